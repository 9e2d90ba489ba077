//! What to render and how long.

use super::RenderError;
use super::pilot::PILOT_SAMPLES;
use crate::camera::Region;
use crate::scene::{World, description, validate_camera};
use crate::transport::options::{
    CausticOptions, Check, GeometryTerm, LARGEST_AIM, LARGEST_TOLERANCE, LEAST_LIGHT_SUBPATHS, LEAST_TOLERANCE,
    MOST_ITERATIONS, MOST_LIGHT_SUBPATHS, MOST_SEEDS,
};
use crate::transport::roulette::Roulette;
use std::time::Duration;

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
    /// Columns of the frame.
    pub width: u32,
    /// Rows of the frame.
    pub height: u32,
    /// What of the frame is rendered, and is the image; `None`: all. Light subpaths are as many as its samples, and what
    /// they say is weighed accordingly. Path tracing gives the same bits as in the whole.
    pub region: Option<Region>,
    /// Index into the scene's cameras.
    pub camera: usize,
    /// In place of that: a camera that need not be in the scene.
    pub view: Option<description::Camera>,
    /// Samples per pixel; with a limit of time or noise, at most so many.
    pub samples: u32,
    /// Number of the first of them: renders of 0 to 63 and of 64 to 127 have, on average, the image of 0 to 127.
    pub first_sample: u32,
    /// Stop at the end of the pass that is running at this time.
    pub time_limit: Option<Duration>,
    /// Stop after the pass that brings the estimated noise, the relative standard error of the image, down to this: not
    /// before [`LEAST_PASSES`]. The number of samples then follows from scene, seed and settings, for any number of
    /// threads.
    pub noise_limit: Option<f32>,
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
    /// Leave out all paths but caustic ones, see [`crate::integrator::Contribution::is_caustic`].
    pub caustics_only: bool,
    /// Most radiance that one path may add to a pixel, in its largest channel, unless the camera sees the light itself, by
    /// mirrors or through smooth glass. Less noise for a bias, of which [`super::Statistics::clamped`] tells.
    pub clamp: Option<f32>,
    /// Also keep what the samples see ([`crate::integrator::Feature`]), for denoisers. Not by light tracing.
    pub features: bool,
    /// Leave out what the camera sees of the environment with nothing before it, and say so by [`super::Image::alpha`]. What
    /// glass, mirrors and everything else show of the environment stays. Not of light tracing.
    pub transparent: bool,
    /// Also keep images per technique (s, t).
    pub per_technique: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            integrator: Integrator::default(),
            width: 512,
            height: 512,
            region: None,
            camera: 0,
            view: None,
            samples: 64,
            first_sample: 0,
            time_limit: None,
            noise_limit: None,
            max_depth: 12,
            seed: 0,
            threads: 0,
            caustics: Caustics::Auto,
            caustic_options: CausticOptions::default(),
            caustics_only: false,
            clamp: None,
            features: false,
            transparent: false,
            per_technique: false,
        }
    }
}

impl Settings {
    /// What of the frame is rendered.
    pub fn region(&self) -> Region {
        self.region.unwrap_or(Region::all(self.width, self.height))
    }

    /// The camera, of a validated request: in the coordinates of `world`, which lie about its [`World::origin`].
    pub(super) fn camera(&self, world: &World) -> description::Camera {
        let Some(view) = &self.view else { return world.cameras[self.camera].clone() };
        let mut camera = view.clone();
        camera.transform.translation -= world.origin;
        camera
    }

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
        let only = if self.transparent { format!("{only} transparent") } else { only.to_owned() };
        let region = self.region.map_or(String::new(), |region| format!(" region={region}"));
        let clamp = self.clamp.map_or(String::new(), |most| format!(" clamp={most}"));
        let first = if self.first_sample > 0 { format!(" first-sample={}", self.first_sample) } else { String::new() };
        let how = match self.caustic_options {
            options if options == CausticOptions::default() => String::new(),
            options => format!(" {options:?}"),
        };
        format!("integrator={integrator} max-depth={}{only}{clamp}{region}{first}{how}", self.max_depth)
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

/// Largest side of an image, pixels.
pub const LARGEST_SIDE: u32 = 1 << 16;

/// Passes before an estimate of the noise may end a render: what is rare shows in none of the first few, and they seem
/// free of noise. Not tuned.
pub const LEAST_PASSES: u32 = 16;

/// Samples per pixel at most where the noise alone is given, which a black image never reaches. Not tuned.
pub const MOST_BY_NOISE: u32 = 1 << 16;

/// Longest path, in segments.
pub const LARGEST_DEPTH: u32 = 1024;

/// Largest number of a sample, and one more. The last of all are those of the samples before a render.
const MOST_SAMPLES: u32 = u32::MAX - PILOT_SAMPLES;

/// Samples per pixel, from the first on, where nobody asked for a number, with these limits.
pub fn samples_by_limits(time: bool, noise: bool, first_sample: u32) -> u32 {
    match (time, noise) {
        (true, false) => MOST_SAMPLES.saturating_sub(first_sample).max(1),
        (_, true) => MOST_BY_NOISE,
        (false, false) => Settings::default().samples,
    }
}

/// Whether these can be rendered.
pub(crate) fn validate(world: &World, settings: &Settings) -> Result<(), RenderError> {
    for (setting, value, high) in [
        ("width", settings.width, LARGEST_SIDE),
        ("height", settings.height, LARGEST_SIDE),
        ("samples", settings.samples, MOST_SAMPLES),
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
    if let Some(region) = settings.region.filter(|region| !region.is_within(settings.width, settings.height)) {
        let expected = format!("pixels of the frame, which has {}x{}, were expected", settings.width, settings.height);
        return RenderError::setting("region", region, expected);
    }
    if settings.first_sample > MOST_SAMPLES - settings.samples {
        let most = MOST_SAMPLES - settings.samples;
        let expected = format!("with {} samples at most {most} was expected", settings.samples);
        return RenderError::setting("first_sample", settings.first_sample, expected);
    }
    if let Some(most) = settings.clamp.filter(|most| !(*most > 0.0 && most.is_finite())) {
        return RenderError::setting("clamp", most, "a finite radiance above 0 was expected");
    }
    if settings.features && settings.integrator == Integrator::Light {
        return RenderError::setting("features", true, "light tracing has none, false was expected");
    }
    if settings.transparent && settings.integrator == Integrator::Light {
        return RenderError::setting(
            "transparent",
            true,
            "light tracing sees nothing from the camera, false was expected",
        );
    }
    if let Some(noise) = settings.noise_limit.filter(|n| !(*n > 0.0 && n.is_finite())) {
        return RenderError::setting("noise_limit", noise, "a finite number above 0 was expected");
    }
    if let Some(camera) = &settings.view {
        validate_camera(0, camera)?;
    } else if settings.camera >= world.cameras.len() {
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
