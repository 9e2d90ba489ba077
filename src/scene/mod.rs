//! From what a host says ([`description`]) to what is rendered ([`World`]).

pub mod description;
mod fingerprint;
pub mod glass;
pub mod media;
mod place;
mod rebase;
mod solid;
pub mod spectrum;
mod textured;
mod validate;
pub mod world;

use crate::text::shown;
pub(crate) use validate::{is_invertible, validate_camera};
pub use world::{CommitOptions, World};

/// What is wrong with a description.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A value is out of range.
    #[error("{}: {field} is {value}; {expected}", object(kind, *index, name))]
    Invalid {
        /// "mesh", "material", "instance", "light", "camera", "environment".
        kind: &'static str,
        /// Its index in the description.
        index: usize,
        /// Its name.
        name: String,
        /// The field, with its own index where it is a list: `positions[3].y`.
        field: String,
        /// What was given.
        value: String,
        /// What would do.
        expected: String,
    },
    /// Too large for 32-bit indices.
    #[error("{0}")]
    TooLarge(String),
    /// The memory does not suffice.
    #[error("{0}")]
    OutOfMemory(String),
    /// The ray tracer failed.
    #[error("{0}")]
    Backend(String),
}

/// Worth telling of a scene that is no error.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Index in the description and name of the instance that it is about, if it is about one.
    pub instance: Option<(usize, String)>,
    /// What there is to tell.
    pub text: String,
}

impl Warning {
    pub(crate) fn of(instance: usize, name: &str, text: impl Into<String>) -> Warning {
        Warning { instance: Some((instance, name.to_owned())), text: text.into() }
    }

    /// For who does not know the description: without the index.
    pub fn without_index(&self) -> String {
        match &self.instance {
            Some((_, name)) => format!("instance '{}': {}", shown(name), self.text),
            None => self.text.clone(),
        }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        if let Some((index, name)) = &self.instance {
            write!(f, "{}: ", object("instance", *index, name))?;
        }
        f.write_str(&self.text)
    }
}

/// How messages name an object; of the environment there is one.
fn object(kind: &str, index: usize, name: &str) -> String {
    if kind == "environment" { kind.to_owned() } else { format!("{kind} {index} '{}'", shown(name)) }
}
