//! Images on surfaces.

use super::error::Failure;
use super::{Format, ImageError, Read, StoredSamples, decode_any, load};
use crate::math::Rgb;
use crate::scene::description::{Encoding, MOST_SIDE, Texture};
use std::path::Path;

/// Reads an image as [`super::read()`] does, for [`Texture`]; `encoding` says what integer samples mean.
pub fn read_texture(path: &Path, encoding: Encoding) -> Result<Texture, ImageError> {
    let (format, bytes) = load(path)?;
    texture(format, &bytes, encoding, MOST).map_err(|failure| failure.at(path))
}

/// Most texels of a file: by the sides of a texture.
const MOST: usize = MOST_SIDE * MOST_SIDE;

/// The same of a file in memory, PNG or JPEG by its first bytes, and of at most `most` texels; messages call it `name`.
pub fn decode_texture(bytes: &[u8], encoding: Encoding, most: usize, name: &str) -> Result<Texture, ImageError> {
    let decoded = match bytes {
        [0x89, b'P', b'N', b'G', ..] => texture(Format::Png, bytes, encoding, most),
        [0xff, 0xd8, 0xff, ..] => texture(Format::Jpeg, bytes, encoding, most),
        _ => Err(Failure::Unsupported("neither PNG nor JPEG, by its first bytes".to_owned())),
    };
    decoded.map_err(|failure| failure.at(Path::new(name)))
}

fn texture(format: Format, bytes: &[u8], encoding: Encoding, most: usize) -> Result<Texture, Failure> {
    let stored = match decode_any(format, bytes, most)? {
        Read::Linear(image) => return floats(image.width, image.height, image.pixels),
        Read::Stored(stored) => stored,
    };
    match &stored.samples {
        StoredSamples::Bytes(samples) => {
            let texels = stored.pixels(samples, |x| x)?;
            Texture::of_bytes(stored.width as usize, stored.height as usize, texels, encoding)
                .map_err(|error| Failure::Unsupported(error.to_string()))
        }
        StoredSamples::Integers(_) | StoredSamples::Floats(_) => {
            floats(stored.width, stored.height, stored.linear(encoding)?)
        }
    }
}

fn floats(width: u32, height: u32, texels: Vec<Rgb>) -> Result<Texture, Failure> {
    Texture::of_floats(width as usize, height as usize, texels).map_err(|error| Failure::Unsupported(error.to_string()))
}
