//! Russian roulette on attempted caustic connections (Speierer et al. 2018, §3.4): a walk costs as much
//! as tens of rays, and most pairs of vertices have little to tell each other.
//!
//! The decision comes before the segment is looked at, and its probability stays out of the weights,
//! which remain functions of the path: unbiased either way. Without an attempt the segment gets the
//! plain visibility test, so that regular connections lose nothing.

use super::Tracer;
use super::connect::Joined;
use super::experience::{Experience, Place, Trial, class};

/// Smallest probability of an attempt. What the guess underestimates, light in a focus above all,
/// weighs at most its reciprocal.
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
    /// The contribution, weight included, that [`Experience`] expects, over this multiple of the picture's
    /// mean radiance: from 1 on it is certain.
    Contribution(f32),
}

/// A connection that is tried.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attempt {
    /// Reciprocal of the probability with which it is.
    pub(super) scale: f32,
    class: usize,
    straight: f32,
    /// Before it.
    steps: u64,
    work: f64,
}

/// Work of walks that roulette on these trials is expected to spare.
pub fn spared<'t>(trials: impl Iterator<Item = &'t Trial>, experience: &Experience) -> f64 {
    let spared = |t: &Trial| {
        let probability = experience.expects(t.class, t.straight).unwrap_or(1.0).clamp(LEAST, 1.0);
        f64::from(1.0 - probability) * t.work
    };
    trials.map(spared).sum()
}

impl Tracer<'_> {
    /// Whether to try a caustic connection between two places that would contribute `straight` if nothing
    /// were in the way, with `vertices` connectable vertices before its ends.
    #[inline]
    pub(super) fn attempt(
        &mut self,
        places: [Place; 2],
        straight: Option<&Joined>,
        vertices: usize,
    ) -> Option<Attempt> {
        let class = class(places);
        let straight = straight.map_or(0.0, |s| s.weighted.max_element());
        let steps = self.walks.iterations;
        let work = if self.trials.is_some() { self.walk_work() } else { 0.0 };
        let attempt = |scale| Some(Attempt { scale, class, straight, steps, work });
        let probability = match self.options.roulette {
            Roulette::Off => 1.0,
            Roulette::Lengths => PER_VERTEX.powi(vertices as i32),
            Roulette::Contribution(_) => self.experience.expects(class, straight).unwrap_or(1.0),
        };
        if !(probability < 1.0) {
            return attempt(1.0);
        }
        let probability = probability.max(LEAST);
        if self.caustic_numbers.next_1d() < probability {
            return attempt(1.0 / probability);
        }
        self.walks.spared += 1;
        None
    }

    /// Notes, if anybody asked for it, what came of an attempt whose straight line was not free.
    #[inline]
    pub(super) fn learn(&mut self, attempt: &Attempt) {
        let work = if self.trials.is_some() { self.walk_work() } else { 0.0 };
        if let Some(trials) = &mut self.trials {
            let found = self.joined.iter().map(|j| j.weighted.max_element()).sum();
            let steps = self.walks.iterations - attempt.steps;
            let work = work - attempt.work;
            trials.push(Trial { class: attempt.class, straight: attempt.straight, found, steps, work });
        }
    }

    /// Work of all walks so far, in units of one of the other rays with all that it brings. Fitted to the walks of all
    /// scenes: a step takes 0.5 microseconds, a ray of a walk 0.35, the rest of a walk 1.0, another ray 0.25.
    pub fn walk_work(&self) -> f64 {
        2.0 * self.walks.iterations as f64 + 1.5 * self.rays.walk as f64 + 4.0 * self.walks.total() as f64
    }
}
