//! Images on surfaces: texels, and how texture coordinates find them.

mod map;
mod pixels;

pub use map::{Filter, TextureMap, Wrap};
pub use pixels::{MOST_SIDE, PixelsError};

use crate::math::{Fnv, Rgb, srgb};
use std::fmt;
use std::sync::LazyLock;

/// What a byte of a texel means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// A colour, by the transfer function of sRGB.
    Srgb,
    /// A number from 0 to 1.
    Linear,
}

/// An image: rows from the top, three channels. Bytes stay bytes: they take a quarter of the memory.
pub struct Texture {
    width: usize,
    height: usize,
    texels: Texels,
    largest: Rgb,
    hash: u64,
}

enum Texels {
    /// Each byte by its table.
    Bytes(Vec<[u8; 3]>, &'static [f32; 256]),
    Floats(Vec<Rgb>),
}

static SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| srgb::decode(code as f32 / 255.0)));
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| code as f32 / 255.0));

impl fmt::Debug for Texture {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Texture({}x{}, {:016x})", self.width, self.height, self.hash)
    }
}

impl Texture {
    /// From `width * height` texels of 8 bits a channel.
    pub fn of_bytes(
        width: usize,
        height: usize,
        texels: Vec<[u8; 3]>,
        encoding: Encoding,
    ) -> Result<Texture, PixelsError> {
        let mut hash = start(width, height, texels.len())?;
        let table = match encoding {
            Encoding::Srgb => &*SRGB,
            Encoding::Linear => &*LINEAR,
        };
        let mut largest = [0; 3];
        for texel in &texels {
            largest = [0, 1, 2].map(|c| texel[c].max(largest[c]));
            hash.triple(texel.map(u32::from));
        }
        hash.bytes(&[encoding as u8]);
        let largest = Rgb::from_array(largest.map(|code| table[usize::from(code)]));
        Ok(Texture { width, height, texels: Texels::Bytes(texels, table), largest, hash: hash.value() })
    }

    /// From `width * height` texels, linear Rec. 709.
    pub fn of_floats(width: usize, height: usize, texels: Vec<Rgb>) -> Result<Texture, PixelsError> {
        let mut hash = start(width, height, texels.len())?;
        let mut largest = Rgb::ZERO;
        for (i, &value) in texels.iter().enumerate() {
            if !(value.is_finite() && value.min_element() >= 0.0) {
                let expected = "finite numbers of at least 0";
                return Err(PixelsError::Pixel { x: i % width, y: i / width, value, expected });
            }
            largest = largest.max(value);
            hash.triple(value.to_array().map(f32::to_bits));
        }
        Ok(Texture { width, height, texels: Texels::Floats(texels), largest, hash: hash.value() })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The largest number of each channel.
    pub fn largest(&self) -> Rgb {
        self.largest
    }

    /// Of the size and of all texels.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Bytes of texels.
    pub fn memory(&self) -> u64 {
        match &self.texels {
            Texels::Bytes(texels, _) => size_of_val(&texels[..]) as u64,
            Texels::Floats(texels) => size_of_val(&texels[..]) as u64,
        }
    }

    /// A texel, linear, by its column and row.
    #[inline]
    fn texel(&self, x: usize, y: usize) -> Rgb {
        let i = y * self.width + x;
        match &self.texels {
            Texels::Bytes(texels, table) => Rgb::from_array(texels[i].map(|code| table[usize::from(code)])),
            Texels::Floats(texels) => texels[i],
        }
    }
}

/// A hash of the size, if it is one.
fn start(width: usize, height: usize, texels: usize) -> Result<Fnv, PixelsError> {
    PixelsError::check_size(width, height, texels)?;
    let mut hash = Fnv::default();
    hash.bytes(&(width as u64).to_le_bytes());
    Ok(hash)
}
