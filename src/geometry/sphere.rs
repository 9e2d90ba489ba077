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
}
