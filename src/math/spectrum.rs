//! Light of one wavelength as a colour, and glass's index for it.

use super::Rgb;
use glam::{DMat3, DVec3};

/// Most of the spectrum that is one band: as a share of its weight in colours, and in nanometres, which counts at its ends. Not
/// tuned. Computed behind a prism of dense flint (SF11, 60 degrees): the 76 bands are apart by 0.8 degrees at the violet end, by
/// 0.1 in the median, a fifth of the sun's disc.
const MOST_WEIGHT: f64 = 1.0 / 64.0;
const MOST_WIDE: f64 = 8.0;

/// A part of the spectrum.
#[derive(Clone, Copy, Debug)]
pub struct Band {
    /// Mean wavelength, nanometres.
    pub wavelength: f64,
    /// Colour of light of the band, in linear Rec. 709, where light of all bands is white: their mean is 1. At most 3.7 in
    /// any channel, and little at the ends.
    pub color: Rgb,
}

/// Visible wavelengths, nanometres, and the step of integrals.
const VISIBLE: [f64; 2] = [380.0, 730.0];
const STEP: f64 = 0.1;

/// The spectrum, from violet to red.
pub fn bands() -> Vec<Band> {
    let count = ((VISIBLE[1] - VISIBLE[0]) / STEP) as usize;
    let samples: Vec<(f64, DVec3)> = (0..count)
        .map(|i| VISIBLE[0] + (i as f64 + 0.5) * STEP)
        .map(|wavelength| (wavelength, monochromatic(wavelength)))
        .collect();
    let all: DVec3 = samples.iter().map(|(_, color)| *color).sum();
    let mut bands = Vec::new();
    let (mut color, mut moment, mut wide) = (DVec3::ZERO, 0.0, 0.0);
    for (i, (wavelength, sample)) in samples.into_iter().enumerate() {
        let share = sample / all;
        (color, moment, wide) = (color + share, moment + share.element_sum() * wavelength, wide + STEP);
        let weight = color.element_sum();
        if weight >= 3.0 * MOST_WEIGHT || wide >= MOST_WIDE || i + 1 == count {
            bands.push(Band { wavelength: moment / weight, color: color.as_vec3() });
            (color, moment, wide) = (DVec3::ZERO, 0.0, 0.0);
        }
    }
    let number = bands.len() as f32;
    bands.iter_mut().for_each(|band| band.color *= number);
    bands
}

/// Linear Rec. 709 of light of one wavelength, without what that has no colour for: negative parts are cut.
fn monochromatic(wavelength: f64) -> DVec3 {
    let to_rgb = DMat3::from_cols(
        DVec3::new(3.2406, -0.9689, 0.0557),
        DVec3::new(-1.5372, 1.8758, -0.2040),
        DVec3::new(-0.4986, 0.0415, 1.0570),
    );
    (to_rgb * xyz(wavelength)).max(DVec3::ZERO)
}

/// The colour matching functions of CIE 1931, by the fits of Wyman, Sloan and Shirley 2013 ("Simple Analytic Approximations to
/// the CIE XYZ Color Matching Functions").
fn xyz(wavelength: f64) -> DVec3 {
    let bell = |mean: f64, below: f64, above: f64| {
        let x = (wavelength - mean) / if wavelength < mean { below } else { above };
        (-0.5 * x * x).exp()
    };
    let x = 1.056 * bell(599.8, 37.9, 31.0) + 0.362 * bell(442.0, 16.0, 26.7) - 0.065 * bell(501.1, 20.4, 26.2);
    let y = 0.821 * bell(568.8, 46.9, 40.5) + 0.286 * bell(530.9, 16.3, 31.1);
    let z = 1.217 * bell(437.0, 11.8, 36.0) + 0.681 * bell(459.0, 26.0, 13.8);
    DVec3::new(x, y, z)
}

/// Wavelengths of Fraunhofer's lines, nanometres: helium's yellow, hydrogen's blue and red.
const D: f64 = 587.56;
const F: f64 = 486.13;
const C: f64 = 656.27;

/// The index of refraction at a wavelength, from that of helium's yellow line and the Abbe number: Cauchy's equation with two
/// terms, which has these, never below 1.
pub fn index(ior: f32, abbe: f32, wavelength: f64) -> f32 {
    let inverse_square = |w: f64| 1.0 / (w * w);
    let slope = f64::from(ior - 1.0) / (f64::from(abbe) * (inverse_square(F) - inverse_square(C)));
    (f64::from(ior) + slope * (inverse_square(wavelength) - inverse_square(D))).max(1.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_bands_together_are_white_and_each_has_its_colour() {
        let bands = bands();
        assert!((64..90).contains(&bands.len()), "{}", bands.len());
        let mean = bands.iter().map(|band| band.color).sum::<Rgb>() / bands.len() as f32;
        assert!((mean - Rgb::ONE).abs().max_element() < 1e-5, "{mean}");
        let apart = |pair: &[Band]| pair[1].wavelength - pair[0].wavelength;
        assert!(bands.windows(2).all(|pair| apart(pair) > 0.0 && apart(pair) < 2.0 * MOST_WIDE));
        for band in &bands {
            let sum = band.color.element_sum();
            assert!(sum > 0.0 && band.color.max_element() < 3.7 && band.color.min_element() >= 0.0, "{band:?}");
        }
        let at = |wavelength: f64| {
            let near = |band: &&Band| (band.wavelength - wavelength).abs();
            bands.iter().min_by(|a, b| near(a).total_cmp(&near(b))).expect("bands").color
        };
        assert!(
            at(620.0).x > 2.9 && at(540.0).y > 2.0 && at(455.0).z > 2.5,
            "{} {} {}",
            at(620.0),
            at(540.0),
            at(455.0)
        );
    }

    /// Of the CIE's tables for the observer of 1931.
    #[test]
    fn matching_functions() {
        let tables = [
            (450.0, DVec3::new(0.3362, 0.0380, 1.7721)),
            (500.0, DVec3::new(0.0049, 0.3230, 0.2720)),
            (550.0, DVec3::new(0.4334, 0.9950, 0.0087)),
            (600.0, DVec3::new(1.0622, 0.6310, 0.0008)),
            (650.0, DVec3::new(0.2835, 0.1070, 0.0)),
        ];
        for (wavelength, known) in tables {
            let fit = xyz(wavelength);
            assert!((fit - known).abs().max_element() < 0.03, "{wavelength}: {fit}");
        }
    }

    /// BK7: n_F = 1.52238, n_d = 1.51680, n_C = 1.51432, V_d = 64.17 (Schott's catalogue).
    #[test]
    fn the_index_of_a_glass() {
        let n = |wavelength| f64::from(index(1.5168, 64.17, wavelength));
        assert!((n(D) - 1.5168).abs() < 1e-6);
        assert!((n(F) - 1.52238).abs() < 2e-4 && (n(C) - 1.51432).abs() < 2e-4, "{} {}", n(F), n(C));
        assert!(((n(D) - 1.0) / (n(F) - n(C)) / 64.17 - 1.0).abs() < 1e-3);
        assert!(index(1.01, 1.0, 730.0) >= 1.0);
    }
}
