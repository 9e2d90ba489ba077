//! Light-emitting spheres. A receiver outside draws from the cone of directions under which it sees
//! the sphere (Shirley, Wang, Zimmermann 1996), one inside, or too near for f32 to tell, by area.
//!
//! The cone is described by `1 - cos` and squared sines in f64, never by a difference of cosines: a
//! sphere a million radii away keeps its digits.

use super::surface::SurfaceEmission;
use crate::geometry::{Sphere, SurfacePoint};
use crate::math::{Frame, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A sphere.
#[derive(Clone, Debug)]
pub(super) struct SphereLight {
    pub(super) shape: u32,
    pub(super) emission: SurfaceEmission,
    /// Square metres, one side.
    pub(super) area: f64,
}

/// The directions under which a receiver sees a sphere.
struct Cone {
    /// Toward the centre, unit.
    axis: DVec3,
    /// Squared sine of the half-angle.
    sin2: f64,
    /// One minus its cosine.
    one_minus_cos: f64,
}

impl Cone {
    /// `None` from inside, and where rounding may decide between inside and outside.
    #[inline]
    fn of(sphere: &Sphere, receiver: Vec3) -> Option<Cone> {
        let to_center = sphere.center.as_dvec3() - receiver.as_dvec3();
        let (distance, radius) = (to_center.length(), f64::from(sphere.radius));
        if distance <= radius + f64::from(sphere.rounding()) {
            return None;
        }
        let sin2 = (radius / distance).powi(2);
        let cos = ((distance - radius) * (distance + radius)).sqrt() / distance;
        Some(Cone { axis: to_center / distance, sin2, one_minus_cos: sin2 / (1.0 + cos) })
    }
}

impl SphereLight {
    pub(super) fn new(shape: u32, sphere: &Sphere, emission: SurfaceEmission) -> SphereLight {
        let area = 4.0 * PI * f64::from(sphere.radius).powi(2);
        SphereLight { shape, emission, area }
    }

    /// A point with density `1/area`.
    #[inline]
    pub(super) fn sample_point(&self, sphere: &Sphere, u: Vec2) -> SurfacePoint {
        self.at(sphere, warp::sphere(u))
    }

    /// A point with density [`SphereLight::direct_density`].
    #[inline]
    pub(super) fn sample_point_for(&self, sphere: &Sphere, receiver: Vec3, u: Vec2) -> SurfacePoint {
        let Some(cone) = Cone::of(sphere, receiver) else {
            return self.sample_point(sphere, u);
        };
        // The direction makes the angle alpha with the axis. The law of sines gives the angle theta
        // at the point, between its normal and the direction to the receiver; theta - alpha remains
        // for the angle at the centre.
        let h = f64::from(u.x) * cone.one_minus_cos;
        let (cos_alpha, sin2_alpha) = (1.0 - h, h * (2.0 - h));
        let sin2_theta = (sin2_alpha / cone.sin2).min(1.0);
        let (sin_alpha, sin_theta, cos_theta) = (sin2_alpha.sqrt(), sin2_theta.sqrt(), (1.0 - sin2_theta).sqrt());
        let cos = cos_theta * cos_alpha + sin_theta * sin_alpha;
        let sin = sin_theta * cos_alpha - cos_theta * sin_alpha;
        let (sin_phi, cos_phi) = (2.0 * PI * f64::from(u.y)).sin_cos();
        let local = DVec3::new(sin * cos_phi, sin * sin_phi, cos).as_vec3();
        self.at(sphere, Frame::around(-cone.axis.as_vec3()).to_world(local))
    }

    /// Density per area at `at` of [`SphereLight::sample_point_for`]. `cos_over_d2` is the cosine at
    /// `at` toward the receiver, over their squared distance; negative on the far side, which the
    /// cone's rays do not reach.
    #[inline]
    pub(super) fn direct_density(&self, sphere: &Sphere, receiver: Vec3, cos_over_d2: f64) -> f64 {
        match Cone::of(sphere, receiver) {
            Some(cone) => cos_over_d2.max(0.0) / (2.0 * PI * cone.one_minus_cos),
            None => 1.0 / self.area,
        }
    }

    fn at(&self, sphere: &Sphere, n: Vec3) -> SurfacePoint {
        SurfacePoint { shape: self.shape, ..sphere.at(n.as_dvec3().normalize()) }
    }
}
