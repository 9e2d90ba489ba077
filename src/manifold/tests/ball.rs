//! Success and truth of the walk on a glass ball, against all roots of an independent solver.

use super::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// Two refractions through the unit circle, in the plane of both ends and the centre.
struct Planar {
    a: f64,
    b: (f64, f64),
    n: f64,
}

/// What a planar ray does: where it leaves the circle, and in which direction.
struct Exit {
    x: f64,
    y: f64,
    angle: f64,
}

impl Planar {
    /// The plane's first axis points from the centre to `a`.
    fn new(a: DVec3, b: DVec3, n: f64) -> Planar {
        let x = a.normalize();
        let y = (b - x * b.dot(x)).normalize_or_zero();
        Planar { a: a.length(), b: (b.dot(x), b.dot(y)), n }
    }

    /// The ray from `a` that meets the circle at incidence of sine `p` (signed), by angles alone.
    fn exit(&self, p: f64) -> Exit {
        let (i, r) = (p.asin(), (p / self.n).asin());
        // At a the ray leans by asin(p/a) from the axis; the entry lies at polar angle i - that.
        let lean = (p / self.a).asin();
        let entry = i - lean;
        // Each passage turns the ray by r - i; inside it subtends pi - 2r at the centre.
        let leave = entry + PI - 2.0 * r;
        let angle = PI - lean + 2.0 * (i - r);
        Exit { x: leave.cos(), y: leave.sin(), angle }
    }

    /// Distance of b from the leaving ray's line, signed, over that of b from the exit; and whether b is
    /// ahead.
    fn miss(&self, p: f64) -> (f64, bool) {
        let e = self.exit(p);
        let (dx, dy) = (self.b.0 - e.x, self.b.1 - e.y);
        let (c, s) = (e.angle.cos(), e.angle.sin());
        ((c * dy - s * dx) / dx.hypot(dy), c * dx + s * dy > 0.0)
    }

    /// All roots that a grid brackets: uniform in the angle of incidence, since the exit moves fast near
    /// grazing incidence.
    fn roots(&self) -> Vec<f64> {
        const GRID: usize = 1000;
        let sine = |k: usize| ((k as f64 + 0.5) / GRID as f64 * PI - FRAC_PI_2).sin();
        let mut roots = Vec::new();
        let mut previous = (sine(0), self.miss(sine(0)));
        for k in 1..GRID {
            let here = (sine(k), self.miss(sine(k)));
            let ((mut lo, (f_lo, ahead_lo)), (mut hi, (f_hi, ahead_hi))) = (previous, here);
            if f_lo * f_hi <= 0.0 && ahead_lo && ahead_hi {
                for _ in 0..60 {
                    let mid = 0.5 * (lo + hi);
                    if self.miss(mid).0 * f_lo > 0.0 { lo = mid } else { hi = mid }
                }
                roots.push(0.5 * (lo + hi));
            }
            previous = here;
        }
        roots
    }

    /// The incidence sine of a first direction.
    fn sine(&self, a: DVec3, b: DVec3, first: DVec3) -> f64 {
        let x = a.normalize();
        let y = (b - x * b.dot(x)).normalize_or_zero();
        self.a * first.dot(y)
    }
}

/// Distances and radii of the disks of both ends; least share of solved pairs, and mean steps as measured.
const SETUPS: [([f64; 4], f64, f64); 3] =
    [([1.6, 1.2, 5.0, 1.5], 0.998, 12.8), ([1.05, 1.0, 4.0, 1.0], 0.992, 16.0), ([3.0, 1.5, 3.0, 1.5], 1.000, 7.4)];

/// Pairs whose straight segment crosses the ball.
fn pairs(random: &mut Random, [z_a, r_a, z_b, r_b]: [f64; 4], count: usize) -> Vec<(DVec3, DVec3)> {
    let mut found = Vec::new();
    while found.len() < count {
        let (a, b) = (random.disk(r_a, -z_a), random.disk(r_b, z_b));
        let d = (b - a).normalize();
        if (a - d * a.dot(d)).length() < 1.0 {
            found.push((a, b));
        }
    }
    found
}

#[test]
fn solves_what_the_planar_solver_solves() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let settings = WalkSettings::default();
    for (k, (disks, share, steps)) in SETUPS.into_iter().enumerate() {
        let mut random = Random::new(31 + k as u64);
        let (mut solvable, mut solved, mut iterations) = (0u32, 0u32, 0u32);
        let (mut angle, mut off) = (0.0f64, 0.0f64);
        for (a, b) in pairs(&mut random, disks, [3000, 6000, 3000][k]) {
            let planar = Planar::new(a, b, 1.5);
            let roots = planar.roots();
            let result = connect(&ball, a, b, &settings);
            if roots.is_empty() {
                // Two roots within one step of the grid, or one beyond its ends.
                if let Ok(chain) = result {
                    let p = planar.sine(a, b, chain.first);
                    assert!(planar.miss(p).0.abs() * (1.0 - p * p).sqrt() < 1e-7, "{p} {chain:?}");
                }
                continue;
            }
            solvable += 1;
            let Ok(chain) = result else { continue };
            solved += 1;
            iterations += chain.iterations;
            let p = planar.sine(a, b, chain.first);
            let (miss, ahead) = planar.miss(p);
            assert!(ahead && chain.first.dot(a.cross(b)).abs() < 1e-6);
            // The residual is a difference of sines: the angle's times the cosine at the exit.
            angle = angle.max(miss.abs() * (1.0 - p * p).sqrt());
            off = off.max(roots.iter().map(|r| (r - p).abs()).fold(f64::INFINITY, f64::min));
        }
        let (rate, mean) = (solved as f64 / solvable as f64, iterations as f64 / solved as f64);
        eprintln!("setup {k}: {solved}/{solvable} = {rate:.4}, mean steps {mean:.2}, miss {angle:.1e}, off {off:.1e}");
        // Ten times the tolerance. The sine deviates by its square root near a fold.
        assert!(angle < 1e-7, "{angle}");
        assert!(off < 2e-4, "{off}");
        // One-sided, 99.9 %, the given share taken as exact. With the unnormalised constraint the first two
        // setups fail here (0.9947, 0.9821), with 20 steps at most, too.
        let sd = (share * (1.0 - share) / solvable as f64).sqrt();
        assert!(rate >= share - 3.09 * sd, "{rate} {share}");
        assert!((mean / steps - 1.0).abs() < 0.25, "{mean} {steps}");
    }
}

#[test]
fn same_ends_same_bits() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let mut random = Random::new(41);
    let settings = WalkSettings::default();
    let all = pairs(&mut random, SETUPS[1].0, 2000);
    let bits = |r: &Result<Chain, Rejected>| format!("{r:?}");
    let forward: Vec<_> = all.iter().map(|&(a, b)| connect(&ball, a, b, &settings)).collect();
    // Again in another order, so that nothing left from a walk could matter.
    for (&(a, b), before) in all.iter().zip(&forward).rev() {
        let again = connect(&ball, a, b, &settings);
        assert_eq!(bits(&again), bits(before));
        if let (Ok(x), Ok(y)) = (again, before) {
            assert_eq!(x.inverse_jacobian.to_bits(), y.inverse_jacobian.to_bits());
            assert_eq!(x.transmittance.to_bits(), y.transmittance.to_bits());
        }
    }
}

/// The walk depends on the order of the ends: another function, not another sign.
#[test]
fn the_other_order_may_fail_or_find_another_root() {
    let ball = [Solid::ball(DVec3::ZERO, 1.0, 1.5)];
    let settings = WalkSettings::default();
    let mut rates = Vec::new();
    for (disks, ..) in SETUPS {
        let mut random = Random::new(42);
        let (mut only_one, mut another) = (0u32, 0u32);
        let count = 3000;
        for (a, b) in pairs(&mut random, disks, count) {
            match (connect(&ball, a, b, &settings), connect(&ball, b, a, &settings)) {
                (Ok(x), Ok(y)) => another += (x.first.distance(y.last) > 1e-4) as u32,
                (Err(_), Err(_)) => {}
                _ => only_one += 1,
            }
        }
        eprintln!("{disks:?}: only one order {only_one}, another root {another} of {count}");
        rates.push((only_one as f64 / count as f64, another as f64 / count as f64));
    }
    // Far ends: both orders agree. Inside the caustic they need not, which is why the order is fixed.
    assert!(rates[2].0 < 0.005, "{rates:?}");
    assert!(rates[1].0 + rates[1].1 > 0.01, "{rates:?}");
}

/// Weakly curved interfaces, as of an eye, a window or water, take three steps: four looks at the
/// constraint, as published.
#[test]
fn shallow_interfaces_take_few_steps() {
    let mut random = Random::new(43);
    let (mut steps, mut solved) = (0, 0);
    let count = 1000;
    for _ in 0..count {
        let solids = bent_slab(&mut random, [1.0, 1.4, 1.0]);
        let (a, b) = (random.disk(0.8, -0.5), random.disk(0.8, 3.0));
        if let Ok(chain) = connect(&solids, a, b, &WalkSettings::default()) {
            steps += chain.iterations;
            solved += 1;
        }
    }
    let mean = steps as f64 / solved as f64;
    eprintln!("shallow: {solved} of {count}, mean steps {mean:.2}");
    assert!(solved > 990 && (2.0..4.0).contains(&mean), "{solved} {mean}");
}
