//! Ray queries. A backend answers two questions about a set of shapes and knows nothing else of the
//! scene; a hit is plain data, and normals and derivatives come from [`crate::geometry`] for every
//! backend alike, so that backends can be compared ray by ray.

mod bounds;
pub mod compare;
#[cfg(feature = "embree")]
pub mod embree;
pub mod obvhs;
mod wide;

#[cfg(test)]
mod tests;

pub(crate) use bounds::Bounds;
pub use compare::{Comparison, compare};
pub(crate) use wide::Wide;

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

/// What transport needs of a ray tracer. Queries look at `0 < t <= t_max`; where a ray may start on
/// a surface is the caller's matter (see [`crate::geometry::ray`]). Both sides of a surface are hit; a
/// ray in the plane of a triangle does not meet it.
pub trait Intersector: Send + Sync {
    /// The nearest hit.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything is hit.
    fn occluded(&self, ray: &Ray) -> bool;
    /// Name and version, as shown to people.
    fn describe(&self) -> String;
    /// Bytes held by the acceleration structure, where the backend knows.
    fn memory(&self) -> u64;
    /// The same ray tracer over other shapes, [editable](Build::Editable), which keeps what it has of meshes that are among
    /// them, too; none if it keeps nothing.
    #[allow(unused_variables)]
    fn rebuilt(&self, shapes: &[Shape], threads: usize) -> Option<Result<Box<dyn Intersector>, BackendError>> {
        None
    }
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

/// What a ray tracer is built for. Where two triangles are hit at once, at an edge, either may be told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Build {
    /// Fast queries: all in one hierarchy.
    #[default]
    Static,
    /// Fast changes: Embree builds each large mesh for itself, and keeps it while it stays where it is. obvhs does not.
    Editable,
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
    /// The memory does not suffice.
    #[error("{backend}: {message}")]
    OutOfMemory {
        /// Its name.
        backend: &'static str,
        /// Its words.
        message: String,
    },
    /// The backend refused or failed.
    #[error("{backend}: {message}")]
    Failed {
        /// Its name.
        backend: &'static str,
        /// Its words.
        message: String,
    },
}

fn failed(backend: &'static str, message: String) -> BackendError {
    BackendError::Failed { backend, message }
}

/// Primitives a backend takes: they and twice as many nodes are numbered in 32 bits.
const MAX_PRIMITIVES: u64 = 1 << 30;

/// Coordinates beyond this make Embree drop a triangle without an error.
pub(crate) const MAX_COORDINATE: f32 = 1e18;

/// The number of primitives, once it is sure that no backend will read out of bounds, drop a primitive
/// in silence or count past 32 bits. Scenes are validated with better words before they come here.
fn check(shapes: &[Shape]) -> Result<usize, BackendError> {
    let refuse = |message: String| Err(failed("intersect", message));
    let count = |s: &Shape| match s {
        Shape::Mesh(mesh) => mesh.triangles.len().max(mesh.positions.len()) as u64,
        Shape::Sphere(_) => 1,
    };
    check_count(shapes.iter().map(count)).map_err(|message| failed("intersect", message))?;
    let bad = |p: &glam::Vec3| !p.abs().cmple(glam::Vec3::splat(MAX_COORDINATE)).all();
    let mut primitives = 0;
    for (i, shape) in shapes.iter().enumerate() {
        match shape {
            Shape::Mesh(mesh) => {
                primitives += mesh.triangles.len();
                let n = mesh.positions.len() as u32;
                if let Some(t) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v >= n)) {
                    return refuse(format!("shape {i}, triangle {t}: a vertex index is not below {n}"));
                }
                if let Some(v) = mesh.positions.iter().position(bad) {
                    return refuse(format!("shape {i}, vertex {v}: {} is out of range", mesh.positions[v]));
                }
            }
            Shape::Sphere(s) => {
                primitives += 1;
                if bad(&s.center) || !(s.radius > 0.0 && s.radius <= MAX_COORDINATE) {
                    return refuse(format!("shape {i}: sphere at {} of radius {}", s.center, s.radius));
                }
            }
        }
    }
    Ok(primitives)
}

/// Whether shapes of so many primitives or vertices are not too many together, before any is made.
pub(crate) fn check_count(counts: impl Iterator<Item = u64>) -> Result<(), String> {
    let total = counts.fold(0u64, u64::saturating_add);
    if total > MAX_PRIMITIVES {
        return Err(format!("{total} primitives or vertices; at most {MAX_PRIMITIVES} are taken"));
    }
    Ok(())
}

/// Builds the acceleration structure over `shapes`, with at most `threads` threads (obvhs uses the
/// caller's alone).
#[cfg_attr(not(feature = "embree"), allow(unused_variables))]
pub fn build(
    backend: Backend,
    shapes: &[Shape],
    build: Build,
    threads: usize,
) -> Result<Box<dyn Intersector>, BackendError> {
    match backend {
        #[cfg(feature = "embree")]
        Backend::Embree => Ok(Box::new(embree::Embree::build(shapes, build, threads)?)),
        #[cfg(not(feature = "embree"))]
        Backend::Embree => Err(BackendError::Missing("embree")),
        Backend::Obvhs => Ok(Box::new(obvhs::Obvhs::build(shapes, threads)?)),
    }
}
