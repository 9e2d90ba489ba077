//! Running a render: settings, threads, progress, cancel, film.

pub mod compare;
mod error;
pub mod film;
pub mod image;
mod job;
mod moments;
mod output;
pub mod passes;
mod pilot;
pub mod pixel;
pub mod preview;
mod samples;
mod settings;

pub use crate::camera::Region;
pub use error::RenderError;
pub use image::{Image, Plane};
pub use job::{Cancel, Progress, render, render_shown};
pub use output::{Forecast, Output, Statistics, Technique, TechniqueImages};
pub(crate) use settings::validate;
pub use settings::{
    Caustics, Integrator, LARGEST_DEPTH, LARGEST_SIDE, LEAST_PASSES, MOST_BY_NOISE, Settings, samples_by_limits,
};
