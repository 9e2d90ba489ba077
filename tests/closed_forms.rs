//! Images that a formula gives: one light of each kind over a Lambertian floor, and what absorption
//! and Fresnel's equations make of a lamp behind a slab. Units and conventions of each light and
//! medium, which integrators have in common, are held here.
//!
//! The camera looks straight down in parallel projection. Each pixel must agree with the formula's
//! mean over it within 4 standard errors (Student's t, widened for the number of pixels) and
//! numerical noise of 1e-4; the upper 95 % confidence bound of the bias lies below 0.2 %.

mod common;

use caustica::math::{Rgb, luminance};
use caustica::render::{Integrator, Settings};
use caustica::scene::description::*;
use common::oracle::{BIAS_LIMIT, check_bias, first_seed, renders};
use common::stats::{blocks, mean_and_error};
use common::{Builder, settings};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

const RUNS: u64 = 16;
const SIDE: u32 = 8;
/// Half the width of the film, metres.
const YMAG: f64 = 1.0;
const ALBEDO: f64 = 0.6;

/// A floor at y = 0 under a camera at height 8: twice as wide as the film, so that light paths from
/// infinity often meet it. The rest is the caller's.
fn over_floor(parts: impl Fn(&mut Builder)) -> Builder {
    let mut b = Builder::default();
    let floor = b.diffuse(ALBEDO as f32);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    parts(&mut b);
    let rotation = glam::DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
    let transform = glam::DAffine3::from_mat3_translation(rotation, DVec3::Y * 8.0);
    let projection = Projection::Orthographic { ymag: YMAG };
    b.0.cameras.push(Camera::new("down", transform, projection));
    b
}

/// Mean of a function of the floor point over a pixel, by 16 x 16 midpoints.
fn over_pixel(pixel: u32, f: &dyn Fn(DVec3) -> f64) -> f64 {
    const N: u32 = 16;
    let coordinate =
        |i: u32, j: u32| ((f64::from(i) + (f64::from(j) + 0.5) / f64::from(N)) / f64::from(SIDE) * 2.0 - 1.0) * YMAG;
    let (x, y) = (pixel % SIDE, pixel / SIDE);
    let points = (0..N * N).map(|k| DVec3::new(coordinate(x, k % N), 0.0, coordinate(y, k / N)));
    points.map(f).sum::<f64>() / f64::from(N * N)
}

/// Both integrators against the luminance that `formula` gives at a floor point.
fn check(name: &str, builder: &Builder, max_depth: u32, samples: u32, formula: &dyn Fn(DVec3) -> f64) {
    let world = builder.commit();
    let mut wrong = Vec::new();
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        let name = format!("{name}, {integrator:?}");
        let seed = first_seed(&name);
        let settings = Settings { max_depth, ..settings(integrator, SIDE, samples, 0) };
        let images = renders(&world, &settings, seed..seed + RUNS);
        let pixels = blocks(&images, 1);
        let known: Vec<f64> = (0..SIDE * SIDE).map(|pixel| over_pixel(pixel, formula)).collect();
        for (i, &known) in known.iter().enumerate() {
            let (mean, error) = (pixels.mean[i], pixels.error[i]);
            // 6.5 is Student's quantile for 15 degrees at 1e-3 over 64 pixels and 2 sides.
            if (mean - known).abs() > 6.5 * error + 1e-4 * known {
                wrong.push(format!("{name}: pixel {i} is {mean} +- {error}, expected {known}"));
            }
        }
        let level = known.iter().sum::<f64>() / known.len() as f64;
        let means = images.iter().map(|image| image.pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>());
        let (mean, error) = mean_and_error(&means.map(|sum| sum / f64::from(SIDE * SIDE)).collect::<Vec<_>>());
        wrong.extend(check_bias(&name, (mean - level) / level, error / level, RUNS as f64 - 1.0, BIAS_LIMIT).err());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Irradiance at `p` from intensity `i` at `from`.
fn point_irradiance(from: DVec3, i: f64, p: DVec3) -> f64 {
    let d = from - p;
    i * d.y / d.length().powi(3)
}

const LAMP: DVec3 = DVec3::new(0.3, 1.5, -0.2);

#[test]
fn point_light() {
    let b = over_floor(|b| b.light(LightKind::Point { position: LAMP, intensity: Rgb::splat(2.0) }));
    check("point", &b, 4, 512, &|p| ALBEDO / PI * point_irradiance(LAMP, 2.0, p));
}

/// KHR_lights_punctual: angular attenuation is the square of a linear ramp in the cosine.
#[test]
fn spot_light() {
    let (inner, outer) = (0.3f64, 0.7f64);
    let axis = DVec3::new(-0.2, -1.0, 0.1).normalize();
    let spot = LightKind::Spot { position: LAMP, direction: axis, intensity: Rgb::splat(2.0), inner, outer };
    let b = over_floor(|b| b.light(spot));
    check("spot", &b, 4, 512, &|p| {
        let cos = (p - LAMP).normalize().dot(axis);
        let ramp = ((cos - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
        ALBEDO / PI * point_irradiance(LAMP, 2.0, p) * ramp * ramp
    });
}

#[test]
fn directional_light() {
    let direction = DVec3::new(0.4, -1.0, 0.3);
    let b = over_floor(|b| b.light(LightKind::Directional { direction, irradiance: Rgb::splat(3.0) }));
    let cos = -direction.normalize().y;
    check("directional", &b, 4, 512, &|_| ALBEDO / PI * 3.0 * cos);
}

#[test]
fn environment() {
    let b = over_floor(|b| b.0.environment = Rgb::splat(0.7).into());
    check("environment", &b, 4, 256, &|_| ALBEDO * 0.7);
}

/// An image of two pixels: `a` down to a quarter of the way from the pole, then linear in the height of the direction, the
/// square of which is 1/2 there. Upright, and upside down.
#[test]
fn image_environment() {
    for (name, turn, a, b) in [("image", 0.0, 2.0, 0.25), ("image upside down", PI, 0.25, 2.0)] {
        let image = EnvironmentMap::new(1, 2, [2.0, 0.25].map(Rgb::splat).to_vec()).expect("an image");
        let rotation = glam::DMat3::from_rotation_x(turn);
        let sky = Environment { radiance: Rgb::splat(0.7), image: Some(std::sync::Arc::new(image)), rotation };
        let scene = over_floor(|builder| builder.0.environment = sky.clone());
        check(name, &scene, 4, 256, &|_| ALBEDO * 0.7 * 2.0 * ((a + b) / 8.0 + (a - b) / 12.0 + a / 4.0));
    }
}

/// A sphere above the horizon gives pi L sin²(half-angle) cos(angle of its centre).
#[test]
fn sphere_light() {
    let radius = 0.5;
    let b = over_floor(|b| {
        let lamp = b.lamp(4.0);
        b.sphere(DVec3::new(2.0, 1.5, 0.0), radius, lamp);
    });
    check("sphere", &b, 4, 512, &|p| {
        let d = DVec3::new(2.0, 1.5, 0.0) - p;
        ALBEDO * 4.0 * radius * radius * d.y / d.length().powi(3)
    });
}

/// Lambert's formula for a polygon: E = L/2 sum of (edge angle) (edge plane's normal . n).
fn polygon_irradiance(corners: &[DVec3], radiance: f64, p: DVec3) -> f64 {
    let unit: Vec<DVec3> = corners.iter().map(|c| (*c - p).normalize()).collect();
    let edges = unit.iter().zip(unit.iter().cycle().skip(1));
    let sum: f64 = edges.map(|(a, b)| a.angle_between(*b) * a.cross(*b).normalize().y).sum();
    0.5 * radiance * sum.abs()
}

/// Two lamps and a point light, so that the choice among lights counts.
#[test]
fn unequal_lights_together() {
    let corners = |corner: DVec3, e1: DVec3, e2: DVec3| [corner, corner + e1, corner + e1 + e2, corner + e2];
    let lamps = [
        (DVec3::new(1.5, 1.5, -0.5), DVec3::new(1.0, -0.5, 0.0), DVec3::new(0.0, 0.0, 1.5), 2.0),
        (DVec3::new(-2.0, 1.5, -0.5), DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.0, 0.25), 9.0),
    ];
    let b = over_floor(|b| {
        for (corner, e1, e2, radiance) in lamps {
            let lamp = b.lamp(radiance as f32);
            b.quad(corner.as_vec3(), e1.as_vec3(), e2.as_vec3(), lamp);
        }
        b.light(LightKind::Point { position: LAMP, intensity: Rgb::splat(0.5) });
    });
    // Lamps are black and see all of the film.
    check("unequal lights", &b, 4, 2048, &|p| {
        let polygons = lamps.iter().map(|&(c, e1, e2, radiance)| polygon_irradiance(&corners(c, e1, e2), radiance, p));
        ALBEDO / PI * (polygons.sum::<f64>() + point_irradiance(LAMP, 0.5, p))
    });
}

/// Camera, floor and light in one absorbing medium.
#[test]
fn absorption_on_both_segments() {
    let sigma = 0.25;
    let b = over_floor(|b| {
        let murky = b.material(Scattering::Dielectric {
            inside: Medium::new(1.33, Rgb::splat(sigma as f32)),
            outside: Medium::VACUUM,
            roughness: 0.0,
            tint: Rgb::ONE,
        });
        b.sphere(DVec3::ZERO, 1000.0, murky);
        b.light(LightKind::Point { position: LAMP, intensity: Rgb::splat(2.0) });
    });
    check("absorption", &b, 4, 512, &|p| {
        let length = 8.0 + (LAMP - p).length();
        ALBEDO / PI * point_irradiance(LAMP, 2.0, p) * (-sigma * length).exp()
    });
}

/// A lamp seen straight through an absorbing slab: T² A / (1 - R² A²) of its radiance, with Fresnel's
/// R at normal incidence, T = 1 - R, A the transmittance of one crossing.
#[test]
fn slab_before_a_lamp() {
    let (n, sigma, thickness, radiance) = (1.5f64, 0.8f64, 0.75f64, 3.0);
    let b = over_floor(|b| {
        let lamp = b.lamp(radiance as f32);
        b.quad(Vec3::new(-4.0, 0.5, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, lamp);
        let glass = b.material(Scattering::Dielectric {
            inside: Medium::new(n as f32, Rgb::splat(sigma as f32)),
            outside: Medium::VACUUM,
            roughness: 0.0,
            tint: Rgb::ONE,
        });
        b.cuboid(Vec3::new(-4.0, 1.0, -4.0), Vec3::new(4.0, 1.0 + thickness as f32, 4.0), false, glass);
    });
    let r = ((n - 1.0) / (n + 1.0)).powi(2);
    let a = (-sigma * thickness).exp();
    let value = radiance * (1.0 - r).powi(2) * a / (1.0 - (r * a).powi(2));
    check("slab", &b, 16, 512, &|_| value);
}
