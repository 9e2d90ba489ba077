//! Ray against triangle: the signed volumes between the ray and the edges (Plücker coordinates), with
//! vertices relative to the origin, in f64, and closed by a bound of their rounding error, so that no
//! triangle is missed which the exact ray meets: meshes are watertight, at edges and vertices too.

use crate::geometry::Ray;
use glam::{DVec3, Vec3};

/// A ray as the triangle test wants it.
pub(super) struct Query {
    origin: DVec3,
    direction: DVec3,
    /// `EDGE_ERROR` times the largest component of the direction.
    tolerance: f64,
}

/// An edge function is `d . ((b - a) x (b + a))`. Each of its six products of three factors is rounded
/// at most seven times on its way to the sum (two differences of vertices and origin, one of vertices,
/// their sum, the product, the difference of products, the product with `d`) and three times in the
/// sum: 6 * 10 roundoffs of 2^-53, each against the largest components of the factors; 2^6 bounds 60.
const EDGE_ERROR: f64 = 64.0 / (1u64 << 53) as f64;

impl Query {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Query {
        let direction = ray.direction.as_dvec3();
        Query { origin: ray.origin.as_dvec3(), direction, tolerance: EDGE_ERROR * direction.abs().max_element() }
    }

    /// `(t, u, v)` of the crossing, if `0 < t <= t_max`. A ray in the triangle's plane does not cross it.
    #[inline]
    pub(super) fn triangle(&self, corners: &[Vec3; 3], t_max: f32) -> Option<(f32, f32, f32)> {
        let [p0, p1, p2] = corners.map(|p| p.as_dvec3());
        let [a, b, c] = [p0 - self.origin, p1 - self.origin, p2 - self.origin];
        let (ab, bc, ca) = (p1 - p0, p2 - p1, p0 - p2);
        let w0 = self.direction.dot(bc.cross(c + b));
        let w1 = self.direction.dot(ca.cross(a + c));
        let w2 = self.direction.dot(ab.cross(b + a));
        let (lo, hi) = (w0.min(w1).min(w2), w0.max(w1).max(w2));
        if lo < 0.0 && hi > 0.0 {
            let edge = ab.abs().max(bc.abs()).max(ca.abs()).max_element();
            let sum = 2.0 * a.abs().max(b.abs()).max(c.abs()).max_element();
            let tolerance = self.tolerance * edge * sum;
            if lo < -tolerance && hi > tolerance {
                return None;
            }
        }
        let normal = ab.cross(bc);
        let (distance, approach) = (a.dot(normal), self.direction.dot(normal));
        let total = w0 + w1 + w2;
        if approach == 0.0 || total == 0.0 {
            return None;
        }
        let t = distance / approach;
        if t > 0.0 && t <= t_max as f64 {
            let bary = |w: f64| (w / total).clamp(0.0, 1.0) as f32;
            Some((t as f32, bary(w1), bary(w2)))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> Ray {
        Ray { origin, direction, t_max }
    }

    #[test]
    fn barycentrics_and_distance_are_those_of_the_point_aimed_at() {
        let corners = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 0.0, 3.0)];
        for (u, v) in [(0.25f32, 0.25f32), (0.5, 0.125), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5)] {
            let aim = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
            for origin in [Vec3::ZERO, Vec3::new(4.0, 5.0, 6.0)] {
                let query = Query::new(&ray(origin, (aim - origin) * 0.5, 2.0));
                let (t, hu, hv) = query.triangle(&corners, 2.0).expect("a hit from either side");
                assert!((t - 2.0).abs() < 1e-6 && (hu - u).abs() < 1e-6 && (hv - v).abs() < 1e-6);
                assert!(query.triangle(&corners, 1.999).is_none(), "beyond t_max");
            }
            assert!(Query::new(&ray(Vec3::ZERO, -aim, 9.0)).triangle(&corners, 9.0).is_none(), "behind");
        }
    }

    #[test]
    fn a_ray_in_the_plane_misses() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let query = Query::new(&ray(Vec3::new(-1.0, 0.25, 0.0), Vec3::X, 9.0));
        assert!(query.triangle(&corners, 9.0).is_none());
    }
}
