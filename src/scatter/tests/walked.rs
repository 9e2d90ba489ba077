//! Rough refraction that walks lead through is the rough refraction that connections evaluate, over the
//! density of its microfacets.

use super::*;
use crate::manifold::Tilt;
use std::f64::consts::PI;

/// GGX (Walter et al. 2007, eq. 33) of the microfacet at the cosine `c`, times that cosine.
fn offsets(alpha: f64, c: f64) -> f64 {
    let q = c * c * (alpha * alpha - 1.0) + 1.0;
    c * alpha * alpha / (PI * q * q)
}

#[test]
fn walked_refraction_is_the_evaluated_one() {
    let at = flat();
    let mut r = random(7);
    let mut compared = 0;
    for (roughness, n_1, n_2) in [(0.3, 1.0, 1.5f64), (0.6, 1.0, 1.5), (0.9, 1.0, 1.5), (0.6, 1.33, 1.2)] {
        let evaluated = Bsdf::new(&Scattering::Dielectric {
            inside: medium(n_2 as f32),
            outside: medium(n_1 as f32),
            roughness,
            tint: Rgb::ONE,
        });
        let walked = evaluated.walked(1.0).unwrap();
        let alpha = f64::from(roughness * roughness);
        for _ in 0..4000 {
            let wo = warp::sphere(r.next_2d());
            let (branch, u) = (r.next_1d(), r.next_2d());
            let Some(s) = walked.sample(&at, wo, TransportMode::Importance, branch, u) else { continue };
            let Some(microfacet) = s.microfacet else { continue };
            assert!(walked.evaluate(&at, wo, s.wi, TransportMode::Importance).f == Rgb::ZERO);
            let e = evaluated.evaluate(&at, wo, s.wi, TransportMode::Importance);
            let wide = |v: Vec3| v.as_dvec3();
            let (n, mut h) = (wide(at.ns), wide(microfacet.normal));
            h *= h.dot(n).signum();
            let (n_o, n_i) = if wo.dot(at.ns) > 0.0 { (n_1, n_2) } else { (n_2, n_1) };
            let (cos_o, cos_i) = (wide(wo).dot(h).abs(), wide(s.wi).dot(h).abs());
            // Near the critical angle and at the horizon, f32 has few digits left.
            if cos_o.min(cos_i) < 0.05 || wo.dot(at.ns).abs().min(s.wi.dot(at.ns).abs()) < 0.02 {
                continue;
            }
            // From offsets to directions on either side (Walter et al. 2007, eq. 17).
            let bent = (wide(wo) * n_o + wide(s.wi) * n_i).length_squared();
            let passes = f64::from(s.pdf) * offsets(alpha, h.dot(n));
            let [forward, reverse] = [passes * n_i * n_i * cos_i / bent, passes * n_o * n_o * cos_o / bent];
            let carried = Tilt::sample(n, alpha, glam::DVec2::ZERO).carried(n, h, -wide(wo), wide(s.wi));
            let f = f64::from(e.f.x) * wide(s.wi).dot(n).abs();
            for (name, expected, got) in [
                ("value", f, forward * carried.value),
                ("density", f64::from(e.pdf), forward * carried.density[0]),
                ("reverse density", f64::from(e.pdf_reverse), reverse * carried.density[1]),
                ("sampled density", f64::from(e.pdf), forward * f64::from(microfacet.density[0])),
                ("sampled reverse density", f64::from(e.pdf_reverse), reverse * f64::from(microfacet.density[1])),
                ("sampled weight", f, forward * f64::from(microfacet.density[0] * s.weight.x)),
            ] {
                assert!((got / expected - 1.0).abs() < 2e-3, "{name} at {roughness}: {got} {expected}");
            }
            compared += 1;
        }
    }
    assert!(compared > 4000, "{compared}");
}
