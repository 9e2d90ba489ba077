//! Rough boundary of a solid or liquid (Walter et al. 2007, "Microfacet models for refraction through
//! rough surfaces"), single scattering.

use super::fresnel::{bend, dielectric, reflect, reflectance, refraction_cosine};
use super::ggx::Ggx;
use super::lobe::{DeltaSample, LobeSample};
use super::smooth_dielectric::Interface;
use super::{Evaluation, Microfacet, TransportMode};
use crate::math::Rgb;
use glam::{Vec2, Vec3};

/// Below this product of `alpha` and the indices' relative difference, the boundary is treated as
/// smooth: it is the angular width of the refraction lobe, and the half vector `n_1 wo + n_2 wi` loses
/// as many digits as the indices are close. The density is then off by some 1e-3.
const MIN_REFRACTION_WIDTH: f32 = 1e-4;

/// Rough boundary.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughDielectric {
    pub(super) interface: Interface,
    pub(super) ggx: Ggx,
    /// Whether manifold walks lead through it, so that no connection evaluates its refraction. Its
    /// reflection stays what it is.
    pub(super) walked: bool,
}

impl RoughDielectric {
    /// `None` if the boundary is so smooth, or its media so alike, that it must count as smooth.
    pub(super) fn new(interface: Interface, roughness: f32) -> Option<RoughDielectric> {
        let ggx = Ggx::new(roughness)?;
        let (a, b) = (interface.inside, interface.outside);
        let width = ggx.alpha() * (a - b).abs() / a.max(b);
        (width >= MIN_REFRACTION_WIDTH).then_some(RoughDielectric { interface, ggx, walked: false })
    }

    /// A visible microfacet, then its reflection with probability F, else its refraction.
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, front: bool, u_branch: f32, u: Vec2) -> Option<Vec3> {
        self.draw(wo, front, u_branch, u).map(|(wi, _)| wi)
    }

    /// The same, with the microfacet's normal.
    #[inline]
    fn draw(&self, wo: Vec3, front: bool, u_branch: f32, u: Vec2) -> Option<(Vec3, Vec3)> {
        let (n_1, n_2) = self.interface.indices(front);
        let h = self.ggx.sample(wo, u);
        let cos_1 = wo.dot(h).clamp(0.0, 1.0);
        if let Some(cos_2) = refraction_cosine(n_1, n_2, cos_1)
            && u_branch >= reflectance(n_1, cos_1, n_2, cos_2)
        {
            let wi = bend(wo, h, n_1 / n_2, cos_1, cos_2);
            return (wi.z < 0.0).then_some((wi, h));
        }
        let wi = reflect(wo, h);
        (wi.z > 0.0).then_some((wi, h))
    }

    /// The same, where walks lead through it.
    #[inline]
    pub(super) fn sample_walked(
        &self,
        wo: Vec3,
        front: bool,
        mode: TransportMode,
        u_branch: f32,
        u: Vec2,
    ) -> Option<LobeSample> {
        let (wi, normal) = self.draw(wo, front, u_branch, u)?;
        if wi.z > 0.0 {
            return Some(LobeSample::Connectable(wi));
        }
        let (n_1, n_2) = self.interface.indices(front);
        let (cos_1, cos_2) = (wo.dot(normal).clamp(0.0, 1.0), -wi.dot(normal));
        let (v_1, v_2) = (self.ggx.v(wo), self.ggx.v(wi));
        let ratio = n_1 / n_2;
        let scale = match mode {
            TransportMode::Radiance => ratio * ratio,
            TransportMode::Importance => 1.0,
        };
        Some(LobeSample::Delta(DeltaSample {
            wi,
            weight: self.interface.tint * (scale * 2.0 * v_2 * -wi.z),
            probability: 1.0 - reflectance(n_1, cos_1, n_2, cos_2.min(1.0)),
            transmitted: true,
            microfacet: Some(Microfacet {
                normal,
                density: [2.0 * v_1 * cos_1 / normal.z, 2.0 * v_2 * cos_2 / normal.z],
            }),
        }))
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, front: bool, mode: TransportMode) -> Evaluation {
        let (n_1, n_2) = self.interface.indices(front);
        let evaluation = if wi.z > 0.0 {
            self.reflection(wo, wi, n_1, n_2)
        } else if self.walked {
            None
        } else {
            self.refraction(wo, wi, n_1, n_2, mode)
        };
        evaluation.unwrap_or_default()
    }

    #[inline]
    fn reflection(&self, wo: Vec3, wi: Vec3, n_1: f32, n_2: f32) -> Option<Evaluation> {
        let r = self.ggx.reflection(wo, wi)?;
        let f = dielectric(n_1, n_2, r.cos_h);
        Some(Evaluation { f: Rgb::splat(f * r.value), pdf: f * r.pdf, pdf_reverse: f * r.pdf_reverse })
    }

    fn refraction(&self, wo: Vec3, wi: Vec3, n_1: f32, n_2: f32, mode: TransportMode) -> Option<Evaluation> {
        let sum = wo * n_1 + wi * n_2;
        let h = sum.try_normalize()?;
        let h = if h.z < 0.0 { -h } else { h };
        // Both directions must see the front of the microfacet on their own side.
        let (cos_1, cos_2) = (wo.dot(h), -wi.dot(h));
        if !(cos_1 > 0.0 && cos_2 > 0.0) {
            return None;
        }
        let t = 1.0 - reflectance(n_1, cos_1.min(1.0), n_2, cos_2.min(1.0));
        let (d, v_1, v_2) = (self.ggx.d(h), self.ggx.v(wo), self.ggx.v(wi));
        // d omega_h / d omega of a direction in the medium n: n^2 cos_h / |n_1 wo + n_2 wi|^2.
        // The cosines' product first: the same bits from either side.
        let common = t * d * (cos_1 * cos_2) / sum.length_squared();
        let n_scale = match mode {
            TransportMode::Radiance => n_1,
            TransportMode::Importance => n_2,
        };
        Some(Evaluation {
            f: self.interface.tint * (4.0 * v_1 * v_2 * common * n_scale * n_scale),
            pdf: 2.0 * v_1 * common * n_2 * n_2,
            pdf_reverse: 2.0 * v_2 * common * n_1 * n_1,
        })
    }
}
