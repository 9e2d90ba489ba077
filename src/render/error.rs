//! Why a render could not run.

use crate::pool;
use crate::scene::SceneError;

/// Why a render could not run.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A setting is out of its range.
    #[error("{setting} is {value}; {expected}")]
    Setting {
        /// Its name.
        setting: &'static str,
        /// What was given.
        value: String,
        /// What would do.
        expected: String,
    },
    /// The camera of [`super::Settings::view`] cannot be.
    #[error(transparent)]
    View(#[from] SceneError),
    /// The film does not fit into memory.
    #[error("not enough memory for a {width}x{height} film")]
    OutOfMemory {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Nor do the images per technique.
    #[error("not enough memory for the {width}x{height} images of {techniques} techniques")]
    OutOfMemoryForTechniques {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Techniques met so far.
        techniques: usize,
    },
    /// The system gives no more threads.
    #[error("{threads} threads could not be started: {reason}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        reason: String,
    },
    /// A worker panicked: a bug in the renderer.
    #[error("internal error: {0}")]
    Internal(String),
}

impl RenderError {
    pub(super) fn setting<T>(
        setting: &'static str,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Result<T, RenderError> {
        Err(RenderError::Setting { setting, value: value.to_string(), expected: expected.into() })
    }

    pub(super) fn of_workers(threads: usize, failed: pool::Failed) -> RenderError {
        match failed {
            pool::Failed::Threads(reason) => RenderError::Threads { threads, reason },
            pool::Failed::Panic(message) => RenderError::Internal(message),
        }
    }
}
