//! Light-emitting meshes.

use super::surface::SurfaceEmission;
use crate::geometry::{Mesh, SurfacePoint};
use crate::math::{Discrete, warp};
use glam::Vec2;

/// A mesh, sampled uniformly by area for emission and for next-event estimation alike.
#[derive(Clone, Debug)]
pub(super) struct MeshLight {
    pub(super) shape: u32,
    pub(super) emission: SurfaceEmission,
    /// Chooses a triangle by its area; one without area has probability 0.
    triangles: Discrete,
}

impl MeshLight {
    /// `None` if the mesh has no area.
    pub(super) fn new(shape: u32, mesh: &Mesh, emission: SurfaceEmission) -> Option<MeshLight> {
        let areas = (0..mesh.triangles.len() as u32).map(|t| {
            let [a, b, c] = mesh.corners(t).map(|p| p.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        });
        Some(MeshLight { shape, emission, triangles: Discrete::new(areas)? })
    }

    /// Square metres, one side.
    #[inline]
    pub(super) fn area(&self) -> f64 {
        self.triangles.total()
    }

    /// A point with density `1/area`.
    #[inline]
    pub(super) fn sample_point(&self, mesh: &Mesh, mut u: Vec2) -> SurfacePoint {
        let (triangle, rest) = self.triangles.sample_reuse(u.x);
        u.x = rest;
        let b = warp::triangle(u);
        SurfacePoint { shape: self.shape, ..mesh.surface(triangle as u32, b.x, b.y) }
    }
}
