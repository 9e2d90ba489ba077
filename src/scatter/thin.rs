//! A sheet without thickness: light leaves it parallel to how it came.

use super::fresnel::{dielectric, reflect};
use super::ggx::Ggx;
use super::{DeltaSample, Evaluation};
use crate::math::Rgb;
use glam::{Vec2, Vec3};

/// A sheet in vacuum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    pub(super) ior: f32,
    pub(super) tint: Rgb,
}

impl Sheet {
    /// Reflectance with all reflections between the two faces, `F + (1-F)^2 F (1 + F^2 + F^4 + ...) =
    /// 2F/(1+F)`; the sheet absorbs nothing, so the rest is transmitted (Stokes 1862).
    #[inline]
    pub(super) fn reflectance(&self, cos: f32) -> f32 {
        let f = dielectric(1.0, self.ior, cos);
        2.0 * f / (1.0 + f)
    }
}

/// Smooth sheet.
#[derive(Clone, Copy, Debug)]
pub(super) struct SmoothThin {
    pub(super) sheet: Sheet,
}

impl SmoothThin {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: f32) -> DeltaSample {
        let r = self.sheet.reflectance(wo.z);
        if u < r {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            DeltaSample { wi, weight: Rgb::ONE, probability: r, transmitted: false, microfacet: None }
        } else {
            let weight = self.sheet.tint;
            DeltaSample { wi: -wo, weight, probability: 1.0 - r, transmitted: true, microfacet: None }
        }
    }
}

/// Rough sheet: the reflection lobe of a rough surface, and its mirror image behind the sheet for
/// what is transmitted (as `KHR_materials_transmission` asks).
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughThin {
    pub(super) sheet: Sheet,
    pub(super) ggx: Ggx,
}

impl RoughThin {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_branch: f32, u: Vec2) -> Option<Vec3> {
        let h = self.ggx.sample(wo, u);
        let wi = reflect(wo, h);
        if wi.z <= 0.0 {
            return None;
        }
        let reflected = u_branch < self.sheet.reflectance(wo.dot(h).clamp(0.0, 1.0));
        Some(if reflected { wi } else { Vec3::new(wi.x, wi.y, -wi.z) })
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let Some(r) = self.ggx.reflection(wo, Vec3::new(wi.x, wi.y, wi.z.abs())) else {
            return Evaluation::default();
        };
        let reflectance = self.sheet.reflectance(r.cos_h);
        let (share, colour) = if wi.z > 0.0 { (reflectance, Rgb::ONE) } else { (1.0 - reflectance, self.sheet.tint) };
        Evaluation { f: colour * (share * r.value), pdf: share * r.pdf, pdf_reverse: share * r.pdf_reverse }
    }
}
