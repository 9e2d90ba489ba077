//! The choice among lights: one distribution, for emission (`P`) and for next-event estimation (`P'`).

use crate::math::Discrete;

/// Share of the choices that ignores power. A lamp beside the sun has a share of the power below the
/// resolution of a random number; chosen by power alone it would never light the room that the
/// sun does not reach.
const UNIFORM_SHARE: f64 = 0.1;

/// Steps of the random numbers that choose: 23 bits. Probabilities are whole numbers of them, so that a light is chosen
/// as often as claimed, however many there are.
const STEPS: f64 = (1 << 23) as f64;

/// Largest number of lights: one step for each, and as many for their power.
pub const MOST_LIGHTS: usize = 1 << 22;

/// Chooses a light by emitted power, mixed with a uniform choice.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    distribution: Discrete,
}

impl Choice {
    /// From the emitted powers, all positive; `None` if there are none.
    pub(super) fn by_power(powers: &[f64]) -> Option<Choice> {
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
        self.distribution.sample(u) as u32
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

    #[test]
    fn strong_lights_are_chosen_by_power_and_no_light_is_forgotten() {
        let choice = Choice::by_power(&[1e9, 3e9, 1e-30]).unwrap();
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
            let mut powers = vec![1e-30; n];
            powers[n / 3] = 1e9;
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
