//! Smooth boundary of a solid or liquid: reflection and refraction in one direction each.

use super::fresnel::{reflectance, refraction_cosine};
use super::{DeltaSample, TransportMode};
use crate::math::Rgb;
use glam::Vec3;

/// Refractive indices on both sides, and the tint of what passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interface {
    pub(super) inside: f32,
    pub(super) outside: f32,
    pub(super) tint: Rgb,
}

impl Interface {
    /// Index on `wo`'s side, then the other.
    #[inline]
    pub(super) fn indices(&self, front: bool) -> (f32, f32) {
        if front { (self.outside, self.inside) } else { (self.inside, self.outside) }
    }
}

/// Smooth boundary.
#[derive(Clone, Copy, Debug)]
pub(super) struct SmoothDielectric {
    pub(super) interface: Interface,
}

impl SmoothDielectric {
    /// The branch is drawn with probability F, whatever the tint, so that it is the same number for
    /// both directions of travel.
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, front: bool, mode: TransportMode, u: f32) -> DeltaSample {
        let (n_1, n_2) = self.interface.indices(front);
        let refracted = refraction_cosine(n_1, n_2, wo.z);
        let f = refracted.map_or(1.0, |cos| reflectance(n_1, wo.z, n_2, cos));
        match refracted {
            Some(cos) if u >= f => {
                let ratio = n_1 / n_2;
                let scale = match mode {
                    TransportMode::Radiance => ratio * ratio,
                    TransportMode::Importance => 1.0,
                };
                DeltaSample {
                    wi: Vec3::new(-ratio * wo.x, -ratio * wo.y, -cos),
                    weight: self.interface.tint * scale,
                    probability: 1.0 - f,
                    transmitted: true,
                    microfacet: None,
                }
            }
            _ => {
                let wi = Vec3::new(-wo.x, -wo.y, wo.z);
                DeltaSample { wi, weight: Rgb::ONE, probability: f, transmitted: false, microfacet: None }
            }
        }
    }
}
