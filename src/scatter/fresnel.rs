//! Fresnel reflection and refraction at a boundary, from the refractive indices on both sides.
//!
//! Cosines are of the angle to the normal that points to the ray's own side, so never negative.

use crate::math::Rgb;
use glam::Vec3;

/// Cosine of the refracted ray (Snell's law) for a ray in a medium of index `n_i` that meets one of
/// `n_o`; `None` for total reflection.
///
/// `cos_o^2 = (1-e)(1+e) + e^2 cos_i^2` with `e = n_i/n_o`, the difference taken of the indices
/// themselves, where it is exact for close ones.
#[inline]
pub fn refraction_cosine(n_i: f32, n_o: f32, cos_i: f32) -> Option<f32> {
    if n_i == n_o {
        return Some(cos_i);
    }
    let inverse = 1.0 / n_o;
    let e = n_i * inverse * cos_i;
    let squared = (n_o - n_i) * (n_o + n_i) * inverse * inverse + e * e;
    // A cosine above 1 can only be rounding.
    (squared > 0.0).then(|| squared.sqrt().min(1.0))
}

/// Reflectance of unpolarised light (Fresnel 1823) from the cosines of Snell's law on both sides.
/// The same bits whichever side comes first.
///
/// The amplitudes are written with `n_b - n_a` as a factor, `r_s = (n_a^2 - n_b^2) / (n_a cos_a + n_b
/// cos_b)^2` and likewise `r_p`, so that nothing cancels between nearly equal media.
#[inline]
pub fn reflectance(n_a: f32, cos_a: f32, n_b: f32, cos_b: f32) -> f32 {
    // From the optically thinner side, whose angle is the wider one.
    let (n_1, c_1, n_2, c_2) = if n_a <= n_b { (n_a, cos_a, n_b, cos_b) } else { (n_b, cos_b, n_a, cos_a) };
    if n_1 == n_2 {
        return 0.0;
    }
    let difference = (n_2 - n_1) * (n_2 + n_1);
    let ratio = n_1 / n_2;
    let sin2 = (1.0 - c_1) * (1.0 + c_1);
    let s = n_1 * c_1 + n_2 * c_2;
    let p = n_2 * c_1 + n_1 * c_2;
    let r_s = difference / (s * s);
    let r_p = difference * (1.0 - sin2 * (1.0 + ratio * ratio)) / (p * p);
    (0.5 * (r_s * r_s + r_p * r_p)).min(1.0)
}

/// Reflectance of unpolarised light that comes from a medium of index `n_i` to one of `n_o`; 1 for
/// total reflection.
#[inline]
pub fn dielectric(n_i: f32, n_o: f32, cos_i: f32) -> f32 {
    match refraction_cosine(n_i, n_o, cos_i) {
        Some(cos_o) => reflectance(n_i, cos_i, n_o, cos_o),
        None => 1.0,
    }
}

/// [`bend`] from the medium `n_i` into `n_o`; `None` for total reflection.
#[cfg(test)]
fn refract(w: Vec3, n: Vec3, n_i: f32, n_o: f32) -> Option<Vec3> {
    let cos_i = w.dot(n);
    let cos_o = refraction_cosine(n_i, n_o, cos_i)?;
    Some(bend(w, n, n_i / n_o, cos_i, cos_o))
}

/// Direction, leaving the surface, into which `w` (leaving the surface too, on the side of the unit normal `n`) refracts, by
/// the cosines on both sides; `ratio` is `n_i / n_o`.
#[inline]
pub(super) fn bend(w: Vec3, n: Vec3, ratio: f32, cos_i: f32, cos_o: f32) -> Vec3 {
    n * (ratio * cos_i - cos_o) - w * ratio
}

/// Mirror image of `w` about `n`, both leaving the surface.
#[inline]
pub fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * w.dot(n)) - w
}

/// Schlick's fit (1994): from `f0` at normal incidence to `f90` at grazing incidence.
#[inline]
pub fn schlick(f0: Rgb, f90: f32, cos: f32) -> Rgb {
    f0 + (Rgb::splat(f90) - f0) * schlick_weight(cos)
}

/// `(1 - cos)^5`.
#[inline]
pub(super) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Sampler, Stream};

    /// The textbook form in f64, with its cancellations.
    fn textbook(n_i: f64, n_o: f64, cos_i: f64) -> f64 {
        let sin2_o = (n_i / n_o).powi(2) * (1.0 - cos_i * cos_i);
        if sin2_o >= 1.0 {
            return 1.0;
        }
        let cos_o = (1.0 - sin2_o).sqrt();
        let s = (n_i * cos_i - n_o * cos_o) / (n_i * cos_i + n_o * cos_o);
        let p = (n_o * cos_i - n_i * cos_o) / (n_o * cos_i + n_i * cos_o);
        0.5 * (s * s + p * p)
    }

    #[test]
    fn closed_values() {
        assert!((dielectric(1.0, 1.5, 1.0) - 0.04).abs() < 1e-8);
        assert!((dielectric(1.5, 1.0, 1.0) - 0.04).abs() < 1e-8);
        // Brewster: tan = 1.5, p vanishes and r_s = (1 - 1.5^2)/(1 + 1.5^2).
        let brewster = 0.5 * (1.25f32 / 3.25).powi(2);
        assert!((dielectric(1.0, 1.5, 1.0 / 3.25f32.sqrt()) - brewster).abs() < 1e-7);
        assert!((dielectric(1.0, 1.5, 0.0) - 1.0).abs() < 2e-7);
        // Critical cosine of 1.5 -> 1: sqrt(1 - 1/2.25) = 0.745356.
        assert_eq!(dielectric(1.5, 1.0, 0.7453), 1.0);
        assert!(dielectric(1.5, 1.0, 0.7454) < 0.97);
        assert_eq!(dielectric(1.33, 1.33, 0.0), 0.0);
    }

    #[test]
    fn agrees_with_the_textbook_form() {
        let mut random = Sampler::new(5, 0, 0, Stream::Camera);
        for _ in 0..100_000 {
            let n_i = 1.0 + 1.5 * random.next_1d();
            let n_o = 1.0 + 1.5 * random.next_1d();
            let cos = random.next_1d();
            let (f, exact) = (dielectric(n_i, n_o, cos) as f64, textbook(n_i as f64, n_o as f64, cos as f64));
            // f32 rounding of cos_o^2 is amplified by d F / d cos_o^2 ~ 1/cos_o near the critical angle.
            let cos2_o = 1.0 - (n_i as f64 / n_o as f64).powi(2) * (1.0 - (cos as f64).powi(2));
            assert!((f - exact).abs() < 2e-6 / cos2_o.abs().sqrt().max(1e-3), "{n_i} {n_o} {cos}: {f} {exact}");
        }
    }

    #[test]
    fn keeps_its_digits_between_nearly_equal_media() {
        // Normal incidence: ((n-1)/(n+1))^2. The index itself rounds, so the exact one is what f32 holds.
        for excess in [1e-2f32, 1e-4, 1e-6] {
            let n = 1.0 + excess;
            let exact = ((n as f64 - 1.0) / (n as f64 + 1.0)).powi(2);
            for f in [dielectric(1.0, n, 1.0), dielectric(n, 1.0, 1.0)] {
                assert!((f as f64 / exact - 1.0).abs() < 1e-6, "{excess}: {f} {exact}");
            }
            let oblique = textbook(1.0, n as f64, 0.5);
            assert!((dielectric(1.0, n, 0.5) as f64 / oblique - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn both_sides_agree_bit_for_bit_on_the_same_cosines() {
        let mut random = Sampler::new(6, 0, 0, Stream::Camera);
        for _ in 0..10_000 {
            let n = 1.0 + 2.0 * random.next_1d();
            let c = random.next_1d();
            if let Some(t) = refraction_cosine(1.0, n, c) {
                assert_eq!(reflectance(1.0, c, n, t), reflectance(n, t, 1.0, c));
            }
        }
    }

    #[test]
    fn refraction_obeys_snell_and_reverses() {
        let mut random = Sampler::new(7, 0, 0, Stream::Camera);
        for _ in 0..10_000 {
            let n = crate::math::warp::sphere(random.next_2d());
            let w = crate::math::warp::sphere(random.next_2d());
            let w = if w.dot(n) < 0.0 { -w } else { w };
            let (a, b) = (1.0 + random.next_1d(), 1.0 + random.next_1d());
            let Some(t) = refract(w, n, a, b) else {
                assert!(a > b && w.cross(n).length() > b / a - 1e-6);
                continue;
            };
            assert!((t.length() - 1.0).abs() < 1e-6 && t.dot(n) < 0.0);
            assert!((w.cross(n) * a + t.cross(n) * b).length() < 1e-6);
            if let Some(back) = refract(t, -n, b, a) {
                // Near grazing incidence a cosine has only half its digits.
                assert!((back - w).length() < 2e-6 / w.dot(n).max(1e-3), "{w} {back}");
            }
        }
    }
}
