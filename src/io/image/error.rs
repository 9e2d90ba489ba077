//! Why an image file could not be written or read.

use std::path::{Path, PathBuf};

/// Each names the file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The request cannot be met: the extension, an option, the size of the image.
    #[error("{}: {reason}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what would do.
        reason: String,
    },
    /// The operating system refuses.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// A verb.
        action: &'static str,
        /// Its reason.
        source: std::io::Error,
    },
    /// The file is damaged, or an encoder failed.
    #[error("{}: {reason}", path.display())]
    Codec {
        /// The file.
        path: PathBuf,
        /// The library's reason.
        reason: String,
    },
    /// OpenImageIO is needed and not there.
    #[error("{}: needs OpenImageIO, which is not there: {reason}", path.display())]
    Module {
        /// The file.
        path: PathBuf,
        /// What was tried.
        reason: String,
    },
    /// No room for the samples.
    #[error("{}: not enough memory", path.display())]
    OutOfMemory {
        /// The file.
        path: PathBuf,
    },
}

/// An [`ImageError`] that does not know its file yet.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    /// See [`ImageError::Unsupported`].
    #[error("{0}")]
    Unsupported(String),
    /// See [`ImageError::Codec`].
    #[error("{0}")]
    Codec(String),
    /// See [`ImageError::Module`].
    #[error("{0}")]
    Module(String),
    /// See [`ImageError::OutOfMemory`].
    #[error("not enough memory")]
    OutOfMemory,
}

impl Failure {
    /// Names the file.
    pub(super) fn at(self, path: &Path) -> ImageError {
        let path = path.to_owned();
        match self {
            Failure::Unsupported(reason) => ImageError::Unsupported { path, reason },
            Failure::Codec(reason) => ImageError::Codec { path, reason },
            Failure::Module(reason) => ImageError::Module { path, reason },
            Failure::OutOfMemory => ImageError::OutOfMemory { path },
        }
    }
}
