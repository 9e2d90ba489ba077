//! Russian roulette on attempted caustic connections (Speierer et al. 2018, §3.4): a walk costs as much
//! as tens of rays, and most pairs of vertices have little to tell each other.
//!
//! The decision comes before the segment is looked at, and its probability stays out of the weights,
//! which remain functions of the path: unbiased either way. Without an attempt the segment gets the
//! plain visibility test, so that regular connections lose nothing.

//!
//! The straight line does not know whether glass leads there, nor what gathers behind it. A few samples
//! before the render do ([`Experience`]), by the shapes at the ends: a lamp that no refraction brings to the
//! floor is seldom tried from there, and where the surface turns away from the straight line but not from the
//! refracted one, what was found counts.

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
    /// The contribution, weight included, that experience expects, over this multiple of the picture's mean
    /// radiance: from 1 on it is certain. Without experience, that of the straight line if nothing were in
    /// its way.
    Contribution(f32),
}

/// An end of a connection, as experience tells them apart.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    Camera,
    Shape(u32),
    Light(u32),
}

/// A connection that is tried.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attempt {
    /// Reciprocal of the probability with which it is.
    pub(super) scale: f32,
    class: usize,
    /// Contribution, weight included, of the straight line.
    straight: f32,
}

/// What came of an attempt whose straight line was not free.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    class: usize,
    straight: f32,
    /// Contribution, weights included, of all its chains.
    found: f32,
}

/// Classes of pairs of ends. Different pairs may share one; it is only a guess.
const CLASSES: usize = 256;

/// Trials from which on a class has its own guess; before it has that of all classes together.
const ENOUGH: u32 = 32;

/// What a guess is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Guess {
    /// Root mean square of what was found, relative to the straight line.
    ratio: f32,
    /// The same where the straight line contributes nothing, in units of the certain contribution.
    blind: f32,
}

/// Tells how likely attempts of a render are worth their walks, from those of a few samples before it.
#[derive(Clone, Debug, Default)]
pub struct Experience {
    /// Contribution from which on an attempt is certain; 0 if all are.
    certain: f32,
    /// By class.
    guesses: Box<[Guess]>,
}

/// Sums over trials: number, and second moments of the straight line and of what was found, both at most 1.
#[derive(Clone, Copy, Default)]
struct Sums {
    trials: u32,
    straight: f32,
    found: f32,
}

impl Sums {
    fn add(&mut self, straight: f32, found: f32) {
        self.trials += 1;
        self.straight += straight * straight;
        self.found += found * found;
    }
}

impl Experience {
    /// From the trials, with the contribution from which on an attempt shall be certain.
    pub fn new(trials: &[Trial], certain: f32) -> Experience {
        let mut classes = [[Sums::default(); 2]; CLASSES];
        let mut all = [Sums::default(); 2];
        for trial in trials {
            let [straight, found] = [trial.straight, trial.found].map(|x| (x / certain).min(1.0));
            let kind = usize::from(!(straight > 0.0));
            for sums in [&mut classes[trial.class][kind], &mut all[kind]] {
                sums.add(straight, found);
            }
        }
        let guesses = classes.map(|kinds| {
            let [seen, blind] = [0, 1].map(|k| if kinds[k].trials < ENOUGH { all[k] } else { kinds[k] });
            Guess {
                ratio: if seen.trials < ENOUGH { 1.0 } else { (seen.found / seen.straight).sqrt() },
                blind: if blind.trials < ENOUGH { 0.0 } else { (blind.found / blind.trials as f32).sqrt() },
            }
        });
        Experience { certain, guesses: Box::new(guesses) }
    }

    /// Probability of an attempt, not yet between its bounds.
    fn probability(&self, class: usize, straight: f32) -> f32 {
        let guess = self.guesses.get(class).copied().unwrap_or(Guess { ratio: 1.0, blind: 0.0 });
        if straight > 0.0 { guess.ratio * straight / self.certain } else { guess.blind }
    }
}

impl Tracer<'_> {
    /// Whether to try a caustic connection between two places that would contribute `straight` if nothing were
    /// in the way, with `vertices` connectable vertices before its ends.
    #[inline]
    pub(super) fn attempt(&mut self, [a, b]: [Place; 2], straight: Option<&Joined>, vertices: usize) -> Option<Attempt> {
        let straight = straight.map_or(0.0, |s| s.weighted.max_element());
        let class = a.number().wrapping_mul(0x9e37_79b1).wrapping_add(b.number()).wrapping_mul(0x85eb_ca6b) >> 24;
        let attempt = |scale| Some(Attempt { scale, class: class as usize, straight });
        let probability = match self.options.roulette {
            Roulette::Off => return attempt(1.0),
            Roulette::Lengths => PER_VERTEX.powi(vertices as i32),
            Roulette::Contribution(_) if !(self.experience.certain > 0.0) => return attempt(1.0),
            Roulette::Contribution(_) => self.experience.probability(class as usize, straight),
        };
        if !(probability < 1.0) {
            return attempt(1.0);
        }
        let probability = probability.max(LEAST);
        if self.roulette.next_1d() < probability {
            return attempt(1.0 / probability);
        }
        self.walks.spared += 1;
        None
    }

    /// Notes, if anybody asked for it, what came of an attempt whose straight line was not free.
    #[inline]
    pub(super) fn learn(&mut self, attempt: &Attempt) {
        if let Some(trials) = &mut self.trials {
            let found = self.joined.iter().map(|j| j.weighted.max_element()).sum();
            trials.push(Trial { class: attempt.class, straight: attempt.straight, found });
        }
    }
}

impl Place {
    fn number(self) -> u32 {
        match self {
            Place::Camera => u32::MAX,
            Place::Shape(shape) => shape,
            Place::Light(light) => !light - 1,
        }
    }
}
