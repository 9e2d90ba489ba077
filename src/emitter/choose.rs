//! The choice among lights: one distribution, for emission (`P`) and for next-event estimation (`P'`).

use crate::math::Discrete;

/// Share of the choices that ignores power. A lamp beside the sun has a share of the power below the
/// resolution of a random number; chosen by power alone it would never light the room that the
/// sun does not reach.
const UNIFORM_SHARE: f64 = 0.1;

/// Steps of the random numbers that choose: 23 bits of f32. Probabilities are whole numbers of them, so that a light is
/// chosen as often as claimed, however many there are.
const STEPS: f64 = (1 << 23) as f64;

/// Largest number of lights: one step for each, and as many for their power.
pub const MOST_LIGHTS: usize = 1 << 22;

/// Chooses a light by emitted power, mixed with a uniform choice.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    distribution: Discrete,
}

/// What a light is chosen by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Power {
    /// Emitted flux, positive.
    pub(super) flux: f64,
    /// Whether that is what passes the scene's disk, and so grows with the scene.
    pub(super) infinite: bool,
}

impl Choice {
    /// From the emitted powers; `None` if there are none. All light from infinity together is chosen no more often than all
    /// other: most of its flux passes by what the camera sees, the more the farther the ground reaches.
    pub(super) fn by_power(powers: &[Power]) -> Option<Choice> {
        let sum = |infinite| powers.iter().filter(|p| p.infinite == infinite).map(|p| p.flux).sum::<f64>();
        let (finite, infinite) = (sum(false), sum(true));
        let kept = if finite > 0.0 && infinite > finite { finite / infinite } else { 1.0 };
        let powers: Vec<f64> = powers.iter().map(|p| if p.infinite { p.flux * kept } else { p.flux }).collect();
        let total: f64 = powers.iter().sum();
        // More than a step for each, or rounding might leave none.
        let uniform = (UNIFORM_SHARE / powers.len() as f64).max(1.001 / STEPS);
        let by_power = 1.0 - uniform * powers.len() as f64;
        let mut sum = 0.0;
        let steps = powers.iter().map(|p| {
            let before = (sum * STEPS).round();
            sum += by_power * (p / total) + uniform;
            (sum * STEPS).round() - before
        });
        Some(Choice { distribution: Discrete::new(steps)? })
    }

    /// A light for a uniform number in `[0, 1)`.
    #[inline]
    pub(super) fn sample(&self, u: f32) -> u32 {
        self.distribution.sample(u.into()) as u32
    }

    /// The probability of a light.
    #[inline]
    pub(super) fn probability(&self, light: u32) -> f64 {
        self.distribution.probability(light as usize).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finite(flux: f64) -> Power {
        Power { flux, infinite: false }
    }

    #[test]
    fn light_from_infinity_has_half_of_the_choices_at_most() {
        let infinite = |flux| Power { flux, infinite: true };
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
}
