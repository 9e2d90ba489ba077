//! The choice among lights: one distribution, for emission (`P`) and for next-event estimation (`P'`).

use crate::math::Discrete;

/// Share of the choices that ignores power. A lamp beside the sun has a share of the power below the
/// resolution of a 23-bit random number; chosen by power alone it would never light the room that the
/// sun does not reach.
const UNIFORM_SHARE: f64 = 0.1;

/// Chooses a light by emitted power, mixed with a uniform choice.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    distribution: Discrete,
}

impl Choice {
    /// From the emitted powers, all positive; `None` if there are none.
    pub(super) fn by_power(powers: &[f64]) -> Option<Choice> {
        let total: f64 = powers.iter().sum();
        let uniform = UNIFORM_SHARE / powers.len() as f64;
        let weights = powers.iter().map(|p| (1.0 - UNIFORM_SHARE) * (p / total) + uniform);
        Some(Choice { distribution: Discrete::new(weights)? })
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
}
