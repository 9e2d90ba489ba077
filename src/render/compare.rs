//! How far an image is from a reference.

use super::Image;
use crate::math::{Rgb, luminance};

/// Keeps the relative error of black pixels finite, in units of the squared mean of the reference: most papers on
/// rendering add 0.01 to squares of pictures whose radiance is about 1. So the error does not change with the exposure.
const EPSILON: f64 = 0.01;

/// Distances of an image `a` from a reference `b`, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Mean of the image, per channel.
    pub mean: [f64; 3],
    /// Mean of the reference, per channel.
    pub reference_mean: [f64; 3],
    /// `(mean a - mean b) / mean b`, per channel. 0 where both means are 0; infinite where only that
    /// of the reference is.
    pub bias: [f64; 3],
    /// The same of the luminance.
    pub luminance_bias: f64,
    /// Mean over pixels and channels of `(a - b)²`.
    pub mse: f64,
    /// Mean over pixels and channels of `(a - b)² / (b² + 0.01 m²)`, `m` the reference's mean over both. Infinite
    /// where only the reference is black.
    pub rel_mse: f64,
    /// The same without the [`trimmed`](Comparison::trimmed) pixels of the largest relative error, so
    /// that a few fireflies do not hide the rest.
    pub rel_mse_trimmed: f64,
    /// Pixels left out there: 0.1 % of all, rounded down.
    pub trimmed: usize,
}

/// Why two images cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// They differ in size.
    #[error("the sizes differ: the image has {}x{} pixels, the reference {}x{}", image.0, image.1, reference.0, reference.1)]
    Size {
        /// Columns and rows.
        image: (u32, u32),
        /// Columns and rows.
        reference: (u32, u32),
    },
    /// They have no pixels, or not as many as their size says.
    #[error("{which} has {pixels} pixels at a size of {width}x{height}")]
    Pixels {
        /// Of the two.
        which: &'static str,
        /// How many there are.
        pixels: usize,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A pixel is NaN or infinite.
    #[error("pixel ({x}, {y}) of {which} is not finite")]
    NonFinite {
        /// Of the two.
        which: &'static str,
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
}

/// Compares an image with a reference of the same size.
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison, CompareError> {
    check(image, reference)?;
    let pixels = image.pixels.len();
    let (mut sum, mut reference_sum) = (glam::DVec3::ZERO, glam::DVec3::ZERO);
    let mut square = 0.0;
    let mut relative: Vec<f64> = Vec::with_capacity(pixels);
    let floor = floor(reference);
    for (a, b) in image.pixels.iter().zip(&reference.pixels) {
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        sum += a;
        reference_sum += b;
        let d = (a - b) * (a - b);
        square += d.element_sum();
        relative.push(d.to_array().iter().zip((b * b).to_array()).map(|(d, b2)| ratio(*d, b2 + floor)).sum());
    }
    let n = pixels as f64;
    let (mean, reference_mean) = (sum / n, reference_sum / n);
    let bias = |a: f64, b: f64| if a == b { 0.0 } else { (a - b) / b };

    relative.sort_unstable_by(f64::total_cmp);
    let trimmed = pixels / 1000;
    let kept: f64 = relative[..pixels - trimmed].iter().sum();
    let dropped: f64 = relative[pixels - trimmed..].iter().sum();
    Ok(Comparison {
        mean: mean.to_array(),
        reference_mean: reference_mean.to_array(),
        bias: std::array::from_fn(|i| bias(mean[i], reference_mean[i])),
        luminance_bias: bias(luminance_f64(mean), luminance_f64(reference_mean)),
        mse: square / (3.0 * n),
        rel_mse: (kept + dropped) / (3.0 * n),
        rel_mse_trimmed: kept / (3.0 * (pixels - trimmed) as f64),
        trimmed,
    })
}

/// `a / b`, 0 where both are.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// What is added to the squares of the reference: [`EPSILON`] times the square of its mean.
fn floor(reference: &Image) -> f64 {
    let sum: f64 = reference.pixels.iter().map(|p| p.as_dvec3().element_sum()).sum();
    EPSILON * (sum / (3.0 * reference.pixels.len() as f64)).powi(2)
}

/// A picture of the signed difference: red where the image is brighter than the reference, blue where
/// it is darker, black where they agree. The value is `|A - B| / sqrt(B² + 0.01 m²)` of the luminances, `m` the
/// reference's mean, linear, cut at 1.
pub fn difference_picture(image: &Image, reference: &Image) -> Result<Image, CompareError> {
    check(image, reference)?;
    let floor = floor(reference);
    let colour = |(a, b): (&Rgb, &Rgb)| {
        let (a, b) = (f64::from(luminance(*a)), f64::from(luminance(*b)));
        let d = ratio(a - b, (b * b + floor).sqrt()).clamp(-1.0, 1.0) as f32;
        Rgb::new(d.max(0.0), 0.0, (-d).max(0.0))
    };
    let pixels = image.pixels.iter().zip(&reference.pixels).map(colour).collect();
    Ok(Image::new(image.width, image.height, pixels))
}

/// [`luminance`] without rounding to f32.
fn luminance_f64(c: glam::DVec3) -> f64 {
    let weights = [Rgb::X, Rgb::Y, Rgb::Z].map(|axis| f64::from(luminance(axis)));
    c.dot(weights.into())
}

fn check(image: &Image, reference: &Image) -> Result<(), CompareError> {
    let size = |i: &Image| (i.width, i.height);
    if size(image) != size(reference) {
        return Err(CompareError::Size { image: size(image), reference: size(reference) });
    }
    for (which, of) in [("the image", image), ("the reference", reference)] {
        let (width, height, pixels) = (of.width, of.height, of.pixels.len());
        if pixels == 0 || pixels as u64 != u64::from(width) * u64::from(height) {
            return Err(CompareError::Pixels { which, pixels, width, height });
        }
        if let Some(i) = of.pixels.iter().position(|p| !p.is_finite()) {
            let i = i as u64;
            let (x, y) = ((i % u64::from(width)) as u32, (i / u64::from(width)) as u32);
            return Err(CompareError::NonFinite { which, x, y });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixel: impl Fn(u32) -> Rgb) -> Image {
        Image::new(width, height, (0..width * height).map(pixel).collect())
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn constant_images_give_the_closed_values() {
        // Powers of two: every f32 is exact.
        let c =
            compare(&image(4, 3, |_| Rgb::new(0.75, 0.5, 0.0)), &image(4, 3, |_| Rgb::new(0.5, 0.5, 0.25))).unwrap();
        assert_eq!(c.mean, [0.75, 0.5, 0.0]);
        assert_eq!(c.bias, [0.5, 0.0, -1.0]);
        // 0.25 * (0.212639 - 0.072192) / (0.5 * 0.927808 + 0.25 * 0.072192)
        assert!((c.luminance_bias - 0.25 * 0.140_447 / (0.5 * 0.927_808 + 0.25 * 0.072_192)).abs() < 1e-7);
        near(c.mse, (0.0625 + 0.0 + 0.0625) / 3.0);
        // The mean is 1.25 / 3.
        let floor = 0.01 * 1.5625 / 9.0;
        near(c.rel_mse, (0.0625 / (0.25 + floor) + 0.0625 / (0.0625 + floor)) / 3.0);
        near(c.rel_mse_trimmed, c.rel_mse);
        assert_eq!(c.trimmed, 0);
    }

    #[test]
    fn trimming_takes_away_the_fireflies_and_no_more() {
        // 2000 pixels: two may go. Three fireflies, two of them larger.
        let firefly = |i: u32| match i {
            7 => 100.0,
            900 => 50.0,
            1999 => 10.0,
            _ => 0.0,
        };
        // At any exposure.
        for scale in [1.0, 1024.0] {
            let a = image(50, 40, |i| Rgb::splat(scale * (1.0 + firefly(i))));
            let c = compare(&a, &image(50, 40, |_| Rgb::splat(scale))).unwrap();
            assert_eq!(c.trimmed, 2);
            near(c.mse, f64::from(scale * scale) * (1e4 + 2500.0 + 100.0) / 2000.0);
            near(c.rel_mse, (1e4 + 2500.0 + 100.0) / 1.01 / 2000.0);
            near(c.rel_mse_trimmed, 100.0 / 1.01 / 1998.0);
        }
    }

    #[test]
    fn nothing_is_near_a_black_reference() {
        let c = compare(&image(2, 1, |i| Rgb::splat(i as f32)), &image(2, 1, |_| Rgb::ZERO)).unwrap();
        assert_eq!((c.bias, c.rel_mse), ([f64::INFINITY; 3], f64::INFINITY));
    }

    #[test]
    fn equal_images_have_no_error_black_ones_neither() {
        for value in [0.0, 3.0] {
            let a = image(5, 5, |i| Rgb::splat(value * i as f32));
            let c = compare(&a, &a).unwrap();
            assert_eq!((c.bias, c.luminance_bias, c.mse, c.rel_mse, c.rel_mse_trimmed), ([0.0; 3], 0.0, 0.0, 0.0, 0.0));
        }
    }

    #[test]
    fn sums_do_not_drown_small_values() {
        // In f32 the sum stands still at 2^24.
        let n = 1u32 << 12;
        let c = compare(&image(n, n + 1, |_| Rgb::ONE), &image(n, n + 1, |_| Rgb::ONE)).unwrap();
        assert_eq!(c.mean, [1.0; 3]);
    }

    #[test]
    fn what_cannot_be_compared_is_named() {
        let a = image(4, 3, |_| Rgb::ONE);
        let error = compare(&a, &image(3, 4, |_| Rgb::ONE)).unwrap_err();
        assert_eq!(error.to_string(), "the sizes differ: the image has 4x3 pixels, the reference 3x4");
        let error = compare(&a, &image(4, 3, |i| Rgb::splat(if i == 6 { f32::NAN } else { 1.0 }))).unwrap_err();
        assert_eq!(error.to_string(), "pixel (2, 1) of the reference is not finite");
        assert!(matches!(compare(&Image::default(), &Image::default()), Err(CompareError::Pixels { .. })));
        assert!(difference_picture(&a, &Image::default()).is_err());
    }

    #[test]
    fn difference_picture_shows_sign_and_size() {
        let reference = image(4, 1, |i| Rgb::splat([1.0, 1.0, 1.0, 0.0][i as usize]));
        let picture = difference_picture(&image(4, 1, |i| Rgb::splat([1.5, 0.5, 1.0, 9.0][i as usize])), &reference);
        // The reference's mean is 3/4.
        let half = (0.5 / (1.0 + 0.01 * 0.5625f64).sqrt()) as f32;
        let expected = [Rgb::X * half, Rgb::Z * half, Rgb::ZERO, Rgb::X];
        for (p, e) in picture.unwrap().pixels.iter().zip(expected) {
            assert!((*p - e).abs().max_element() < 1e-6, "{p} is not {e}");
        }
    }
}
