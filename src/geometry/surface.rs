//! The surface at a hit.

use glam::Vec3;

/// Unit roundoff of f32: the relative error of one rounded operation.
pub(crate) const ROUNDOFF: f32 = f32::EPSILON / 2.0;

/// A point on a surface, with what transport needs to know of the surface there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, world space, metres.
    pub p: Vec3,
    /// Geometric unit normal; the front side is the one from which a triangle's vertices run
    /// counter-clockwise, and the outside of a sphere.
    pub ng: Vec3,
    /// Shading unit normal, in the hemisphere of `ng`.
    pub ns: Vec3,
    /// How far, along `ng`, a ray must start from `p` for its origin to lie on a known side of the
    /// surface despite rounding in `p` and in the intersection test.
    pub offset: f32,
    /// The same for the far end of a ray, per metre of its length: the test rounds vertices relative
    /// to the ray's origin, so that a surface seen from afar is known less well.
    pub offset_per_length: f32,
    /// Index of the shape.
    pub shape: u32,
    /// Index of the triangle; 0 on a sphere.
    pub primitive: u32,
}

impl SurfacePoint {
    /// `p` moved off the surface to the side that `direction` points to.
    #[inline]
    pub fn offset(&self, direction: Vec3) -> Vec3 {
        self.displaced(direction, self.offset)
    }

    /// `p` moved off the surface to the side of a ray's origin, which lies at `p + to_origin`, far
    /// enough that a ray from there ends before the surface.
    #[inline]
    pub fn offset_from(&self, to_origin: Vec3) -> Vec3 {
        self.displaced(to_origin, self.offset + self.offset_per_length * to_origin.length())
    }

    #[inline]
    fn displaced(&self, direction: Vec3, distance: f32) -> Vec3 {
        self.p + self.ng * distance.copysign(self.ng.dot(direction))
    }
}

/// Bound of the distance from the true plane of a point of it that was rounded to f32, moved off and
/// rounded again: half an ulp per component each time, seen along the normal.
#[inline]
pub(super) fn position_error(p: Vec3, ng: Vec3) -> f32 {
    2.0 * ROUNDOFF * p.abs().dot(ng.abs())
}
