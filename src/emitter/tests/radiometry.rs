//! Irradiance and flux against closed forms, and the two ways to sample a light against each other.
//! Seeds are fixed; each comparison allows 4 standard errors (chance 6e-5) and, for rounding, 1e-5.

use super::*;
use std::f64::consts::PI;

#[track_caller]
fn assert_near(name: &str, (mean, error): (f64, f64), truth: f64) {
    let allowed = 4.0 * error + 1e-5 * truth;
    assert!((mean - truth).abs() <= allowed, "{name}: {mean} +- {error}, expected {truth}");
    assert!(error < 0.02 * truth, "{name}: too noisy to tell, {mean} +- {error}");
}

/// Irradiance, red, by next-event estimation on a surface with normal `n`.
fn irradiance(scene: &Scene, receiver: Vec3, n: Vec3, samples: usize, seed: u64) -> (f64, f64) {
    let mut random = random(seed);
    mean(samples, || {
        scene.direct(receiver, &mut random).map_or(0.0, |s| f64::from(s.incident.x * s.wi.dot(n).max(0.0)))
    })
}

/// Form factor from a small surface to a parallel rectangle of half-sides `x` and `z` that is centred
/// `height` above it (Howell, "A catalog of radiation heat transfer configuration factors", B-3).
fn parallel_rectangle(x: f64, z: f64, height: f64) -> f64 {
    let (x, z) = (x / height, z / height);
    let (rx, rz) = ((1.0 + x * x).sqrt(), (1.0 + z * z).sqrt());
    4.0 * (x / rx * (z / rx).atan() + z / rz * (x / rz).atan()) / (2.0 * PI)
}

#[test]
fn irradiance_below_a_rectangle() {
    for (k, height) in [0.05, 0.5, 2.0, 50.0].into_iter().enumerate() {
        let light = ceiling(Vec3::new(0.0, height, 0.0), 0.6, 0.4);
        let scene = scene(vec![(light, Rgb::splat(2.5), false)], &[], Rgb::ZERO);
        let truth = PI * 2.5 * parallel_rectangle(0.6, 0.4, f64::from(height));
        let seen = irradiance(&scene, Vec3::ZERO, Vec3::Y, 400_000, k as u64);
        assert_near(&format!("height {height}"), seen, truth);
        let above = Vec3::new(0.0, height + 1.0, 0.0);
        assert_eq!(irradiance(&scene, above, Vec3::NEG_Y, 1000, 9).0, 0.0, "the back is dark");
    }
}

#[test]
fn irradiance_from_a_sphere_above_the_horizon() {
    // pi L sin² of the half-angle, times the cosine of the receiver.
    let tilt = Vec3::new(0.6, 0.8, 0.0);
    for (k, (radius, distance, n)) in [
        (1.0, 1.0001, Vec3::Y),
        (1.0, 1.01, Vec3::Y),
        (1.0, 4.0, tilt),
        (1.0, 1e6, tilt),
        (1e-6, 1.0, tilt),
        (1e6, 1e6 + 100.0, Vec3::Y),
    ]
    .into_iter()
    .enumerate()
    {
        let scene = scene(vec![(ball(Vec3::ZERO, radius), Rgb::splat(0.7), false)], &[], Rgb::ZERO);
        let receiver = Vec3::new(0.0, -distance, 0.0);
        let sin = f64::from(radius) / f64::from(distance);
        let truth = PI * 0.7 * sin * sin * f64::from(n.y);
        let seen = irradiance(&scene, receiver, n, 100_000, 20 + k as u64);
        assert_near(&format!("radius {radius}, distance {distance}"), seen, truth);
    }
}

#[test]
fn irradiance_within_a_sphere_is_pi_times_the_radiance() {
    let scene = scene(vec![(ball(Vec3::ZERO, 2.0), Rgb::splat(0.5), true)], &[], Rgb::ZERO);
    let seen = irradiance(&scene, Vec3::new(0.3, 0.9, -0.4), Vec3::X, 400_000, 30);
    assert_near("inside", seen, PI * 0.5);
}

#[test]
fn irradiance_of_several_lights_is_the_sum() {
    let intensity = Rgb::splat(3.0);
    let kinds = [
        LightKind::Point { position: DVec3::new(0.0, 2.0, 1.0), intensity },
        LightKind::Directional { direction: DVec3::new(0.0, -2.0, 0.0), irradiance: Rgb::splat(0.05) },
        LightKind::Spot {
            position: DVec3::new(0.0, 3.0, 0.0),
            direction: DVec3::new(0.0, -1.0, 0.0),
            intensity,
            inner: 0.5,
            outer: 0.6,
        },
    ];
    let light = (ceiling(Vec3::new(0.0, 2.0, 0.0), 0.6, 0.4), Rgb::splat(2.5), false);
    let scene = scene(vec![light], &kinds, Rgb::splat(0.1));
    let truth = PI * 2.5 * parallel_rectangle(0.6, 0.4, 2.0) + 3.0 * 2.0 / 5f64.powf(1.5) + 0.05 + 3.0 / 9.0 + PI * 0.1;
    assert_near("sum", irradiance(&scene, Vec3::ZERO, Vec3::Y, 1_000_000, 31), truth);
}

/// What each light of [`one_of_each`] emits, W, red.
fn powers() -> [f64; 9] {
    let area = Vec3::new(2.0, 0.3, 0.0).as_dvec3().cross(Vec3::new(0.2, 0.4, 1.5).as_dvec3()).length();
    let sphere = 4.0 * PI * 0.49;
    let disk = PI * f64::from(RADIUS).powi(2);
    // The falloff of the extension's text, summed over the cone in rings.
    let rings = 200_000;
    let falloff = (0..rings).map(|k| {
        let angle = 0.9 * (f64::from(k) + 0.5) / f64::from(rings);
        let f = ((angle.cos() - 0.9f64.cos()) / (0.4f64.cos() - 0.9f64.cos())).clamp(0.0, 1.0);
        f * f * 2.0 * PI * angle.sin() * 0.9 / f64::from(rings)
    });
    let spot = falloff.sum::<f64>();
    let sky = crate::math::chi_square::integrate_sphere(|d| environment::sky().radiance(d).x.into());
    [PI * area, 2.0 * PI * area, PI * sphere, 2.0 * PI * sphere, 4.0 * PI, spot, disk, 4.0 * PI * disk, sky * disk]
        .map(|f| 3.0 * f)
}

#[test]
fn emission_carries_the_power_of_the_light() {
    for (k, ((name, scene), truth)) in one_of_each().into_iter().zip(powers()).enumerate() {
        assert!((scene.lights.lights[0].power().x - truth).abs() < 1e-5 * truth, "{name}");
        let mut random = random(40 + k as u64);
        let flux = mean(100_000, || scene.emission(&mut random).map_or(0.0, |s| f64::from(s.beta.x)));
        assert_near(name, flux, truth);
    }
    let scene = mixture();
    let truth: f64 = scene.lights.lights.iter().map(|l| l.power().x).sum();
    let mut random = random(50);
    let flux = mean(1_000_000, || scene.emission(&mut random).map_or(0.0, |s| f64::from(s.beta.x)));
    assert_near("mixture", flux, truth);
}

#[test]
fn emission_and_next_event_estimation_light_a_patch_alike() {
    // A square on the floor, seen from above.
    let (corner, side) = (Vec3::new(-0.7, -1.5, -0.4), 2.0f32);
    let mut scenes = one_of_each();
    scenes.push(("mixture", mixture()));
    for (k, (name, scene)) in scenes.iter().enumerate() {
        let mut random = random(60 + k as u64);
        let emitted = mean(1_000_000, || {
            let Some(s) = scene.emission(&mut random) else { return 0.0 };
            let stopped = match s.at {
                // By the sphere's other side.
                Endpoint::Surface(at) => {
                    matches!(scene.shapes[at.shape as usize], Shape::Sphere(_)) && at.ng.dot(s.direction) < 0.0
                }
                Endpoint::Point(_) | Endpoint::Infinite(_) => false,
            };
            let t = (corner.y - s.origin.y) / s.direction.y;
            let q = (s.origin + s.direction * t - corner) / side;
            let meets =
                !stopped && s.direction.y < 0.0 && t > 0.0 && (0.0..1.0).contains(&q.x) && (0.0..1.0).contains(&q.z);
            if meets { f64::from(s.beta.x / (side * side)) } else { 0.0 }
        });
        let received = mean(300_000, || {
            let u = random.next_2d() * side;
            let receiver = corner + Vec3::new(u.x, 0.0, u.y);
            scene.direct(receiver, &mut random).map_or(0.0, |s| f64::from(s.incident.x * s.wi.y.max(0.0)))
        });
        let error = emitted.1.hypot(received.1);
        assert!((emitted.0 - received.0).abs() < 4.0 * error, "{name}: {emitted:?} by emission, {received:?} directly");
        assert!(error < 0.03 * received.0, "{name}: too noisy to tell, {emitted:?}, {received:?}");
    }
}
