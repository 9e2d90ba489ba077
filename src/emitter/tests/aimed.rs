//! Emission that is aimed, against that which is not: the same light in other numbers of rays.

use super::*;
use std::sync::Arc;

/// Rays of each.
const N: usize = 200_000;

/// Standard errors that are allowed between the two, of 36 means: by chance in one of 4000 runs.
const LIMIT: f64 = 4.5;

fn targets() -> Arc<Targets> {
    let thing = |low: Vec3, size: Vec3| (low, low + size, size.length());
    Arc::new(Targets::new([
        thing(Vec3::new(-0.6, 0.0, -0.3), Vec3::splat(0.5)),
        thing(Vec3::new(-1.0, 4.0, -1.0), Vec3::new(2.0, 0.05, 2.0)),
    ]))
}

#[test]
fn aimed_light_carries_the_same_flux_everywhere() {
    for (k, (name, plain)) in one_of_each().iter().enumerate() {
        let aimed = plain.lights.aimed(Aim::new(targets(), vec![0.6]));
        let aimed = Scene { shapes: plain.shapes.clone(), lights: aimed };
        // All of it, by direction and place, and what passes near the target.
        let measures: [fn(&EmissionSample) -> f32; 4] = [
            |_| 1.0,
            |s| (1.0 + s.direction.x) * (1.5 + s.origin.z),
            |s| s.direction.y.max(0.0),
            |s| {
                let to = Vec3::new(-0.35, 0.25, -0.05) - s.origin;
                if to.cross(s.direction).length() < 0.4 && to.dot(s.direction) > 0.0 { 1.0 } else { 0.0 }
            },
        ];
        let means = |scene: &Scene, seed| {
            let mut random = random(seed);
            let mut sums = [[0.0f64; 2]; 4];
            for _ in 0..N {
                let Some(s) = scene.emission(&mut random) else { continue };
                // Light from infinity that passes by the scene, where a target leans out of it, is nobody's.
                let beside =
                    matches!(s.at, Endpoint::Infinite(_)) && (s.origin - CENTER).cross(s.direction).length() > RADIUS;
                if beside {
                    continue;
                }
                for (sum, measure) in sums.iter_mut().zip(measures) {
                    let x = f64::from(s.beta.y * measure(&s));
                    *sum = [sum[0] + x, sum[1] + x * x];
                }
            }
            sums.map(|[sum, squares]| {
                let mean = sum / N as f64;
                (mean, (squares / N as f64 - mean * mean) / N as f64)
            })
        };
        let (with, without) = (means(&aimed, 2 * k as u64), means(plain, 2 * k as u64 + 1));
        for (i, (a, b)) in with.iter().zip(&without).enumerate() {
            let error = (a.1 + b.1).sqrt();
            assert!((a.0 - b.0).abs() <= LIMIT * error + 1e-5 * b.0, "{name}, {i}: {} against {}", a.0, b.0);
        }
        // What passes the target is what aim is for.
        if without[3].0 > 0.0 {
            assert!(with[3].1 < 0.5 * without[3].1, "{name}: variance {} of {}", with[3].1, without[3].1);
        }
    }
}

/// Where parallel light passes the scene's disk, against the density there; and a ray's density is the same wherever on it
/// one asks.
#[test]
fn parallel_light_is_aimed_at_disks() {
    let scene = &one_of_each()[6].1;
    let lights = scene.lights.aimed(Aim::new(targets(), vec![0.6]));
    let aimed = Scene { shapes: Vec::new(), lights };
    let (mut random, mut others) = (random(90), 0);
    let d = aimed.emission(&mut random).unwrap().direction;
    let x = d.as_dvec3().any_orthonormal_vector();
    let y = d.as_dvec3().cross(x);
    let sample = || {
        let s = aimed.emission(&mut random)?;
        let offset = (s.origin - CENTER).as_dvec3();
        let again = aimed.lights.emission_densities(0, &s.at, d, s.origin + d * 5.0).1;
        others += u32::from(again != s.densities.direction);
        Some([offset.dot(x), offset.dot(y)])
    };
    let r = f64::from(RADIUS);
    let density = |u: f64, v: f64| {
        let through = (CENTER.as_dvec3() + x * u + y * v).as_vec3();
        let inside = aimed.lights.emission_densities(0, &Endpoint::Infinite(-d), d, through).1;
        // Beside the disk only what is aimed passes.
        if u.hypot(v) < r {
            inside
        } else {
            inside - 0.4 * scene.lights.emission_densities(0, &Endpoint::Infinite(-d), d, through).1
        }
    };
    crate::math::chi_square::rectangle(-5.0..5.0, -5.0..5.0, 100_000, [20, 20], sample, density)
        .assert_accepted("aimed parallel light", 1);
    // But on the rims, by rounding.
    assert!(others < 20, "{others}");
}
