//! Triangle meshes in world space.

use super::SurfacePoint;
use glam::Vec3;

/// Triangles with optional vertex normals.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, as many as positions, or empty for flat shading.
    pub normals: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Corners of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)))
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// The surface at barycentrics `u` (of the second vertex) and `v` (of the third).
    #[inline]
    pub fn surface(&self, _triangle: u32, _u: f32, _v: f32) -> SurfacePoint {
        todo!()
    }
}
