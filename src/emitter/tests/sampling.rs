//! Every sampler against its density, by chi-square tests. Together they fail by chance with
//! probability 1 % before the seeds are fixed.

use super::*;
use crate::math::chi_square::{self, Fit};
use std::f64::consts::PI;

/// Tests in this file.
const TESTS: usize = 28;
const N: usize = 100_000;

/// Directions of next-event estimation at `receiver`, against the density of all lights' vertices in
/// each direction.
fn direct(scene: &Scene, receiver: Vec3, seed: u64) -> Fit {
    let mut random = random(seed);
    let lights = &scene.lights;
    let sample = || {
        let s = scene.direct(receiver, &mut random)?;
        s.densities.hittable.then_some(s.wi)
    };
    chi_square::sphere(N, [64, 64], sample, |w| {
        let mut density = lights.escape(receiver, w).map_or(0.0, |(_, d)| d.direct);
        for s in scene.crossings(receiver, w.as_dvec3().normalize()) {
            let light = lights.of_shape(s.shape).unwrap();
            if lights.hit(&scene.shapes, light, &s, -w, receiver).is_some() {
                let d2 = s.p.as_dvec3().distance_squared(receiver.as_dvec3());
                let cos = f64::from(s.ng.dot(w)).abs();
                density += lights.direct_density(&scene.shapes, light, &Endpoint::Surface(s), receiver) * d2 / cos;
            }
        }
        density
    })
}

#[test]
fn light_points_follow_their_density_in_the_solid_angle_of_the_receiver() {
    for (k, (name, scene)) in one_of_each().iter().enumerate() {
        if scene.lights.any_hittable() {
            direct(scene, Vec3::new(0.4, 0.2, 0.3), k as u64).assert_accepted(name, TESTS);
        }
    }
    // From above the tilted mesh, whose one-sided version is dark there; from inside the sphere.
    let scenes = one_of_each();
    direct(&scenes[1].1, Vec3::new(0.0, 3.5, 0.5), 20).assert_accepted("back of a two-sided mesh", TESTS);
    direct(&scenes[3].1, Vec3::new(0.4, 1.5, 0.6), 21).assert_accepted("inside of a two-sided sphere", TESTS);
    direct(&mixture(), Vec3::new(0.4, 0.2, 0.3), 22).assert_accepted("mixture", TESTS);
}

/// Normals of the points drawn on a sphere, against the area density. The part of the sphere that
/// the receiver sees is the domain, so that near receivers, which see little of it, are tested as
/// sharply as far ones.
fn seen_cap(center: Vec3, radius: f32, receiver: Vec3, seed: u64) -> Fit {
    let scene = scene(vec![(ball(center, radius), Rgb::ONE, false)], &[], Rgb::ZERO);
    let mut random = random(seed);
    let toward = receiver.as_dvec3() - center.as_dvec3();
    let axis = toward.normalize();
    let s = axis.any_orthonormal_vector();
    let t = axis.cross(s);
    let cap = 1.0 - f64::from(radius) / toward.length();
    // Near receivers draw most points from a small part of the cap, about as wide as their height: the
    // coordinate x of 1 - cos = cap (s^x - 1)/(s - 1) spreads it.
    let spread = 2.0 * cap / (toward.length() / f64::from(radius) - 1.0).powi(2);
    let log = spread.ln_1p();
    let sample = || match scene.direct(receiver, &mut random)?.at {
        Endpoint::Surface(p) => {
            let n = p.ng.as_dvec3();
            let h = 0.5 * (n - axis).length_squared() / cap;
            Some([(spread * h).ln_1p() / log, n.dot(t).atan2(n.dot(s))])
        }
        _ => None,
    };
    chi_square::rectangle(0.0..1.0, -PI..PI, N, [12, 6], sample, |x, phi| {
        let h = cap * (x * log).exp_m1() / spread;
        let sin = (h * (2.0 - h)).sqrt();
        let n = axis * (1.0 - h) + (s * phi.cos() + t * phi.sin()) * sin;
        let at = SurfacePoint { shape: 0, ..Sphere { center, radius }.at(n) };
        let area = scene.lights.direct_density(&scene.shapes, 0, &Endpoint::Surface(at), receiver);
        area * f64::from(radius).powi(2) * cap * log / spread * (x * log).exp()
    })
}

#[test]
fn sphere_points_follow_their_density_near_and_far() {
    let axis = Vec3::new(0.3, -0.9, 0.5).normalize();
    seen_cap(Vec3::ZERO, 1.0, axis * 1.0001, 30).assert_accepted("1e-4 radii above the surface", TESTS);
    seen_cap(Vec3::ZERO, 1.0, axis * 3.0, 31).assert_accepted("two radii above the surface", TESTS);
    seen_cap(Vec3::ZERO, 1.0, axis * 1e6, 32).assert_accepted("a million radii away", TESTS);
    seen_cap(Vec3::new(1.0, 2.0, 3.0), 1e-6, Vec3::ZERO, 33).assert_accepted("tiny", TESTS);
    seen_cap(Vec3::new(0.0, 2e6, 0.0), 1e6, Vec3::new(1.0, 0.0, 3.0), 34).assert_accepted("huge", TESTS);
}

#[test]
fn emission_starts_uniformly_on_surfaces() {
    let scenes = one_of_each();
    for (name, scene) in &scenes[0..2] {
        let Shape::Mesh(mesh) = &scene.shapes[0] else { panic!() };
        let corner = mesh.positions[0].as_dvec3();
        let (a, b) = (mesh.positions[1].as_dvec3() - corner, mesh.positions[3].as_dvec3() - corner);
        let n = a.cross(b);
        let mut random = random(40);
        let density = scene.lights.emission_densities(0, &Endpoint::Point(Vec3::ZERO), Vec3::X, CENTER).0;
        let sample = || {
            let q = scene.emission(&mut random)?.origin.as_dvec3() - corner;
            Some([q.cross(b).dot(n) / n.length_squared(), a.cross(q).dot(n) / n.length_squared()])
        };
        chi_square::rectangle(0.0..1.0, 0.0..1.0, N, [16, 16], sample, |_, _| density * n.length())
            .assert_accepted(name, TESTS);
    }
    let (name, scene) = &scenes[2];
    let mut random = random(41);
    let density = scene.lights.emission_densities(0, &Endpoint::Point(Vec3::ZERO), Vec3::X, CENTER).0;
    let sample = || match scene.emission(&mut random)?.at {
        Endpoint::Surface(s) => Some(s.ng),
        _ => None,
    };
    chi_square::sphere(N, [16, 16], sample, |_| density * 0.49).assert_accepted(name, TESTS);
}

#[test]
fn emission_leaves_with_its_direction_density() {
    for (k, (name, scene)) in one_of_each().iter().enumerate() {
        let parallel = matches!(scene.lights.lights[0], Light::Directional(_));
        if parallel {
            continue;
        }
        let environment = matches!(scene.lights.lights[0], Light::Environment(_));
        // Sphere: directions in the frame of the normal, which takes every direction.
        let ball = matches!(scene.lights.lights[0], Light::Sphere(_));
        let mut random = random(50 + k as u64);
        let north = |s: &SurfacePoint| SurfacePoint { ng: if ball { Vec3::Z } else { s.ng }, ..*s };
        let at = match scene.emission(&mut random).unwrap().at {
            Endpoint::Surface(s) => Endpoint::Surface(north(&s)),
            other => other,
        };
        let sample = || {
            let s = scene.emission(&mut random)?;
            Some(match s.at {
                Endpoint::Surface(p) if ball => crate::math::Frame::around(p.ng).to_local(s.direction),
                _ => s.direction,
            })
        };
        let density = |w: Vec3| {
            if environment {
                return scene.lights.emission_densities(0, &Endpoint::Infinite(-w), w, CENTER).0;
            }
            scene.lights.emission_densities(0, &at, w, CENTER).1
        };
        chi_square::sphere(N, [20, 20], sample, density).assert_accepted(name, TESTS);
    }
}

#[test]
fn light_from_infinity_starts_uniformly_on_a_disk_before_the_scene() {
    for (k, (name, scene)) in one_of_each()[6..].iter().enumerate() {
        let mut random = random(60 + k as u64);
        let r = f64::from(RADIUS);
        let sample = || {
            let s = scene.emission(&mut random)?;
            let (d, offset) = (s.direction.as_dvec3(), (s.origin - CENTER).as_dvec3());
            assert!(offset.dot(d) < -r, "starts within the scene");
            let x = d.any_orthonormal_vector();
            Some([offset.dot(x), offset.dot(d.cross(x))])
        };
        let density = scene.lights.emission_densities(0, &Endpoint::Infinite(Vec3::Y), Vec3::NEG_Y, CENTER).1;
        chi_square::rectangle(-r..r, -r..r, N, [12, 12], sample, |x, y| if x.hypot(y) < r { density } else { 0.0 })
            .assert_accepted(name, TESTS);
    }
}
