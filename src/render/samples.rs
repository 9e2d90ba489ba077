//! One sample of one pixel, as a request wants it: its camera, its tracer, its integrator.

use super::pilot::Pilot;
use super::{Caustics, Integrator, Settings};
use crate::camera::{Camera, Endpoint};
use crate::integrator::bdpt::{self, View};
use crate::integrator::{Observer, Sample, light};
use crate::math::{Sampler, Stream, pixel_position};
use crate::scene::World;
use crate::transport::Tracer;
use glam::UVec2;

pub(super) fn connects_through_glass(world: &World, settings: &Settings) -> bool {
    world.requirements.caustics
        && match settings.integrator {
            Integrator::Path | Integrator::Light => false,
            Integrator::Mnee => true,
            Integrator::Bdpt => settings.caustics != Caustics::Off,
        }
}

/// Points at which a lens, or the film of a parallel projection, is asked for its medium. A corner of a few thousandths of
/// it can be missed.
const PROBES: u32 = 1024;

/// The camera of a validated request.
pub(super) fn view(world: &World, settings: &Settings) -> View {
    let region = settings.region();
    let camera = Camera::new(&settings.camera(world), settings.width, settings.height, region);
    let [corner, size] = [[region.x, region.y], [region.width, region.height]].map(|side| UVec2::from(side).as_vec2());
    let at = |i| {
        let camera = camera.sample(&mut Sampler::new(0, 0, i, Stream::Camera));
        world.medium_at(camera.generate(corner + pixel_position(0, 0, i) * size).0)
    };
    let first = at(0);
    let one = camera.is_point() || !world.requirements.media || (1..PROBES).all(|i| at(i) == first);
    View { medium: one.then_some(first), camera, columns: settings.width, region }
}

/// A worker's tracer.
pub(super) fn tracer<'w>(world: &'w World, view: &View, settings: &Settings, pilot: &Pilot) -> Tracer<'w> {
    let mut tracer = Tracer::new(world, settings.max_depth);
    tracer.light_subpaths = pilot.light_subpaths;
    if pilot.connects {
        tracer.connect_through_glass();
    }
    // The camera's own path crosses glass before the camera at no cost; only where a light cannot be hit
    // does the connection find paths that nothing else finds.
    tracer.camera_caustics = pilot.connects
        && settings.integrator == Integrator::Bdpt
        && world.requirements.delta_lights
        && matches!(view.camera.endpoint(), Endpoint::Point(_));
    tracer.options = settings.caustic_options;
    tracer.seeds = pilot.seeds;
    tracer.search = pilot.search;
    if settings.integrator == Integrator::Mnee {
        // As it was published: one chain for each pair of ends.
        tracer.options.search.get_or_insert(0.0);
    }
    if let Some(aim) = &pilot.aim {
        tracer.aim_at(aim);
    }
    tracer.experience = pilot.experience.clone();
    tracer
}

/// An empty sample, with the limits of a request.
pub(super) fn empty(settings: &Settings) -> Sample {
    let sample = Sample::default();
    Sample { most: settings.clamp.unwrap_or(sample.most), transparent: settings.transparent, ..sample }
}

/// One sample of a technique-wise integrator.
pub(super) fn estimate<O: Observer>(
    tracer: &mut Tracer,
    view: &View,
    settings: &Settings,
    pixel: u32,
    pass: u32,
    sample: &mut Sample,
    observer: &mut O,
) {
    match settings.integrator {
        Integrator::Light => light::sample(tracer, view, settings.seed, pixel, pass, sample, observer),
        _ => bdpt::sample(tracer, view, settings.seed, pixel, pass, sample, observer),
    }
}
