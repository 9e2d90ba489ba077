//! One render request.

use super::output::Output;
use super::passes::{Passes, TechniqueSplat, Tile};
use super::pilot;
use super::preview::Preview;
use super::settings::validate;
use super::{Integrator, RenderError, Settings, samples};
use crate::integrator::{Contribution, Feature, Observer, Sample, Splat, path};
use crate::pool;
use crate::scene::World;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Asks a running render to stop; shared between threads.
#[derive(Debug, Default)]
pub struct Cancel(pub(super) AtomicBool);

impl Cancel {
    /// Asks. Idempotent.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// `[0, 1]`, never falling; 1 only at success.
    pub fraction: f32,
    /// Whole passes (samples per pixel) in the film.
    pub samples: u32,
    /// Rays traced so far.
    pub rays: u64,
    /// Since the start.
    pub elapsed: Duration,
    /// Estimated relative standard error of the image, from what its later
    /// passes differ from the first ones; NaN before the second pass.
    pub noise: f32,
}

/// Sorts the paths of a sample for a tile.
struct Sorter<'a> {
    tile: &'a mut Tile,
    pixel: u32,
    /// Into images per technique.
    per_technique: bool,
    /// And there caustic paths alone.
    caustics_only: bool,
    /// The sum of caustic paths.
    caustics: Sample,
}

impl Observer for Sorter<'_> {
    fn observe(&mut self, c: &Contribution) {
        let caustic = c.is_caustic();
        if caustic {
            self.caustics.cut += c.cut;
        }
        if caustic && c.t == 1 {
            self.caustics.splats.push(Splat { pixel: c.pixel, value: c.weighted });
        } else if caustic {
            debug_assert_eq!(c.pixel, self.pixel);
            self.caustics.radiance += c.weighted;
        }
        let shown = self.per_technique && (caustic || !self.caustics_only);
        if shown && c.value.is_finite() && c.weighted.is_finite() {
            if self.tile.techniques.try_reserve(1).is_err() {
                self.tile.out_of_memory = true;
                return;
            }
            self.tile.techniques.push(TechniqueSplat {
                technique: (c.s, c.t),
                pixel: c.pixel,
                weighted: c.weighted,
                unweighted: c.value,
                caustic,
            });
        }
    }
}

/// Renders. Blocks until done or cancelled; `progress` is called from one of the workers at a time,
/// at most ten times a second, and at the end.
///
/// The image is a function of the scene and of the settings other than `threads` and `time_limit`,
/// bit for bit: samples are numbered by (pixel, pass), and added in the order of their numbers. Makes of
/// processor differ in the last place of what Embree hits.
pub fn render(
    world: &World,
    settings: &Settings,
    cancel: &Cancel,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Output, RenderError> {
    render_shown(world, settings, cancel, progress, &Preview::default())
}

/// The same, which `preview` shows while it runs, and until it is closed.
pub fn render_shown(
    world: &World,
    settings: &Settings,
    cancel: &Cancel,
    progress: &(dyn Fn(Progress) + Sync),
    preview: &Preview,
) -> Result<Output, RenderError> {
    validate(world, settings)?;
    let start = Instant::now();
    let threads = pool::thread_count(settings.threads);
    let view = samples::view(world, settings);
    let passes = Arc::new(Passes::new(settings, threads)?);
    preview.show(&passes);
    let rays = AtomicU64::new(0);
    progress(Progress { fraction: 0.0, samples: 0, rays: 0, elapsed: start.elapsed(), noise: f32::NAN });
    let last_report = Mutex::new((Instant::now(), 0.0f32));
    // Whoever finds a report due makes it; the lock keeps reports apart.
    let report_if_due = || {
        let due = last_report.try_lock().ok().filter(|last| last.0.elapsed() >= Duration::from_millis(100));
        let Some(mut last) = due else { return };
        let (samples, noise) = passes.noise();
        let by_time = settings.time_limit.map_or(0.0, |t| start.elapsed().as_secs_f32() / t.as_secs_f32());
        // Noise falls with the root of the number of samples, more or less; a fraction does not fall.
        let by_noise = settings.noise_limit.map_or(0.0, |limit| (limit / noise).powi(2));
        last.1 = passes.fraction().max(by_time).max(by_noise).min(0.999).max(last.1);
        progress(Progress {
            fraction: last.1,
            samples,
            rays: rays.load(Ordering::Relaxed),
            elapsed: start.elapsed(),
            noise,
        });
        // From here on: a host that takes its time does not hold up every tile.
        last.0 = Instant::now();
    };

    let pilot = pilot::look(world, &view, settings, &pilot::Host { cancel, report: &report_if_due })?;
    let work = |_worker: usize| {
        let _ends = passes.end_on_panic();
        let mut tracer = samples::tracer(world, &view, settings, &pilot);
        tracer.stop = Some(&cancel.0);
        let mut sample = samples::empty(settings);
        let stop = || cancel.is_cancelled();
        while let Some(mut tile) = passes.next_tile(&stop) {
            let before = tracer.rays;
            for pixel in tile.pixels.clone() {
                if cancel.is_cancelled() {
                    passes.stop();
                    return;
                }
                sample.clear();
                sample.feature = settings.features.then(Feature::default);
                let (seed, pass) = (settings.seed, settings.first_sample + tile.pass);
                if settings.integrator == Integrator::Path {
                    path::sample(&mut tracer, &view, seed, pixel, pass, settings.caustics_only, &mut sample);
                } else if settings.per_technique || settings.caustics_only {
                    let Settings { per_technique, caustics_only, .. } = *settings;
                    let caustics = Sample::default();
                    let mut sorter = Sorter { tile: &mut tile, pixel, per_technique, caustics_only, caustics };
                    samples::estimate(&mut tracer, &view, settings, pixel, pass, &mut sample, &mut sorter);
                    if settings.caustics_only {
                        let Sample { feature, most, transparent, covered, .. } = sample;
                        sample = Sample { feature, most, transparent, covered, ..sorter.caustics };
                    }
                } else {
                    samples::estimate(&mut tracer, &view, settings, pixel, pass, &mut sample, &mut ());
                }
                tile.add(pixel, &sample);
            }
            // What a search left behind that was stopped is wrong.
            if cancel.is_cancelled() {
                passes.stop();
                return;
            }
            tile.rays = tracer.rays - before;
            tile.walks = std::mem::take(&mut tracer.walks);
            rays.fetch_add(tile.rays.total(), Ordering::Relaxed);
            passes.finish(tile, start, settings.time_limit, settings.noise_limit);
            report_if_due();
        }
    };
    pool::broadcast(threads, work).map_err(|failed| RenderError::of_workers(threads, failed))?;
    passes.check_memory()?;

    let cancelled = cancel.is_cancelled();
    let noise = passes.noise().1;
    let mut output = passes.take_output();
    output.cancelled = cancelled && output.statistics.samples < settings.samples;
    let statistics = &mut output.statistics;
    if let Some((_, sample)) = &mut statistics.first_non_finite {
        *sample += settings.first_sample;
    }
    statistics.caustics = pilot.connects;
    statistics.forecast = pilot.forecast;
    statistics.aimed = pilot.aim.is_some();
    statistics.aim_forecast = pilot.aim_forecast;
    statistics.light_subpaths = pilot.light_subpaths as f32;
    statistics.seeds = if pilot.connects { settings.caustic_options.seeds.unwrap_or(pilot.seeds) } else { 0 };
    statistics.seeds_forecast = pilot.seeds_forecast;
    statistics.search = if pilot.connects { settings.caustic_options.search.unwrap_or(pilot.search) } else { 0.0 };
    statistics.search_forecast = pilot.search_forecast;
    statistics.commit_seconds = world.commit_seconds;
    statistics.render_seconds = start.elapsed().as_secs_f64();
    statistics.scene_bytes = world.memory();
    statistics.threads = threads as u32;
    statistics.backend = world.intersector.describe();
    if !output.cancelled {
        progress(Progress {
            fraction: 1.0,
            samples: output.statistics.samples,
            rays: output.statistics.rays(),
            elapsed: start.elapsed(),
            noise,
        });
    }
    Ok(output)
}
