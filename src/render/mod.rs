//! Running a render: settings, threads, progress, cancel, film.

pub mod compare;
pub mod film;
pub mod image;
pub mod job;
mod moments;
pub mod passes;
mod pilot;
pub mod pixel;
pub mod preview;

pub use image::Image;
