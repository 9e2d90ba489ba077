//! What a light-emitting surface does at one of its points, whatever its shape: constant radiance
//! over the hemisphere of one or both sides. The side is told by the geometric normal.

use crate::math::{Frame, Rgb, warp};
use glam::{Vec2, Vec3};
use std::f64::consts::PI;

/// Lambertian emission.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceEmission {
    /// W/(m² sr).
    pub(super) radiance: Rgb,
    /// Whether the back emits too.
    pub(super) two_sided: bool,
}

impl SurfaceEmission {
    fn sides(&self) -> f64 {
        if self.two_sided { 2.0 } else { 1.0 }
    }

    /// Emitted flux per radiance: `pi A`, for each side.
    pub(super) fn flux(&self, area: f64) -> f64 {
        self.sides() * PI * area
    }

    /// Radiance along `direction`; zero on a dark side.
    #[inline]
    pub(super) fn radiance(&self, ng: Vec3, direction: Vec3) -> Rgb {
        if self.cosine(ng, direction) > 0.0 { self.radiance } else { Rgb::ZERO }
    }

    /// Density per solid angle with which emission leaves along `direction`: `cos/pi`, the two sides
    /// being equally likely.
    #[inline]
    pub(super) fn direction_density(&self, ng: Vec3, direction: Vec3) -> f64 {
        self.cosine(ng, direction).max(0.0) / (PI * self.sides())
    }

    /// A direction of emission.
    #[inline]
    pub(super) fn sample_direction(&self, ng: Vec3, mut u: Vec2) -> Vec3 {
        let mut normal = ng;
        if self.two_sided {
            u.x *= 2.0;
            if u.x >= 1.0 {
                u.x -= 1.0;
                normal = -ng;
            }
        }
        Frame::around(normal).to_world(warp::cosine_hemisphere(u))
    }

    /// Cosine with the normal of the emitting side, negative on a dark side.
    #[inline]
    fn cosine(&self, ng: Vec3, direction: Vec3) -> f64 {
        let cos = ng.as_dvec3().dot(direction.as_dvec3());
        if self.two_sided { cos.abs() } else { cos }
    }
}
