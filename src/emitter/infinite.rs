//! Light from infinity: parallel, or from all around. Both start their rays on a disk
//! before the scene, perpendicular to the direction of travel and as wide as the scene's bounding
//! sphere.

use super::map::EnvironmentMap;
use crate::geometry::BoundingDisk;
use crate::math::{Rgb, warp};
use crate::scene::description;
use glam::{DVec3, Mat3, Vec2, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Parallel light.
#[derive(Clone, Debug)]
pub(super) struct DirectionalLight {
    /// The way the light travels, unit.
    pub(super) direction: Vec3,
    /// On a perpendicular surface, W/m².
    pub(super) irradiance: Rgb,
    pub(super) disk: BoundingDisk,
}

impl DirectionalLight {
    /// `direction` of any non-zero length.
    pub(super) fn new(direction: DVec3, irradiance: Rgb, disk: BoundingDisk) -> DirectionalLight {
        DirectionalLight { direction: direction.normalize_or(DVec3::NEG_Y).as_vec3(), irradiance, disk }
    }

    /// Flux through the disk per irradiance.
    pub(super) fn flux(&self) -> f64 {
        self.disk.area()
    }
}

/// Light from all around: the same from everywhere, or as an image says.
#[derive(Clone, Debug)]
pub(super) struct Environment {
    /// W/(m² sr); what the image is multiplied by, if there is one.
    radiance: Rgb,
    image: Option<Image>,
    pub(super) disk: BoundingDisk,
}

#[derive(Clone, Debug)]
struct Image {
    map: Arc<EnvironmentMap>,
    /// From the image's space to the scene's.
    rotation: Mat3,
}

impl Environment {
    pub(super) fn new(environment: &description::Environment, disk: BoundingDisk) -> Environment {
        let image = environment.image.clone().map(|map| Image { map, rotation: environment.rotation.as_mat3() });
        Environment { radiance: environment.radiance, image, disk }
    }

    /// Flux through the disks of all directions, W per channel.
    pub(super) fn power(&self) -> DVec3 {
        let around = self.image.as_ref().map_or(DVec3::splat(4.0 * PI), |image| image.map.total());
        self.radiance.as_dvec3() * around * self.disk.area()
    }

    /// Bytes of the image.
    pub(super) fn memory(&self) -> u64 {
        self.image.as_ref().map_or(0, |image| image.map.memory())
    }

    /// What comes from a direction, unit, toward the light.
    #[inline]
    pub(super) fn radiance(&self, to_light: Vec3) -> Rgb {
        match &self.image {
            Some(Image { map, rotation }) => self.radiance * map.radiance(rotation.transpose() * to_light),
            None => self.radiance,
        }
    }

    /// Density per solid angle of [`Environment::sample_direction`].
    #[inline]
    pub(super) fn density(&self, to_light: Vec3) -> f64 {
        match &self.image {
            Some(Image { map, rotation }) => map.density(rotation.transpose() * to_light),
            None => 1.0 / (4.0 * PI),
        }
    }

    /// A direction toward the light.
    #[inline]
    pub(super) fn sample_direction(&self, u: Vec2) -> Vec3 {
        match &self.image {
            Some(Image { map, rotation }) => (*rotation * map.sample(u)).normalize(),
            None => warp::sphere(u),
        }
    }
}
