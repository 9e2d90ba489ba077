//! A plane of RGB pixels in memory.

use crate::math::Rgb;

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
