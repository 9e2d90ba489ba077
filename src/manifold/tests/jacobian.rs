//! The geometry term: ray differentials against the block system, against differences of paths solved
//! anew, and against the étendue identity.

use super::*;
use crate::geometry::differential::tangents;
use crate::manifold::constraint::Form;

/// Solved chains through balls (one, nested, six interfaces deep, two) and bent slabs, between media that differ.
fn samples(count: usize) -> Vec<(Vec<Solid>, DVec3, DVec3, Chain)> {
    let mut random = Random::new(11);
    let mut found = Vec::new();
    while found.len() < count {
        let (solids, a, b) = match found.len() % 5 {
            0 => {
                let n = [random.within(1.0, 1.4), random.within(1.5, 2.0), random.within(1.0, 1.4)];
                (bent_slab(&mut random, n), random.disk(0.8, -0.5), random.disk(0.8, 3.0))
            }
            1 => (vec![Solid::ball(DVec3::ZERO, 1.0, 1.5)], random.disk(0.8, -2.5), random.disk(0.8, 3.0)),
            2 => {
                let inner = Solid { front: 1.5, back: 1.2, ..Solid::ball(DVec3::Z * 0.2, 0.6, 1.0) };
                let solids = vec![Solid::ball(DVec3::ZERO, 1.0, 1.5), inner];
                (solids, random.disk(0.3, -3.0), random.disk(0.3, 3.0))
            }
            3 => {
                let shell = |r: f64, n: [f64; 2]| Solid { front: n[0], ..Solid::ball(DVec3::ZERO, r, n[1]) };
                let solids = vec![shell(1.0, [1.0, 1.2]), shell(0.8, [1.2, 1.4]), shell(0.6, [1.4, 1.6])];
                (solids, random.disk(0.4, -3.0), random.disk(0.4, 3.0))
            }
            _ => {
                let shell = |z: f64| Solid::ball(DVec3::Z * z, 1.0, 1.33);
                (vec![shell(-1.2), shell(1.2)], random.disk(0.4, -4.0), random.disk(0.4, 4.0))
            }
        };
        if let Ok(chain) = connect(&solids, a, b, &EXACT) {
            found.push((solids, a, b, chain));
        }
    }
    found
}

#[test]
fn equals_the_block_form() {
    for (_, _, _, chain) in samples(400) {
        let j = 1.0 / chain.inverse_jacobian;
        let forms: [fn(f64, f64) -> Form; 2] = [|_, _| Form::Unnormalised, |_, _| Form::HalfVector];
        for form in forms {
            let e = error(block_form::jacobian(&chain, form), j);
            assert!(e < 1e-9, "{e} {chain:?}");
        }
    }
}

#[test]
fn equals_differences_of_paths_solved_anew() {
    for (solids, a, b, chain) in samples(200) {
        let (p_u, p_v) = tangents(chain.last);
        let h = 1e-4 * (b - a).length();
        let first = |shift: DVec3| connect(&solids, a, b + shift, &EXACT).ok().map(|c| c.first);
        let slope = |p: DVec3| Some((first(p * h)? - first(-p * h)?) / (2.0 * h));
        // A neighbour may lie behind a silhouette or a caustic, where there is nothing to compare.
        let (Some(du), Some(dv)) = (slope(p_u), slope(p_v)) else { continue };
        let j = chain.first.dot(du.cross(dv)).abs();
        // The differences' own error is that of the third derivative, large where J itself is.
        let spread = (chain.inverse_jacobian / (b - a).length_squared()).min(1.0);
        let e = error(j, 1.0 / chain.inverse_jacobian);
        assert!(e < 1e-5 / spread, "{e} {spread}");
    }
}

#[test]
fn of_a_direction_equals_blocks_differences_and_the_far_limit() {
    let mut random = Random::new(12);
    let mut compared = 0;
    for _ in 0..200 {
        let solids = bent_slab(&mut random, [1.0, 1.5, 1.2]);
        let a = random.disk(0.8, -0.5);
        let d = DVec3::new(random.within(-0.3, 0.3), random.within(-0.3, 0.3), 1.0).normalize();
        let solve = |d: DVec3| reach(&solids, a, End::Direction(d), &EXACT);
        let Ok(chain) = solve(d) else { continue };
        let j = 1.0 / chain.inverse_jacobian;
        assert!(error(block_form::jacobian(&chain, |_, _| Form::HalfVector), j) < 1e-9);
        let far = 1e7;
        let point = walk_to(&solids, a, chain.vertices()[1].p + d * far, &chain);
        // cos_b = 1: J L^2 -> J_dir, up to 1/L.
        assert!(error(far * far / point.inverse_jacobian, j) < 1e-5);
        let (u, v) = tangents(d);
        let h = 1e-4;
        let slope = |p: DVec3| {
            let first = |s: f64| solve((d + p * (s * h)).normalize()).ok().map(|c| c.first);
            Some((first(1.0)? - first(-1.0)?) / (2.0 * h))
        };
        if let (Some(du), Some(dv)) = (slope(u), slope(v)) {
            assert!(error(chain.first.dot(du.cross(dv)).abs(), j) < 1e-5);
            compared += 1;
        }
    }
    assert!(compared > 150, "{compared}");
}

/// The walk from a known chain's vertices to another end.
fn walk_to(solids: &[Solid], a: DVec3, b: DVec3, known: &Chain) -> Chain {
    let mut seed = Seed::default();
    for (crossing, at) in known.crossings().iter().zip(known.vertices()) {
        seed.push(*crossing, at).unwrap();
    }
    walk(&Local { solids, a }, None, End::Point(b), &seed, None, &TIGHT).unwrap()
}

/// The same chain from the other end.
fn reversed(solids: &[Solid], b: DVec3, a: DVec3, chain: &Chain) -> Chain {
    let mut seed = Seed::default();
    for (c, at) in chain.crossings().iter().zip(chain.vertices()).rev() {
        let crossing = Crossing { inward: !c.inward, n_i: c.n_o, n_o: c.n_i, ..*c };
        seed.push(crossing, &Differential { p: at.p + a - b, ..*at }).unwrap();
    }
    walk(&Local { solids, a: b }, None, End::Point(a - b), &seed, None, &EXACT).unwrap()
}

#[test]
fn reverse_follows_from_the_etendue_identity() {
    let (mut kappa_low, mut kappa_high) = (f64::INFINITY, 0.0f64);
    for (solids, a, b, chain) in samples(400) {
        let back = reversed(&solids, b, a, &chain);
        assert!(back.first.distance(chain.last) < 1e-12 && back.last.distance(chain.first) < 1e-12);
        let e = error(chain.reverse_inverse_jacobian(), back.inverse_jacobian);
        assert!(e < 1e-10, "{e}");
        assert!(error(chain.kappa * back.kappa, 1.0) < 1e-12);
        assert!(error(chain.transmittance, back.transmittance) < 1e-11);
        kappa_low = kappa_low.min(chain.kappa);
        kappa_high = kappa_high.max(chain.kappa);
    }
    // The shading normals of the slabs count, or the identity would hold without kappa.
    assert!(kappa_low < 0.985 && kappa_high > 1.015, "{kappa_low} {kappa_high}");
}
