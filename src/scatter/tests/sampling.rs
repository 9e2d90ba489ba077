//! Samplers against the densities they claim, and weights against values.

use super::*;
use crate::math::chi_square;

/// Chi-square of every material of the catalogue, from every side, on plain and bent normals; 1 % for
/// the whole suite. On bent normals the density must vanish exactly where the sampler refuses.
#[test]
fn samples_follow_their_density() {
    let catalogue = catalogue();
    let points = [flat(), bent(0.5)];
    let tests = catalogue.len() * COSINES.len() * points.len();
    let mut seed = 0;
    for (name, scattering) in &catalogue {
        let bsdf = Bsdf::new(scattering);
        for at in &points {
            for cos in COSINES {
                seed += 1;
                // In the plane of the two normals nearly, on the side where they agree.
                let wo = direction(at, cos, if cos > 0.0 { 0.3 } else { std::f32::consts::PI + 0.3 });
                let frame = Frame::around(at.ns);
                let mut r = random(seed);
                let fit = chi_square::sphere(
                    40_000,
                    [20, 32],
                    || {
                        let s = bsdf.sample(at, wo, TransportMode::Radiance, r.next_1d(), r.next_2d())?;
                        s.connectable.then(|| frame.to_local(s.wi))
                    },
                    |w| bsdf.evaluate(at, wo, frame.to_world(w), TransportMode::Radiance).pdf as f64,
                );
                fit.assert_accepted(&format!("{name}, cos {cos}, bent {}", at.ng != at.ns), tests);
            }
        }
    }
}

/// What a sample reports is what a connection along it would find.
#[test]
fn weights_are_value_times_cosine_over_density() {
    let mut r = random(1);
    for (name, scattering) in catalogue() {
        let bsdf = Bsdf::new(&scattering);
        for at in [flat(), bent(0.3)] {
            for _ in 0..3000 {
                let wo = warp::sphere(r.next_2d());
                for mode in MODES {
                    let Some(s) = bsdf.sample(&at, wo, mode, r.next_1d(), r.next_2d()) else { continue };
                    assert!((s.wi.length() - 1.0).abs() < 1e-6, "{name}");
                    assert_eq!(s.transmitted, s.wi.dot(at.ng) * wo.dot(at.ng) < 0.0, "{name}");
                    if s.connectable {
                        let e = bsdf.evaluate(&at, wo, s.wi, mode);
                        assert_eq!(s.pdf, e.pdf, "{name}");
                        let weight = e.f * s.wi.dot(at.ns).abs() / e.pdf;
                        assert!((s.weight - weight).length() <= 1e-5 * weight.length(), "{name}: {s:?} {weight}");
                    }
                }
            }
        }
    }
}

/// Drawing visible normals leaves the masking of the other direction as the weight, in both lobes of
/// rough glass (Walter et al. 2007, eq. 41, with Heitz and d'Eon 2014); radiance is scaled by the
/// squared index ratio on top.
#[test]
fn weights_of_rough_glass_are_its_masking() {
    let at = flat();
    let mut r = random(2);
    for roughness in [0.3, 0.6, 1.0] {
        let bsdf = Bsdf::new(&glass(1.5, roughness));
        let alpha = roughness * roughness;
        for _ in 0..20_000 {
            let wo = warp::sphere(r.next_2d());
            for mode in MODES {
                let Some(s) = bsdf.sample(&at, wo, mode, r.next_1d(), r.next_2d()) else { continue };
                let cos2 = s.wi.dot(at.ns).powi(2);
                let g1 = 2.0 / (1.0 + (1.0 + alpha * alpha * (1.0 - cos2) / cos2).sqrt());
                let ratio = if wo.dot(at.ns) > 0.0 { 1.0 / 1.5 } else { 1.5f32 };
                let scale = if s.transmitted && mode == TransportMode::Radiance { ratio * ratio } else { 1.0 };
                assert!((s.weight.x / (g1 * scale) - 1.0).abs() < 1e-3, "{roughness} {mode:?} {s:?} {}", g1 * scale);
            }
        }
    }
}

/// The reported reverse density is the density with the roles swapped.
#[test]
fn reverse_densities_are_densities() {
    let mut r = random(3);
    for (name, scattering) in catalogue() {
        let bsdf = Bsdf::new(&scattering);
        let at = bent(0.2);
        for _ in 0..5000 {
            let (wo, wi) = (warp::sphere(r.next_2d()), warp::sphere(r.next_2d()));
            let forward = bsdf.evaluate(&at, wo, wi, TransportMode::Radiance);
            let backward = bsdf.evaluate(&at, wi, wo, TransportMode::Importance);
            for (a, b) in [(forward.pdf, backward.pdf_reverse), (forward.pdf_reverse, backward.pdf)] {
                assert!((a - b).abs() <= 1e-4 * a.max(b), "{name}: {a} {b}");
            }
        }
    }
}

/// A density integrates to the share of its lobes: all of it for Lambert, the rest of the mirror's
/// probability for a smooth coat.
#[test]
fn densities_integrate_to_the_connectable_share() {
    let at = flat();
    let frame = Frame::around(at.ns);
    for (name, scattering) in catalogue() {
        let bsdf = Bsdf::new(&scattering);
        let wo = direction(&at, 0.6, 1.0);
        let integral = chi_square::integrate_sphere(|w| {
            bsdf.evaluate(&at, wo, frame.to_world(w), TransportMode::Radiance).pdf as f64
        });
        let mut r = random(4);
        let delta = (0..64)
            .filter_map(|k| bsdf.sample(&at, wo, TransportMode::Radiance, (k as f32 + 0.5) / 64.0, r.next_2d()))
            .find(|s| !s.connectable && !s.transmitted)
            .map_or(0.0, |s| s.pdf as f64);
        match name {
            "diffuse" | "smooth plastic" => {
                assert!((integral + delta - 1.0).abs() < 1e-4, "{name}: {integral} {delta}")
            }
            _ => assert!(integral < 1.0 + 1e-4 && integral > 0.3, "{name}: {integral}"),
        }
    }
}
