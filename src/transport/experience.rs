//! What attempted caustic connections are worth, from those of a few samples before a render.
//!
//! Roulette's natural guess is the contribution of the straight line. That line does not know whether the
//! glass leads anywhere, nor what gathers behind it. So attempts are told apart by the shapes at their
//! ends: a lamp that no refraction brings to the floor is seldom tried from there again, and where a surface
//! turns away from the straight line but not from the refracted one, what was found there counts. A
//! guess may be wrong; it makes noise or costs time, never bias, as long as nothing of the render
//! enters it.

/// An end of a connection, as experience tells them apart.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    Camera,
    /// A vertex on this shape.
    Shape(u32),
    /// A light vertex drawn for the connection, on this light.
    Light(u32),
}

/// Classes of pairs of places. Different pairs may share one. More than the pairs of any scene here; 2 kB.
const CLASSES: usize = 256;

/// The class of a pair of places.
#[inline]
pub(super) fn class([a, b]: [Place; 2]) -> usize {
    let number = |place| match place {
        Place::Camera => u32::MAX,
        Place::Shape(shape) => shape,
        Place::Light(light) => u32::MAX - 1 - light,
    };
    // A multiplicative hash: its upper bits are the mixed ones.
    let hash = number(a).wrapping_mul(0x9e37_79b1).wrapping_add(number(b)).wrapping_mul(0x85eb_ca6b);
    (hash >> 24) as usize % CLASSES
}

/// What came of an attempt whose straight line was not free.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    pub(super) class: usize,
    /// Contribution, weight included, of the straight line if nothing were in its way.
    pub(super) straight: f32,
    /// Contribution, weights included, of all chains found.
    pub(super) found: f32,
    /// Steps of the walks.
    pub(super) steps: u64,
    /// See [`super::Tracer::walk_work`].
    pub(super) work: f64,
}

/// Trials from which on a class has a guess of its own; before, it has that of all classes together. Not
/// tuned: enough for a guess good to a few tenths.
const ENOUGH: u32 = 32;

/// Work of an attempt beside its walks, in their steps: the rays of the straight line. An estimate, not tuned.
const RAYS: f64 = 2.0;

/// Work of an attempt that is as likely as its contribution says, in steps: about that on `eye_small`, for
/// which the multiple of the mean radiance was chosen. Against no regard for work, with 6, the error of
/// caustics at equal time was 1.17 times less on water_glass, 1.11 on figure4a, 1.09 on demo, 1.0 on window
/// and figure4c, 0.97 on water_small, 0.94 on `eye_small`, which is why it is more.
const USUAL: f64 = 8.0;

/// Root mean squares of what was found, over the root of the work it took: what minimises the product of
/// variance and work.
#[derive(Clone, Copy, Debug)]
struct Guess {
    /// Relative to the straight line.
    ratio: f32,
    /// In units of the certain contribution, where the straight line has none.
    blind: f32,
}

/// Expects of attempts what those before the render brought.
#[derive(Clone, Debug, Default)]
pub struct Experience {
    /// Contribution from which on an attempt is certain; 0 without experience.
    certain: f32,
    /// By class.
    guesses: Box<[Guess]>,
}

/// Second moments over trials, of contributions of at most 1: more than certain is no attempt.
#[derive(Clone, Copy, Default)]
struct Moments {
    trials: u32,
    straight: f64,
    found: f64,
    steps: u64,
}

impl Moments {
    /// Found over `reference`, and over the work.
    fn worth(&self, reference: f64) -> f32 {
        let work = self.steps as f64 / f64::from(self.trials) + RAYS;
        (self.found / reference * USUAL / work).sqrt() as f32
    }
}

impl Experience {
    /// From trials that were not subject to roulette, and the contribution from which on an attempt of the
    /// render is certain.
    pub fn new<'a>(trials: impl IntoIterator<Item = &'a Trial>, certain: f32) -> Experience {
        let mut classes = [[Moments::default(); 2]; CLASSES];
        let mut all = [Moments::default(); 2];
        for trial in trials {
            let [straight, found] = [trial.straight, trial.found].map(|x| f64::from((x / certain).min(1.0)));
            let blind = usize::from(!(trial.straight > 0.0));
            for moments in [&mut classes[trial.class][blind], &mut all[blind]] {
                moments.trials += 1;
                moments.straight += straight * straight;
                moments.found += found * found;
                moments.steps += trial.steps;
            }
        }
        let guesses = classes.map(|class| {
            let [sighted, blind] = [0, 1].map(|k| if class[k].trials < ENOUGH { all[k] } else { class[k] });
            Guess {
                ratio: if sighted.trials < ENOUGH { 1.0 } else { sighted.worth(sighted.straight) },
                blind: if blind.trials < ENOUGH { 0.0 } else { blind.worth(f64::from(blind.trials)) },
            }
        });
        Experience { certain, guesses: Box::new(guesses) }
    }

    /// Probability of an attempt by its expected contribution and work, without bounds, if there is any
    /// experience.
    #[inline]
    pub(super) fn expects(&self, class: usize, straight: f32) -> Option<f32> {
        let guess = self.guesses.get(class)?;
        Some(if straight > 0.0 { guess.ratio * straight / self.certain } else { guess.blind })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trials(class: usize, straight: f32, found: f32, count: usize) -> Vec<Trial> {
        vec![Trial { class, straight, found, steps: 6, work: 0.0 }; count]
    }

    #[test]
    fn a_class_expects_what_it_found() {
        // One in four brings twice the straight line, at the usual work, all below the certain contribution 10.
        let all = [trials(7, 1.0, 2.0, 25), trials(7, 1.0, 0.0, 75), trials(9, 1.0, 0.0, 50)].concat();
        let experience = Experience::new(&all, 10.0);
        assert!((experience.expects(7, 3.0).unwrap() - 0.3).abs() < 1e-6);
        assert_eq!(experience.expects(9, 1e6), Some(0.0));
    }

    #[test]
    fn where_the_straight_line_has_nothing_what_was_found_counts() {
        let all = [trials(3, 0.0, 0.0, 75), trials(3, 0.0, 4.0, 25), trials(3, 1.0, 1.0, 50)].concat();
        let experience = Experience::new(&all, 10.0);
        assert!((experience.expects(3, 0.0).unwrap() - 0.2).abs() < 1e-6);
        assert_eq!(experience.expects(3, 10.0), Some(1.0));
    }

    #[test]
    fn what_takes_longer_is_tried_less() {
        let trial = Trial { class: 5, straight: 1.0, found: 1.0, steps: 30, work: 0.0 };
        assert_eq!(Experience::new(&[trial; 50], 1.0).expects(5, 1.0), Some(0.5));
    }

    #[test]
    fn few_trials_say_nothing_of_their_own() {
        // The class takes over from all together, here from class 1, and these from the straight line.
        let few = trials(0, 1.0, 0.0, ENOUGH as usize - 1);
        assert_eq!(Experience::new(&few, 1.0).expects(0, 0.5), Some(0.5));
        let many = [few, trials(1, 1.0, 1.0, 10_000)].concat();
        assert!(Experience::new(&many, 1.0).expects(0, 0.5).unwrap() > 0.49);
        assert_eq!(Experience::default().expects(0, 0.5), None);
    }

    #[test]
    fn extreme_contributions_leave_a_guess() {
        let all = [trials(0, 1e-40, f32::INFINITY, 50), trials(1, f32::MAX, f32::NAN, 50)].concat();
        let experience = Experience::new(&all, 1e-3);
        for class in [0, 1, 2] {
            for straight in [0.0, 1e-30, 1.0] {
                let expected = experience.expects(class, straight).unwrap();
                // Not NaN; of infinity it is certain.
                assert!(expected >= 0.0, "class {class}, {straight}: {expected}");
            }
        }
    }
}
