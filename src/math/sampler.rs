//! The random number stream: a function of (seed, pixel, sample, stream, dimension) and of nothing
//! else, so that an image does not depend on threads, tiles or time.

use glam::Vec2;
use sobol_burley::parts::{Int4, owen_scramble_int4_rev, sobol_int4_rev};

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

/// The numbers of one sample: the first 64 are a point of the Sobol sequence, which the samples of a pixel share, so that
/// together they fill the space of paths evenly; Owen scrambling, other for each pixel and stream, makes each number
/// uniform and pixels independent (Owen 1995; by a hash as in Burley 2020, "Practical Hash-based Owen Scrambling",
/// Vegdahl's). All further ones are independent: SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
pub struct Sampler {
    state: u64,
    /// The point.
    index: u32,
    /// Next dimensions, in fours, and where this stream's end.
    set: u32,
    end: u32,
    /// The last ones drawn, of which `used` are spent.
    numbers: [f32; 4],
    used: u32,
}

/// Dimensions of the Sobol sequence that a stream has, in fours. Each vertex of a subpath takes about four: enough for
/// one subpath of the default depth.
const SETS: u32 = 16;
/// Points of the sequence; after these comes another scrambling.
const POINTS: u32 = 1 << 16;

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A bijection that spreads each bit over all (Steele, Lea, Flood 2014).
#[inline]
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Sampler {
    /// The stream of one sample of one pixel.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32, stream: Stream) -> Sampler {
        let key = mix(seed ^ GOLDEN).wrapping_add((pixel as u64) << 32 | (sample / POINTS) as u64);
        let set = (stream as u32 - 1) * SETS;
        Sampler {
            state: mix(mix(key).wrapping_add((stream as u64).wrapping_mul(GOLDEN))),
            index: sample % POINTS,
            set,
            end: set + SETS,
            numbers: [0.0; 4],
            used: 4,
        }
    }

    fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        mix(self.state)
    }

    fn next_set(&mut self) -> [f32; 4] {
        let (a, b) = (self.next_u64(), self.next_u64());
        let halves = [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32];
        if self.set == self.end {
            return halves.map(|bits| (bits >> 8) as f32 * (1.0 / (1 << 24) as f32));
        }
        // A scrambling for each dimension; the crate's own makes them from one number by a hash of 32 bits, whose
        // correlations are biases of 1e-4.
        let point = sobol_int4_rev(self.index.reverse_bits(), self.set);
        self.set += 1;
        if self.set == self.end {
            self.state = mix(self.state ^ self.index as u64);
        }
        owen_scramble_int4_rev(point, Int4::from(halves)).reverse_bits().to_f32_norm()
    }

    /// Uniform in `[0, 1)`, at least 23 bits.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        if self.used == 4 {
            self.numbers = self.next_set();
            self.used = 0;
        }
        self.used += 1;
        self.numbers[self.used as usize - 1]
    }

    /// Uniform in `[0, 1)²`.
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        Vec2::new(self.next_1d(), self.next_1d())
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

/// One of `n` for a sample: each as often as any other over the samples of a pixel, and evenly over successive ones, by the
/// multiples of the golden ratio, shifted at random for each pixel.
#[inline]
pub fn stratum(seed: u64, pixel: u32, sample: u32, n: u32) -> u32 {
    // 2^32 over the golden ratio.
    const STEP: u32 = 2_654_435_769;
    let shift = mix(mix(seed ^ GOLDEN.rotate_left(32)).wrapping_add(pixel as u64));
    let x = (shift as u32).wrapping_add(sample.wrapping_mul(STEP));
    ((u64::from(x) * u64::from(n)) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_are_even_over_samples_and_over_pixels() {
        const N: u32 = 64;
        let count = |of: &mut dyn Iterator<Item = u32>| {
            let mut counts = [0u32; N as usize];
            of.for_each(|i| counts[i as usize] += 1);
            counts
        };
        let over_samples = count(&mut (0..N * 16).map(|sample| stratum(3, 5, sample, N)));
        assert!(over_samples.iter().all(|&n| (14..=18).contains(&n)), "{over_samples:?}");
        let over_pixels = count(&mut (0..N * 400).map(|pixel| stratum(3, pixel, 7, N)));
        // Standard deviation 20; 5 of them.
        assert!(over_pixels.iter().all(|&n| (300..=500).contains(&n)), "{over_pixels:?}");
    }

    #[test]
    fn neighbouring_keys_give_uncorrelated_uniform_numbers() {
        let n = 40_000;
        let first = |pixel, sample, stream| Sampler::new(7, pixel, sample, stream).next_1d() as f64;
        let mut sums = [0.0; 4];
        for i in 0..n {
            let a = first(i, 0, Stream::Camera) - 0.5;
            sums[0] += a;
            sums[1] += a * (first(i + 1, 0, Stream::Camera) - 0.5);
            sums[2] += a * (first(i, POINTS, Stream::Camera) - 0.5);
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
    fn the_numbers_of_one_sample_are_uncorrelated_and_uniform_over_pixels() {
        let (pixels, numbers) = (4000, 4 * SETS as usize + 8);
        let mut means = vec![0.0; numbers];
        let mut products = vec![0.0; numbers];
        for pixel in 0..pixels {
            let mut sampler = Sampler::new(3, pixel, 11, Stream::Connect);
            let drawn: Vec<f64> = (0..numbers).map(|_| sampler.next_1d() as f64 - 0.5).collect();
            for i in 0..numbers {
                means[i] += drawn[i] / pixels as f64;
                products[i] += drawn[i] * drawn[(i + 1) % numbers] / pixels as f64;
            }
        }
        // Standard errors as above; 5 sigma, for 144 of them: false alarms below 1e-4.
        let n = pixels as f64;
        for i in 0..numbers {
            assert!(means[i].abs() < 5.0 / (12.0 * n).sqrt(), "mean of number {i}: {}", means[i]);
            assert!(products[i].abs() < 5.0 / (12.0 * n.sqrt()), "numbers {i} and {}: {}", i + 1, products[i]);
        }
    }

    #[test]
    fn samples_of_a_pixel_are_even() {
        // 64 samples: one in each 64th of any dimension, one in each cell of the first two, cut in eight by eight; from
        // any multiple of 64 on, and where the sequence begins anew.
        for start in [0, 64, POINTS - 64, POINTS] {
            for (pixel, stream) in [(0, Stream::Camera), (77, Stream::Light), (5, Stream::Caustic)] {
                let mut seen = vec![0u64; 4 * SETS as usize];
                let mut cells = 0u64;
                for sample in start..start + 64 {
                    let mut sampler = Sampler::new(9, pixel, sample, stream);
                    let drawn: Vec<f32> = seen.iter().map(|_| sampler.next_1d()).collect();
                    for (seen, x) in seen.iter_mut().zip(&drawn) {
                        *seen |= 1 << (x * 64.0) as u32;
                    }
                    if stream == Stream::Camera {
                        cells |= 1 << ((drawn[0] * 8.0) as u32 * 8 + (drawn[1] * 8.0) as u32);
                    }
                }
                assert!(seen.iter().all(|s| *s == u64::MAX), "pixel {pixel} from {start}: {seen:x?}");
                assert!(stream != Stream::Camera || cells == u64::MAX, "pixel {pixel} from {start}: {cells:x}");
            }
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
}
