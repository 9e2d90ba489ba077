//! Path tracing with next-event estimation (Kajiya 1986; the two techniques of each path combined by
//! the balance heuristic, Veach and Guibas 1995). Shares the scattering functions and the light
//! sampling with the bidirectional path tracer, and none of its weights: it is its oracle.

use super::bdpt::View;
use super::feature::color_scale;
use super::{Feature, Sample};
use crate::camera::Endpoint;
use crate::geometry::Ray;
use crate::math::{Rgb, Sampler, Stream};
use crate::scatter::TransportMode;
use crate::transport::Tracer;
use glam::Vec3;

/// Scattering events before Russian roulette begins.
const ROULETTE_FREE_EVENTS: u32 = 3;

/// One sample of one pixel; of caustic paths alone (see [`super::Contribution::is_caustic`]) if
/// `caustics_only`.
pub fn sample(
    tracer: &mut Tracer,
    view: &View,
    seed: u64,
    pixel: u32,
    index: u32,
    caustics_only: bool,
    out: &mut Sample,
) {
    let number = view.number(pixel);
    tracer.begin(seed, number, index);
    let mut numbers = Sampler::new(seed, number, index, Stream::Camera);
    let mut connect_numbers = Sampler::new(seed, number, index, Stream::Connect);
    let raster = view.raster(seed, pixel, index);
    let camera = view.camera.sample(&mut numbers);
    let (origin, direction) = camera.generate(raster);
    let world = tracer.world;
    let mut ray = Ray { origin, direction, t_max: f32::INFINITY };
    let mut beta = Rgb::ONE;
    let mut roulette = Rgb::ONE;
    (out.radiance, out.covered) = (Rgb::ZERO, true);
    let mut medium = view.medium.unwrap_or_else(|| world.medium_at(origin));
    let start = medium;
    // Density of the last direction if it came from a connectable lobe, and the vertex it left.
    let mut sampled: Option<(f32, Vec3)> = None;
    // What is seen, and whether it is still looked for.
    let (mut feature, mut seeing) = (Feature::default(), out.feature.is_some());
    // Whether a connectable vertex came before, and a chain after one.
    let (mut seen, mut caustic) = (false, false);

    // Whether the path met glass whose index varies over the spectrum.
    let mut dispersed = false;

    let share = |caustic| if caustic || !caustics_only { 1.0 } else { 0.0 };
    for depth in 1..=tracer.max_depth {
        match depth {
            1 => tracer.rays.camera += 1,
            _ => tracer.rays.camera_path += 1,
        }
        let Some(hit) = world.intersector.closest(&ray) else {
            out.covered &= depth > 1;
            if out.transparent && depth == 1 {
                break;
            }
            if let Some((emitted, densities)) = world.lights.escape(ray.origin, ray.direction) {
                if world.requirements.absorption {
                    beta *= world.transmittance(medium, f32::INFINITY);
                }
                if seeing {
                    feature.see(beta * emitted * color_scale(tracer.media, start, medium), Vec3::ZERO, Vec3::ZERO);
                }
                let weight = sampled.map_or(1.0, |(pdf, _)| pdf as f64 / (pdf as f64 + densities.direct));
                out.add(beta * emitted * weight as f32 * share(caustic) * tracer.color(dispersed), seen);
            }
            break;
        };
        let at = world.surface(&ray, &hit);
        let wo = -ray.direction;
        if seeing && depth == 1 {
            feature.depth = Some(camera.depth(at.p));
        }
        if world.requirements.absorption {
            beta *= world.transmittance(medium, hit.t);
        }
        if let Some(light) = world.lights.of_shape(hit.shape) {
            let receiver = sampled.map_or(ray.origin, |(_, p)| p);
            if let Some((emitted, densities)) = world.lights.hit(&world.shapes, light, &at, wo, receiver) {
                if seeing {
                    feature.see(beta * emitted * color_scale(tracer.media, start, medium), at.ns, wo);
                }
                let weight = sampled.map_or(1.0, |(pdf, p)| {
                    let to_area = at.ng.dot(wo).abs() as f64 / (at.p - p).as_dvec3().length_squared();
                    let pdf_a = pdf as f64 * to_area;
                    pdf_a / (pdf_a + densities.direct)
                });
                out.add(beta * emitted * weight as f32 * share(caustic) * tracer.color(dispersed), seen);
            }
        }
        dispersed |= tracer.disperses(hit.shape);
        let mut place = None;
        let bsdf = tracer.bsdf(&at, &mut place);
        if seeing && bsdf.connectable() {
            feature.see(beta * bsdf.albedo() * color_scale(tracer.media, start, medium), at.ns, wo);
            seeing = false;
        }
        if depth == tracer.max_depth {
            break;
        }
        if bsdf.connectable() && world.requirements.lights {
            let (u_light, u) = (connect_numbers.next_1d(), connect_numbers.next_2d());
            if let Some(light) = world.lights.sample_direct(&world.shapes, at.p, u_light, u) {
                let scattering = bsdf.evaluate(&at, wo, light.wi, TransportMode::Radiance);
                let mut value = beta * scattering.f * at.ns.dot(light.wi).abs() * light.incident;
                if value.max_element() > 0.0 {
                    let (segment, length, to_light) = match &light.at {
                        Endpoint::Surface(y) => {
                            let d2 = (y.p - at.p).as_dvec3().length_squared();
                            let to_light = y.ng.dot(light.wi).abs() as f64 / d2;
                            (Ray::between(&at, y), d2.sqrt() as f32, to_light)
                        }
                        Endpoint::Point(p) => (Ray::to_point(&at, *p), (*p - at.p).length(), 0.0),
                        Endpoint::Infinite(w) => (Ray::leaving(&at, *w), f32::INFINITY, 1.0),
                    };
                    if tracer.visible(&segment) {
                        let inside = world.boundary(hit.shape).map_or(medium, |b| b.medium_toward(&at, light.wi));
                        if world.requirements.absorption {
                            value *= world.transmittance(inside, length);
                        }
                        let d = &light.densities;
                        let hit_density = if d.hittable { scattering.pdf as f64 * to_light } else { 0.0 };
                        out.add(
                            value
                                * (d.direct / (d.direct + hit_density)) as f32
                                * share(caustic)
                                * tracer.color(dispersed),
                            true,
                        );
                    }
                }
            }
        }
        let (u_lobe, u) = (numbers.next_1d(), numbers.next_2d());
        let Some(next) = bsdf.sample(&at, wo, TransportMode::Radiance, u_lobe, u) else { break };
        beta *= next.weight;
        roulette *= next.weight;
        sampled = next.connectable.then_some((next.pdf, at.p));
        caustic |= seen && !next.connectable;
        seen |= next.connectable;
        if let Some(boundary) = world.boundary(hit.shape).filter(|_| next.transmitted) {
            let before = tracer.media[medium as usize].ior;
            medium = boundary.medium_toward(&at, next.wi);
            // Roulette goes by radiance over n², or paths would die of entering glass.
            roulette *= (tracer.media[medium as usize].ior / before).powi(2);
        }
        if depth > ROULETTE_FREE_EVENTS {
            let survival = roulette.max_element().clamp(0.05, 1.0);
            if survival < 1.0 {
                if numbers.next_1d() >= survival {
                    break;
                }
                beta /= survival;
                roulette /= survival;
            }
        }
        if !(beta.max_element() > 0.0) {
            break;
        }
        ray = Ray::leaving(&at, next.wi);
    }
    out.feature = out.feature.map(|_| feature);
}
