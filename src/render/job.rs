//! One render request.

use super::Image;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Which estimator of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Path tracing with next-event estimation.
    Path,
    /// Bidirectional path tracing (Veach 1997, ch. 10).
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
    /// Also keep one image per technique (s, t), weighted and unweighted.
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
            per_technique: false,
        }
    }
}

/// Asks a running render to stop; shared between threads.
#[derive(Debug, Default)]
pub struct Cancel(AtomicBool);

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
    /// Estimated relative standard error of the image, from the difference of its even and odd
    /// passes; NaN before the second pass.
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
        self.camera_rays + self.camera_path_rays + self.light_path_rays + self.shadow_rays
    }
}

/// One technique: the number of light-subpath vertices and of camera-subpath vertices (Veach's s, t).
pub type Technique = (u32, u32);

/// A finished (or cancelled, with what was whole) render.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// The image.
    pub image: Image,
    /// Per technique: weighted image, unweighted image. Empty unless asked for.
    pub techniques: BTreeMap<Technique, (Image, Image)>,
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
    /// A worker panicked: a bug in the renderer.
    #[error("internal error: {0}")]
    Internal(String),
}

/// Renders. Blocks until done or cancelled; `progress` is called from one of the workers, at most ten
/// times a second, and at the end.
pub fn render(
    _world: &crate::scene::World,
    _settings: &Settings,
    _cancel: &Cancel,
    _progress: &(dyn Fn(Progress) + Sync),
) -> Result<Output, RenderError> {
    todo!()
}
