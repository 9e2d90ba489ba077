//! Triangle meshes in world space.

use super::enclosure::is_sealed;
use super::surface::{ROUNDOFF, position_error};
use super::{Enclosure, Ray, SurfacePoint};
use glam::{DVec3, Vec2, Vec3};

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

    /// Area of a triangle in square metres, computed in f64.
    pub fn area(&self, triangle: u32) -> f32 {
        let [p0, p1, p2] = self.corners(triangle).map(|p| p.as_dvec3());
        (0.5 * (p1 - p0).cross(p2 - p0).length()) as f32
    }

    /// Unit normal of a triangle by its winding, if it has an area.
    pub fn normal(&self, triangle: u32) -> Option<DVec3> {
        let [p0, p1, p2] = self.corners(triangle).map(|p| p.as_dvec3());
        (p1 - p0).cross(p2 - p0).try_normalize()
    }

    /// What it encloses.
    pub fn enclosure(&self) -> Enclosure {
        Enclosure::of(&self.triangles, |i| self.positions[i as usize].as_dvec3())
    }

    /// See [`is_sealed`].
    pub fn is_sealed(&self) -> bool {
        is_sealed(&self.triangles, |i| self.positions[i as usize].as_dvec3())
    }

    /// What stands at the vertices, at a point of a triangle.
    #[inline]
    pub fn interpolate(&self, at: &SurfacePoint, values: &[[f32; 2]]) -> Vec2 {
        let corners = self.triangles[at.primitive as usize];
        let [p0, p1, p2] = corners.map(|i| self.positions[i as usize].as_dvec3());
        let (e1, e2, d) = (p1 - p0, p2 - p0, at.p.as_dvec3() - p0);
        let m = e1.cross(e2);
        let scale = m.length_squared().recip();
        // Without an area it is its first corner. Rounding may have put the point outside.
        let inside = |x: f64, most: f64| if x > 0.0 { x.min(most) } else { 0.0 };
        let u = inside(d.cross(e2).dot(m) * scale, 1.0);
        let v = inside(e1.cross(d).dot(m) * scale, 1.0 - u);
        let [a, b, c] = corners.map(|i| Vec2::from(values[i as usize]).as_dvec2());
        (a + (b - a) * u + (c - a) * v).as_vec2()
    }

    /// Directions in which the first and the second of what `at` tells of the vertices grow, over the plane of a triangle; `None`
    /// where they grow in one or none.
    #[inline]
    pub fn gradients(&self, triangle: u32, at: impl Fn(usize) -> Vec2) -> Option<[Vec3; 2]> {
        let corners = self.triangles[triangle as usize].map(|i| i as usize);
        let [p0, p1, p2] = corners.map(|i| self.positions[i].as_dvec3());
        let [a, b, c] = corners.map(|i| at(i).as_dvec2());
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, b - a, c - a);
        let sign = d1.perp_dot(d2).signum();
        let along = |x: f64, y: f64| ((e1 * x + e2 * y) * sign).try_normalize().map(|d| d.as_vec3());
        Some([along(d2.y, -d1.y)?, along(-d2.x, d1.x)?])
    }

    /// The surface at barycentrics `u` (of the second vertex) and `v` (of the third). The caller
    /// fills in `shape`, which a mesh does not know.
    ///
    /// Position and normal are computed in f64, where vertex differences are exact, and rounded once.
    /// An interpolated normal on the back of the triangle is reversed, so that `ns` stays in the
    /// hemisphere of `ng`; where interpolation leaves no direction, `ns = ng`.
    #[inline]
    pub fn surface(&self, triangle: u32, u: f32, v: f32) -> SurfacePoint {
        self.surface_at(triangle, |_| (u.into(), v.into()))
    }

    /// The surface where `ray` meets a triangle, near barycentrics `u` and `v`: the crossing is computed anew in f64, since
    /// barycentrics in f32 move it by roundings of the triangle's size, which may be more than what stands on it.
    #[inline]
    pub fn surface_along(&self, ray: &Ray, triangle: u32, u: f32, v: f32) -> SurfacePoint {
        /// Far above the rounding of f32 but for needles and grazing rays, whose hits stay as the ray tracer has them.
        const NEAR: f64 = 1e-3;
        self.surface_at(triangle, |[p0, e1, e2, m]| {
            let near = (f64::from(u), f64::from(v));
            let d = ray.direction.as_dvec3();
            let c = (ray.origin.as_dvec3() - p0).cross(d);
            let scale = -1.0 / d.dot(m);
            let (u, v) = (e2.dot(c) * scale, -e1.dot(c) * scale);
            let close = (u - near.0).abs() < NEAR && (v - near.1).abs() < NEAR;
            if !close {
                return near;
            }
            // Rounding may have put a hit of the edge outside.
            let u = u.clamp(0.0, 1.0);
            (u, v.clamp(0.0, 1.0 - u))
        })
    }

    /// At barycentrics that the first corner, the two edges from it and their cross product may tell.
    #[inline]
    fn surface_at(&self, triangle: u32, barycentrics: impl FnOnce([DVec3; 4]) -> (f64, f64)) -> SurfacePoint {
        let corners = self.triangles[triangle as usize];
        let [p0, p1, p2] = corners.map(|i| self.positions[i as usize].as_dvec3());
        let (e1, e2) = (p1 - p0, p2 - p0);
        let m = e1.cross(e2);
        let (u, v) = barycentrics([p0, e1, e2, m]);
        let p = (p0 + e1 * u + e2 * v).as_vec3();
        let (u, v) = (u as f32, v as f32);
        let twice_area = m.length();
        // A triangle without area is never hit nor sampled; any unit vector keeps the numbers finite.
        let ng = if twice_area > 0.0 { (m / twice_area).as_vec3() } else { Vec3::Z };
        let ns = if self.normals.is_empty() {
            ng
        } else {
            let [n0, n1, n2] = corners.map(|i| self.normals[i as usize]);
            shading_normal(n0 * (1.0 - u - v) + n1 * u + n2 * v, ng)
        };
        let PlaneError { nearby, per_length } = PlaneError::of(e1, e2, m / twice_area, twice_area);
        SurfacePoint {
            p,
            ng,
            ns,
            offset: position_error(p, ng) + nearby,
            offset_per_length: per_length,
            shape: 0,
            primitive: triangle,
        }
    }
}

#[inline]
fn shading_normal(interpolated: Vec3, ng: Vec3) -> Vec3 {
    match interpolated.try_normalize() {
        Some(n) if n.dot(ng) < 0.0 => -n,
        Some(n) => n,
        None => ng,
    }
}

/// How far from the true plane a single-precision intersection test may see it.
struct PlaneError {
    /// From within the triangle's box.
    nearby: f32,
    /// Per unit of the distance to the ray's origin.
    per_length: f32,
}

impl PlaneError {
    /// With `r = ROUNDOFF` and all vertices within `d` of the origin, rounding them relative to the
    /// origin moves the plane by at most `r d` at a point inside the triangle (a convex combination of the
    /// three errors); the edges' difference, the products and the difference of a cross product of edges
    /// `a`, `b` err by `5 r |a||b|` against its length, twice the area, and the dot product that gives the
    /// distance by `3 r`. So `r d (4 + 5 |a||b| / 2A)`, with the two shorter edges, from which Embree forms
    /// the normal. The last factor is the triangle's condition: 1 to 2 for common shapes, large for flat
    /// ones; it is capped where the offset would reach 1/64 of the triangle's size.
    ///
    /// Nearby, component by component: `d` is the side of the triangle's box, `|n|` seen along the normal, and `|a||b|`
    /// the sum of two products. A floor that is level has no error however large it is, and would else pass for as thick as
    /// what stands on it.
    #[inline]
    fn of(e1: DVec3, e2: DVec3, normal: DVec3, twice_area: f64) -> PlaneError {
        const CAP: f64 = 1.0 / 64.0;
        let r = f64::from(ROUNDOFF);
        let e3 = e2 - e1;
        let (l1, l2, l3) = (e1.length_squared(), e2.length_squared(), e3.length_squared());
        let longest = l1.max(l2).max(l3);
        let condition = (l1 * l2 * l3 / longest).sqrt() / twice_area;
        // min() also turns the 0/0 of a point-like triangle into the cap.
        let per_length = (r * (4.0 + 5.0 * condition)).min(CAP);
        let longest_edge = longest.sqrt();

        let (a, b) = match () {
            _ if l3 == longest => (e1, e2),
            _ if l2 == longest => (e1, e3),
            _ => (e2, e3),
        };
        let (a, b) = (a.abs(), b.abs());
        let products = DVec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
        let sides = DVec3::ZERO.max(e1).max(e2) - DVec3::ZERO.min(e1).min(e2);
        let nearby = r * (4.0 * normal.abs() + 5.0 / twice_area * products).dot(sides);
        PlaneError {
            // Where arithmetic is exact, a ray must still not start on the plane.
            nearby: nearby.min(per_length * longest_edge).max(r * r * longest_edge) as f32,
            per_length: per_length as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(p: [Vec3; 3], n: [Vec3; 3]) -> Mesh {
        Mesh { positions: p.to_vec(), normals: n.to_vec(), triangles: vec![[0, 1, 2]] }
    }

    #[test]
    fn the_normal_faces_the_side_of_counter_clockwise_order_and_barycentrics_name_the_vertices() {
        let mesh = triangle([Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::Z; 3]);
        let s = mesh.surface(0, 0.25, 0.5);
        assert_eq!((s.p, s.ng, s.ns), (Vec3::new(0.25, 0.5, 0.0), Vec3::Z, Vec3::Z));
        assert_eq!(mesh.area(0), 0.5);
    }

    #[test]
    fn shading_normals_stay_in_the_hemisphere_of_the_geometric_one() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let back = triangle(corners, [Vec3::NEG_Z; 3]).surface(0, 0.2, 0.2);
        assert_eq!(back.ns, Vec3::Z);
        let cancelling = triangle(corners, [Vec3::X, Vec3::NEG_X, Vec3::Z]).surface(0, 0.5, 0.0);
        assert_eq!(cancelling.ns, Vec3::Z);
        let tilted = triangle(corners, [Vec3::new(0.6, 0.0, 0.8); 3]).surface(0, 0.3, 0.3);
        assert!((tilted.ns - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-6);
    }

    #[test]
    fn a_needle_far_out_keeps_its_normal_and_area() {
        // 1 by 2^-16 at 2^7: single-precision products would lose the short side. Exact answers.
        let h = 2f32.powi(-16);
        let at = Vec3::splat(128.0);
        let mesh = triangle([at, at + Vec3::new(1.0, 1.0, 0.0), at + Vec3::new(0.0, 0.0, h)], [Vec3::Z; 3]);
        let s = Mesh { normals: vec![], ..mesh.clone() }.surface(0, 0.3, 0.3);
        let expected = Vec3::new(1.0, -1.0, 0.0).normalize();
        assert!((s.ng - expected).length() < 1e-7, "{}", s.ng);
        let area = 0.5 * 2f64.sqrt() * h as f64;
        assert!((mesh.area(0) as f64 / area - 1.0).abs() < 1e-7);
    }
}
