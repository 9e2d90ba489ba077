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
    pub fn surface(&self, triangle: u32, u: f32, v: f32) -> SurfacePoint {
        let [a, b, c] = self.corners(triangle);
        let ng = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or_zero().as_vec3();
        let ns = match self.normals[..] {
            [] => ng,
            _ => {
                let [na, nb, nc] = self.triangles[triangle as usize].map(|i| self.normals[i as usize]);
                let n = (na * (1.0 - u - v) + nb * u + nc * v).normalize_or(ng);
                if n.dot(ng) > 0.0 { n } else { ng }
            }
        };
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        let p = a * (1.0 - u - v) + b * u + c * v;
        SurfacePoint { p, ng, ns, offset: 8.0 * f32::EPSILON * largest, shape: 0, primitive: triangle }
    }
}
