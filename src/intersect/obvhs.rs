//! The pure Rust backend.

use super::{BackendError, Hit, Intersector};
use crate::geometry::{Ray, Shape};

/// Pure Rust ray queries.
pub struct Obvhs {}

impl Obvhs {
    /// Builds.
    pub fn build(_shapes: &[Shape], _threads: usize) -> Result<Obvhs, BackendError> {
        todo!()
    }
}

impl Intersector for Obvhs {
    fn closest(&self, _ray: &Ray) -> Option<Hit> {
        todo!()
    }
    fn occluded(&self, _ray: &Ray) -> bool {
        todo!()
    }
    fn describe(&self) -> String {
        todo!()
    }
    fn memory(&self) -> u64 {
        todo!()
    }
}
