//! One render request.

use super::Image;
use super::passes::{Passes, TechniqueSplat, Tile};
use super::pilot::{self, Pilot};
use super::preview::Preview;
use crate::camera::{Camera, Endpoint};
use crate::integrator::bdpt::{self, View};
use crate::integrator::{Contribution, Observer, Sample, Splat, light, path};
use crate::math::pixel_position;
use crate::pool;
use crate::scene::World;
use crate::transport::Tracer;
use crate::transport::options::{
    CausticOptions, Check, GeometryTerm, LARGEST_AIM, LARGEST_TOLERANCE, LEAST_LIGHT_SUBPATHS, LEAST_TOLERANCE,
    MOST_ITERATIONS, MOST_LIGHT_SUBPATHS, MOST_SEEDS,
};
use crate::transport::roulette::Roulette;
use crate::transport::walk_count::WalkCount;
use glam::Vec2;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Which estimator of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Path tracing with next-event estimation.
    Path,
    /// Light tracing.
    Light,
    /// Path tracing with manifold next-event estimation (Hanika et al. 2015).
    Mnee,
    /// Bidirectional path tracing (Veach 1997, ch. 10), with caustic connections (Speierer et al. 2018)
    /// unless they are switched off.
    #[default]
    Bdpt,
}

/// What to render and how long.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Estimator.
    pub integrator: Integrator,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Index into the scene's cameras.
    pub camera: usize,
    /// Samples per pixel; with a time limit, at most so many.
    pub samples: u32,
    /// Stop at the end of the pass that is running at this time.
    pub time_limit: Option<Duration>,
    /// Longest path, in segments; 1 is light seen directly.
    pub max_depth: u32,
    /// Selects the random numbers.
    pub seed: u64,
    /// Worker threads; 0 for as many as the process may use.
    pub threads: usize,
    /// Whether the bidirectional path tracer connects through glass.
    pub caustics: Caustics,
    /// How it does.
    pub caustic_options: CausticOptions,
    /// Leave out all paths but caustic ones, see [`Contribution::is_caustic`].
    pub caustics_only: bool,
    /// Also keep images per technique (s, t).
    pub per_technique: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            integrator: Integrator::default(),
            width: 512,
            height: 512,
            camera: 0,
            samples: 64,
            time_limit: None,
            max_depth: 12,
            seed: 0,
            threads: 0,
            caustics: Caustics::Auto,
            caustic_options: CausticOptions::default(),
            caustics_only: false,
            per_technique: false,
        }
    }
}

impl Settings {
    /// The settings that change an image beside its samples and seed, for its metadata.
    pub fn describe(&self) -> String {
        let integrator = match (self.integrator, self.caustics) {
            (Integrator::Path, _) => "path",
            (Integrator::Light, _) => "light",
            (Integrator::Mnee, _) => "mnee",
            (Integrator::Bdpt, Caustics::Auto) => "bdpt caustics=auto",
            (Integrator::Bdpt, Caustics::On) => "bdpt caustics=on",
            (Integrator::Bdpt, Caustics::Off) => "bdpt caustics=off",
        };
        let only = if self.caustics_only { " caustics-only" } else { "" };
        let how = match self.caustic_options {
            options if options == CausticOptions::default() => String::new(),
            options => format!(" {options:?}"),
        };
        format!("integrator={integrator} max-depth={}{only}{how}", self.max_depth)
    }
}

/// Whether the bidirectional path tracer makes caustic connections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Caustics {
    /// Where a few samples before the render forecast that they pay. Always with delta lights, of which they
    /// may find light that nothing else finds, and for images per technique or of caustics alone.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// What caustic connections or aimed light subpaths bring and cost, by a few samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Variance of the caustics without them over that with them, at equal samples.
    pub variance: f32,
    /// Work with them over that without them, per sample.
    pub work: f32,
}

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

/// Numbers a user needs to judge a render.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Passes in the image.
    pub samples: u32,
    /// Nearest-hit rays from the camera.
    pub camera_rays: u64,
    /// Nearest-hit rays that continue camera subpaths.
    pub camera_path_rays: u64,
    /// Nearest-hit rays of light subpaths.
    pub light_path_rays: u64,
    /// Visibility rays.
    pub shadow_rays: u64,
    /// Rays of manifold walks.
    pub walk_rays: u64,
    /// Manifold walks.
    pub walks: WalkCount,
    /// Whether caustic connections were made.
    pub caustics: bool,
    /// On what [`Caustics::Auto`] decided; `None` where there was nothing to decide.
    pub forecast: Option<Forecast>,
    /// Whether light subpaths were aimed at glass.
    pub aimed: bool,
    /// On what that was decided; `None` where there was nothing to decide.
    pub aim_forecast: Option<Forecast>,
    /// Light subpaths per sample.
    pub light_subpaths: f32,
    /// Most walks from one pair of ends, other than to lights that cannot be hit; 0 without connections.
    pub seeds: u32,
    /// On what that was decided; `None` where there was nothing to decide.
    pub seeds_forecast: Option<Forecast>,
    /// Probability with which connections searched for one more chain, other than to lights that cannot be hit.
    pub search: f32,
    /// On what that was decided; `None` where there was nothing to decide.
    pub search_forecast: Option<Forecast>,
    /// Samples whose value was NaN or infinite; dropped from the image.
    pub non_finite: u64,
    /// Pixel and sample of the first of them.
    pub first_non_finite: Option<(u32, u32)>,
    /// Seconds to build the acceleration structure and the light tables.
    pub commit_seconds: f64,
    /// Seconds to render.
    pub render_seconds: f64,
    /// Bytes of geometry and acceleration structure.
    pub scene_bytes: u64,
    /// Bytes of the film.
    pub film_bytes: u64,
    /// Worker threads.
    pub threads: u32,
    /// The ray tracer.
    pub backend: String,
}

impl Statistics {
    /// All rays.
    pub fn rays(&self) -> u64 {
        self.camera_rays + self.camera_path_rays + self.light_path_rays + self.shadow_rays + self.walk_rays
    }
}

/// One technique: the number of light-subpath vertices and of camera-subpath vertices (Veach's s, t).
pub type Technique = (u32, u32);

/// The images of one technique.
#[derive(Clone, Debug, Default)]
pub struct TechniqueImages {
    /// What it adds to the picture.
    pub weighted: Image,
    /// What it says on its own, of the paths that it can make.
    pub unweighted: Image,
    /// The caustic paths' part of `weighted`.
    pub caustic: Image,
}

/// A finished (or cancelled, with what was whole) render.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// The image.
    pub image: Image,
    /// By technique. Empty unless asked for.
    pub techniques: BTreeMap<Technique, TechniqueImages>,
    /// What happened.
    pub statistics: Statistics,
    /// Whether it was cancelled before the last pass.
    pub cancelled: bool,
}

/// Why a render could not run.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A setting is out of its range.
    #[error("{setting} is {value}; {expected}")]
    Setting {
        /// Its name.
        setting: &'static str,
        /// What was given.
        value: String,
        /// What would do.
        expected: String,
    },
    /// The film does not fit into memory.
    #[error("not enough memory for a {width}x{height} film")]
    OutOfMemory {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Nor do the images per technique.
    #[error("not enough memory for the {width}x{height} images of {techniques} techniques")]
    OutOfMemoryForTechniques {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Techniques met so far.
        techniques: usize,
    },
    /// The system gives no more threads.
    #[error("{threads} threads could not be started: {reason}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        reason: String,
    },
    /// A worker panicked: a bug in the renderer.
    #[error("internal error: {0}")]
    Internal(String),
}

impl RenderError {
    pub(super) fn setting<T>(
        setting: &'static str,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Result<T, RenderError> {
        Err(RenderError::Setting { setting, value: value.to_string(), expected: expected.into() })
    }

    pub(super) fn of_workers(threads: usize, failed: pool::Failed) -> RenderError {
        match failed {
            pool::Failed::Threads(reason) => RenderError::Threads { threads, reason },
            pool::Failed::Panic(message) => RenderError::Internal(message),
        }
    }
}

/// Largest side of an image, pixels.
pub const LARGEST_SIDE: u32 = 1 << 16;

/// Longest path, in segments.
pub const LARGEST_DEPTH: u32 = 1024;

pub(super) fn validate(world: &World, settings: &Settings) -> Result<(), RenderError> {
    for (setting, value, high) in [
        ("width", settings.width, LARGEST_SIDE),
        ("height", settings.height, LARGEST_SIDE),
        ("samples", settings.samples, u32::MAX),
        ("max_depth", settings.max_depth, LARGEST_DEPTH),
    ] {
        if value < 1 || value > high {
            return RenderError::setting(setting, value, format!("a number from 1 to {high} was expected"));
        }
    }
    if settings.width as u64 * settings.height as u64 > u32::MAX as u64 {
        let size = format!("{}x{}", settings.width, settings.height);
        return RenderError::setting("size", size, "fewer than 2^32 pixels were expected");
    }
    if settings.camera >= world.cameras.len() {
        let expected = format!("the scene has {} cameras", world.cameras.len());
        return RenderError::setting("camera", settings.camera, expected);
    }
    let CausticOptions { geometry_term, check, walk, seeds, search, roulette, aim, light_subpaths, max_iterations } =
        settings.caustic_options;
    if !(LEAST_TOLERANCE..=LARGEST_TOLERANCE).contains(&walk.tolerance) {
        let expected = format!("{LEAST_TOLERANCE:e} to {LARGEST_TOLERANCE:e} radians were expected");
        return RenderError::setting("walk tolerance", walk.tolerance, expected);
    }
    if let Some(n) = max_iterations.filter(|n| !(1..=MOST_ITERATIONS).contains(n)) {
        return RenderError::setting(
            "walk iterations",
            n,
            format!("a number from 1 to {MOST_ITERATIONS} was expected"),
        );
    }
    if let Roulette::Contribution(threshold) = roulette
        && !(threshold > 0.0 && threshold.is_finite())
    {
        return RenderError::setting("roulette threshold", threshold, "a finite number above 0 was expected");
    }
    if let Some(share) = aim.filter(|share| !(0.0..=LARGEST_AIM).contains(share)) {
        return RenderError::setting("aim", share, format!("a share from 0 to {LARGEST_AIM} was expected"));
    }
    if let Some(number) = light_subpaths.filter(|n| !(LEAST_LIGHT_SUBPATHS..=MOST_LIGHT_SUBPATHS).contains(n)) {
        let expected = format!("a number from {LEAST_LIGHT_SUBPATHS} to {MOST_LIGHT_SUBPATHS} was expected");
        return RenderError::setting("light subpaths", number, expected);
    }
    if let Some(n) = seeds.filter(|n| !(1..=MOST_SEEDS).contains(n)) {
        return RenderError::setting("seeds", n, format!("a number from 1 to {MOST_SEEDS} was expected"));
    }
    if let Some(p) = search.filter(|p| !(0.0..=1.0).contains(p)) {
        return RenderError::setting("search", p, "a probability was expected");
    }
    if let Some(p) = search.filter(|p| *p > 0.0 && check != Check::Exact) {
        return RenderError::setting("search", p, "searches need the exact check");
    }
    if check != Check::Exact && geometry_term != GeometryTerm::Direct {
        let why = "all but the exact check need the direct geometry term";
        return RenderError::setting("check", format!("{check:?}"), why);
    }
    if settings.threads > 4096 {
        return RenderError::setting("threads", settings.threads, "at most 4096 were expected");
    }
    Ok(())
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

pub(super) fn connects_through_glass(world: &World, settings: &Settings) -> bool {
    world.requirements.caustics
        && match settings.integrator {
            Integrator::Path | Integrator::Light => false,
            Integrator::Mnee => true,
            Integrator::Bdpt => settings.caustics != Caustics::Off,
        }
}

/// Points at which the film of a parallel projection is asked for its medium. A corner of a few thousandths of it can be
/// missed.
const FILM_PROBES: u32 = 1024;

/// The camera of a validated request.
pub(super) fn view(world: &World, settings: &Settings) -> View {
    let camera = Camera::new(&world.cameras[settings.camera], settings.width, settings.height);
    let (width, height) = (settings.width, settings.height);
    let at = |i| world.medium_at(camera.generate(pixel_position(0, 0, i) * Vec2::new(width as f32, height as f32)).0);
    let first = at(0);
    let pinhole = matches!(camera.endpoint(), Endpoint::Point(_));
    let one = pinhole || !world.requirements.media || (1..FILM_PROBES).all(|i| at(i) == first);
    View { medium: one.then_some(first), camera, width, height }
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

/// The same, which `preview` shows while it runs.
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
    let view = view(world, settings);
    let passes = Arc::new(Passes::new(settings, threads)?);
    preview.show(&passes);
    let rays = AtomicU64::new(0);
    let last_report = Mutex::new(start);
    progress(Progress { fraction: 0.0, samples: 0, rays: 0, elapsed: start.elapsed(), noise: f32::NAN });
    // Whoever finds a report due makes it; the lock keeps reports apart.
    let report_if_due = || {
        let due = last_report.try_lock().ok().filter(|last| last.elapsed() >= Duration::from_millis(100));
        let Some(mut last) = due else { return };
        *last = Instant::now();
        let (samples, noise) = passes.noise();
        let by_time = settings.time_limit.map_or(0.0, |t| start.elapsed().as_secs_f32() / t.as_secs_f32());
        progress(Progress {
            fraction: passes.fraction().max(by_time).min(0.999),
            samples,
            rays: rays.load(Ordering::Relaxed),
            elapsed: start.elapsed(),
            noise,
        });
    };

    let pilot = pilot::look(world, &view, settings, &pilot::Host { cancel, report: &report_if_due })?;
    let work = |_worker: usize| {
        let _ends = passes.end_on_panic();
        let mut tracer = tracer(world, &view, settings, &pilot);
        tracer.stop = Some(&cancel.0);
        let mut sample = Sample::default();
        let stop = || cancel.is_cancelled();
        while let Some(mut tile) = passes.next_tile(&stop) {
            let before = tracer.rays;
            for pixel in tile.pixels.clone() {
                if cancel.is_cancelled() {
                    passes.stop();
                    return;
                }
                sample.splats.clear();
                let (seed, pass) = (settings.seed, tile.pass);
                if settings.integrator == Integrator::Path {
                    path::sample(&mut tracer, &view, seed, pixel, pass, settings.caustics_only, &mut sample);
                } else if settings.per_technique || settings.caustics_only {
                    let Settings { per_technique, caustics_only, .. } = *settings;
                    let caustics = Sample::default();
                    let mut sorter = Sorter { tile: &mut tile, pixel, per_technique, caustics_only, caustics };
                    estimate(&mut tracer, &view, settings, pixel, pass, &mut sample, &mut sorter);
                    if settings.caustics_only {
                        sample = sorter.caustics;
                    }
                } else {
                    estimate(&mut tracer, &view, settings, pixel, pass, &mut sample, &mut ());
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
            passes.finish(tile, start, settings.time_limit);
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
