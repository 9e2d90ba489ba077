//! Scattering at a surface: what a material does, as a mixture of lobes.
//!
//! Directions leave the surface, unit, world space. `wo` points to where the path came from, `wi` to
//! where it goes; densities are of `wi` given `wo`, per unit solid angle.
//!
//! Lobes live in the frame of the shading normal. A direction whose geometric and shading sides
//! disagree is neither sampled nor evaluated (Veach 1997, section 5.3).

pub mod fresnel;

mod conductor;
mod ggx;
mod lambert;
mod lobe;
mod metallic_roughness;
mod mixture;
mod rough_dielectric;
mod smooth_dielectric;
mod thin;

#[cfg(test)]
mod tests;

use crate::geometry::SurfacePoint;
use crate::math::{Frame, Rgb, warp};
use crate::scene::description::{Medium, Scattering};
use conductor::Reflectance;
use ggx::Ggx;
use glam::{Vec2, Vec3};
use lambert::Lambert;
use lobe::{DeltaSample, Lobe};
use mixture::Mixture;
use rough_dielectric::RoughDielectric;
use smooth_dielectric::{Interface, SmoothDielectric};
use thin::{RoughThin, Sheet, SmoothThin};

/// What the subpath carries; decides whether refraction scales by the squared index ratio.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// From the camera: the path carries importance, its throughput scales radiance.
    Radiance,
    /// From a light: the path carries power.
    Importance,
}

/// A sampled continuation.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Direction of the continuation.
    pub wi: Vec3,
    /// Connectable: `f cos_s / pdf`. Otherwise: the lobe's albedo over `pdf`. Without the
    /// shading-normal adjoint factor, which is transport's.
    pub weight: Rgb,
    /// Connectable: density of `wi`, all connectable lobes and their choice probabilities included.
    /// Otherwise: the discrete probability of this lobe and branch.
    pub pdf: f32,
    /// Whether the lobe is one that connections may evaluate; fixed for a lobe of a material.
    pub connectable: bool,
    /// Whether the path crossed the surface.
    pub transmitted: bool,
    /// Where it crossed a rough surface that walks lead through.
    pub microfacet: Option<Microfacet>,
}

/// A microfacet that was drawn by visible normals to be refracted at.
#[derive(Clone, Copy, Debug)]
pub struct Microfacet {
    /// Unit normal, on the side of `wo`.
    pub normal: Vec3,
    /// Density with which it is drawn from `wo`, and from `wi`, both over `D(h) |n.h|`.
    pub density: [f32; 2],
}

/// A refraction that walks lead through.
#[derive(Clone, Copy, Debug)]
pub struct Refraction {
    /// The lobe's share times its tint.
    pub albedo: Rgb,
    /// Probability of choosing the lobe.
    pub probability: f32,
    /// Width of the distribution of microfacet normals; 0 for a smooth surface.
    pub alpha: f32,
}

/// The connectable lobes' value and densities for a pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evaluation {
    /// The BSDF without cosine, 1/sr.
    pub f: Rgb,
    /// Density of `wi` given `wo`, lobe choice included.
    pub pdf: f32,
    /// Density of `wo` given `wi`, lobe choice included.
    pub pdf_reverse: f32,
}

/// A material, compiled for evaluation.
#[derive(Clone, Debug)]
pub struct Bsdf {
    /// Set if the material is this one lobe everywhere, the most frequent case and the cheapest.
    lambert: Option<Lambert>,
    mixture: Mixture,
    connectable: bool,
    has_delta: bool,
    media: Option<(Medium, Medium)>,
}

impl Bsdf {
    /// Compiles a validated description. What reflects nothing at all compiles to no lobes.
    pub fn new(scattering: &Scattering) -> Bsdf {
        let mut media = None;
        let mixture = match *scattering {
            Scattering::Diffuse { reflectance } if reflectance == Rgb::ZERO => Mixture::default(),
            Scattering::Diffuse { reflectance } => Mixture::one(Lobe::Lambert(Lambert { reflectance })),
            Scattering::Dielectric { inside, outside, roughness, tint } => {
                media = Some((inside, outside));
                Mixture::one(dielectric_lobe(inside.ior, outside.ior, roughness, tint))
            }
            Scattering::ThinDielectric { ior, roughness, tint } => Mixture::one(thin_lobe(ior, roughness, tint)),
            Scattering::Conductor { reflectance, roughness } => {
                Mixture::one(metallic_roughness::reflection_lobe(Reflectance::metal(reflectance), roughness))
            }
            Scattering::MetallicRoughness(ref m) => {
                media = metallic_roughness::media(m);
                metallic_roughness::compile(m)
            }
        };
        let lambert = match mixture.only() {
            Some(&Lobe::Lambert(l)) => Some(l),
            _ => None,
        };
        let connectable = mixture.lobes().any(Lobe::connectable);
        let has_delta = !mixture.lobes().all(Lobe::connectable);
        Bsdf { lambert, mixture, connectable, has_delta, media }
    }

    /// The same for what is another material at each point: [`Bsdf::evaluate_lambert`] evaluates nothing.
    pub fn varying(self) -> Bsdf {
        Bsdf { lambert: None, ..self }
    }

    /// Its colour, whatever the light and the angle: the shares of its lobes times what they reflect at normal incidence
    /// or let through, at most 1. A guide for the eye and for denoisers, no directional albedo.
    pub fn albedo(&self) -> Rgb {
        self.mixture.albedo()
    }

    /// Whether any lobe is connectable.
    #[inline]
    pub fn connectable(&self) -> bool {
        self.connectable
    }

    /// Whether any lobe is not connectable.
    #[inline]
    pub fn has_delta(&self) -> bool {
        self.has_delta
    }

    /// Whether all that it does is reflection that connections may evaluate.
    pub fn reflects_only(&self) -> bool {
        self.connectable && self.mixture.lobes().all(|lobe| lobe.connectable() && !lobe.transmits())
    }

    /// The refraction that walks lead through, if there is one: smooth, or of [`Bsdf::walked`]. A thin sheet
    /// bends nothing.
    #[inline]
    pub fn walked_refraction(&self) -> Option<Refraction> {
        self.media?;
        self.mixture.refraction()
    }

    /// The same material with walks through its rough refraction, if it has one of a perceptual roughness
    /// below `roughness`: sampled as before, and no longer connectable (Speierer et al. 2018, §3.2.2).
    pub fn walked(&self, roughness: f32) -> Option<Bsdf> {
        self.media?;
        let mut bsdf = self.clone();
        let any = bsdf.mixture.walk_rough(roughness * roughness);
        bsdf.has_delta |= any;
        any.then_some(bsdf)
    }

    /// Whether the material is plain Lambertian reflection and nothing else.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        matches!(self.mixture.only(), Some(Lobe::Lambert(_)))
    }

    /// The media behind and before the surface, if it is a boundary that refracts.
    #[inline]
    pub fn media(&self) -> Option<(Medium, Medium)> {
        self.media
    }

    /// Draws a continuation. `u_lobe` chooses the lobe and the branch, `u` the direction.
    #[inline]
    pub fn sample(&self, at: &SurfacePoint, wo: Vec3, mode: TransportMode, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let Some(lambert) = self.lambert else {
            return self.mixture.sample(at, wo, mode, u_lobe, u);
        };
        let sign = 1.0f32.copysign(side(at, wo)?);
        let wi = Frame::around(at.ns * sign).to_world(warp::cosine_hemisphere(u));
        let cos = side(at, wi)? * sign;
        (cos > 0.0).then(|| BsdfSample {
            wi,
            weight: lambert.reflectance,
            pdf: warp::cosine_hemisphere_pdf_w(cos),
            connectable: true,
            transmitted: false,
            microfacet: None,
        })
    }

    /// Value and densities of the connectable lobes; zero where the geometric and the shading side
    /// of either direction disagree.
    #[inline]
    pub fn evaluate(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3, mode: TransportMode) -> Evaluation {
        self.evaluate_lambert(at, wo, wi).unwrap_or_else(|| self.mixture.evaluate(at, wo, wi, mode))
    }

    /// The same of plain Lambertian reflection alone. Always inline: as a call it takes 2 % of a render of such surfaces.
    #[inline(always)]
    pub fn evaluate_lambert(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Option<Evaluation> {
        let lambert = self.lambert?;
        Some(match (side(at, wo), side(at, wi)) {
            (Some(o), Some(i)) if (o > 0.0) == (i > 0.0) => lambert.evaluate(o.abs(), i.abs()),
            _ => Evaluation::default(),
        })
    }
}

/// Signed cosine of `w` with the shading normal; `None` if `w` is on the other side of the surface
/// itself, or in it.
#[inline]
fn side(at: &SurfacePoint, w: Vec3) -> Option<f32> {
    let shading = w.dot(at.ns);
    (shading * w.dot(at.ng) > 0.0).then_some(shading)
}

/// The boundary of a solid, rough or smooth.
fn dielectric_lobe(inside: f32, outside: f32, roughness: f32, tint: Rgb) -> Lobe {
    let interface = Interface { inside, outside, tint };
    match RoughDielectric::new(interface, roughness) {
        Some(rough) => Lobe::RoughDielectric(rough),
        None => Lobe::SmoothDielectric(SmoothDielectric { interface }),
    }
}

/// A sheet, rough or smooth.
fn thin_lobe(ior: f32, roughness: f32, tint: Rgb) -> Lobe {
    let sheet = Sheet { ior, tint };
    match Ggx::new(roughness) {
        Some(ggx) => Lobe::RoughThin(RoughThin { sheet, ggx }),
        None => Lobe::SmoothThin(SmoothThin { sheet }),
    }
}
