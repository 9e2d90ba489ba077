//! Analytic spheres.

use super::{Ray, SurfacePoint};
use glam::Vec3;

/// A sphere in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, positive.
    pub radius: f32,
}

impl Sphere {
    /// The surface where `ray` meets the sphere near parameter `t`.
    #[inline]
    pub fn surface(&self, _ray: &Ray, _t: f32) -> SurfacePoint {
        todo!()
    }

    /// The surface where its outward unit normal is `n`; the shape index is left 0.
    #[inline]
    pub fn at_normal(&self, n: Vec3) -> SurfacePoint {
        let p = self.center + n * self.radius;
        SurfacePoint { p, ng: n, ns: n, offset: self.rounding(), shape: 0, primitive: 0 }
    }

    /// Bound on how far from the true sphere f32 rounding puts a point of it: the length of `n`, the
    /// product and the sum in [`Sphere::at_normal`] together lose under two epsilons of the largest
    /// magnitude that occurs; the rest is left to the intersection test.
    #[inline]
    pub fn rounding(&self) -> f32 {
        8.0 * f32::EPSILON * (self.center.abs().max_element() + self.radius)
    }
}
