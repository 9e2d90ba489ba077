//! The techniques that join a camera subpath and a light subpath: next-event estimation (s = 1),
//! connection of two vertices (s, t >= 2), and connection of a light vertex to the camera (t = 1).
//!
//! Each returns the unweighted contribution and its weight, or nothing; a pair is first tested for a
//! zero of its scattering functions, then for visibility.

use super::vertex::LightVertex;
use super::{Tracer, weight};
use crate::camera::{Camera, Endpoint};
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
}

impl Tracer<'_> {
    /// Next-event estimation at camera vertex `index`: a light vertex drawn for this receiver.
    #[inline]
    pub fn next_event(&mut self, index: usize, sampler: &mut Sampler) -> Option<(Joined, LightVertex)> {
        let world = self.world;
        let a = self.camera_vertices[index];
        let (u_light, u) = (sampler.next_1d(), sampler.next_2d());
        let light = world.lights.sample_direct(&world.shapes, a.at.p, u_light, u)?;
        let scattering = world.bsdf(a.at.shape).evaluate(&a.at, a.wo, light.wi, TransportMode::Radiance);
        let mut value = a.beta * scattering.f * a.cos_s(light.wi) * light.incident;
        if !(value.max_element() > 0.0) {
            return None;
        }
        let ray = match &light.at {
            Endpoint::Surface(y) => Ray::between(&a.at, y),
            Endpoint::Point(p) => Ray::to_point(&a.at, *p),
            Endpoint::Infinite(direction) => Ray::leaving(&a.at, *direction),
        };
        if !self.visible(&ray) {
            return None;
        }
        // From a density at one end to the density at the other.
        let cos_a = a.cos_g(light.wi) as f64;
        let (to_light, to_a) = match &light.at {
            Endpoint::Surface(y) => {
                let d2 = segment(a.at.p, y.p).1;
                (y.ng.dot(light.wi).abs() as f64 / d2, cos_a / d2)
            }
            Endpoint::Point(p) => (0.0, cos_a / segment(a.at.p, *p).1),
            Endpoint::Infinite(_) => (1.0, cos_a),
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
        let emission = d.position * d.direction * to_a * a.partial.at(scattering.pdf_reverse as f64);
        let hit = if d.hittable { scattering.pdf as f64 * to_light } else { 0.0 };
        let weight = weight::next_event(1.0, d.direct, emission, hit);
        Some((Joined { value, weight }, LightVertex { light: light.light, at: light.at, densities: *d }))
    }

    /// Connection of camera vertex `i` with light vertex `j`.
    #[inline]
    pub fn connect(&mut self, i: usize, j: usize) -> Option<Joined> {
        let world = self.world;
        let (a, b) = (&self.camera_vertices[i], &self.light_vertices[j]);
        let (w, d2) = segment(a.at.p, b.at.p);
        if !(d2 > 0.0) {
            return None;
        }
        let at_a = world.bsdf(a.at.shape).evaluate(&a.at, a.wo, w, TransportMode::Radiance);
        if at_a.f == Rgb::ZERO {
            return None;
        }
        let at_b = world.bsdf(b.at.shape).evaluate(&b.at, b.wo, -w, TransportMode::Importance);
        if at_b.f == Rgb::ZERO {
            return None;
        }
        let cos_a = a.cos_g(w) as f64 / d2;
        let cos_b = b.cos_g(w) as f64 / d2;
        let geometry = a.cos_s(w) * cos_b as f32 * b.incident_adjoint();
        let mut value = a.beta * at_a.f * at_b.f * b.beta * geometry;
        if !(value.max_element() > 0.0) {
            return None;
        }
        if world.requirements.absorption {
            value *= world.transmittance(a.medium_toward(world, w), d2.sqrt() as f32);
        }
        // R_i e_i and F_{i+1} g_{i+1}.
        let camera_side = at_b.pdf as f64 * cos_a * a.partial.at(at_a.pdf_reverse as f64);
        let light_side = at_a.pdf as f64 * cos_b * b.partial.at(at_b.pdf_reverse as f64);
        let ray = Ray::between(&a.at, &b.at);
        if !self.visible(&ray) {
            return None;
        }
        Some(Joined { value, weight: weight::connection(1.0, camera_side, light_side) })
    }

    /// Connection of light vertex `j` with the camera: the light image's share, and where it falls.
    #[inline]
    pub fn to_camera(&mut self, camera: &Camera, j: usize) -> Option<(Joined, Vec2)> {
        let world = self.world;
        let b = &self.light_vertices[j];
        let seen = camera.connect(b.at.p)?;
        let scattering = world.bsdf(b.at.shape).evaluate(&b.at, b.wo, seen.wi, TransportMode::Importance);
        let forward = seen.density * b.cos_g(seen.wi) as f64;
        let mut value = b.beta * scattering.f * (forward as f32 * b.incident_adjoint());
        if !(value.max_element() > 0.0) {
            return None;
        }
        if world.requirements.absorption {
            let medium = b.medium_toward(world, seen.wi);
            value *= world.transmittance(medium, (seen.target - b.at.p).length());
        }
        let light_side = forward * b.partial.at(scattering.pdf_reverse as f64);
        let ray = Ray::to_point(&b.at, seen.target);
        if !self.visible(&ray) {
            return None;
        }
        Some((Joined { value, weight: weight::connection(1.0, 0.0, light_side) }, seen.raster))
    }
}
