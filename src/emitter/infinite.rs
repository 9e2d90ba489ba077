//! Light from infinity: parallel, or the same from everywhere. Both start their rays on a disk
//! before the scene, perpendicular to the direction of travel and as wide as the scene's bounding
//! sphere.

use crate::math::{Frame, Rgb, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// The disk through the middle of the scene, for any direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneDisk {
    center: Vec3,
    radius: f32,
}

impl SceneDisk {
    pub(super) fn new(center: Vec3, radius: f32) -> SceneDisk {
        // A scene may be a single point; its disk must still have an area.
        SceneDisk { center, radius: radius.max(f32::MIN_POSITIVE) }
    }

    /// Square metres.
    #[inline]
    pub(super) fn area(&self) -> f64 {
        PI * f64::from(self.radius).powi(2)
    }

    /// Where a ray along `direction` starts, with density `1/area` per perpendicular area: a little
    /// outside the bounding sphere, so that rounding leaves nothing behind it.
    #[inline]
    pub(super) fn sample(&self, direction: Vec3, u: Vec2) -> Vec3 {
        let d = warp::disk(u);
        self.center + Frame::around(direction).to_world(d.extend(-1.001)) * self.radius
    }
}

/// Parallel light.
#[derive(Clone, Debug)]
pub(super) struct DirectionalLight {
    /// The way the light travels, unit.
    pub(super) direction: Vec3,
    /// On a perpendicular surface, W/m².
    pub(super) irradiance: Rgb,
    pub(super) disk: SceneDisk,
}

impl DirectionalLight {
    /// `direction` of any non-zero length.
    pub(super) fn new(direction: DVec3, irradiance: Rgb, disk: SceneDisk) -> DirectionalLight {
        DirectionalLight { direction: direction.normalize_or(DVec3::NEG_Y).as_vec3(), irradiance, disk }
    }

    /// Flux through the disk per irradiance.
    pub(super) fn flux(&self) -> f64 {
        self.disk.area()
    }
}

/// The same radiance from everywhere.
#[derive(Clone, Debug)]
pub(super) struct Environment {
    /// W/(m² sr).
    pub(super) radiance: Rgb,
    pub(super) disk: SceneDisk,
}

impl Environment {
    /// Density per solid angle of [`Environment::sample_direction`].
    pub(super) const DIRECTION_DENSITY: f64 = 1.0 / (4.0 * PI);

    /// Flux through the disks of all directions per radiance.
    pub(super) fn flux(&self) -> f64 {
        4.0 * PI * self.disk.area()
    }

    /// A direction toward the light.
    #[inline]
    pub(super) fn sample_direction(u: Vec2) -> Vec3 {
        warp::sphere(u)
    }
}
