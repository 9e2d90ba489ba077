//! Running a render: settings, threads, progress, cancel, film.

pub mod compare;
pub mod image;
pub mod job;

pub use image::Image;
