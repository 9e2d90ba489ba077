//! Random walks from the camera and from the lights, with the running quantities of the weights.
//!
//! Densities are evaluated again from the positions of the vertices, not taken from the sampling
//! routine: then each is a function of the path alone, both subpaths get the same bits for it, and
//! the weights of all techniques of a path sum to one to f64 precision.

use super::Tracer;
use super::edge::{Departure, EdgeEnd, OpenEdge};
use super::vertex::{EdgeRecord, LightVertex, Vertex};
use super::weight::{Partial, emitter_hit, light_image};
use crate::camera::{Camera, Endpoint};
use crate::emitter::EmissionSample;
use crate::geometry::ray::segment;
use crate::geometry::{Ray, SurfacePoint};
use crate::math::{Rgb, Sampler};
use crate::scatter::{Microfacet, TransportMode};
use crate::scene::media::MediumId;
use glam::Vec3;

/// Scattering events before Russian roulette begins. Three keeps the short paths, which carry most
/// of an image, free of roulette noise.
const ROULETTE_FREE_EVENTS: u32 = 3;

/// Square of the angle up to which a segment's direction is taken from its ends. Rounding of the ends bends by less than
/// this thousandth of a radian, unless the segment is shorter than some 1e-4 of the distance to the world's origin; the offset
/// of a ray's origin bends by more, where it is a thousandth of the segment.
const STRAIGHT: f32 = 1e-6;

/// A camera path that ran into a light: the technique s = 0.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// Throughput times emitted radiance.
    pub value: Rgb,
    /// The same without the colour of its band, if it met glass whose index varies.
    pub white: Rgb,
    /// Weight of s = 0.
    pub weight: f64,
    /// Weight of all techniques that need no light subpath (s <= 1) together.
    pub camera_only: f64,
    /// Segments from the camera to the light.
    pub segments: u32,
    /// Connectable camera vertices before the light.
    pub vertices: usize,
    /// The light vertex.
    pub light: LightVertex,
    /// Direction in which the light leaves it along the path.
    pub direction: Vec3,
    /// Whether more than mirrors and smooth glass is between the camera and it.
    pub scattered: bool,
    /// Medium through which it comes there.
    pub medium: MediumId,
    /// The macro-edge that leads to the light.
    pub edge: EdgeRecord,
    /// Closed at the light.
    pub partial: Partial,
}

/// The moving end of a subpath.
pub(super) struct Walk<'c> {
    /// The camera it started from, if it did.
    pub(super) camera: Option<&'c Camera>,
    pub(super) mode: TransportMode,
    pub(super) ray: Ray,
    pub(super) beta: Rgb,
    pub(super) medium: MediumId,
    pub(super) segments: u32,
    pub(super) max_segments: u32,
    pub(super) events: u32,
    /// Throughput relative to the start, radiance over n² in radiance mode: what roulette goes by.
    pub(super) roulette: Rgb,
    /// Density of what was drawn without any aim, over that with it.
    pub(super) plain: f64,
    /// Whether it went on otherwise than by a mirror or through smooth glass.
    pub(super) scattered: bool,
    /// Whether it met glass whose index varies.
    pub(super) dispersed: bool,
}

impl Tracer<'_> {
    /// Walks from the camera through `raster`; fills [`Self::camera_vertices`] and
    /// [`Self::emitter_hits`].
    pub fn trace_camera(
        &mut self,
        camera: &Camera,
        medium: Option<MediumId>,
        raster: glam::Vec2,
        sampler: &mut Sampler,
    ) {
        self.camera_vertices.clear();
        self.made[TransportMode::Radiance as usize].clear();
        self.emitter_hits.clear();
        let (origin, direction) = camera.generate(raster);
        let medium = medium.unwrap_or_else(|| self.world.medium_at(origin));
        self.camera_medium = medium;
        self.camera_hit = None;
        let mut edge = OpenEdge::new(Departure::Camera, origin, medium);
        edge.forward_is_area = true;
        let walk = Walk {
            camera: Some(camera),
            mode: TransportMode::Radiance,
            ray: Ray { origin, direction, t_max: f32::INFINITY },
            beta: Rgb::ONE,
            medium,
            segments: 0,
            max_segments: self.max_depth,
            events: 0,
            roulette: Rgb::ONE,
            plain: 1.0,
            scattered: false,
            dispersed: false,
        };
        self.walk(walk, edge, sampler);
    }

    /// Walks from a light; fills [`Self::light_start`] and [`Self::light_vertices`]. The walk is one
    /// segment shorter than the longest path, which the camera adds.
    pub fn trace_light(&mut self, sampler: &mut Sampler) {
        self.light_vertices.clear();
        self.made[TransportMode::Importance as usize].clear();
        self.light_start = None;
        if !self.world.requirements.lights || self.max_depth < 2 {
            return;
        }
        let u_light = sampler.next_1d();
        let (u_position, u_direction) = (sampler.next_2d(), sampler.next_2d());
        let u_aim = if self.lights.aims() { sampler.next_1d() } else { 0.0 };
        let shapes = &self.world.shapes;
        let Some(sample) = self.lights.sample_emission(shapes, u_light, u_position, u_direction, u_aim) else {
            return;
        };
        let back = matches!(&sample.at, Endpoint::Surface(at) if at.ng.dot(sample.direction) < 0.0);
        let medium = self.world.medium_of_light(sample.light, &sample.at, back);
        let (ray, origin) = match &sample.at {
            Endpoint::Surface(at) => (Ray::leaving(at, sample.direction), at.p),
            Endpoint::Point(p) => (Ray { origin: *p, direction: sample.direction, t_max: f32::INFINITY }, *p),
            Endpoint::Infinite(_) => {
                let origin = sample.origin;
                (Ray { origin, direction: sample.direction, t_max: f32::INFINITY }, origin)
            }
        };
        let EmissionSample { light, at, densities, .. } = sample;
        self.light_start = Some(LightVertex { light, at, through: origin, densities });
        let mut edge = OpenEdge::new(Departure::Light, origin, medium);
        edge.at_infinity = matches!(sample.at, Endpoint::Infinite(_));
        edge.forward_is_area = edge.at_infinity;
        let walk = Walk {
            camera: None,
            mode: TransportMode::Importance,
            ray,
            beta: sample.beta / self.light_subpaths as f32,
            medium,
            segments: 0,
            max_segments: self.max_depth - 1,
            events: 0,
            roulette: Rgb::ONE,
            plain: sample.plain,
            scattered: false,
            dispersed: false,
        };
        self.walk(walk, edge, sampler);
    }

    fn walk(&mut self, mut walk: Walk, mut edge: OpenEdge, sampler: &mut Sampler) {
        let world = self.world;
        while walk.segments < walk.max_segments {
            match (walk.mode, walk.segments) {
                (TransportMode::Radiance, 0) => self.rays.camera += 1,
                (TransportMode::Radiance, _) => self.rays.camera_path += 1,
                (TransportMode::Importance, _) => self.rays.light_path += 1,
            }
            walk.segments += 1;
            let Some(hit) = world.intersector.closest(&walk.ray) else {
                if walk.mode == TransportMode::Radiance && world.requirements.hittable_lights {
                    self.escape(&walk, &mut edge);
                }
                return;
            };
            let at = world.surface(&walk.ray, &hit);
            if walk.mode == TransportMode::Radiance && walk.segments == 1 {
                self.camera_hit = Some(at.p);
            }

            // The segment as both subpaths see it: from the positions of its ends.
            let (direction, distance_squared) = if edge.chain == 0 {
                if edge.at_infinity {
                    (walk.ray.direction, 0.0)
                } else {
                    let (d, d2) = segment(edge.origin, at.p);
                    // Ends that coincide see nothing of each other that can be weighed: a camera or a light in the plane
                    // of a surface, to within its rounding.
                    if !(d2 > 0.0) {
                        return;
                    }
                    // Across a gap as narrow as the offset of the ray's origin it is bent toward the normal: there, the
                    // sampled one.
                    let bend = (d - walk.ray.direction).length_squared();
                    (if bend < STRAIGHT { d } else { walk.ray.direction }, d2)
                }
            } else {
                (walk.ray.direction, 0.0)
            };
            if edge.chain == 0 {
                self.leave(&mut edge, &walk, direction, Some(distance_squared), at.p);
            }
            if world.requirements.absorption {
                let length = hit.t * walk.ray.direction.length();
                walk.beta *= world.transmittance(walk.medium, length);
            }

            let mut wo = -direction;
            let mut end =
                EdgeEnd { distance_squared, cos: at.ng.dot(wo).abs() as f64, at_infinity: false, medium: walk.medium };
            // A ray in the plane of the surface meets nothing that can be weighed.
            if !(end.cos > 0.0) {
                return;
            }
            if walk.mode == TransportMode::Radiance
                && let Some(light) = self.lights.of_shape(hit.shape)
            {
                self.hit_light(&walk, &mut edge, &mut end, light, &at, wo);
            }
            walk.dispersed |= self.disperses(hit.shape);
            let mut made = None;
            let bsdf = self.bsdf(&at, &mut made);
            if bsdf.connectable() {
                let place = Endpoint::Surface(at);
                let (partial, camera_only, record) =
                    self.close(&mut edge, &walk, &mut end, &place, self.light_subpaths, &mut wo);
                let (aimed, toward) = self.aimed(&at, wo, walk.mode);
                let made = (!std::ptr::eq(bsdf, self.factors(hit.shape))).then(|| {
                    let all = &mut self.made[walk.mode as usize];
                    all.push(bsdf.clone());
                    all.len() as u32 - 1
                });
                let vertex = Vertex {
                    at,
                    made,
                    wo,
                    beta: walk.beta,
                    partial,
                    camera_only,
                    segments: walk.segments,
                    medium: walk.medium,
                    aimed,
                    plain: walk.plain,
                    toward,
                    edge: record,
                    first: !matches!(edge.departure, Departure::Vertex { .. }),
                    passed: false,
                    dispersed: walk.dispersed,
                };
                match walk.mode {
                    TransportMode::Radiance => self.camera_vertices.push(vertex),
                    TransportMode::Importance => self.light_vertices.push(vertex),
                }
            }
            if walk.segments == walk.max_segments {
                return;
            }

            let (u_lobe, u) = (sampler.next_1d(), sampler.next_2d());
            let aimed = match self.light_vertices.last() {
                Some(vertex) if walk.mode == TransportMode::Importance && bsdf.connectable() => vertex.aimed,
                _ => 0.0,
            };
            let sample = match aimed {
                aimed if aimed > 0.0 => self.sample_aimed(bsdf, &at, wo, aimed, u_lobe, u),
                _ => bsdf.sample(&at, wo, walk.mode, u_lobe, u).map(|s| (s, 1.0)),
            };
            let Some((sample, plain)) = sample else { return };
            let wi = sample.wi;
            walk.beta *= sample.weight;
            walk.scattered |= sample.connectable || sample.microfacet.is_some();
            // By what it would be without aim, or roulette would kill what was aimed.
            walk.roulette *= sample.weight / plain;
            walk.plain *= f64::from(plain);
            let shading = at.ns != at.ng;
            // cos_s(prev) cos_g(next) / (cos_g(prev) cos_s(next)): Veach's adjoint factor A.
            let adjoint =
                if shading { (at.ns.dot(wo) * at.ng.dot(wi) / (at.ng.dot(wo) * at.ns.dot(wi))).abs() } else { 1.0 };
            if walk.mode == TransportMode::Importance {
                walk.beta *= adjoint;
                walk.roulette *= adjoint;
            }
            if let Some(boundary) = world.boundary(hit.shape).filter(|_| sample.transmitted) {
                let before = self.media[walk.medium as usize].ior;
                walk.medium = boundary.medium_toward(&at, wi);
                if walk.mode == TransportMode::Radiance {
                    let ratio = self.media[walk.medium as usize].ior / before;
                    walk.roulette *= ratio * ratio;
                }
            }
            if sample.connectable {
                let index = match walk.mode {
                    TransportMode::Radiance => self.camera_vertices.len() - 1,
                    TransportMode::Importance => self.light_vertices.len() - 1,
                };
                let departure = Departure::Vertex { index, sampled_density: sample.pdf };
                edge = OpenEdge::new(departure, at.p, walk.medium);
            } else {
                if bsdf.connectable()
                    && let Some(vertex) = match walk.mode {
                        TransportMode::Radiance => self.camera_vertices.last_mut(),
                        TransportMode::Importance => self.light_vertices.last_mut(),
                    }
                {
                    vertex.passed = true;
                }
                if edge.chain == 0
                    && let Some(boundary) = world.boundary(hit.shape).filter(|_| sample.transmitted)
                {
                    // As the connection has it. Where boundaries are closed, it is that already.
                    edge.medium = boundary.medium_toward(&at, wo);
                }
                edge.refracted &= sample.transmitted && world.boundary(hit.shape).is_some();
                let position = edge.chain as usize;
                if let Some(slot) = edge.shapes.get_mut(position) {
                    *slot = hit.shape;
                }
                edge.chain += 1;
                edge.probability = edge.probability.map(|p| p * f64::from(sample.pdf));
                // The factor of kappa: the normal that refracts is the microfacet's.
                let mut bent = adjoint;
                if let Some(Microfacet { normal, density }) = sample.microfacet {
                    for (p, density) in edge.probability.iter_mut().zip(density) {
                        *p *= f64::from(density);
                    }
                    bent = (normal.dot(wo) * at.ng.dot(wi) / (at.ng.dot(wo) * normal.dot(wi))).abs();
                    if let Some(slot) = self.microfacets.get_mut(position) {
                        *slot = [at.ns, normal * 1f32.copysign(normal.dot(at.ns))];
                    }
                }
                // kappa runs from the camera side; this is its factor for a camera walk.
                match walk.mode {
                    TransportMode::Radiance => edge.kappa *= f64::from(bent),
                    TransportMode::Importance => edge.kappa /= f64::from(bent),
                }
            }
            walk.events += 1;
            if walk.events > ROULETTE_FREE_EVENTS {
                // Left out of the weights on both sides, which keeps them functions of the path.
                let survival = walk.roulette.max_element().clamp(0.05, 1.0);
                if survival < 1.0 {
                    if sampler.next_1d() >= survival {
                        return;
                    }
                    walk.beta /= survival;
                    walk.roulette /= survival;
                }
            }
            if !(walk.beta.max_element() > 0.0) {
                return;
            }
            walk.ray = Ray::leaving(&at, wi);
        }
    }

    fn hit_light(
        &mut self,
        walk: &Walk,
        edge: &mut OpenEdge,
        end: &mut EdgeEnd,
        light: u32,
        at: &SurfacePoint,
        mut wo: Vec3,
    ) {
        // Next-event estimation draws from the last connectable vertex by its straight line.
        let Some((radiance, densities)) = self.lights.hit(&self.world.shapes, light, at, wo, edge.origin) else {
            return;
        };
        let place = Endpoint::Surface(*at);
        let (partial, _, record) = self.close(edge, walk, end, &place, edge.next_events(), &mut wo);
        let densities = if record.chain > 0 && record.technique > 0.0 {
            // The direction may have changed in its last bits.
            self.lights.densities(&self.world.shapes, light, &place, (wo, at.p), edge.origin)
        } else {
            densities
        };
        let vertex = LightVertex { light, at: place, through: at.p, densities };
        self.record_hit(walk, edge, (partial, record), radiance, wo, vertex);
    }

    fn escape(&mut self, walk: &Walk, edge: &mut OpenEdge) {
        let direction = walk.ray.direction;
        let Some((mut radiance, densities)) = self.lights.escape(walk.ray.origin, direction) else { return };
        if self.world.requirements.absorption {
            radiance *= self.world.transmittance(walk.medium, f32::INFINITY);
        }
        let Some(light) = self.lights.environment() else { return };
        if edge.chain == 0 && matches!(edge.departure, Departure::Vertex { .. }) {
            self.leave(edge, walk, direction, None, Vec3::ZERO);
        }
        let mut end = EdgeEnd { distance_squared: 0.0, cos: 1.0, at_infinity: true, medium: walk.medium };
        let place = Endpoint::Infinite(direction);
        let mut wo = -direction;
        let (partial, _, record) = self.close(edge, walk, &mut end, &place, edge.next_events(), &mut wo);
        let start = LightVertex { light, at: place, through: walk.ray.origin, densities };
        self.record_hit(walk, edge, (partial, record), radiance, -direction, start);
    }

    fn record_hit(
        &mut self,
        walk: &Walk,
        edge: &OpenEdge,
        (partial, record): (Partial, EdgeRecord),
        radiance: Rgb,
        direction: Vec3,
        light: LightVertex,
    ) {
        // A light that the camera sees directly, or through a chain, is left to s = 0 alone.
        let (weight, camera_only) = match edge.departure {
            Departure::Vertex { index, .. } => {
                let d = &light.densities;
                let gamma = partial.gamma * light_image(self.camera_vertices[index].first && record.sure);
                let partial = Partial { gamma, ..partial };
                let weight = emitter_hit(partial, d.direct, d.position, d.direction);
                (weight, weight * (1.0 + d.direct * partial.alpha))
            }
            _ => (1.0, 1.0),
        };
        let vertices = match edge.departure {
            Departure::Vertex { index, .. } => index + 1,
            _ => 0,
        };
        let white = walk.beta * radiance;
        self.emitter_hits.push(EmitterHit {
            value: white * self.color(walk.dispersed),
            white,
            weight,
            camera_only,
            segments: walk.segments,
            vertices,
            light,
            direction,
            scattered: walk.scattered,
            medium: walk.medium,
            edge: record,
            partial,
        });
    }
}
