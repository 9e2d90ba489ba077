//! Image files: EXR by the crate `exr`, every other format (and EXR on demand) by OpenImageIO, which
//! is opened as a module of its own when it is first needed (see `oiio`).
//!
//! | extension | samples | transfer |
//! |---|---|---|
//! | `exr` | half or float | linear, Rec. 709 |
//! | `tif`, `tiff` | float | linear, Rec. 709 |
//! | `hdr` | RGBE | linear, Rec. 709, not below 0 |
//! | `png` | 8 bits | exposure, then sRGB |
//! | `jpg`, `jpeg` | 8 bits, quality 95, full chroma | exposure, then sRGB |
//!
//! EXR files of the compressions DWA and B44 are read by OpenImageIO.
//!
//! Samples are converted here, so that no library's colour management has a say. A file is encoded
//! in memory, written beside its final name and renamed: the final name never holds half a file.

// Without OpenImageIO nobody asks for what serves it alone.
#![cfg_attr(not(feature = "oiio"), allow(dead_code))]

mod environment;
mod error;
mod metadata;
#[cfg_attr(not(feature = "oiio"), path = "oiio_absent.rs")]
mod oiio;
mod openexr;
mod picture;
mod replace;
mod texture;

pub use environment::read_environment;
pub use error::ImageError;
pub use metadata::{Metadata, Value};
pub use texture::{decode_texture, read_texture};

use crate::math::{Rgb, srgb};
use crate::render::Image;
use crate::scene::description::Encoding;
use error::Failure;
use picture::Picture;
use std::path::Path;

/// Who encodes EXR files; the other formats are OpenImageIO's in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImageIo {
    /// The crate `exr`: nothing is loaded.
    #[default]
    Auto,
    /// OpenImageIO. Same pixels, windows and attributes.
    Oiio,
}

/// How to write.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WriteOptions {
    /// Who encodes EXR.
    pub image_io: ImageIo,
    /// Stops: 8-bit formats show `2^exposure` times the image. No effect on the others.
    pub exposure: f32,
    /// EXR samples of 16 bits, else of 32.
    pub half: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        WriteOptions { image_io: ImageIo::Auto, exposure: 0.0, half: true }
    }
}

/// What had to be changed to fit the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Pixels that were NaN or infinite, written as black. A render never makes them.
    pub non_finite: u64,
    /// Pixels beyond the range of the format's samples, written at its end: over 65504 in half,
    /// below 0 in RGBE. 8-bit formats, which clip by design, are not counted.
    pub clamped: u64,
    /// Pixels of 8-bit formats that are white although they are brighter: see [`WriteOptions::exposure`].
    pub white: u64,
    /// Whether half floats hold most of its pixels with fewer digits than they have for brighter ones.
    pub too_dim: bool,
}

/// A file format, known by the extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
    Tiff,
    Jpeg,
    Hdr,
}

impl Format {
    fn of(path: &Path) -> Result<Format, ImageError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            Some("tif" | "tiff") => Ok(Format::Tiff),
            Some("jpg" | "jpeg") => Ok(Format::Jpeg),
            Some("hdr") => Ok(Format::Hdr),
            other => {
                let what = other.map_or("no extension".to_owned(), |e| format!("unknown image format '.{e}'"));
                let reason = format!("{what}; known are .exr, .png, .tif, .tiff, .jpg, .jpeg and .hdr");
                Err(ImageError::Unsupported { path: path.into(), reason })
            }
        }
    }

    /// OpenImageIO's name, also an extension it knows.
    fn name(self) -> &'static str {
        match self {
            Format::Exr => "openexr",
            Format::Png => "png",
            Format::Tiff => "tiff",
            Format::Jpeg => "jpeg",
            Format::Hdr => "hdr",
        }
    }

    fn needs_module(self, image_io: ImageIo) -> bool {
        self != Format::Exr || image_io == ImageIo::Oiio
    }
}

/// The version of OpenImageIO, which this opens; else why it is not there.
pub fn openimageio_version() -> Result<&'static str, String> {
    oiio::version().map_err(|failure| failure.to_string())
}

/// Whether [`write()`] to `path` can be expected to work, asked before hours of rendering: the format
/// is known, its library opens, the directory exists and takes a new file, and a file that is there
/// already may be replaced.
pub fn check_writable(path: &Path, options: &WriteOptions) -> Result<(), ImageError> {
    let format = Format::of(path)?;
    check_exposure(path, options)?;
    if format.needs_module(options.image_io) {
        oiio::version().map_err(|failure| failure.at(path))?;
    }
    replace::begin(path).map(drop)
}

/// Writes an image in the format that the extension of `path` names; row 0 is the top. EXR keeps its alpha, other formats
/// have it over black. On an error
/// a file that was there before is as it was.
pub fn write(path: &Path, image: &Image, metadata: &Metadata, options: &WriteOptions) -> Result<Written, ImageError> {
    let format = Format::of(path)?;
    check_exposure(path, options)?;
    let at = |failure: Failure| failure.at(path);
    let (picture, written) = Picture::new(image, format, options).map_err(at)?;
    metadata.check(image.width, image.height).map_err(at)?;
    if !picture.alpha.is_empty() && options.image_io == ImageIo::Oiio {
        let reason = "its alpha is written by the built-in writer alone".to_owned();
        return Err(ImageError::Unsupported { path: path.into(), reason });
    }
    let bytes = if format.needs_module(options.image_io) {
        oiio::encode(format, &picture, metadata).map_err(at)?
    } else {
        openexr::encode(&picture, metadata).map_err(at)?
    };
    replace::begin(path)?.finish(&bytes)?;
    Ok(written)
}

/// Reads an image of a known extension. Integer samples are taken as sRGB and decoded, float samples
/// as linear. Channels beside R, G, B are left out; a single grey channel becomes all three. Of an
/// EXR file: the first part that has R, G, B or Y, its data window, its full resolution; of the compressions DWA and B44, by
/// OpenImageIO, where that is the only part.
pub fn read(path: &Path) -> Result<Image, ImageError> {
    let (format, bytes) = load(path)?;
    decode(format, &bytes).map_err(|failure| failure.at(path))
}

fn load(path: &Path) -> Result<(Format, Vec<u8>), ImageError> {
    let format = Format::of(path)?;
    let bytes = std::fs::read(path).map_err(|source| ImageError::Io { path: path.into(), action: "read", source })?;
    Ok((format, bytes))
}

fn decode(format: Format, bytes: &[u8]) -> Result<Image, Failure> {
    match decode_any(format, bytes, usize::MAX)? {
        Read::Linear(image) => Ok(image),
        Read::Stored(stored) => {
            let pixels = stored.linear(Encoding::Srgb)?;
            Ok(Image::new(stored.width, stored.height, pixels))
        }
    }
}

/// What was in a file.
enum Read {
    /// Of an EXR file.
    Linear(Image),
    /// By OpenImageIO.
    Stored(Stored),
}

/// By OpenImageIO, of at most so many pixels.
fn decode_any(format: Format, bytes: &[u8], most: usize) -> Result<Read, Failure> {
    let left = if format == Format::Exr { openexr::left_to_openimageio(bytes)? } else { None };
    if format == Format::Exr && left.is_none() {
        return openexr::decode(bytes).map(Read::Linear);
    }
    let stored = oiio::decode(format, bytes, most).map_err(|failure| match (failure, left) {
        (Failure::Module(reason), Some(compression)) => {
            Failure::Module(format!("{reason}; its compression is {compression}"))
        }
        (failure, _) => failure,
    })?;
    Ok(Read::Stored(stored))
}

/// An image as its file has it.
struct Stored {
    width: u32,
    height: u32,
    /// 1 for grey, else 3.
    channels: u32,
    samples: StoredSamples,
}

enum StoredSamples {
    Bytes(Vec<u8>),
    /// Of more bits, from 0 to 1.
    Integers(Vec<f32>),
    Floats(Vec<f32>),
}

impl Stored {
    /// `encoding` says what integers mean; floats are linear.
    fn linear(&self, encoding: Encoding) -> Result<Vec<Rgb>, Failure> {
        let decode = |x: f32| if encoding == Encoding::Srgb { srgb::decode(x) } else { x };
        match &self.samples {
            StoredSamples::Bytes(samples) => self.pixels(samples, |x| decode(f32::from(x) / 255.0)),
            StoredSamples::Integers(samples) => self.pixels(samples, decode),
            StoredSamples::Floats(samples) => self.pixels(samples, |x| x),
        }
        .map(|pixels| pixels.into_iter().map(Rgb::from_array).collect())
    }

    fn pixels<T: Copy, U: Copy>(&self, samples: &[T], convert: impl Fn(T) -> U) -> Result<Vec<[U; 3]>, Failure> {
        let channels = self.channels.max(1) as usize;
        let mut pixels = room(samples.len() / channels)?;
        let pixel = |c: &[T]| if let [r, g, b] = *c { [r, g, b] } else { [c[0]; 3] };
        pixels.extend(samples.chunks_exact(channels).map(|c| pixel(c).map(&convert)));
        Ok(pixels)
    }
}

fn check_exposure(path: &Path, options: &WriteOptions) -> Result<(), ImageError> {
    if options.exposure.is_finite() {
        return Ok(());
    }
    Err(ImageError::Unsupported { path: path.into(), reason: format!("exposure is {}, not finite", options.exposure) })
}

/// The number of pixels, if a file of `bytes` bytes can hold so many.
///
/// A header of a few bytes may claim any size, and memory is taken before the lie shows. The best
/// case of the compressions in use, a constant image, stays below 4096 pixels per byte; a picture of
/// up to 16 Mi pixels is let through whatever the file's length.
fn plausible_pixels(width: usize, height: usize, bytes: usize) -> Result<usize, Failure> {
    let limit = bytes.saturating_mul(4096).max(1 << 24);
    let fits = |n: &usize| *n <= limit && u32::try_from(width).is_ok() && u32::try_from(height).is_ok();
    width.checked_mul(height).filter(|&n| n > 0).filter(fits).ok_or_else(|| {
        Failure::Codec(format!("damaged: its header claims {width}x{height} pixels in a file of {bytes} bytes"))
    })
}

/// An empty vector with room for `n` values.
fn room<T>(n: usize) -> Result<Vec<T>, Failure> {
    let mut values = Vec::new();
    values.try_reserve_exact(n).map_err(|_| Failure::OutOfMemory)?;
    Ok(values)
}
