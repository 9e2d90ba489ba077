//! Light subpaths aimed at glass: light that a wall sends through glass is a small part of what leaves the wall,
//! and where caustics are it matters most. So a share of the directions in which light subpaths leave a
//! surface is drawn toward the glass, the others as ever; the density of the mixture enters all weights.
//! (Jensen 2001, §9.3, aims the emission of lights alone.)

use super::Tracer;
use super::vertex::{LightVertex, Vertex};
use crate::geometry::{Aim, Sight, SurfacePoint, Targets};
use crate::math::Rgb;
use crate::scatter::{BsdfSample, Evaluation, TransportMode};
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Where light subpaths leave from, as their aim tells it apart: lights and shapes by number, as far as these go.
const LIGHTS: usize = 64;
const SHAPES: usize = 448;

/// For each class of places that light subpaths leave from, the share that is aimed.
#[derive(Clone, Debug, PartialEq)]
pub struct Shares(Box<[f32]>);

impl Shares {
    /// Classes.
    pub const COUNT: usize = LIGHTS + SHAPES;

    /// By class.
    pub fn new(share: impl Fn(usize) -> f32) -> Shares {
        Shares((0..Shares::COUNT).map(share).collect())
    }

    /// Whether nothing is aimed.
    pub fn none(&self) -> bool {
        self.0.iter().all(|share| *share == 0.0)
    }

    fn of_light(&self, light: u32) -> f32 {
        self.0[light as usize % LIGHTS]
    }

    fn of_shape(&self, shape: u32) -> f32 {
        self.0[LIGHTS + shape as usize % SHAPES]
    }
}

/// The vertices of a light subpath, each with the class of the place before it and the density with which it would have
/// been drawn there without aim, over that with it.
pub fn departures<'a>(start: &LightVertex, vertices: &'a [Vertex]) -> impl Iterator<Item = (usize, f64)> + use<'a> {
    let mut place = (start.light as usize % LIGHTS, 1.0);
    vertices.iter().map(move |v| {
        let (class, before) = place;
        place = (LIGHTS + v.at.shape as usize % SHAPES, v.plain);
        (class, v.plain / before)
    })
}

impl Tracer<'_> {
    /// Aims shares of what light subpaths draw, at lights and at surfaces that reflect and are not smooth.
    pub fn aim_at_glass(&mut self, by_class: &Shares) {
        let world = self.world;
        let glass = world.walked.as_ref().map_or(&world.refractors, |w| &w.refractors);
        let targets = Arc::new(Targets::new(glass.iter().map(|r| (r.low, r.high, r.radius))));
        let shares = (0..).zip(&world.shape_material).map(|(shape, m)| {
            let bsdf = &world.bsdfs[*m as usize];
            let reflects = bsdf.connectable() && !bsdf.has_delta() && bsdf.media().is_none();
            if reflects { by_class.of_shape(shape) } else { 0.0 }
        });
        let of_lights = (0..world.lights.len() as u32).map(|light| by_class.of_light(light));
        self.lights = Arc::new(world.lights.aimed(Aim::new(targets.clone(), of_lights.collect::<Vec<_>>())));
        self.aim = Some(Aim::new(targets, shares.collect::<Vec<_>>()));
    }

    /// For a new vertex: [`Vertex::aimed`] and [`Vertex::toward`].
    #[inline]
    pub(super) fn aimed(&self, at: &SurfacePoint, wo: Vec3, mode: TransportMode) -> (f64, f64) {
        let Some(aim) = self.aim.as_ref().filter(|aim| aim.share(at.shape) > 0.0) else { return (0.0, 0.0) };
        let sight = sight(at, wo);
        let aimed = aim.targets().total(at.p, &sight);
        let back = mode == TransportMode::Radiance && aimed > 0.0;
        (aimed, if back { aim.targets().density(at.p, &sight, aimed, wo) } else { 0.0 })
    }

    /// Scattering at a vertex between its `wo` and `w`, with the densities of this tracer's subpaths.
    #[inline]
    pub fn evaluate(&self, vertex: &Vertex, w: Vec3, mode: TransportMode) -> Evaluation {
        let mut e = self.bsdf(vertex.at.shape).evaluate(&vertex.at, vertex.wo, w, mode);
        if vertex.aimed > 0.0
            && e.f != Rgb::ZERO
            && let Some(aim) = &self.aim
        {
            let share = aim.share(vertex.at.shape);
            match mode {
                TransportMode::Importance => e.pdf = self.mixed(&vertex.at, vertex.wo, vertex.aimed, w, e.pdf),
                TransportMode::Radiance => e.pdf_reverse = mix(share, e.pdf_reverse, vertex.toward),
            }
        }
        e
    }

    /// Density with which light leaves a surface along `w`, of which `plain` is that of its scattering.
    #[inline]
    fn mixed(&self, at: &SurfacePoint, wo: Vec3, aimed: f64, w: Vec3, plain: f32) -> f32 {
        let Some(aim) = &self.aim else { return plain };
        mix(aim.share(at.shape), plain, aim.targets().density(at.p, &sight(at, wo), aimed, w))
    }

    /// Draws the continuation of a light subpath; beside it, its density without aim over that with it.
    pub(super) fn sample_aimed(
        &self,
        at: &SurfacePoint,
        wo: Vec3,
        aimed: f64,
        u_lobe: f32,
        u: Vec2,
    ) -> Option<(BsdfSample, f32)> {
        let aim = self.aim.as_ref()?;
        let (bsdf, mode) = (self.bsdf(at.shape), TransportMode::Importance);
        let share = aim.share(at.shape);
        let sample = if u_lobe < share {
            let wi = aim.targets().sample(at.p, &sight(at, wo), aimed, u)?;
            let e = bsdf.evaluate(at, wo, wi, mode);
            if !(e.pdf > 0.0) {
                return None;
            }
            let weight = e.f * (at.ns.dot(wi).abs() / e.pdf);
            BsdfSample { wi, weight, pdf: e.pdf, connectable: true, transmitted: false, microfacet: None }
        } else {
            bsdf.sample(at, wo, mode, (u_lobe - share) / (1.0 - share), u)?
        };
        let pdf = self.mixed(at, wo, aimed, sample.wi, sample.pdf);
        let plain = sample.pdf / pdf;
        Some((BsdfSample { weight: sample.weight * plain, pdf, ..sample }, plain))
    }
}

#[inline]
fn mix(share: f32, plain: f32, toward: f64) -> f32 {
    (1.0 - share) * plain + share * toward as f32
}

/// The side of `wo`.
#[inline]
fn sight(at: &SurfacePoint, wo: Vec3) -> Sight {
    Sight::above(at.ng * 1f32.copysign(at.ng.dot(wo)))
}
