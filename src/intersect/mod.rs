//! Ray queries. A backend answers two questions about a set of shapes and knows nothing else of the
//! scene; a hit is plain data, and normals and derivatives come from [`crate::geometry`] for every
//! backend alike, so that backends can be compared ray by ray.

#[cfg(feature = "embree")]
pub mod embree;
pub mod obvhs;

use crate::geometry::{Ray, Shape};

/// The nearest crossing of a ray with a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter along the ray, in units of the direction's length.
    pub t: f32,
    /// Barycentric of the triangle's second vertex; 0 on a sphere.
    pub u: f32,
    /// Barycentric of the triangle's third vertex; 0 on a sphere.
    pub v: f32,
    /// Index of the shape.
    pub shape: u32,
    /// Index of the triangle within its mesh; 0 on a sphere.
    pub primitive: u32,
}

/// What transport needs of a ray tracer. Queries look at `0 <= t <= t_max`; where a ray may start on
/// a surface is the caller's matter (see [`crate::geometry::ray`]).
pub trait Intersector: Send + Sync {
    /// The nearest hit.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything is hit.
    fn occluded(&self, ray: &Ray) -> bool;
    /// Name and version, as shown to people.
    fn describe(&self) -> String;
    /// Bytes held by the acceleration structure, where the backend knows.
    fn memory(&self) -> u64;
}

/// Which ray tracer answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Backend {
    /// Embree 4 (Wald et al. 2014), the fast one.
    Embree,
    /// obvhs: pure Rust, always present; the oracle for Embree.
    Obvhs,
}

impl Default for Backend {
    /// Embree where it is built in.
    fn default() -> Self {
        if cfg!(feature = "embree") { Backend::Embree } else { Backend::Obvhs }
    }
}

/// Why a backend could not be made.
#[derive(Debug, thiserror::Error)]
pub enum BackendError {
    /// Not in this build.
    #[error("the backend '{0}' is not in this build (feature `{0}`)")]
    Missing(&'static str),
    /// The library found at run time is not the one compiled against.
    #[error("{0}")]
    Incompatible(String),
    /// The backend refused or failed.
    #[error("{backend}: {message}")]
    Failed {
        /// Its name.
        backend: &'static str,
        /// Its words.
        message: String,
    },
}

/// Builds the acceleration structure over `shapes`, with at most `threads` threads.
pub fn build(backend: Backend, shapes: &[Shape], threads: usize) -> Result<Box<dyn Intersector>, BackendError> {
    match backend {
        #[cfg(feature = "embree")]
        Backend::Embree => Ok(Box::new(embree::Embree::build(shapes, threads)?)),
        #[cfg(not(feature = "embree"))]
        Backend::Embree => Err(BackendError::Missing("embree")),
        Backend::Obvhs => Ok(Box::new(obvhs::Obvhs::build(shapes, threads)?)),
    }
}
