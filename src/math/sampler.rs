//! The random number stream: a function of (seed, pixel, sample, stream, dimension) and of nothing
//! else, so that an image does not depend on threads, tiles or time.

use glam::Vec2;

/// Which random decision sequence of a sample. Two sequences never share numbers, so switching one
/// technique on or off leaves the others' paths as they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Stream {
    /// The camera subpath.
    Camera = 1,
    /// The light subpath.
    Light = 2,
    /// Light points drawn for next-event estimation.
    Connect = 3,
    /// Decisions about caustic connections.
    Caustic = 4,
}

/// A counter-based generator: SplitMix64 (Steele, Lea, Flood 2014) whose starting point is a hash of
/// the key. The n-th call returns dimension n.
#[derive(Clone, Debug)]
pub struct Sampler {
    state: u64,
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Sampler {
    /// The stream of one sample of one pixel.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32, stream: Stream) -> Sampler {
        let key = mix(seed ^ GOLDEN).wrapping_add((pixel as u64) << 32 | sample as u64);
        Sampler { state: mix(mix(key).wrapping_add((stream as u64).wrapping_mul(GOLDEN))) }
    }

    #[inline]
    fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        mix(self.state)
    }

    /// Uniform in `[0, 1)`, 24 bits.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 * (1.0 / (1u64 << 24) as f32)
    }

    /// Uniform in `[0, 1)²`.
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        let bits = self.next_u64();
        let scale = 1.0 / (1u64 << 24) as f32;
        Vec2::new((bits >> 40) as f32 * scale, ((bits >> 8) & 0xff_ffff) as f32 * scale)
    }
}

/// Position of a sample within its pixel: the additive sequence R2 of Roberts 2018 ("The unreasonable
/// effectiveness of quasirandom sequences"), shifted at random for each pixel. Each point is uniform
/// in the pixel; the points of successive samples spread evenly over it, which is what edges need.
/// Fixed point, so that no number of samples wears the sequence out.
#[inline]
pub fn pixel_position(seed: u64, pixel: u32, sample: u32) -> Vec2 {
    // 2^32 / p and 2^32 / p², p the real root of p³ = p + 1.
    const STEP: [u32; 2] = [3_242_174_889, 2_447_445_414];
    let shift = mix(mix(seed ^ GOLDEN).wrapping_add(pixel as u64));
    let coordinate = |start: u64, step: u32| {
        let x = (start as u32).wrapping_add(sample.wrapping_mul(step));
        (x >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
    };
    Vec2::new(coordinate(shift, STEP[0]), coordinate(shift >> 32, STEP[1]))
}

/// How many of something a sample of a pixel has, if a sample has `number` on average: the whole part of that, and one
/// more where the multiples of the golden ratio, shifted at random for each pixel, fall into the rest. So successive
/// samples, and odd ones and even ones alike, have nearly their share, and not where [`pixel_position`] returns to.
#[inline]
pub fn number_of_sample(number: f64, seed: u64, pixel: u32, sample: u32) -> u32 {
    let shift = (mix(mix(!seed ^ GOLDEN).wrapping_add(pixel as u64)) >> 32) as u32;
    let x = shift.wrapping_add(sample.wrapping_mul(0x9e37_79b9));
    number as u32 + u32::from(f64::from(x) < number.fract() * (1u64 << 32) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_keys_give_uncorrelated_uniform_numbers() {
        let n = 40_000;
        let first = |pixel, sample, stream| Sampler::new(7, pixel, sample, stream).next_1d() as f64;
        let mut sums = [0.0; 4];
        for i in 0..n {
            let a = first(i, 0, Stream::Camera) - 0.5;
            sums[0] += a;
            sums[1] += a * (first(i + 1, 0, Stream::Camera) - 0.5);
            sums[2] += a * (first(i, 1, Stream::Camera) - 0.5);
            sums[3] += a * (first(i, 0, Stream::Light) - 0.5);
        }
        // Standard errors: 1/sqrt(12 n) for the mean, 1/(12 sqrt n) for a product of two; 4 sigma.
        let n = n as f64;
        assert!((sums[0] / n).abs() < 4.0 / (12.0 * n).sqrt());
        for s in &sums[1..] {
            assert!((s / n).abs() < 4.0 / (12.0 * n.sqrt()), "correlation {}", s / n);
        }
    }

    #[test]
    fn pixel_positions_are_uniform_over_pixels_and_even_over_samples() {
        let n = 10_000;
        let mean = |f: &dyn Fn(u32) -> Vec2| (0..n).map(|i| f(i).as_dvec2()).sum::<glam::DVec2>() / n as f64;
        // Over pixels: random, standard error 1/sqrt(12 n), 4 sigma. Over samples: error of order 1/n.
        let over_pixels = mean(&|i| pixel_position(3, i, 5)) - 0.5;
        let over_samples = mean(&|i| pixel_position(3, 5, i)) - 0.5;
        assert!(over_pixels.abs().max_element() < 4.0 / (12.0 * n as f64).sqrt(), "{over_pixels}");
        assert!(over_samples.abs().max_element() < 5.0 / n as f64, "{over_samples}");
    }

    #[test]
    fn the_same_key_gives_the_same_numbers() {
        let mut a = Sampler::new(1, 2, 3, Stream::Light);
        let mut b = Sampler::new(1, 2, 3, Stream::Light);
        for _ in 0..10 {
            assert_eq!(a.next_2d(), b.next_2d());
        }
    }

    #[test]
    fn numbers_of_samples_come_to_their_mean_and_evenly() {
        for number in [0.0, 1e-3, 0.01, 0.125, 0.37, 1.0, 2.61, 64.0] {
            let (pixels, samples) = (4000, 3);
            let mut all = 0;
            for pixel in 0..pixels {
                let of = |samples: std::ops::Range<u32>, step| {
                    let numbers = samples.step_by(step).map(|i| number_of_sample(number, 7, pixel, i));
                    f64::from(numbers.sum::<u32>())
                };
                // Of hundred samples, and of fifty odd ones, from the first and before the last.
                for (range, step, n) in [(0..100, 1, 100.0), (1..101, 2, 50.0), (u32::MAX - 100..u32::MAX, 2, 50.0)] {
                    let sum = of(range, step);
                    assert!((sum - number * n).abs() < 3.0, "{number}: {sum} of {}", number * n);
                }
                all += of(0..samples, 1) as u32;
            }
            // Shifts are independent from pixel to pixel: five standard errors of independent samples at most.
            let (n, rest) = (f64::from(pixels * samples), number.fract());
            let error = (n * rest * (1.0 - rest)).sqrt();
            assert!((f64::from(all) - n * number).abs() <= 5.0 * error, "{number}: {all} of {}", n * number);
        }
    }
}
