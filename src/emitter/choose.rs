//! The choice among lights, for emission (`P`) and for next-event estimation (`P'`).

use super::tree::{Place, Tree};
use crate::math::{Discrete, mix};
use glam::Vec3;
use std::sync::Arc;

/// Share of the choices that ignores power. A lamp beside the sun has a share of the power below the
/// resolution of a random number; chosen by power alone it would never light the room that the
/// sun does not reach.
const UNIFORM_SHARE: f64 = 0.1;

/// Steps of the random numbers that choose: 23 bits of f32. Probabilities are whole numbers of them, so that a light is
/// chosen as often as claimed, however many there are.
pub(super) const STEPS: f64 = (1 << 23) as f64;

/// Largest number of lights: one step for each, and as many for their power.
pub const MOST_LIGHTS: usize = 1 << 22;

/// Share of the choices for a receiver that are made as for emission. Which light reaches it is not known: one behind
/// glass that gathers its light, or alone in its room, may matter more than its distance says; a tenth bounds what a wrong
/// guess weighs at ten times, and costs little where the guess is right (docs/decisions/0007).
const EMISSION_SHARE: f64 = 0.1;

/// Chooses a light: for emission by emitted power, mixed with a uniform choice; for a receiver by what arrives there, if
/// there are several lights at finite places.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    emission: Discrete,
    reception: Option<Arc<Reception>>,
}

/// The choice for a receiver.
#[derive(Clone, Debug)]
struct Reception {
    /// The share of the lights at finite places, as for emission.
    finite: f64,
    /// They.
    tree: Tree,
    /// The others, as for emission.
    infinite: Option<Infinite>,
}

#[derive(Clone, Debug)]
struct Infinite {
    lights: Vec<u32>,
    choice: Discrete,
}

/// What a light is chosen by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Power {
    /// Emitted flux, positive.
    pub(super) flux: f64,
    /// The box of a light at a finite place. The flux of any other is what passes the scene's disk, and so grows with the
    /// scene.
    pub(super) place: Option<(Vec3, Vec3)>,
}

impl Power {
    fn infinite(&self) -> bool {
        self.place.is_none()
    }
}

impl Choice {
    /// From the emitted powers; `None` if there are none. All light from infinity together is chosen no more often than all
    /// other: most of its flux passes by what the camera sees, the more the farther the ground reaches.
    pub(super) fn by_power(powers: &[Power]) -> Option<Choice> {
        let sum = |infinite| powers.iter().filter(|p| p.infinite() == infinite).map(|p| p.flux).sum::<f64>();
        let (finite, infinite) = (sum(false), sum(true));
        let kept = if finite > 0.0 && infinite > finite { finite / infinite } else { 1.0 };
        let shares: Vec<f64> = powers.iter().map(|p| if p.infinite() { p.flux * kept } else { p.flux }).collect();
        let total: f64 = shares.iter().sum();
        // More than a step for each, or rounding might leave none.
        let uniform = (UNIFORM_SHARE / powers.len() as f64).max(1.001 / STEPS);
        let by_power = 1.0 - uniform * powers.len() as f64;
        let mut sum = 0.0;
        let steps = shares.iter().map(|p| {
            let before = (sum * STEPS).round();
            sum += by_power * (p / total) + uniform;
            (sum * STEPS).round() - before
        });
        let emission = Discrete::new(steps)?;
        let reception = Reception::new(powers, &emission);
        Some(Choice { emission, reception: reception.map(Arc::new) })
    }

    /// A light that emits, for a uniform number in `[0, 1)`: `P`.
    #[inline]
    pub(super) fn sample(&self, u: f32) -> u32 {
        self.emission.sample(u.into()) as u32
    }

    /// The probability of a light that emits.
    #[inline]
    pub(super) fn probability(&self, light: u32) -> f64 {
        self.emission.probability(light as usize).into()
    }

    /// A light for a receiver: `P'`.
    #[inline]
    pub(super) fn sample_for(&self, receiver: Vec3, u: f32) -> u32 {
        let Some(reception) = &self.reception else { return self.sample(u) };
        let u = (f64::from(u) + digits(receiver) / STEPS).min(1.0 - f64::EPSILON);
        if u < EMISSION_SHARE {
            self.emission.sample(u / EMISSION_SHARE) as u32
        } else {
            reception.sample(receiver, (u - EMISSION_SHARE) / (1.0 - EMISSION_SHARE))
        }
    }

    /// The probability of a light for a receiver.
    #[inline]
    pub(super) fn probability_for(&self, receiver: Vec3, light: u32) -> f64 {
        let emission = self.probability(light);
        let Some(reception) = &self.reception else { return emission };
        EMISSION_SHARE * emission + (1.0 - EMISSION_SHARE) * reception.probability(receiver, light, emission)
    }
}

impl Reception {
    /// `None` with less than two lights at finite places: there is nothing to choose.
    fn new(powers: &[Power], emission: &Discrete) -> Option<Reception> {
        let of_all = || (0u32..).zip(powers);
        let places: Vec<_> = of_all()
            .filter_map(|(light, p)| p.place.map(|(low, high)| Place { light, flux: p.flux, low, high }))
            .collect();
        if places.len() < 2 {
            return None;
        }
        let infinite: Vec<_> = of_all().filter(|(_, p)| p.infinite()).map(|(light, _)| light).collect();
        let choice = Discrete::new(infinite.iter().map(|&light| emission.probability(light as usize).into()));
        let finite = 1.0 - choice.as_ref().map_or(0.0, Discrete::total);
        let infinite = choice.map(|choice| Infinite { lights: infinite, choice });
        // Of lights that are many orders apart none overflows.
        let brightest = places.iter().map(|p| p.flux).fold(0.0, f64::max);
        let places = places.into_iter().map(|p| Place { flux: p.flux / brightest, ..p }).collect();
        Some(Reception { finite, tree: Tree::new(places, powers.len()), infinite })
    }

    #[inline]
    fn sample(&self, receiver: Vec3, u: f64) -> u32 {
        match &self.infinite {
            Some(infinite) if u >= self.finite => {
                let light = infinite.choice.sample((u - self.finite) / (1.0 - self.finite));
                infinite.lights[light]
            }
            _ => self.tree.sample(receiver, u / self.finite),
        }
    }

    /// `emission` is the light's probability there.
    #[inline]
    fn probability(&self, receiver: Vec3, light: u32, emission: f64) -> f64 {
        match self.tree.probability(receiver, light) {
            Some(probability) => self.finite * probability,
            None => emission,
        }
    }
}

/// Digits to follow those of a random number, uniform in `[0, 1)` from receiver to receiver: of many lights some are less
/// likely than a step.
#[inline]
fn digits(receiver: Vec3) -> f64 {
    let [x, y, z] = receiver.to_array().map(|c| u64::from(c.to_bits()));
    let mixed = mix(mix(mix(x) ^ y) ^ z);
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finite(flux: f64) -> Power {
        Power { flux, place: Some((Vec3::ZERO, Vec3::ZERO)) }
    }

    #[test]
    fn light_from_infinity_has_half_of_the_choices_at_most() {
        let infinite = |flux| Power { flux, place: None };
        let probabilities = |powers: &[Power]| {
            let choice = Choice::by_power(powers).unwrap();
            (0..powers.len() as u32).map(|i| choice.probability(i)).collect::<Vec<_>>()
        };
        let third = 0.1 / 3.0;
        for (powers, expected) in [
            ([finite(1.0), infinite(3e9), infinite(1e9)], [0.45 + third, 0.3375 + third, 0.1125 + third]),
            ([finite(6.0), infinite(2.0), infinite(1.0)], [0.6 + third, 0.2 + third, 0.1 + third]),
            ([infinite(1e-9), infinite(7e-9), infinite(1e-9)], [0.1 + third, 0.7 + third, 0.1 + third]),
        ] {
            for (p, e) in probabilities(&powers).into_iter().zip(expected) {
                assert!((p - e).abs() < 1e-6, "{powers:?}: {p} instead of {e}");
            }
        }
    }

    #[test]
    fn strong_lights_are_chosen_by_power_and_no_light_is_forgotten() {
        let choice = Choice::by_power(&[1e9, 3e9, 1e-30].map(finite)).unwrap();
        let third = 0.1 / 3.0;
        for (i, expected) in [0.225 + third, 0.675 + third, third].into_iter().enumerate() {
            assert!((choice.probability(i as u32) - expected).abs() < 1e-7);
        }
        assert_eq!(choice.sample(0.9999), 2);
        assert!(Choice::by_power(&[]).is_none());
    }

    #[test]
    fn each_of_many_lights_is_chosen_as_often_as_claimed() {
        for n in [3, 1000, 100_000, 1 << 20] {
            let mut powers = vec![finite(1e-30); n];
            powers[n / 3] = finite(1e9);
            let choice = Choice::by_power(&powers).unwrap();
            let mut chosen = vec![0u32; n];
            for step in 0..STEPS as u32 {
                chosen[choice.sample(step as f32 / STEPS as f32) as usize] += 1;
            }
            for (light, &times) in (0..).zip(&chosen) {
                assert_eq!(choice.probability(light), f64::from(times) / STEPS, "light {light} of {n}");
                assert!(times > 0, "light {light} of {n}");
            }
        }
    }

    #[test]
    fn each_light_for_a_receiver_is_chosen_as_often_as_claimed() {
        let at = |x: f32| Power { flux: 1.0, place: Some((Vec3::X * x, Vec3::X * x)) };
        let infinite = |flux| Power { flux, place: None };
        for powers in [vec![at(0.0), at(1.0)], vec![at(0.0), infinite(3.0), at(1.0), at(-3.0), infinite(1e9)]] {
            let choice = Choice::by_power(&powers).unwrap();
            assert!(choice.reception.is_some());
            for receiver in [Vec3::new(0.3, 0.1, 0.0), Vec3::new(2.0, 7.0, 1.0)] {
                let mut chosen = vec![0u32; powers.len()];
                let n = 1 << 16;
                for step in 0..n {
                    chosen[choice.sample_for(receiver, step as f32 / n as f32) as usize] += 1;
                }
                let claimed = |light| choice.probability_for(receiver, light);
                for (light, &times) in (0..).zip(&chosen) {
                    let found = f64::from(times) / f64::from(n);
                    assert!((claimed(light) - found).abs() < 4.0 / f64::from(n), "{light} of {powers:?}: {found}");
                }
                let sum: f64 = (0..powers.len() as u32).map(claimed).sum();
                assert!((sum - 1.0).abs() < 1e-6, "{sum}");
                // What shines from infinity is chosen as for emission.
                for (light, power) in (0..).zip(&powers).filter(|(_, p)| p.infinite()) {
                    assert!((claimed(light) - choice.probability(light)).abs() < 1e-12, "{power:?}");
                }
            }
        }
        assert!(Choice::by_power(&[at(0.0), infinite(1.0)]).unwrap().reception.is_none());
    }
}
