//! Light of a disk through a glass ball on a spot beneath: the irradiance by two refractions, from a
//! quadrature that knows nothing of walks, Jacobians or light sampling.
//!
//! Each comparison: within its errors (false alarm 1e-3 for the six setups together), and a bias whose upper confidence
//! bound lies below a limit; of all six setups together, below [`LIMIT`].
// The second backend is held against the first ray by ray, in `backends.rs`.
#![cfg(feature = "embree")]

mod common;

use caustica::render::{Caustics, Integrator, Settings};
use caustica::scene::World;
use caustica::scene::description::*;
use caustica::transport::options::CausticOptions;
use caustica::transport::roulette::Roulette;
use common::oracle::{check_bias, first_seed, renders};
use common::stats::{block_means, largest_z, mean_and_error};
use common::{Builder, settings};
use glam::{DAffine3, DVec3, Vec3};
use std::f64::consts::PI;

const IOR: f64 = 1.5;
const ALBEDO: f64 = 0.5;
const RUNS: u64 = 32;
const SIDE: u32 = 8;
const LIMIT: f64 = 0.005;

/// Half the side of the square that the camera sees across, and the sine of its elevation: it sees
/// a rectangle of 0.001 by 0.0017 of a spot of 0.004 by 0.004.
const HALF_VIEW: f64 = 5e-4;
const ELEVATION: f64 = 0.6;

/// A ball of radius 1 around the origin, a receiver at (x, 0, -depth) that faces up (+z) and a disk of
/// radiance 1 in the plane z = `height` that faces down.
struct Setup {
    depth: f64,
    height: f64,
    radius: f64,
    x: f64,
    /// Irradiance by two refractions, from another program.
    irradiance: f64,
}

const fn setup(depth: f64, height: f64, radius: f64, x: f64, irradiance: f64) -> Setup {
    Setup { depth, height, radius, x, irradiance }
}

const SETUPS: [Setup; 6] = [
    setup(1.6, 5.0, 1.5, 0.0, 0.96210),
    setup(1.6, 5.0, 1.5, 0.5, 0.26116),
    setup(1.6, 5.0, 1.5, 1.0, 0.008500),
    setup(1.05, 4.0, 1.0, 0.1, 1.01372),
    setup(1.05, 4.0, 1.0, 0.4, 0.4742),
    setup(3.0, 5.0, 0.5, 0.6, 0.015172),
];

impl Setup {
    fn receiver(&self) -> DVec3 {
        DVec3::new(self.x, 0.0, -self.depth)
    }

    fn name(&self) -> String {
        format!("({}, {}, {}, {})", self.depth, self.height, self.radius, self.x)
    }

    /// Irradiance by two refractions: over the directions toward the ball, around the line through its
    /// centre, since all rays at one angle to that line are bent by the same angle. A lattice of points.
    fn quadrature(&self) -> f64 {
        let p = self.receiver();
        let distance = p.length();
        let axis = -p / distance;
        let across = axis.any_orthonormal_vector();
        let other = axis.cross(across);
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let points = 4_000_000;
        let arrives = |i: u32| {
            // The sine of incidence, and from it the angle at the receiver.
            let s = (f64::from(i) + 0.5) / f64::from(points);
            let (incident, refracted) = (s.asin(), (s / IOR).asin());
            let angle = (s / distance).asin();
            // In the plane of ray and axis. The chord turns the place around the centre, and both refractions
            // turn the ray toward the axis.
            let exit = incident - angle + PI - 2.0 * refracted;
            let direction = angle - 2.0 * (incident - refracted);
            let turn = 2.0 * PI * (f64::from(i) * golden).fract();
            let side = across * turn.cos() + other * turn.sin();
            let cos = (axis * angle.cos() + side * angle.sin()).z;
            let from = side * exit.sin() - axis * exit.cos();
            let toward = axis * direction.cos() + side * direction.sin();
            let t = (self.height - from.z) / toward.z;
            let hit = from + toward * t;
            if cos <= 0.0 || toward.z <= 0.0 || t <= 0.0 || hit.truncate().length_squared() > self.radius.powi(2) {
                return 0.0;
            }
            let (i, t) = (incident.cos(), refracted.cos());
            let across = ((i - IOR * t) / (i + IOR * t)).powi(2);
            let along = ((t - IOR * i) / (t + IOR * i)).powi(2);
            let transmittance = (1.0 - (across + along) / 2.0).powi(2);
            // Solid angle per s, over the turn.
            cos * transmittance * s / (distance.powi(2) * angle.cos())
        };
        (0..points).map(arrives).sum::<f64>() * 2.0 * PI / f64::from(points)
    }

    /// Whether the receiver may see the disk reflected by the ball. The plane of a reflection has the ball on
    /// one side and both ends on the other, so the straight line between them misses the ball.
    fn may_reflect(&self) -> bool {
        let p = self.receiver();
        (0..64).any(|k| {
            let turn = f64::from(k) * PI / 32.0;
            let y = DVec3::new(self.radius * turn.cos(), self.radius * turn.sin(), self.height);
            p.cross(y - p).length() > (y - p).length()
        })
    }

    fn world(&self) -> World {
        let mut b = Builder::default();
        let glass = b.glass(IOR as f32, 0.0);
        b.sphere(DVec3::ZERO, 1.0, glass);
        let spot = b.diffuse(ALBEDO as f32);
        let p = self.receiver();
        b.quad(p.as_vec3() - Vec3::new(2e-3, 2e-3, 0.0), Vec3::X * 4e-3, Vec3::Y * 4e-3, spot);
        let lamp = b.lamp(1.0);
        b.mesh(disk(self.radius), lamp, DAffine3::from_translation(DVec3::Z * self.height));
        // From so near that the ball is never in the way.
        let away = DVec3::new(0.0, -(1.0f64 - ELEVATION * ELEVATION).sqrt(), ELEVATION);
        b.camera(p + away * 0.02, p, Projection::Orthographic { ymag: HALF_VIEW });
        b.commit()
    }
}

/// A polygon of the area of a disk, which faces down. Its edge is off the circle by at most 5e-5 of the
/// radius, to either side by turns.
fn disk(radius: f64) -> MeshDescription {
    let corners = 256;
    let step = 2.0 * PI / f64::from(corners);
    let radius = radius * (step / step.sin()).sqrt();
    let corner =
        |k: u32| [(radius * (step * f64::from(k)).cos()) as f32, (radius * (step * f64::from(k)).sin()) as f32, 0.0];
    MeshDescription {
        name: "disk".to_owned(),
        positions: std::iter::once([0.0; 3]).chain((0..corners).map(corner)).collect(),
        triangles: (0..corners).map(|k| [0, 1 + (k + 1) % corners, 1 + k]).collect(),
        ..Default::default()
    }
}

/// Irradiance by two refractions, run by run: caustic paths of up to four segments, less those of up
/// to three, which are reflected off the ball.
fn irradiances(setup: &Setup, integrator: Integrator, samples: u32, seed: u64) -> Vec<f64> {
    let world = setup.world();
    let up_to = |max_depth| {
        let settings = settings(integrator, SIDE, samples, 0);
        // Roulette on connections would only add noise, ten times what is there without it.
        let caustic_options = CausticOptions { roulette: Roulette::Off, ..CausticOptions::default() };
        let settings = Settings { max_depth, caustics: Caustics::On, caustics_only: true, caustic_options, ..settings };
        let images = renders(&world, &settings, seed..seed + RUNS);
        images.iter().map(|image| block_means(image, SIDE)[0] * PI / ALBEDO).collect::<Vec<f64>>()
    };
    let all = up_to(4);
    if !setup.may_reflect() {
        return all;
    }
    all.iter().zip(up_to(3)).map(|(all, reflected)| all - reflected).collect()
}

/// Each setup, and all of them together: what is wrong with one unit or factor is wrong everywhere.
/// `limits` of the bias.
fn agrees(integrator: Integrator, samples: u32, limits: [f64; 6]) {
    let degrees = (RUNS - 1) as f64;
    let mut failures = Vec::new();
    let (mut sum, mut weights) = (0.0, 0.0);
    for (setup, limit) in SETUPS.iter().zip(limits) {
        let name = format!("{integrator:?} {}", setup.name());
        let truth = setup.quadrature();
        let (mean, error) = mean_and_error(&irradiances(setup, integrator, samples, first_seed(&name)));
        let (bias, error) = (mean / truth - 1.0, error / truth);
        let z = bias / error;
        eprintln!("{name}: {mean:.6}, quadrature {truth:.6}, z {z:+.2}");
        failures.extend(check_bias(&name, bias, error, degrees, limit).err());
        if z.abs() > largest_z(SETUPS.len(), degrees) {
            failures.push(format!("{name}: z {z}"));
        }
        sum += bias / (error * error);
        weights += 1.0 / (error * error);
    }
    let name = format!("{integrator:?}, all");
    failures.extend(check_bias(&name, sum / weights, weights.sqrt().recip(), degrees, LIMIT).err());
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn two_programs_integrate_alike() {
    for setup in &SETUPS {
        let value = setup.quadrature();
        eprintln!("{}: {value:.7}, listed {}", setup.name(), setup.irradiance);
        assert!((value / setup.irradiance - 1.0).abs() < 2e-4, "{}: {value}", setup.name());
    }
}

#[test]
fn path_tracing() {
    // Few paths meet the disk by chance from where little of it is seen: the third and the last.
    agrees(Integrator::Path, 400, [0.01, 0.015, 0.08, 0.01, 0.01, 0.06]);
}

#[test]
fn manifold_next_event_estimation() {
    agrees(Integrator::Mnee, 150, [0.01, 0.015, 0.01, 0.01, 0.01, 0.005]);
}

#[test]
fn bidirectional() {
    agrees(Integrator::Bdpt, 150, [0.01, 0.015, 0.01, 0.01, 0.01, 0.005]);
}
