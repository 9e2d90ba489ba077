//! Depth of field: what a thin lens makes of a small patch, for each integrator.
//!
//! A Lambertian square of side `a` at depth `z` under parallel light has the same radiance from all points of the lens.
//! A pixel is that radiance times the share of the lens from which its ray meets the square. So over the film, in units of
//! the film at unit distance, the picture's integral is radiance times (a / z)², and its second moment about its middle,
//! over that, is `c² / 2` of the circle of confusion, `c = r |1 / focus - 1 / z|`, and `(a / z)² / 6` of the square.

mod common;

use caustica::math::{Rgb, luminance};
use caustica::render::{Integrator, Settings};
use caustica::scene::description::*;
use common::stats::mean_and_error;
use common::{Builder, run, settings};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use std::f64::consts::PI;

const SIDE: u32 = 32;
const RUNS: u64 = 12;

#[test]
fn a_small_patch_becomes_a_disc() {
    let (yfov, albedo, irradiance, size, depth) = (0.1f64, 0.6f64, 3.0f64, 0.02f64, 2.0f64);
    let lens = Lens { radius: 0.1, focus: 5.0 };
    let shift = DVec2::new(0.1, -0.15);
    let mut b = Builder::default();
    let white = b.diffuse(albedo as f32);
    let half = 0.5 * size as f32;
    b.quad(Vec3::new(-half, -half, -depth as f32), Vec3::X * size as f32, Vec3::Y * size as f32, white);
    b.light(LightKind::Directional {
        direction: DVec3::new(0.3, 0.1, -1.0),
        irradiance: Rgb::splat(irradiance as f32),
    });
    let plain = Camera::new("", DAffine3::IDENTITY, Projection::Perspective { yfov });
    b.0.cameras.push(Camera { lens: Some(lens), shift, ..plain });
    let world = b.commit();

    let radiance = albedo / PI * irradiance / DVec3::new(0.3, 0.1, 1.0).length();
    let seen = size / depth;
    let pixel = 2.0 * (0.5 * yfov).tan() / f64::from(SIDE);
    let confusion = lens.radius * (1.0 / lens.focus - 1.0 / depth).abs();
    // Positions are those of pixels' middles, which adds a pixel's own second moment (Sheppard 1898), but for what the edges
    // do: 1e-3 is left for that.
    let known = [radiance * seen * seen, confusion * confusion / 2.0 + seen * seen / 6.0 + pixel * pixel / 6.0];
    for integrator in [Integrator::Path, Integrator::Light, Integrator::Mnee, Integrator::Bdpt] {
        let measured: Vec<[f64; 2]> = (0..RUNS)
            .map(|seed| {
                let settings = Settings { max_depth: 4, ..settings(integrator, SIDE, 256, seed) };
                let image = run(&world, &settings).image;
                // The middle of the view is moved to the left and down in the picture.
                let middle = f64::from(SIDE) * (DVec2::splat(0.5) + DVec2::new(-shift.x, shift.y));
                let (mut integral, mut second) = (0.0, 0.0);
                for (i, p) in image.pixels.iter().enumerate() {
                    let at = DVec2::new(f64::from(i as u32 % SIDE), f64::from(i as u32 / SIDE)) + 0.5 - middle;
                    let value = f64::from(luminance(*p)) * pixel * pixel;
                    integral += value;
                    second += value * (at * pixel).length_squared();
                }
                [integral, second / integral]
            })
            .collect();
        for (i, name) in ["integral", "second moment"].into_iter().enumerate() {
            let (mean, error) = mean_and_error(&measured.iter().map(|m| m[i]).collect::<Vec<_>>());
            // 6.0 is Student's quantile for 11 degrees at 1e-4 over 8 comparisons and 2 sides.
            assert!(
                (mean - known[i]).abs() < 6.0 * error + 1e-3 * known[i],
                "{integrator:?}: {name} {mean} +- {error}, not {}",
                known[i]
            );
            assert!(error < 0.005 * known[i], "{integrator:?}: {name} is known to {error} of {} only", known[i]);
        }
    }
}

/// Half of the lens is in a ball of dark gas, under a sky of radiance 1: absorption along what of each ray is in the ball,
/// averaged over lens and film.
#[test]
fn a_lens_that_is_in_two_media() {
    let (absorption, radius, tan) = (2.0f64, 0.5f64, 0.3f64);
    let lens = Lens { radius: 0.4, focus: 2.0 };
    let center = DVec3::new(0.5, 0.0, 0.0);
    let mut b = Builder::default();
    b.0.environment = Rgb::ONE.into();
    let gas = b.absorbing(1.0, Rgb::splat(absorption as f32));
    b.sphere(center, radius, gas);
    let plain = Camera::new("", DAffine3::IDENTITY, Projection::Perspective { yfov: 2.0 * tan.atan() });
    b.0.cameras.push(Camera { lens: Some(lens), ..plain });
    let world = b.commit();

    // Midpoints: of squared radius and angle on the lens, of both coordinates on the film.
    const N: u32 = 40;
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
    let mut known = 0.0;
    for k in 0..N.pow(4) {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| middle(k / N.pow(i) % N));
        let from = (DVec2::from_angle(2.0 * PI * a) * lens.radius * b.sqrt()).extend(0.0);
        let at = (DVec2::new(2.0 * c - 1.0, 2.0 * d - 1.0) * tan * lens.focus).extend(-lens.focus);
        let along = (at - from).normalize();
        let to = center - from;
        let half = (radius * radius - to.length_squared() + to.dot(along).powi(2)).max(0.0).sqrt();
        let within = (to.dot(along) + half).max(0.0) - (to.dot(along) - half).max(0.0);
        known += (-absorption * within).exp() / f64::from(N.pow(4));
    }
    for integrator in [Integrator::Path, Integrator::Mnee, Integrator::Bdpt] {
        let mean = |seed| {
            let image = run(&world, &settings(integrator, 8, 256, seed)).image;
            image.pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>() / 64.0
        };
        let (mean, error) = mean_and_error(&(0..RUNS).map(mean).collect::<Vec<_>>());
        // 5.5 is Student's quantile for 11 degrees at 2e-4 over 3 comparisons and 2 sides; 1e-3: midpoints.
        assert!((mean - known).abs() < 5.5 * error + 1e-3 * known, "{integrator:?}: {mean} +- {error}, not {known}");
        assert!(error < 2e-3 * known, "{integrator:?}: known to {error}");
    }
}
