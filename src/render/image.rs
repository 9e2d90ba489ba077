//! Planes of RGB pixels in memory.

use crate::math::Rgb;

/// Which plane of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// The picture.
    #[default]
    Radiance,
    /// The average of [`crate::integrator::Feature::albedo`].
    Albedo,
    /// The average of [`crate::integrator::Feature::normal`]: shorter than 1 where the samples of a pixel differ.
    Normal,
    /// The average of [`crate::integrator::Feature::depth`] over the samples that have one; 0 where none has.
    Depth,
}

/// RGB, f32, linear Rec. 709; row 0 is the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row, `width * height` of them; what an alpha below 1 leaves to a background is missing in them.
    pub pixels: Vec<Rgb>,
    /// Share of each pixel that something covers; empty for 1 everywhere.
    pub alpha: Vec<f32>,
}

impl Image {
    /// One that covers all.
    pub fn new(width: u32, height: u32, pixels: Vec<Rgb>) -> Image {
        Image { width, height, pixels, alpha: Vec::new() }
    }
}
