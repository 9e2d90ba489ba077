//! The techniques that join a camera subpath and a light subpath: next-event estimation (s = 1),
//! connection of two vertices (s, t >= 2), and connection of a light vertex to the camera (t = 1).
//!
//! Each leaves its paths in [`Tracer::joined`]: none, one, or through glass one for each chain. A pair is
//! first tested for a zero of its scattering functions, then for visibility.

use super::caustic::CausticEdge;
use super::experience::Place;
use super::sight::Sight;
use super::vertex::LightVertex;
use super::{Tracer, weight};
use crate::camera::{Camera, Endpoint};
use crate::emitter::LightDensities;
use crate::geometry::Ray;
use crate::geometry::ray::segment;
use crate::math::{Rgb, Sampler};
use crate::scatter::TransportMode;
use glam::Vec2;

/// A full path made by joining subpaths.
#[derive(Clone, Copy, Debug)]
pub struct Joined {
    /// Contribution to the measurement, without the weight.
    pub value: Rgb,
    /// Balance-heuristic weight of the technique.
    pub weight: f64,
    /// Weight of all techniques that need no light subpath (s <= 1) together.
    pub camera_only: f64,
    /// Their product. Finite also at a caustic, where the value is infinite and the weight zero.
    pub weighted: Rgb,
    /// The chain that a caustic connection went through.
    pub chain: Option<CausticEdge>,
    /// Densities at the light vertex, if that was drawn for this path (s = 1).
    pub densities: Option<LightDensities>,
    /// Where it falls on the film, if that is the technique's choice (t = 1).
    pub raster: Vec2,
}

impl Joined {
    fn regular(value: Rgb, weight: f64, camera_only: f64) -> Joined {
        Joined {
            value,
            weight,
            camera_only,
            weighted: value * weight as f32,
            chain: None,
            densities: None,
            raster: Vec2::ZERO,
        }
    }

    /// From the value without its factor `J`, and the densities of this technique, `own`, and of all
    /// others together, over `J` as it enters the weights.
    fn caustic(value: Rgb, cos_b: f64, own: f64, others: f64, camera_only: f64, chain: &CausticEdge) -> Joined {
        let own = own * chain.presumed;
        let scale = |x: f64| (value.as_dvec3() * x).as_vec3();
        let own_here = own * chain.weight_inverse_jacobian / cos_b;
        // Exactly 1 with the exact term, also at a caustic.
        let off = if chain.weight_inverse_jacobian == chain.inverse_jacobian {
            1.0
        } else {
            chain.weight_inverse_jacobian / chain.inverse_jacobian
        };
        Joined {
            value: scale(cos_b / chain.inverse_jacobian),
            weight: own_here / (own_here + others),
            camera_only: camera_only / (own_here + others),
            weighted: scale(off * own / (own_here + others)),
            chain: Some(*chain),
            densities: None,
            raster: Vec2::ZERO,
        }
    }

    /// Of a technique that roulette tries with the probability `1 / attempt`.
    fn attempted(self, attempt: f32) -> Joined {
        Joined { value: self.value * attempt, weighted: self.weighted * attempt, ..self }
    }
}

/// The straight line between two ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Line {
    /// Not looked at: no glass can be on it, or roulette left it out.
    Unseen,
    /// Nothing is on it.
    Clear,
    /// Something is, and what leads through it is joined.
    Decided,
}

impl Tracer<'_> {
    /// Next-event estimation at camera vertex `index`: a light vertex drawn for this receiver.
    #[inline]
    pub fn next_event(&mut self, index: usize, sampler: &mut Sampler) -> Option<LightVertex> {
        self.joined.clear();
        let world = self.world;
        let a = self.camera_vertices[index];
        let (u_light, u) = (sampler.next_1d(), sampler.next_2d());
        let regular = self.regular_next_event(index, u_light, u);
        if self.caustics {
            let (light, at, direct) = self.lights.sample_vertex(&world.shapes, a.at.p, u_light, u)?;
            let (segments, places) = (a.segments, [Place::Shape(a.at.shape), Place::Light(light)]);
            let (ends, straight) = ([Endpoint::Surface(a.at), at], regular.as_ref().map(|r| &r.0));
            let mut found = None;
            let line = self.join_ends(&ends, places, straight, index, segments, |tracer, chain, attempt| {
                found = tracer.caustic_next_event(index, light, at, direct, chain, attempt).or(found);
            });
            match line {
                Line::Clear => {
                    let (joined, light, _) = regular?;
                    self.joined.push(joined);
                    return Some(light);
                }
                Line::Decided => return found,
                Line::Unseen => {}
            }
        }
        let (joined, light, ray) = regular?;
        if self.visible(&ray) {
            self.joined.push(joined);
        }
        Some(light)
    }

    /// Algorithm 1 between two ends (Speierer et al. 2018, §3), which `vertices` and `segments` precede in their subpaths:
    /// what refracting surfaces on the straight line lead to, `join` takes, with the factor of roulette. `straight` is what
    /// that line itself would give.
    #[inline]
    fn join_ends(
        &mut self,
        [a, b]: &[Endpoint; 2],
        places: [Place; 2],
        straight: Option<&Joined>,
        vertices: usize,
        segments: u32,
        mut join: impl FnMut(&mut Self, &CausticEdge, f32),
    ) -> Line {
        let Some(ray) = self.toward_glass(a, b) else { return Line::Unseen };
        let Some(attempt) = self.attempt(places, straight, vertices) else { return Line::Unseen };
        match self.sight(ray, a, b) {
            Sight::Clear => return Line::Clear,
            Sight::Refracted(mut seen) if segments + seen.segments() <= self.max_depth => {
                for chain in self.connect_chains(a, b, &mut seen).into_iter().flatten() {
                    join(self, &chain, attempt.scale);
                }
            }
            Sight::Blocked | Sight::Refracted(_) => {}
        }
        self.learn(&attempt);
        Line::Decided
    }

    /// The path along the straight line, if nothing is on it. As a call it takes 3 % of a render without glass.
    #[inline(always)]
    fn join_straight(&mut self, regular: Option<(Joined, Ray)>, line: Line) {
        let Some((joined, ray)) = regular else { return };
        if line == Line::Clear || line == Line::Unseen && self.visible(&ray) {
            self.joined.push(joined);
        }
    }

    /// Next-event estimation along the straight line, if that is free: the ray.
    #[inline]
    fn regular_next_event(&self, index: usize, u_light: f32, u: Vec2) -> Option<(Joined, LightVertex, Ray)> {
        let (world, a) = (self.world, &self.camera_vertices[index]);
        let light = self.lights.sample_direct(&world.shapes, a.at.p, u_light, u)?;
        let scattering = self.evaluate(a, light.wi, TransportMode::Radiance);
        let mut value = a.beta * scattering.f * a.cos_s(light.wi) * light.incident * self.color(a.dispersed);
        if !(value.max_element() > 0.0) {
            return None;
        }
        // From a density at one end to the density at the other.
        let cos_a = a.cos_g(light.wi) as f64;
        let (ray, to_light, to_a) = match &light.at {
            Endpoint::Surface(y) => {
                let d2 = segment(a.at.p, y.p).1;
                (Ray::between(&a.at, y), y.ng.dot(light.wi).abs() as f64 / d2, cos_a / d2)
            }
            Endpoint::Point(p) => (Ray::to_point(&a.at, *p), 0.0, cos_a / segment(a.at.p, *p).1),
            Endpoint::Infinite(direction) => (Ray::leaving(&a.at, *direction), 1.0, cos_a),
        };
        if world.requirements.absorption {
            let length = match &light.at {
                Endpoint::Surface(y) => (y.p - a.at.p).length(),
                Endpoint::Point(p) => (*p - a.at.p).length(),
                Endpoint::Infinite(_) => f32::INFINITY,
            };
            value *= world.transmittance(a.medium_toward(world, light.wi), length);
        }
        let d = &light.densities;
        let remainder = a.partial.at(scattering.pdf_reverse as f64);
        let emission = d.position * d.direction * to_a * remainder * weight::light_image(a.first);
        let hit = if d.hittable { scattering.pdf as f64 * to_light } else { 0.0 };
        let weight = weight::next_event(1.0, d.direct, emission, hit);
        let camera_only = weight * (1.0 + hit / d.direct);
        let vertex = LightVertex { light: light.light, at: light.at, through: a.at.p, densities: *d };
        Some((Joined::regular(value, weight, camera_only), vertex, ray))
    }

    /// Connection of camera vertex `i` with light vertex `j`.
    #[inline]
    pub fn connect(&mut self, i: usize, j: usize) {
        self.joined.clear();
        let regular = self.regular_connect(i, j);
        let mut line = Line::Unseen;
        if self.caustics {
            let (a, b) = (&self.camera_vertices[i], &self.light_vertices[j]);
            let (ends, segments) = ([Endpoint::Surface(a.at), Endpoint::Surface(b.at)], a.segments + b.segments);
            let places = [Place::Shape(a.at.shape), Place::Shape(b.at.shape)];
            let straight = regular.as_ref().map(|r| &r.0);
            line = self.join_ends(&ends, places, straight, i + j + 1, segments, |tracer, chain, attempt| {
                tracer.caustic_connect(i, j, chain, attempt);
            });
        }
        self.join_straight(regular, line);
    }

    /// Connection along the straight line, if that is free: the ray.
    #[inline]
    fn regular_connect(&self, i: usize, j: usize) -> Option<(Joined, Ray)> {
        let world = self.world;
        let (a, b) = (&self.camera_vertices[i], &self.light_vertices[j]);
        let (w, d2) = segment(a.at.p, b.at.p);
        if !(d2 > 0.0) {
            return None;
        }
        let at_a = self.evaluate(a, w, TransportMode::Radiance);
        if at_a.f == Rgb::ZERO {
            return None;
        }
        let at_b = self.evaluate(b, -w, TransportMode::Importance);
        if at_b.f == Rgb::ZERO {
            return None;
        }
        let cos_a = a.cos_g(w) as f64 / d2;
        let cos_b = b.cos_g(w) as f64 / d2;
        let geometry = a.cos_s(w) * cos_b as f32 * b.incident_adjoint();
        let mut value = a.beta * at_a.f * at_b.f * b.beta * geometry * self.color(a.dispersed || b.dispersed);
        if !(value.max_element() > 0.0) {
            return None;
        }
        if world.requirements.absorption {
            value *= world.transmittance(a.medium_toward(world, w), d2.sqrt() as f32);
        }
        // R_i e_i and F_{i+1} g_{i+1}.
        let camera_side = at_b.pdf as f64 * cos_a * a.partial.at(at_a.pdf_reverse as f64);
        let to_light = at_a.pdf as f64 * cos_b;
        let light_side = to_light * b.partial.at(at_b.pdf_reverse as f64);
        let weight = weight::connection(self.light_subpaths, camera_side, light_side);
        let camera_only = weight * to_light * b.camera_only.at(at_b.pdf_reverse as f64) / self.light_subpaths;
        Some((Joined::regular(value, weight, camera_only), Ray::between(&a.at, &b.at)))
    }

    /// Connection of light vertex `j` with the camera: the light image's share.
    #[inline]
    pub fn to_camera(&mut self, camera: &Camera, j: usize) {
        self.joined.clear();
        let regular = self.regular_to_camera(camera, j);
        let mut line = Line::Unseen;
        if self.camera_caustics {
            let b = &self.light_vertices[j];
            let (ends, segments) = ([camera.endpoint(), Endpoint::Surface(b.at)], b.segments);
            let (places, straight) = ([Place::Camera, Place::Shape(b.at.shape)], regular.as_ref().map(|r| &r.0));
            line = self.join_ends(&ends, places, straight, j + 1, segments, |tracer, chain, attempt| {
                tracer.caustic_to_camera(camera, j, chain, attempt);
            });
        }
        self.join_straight(regular, line);
    }

    /// `a_0` of a path whose light subpath ends at its vertex `j`.
    #[inline]
    fn light_images(&self, j: usize) -> f64 {
        let vertex = &self.light_vertices[j];
        self.light_subpaths * weight::light_image(vertex.first && vertex.edge.sure)
    }

    /// Connection with the camera along the straight line, if that is free: the ray.
    #[inline]
    fn regular_to_camera(&self, camera: &Camera, j: usize) -> Option<(Joined, Ray)> {
        let world = self.world;
        let b = &self.light_vertices[j];
        let seen = camera.connect(b.at.p)?;
        let scattering = self.evaluate(b, seen.wi, TransportMode::Importance);
        let forward = seen.density * b.cos_g(seen.wi) as f64;
        let mut value = b.beta * scattering.f * (forward as f32 * b.incident_adjoint()) * self.color(b.dispersed);
        if !(value.max_element() > 0.0) {
            return None;
        }
        if world.requirements.absorption {
            let medium = b.medium_toward(world, seen.wi);
            value *= world.transmittance(medium, (seen.target - b.at.p).length());
        }
        let light_side = forward * b.partial.at(scattering.pdf_reverse as f64);
        let number = self.light_images(j);
        let weight = weight::connection(number, 0.0, light_side);
        let camera_only = weight * forward * b.camera_only.at(scattering.pdf_reverse as f64) / number;
        let joined = Joined { raster: seen.raster, ..Joined::regular(value, weight, camera_only) };
        Some((joined, Ray::to_point(&b.at, seen.target)))
    }

    /// Whether the index of some glass along it varies.
    fn chain_disperses(&self, chain: &CausticEdge) -> bool {
        chain.shapes[..chain.len].iter().any(|&shape| self.disperses(shape))
    }

    /// Next-event estimation through glass: manifold next-event estimation (Hanika et al. 2015).
    fn caustic_next_event(
        &mut self,
        index: usize,
        light: u32,
        at: Endpoint,
        direct: f64,
        chain: &CausticEdge,
        attempt: f32,
    ) -> Option<LightVertex> {
        let (world, a) = (self.world, &self.camera_vertices[index]);
        let emitted = self.lights.emitted(&world.shapes, light, &at, chain.last);
        let scattering = self.evaluate(a, chain.first, TransportMode::Radiance);
        let radiance = emitted * chain.transmittance * chain.index_ratio as f32;
        let color = self.color(a.dispersed || self.chain_disperses(chain));
        let value = a.beta * scattering.f * a.cos_s(chain.first) * radiance * color;
        if !(value.max_element() > 0.0) {
            return None;
        }
        let densities = self.lights.densities(&world.shapes, light, &at, (chain.last, chain.exit), a.at.p);
        let cos_a = f64::from(a.cos_g(chain.first));
        let cos_b = match &at {
            Endpoint::Surface(y) => f64::from(y.ng.dot(chain.last).abs()),
            Endpoint::Point(_) | Endpoint::Infinite(_) => 1.0,
        };
        let image = weight::light_image(a.first && chain.sure());
        let remainder = a.partial.at(f64::from(scattering.pdf_reverse)) * image;
        let [toward_light, toward_camera] = chain.probability;
        let emission = densities.position * densities.direction * toward_camera * chain.etendue_ratio(cos_a, cos_b);
        let hit = if densities.hittable { f64::from(scattering.pdf) * toward_light } else { 0.0 };
        let others = emission * remainder + hit;
        let camera_only = direct * chain.presumed * chain.weight_inverse_jacobian / cos_b + hit;
        let joined = Joined::caustic(value / direct as f32, cos_b, direct, others, camera_only, chain);
        self.joined.push(Joined { densities: Some(densities), ..joined.attempted(attempt * chain.attempt) });
        Some(LightVertex { light, at, through: chain.exit, densities })
    }

    /// Connection of two surface vertices through glass.
    fn caustic_connect(&mut self, i: usize, j: usize, chain: &CausticEdge, attempt: f32) {
        let (a, b) = (&self.camera_vertices[i], &self.light_vertices[j]);
        let at_a = self.evaluate(a, chain.first, TransportMode::Radiance);
        let at_b = self.evaluate(b, chain.last, TransportMode::Importance);
        let geometry = a.cos_s(chain.first) * b.incident_adjoint() * chain.index_ratio as f32;
        let color = self.color(a.dispersed || b.dispersed || self.chain_disperses(chain));
        let value = a.beta * at_a.f * chain.transmittance * at_b.f * b.beta * geometry * color;
        if !(value.max_element() > 0.0) {
            return;
        }
        let (cos_a, cos_b) = (f64::from(a.cos_g(chain.first)), f64::from(b.cos_g(chain.last)));
        let [toward_light, toward_camera] = chain.probability;
        let camera_side = f64::from(at_b.pdf)
            * toward_camera
            * chain.etendue_ratio(cos_a, cos_b)
            * a.partial.at(f64::from(at_a.pdf_reverse));
        let to_light = f64::from(at_a.pdf) * toward_light;
        let others = camera_side + to_light * b.partial.at(f64::from(at_b.pdf_reverse));
        let camera_only = to_light * b.camera_only.at(f64::from(at_b.pdf_reverse));
        let joined = Joined::caustic(value, cos_b, self.light_subpaths, others, camera_only, chain);
        self.joined.push(joined.attempted(attempt * chain.attempt));
    }

    /// Connection of light vertex `j` with a pinhole through glass.
    fn caustic_to_camera(&mut self, camera: &Camera, j: usize, chain: &CausticEdge, attempt: f32) {
        let b = &self.light_vertices[j];
        let Some(raster) = camera.raster_of(chain.first) else { return };
        // Per solid angle at the pinhole.
        let density = camera.density(chain.first, 1.0);
        let at_b = self.evaluate(b, chain.last, TransportMode::Importance);
        let scale = density as f32 * b.incident_adjoint() * chain.index_ratio as f32;
        let color = self.color(b.dispersed || self.chain_disperses(chain));
        let value = chain.transmittance * at_b.f * b.beta * scale * color;
        if !(value.max_element() > 0.0) {
            return;
        }
        let cos_b = f64::from(b.cos_g(chain.last));
        let forward = density * chain.probability[0];
        let light_side = forward * b.partial.at(f64::from(at_b.pdf_reverse));
        let camera_only = forward * b.camera_only.at(f64::from(at_b.pdf_reverse));
        let number = self.light_images(j);
        let joined = Joined::caustic(value, cos_b, number, light_side, camera_only, chain);
        self.joined.push(Joined { raster, ..joined.attempted(attempt * chain.attempt) });
    }
}
