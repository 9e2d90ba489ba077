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
}

/// RGB, f32, linear Rec. 709; row 0 is the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row, `width * height` of them.
    pub pixels: Vec<Rgb>,
}
