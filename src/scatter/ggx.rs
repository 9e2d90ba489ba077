//! The GGX distribution of microfacet normals (Trowbridge and Reitz 1975; Walter et al. 2007), isotropic,
//! with Smith's separable masking-shadowing, as Walter et al. and the glTF specification use it.
//!
//! Local frame: the macroscopic normal is +z; `wo` and microfacet normals have z > 0.

use crate::scene::description::LEAST_TEXTURED_ROUGHNESS;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Narrower distributions than this are treated as smooth.
///
/// The half vector of two f32 directions is off by about 1e-7, and `D` changes by a share of up to
/// `2/alpha` per unit of it: 2e-4 here, and 2e-3, visible in densities, ten times below.
pub(super) const MIN_ALPHA: f32 = 1e-3;

const _: () = assert!(LEAST_TEXTURED_ROUGHNESS * LEAST_TEXTURED_ROUGHNESS >= MIN_ALPHA);

/// The distribution; `alpha` is the square of the perceptual roughness.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    alpha: f32,
}

/// Terms of the reflection between two directions above the surface.
pub(super) struct Reflection {
    /// `D G1(wo) G1(wi) / (4 cos_o cos_i)`: the BRDF without its Fresnel term.
    pub(super) value: f32,
    /// Density of `wi` by visible normals, and of `wo` seen from `wi`.
    pub(super) pdf: f32,
    pub(super) pdf_reverse: f32,
    /// Cosine of either direction with the microfacet normal.
    pub(super) cos_h: f32,
}

impl Ggx {
    /// For a perceptual roughness; `None` when that is so low that the surface is smooth.
    pub(super) fn new(roughness: f32) -> Option<Ggx> {
        let alpha = roughness * roughness;
        (alpha >= MIN_ALPHA).then_some(Ggx { alpha: alpha.min(1.0) })
    }

    /// Width parameter.
    pub(super) fn alpha(&self) -> f32 {
        self.alpha
    }

    /// Density of microfacet normals: per unit area of the surface and unit solid angle.
    #[inline]
    pub(super) fn d(&self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        // sin^2 + alpha^2 cos^2 in this form keeps its digits around the peak.
        let q = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
        a2 / (PI * q * q)
    }

    /// `G1(w) / (2 |w.z|)`, finite at the horizon.
    #[inline]
    pub(super) fn v(&self, w: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        1.0 / (w.z.abs() + (w.z * w.z + a2 * (w.x * w.x + w.y * w.y)).sqrt())
    }

    /// A normal visible from `wo`, with density `2 v(wo) (wo.h) d(h)`, by spherical caps (Dupuy and
    /// Benyoub 2023, "Sampling visible GGX normals with spherical caps").
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Vec3 {
        // Stretched so that the microsurface becomes a hemisphere, whose reflections of one direction
        // fill a spherical cap uniformly.
        let stretched = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let above = (1.0 - u.y) * (1.0 + stretched.z);
        let z = above - stretched.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (2.0 * PI * u.x).sin_cos();
        // The half vector of the cap's point and the direction, stretched back.
        let h = Vec3::new(self.alpha * (r * cos + stretched.x), self.alpha * (r * sin + stretched.y), above);
        h.normalize_or(Vec3::Z)
    }

    /// Terms for two directions above the surface; `None` if they have no half vector.
    #[inline]
    pub(super) fn reflection(&self, wo: Vec3, wi: Vec3) -> Option<Reflection> {
        let sum = wo + wi;
        let h = sum.try_normalize()?;
        // wo.h = wi.h, in the form that gives the same bits for both: the weights of a path compare
        // densities that were evaluated from either side.
        let cos_h = (0.5 * sum.length()).min(1.0);
        let (d, v_o, v_i) = (self.d(h), self.v(wo), self.v(wi));
        Some(Reflection { value: d * v_o * v_i, pdf: 0.5 * d * v_o, pdf_reverse: 0.5 * d * v_i, cos_h })
    }
}
