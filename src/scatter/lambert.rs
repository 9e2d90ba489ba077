//! Lambertian reflection (Lambert 1760).

use super::Evaluation;
use crate::math::{Rgb, warp};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The same radiance in all directions on the side the light came from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lambert {
    /// Albedo.
    pub(super) reflectance: Rgb,
}

impl Lambert {
    /// For cosines of the two directions, positive when on the same side.
    #[inline]
    pub(super) fn evaluate(&self, cos_o: f32, cos_i: f32) -> Evaluation {
        Evaluation {
            f: self.reflectance * FRAC_1_PI,
            pdf: warp::cosine_hemisphere_pdf_w(cos_i),
            pdf_reverse: warp::cosine_hemisphere_pdf_w(cos_o),
        }
    }
}

/// Lambertian base under a reflecting coat, which takes its share of the light first.
///
/// The base keeps `1 - coat`, with Schlick's reflectance of the coat at the more grazing of the two
/// directions. That is reciprocal, and leaves the base no more than the coat lets through, seen from
/// either end; see [`super::metallic_roughness`] for why not at the half vector.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoatedLambert {
    /// The base.
    pub(super) base: Lambert,
    /// Reflectance of the coat at normal incidence, its strongest channel.
    pub(super) f0: f32,
    /// Its reflectance at grazing incidence.
    pub(super) f90: f32,
}

impl CoatedLambert {
    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let mut e = self.base.evaluate(wo.z, wi.z);
        let grazing = wo.z.min(wi.z);
        e.f *= 1.0 - (self.f0 + (self.f90 - self.f0) * super::fresnel::schlick_weight(grazing));
        e
    }
}
