//! Random walks from the camera and from the lights, with the running quantities of the weights.
//!
//! Densities are evaluated again from the positions of the vertices, not taken from the sampling
//! routine: then each is a function of the path alone, both subpaths get the same bits for it, and
//! the weights of all techniques of a path sum to one to f64 precision.

use super::caustic::WalkCount;
use super::vertex::{EdgeRecord, LightVertex, Vertex};
use super::weight::{MacroEdge, Partial, emitter_hit};
use crate::camera::{Camera, Endpoint};
use crate::geometry::ray::segment;
use crate::geometry::{Ray, SurfacePoint};
use crate::manifold::MAX_CHAIN;
use crate::math::{Rgb, Sampler};
use crate::scatter::TransportMode;
use crate::scene::World;
use crate::scene::world::MediumId;
use glam::Vec3;

/// Scattering events before Russian roulette begins. Three keeps the short paths, which carry most
/// of an image, free of roulette noise.
const ROULETTE_FREE_EVENTS: u32 = 3;

/// A camera path that ran into a light: the technique s = 0.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// Throughput times emitted radiance.
    pub value: Rgb,
    /// Weight of s = 0.
    pub weight: f64,
    /// Segments from the camera to the light.
    pub segments: u32,
    /// Connectable camera vertices before the light.
    pub vertices: usize,
    /// The light vertex.
    pub light: LightVertex,
    /// Direction in which the light leaves it along the path.
    pub direction: Vec3,
    /// The macro-edge that leads to the light.
    pub edge: EdgeRecord,
    /// Closed at the light.
    pub partial: Partial,
}

/// Counts rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCount {
    /// Primary rays.
    pub camera: u64,
    /// Continuations of camera subpaths.
    pub camera_path: u64,
    /// Segments of light subpaths.
    pub light_path: u64,
    /// Visibility queries.
    pub shadow: u64,
    /// Rays of manifold walks.
    pub walk: u64,
}

impl RayCount {
    /// Rays of all kinds.
    pub fn total(&self) -> u64 {
        self.camera + self.camera_path + self.light_path + self.shadow + self.walk
    }
}

impl std::ops::Add for RayCount {
    type Output = RayCount;
    fn add(self, other: RayCount) -> RayCount {
        RayCount {
            camera: self.camera + other.camera,
            camera_path: self.camera_path + other.camera_path,
            light_path: self.light_path + other.light_path,
            shadow: self.shadow + other.shadow,
            walk: self.walk + other.walk,
        }
    }
}

impl std::ops::Sub for RayCount {
    type Output = RayCount;
    fn sub(self, earlier: RayCount) -> RayCount {
        RayCount {
            camera: self.camera - earlier.camera,
            camera_path: self.camera_path - earlier.camera_path,
            light_path: self.light_path - earlier.light_path,
            shadow: self.shadow - earlier.shadow,
            walk: self.walk - earlier.walk,
        }
    }
}

/// Traces subpaths; owns the arena of one worker, which is reused from sample to sample.
pub struct Tracer<'w> {
    /// The scene.
    pub world: &'w World,
    /// Longest full path, in segments.
    pub max_depth: u32,
    /// Camera subpath of the current sample.
    pub camera_vertices: Vec<Vertex>,
    /// Light subpath of the current sample, without its first vertex.
    pub light_vertices: Vec<Vertex>,
    /// Its first vertex.
    pub light_start: Option<LightVertex>,
    /// Hits of the camera subpath with lights.
    pub emitter_hits: Vec<EmitterHit>,
    /// Rays so far.
    pub rays: RayCount,
    /// Manifold walks so far.
    pub walks: WalkCount,
    /// Whether caustic connections are made.
    pub caustics: bool,
    /// Whether the camera is connected through glass (t = 1), see [`Tracer::new`].
    pub camera_caustics: bool,
    /// Camera subpaths alone: next-event estimation and hits are the only techniques.
    pub camera_only: bool,
}

/// From where a macro-edge leaves.
enum Departure {
    /// The camera. Its density is per perpendicular area at the next vertex.
    Camera,
    /// A light.
    Light,
    /// A connectable surface vertex: its index in the subpath, and the density of the direction as
    /// sampled, for the rare case that the rounded direction has none.
    Vertex { index: usize, sampled_density: f32 },
}

/// The macro-edge under construction.
struct OpenEdge {
    departure: Departure,
    /// Position of the old end; unused when it is at infinity.
    origin: Vec3,
    /// Density of the departure: per solid angle, or per perpendicular area from the camera or from
    /// infinity.
    forward: f64,
    forward_is_area: bool,
    /// The old vertex's `e` or `g`.
    remainder: f64,
    /// Geometric cosine at the old end; 1 at a point or at infinity.
    cos: f64,
    at_infinity: bool,
    medium: MediumId,
    chain: u32,
    probability: f64,
    kappa: f64,
    direction: Vec3,
    /// Shapes of the chain, as far as they fit.
    shapes: [u32; MAX_CHAIN],
    /// Whether the chain has nothing but refractions.
    refracted: bool,
}

impl OpenEdge {
    fn new(departure: Departure, origin: Vec3, medium: MediumId) -> OpenEdge {
        OpenEdge {
            departure,
            origin,
            forward: 0.0,
            forward_is_area: false,
            remainder: 0.0,
            cos: 1.0,
            at_infinity: false,
            medium,
            chain: 0,
            probability: 1.0,
            kappa: 1.0,
            direction: Vec3::ZERO,
            shapes: [0; MAX_CHAIN],
            refracted: true,
        }
    }

    /// Densities of the closed edge: (forward area density, reverse geometry), and the record.
    /// `cos_end` is 1 and `end` infinite for the environment.
    fn densities(&self, world: &World, mode: TransportMode, end: &EdgeEnd) -> (f64, f64, EdgeRecord) {
        let mut record = EdgeRecord {
            chain: self.chain,
            chain_probability: self.probability,
            etendue_ratio: 0.0,
            technique: 1.0,
            departure: self.direction,
        };
        let forward = self.forward * self.probability;
        if self.chain == 0 {
            let (to_end, to_start) = if end.at_infinity {
                (1.0, self.cos)
            } else {
                let d2 = end.distance_squared;
                let to_end = if self.forward_is_area { end.cos } else { end.cos / d2 };
                (to_end, if self.at_infinity { 1.0 } else { self.cos / d2 })
            };
            return (forward * to_end, to_start, record);
        }
        // Every technique but the one that spans the chain has either its forward or its reverse
        // density, and so the factor J = d omega_a / d A_b: it is left out of both, and the technique
        // across the chain counts 1/J instead. What remains is the étendue identity
        // n_b² cos_b J_ba = n_a² kappa cos_a J_ab.
        let index_squared = |m: MediumId| (world.media[m as usize].ior as f64).powi(2);
        let (start, here) = (index_squared(self.medium), index_squared(end.medium));
        match mode {
            TransportMode::Radiance => {
                record.etendue_ratio = start * self.kappa * self.cos / (here * end.cos);
                (forward, record.etendue_ratio * self.probability, record)
            }
            TransportMode::Importance => {
                record.etendue_ratio = here * self.kappa * end.cos / (start * self.cos);
                (forward * record.etendue_ratio, self.probability, record)
            }
        }
    }
}

/// The new end of a macro-edge.
struct EdgeEnd {
    distance_squared: f64,
    cos: f64,
    at_infinity: bool,
    medium: MediumId,
}

/// The moving end of a subpath.
struct Walk<'c> {
    /// The camera it started from, if it did.
    camera: Option<&'c Camera>,
    mode: TransportMode,
    ray: Ray,
    beta: Rgb,
    medium: MediumId,
    segments: u32,
    max_segments: u32,
    events: u32,
    /// Throughput relative to the start, radiance over n² in radiance mode: what roulette goes by.
    roulette: Rgb,
}

impl<'w> Tracer<'w> {
    /// An idle tracer.
    pub fn new(world: &'w World, max_depth: u32) -> Tracer<'w> {
        let room = (max_depth.min(64) + 1) as usize;
        Tracer {
            world,
            max_depth,
            camera_vertices: Vec::with_capacity(room),
            light_vertices: Vec::with_capacity(room),
            light_start: None,
            emitter_hits: Vec::with_capacity(room),
            rays: RayCount::default(),
            walks: WalkCount::default(),
            caustics: false,
            camera_caustics: false,
            camera_only: false,
        }
    }

    /// Walks from the camera through `raster`; fills [`Self::camera_vertices`] and
    /// [`Self::emitter_hits`].
    pub fn trace_camera(&mut self, camera: &Camera, medium: MediumId, raster: glam::Vec2, sampler: &mut Sampler) {
        self.camera_vertices.clear();
        self.emitter_hits.clear();
        let (origin, direction) = camera.generate(raster);
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
        };
        self.walk(walk, edge, sampler);
    }

    /// Walks from a light; fills [`Self::light_start`] and [`Self::light_vertices`]. The walk is one
    /// segment shorter than the longest path, which the camera adds.
    pub fn trace_light(&mut self, sampler: &mut Sampler) {
        self.light_vertices.clear();
        self.light_start = None;
        if !self.world.requirements.lights || self.max_depth < 2 {
            return;
        }
        let u_light = sampler.next_1d();
        let (u_position, u_direction) = (sampler.next_2d(), sampler.next_2d());
        let lights = &self.world.lights;
        let Some(sample) = lights.sample_emission(&self.world.shapes, u_light, u_position, u_direction) else {
            return;
        };
        let back = matches!(&sample.at, Endpoint::Surface(at) if at.ng.dot(sample.direction) < 0.0);
        let medium = self.world.light_media[sample.light as usize][back as usize];
        let (ray, origin) = match &sample.at {
            Endpoint::Surface(at) => (Ray::leaving(at, sample.direction), at.p),
            Endpoint::Point(p) => (Ray { origin: *p, direction: sample.direction, t_max: f32::INFINITY }, *p),
            Endpoint::Infinite(_) => {
                let origin = sample.origin;
                (Ray { origin, direction: sample.direction, t_max: f32::INFINITY }, origin)
            }
        };
        self.light_start = Some(LightVertex { light: sample.light, at: sample.at, densities: sample.densities });
        let mut edge = OpenEdge::new(Departure::Light, origin, medium);
        edge.at_infinity = matches!(sample.at, Endpoint::Infinite(_));
        edge.forward_is_area = edge.at_infinity;
        let walk = Walk {
            camera: None,
            mode: TransportMode::Importance,
            ray,
            beta: sample.beta,
            medium,
            segments: 0,
            max_segments: self.max_depth - 1,
            events: 0,
            roulette: Rgb::ONE,
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
            let at = world.shapes[hit.shape as usize].surface(&walk.ray, &hit);

            // The segment as both subpaths see it: from the positions of its ends.
            let (direction, distance_squared) = if edge.chain == 0 {
                if edge.at_infinity {
                    (walk.ray.direction, 0.0)
                } else {
                    let (d, d2) = segment(edge.origin, at.p);
                    // A coincidence of the ends has no direction; the sampled one will do.
                    if d2 > 0.0 { (d, d2) } else { (walk.ray.direction, d2) }
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
                && let Some(light) = world.lights.of_shape(hit.shape)
            {
                self.hit_light(&walk, &mut edge, &mut end, light, &at, wo);
            }
            let bsdf = world.bsdf(hit.shape);
            if bsdf.connectable() {
                let place = Endpoint::Surface(at);
                let (partial, record) = self.close(&mut edge, &walk, &mut end, &place, &mut wo);
                let vertex = Vertex {
                    at,
                    wo,
                    beta: walk.beta,
                    partial,
                    segments: walk.segments,
                    medium: walk.medium,
                    edge: record,
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
            let Some(sample) = bsdf.sample(&at, wo, walk.mode, u_lobe, u) else { return };
            let wi = sample.wi;
            walk.beta *= sample.weight;
            walk.roulette *= sample.weight;
            let shading = at.ns != at.ng;
            // cos_s(prev) cos_g(next) / (cos_g(prev) cos_s(next)): Veach's adjoint factor A.
            let adjoint =
                if shading { (at.ns.dot(wo) * at.ng.dot(wi) / (at.ng.dot(wo) * at.ns.dot(wi))).abs() } else { 1.0 };
            if walk.mode == TransportMode::Importance {
                walk.beta *= adjoint;
                walk.roulette *= adjoint;
            }
            if let Some(boundary) = world.boundary(hit.shape).filter(|_| sample.transmitted) {
                let before = world.media[walk.medium as usize].ior;
                walk.medium = boundary.medium_toward(&at, wi);
                if walk.mode == TransportMode::Radiance {
                    let ratio = world.media[walk.medium as usize].ior / before;
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
                edge.refracted &= sample.transmitted && world.boundary(hit.shape).is_some();
                if let Some(slot) = edge.shapes.get_mut(edge.chain as usize) {
                    *slot = hit.shape;
                }
                edge.chain += 1;
                edge.probability *= sample.pdf as f64;
                // kappa runs from the camera side; adjoint is its factor for a camera walk.
                match walk.mode {
                    TransportMode::Radiance => edge.kappa *= adjoint as f64,
                    TransportMode::Importance => edge.kappa /= adjoint as f64,
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

    /// Completes the old end of an edge, now that the direction out of it is known; `distance_squared`
    /// is that to the new end, or `None` across a chain or to infinity.
    fn leave(&self, edge: &mut OpenEdge, walk: &Walk, direction: Vec3, distance_squared: Option<f64>, receiver: Vec3) {
        edge.direction = direction;
        match edge.departure {
            Departure::Camera => {
                // At distance 1, the density per perpendicular area is that per solid angle.
                if let Some(camera) = walk.camera {
                    edge.forward = camera.density(direction, distance_squared.map_or(1.0, f64::sqrt) as f32);
                }
            }
            Departure::Light => {
                let Some(start) = &self.light_start else { return };
                let densities =
                    self.world.lights.densities(&self.world.shapes, start.light, &start.at, direction, receiver);
                edge.forward = densities.direction;
                if let Endpoint::Surface(at) = &start.at {
                    edge.cos = at.ng.dot(direction).abs() as f64;
                }
            }
            Departure::Vertex { index, sampled_density } => {
                let vertex = match walk.mode {
                    TransportMode::Radiance => &self.camera_vertices[index],
                    TransportMode::Importance => &self.light_vertices[index],
                };
                let bsdf = self.world.bsdf(vertex.at.shape);
                let value = bsdf.evaluate(&vertex.at, vertex.wo, direction, walk.mode);
                edge.forward = if value.pdf > 0.0 { value.pdf } else { sampled_density } as f64;
                edge.remainder = vertex.partial.at(value.pdf_reverse as f64);
                edge.cos = vertex.cos_g(direction) as f64;
            }
        }
    }

    /// Closes an edge at `end`, a vertex or light that is reached against the direction `wo`. Where a
    /// connection would have found the edge's chain, the connection's version of it replaces the
    /// sampled one, and `wo` with it: both are the same path, but for the rounding of the walk's f32
    /// positions, and now to the last bit.
    fn close(
        &mut self,
        edge: &mut OpenEdge,
        walk: &Walk,
        end: &mut EdgeEnd,
        at: &Endpoint,
        wo: &mut Vec3,
    ) -> (Partial, EdgeRecord) {
        let mut technique = if edge.chain == 0 { 1.0 } else { 0.0 };
        if edge.chain > 0 && self.caustics && edge.refracted && edge.chain as usize <= MAX_CHAIN {
            technique = self.confirm_edge(edge, walk, end, at, wo);
        }
        let (forward, reverse_geometry, mut record) = edge.densities(self.world, walk.mode, end);
        record.technique = technique;
        let receiver = match at {
            Endpoint::Surface(at) => at.p,
            Endpoint::Point(p) => *p,
            Endpoint::Infinite(_) => Vec3::ZERO,
        };
        let remainder = if self.camera_only { 0.0 } else { edge.remainder };
        let edge = match (&edge.departure, &self.light_start) {
            (Departure::Light, Some(start)) => {
                let lights = &self.world.lights;
                let direct = lights.direct_density(&self.world.shapes, start.light, &start.at, receiver);
                let (position, hittable) = (start.densities.position, start.densities.hittable);
                MacroEdge::from_light(technique, forward, reverse_geometry, direct, position, hittable)
            }
            _ => MacroEdge { technique, forward, reverse_geometry, remainder },
        };
        (edge.close(), record)
    }

    /// The end that an edge left; `None` where no connection from there is ever made through glass.
    fn start_of(&self, edge: &OpenEdge, mode: TransportMode) -> Option<Endpoint> {
        match &edge.departure {
            Departure::Camera if self.camera_caustics => Some(Endpoint::Point(edge.origin)),
            Departure::Camera => None,
            Departure::Light => self.light_start.as_ref().map(|l| l.at),
            Departure::Vertex { index, .. } => Some(Endpoint::Surface(match mode {
                TransportMode::Radiance => self.camera_vertices[*index].at,
                TransportMode::Importance => self.light_vertices[*index].at,
            })),
        }
    }

    /// The consistency check: `cos_b / J` if `S(camera side, light side)` is the sampled chain, else 0.
    fn confirm_edge(
        &mut self,
        edge: &mut OpenEdge,
        walk: &Walk,
        end: &mut EdgeEnd,
        at: &Endpoint,
        wo: &mut Vec3,
    ) -> f64 {
        let mode = walk.mode;
        let Some(start) = self.start_of(edge, mode) else { return 0.0 };
        let mut shapes = edge.shapes;
        let shapes = &mut shapes[..edge.chain as usize];
        let found = match mode {
            TransportMode::Radiance => self.confirm(&start, at, shapes, edge.direction, *wo),
            TransportMode::Importance => {
                shapes.reverse();
                self.confirm(at, &start, shapes, *wo, edge.direction)
            }
        };
        let Some(found) = found else { return 0.0 };
        let (departure, arrival) = match mode {
            TransportMode::Radiance => (found.first, found.last),
            TransportMode::Importance => (found.last, found.first),
        };
        let receiver = match at {
            Endpoint::Surface(at) => at.p,
            Endpoint::Point(p) => *p,
            Endpoint::Infinite(_) => Vec3::ZERO,
        };
        self.leave(edge, walk, departure, None, receiver);
        if let Endpoint::Surface(at) = at {
            end.cos = f64::from(at.ng.dot(arrival).abs());
        }
        *wo = arrival;
        edge.kappa = found.kappa;
        edge.probability = found.probability;
        let cos_b = match mode {
            TransportMode::Radiance => end.cos,
            TransportMode::Importance => edge.cos,
        };
        found.inverse_jacobian / cos_b
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
        let Some((radiance, densities)) = self.world.lights.hit(&self.world.shapes, light, at, wo, edge.origin) else {
            return;
        };
        let place = Endpoint::Surface(*at);
        let (partial, record) = self.close(edge, walk, end, &place, &mut wo);
        let densities = if record.chain > 0 && record.technique > 0.0 {
            // The direction may have changed in its last bits.
            self.world.lights.densities(&self.world.shapes, light, &place, wo, edge.origin)
        } else {
            densities
        };
        self.record_hit(walk, edge, (partial, record), radiance, wo, LightVertex { light, at: place, densities });
    }

    fn escape(&mut self, walk: &Walk, edge: &mut OpenEdge) {
        let direction = walk.ray.direction;
        let Some((radiance, densities)) = self.world.lights.escape(direction) else { return };
        let Some(light) = self.world.lights.environment() else { return };
        if edge.chain == 0 && matches!(edge.departure, Departure::Vertex { .. }) {
            self.leave(edge, walk, direction, None, Vec3::ZERO);
        }
        let mut end = EdgeEnd { distance_squared: 0.0, cos: 1.0, at_infinity: true, medium: walk.medium };
        let place = Endpoint::Infinite(direction);
        let mut wo = -direction;
        let (partial, record) = self.close(edge, walk, &mut end, &place, &mut wo);
        let start = LightVertex { light, at: place, densities };
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
        let weight = match edge.departure {
            Departure::Vertex { .. } => {
                let d = &light.densities;
                emitter_hit(partial, d.direct, d.position, d.direction)
            }
            _ => 1.0,
        };
        let vertices = match edge.departure {
            Departure::Vertex { index, .. } => index + 1,
            _ => 0,
        };
        self.emitter_hits.push(EmitterHit {
            value: walk.beta * radiance,
            weight,
            segments: walk.segments,
            vertices,
            light,
            direction,
            edge: record,
            partial,
        });
    }

    /// Whether the open segment is free of surfaces.
    #[inline]
    pub fn visible(&mut self, ray: &Ray) -> bool {
        self.rays.shadow += 1;
        !self.world.intersector.occluded(ray)
    }
}
