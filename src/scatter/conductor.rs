//! Metals, and the reflecting coat of the glTF model: reflection only, Schlick's Fresnel term.

use super::fresnel::{reflect, schlick};
use super::ggx::Ggx;
use super::{DeltaSample, Evaluation};
use crate::math::Rgb;
use glam::{Vec2, Vec3};

/// Reflectance as a function of the angle (Schlick 1994).
#[derive(Clone, Copy, Debug)]
pub(super) struct Reflectance {
    /// At normal incidence.
    pub(super) f0: Rgb,
    /// At grazing incidence.
    pub(super) f90: f32,
}

impl Reflectance {
    /// A metal's: everything is reflected at grazing incidence.
    pub(super) fn metal(f0: Rgb) -> Reflectance {
        Reflectance { f0, f90: 1.0 }
    }

    #[inline]
    pub(super) fn at(&self, cos: f32) -> Rgb {
        schlick(self.f0, self.f90, cos)
    }

    /// Mean over a Lambertian distribution of directions.
    pub(super) fn mean(&self) -> Rgb {
        // 2 * integral of (1-c)^5 c dc = 1/21.
        self.f0 + (Rgb::splat(self.f90) - self.f0) / 21.0
    }
}

/// Mirror.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mirror {
    pub(super) reflectance: Reflectance,
}

impl Mirror {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> DeltaSample {
        DeltaSample {
            wi: Vec3::new(-wo.x, -wo.y, wo.z),
            weight: self.reflectance.at(wo.z),
            probability: 1.0,
            transmitted: false,
            microfacet: None,
        }
    }
}

/// Rough metal, single scattering: light that a microfacet throws at another one is lost.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughConductor {
    pub(super) ggx: Ggx,
    pub(super) reflectance: Reflectance,
}

impl RoughConductor {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<Vec3> {
        let wi = reflect(wo, self.ggx.sample(wo, u));
        (wi.z > 0.0).then_some(wi)
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        match self.ggx.reflection(wo, wi) {
            Some(r) => Evaluation { f: self.reflectance.at(r.cos_h) * r.value, pdf: r.pdf, pdf_reverse: r.pdf_reverse },
            None => Evaluation::default(),
        }
    }
}
