//! Light subpaths aimed at glass: light that a wall sends through glass is a small part of what leaves the wall,
//! and where caustics are it matters most. So a share of the directions in which light subpaths leave a
//! surface is drawn toward the glass, the others as ever; the density of the mixture enters all weights.
//! (Jensen 2001, §9.3, aims the emission of lights alone.)

use super::Tracer;
use super::vertex::{LightVertex, Vertex};
use crate::emitter::Lights;
use crate::geometry::{Aim, Reach, SurfacePoint, Targets};
use crate::math::Rgb;
use crate::scatter::{Bsdf, BsdfSample, Evaluation, TransportMode};
use crate::scene::World;
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Where light subpaths leave from, as their aim tells it apart: lights and shapes by number, as far as these go; beyond,
/// several share a class. More than any scene here has; 4 kB for each group of the samples that decide.
const LIGHTS: usize = 64;
const SHAPES: usize = 448;

/// Classes of places.
pub const CLASSES: usize = LIGHTS + SHAPES;

fn of_light(light: u32) -> usize {
    light as usize % LIGHTS
}

fn of_shape(shape: u32) -> usize {
    LIGHTS + shape as usize % SHAPES
}

/// The glass of a scene, as a target.
pub fn glass(world: &World) -> Arc<Targets> {
    Arc::new(Targets::new(world.walked_glass().bodies().iter().map(|r| (r.low, r.high, r.radius))))
}

/// The aim of a render's light subpaths.
#[derive(Clone, Debug)]
pub struct Aimed {
    /// All lights, with their emission aimed.
    pub lights: Arc<Lights>,
    /// The aim from surfaces, by shape.
    pub surfaces: Aim,
}

impl Aimed {
    /// At targets, from each class of places with a share of its own: from lights, and from surfaces that do nothing
    /// but reflect in a way that connections may evaluate.
    pub fn new(world: &World, targets: &Arc<Targets>, share: impl Fn(usize) -> f32) -> Aimed {
        let lights = (0..world.lights.len() as u32).map(|light| share(of_light(light)));
        let shapes = (0..).zip(&world.shape_material).map(|(shape, material)| {
            if world.bsdfs[*material as usize].reflects_only() { share(of_shape(shape)) } else { 0.0 }
        });
        Aimed {
            lights: Arc::new(world.lights.aimed(Aim::new(targets.clone(), lights.collect::<Vec<_>>()))),
            surfaces: Aim::new(targets.clone(), shapes.collect::<Vec<_>>()),
        }
    }
}

/// The vertices of a light subpath, each with the class of the place before it and the density with which it would have
/// been drawn there without aim, over that with it.
pub fn departures<'a>(start: &LightVertex, vertices: &'a [Vertex]) -> impl Iterator<Item = (usize, f64)> + use<'a> {
    let mut place = (of_light(start.light), 1.0);
    vertices.iter().map(move |v| {
        let (class, before) = place;
        place = (of_shape(v.at.shape), v.plain);
        (class, v.plain / before)
    })
}

impl Tracer<'_> {
    /// Aims the light subpaths.
    pub fn aim_at(&mut self, aimed: &Aimed) {
        self.lights = aimed.lights.clone();
        self.aim = Some(aimed.surfaces.clone());
    }

    /// For a new vertex: [`Vertex::aimed`] and [`Vertex::toward`].
    #[inline]
    pub(super) fn aimed(&self, at: &SurfacePoint, wo: Vec3, mode: TransportMode) -> (f64, f64) {
        let Some(aim) = self.aim.as_ref().filter(|aim| aim.share(at.shape) > 0.0) else { return (0.0, 0.0) };
        let reach = reach(at, wo);
        let aimed = aim.targets().total(at.p, &reach);
        let back = mode == TransportMode::Radiance && aimed > 0.0;
        (aimed, if back { aim.targets().density(at.p, &reach, aimed, wo) } else { 0.0 })
    }

    /// Scattering at a vertex between its `wo` and `w`, with the densities of this tracer's subpaths.
    #[inline(always)]
    pub fn evaluate(&self, vertex: &Vertex, w: Vec3, mode: TransportMode) -> Evaluation {
        let plain = self.factors(vertex.at.shape);
        let lambert = if vertex.aimed > 0.0 { None } else { plain.evaluate_lambert(&vertex.at, vertex.wo, w) };
        lambert.unwrap_or_else(|| self.evaluate_any(vertex, w, mode))
    }

    fn evaluate_any(&self, vertex: &Vertex, w: Vec3, mode: TransportMode) -> Evaluation {
        let mut e = self.material(vertex, mode).evaluate(&vertex.at, vertex.wo, w, mode);
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
        mix(aim.share(at.shape), plain, aim.targets().density(at.p, &reach(at, wo), aimed, w))
    }

    /// Draws the continuation of a light subpath; beside it, its density without aim over that with it.
    pub(super) fn sample_aimed(
        &self,
        bsdf: &Bsdf,
        at: &SurfacePoint,
        wo: Vec3,
        aimed: f64,
        u_lobe: f32,
        u: Vec2,
    ) -> Option<(BsdfSample, f32)> {
        let aim = self.aim.as_ref()?;
        let mode = TransportMode::Importance;
        let share = aim.share(at.shape);
        let sample = if u_lobe < share {
            let wi = aim.targets().sample(at.p, &reach(at, wo), aimed, u_lobe / share, u)?;
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
fn reach(at: &SurfacePoint, wo: Vec3) -> Reach {
    Reach::above(at.ng * 1f32.copysign(at.ng.dot(wo)))
}
