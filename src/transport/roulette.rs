//! Russian roulette on attempted caustic connections (Speierer et al. 2018, §3.4): a walk costs as much
//! as tens of rays, and most pairs of vertices have little to tell each other.
//!
//! The decision comes before the segment is looked at, and its probability stays out of the weights,
//! which remain functions of the path: unbiased either way. Without an attempt the segment gets the
//! plain visibility test, so that regular connections lose nothing.

use super::Tracer;
use super::connect::Joined;

/// Smallest probability of an attempt. What the straight line underestimates, light in a focus above
/// all, weighs at most its reciprocal.
const LEAST: f32 = 0.05;

/// Probability per vertex between an attempt and the ends of the path, for [`Roulette::Lengths`].
const PER_VERTEX: f32 = 0.7;

/// What decides whether a caustic connection is tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Roulette {
    /// All are.
    Off,
    /// The number of vertices before both ends, as in the paper: the more, the less likely.
    Lengths,
    /// The contribution, weight included, that the straight line would make if nothing were in its way,
    /// over this multiple of the picture's mean radiance: from 1 on it is certain.
    Contribution(f32),
}

impl Tracer<'_> {
    /// Whether to try a caustic connection that would contribute `straight` if nothing were in the way,
    /// with `vertices` connectable vertices before its ends: the reciprocal of the probability, or not.
    #[inline]
    pub(super) fn attempt(&mut self, straight: Option<&Joined>, vertices: usize) -> Option<f32> {
        let probability = match self.options.roulette {
            Roulette::Off => return Some(1.0),
            Roulette::Lengths => PER_VERTEX.powi(vertices as i32),
            Roulette::Contribution(threshold) => {
                straight.map_or(0.0, |s| s.weighted.max_element()) / (threshold * self.brightness)
            }
        };
        // Before there is a mean radiance the quotient is NaN or infinite: certain.
        if !(probability < 1.0) {
            return Some(1.0);
        }
        let probability = probability.max(LEAST);
        if self.roulette.next_1d() < probability {
            return Some(1.0 / probability);
        }
        self.walks.spared += 1;
        None
    }
}
