//! An image as a file stores it.

use super::{Failure, Format, WriteOptions, Written, room};
use crate::math::{Rgb, srgb};
use crate::render::Image;
use half::f16;

/// The largest finite half, 65504.
const HALF_MAX: f32 = f16::MAX.to_f32_const();
/// The smallest half that has all its digits, 2^-14.
const HALF_NORMAL: f32 = 6.104e-5;
/// The largest RGBE value: mantissa 255/256, exponent 2^127.
const RGBE_MAX: f32 = 1.694_7e38;

/// RGB, row by row from the top.
pub(super) enum Samples {
    /// sRGB, 8 bits.
    Bytes(Vec<u8>),
    /// Linear.
    Half(Vec<f16>),
    /// Linear.
    Float(Vec<f32>),
}

/// Samples ready to be stored.
pub(super) struct Picture {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) samples: Samples,
    /// Of each pixel, if it has one.
    pub(super) alpha: Vec<f32>,
}

impl Picture {
    /// Converts; all values that a codec sees are finite and in its range.
    pub(super) fn new(image: &Image, format: Format, options: &WriteOptions) -> Result<(Picture, Written), Failure> {
        let (width, height) = (image.width, image.height);
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0
            || pixels != image.pixels.len() as u64
            || !(image.alpha.is_empty() || image.alpha.len() == image.pixels.len())
            || width.max(height) > i32::MAX as u32
        {
            let reason = format!("an image of {width}x{height} with {} pixels cannot be written", image.pixels.len());
            return Err(Failure::Unsupported(reason));
        }
        let mut written = Written::default();
        let mut finite = |p: Rgb| {
            if p.is_finite() {
                return p;
            }
            written.non_finite += 1;
            Rgb::ZERO
        };
        let mut clamped = 0;
        let mut within = |p: Rgb, low: f32, high: f32| {
            let inside = p.clamp(Rgb::splat(low), Rgb::splat(high));
            clamped += u64::from(inside != p);
            inside
        };
        let samples = match format {
            Format::Png | Format::Jpeg => {
                let scale = options.exposure.exp2();
                // 0 * inf is NaN: black stays black at any exposure.
                let expose = |x: f32| if x == 0.0 { 0 } else { srgb::encode(x * scale) };
                let white = |p: &&Rgb| p.is_finite() && p.min_element() * scale > 1.0;
                written.white = image.pixels.iter().filter(white).count() as u64;
                Samples::Bytes(collect(image, |p| finite(p).to_array().map(expose))?)
            }
            Format::Exr if options.half => {
                written.too_dim = is_too_dim(image);
                Samples::Half(collect(image, |p| within(finite(p), -HALF_MAX, HALF_MAX).to_array().map(f16::from_f32))?)
            }
            Format::Hdr => Samples::Float(collect(image, |p| to_rgbe(within(finite(p), 0.0, RGBE_MAX)))?),
            Format::Exr | Format::Tiff => Samples::Float(collect(image, |p| finite(p).to_array())?),
        };
        written.clamped = clamped;
        // Other formats show what is over black.
        let alpha = if format == Format::Exr { image.alpha.clone() } else { Vec::new() };
        Ok((Picture { width, height, samples, alpha }, written))
    }
}

/// Whether most pixels that are not black have less than a half's full digits, in all channels.
fn is_too_dim(image: &Image) -> bool {
    let lit = image.pixels.iter().map(|p| p.abs().max_element()).filter(|&x| x > 0.0);
    let [dim, all] = lit.fold([0usize; 2], |[dim, all], x| [dim + usize::from(x < HALF_NORMAL), all + 1]);
    2 * dim > all
}

/// RGBE writers cut a pixel's mantissas, of 8 bits for the largest (Ward 1991), and half a step makes that rounding; a
/// little less, for what lies on a step must stay there in f32. Below 1e-32 they write black.
fn to_rgbe(p: Rgb) -> [f32; 3] {
    let largest = f64::from(p.max_element());
    if largest < 1e-32 {
        return p.to_array();
    }
    let step = 2f64.powi(largest.log2().floor() as i32 - 7);
    p.to_array().map(|x| (f64::from(x) + 0.499 * step).min(RGBE_MAX.into()) as f32)
}

fn collect<T>(image: &Image, mut convert: impl FnMut(Rgb) -> [T; 3]) -> Result<Vec<T>, Failure> {
    let mut samples = room(image.pixels.len().checked_mul(3).ok_or(Failure::OutOfMemory)?)?;
    samples.extend(image.pixels.iter().flat_map(|&pixel| convert(pixel)));
    Ok(samples)
}
