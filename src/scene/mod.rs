//! From what a host says ([`description`]) to what is rendered ([`World`]).

pub mod description;
mod fingerprint;
pub mod glass;
pub mod media;
mod place;
mod rebase;
mod textured;
mod validate;
pub mod world;

use crate::text::shown;
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
    /// Nothing to render.
    #[error("the scene has no {0}")]
    Empty(&'static str),
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

/// How messages name an object; of the environment there is one.
fn object(kind: &str, index: usize, name: &str) -> String {
    if kind == "environment" { kind.to_owned() } else { format!("{kind} {index} '{}'", shown(name)) }
}
