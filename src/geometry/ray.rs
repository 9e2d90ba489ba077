//! Rays, and where they may start: the offset comes from the rounding error of the point, never from
//! a global epsilon (Pharr, Jakob, Humphreys 2023, §6.8).

use super::SurfacePoint;
use super::surface::ROUNDOFF;
use glam::Vec3;

/// Unit direction and squared length of the segment from `p` to `q`. Exactly antisymmetric: both ends
/// of a connection see the same direction, bit for bit, up to its sign.
#[inline]
pub fn segment(p: Vec3, q: Vec3) -> (Vec3, f64) {
    let d = q.as_dvec3() - p.as_dvec3();
    let length_squared = d.length_squared();
    ((d / length_squared.sqrt()).as_vec3(), length_squared)
}

/// A half-line or segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Direction; any length but zero.
    pub direction: Vec3,
    /// End of the segment, in units of the direction's length; infinity for a half-line.
    pub t_max: f32,
}

impl Ray {
    /// The half-line that leaves `from` along `direction`.
    #[inline]
    pub fn leaving(from: &SurfacePoint, direction: Vec3) -> Ray {
        Ray { origin: from.offset(direction), direction, t_max: f32::INFINITY }
    }

    /// The open segment between two surface points, each end moved off its own surface toward the
    /// other, so that neither is its own occluder.
    #[inline]
    pub fn between(from: &SurfacePoint, to: &SurfacePoint) -> Ray {
        let d = to.p - from.p;
        let end = to.offset_from(-d);
        // By the side of the moved end: where `d` grazes the surface it may be the other one.
        let origin = from.offset(end - from.p);
        Ray { origin, direction: end - origin, t_max: 1.0 }
    }

    /// The open segment from a surface point to a point in space, which may lie in a surface: that is not in the way,
    /// wherever rounding puts it: within four roundings of the ray's length, two more than the difference and the quotient
    /// that make its distance have.
    #[inline]
    pub fn to_point(from: &SurfacePoint, to: Vec3) -> Ray {
        let origin = from.offset(to - from.p);
        Ray { origin, direction: to - origin, t_max: 1.0 - 4.0 * ROUNDOFF }
    }
}
