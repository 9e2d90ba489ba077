//! Surfaces to first order, in f64: what a manifold walk and a ray differential need of a point.
//!
//! Positions are relative to an origin of the caller's choice, subtracted from the f32 data before
//! anything is computed: differences of f32 numbers are exact or nearly so in f64, so that no digits
//! are lost far from the world's origin.

use super::{Mesh, Sphere};
use glam::DVec3;

/// Twice the area of a triangle, over its longest edge squared, below which it counts as degenerate.
const DEGENERATE: f64 = 1e-12;

/// Length of an interpolated normal below which its direction is rounding error of the vertex normals.
const CANCELLED: f64 = 1e-6;

/// A surface to first order around one of its points.
///
/// `p_u` and `p_v` are orthonormal tangents of the true surface, so that steps along them are
/// lengths and determinants are ratios of areas; texture coordinates play no part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Differential {
    /// Position, metres, relative to the caller's origin.
    pub p: DVec3,
    /// Geometric unit normal, to the front.
    pub ng: DVec3,
    /// Shading unit normal, in the hemisphere of `ng`.
    pub ns: DVec3,
    /// First unit tangent.
    pub p_u: DVec3,
    /// Second unit tangent, perpendicular to the first.
    pub p_v: DVec3,
    /// Derivative of `ns` along `p_u`, per metre.
    pub n_u: DVec3,
    /// Derivative of `ns` along `p_v`, per metre.
    pub n_v: DVec3,
    /// Index of the triangle; 0 on a sphere.
    pub primitive: u32,
}

impl Differential {
    /// The plane through the origin with normal z.
    pub const FLAT: Differential = Differential {
        p: DVec3::ZERO,
        ng: DVec3::Z,
        ns: DVec3::Z,
        p_u: DVec3::X,
        p_v: DVec3::Y,
        n_u: DVec3::ZERO,
        n_v: DVec3::ZERO,
        primitive: 0,
    };
}

/// Two unit vectors that complete the unit vector `n` to a right-handed orthonormal frame (Duff et al.
/// 2017, "Building an orthonormal basis, revisited").
#[inline]
pub fn tangents(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// A sphere in f64.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Centre, relative to the caller's origin.
    pub center: DVec3,
    /// Radius.
    pub radius: f64,
}

impl Ball {
    /// The surface at a unit direction from the centre.
    #[inline]
    pub fn at(&self, n: DVec3) -> Differential {
        let (p_u, p_v) = tangents(n);
        let curvature = 1.0 / self.radius;
        Differential {
            p: self.center + n * self.radius,
            ng: n,
            ns: n,
            p_u,
            p_v,
            n_u: p_u * curvature,
            n_v: p_v * curvature,
            primitive: 0,
        }
    }

    /// Distance to the first crossing ahead of `o` along the unit direction `d`, and the surface there.
    /// A ray that is `leaving` starts on the sphere: it can only meet the far side.
    #[inline]
    pub fn meet(&self, o: DVec3, d: DVec3, leaving: bool) -> Option<(f64, Differential)> {
        let f = o - self.center;
        let b = f.dot(d);
        if leaving && b >= 0.0 {
            return None;
        }
        // As in `Sphere::crossings`: from the distance between line and centre, and the smaller root
        // from the product of both.
        let r2 = self.radius * self.radius;
        let h2 = r2 - (f - d * b).length_squared();
        if !(h2 > 0.0) {
            return None;
        }
        let q = -(b + h2.sqrt().copysign(b));
        let (t0, t1) = (q, (f.length_squared() - r2) / q);
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        let t = if near > 0.0 && !leaving { near } else { far };
        if !(t > 0.0) {
            return None;
        }
        let n = (f + d * t).normalize();
        n.is_finite().then(|| (t, self.at(n)))
    }
}

/// A triangle in f64.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Corners, counter-clockwise seen from the front, relative to the caller's origin.
    pub corners: [DVec3; 3],
    /// Unit normals at the corners; `None` for flat shading.
    pub normals: Option<[DVec3; 3]>,
    /// Index of the triangle.
    pub primitive: u32,
}

impl Facet {
    /// Distance `t` and barycentrics `u`, `v` (of the second and third corner) at which the line from
    /// `o` along `d` meets the triangle's plane, inside the triangle or not. `None` for a line in the
    /// plane.
    #[inline]
    pub fn crossing(&self, o: DVec3, d: DVec3) -> Option<(f64, f64, f64)> {
        let [p0, p1, p2] = self.corners;
        let (e1, e2) = (p1 - p0, p2 - p0);
        let m = e1.cross(e2);
        let approach = d.dot(m);
        let t = (p0 - o).dot(m) / approach;
        // From the corner, where the products are small, not from the ray's origin.
        let q = (o - p0) + d * t;
        let inverse = 1.0 / m.length_squared();
        let (u, v) = (q.cross(e2).dot(m) * inverse, e1.cross(q).dot(m) * inverse);
        (t.is_finite() && u.is_finite() && v.is_finite()).then_some((t, u, v))
    }

    /// The surface at barycentrics `u`, `v`; `None` where the triangle has no area or the vertex
    /// normals cancel.
    ///
    /// With vertex normals, `ns = m/|m|` of the interpolated `m`, and its derivatives along the edges
    /// are carried through the orthonormalisation of the edges themselves.
    #[inline]
    pub fn at(&self, u: f64, v: f64) -> Option<Differential> {
        let [p0, p1, p2] = self.corners;
        let (e1, e2) = (p1 - p0, p2 - p0);
        let m = e1.cross(e2);
        let twice_area = m.length();
        let longest = e1.length_squared().max(e2.length_squared()).max((e2 - e1).length_squared());
        if !(twice_area > DEGENERATE * longest) {
            return None;
        }
        let ng = m / twice_area;
        let along = 1.0 / e1.length();
        let p_u = e1 * along;
        let p_v = ng.cross(p_u);
        let flat = Differential {
            p: p0 + e1 * u + e2 * v,
            ng,
            ns: ng,
            p_u,
            p_v,
            n_u: DVec3::ZERO,
            n_v: DVec3::ZERO,
            primitive: self.primitive,
        };
        let Some([n0, n1, n2]) = self.normals else { return Some(flat) };
        let sum = n0 * (1.0 - u - v) + n1 * u + n2 * v;
        let length = sum.length();
        if !(length > CANCELLED) {
            return None;
        }
        // A normal to the back is reversed, with its derivatives.
        let scale = 1.0f64.copysign(sum.dot(ng)) / length;
        let ns = sum * scale;
        let derivative = |d: DVec3| (d - ns * ns.dot(d)) * scale;
        let n_u = derivative(n1 - n0) * along;
        // e2 = x p_u + y p_v: the second edge's derivative holds x times the first tangent's.
        let (x, y) = (e2.dot(p_u), twice_area * along);
        let n_v = (derivative(n2 - n0) - n_u * x) / y;
        Some(Differential { ns, n_u, n_v, ..flat })
    }
}

impl Sphere {
    /// The sphere in f64, relative to `origin` (world space).
    #[inline]
    pub fn local(&self, origin: DVec3) -> Ball {
        Ball { center: self.center.as_dvec3() - origin, radius: self.radius as f64 }
    }
}

impl Mesh {
    /// A triangle in f64, relative to `origin` (world space).
    #[inline]
    pub fn local(&self, triangle: u32, origin: DVec3) -> Facet {
        let corners = self.triangles[triangle as usize];
        let normals = (!self.normals.is_empty()).then(|| corners.map(|i| self.normals[i as usize].as_dvec3()));
        Facet { corners: corners.map(|i| self.positions[i as usize].as_dvec3() - origin), normals, primitive: triangle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_facet_is_the_mesh_surface() {
        let positions = vec![Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 2.5, 3.0), Vec3::new(1.5, 3.0, 4.0)];
        for sign in [1.0, -1.0] {
            // The second time all vertex normals point to the back.
            let normals = [Vec3::new(0.4, -0.8, 0.5), Vec3::new(0.5, -0.7, 0.4), Vec3::new(0.3, -0.6, 0.6)];
            let normals = normals.map(|n| n.normalize() * sign).to_vec();
            for normals in [normals, vec![]] {
                let mesh = Mesh { positions: positions.clone(), normals, triangles: vec![[0, 1, 2]] };
                let origin = DVec3::new(1.0, 1.0, 1.0);
                let facet = mesh.local(0, origin);
                let (at, surface) = (facet.at(0.25, 0.5).unwrap(), mesh.surface(0, 0.25, 0.5));
                assert!((at.p + origin).distance(surface.p.as_dvec3()) < 1e-6);
                assert!(at.ng.distance(surface.ng.as_dvec3()) < 1e-6);
                assert!(at.ns.distance(surface.ns.as_dvec3()) < 1e-6);
                assert!(at.p_u.cross(at.p_v).distance(at.ng) < 1e-15);
                let o = DVec3::new(3.0, -1.0, 2.0);
                let d = (at.p - o).normalize();
                let (t, u, v) = facet.crossing(o, d).unwrap();
                assert!((t - o.distance(at.p)).abs() < 1e-14 && (u - 0.25).abs() < 1e-14 && (v - 0.5).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn derivatives_of_the_normal_are_those_of_differences() {
        let corners = [DVec3::new(0.0, 0.1, 0.2), DVec3::new(1.0, 0.3, 0.0), DVec3::new(0.8, 1.2, 0.3)];
        let normals = [DVec3::new(-0.3, 0.1, 1.0), DVec3::new(0.2, 0.1, 1.0), DVec3::new(0.1, 0.4, 1.0)];
        for sign in [1.0, -1.0] {
            let normals = Some(normals.map(|n| n.normalize() * sign));
            let facet = Facet { corners, normals, primitive: 0 };
            let at = facet.at(0.3, 0.4).unwrap();
            for (tangent, derivative) in [(at.p_u, at.n_u), (at.p_v, at.n_v)] {
                let normal = |h: f64| {
                    let (_, u, v) = facet.crossing(at.p + tangent * h + at.ng, -at.ng).unwrap();
                    facet.at(u, v).unwrap().ns
                };
                let difference = (normal(1e-5) - normal(-1e-5)) / 2e-5;
                assert!(difference.distance(derivative) < 1e-9, "{difference} {derivative}");
            }
        }
    }

    #[test]
    fn a_ray_that_leaves_a_ball_meets_its_far_side_only() {
        let ball = Ball { center: DVec3::Z * 3.0, radius: 1.0 };
        let meet = |o: DVec3, d: DVec3, leaving| ball.meet(o, d, leaving).map(|(t, _)| t);
        assert_eq!(meet(DVec3::ZERO, DVec3::Z, false), Some(2.0));
        assert_eq!(meet(DVec3::Z * 2.0, DVec3::Z, true), Some(2.0));
        assert_eq!(meet(DVec3::Z * 3.0, DVec3::Z, false), Some(1.0));
        assert_eq!(meet(DVec3::Z * 2.0, DVec3::NEG_Z, true), None);
        assert_eq!(meet(DVec3::Z * 5.0, DVec3::Z, false), None);
        assert_eq!(meet(DVec3::X * 1.5, DVec3::Z, false), None);
    }
}
