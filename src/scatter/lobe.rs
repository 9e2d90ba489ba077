//! One lobe of a material, by kind.
//!
//! Local frame: z is the shading normal, turned to `wo`'s side, so `wo.z > 0`; `front` tells whether
//! that is the side of the surface's own normal. `wi.z < 0` has crossed.

use super::conductor::{Mirror, RoughConductor};
use super::lambert::{CoatedLambert, Lambert};
use super::rough_dielectric::RoughDielectric;
use super::smooth_dielectric::SmoothDielectric;
use super::thin::{RoughThin, SmoothThin};
use super::{Evaluation, Microfacet, TransportMode};
use crate::math::{Rgb, warp};
use glam::{Vec2, Vec3};

/// What a lobe without a finite BSDF continues with.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeltaSample {
    pub(super) wi: Vec3,
    /// Albedo of the branch over its probability.
    pub(super) weight: Rgb,
    /// Of the branch, the same number for both directions of travel.
    pub(super) probability: f32,
    pub(super) transmitted: bool,
    /// Where the surface is rough.
    pub(super) microfacet: Option<Microfacet>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Lobe {
    Lambert(Lambert),
    CoatedLambert(CoatedLambert),
    Mirror(Mirror),
    RoughConductor(RoughConductor),
    SmoothDielectric(SmoothDielectric),
    RoughDielectric(RoughDielectric),
    SmoothThin(SmoothThin),
    RoughThin(RoughThin),
}

/// A lobe's continuation.
pub(super) enum LobeSample {
    /// A direction that [`Lobe::evaluate`] knows.
    Connectable(Vec3),
    Delta(DeltaSample),
}

impl Lobe {
    /// Whether connections may evaluate it, or some of it.
    #[inline]
    pub(super) fn connectable(&self) -> bool {
        !matches!(self, Lobe::Mirror(_) | Lobe::SmoothDielectric(_) | Lobe::SmoothThin(_))
    }

    /// What it reflects at normal incidence, or lets through.
    pub(super) fn color(&self) -> Rgb {
        match self {
            Lobe::Lambert(l) => l.reflectance,
            Lobe::CoatedLambert(l) => l.base.reflectance,
            Lobe::Mirror(l) => l.reflectance.f0,
            Lobe::RoughConductor(l) => l.reflectance.f0,
            Lobe::SmoothDielectric(l) => l.interface.tint,
            Lobe::RoughDielectric(l) => l.interface.tint,
            Lobe::SmoothThin(l) => l.sheet.tint,
            Lobe::RoughThin(l) => l.sheet.tint,
        }
    }

    /// Whether light crosses the surface.
    pub(super) fn transmits(&self) -> bool {
        match self {
            Lobe::SmoothDielectric(_) | Lobe::RoughDielectric(_) | Lobe::SmoothThin(_) | Lobe::RoughThin(_) => true,
            Lobe::Lambert(_) | Lobe::CoatedLambert(_) | Lobe::Mirror(_) | Lobe::RoughConductor(_) => false,
        }
    }

    #[inline]
    pub(super) fn sample(
        &self,
        wo: Vec3,
        front: bool,
        mode: TransportMode,
        u_branch: f32,
        u: Vec2,
    ) -> Option<LobeSample> {
        let wi = match self {
            Lobe::Lambert(_) | Lobe::CoatedLambert(_) => warp::cosine_hemisphere(u),
            Lobe::RoughConductor(l) => l.sample(wo, u)?,
            Lobe::RoughDielectric(l) if l.walked => return l.sample_walked(wo, front, mode, u_branch, u),
            Lobe::RoughDielectric(l) => l.sample(wo, front, u_branch, u)?,
            Lobe::RoughThin(l) => l.sample(wo, u_branch, u)?,
            Lobe::Mirror(l) => return Some(LobeSample::Delta(l.sample(wo))),
            Lobe::SmoothDielectric(l) => return Some(LobeSample::Delta(l.sample(wo, front, mode, u_branch))),
            Lobe::SmoothThin(l) => return Some(LobeSample::Delta(l.sample(wo, u_branch))),
        };
        Some(LobeSample::Connectable(wi))
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, front: bool, mode: TransportMode) -> Evaluation {
        match self {
            Lobe::RoughDielectric(l) => l.evaluate(wo, wi, front, mode),
            Lobe::RoughThin(l) => l.evaluate(wo, wi),
            // What follows reflects only.
            _ if wi.z <= 0.0 => Evaluation::default(),
            Lobe::Lambert(l) => l.evaluate(wo.z, wi.z),
            Lobe::CoatedLambert(l) => l.evaluate(wo, wi),
            Lobe::RoughConductor(l) => l.evaluate(wo, wi),
            Lobe::Mirror(_) | Lobe::SmoothDielectric(_) | Lobe::SmoothThin(_) => Evaluation::default(),
        }
    }
}
