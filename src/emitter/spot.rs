//! Light from a point into a cone, with the falloff that `KHR_lights_punctual` recommends (Khronos
//! Group 2017): `clamp((cos - cos_outer) / (cos_inner - cos_outer))²`. The lower bound of 0.001 that
//! its shader code puts on the denominator is left out, for it would dim narrow cones.
//!
//! Angles are kept as one minus their cosines, so that a narrow cone keeps its digits.

use crate::geometry::Reach;
use crate::math::{Frame, Rgb, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// A spot light.
#[derive(Clone, Debug)]
pub(super) struct SpotLight {
    pub(super) position: Vec3,
    /// W/sr on the axis.
    pub(super) intensity: Rgb,
    /// Unit.
    axis: DVec3,
    /// `1 - cos` of the half-angle of full intensity.
    inner: f64,
    /// `1 - cos` of the half-angle of darkness.
    outer: f64,
}

/// `1 - cos(angle)`.
fn one_minus_cos(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin().powi(2)
}

impl SpotLight {
    /// Half-angles in radians, the outer one cut at pi/2.
    pub(super) fn new(position: Vec3, direction: DVec3, intensity: Rgb, inner: f64, outer: f64) -> SpotLight {
        SpotLight {
            position,
            intensity,
            axis: direction.normalize_or(DVec3::NEG_Z),
            inner: one_minus_cos(inner),
            outer: one_minus_cos(outer.min(FRAC_PI_2)),
        }
    }

    /// Emitted flux per axial intensity: the falloff integrated over the cone.
    pub(super) fn flux(&self) -> f64 {
        2.0 * PI * (self.inner + (self.outer - self.inner) / 3.0)
    }

    /// Intensity along `direction`.
    #[inline]
    pub(super) fn intensity(&self, direction: Vec3) -> Rgb {
        let h = self.off_axis(direction);
        if h >= self.outer {
            Rgb::ZERO
        } else if h <= self.inner {
            self.intensity
        } else {
            let falloff = (self.outer - h) / (self.outer - self.inner);
            self.intensity * (falloff * falloff) as f32
        }
    }

    /// A direction of emission, uniform in the outer cone.
    #[inline]
    pub(super) fn sample_direction(&self, u: Vec2) -> Vec3 {
        Frame::around(self.axis.as_vec3()).to_world(warp::cone(u, self.outer as f32))
    }

    /// Density per solid angle of [`SpotLight::sample_direction`].
    #[inline]
    pub(super) fn direction_density(&self, direction: Vec3) -> f64 {
        if self.off_axis(direction) < self.outer { 1.0 / (2.0 * PI * self.outer) } else { 0.0 }
    }

    /// What it lights.
    #[inline]
    pub(super) fn reach(&self) -> Reach {
        Reach::cone(self.axis, 1.0 - self.outer)
    }

    /// `1 - cos` of the angle between `direction` and the axis, from the length of their difference.
    #[inline]
    fn off_axis(&self, direction: Vec3) -> f64 {
        0.5 * (direction.as_dvec3().normalize() - self.axis).length_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn the_falloff_is_the_one_gltf_recommends() {
        let (inner, outer) = (0.3, 0.7);
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        let spot = SpotLight::new(Vec3::ZERO, 3.0 * axis, Rgb::new(2.0, 3.0, 4.0), inner, outer);
        // The shader code of the extension's text.
        let scale = 1.0 / (f64::cos(inner) - f64::cos(outer));
        let offset = -f64::cos(outer) * scale;
        for k in 0..200 {
            let angle = 0.01 * f64::from(k);
            let direction = DQuat::from_axis_angle(axis.any_orthonormal_vector(), angle) * axis;
            let expected = (angle.cos() * scale + offset).clamp(0.0, 1.0).powi(2);
            let got = spot.intensity(direction.as_vec3());
            assert!((f64::from(got.y) - 3.0 * expected).abs() < 2e-6, "angle {angle}: {got}, expected {expected}");
        }
    }

    #[test]
    fn a_narrow_cone_is_bright_in_its_middle_and_dark_outside() {
        let spot = SpotLight::new(Vec3::ZERO, DVec3::new(1.0, 1.0, 1.0), Rgb::ONE, 1e-4, 2e-4);
        let axis = DVec3::ONE.normalize();
        let side = axis.any_orthonormal_vector();
        let at = |angle: f64| f64::from(spot.intensity((axis + side * angle).as_vec3()).x);
        assert_eq!(at(0.0), 1.0);
        assert_eq!(at(0.9e-4), 1.0);
        // Angles so small: the falloff is (4 - (angle/1e-4)²)²/9; a direction in f32 is good to 1e-7.
        assert!((at(1.5e-4) - (1.75f64 / 3.0).powi(2)).abs() < 3e-3, "{}", at(1.5e-4));
        assert_eq!(at(2.1e-4), 0.0);
    }
}
