//! The glTF material as a sum of lobes: Khronos glTF 2.0 specification, appendix B, with
//! `KHR_materials_ior`, `_specular`, `_transmission` and `_volume`.
//!
//! ```text
//! metallic * metal + (1 - metallic) * ((1 - transmission) * (coat over diffuse) + transmission * glass)
//! ```
//!
//! *Metal*: GGX reflection, Schlick's term from the base colour. *Coat*: GGX reflection with `specular *
//! schlick(f0)`, `f0 = min(((ior-1)/(ior+1))^2 * specular_color, 1)`, at the half vector. *Glass*: the
//! exact terms of [`super::rough_dielectric`] or [`super::thin`], tinted by the base colour; `specular`
//! and `specular_color` do not act on it, for no boundary refracts all it receives.
//!
//! One departure: the specification's example scales the *diffuse* base by `1 - F(V.H)`. At grazing
//! incidence V.H is not small for most directions, so that a smooth coat reflects everything and the
//! base nearly everything again: 1.9 times the light that came. Here the base is scaled by `1 - F` at
//! the more grazing of the two directions (never more than the example's, as `V.H >= min(N.V, N.L)`),
//! which is as reciprocal and never exceeds 1.

use super::conductor::{Mirror, Reflectance, RoughConductor};
use super::ggx::Ggx;
use super::lambert::{CoatedLambert, Lambert};
use super::lobe::Lobe;
use super::mixture::Mixture;
use super::{dielectric_lobe, thin_lobe};
use crate::math::{Rgb, luminance};
use crate::scene::description::{Medium, MetallicRoughness};

/// A reflection that grows to 1 at grazing incidence is drawn at least this often per unit of share,
/// so that its weights there stay bounded.
const MIN_IMPORTANCE: f32 = 0.25;

/// What is inside and outside, if the material is the boundary of a solid.
pub(super) fn media(m: &MetallicRoughness) -> Option<(Medium, Medium)> {
    let refracts = m.solid && m.transmission > 0.0 && m.metallic < 1.0;
    refracts.then_some((Medium { ior: m.ior, absorption: m.absorption, abbe: m.abbe }, Medium::VACUUM))
}

/// The lobes.
pub(super) fn compile(m: &MetallicRoughness) -> Mixture {
    let mut mixture = Mixture::default();
    let dielectric = 1.0 - m.metallic;
    let opaque = dielectric * (1.0 - m.transmission);

    let metal = Reflectance::metal(m.base_color);
    mixture.add(reflection_lobe(metal, m.roughness), m.metallic, importance(metal.mean()));

    let f0 = (Rgb::splat(((m.ior - 1.0) / (m.ior + 1.0)).powi(2)) * m.specular_color).min(Rgb::ONE);
    let coat = Reflectance { f0: f0 * m.specular, f90: m.specular };
    let base = Lambert { reflectance: m.base_color };
    if m.specular > 0.0 {
        mixture.add(reflection_lobe(coat, m.roughness), opaque, importance(coat.mean()));
        let coated = CoatedLambert { base, f0: coat.f0.max_element(), f90: coat.f90 };
        mixture.add(Lobe::CoatedLambert(coated), opaque, luminance(m.base_color));
    } else {
        mixture.add(Lobe::Lambert(base), opaque, luminance(m.base_color));
    }

    let glass = match media(m) {
        Some((inside, outside)) => dielectric_lobe(inside.ior, outside.ior, m.roughness, m.base_color),
        None => thin_lobe(m.ior, m.roughness, m.base_color),
    };
    mixture.add(glass, dielectric * m.transmission, importance(m.base_color));
    mixture.normalised()
}

fn importance(albedo: Rgb) -> f32 {
    luminance(albedo).max(MIN_IMPORTANCE)
}

/// Reflection only, rough or smooth.
pub(super) fn reflection_lobe(reflectance: Reflectance, roughness: f32) -> Lobe {
    match Ggx::new(roughness) {
        Some(ggx) => Lobe::RoughConductor(RoughConductor { ggx, reflectance }),
        None => Lobe::Mirror(Mirror { reflectance }),
    }
}
