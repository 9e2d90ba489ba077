//! Rough interfaces: microfacet normals that follow the surface, and walks that refract at them.

use super::*;
use crate::geometry::differential::tangents;
use glam::DVec2;

fn tilts(random: &mut Random, seed: &Seed, alpha: f64) -> Vec<Tilt> {
    let sample =
        |at: &Differential| Tilt::sample(at.ns, alpha, DVec2::new(random.within(0.0, 1.0), random.within(0.0, 1.0)));
    seed.vertices().iter().map(sample).collect()
}

/// The chain from `a` to `b` through surfaces whose microfacets are given in world space.
fn solve(solids: &[Solid], a: DVec3, b: DVec3, tilts: &[Tilt]) -> Option<Chain> {
    let (local, end) = (Local { solids, a }, End::Point(b - a));
    let mut seed = seed(&local, end).ok()?;
    if seed.crossings().len() != tilts.len() {
        return None;
    }
    (0..).zip(tilts).for_each(|(i, tilt)| seed.tilt(i, *tilt));
    walk(&local, None, end, &seed, None, &EXACT).ok()
}

type Sampled = (Vec<Solid>, DVec3, DVec3, Vec<Tilt>, Chain);

/// Chains through bent slabs and a ball with a core, with the microfacets.
fn samples(count: usize) -> Vec<Sampled> {
    let mut random = Random::new(21);
    let mut found = Vec::new();
    while found.len() < count {
        let (solids, a, b) = if found.len() % 2 == 0 {
            (bent_slab(&mut random, [1.1, 1.5, 1.2]), random.disk(0.8, -0.5), random.disk(0.8, 3.0))
        } else {
            let core = Solid { front: 1.5, back: 1.2, ..Solid::ball(DVec3::Z * 0.2, 0.6, 1.0) };
            (vec![Solid::ball(DVec3::ZERO, 1.0, 1.5), core], random.disk(0.3, -3.0), random.disk(0.3, 3.0))
        };
        let Ok(seed) = seed(&Local { solids: &solids, a }, End::Point(b - a)) else { continue };
        let tilts = tilts(&mut random, &seed, 0.2);
        if let Some(chain) = solve(&solids, a, b, &tilts) {
            found.push((solids, a, b, tilts, chain));
        }
    }
    found
}

#[test]
fn a_microfacet_turns_with_its_surface() {
    let mut random = Random::new(22);
    for _ in 0..200 {
        let n0 = random.direction();
        let tilt = Tilt::sample(n0, 0.4, DVec2::new(random.within(0.0, 1.0), random.within(0.0, 1.0)));
        let ball = Ball { center: DVec3::ZERO, radius: 0.7 };
        let n = (n0 + random.cube(0.5)).normalize();
        let at = ball.at(n);
        let tilted = tilt.applied(&at);
        // The angle with the normal is the offset's, wherever on the surface.
        let there = tilt.applied(&ball.at(n0)).ns;
        assert!((tilted.ns.dot(n) - there.dot(n0)).abs() < 1e-12);
        for (p, derivative) in [(at.p_u, tilted.n_u), (at.p_v, tilted.n_v)] {
            let normal = |h: f64| tilt.applied(&ball.at((n + p * (h / 0.7)).normalize())).ns;
            let difference = (normal(1e-5) - normal(-1e-5)) / 2e-5;
            assert!(difference.distance(derivative) < 1e-8, "{difference} {derivative}");
        }
        // What a sampled chain's half vector says is what a connection drew.
        let back = Tilt::of(n0, n, tilted.ns, 0.4).applied(&at);
        assert!(back.ns.distance(tilted.ns) < 1e-12);
    }
}

#[test]
fn geometry_term_at_fixed_offsets_equals_differences() {
    let mut compared = 0;
    for (solids, a, b, tilts, chain) in samples(200) {
        let (p_u, p_v) = tangents(chain.last);
        let h = 1e-5 * (b - a).length();
        let first = |shift: DVec3| solve(&solids, a, b + shift, &tilts).map(|c| c.first);
        let slope = |p: DVec3| Some((first(p * h)? - first(-p * h)?) / (2.0 * h));
        let (Some(du), Some(dv)) = (slope(p_u), slope(p_v)) else { continue };
        let j = chain.first.dot(du.cross(dv)).abs();
        let spread = (chain.inverse_jacobian / (b - a).length_squared()).min(1.0);
        let e = error(j, 1.0 / chain.inverse_jacobian);
        assert!(e < 1e-5 / spread, "{e} {spread}");
        compared += 1;
    }
    assert!(compared > 150, "{compared}");
}

#[test]
fn the_reverse_way_is_the_etendue_identity() {
    let mut compared = 0;
    for (solids, a, b, tilts, chain) in samples(200) {
        let backward: Vec<Tilt> = tilts.iter().rev().copied().collect();
        let Some(back) = solve(&solids, b, a, &backward) else { continue };
        if back.first.distance(chain.last) > 1e-9 {
            continue;
        }
        assert!(error(chain.reverse_inverse_jacobian(), back.inverse_jacobian) < 1e-9);
        assert!(error(chain.kappa * back.kappa, 1.0) < 1e-10);
        assert!(error(chain.density[0], back.density[1]) < 1e-9 && error(chain.density[1], back.density[0]) < 1e-9);
        compared += 1;
    }
    assert!(compared > 150, "{compared}");
}

#[test]
fn without_width_a_rough_walk_is_the_smooth_one() {
    let solids = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let (a, b) = (DVec3::new(0.2, 0.1, -3.0), DVec3::new(-0.1, 0.3, 4.0));
    let smooth = connect(&solids, a, b, &EXACT).unwrap();
    let seed = seed(&Local { solids: &solids, a }, End::Point(b - a)).unwrap();
    let flat: Vec<Tilt> = seed.vertices().iter().map(|at| Tilt::sample(at.ns, 1e-9, DVec2::splat(0.5))).collect();
    let rough = solve(&solids, a, b, &flat).unwrap();
    assert!(error(rough.inverse_jacobian, smooth.inverse_jacobian) < 1e-7);
    assert!(error(rough.transmittance, smooth.transmittance) < 1e-7);
}

#[test]
fn offsets_have_the_density_of_the_distribution() {
    // Of D(h) |n.h|, the share within an angle of cosine c is (1 - c²) / (1 + (alpha² - 1) c²).
    let mut random = Random::new(23);
    let (alpha, n) = (0.3f64, random.direction());
    let mut inside = [0.0; 3];
    let cosines = [0.99, 0.95, 0.8];
    let count = 40_000;
    for _ in 0..count {
        let tilt = Tilt::sample(n, alpha, DVec2::new(random.within(0.0, 1.0), random.within(0.0, 1.0)));
        let c = tilt.applied(&Differential { ns: n, ..Differential::FLAT }).ns.dot(n);
        (0..3).for_each(|k| inside[k] += f64::from(u8::from(c > cosines[k])) / f64::from(count));
    }
    for (share, c) in inside.into_iter().zip(cosines) {
        let expected = (1.0 - c * c) / (1.0 + (alpha * alpha - 1.0) * c * c);
        let sigma = (expected * (1.0 - expected) / f64::from(count)).sqrt();
        assert!((share - expected).abs() < 4.5 * sigma, "{share} {expected} {sigma}");
    }
}
