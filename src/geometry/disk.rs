//! The disk that light from infinity passes on its way to the scene.

use crate::math::{Frame, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A disk before the scene, perpendicular to any direction of travel and as wide as the scene's bounding sphere.
#[derive(Clone, Copy, Debug)]
pub struct BoundingDisk {
    center: Vec3,
    radius: f32,
}

impl BoundingDisk {
    /// By the bounding sphere.
    pub fn new(center: Vec3, radius: f32) -> BoundingDisk {
        // A scene may be a single point; its disk must still have an area.
        BoundingDisk { center, radius: radius.max(f32::MIN_POSITIVE) }
    }

    /// Metres.
    #[inline]
    pub fn radius(&self) -> f64 {
        f64::from(self.radius)
    }

    /// Square metres.
    #[inline]
    pub fn area(&self) -> f64 {
        PI * self.radius().powi(2)
    }

    /// Where a ray along `direction` starts, with density `1/area` per perpendicular area: a little
    /// outside the bounding sphere, so that rounding leaves nothing behind it.
    #[inline]
    pub fn sample(&self, direction: Vec3, u: Vec2) -> Vec3 {
        let d = warp::disk(u);
        self.center + Frame::around(direction).to_world(d.extend(-1.001)) * self.radius
    }

    /// Where the ray along `direction` through a place starts, as near the scene as those of [`BoundingDisk::sample`].
    #[inline]
    pub(super) fn before(&self, place: DVec3, direction: Vec3) -> Vec3 {
        let d = direction.as_dvec3().normalize();
        let along = (place - self.center.as_dvec3()).dot(d) + 1.001 * self.radius();
        (place - d * along).as_vec3()
    }
}
