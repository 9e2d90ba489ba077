//! The committed scene: immutable, shared by renders.

use super::{SceneError, description::Description};
use crate::intersect::Backend;

/// Choices of a commit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommitOptions {
    /// The ray tracer.
    pub backend: Backend,
    /// Threads for the build; 0 for as many as the process may use.
    pub threads: usize,
}

/// A committed scene.
pub struct World {
    /// Things worth telling that are not errors, e.g. degenerate triangles left out.
    pub warnings: Vec<String>,
}

impl World {
    /// Validates and builds.
    pub fn commit(_description: &Description, _options: CommitOptions) -> Result<World, SceneError> {
        todo!()
    }

    /// A hash of all that was committed, for an image's metadata.
    pub fn hash(&self) -> u64 {
        todo!()
    }

    /// Triangles in world space, instances counted as often as they stand.
    pub fn triangle_count(&self) -> u64 {
        todo!()
    }
}
