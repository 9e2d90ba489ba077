//! Numbers without a scene: frames, warps, discrete distributions, the random number stream, a hash, a transfer function, the spectrum.

#[cfg(test)]
pub(crate) mod chi_square;
pub mod distribution;
pub mod frame;
pub mod hash;
pub mod sampler;
pub mod spectrum;
pub mod srgb;
pub mod warp;

pub use distribution::Discrete;
pub use frame::Frame;
pub use hash::Fnv;
pub use sampler::{Sampler, Stream, mix, pixel_position, stratum};

/// Three channels, linear Rec. 709 unless a file's metadata says otherwise.
pub type Rgb = glam::Vec3;

/// Luminance of a linear Rec. 709 triple (ITU-R BT.709 luma weights).
#[inline]
pub fn luminance(c: Rgb) -> f32 {
    0.212_639 * c.x + 0.715_169 * c.y + 0.072_192 * c.z
}

/// `a*b - c*d` with at most 1.5 ulp of error, by Kahan's algorithm with a fused multiply-add
/// (Jeannerod, Louvet, Muller 2013).
#[inline]
pub fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = c.mul_add(-d, cd);
    a.mul_add(b, -cd) + error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn difference_of_products_keeps_the_digits_that_cancel() {
        // Plain arithmetic gives 0 here: the products differ in the last bit only.
        let e = f64::EPSILON;
        assert_eq!(difference_of_products(1.0 + e, 1.0 - e, 1.0, 1.0), -e * e);
    }
}
