//! What an image of three channels must be.

use crate::math::Rgb;
use std::fmt;

/// Most pixels on a side: more is taken for a mistake. Not tuned.
pub const MOST_SIDE: usize = 1 << 16;

/// Why pixels are no image.
#[derive(Clone, Debug, PartialEq)]
pub enum PixelsError {
    /// Sides out of range, or not the number of pixels that they say.
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// As many as were given.
        pixels: usize,
    },
    /// Out of range.
    Pixel {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Red, green, blue.
        value: Rgb,
        /// What would do.
        expected: &'static str,
    },
}

impl PixelsError {
    /// Whether so many pixels fill these sides.
    pub fn check_size(width: usize, height: usize, pixels: usize) -> Result<(), PixelsError> {
        let sides = 1..=MOST_SIDE;
        if sides.contains(&width) && sides.contains(&height) && pixels == width * height {
            return Ok(());
        }
        Err(PixelsError::Size { width, height, pixels })
    }
}

impl fmt::Display for PixelsError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            PixelsError::Size { width, height, pixels } => write!(
                f,
                "an image of {width} x {height} with {pixels} pixels; as many as width times height were expected, and 1 to \
                 {MOST_SIDE} on a side"
            ),
            PixelsError::Pixel { x, y, value, expected } => {
                write!(f, "pixel ({x}, {y}) is {} {} {}; {expected} were expected", value.x, value.y, value.z)
            }
        }
    }
}

impl std::error::Error for PixelsError {}
