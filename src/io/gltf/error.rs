//! What can go wrong, and how the objects of a file are named.

use crate::io::image::ImageError;
use crate::text::{shown, shown_path};
use std::fmt;
use std::path::PathBuf;

/// Why a file was not loaded.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// A file could not be read.
    #[error("{}: {source}", shown_path(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Not glTF, or damaged as a whole.
    #[error("not a readable glTF 2.0 file: {0}")]
    NotGltf(String),
    /// Legal, but beyond this loader.
    #[error("{object}: {} is not supported", shown(feature))]
    Unsupported {
        /// Where.
        object: Box<Object>,
        /// What is asked for.
        feature: String,
    },
    /// A value is against the specification or absurd.
    #[error("{object}: {} is {}; {expected}", shown(field), shown(value))]
    Invalid {
        /// Where.
        object: Box<Object>,
        /// The property, as the file spells it, with its own index where it is a list.
        field: String,
        /// What the file says.
        value: String,
        /// What would do.
        expected: String,
    },
    /// An image that the scene names could not be read.
    #[error("{object}: {}: {source}", shown(field))]
    Image {
        /// Where.
        object: Box<Object>,
        /// The property that names it.
        field: String,
        /// Why not.
        source: ImageError,
    },
    /// The memory does not suffice.
    #[error("{object}: no memory for {count} items")]
    OutOfMemory {
        /// Where.
        object: Box<Object>,
        /// Of a list.
        count: usize,
    },
    /// A mistake of the loader, caught before it harms the host.
    #[error("the glTF loader failed ({0}); please report the file")]
    Internal(String),
}

/// An object of the file, for messages: `node 3 'lamp'`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Object {
    /// "node", "mesh", "accessor", ...
    pub kind: &'static str,
    /// Its index in the file; `None` for what stands once, such as the asset.
    pub index: Option<usize>,
    /// Its name, may be empty.
    pub name: String,
}

impl Object {
    /// `field` of this object holds `value`, which is not `expected`.
    pub(super) fn invalid(&self, field: impl ToString, value: impl ToString, expected: impl ToString) -> GltfError {
        GltfError::Invalid {
            object: Box::new(self.clone()),
            field: field.to_string(),
            value: value.to_string(),
            expected: expected.to_string(),
        }
    }

    /// This object asks for `feature`.
    pub(super) fn unsupported(&self, feature: impl ToString) -> GltfError {
        GltfError::Unsupported { object: Box::new(self.clone()), feature: feature.to_string() }
    }

    /// Its name, or `kind index` where it has none.
    pub(super) fn label(&self) -> String {
        if self.name.is_empty() { self.to_string() } else { self.name.clone() }
    }

    /// `value`, or an error if it is infinite or not a number.
    pub(super) fn finite(&self, field: &str, value: f32) -> Result<f32, GltfError> {
        if value.is_finite() { Ok(value) } else { Err(self.invalid(field, value, "expected a finite number")) }
    }

    /// As [`Self::finite`], for each of a list.
    pub(super) fn all_finite<const N: usize>(&self, field: &str, values: [f32; N]) -> Result<[f32; N], GltfError> {
        for (i, &value) in values.iter().enumerate() {
            self.finite(&format!("{field}[{i}]"), value)?;
        }
        Ok(values)
    }
}

impl fmt::Display for Object {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        if let Some(index) = self.index {
            write!(f, " {index}")?;
        }
        if !self.name.is_empty() {
            write!(f, " '{}'", shown(&self.name))?;
        }
        Ok(())
    }
}
