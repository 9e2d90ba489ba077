//! The surface at a hit.

use glam::Vec3;

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
    /// Index of the shape.
    pub shape: u32,
    /// Index of the triangle; 0 on a sphere.
    pub primitive: u32,
}

impl SurfacePoint {
    /// `p` moved off the surface to the side that `direction` points to.
    #[inline]
    pub fn offset(&self, direction: Vec3) -> Vec3 {
        let h = self.offset.copysign(self.ng.dot(direction));
        self.p + self.ng * h
    }
}
