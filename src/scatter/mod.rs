//! Scattering at a surface: what a material does, as a mixture of lobes.
//!
//! Directions leave the surface, unit, world space. `wo` points to where the path came from, `wi` to
//! where it goes; densities are of `wi` given `wo`, per unit solid angle.

use crate::geometry::SurfacePoint;
use crate::math::Rgb;
use crate::scene::description::Scattering;
use glam::{Vec2, Vec3};

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
pub struct Bsdf {}

impl Bsdf {
    /// Compiles a validated description.
    pub fn new(_scattering: &Scattering) -> Bsdf {
        todo!()
    }

    /// Whether any lobe is connectable.
    #[inline]
    pub fn connectable(&self) -> bool {
        todo!()
    }

    /// Draws a continuation. `u_lobe` chooses the lobe and the branch, `u` the direction.
    pub fn sample(
        &self,
        _at: &SurfacePoint,
        _wo: Vec3,
        _mode: TransportMode,
        _u_lobe: f32,
        _u: Vec2,
    ) -> Option<BsdfSample> {
        todo!()
    }

    /// Value and densities of the connectable lobes; zero where the geometric and the shading side
    /// of either direction disagree.
    pub fn evaluate(&self, _at: &SurfacePoint, _wo: Vec3, _wi: Vec3, _mode: TransportMode) -> Evaluation {
        todo!()
    }
}
