//! Light from a point, the same in all directions.

use crate::math::{Rgb, warp};
use glam::{Vec2, Vec3};
use std::f64::consts::PI;

/// An isotropic point light.
#[derive(Clone, Debug)]
pub(super) struct PointLight {
    pub(super) position: Vec3,
    /// W/sr.
    pub(super) intensity: Rgb,
}

impl PointLight {
    /// Emitted flux per intensity.
    pub(super) const FLUX: f64 = 4.0 * PI;

    /// Density per solid angle of [`PointLight::sample_direction`].
    pub(super) const DIRECTION_DENSITY: f64 = 1.0 / (4.0 * PI);

    /// A direction of emission.
    #[inline]
    pub(super) fn sample_direction(u: Vec2) -> Vec3 {
        warp::sphere(u)
    }
}
