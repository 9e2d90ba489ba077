//! Caustic connections change no expectation: path tracing, plain BDPT and BDPT with caustic
//! connections agree where path tracing can find the paths; and they find what it cannot.

mod common;

use caustica::camera::Region;
use caustica::math::Rgb;
use caustica::render::{Caustics, Image, Integrator, Settings};
use caustica::scene::World;
use caustica::scene::description::*;
use caustica::transport::options::MOST_SEEDS;
use common::scenes::{self, under_a_lamp};
use common::stats::{Blocks, blocks, check_normal, z_scores};
use common::{Builder, grid, icosphere, settings};
use glam::{DAffine3, DVec2, DVec3, Vec3};

const RUNS: u64 = 16;
const SIDE: u32 = 24;
const BLOCK: u32 = 6;

fn measure(world: &World, integrator: Integrator, caustics: bool, samples: u32, seed: u64) -> Blocks {
    measure_paths(world, integrator, caustics, 8, samples, seed)
}

fn measure_paths(
    world: &World,
    integrator: Integrator,
    caustics: bool,
    max_depth: u32,
    samples: u32,
    seed: u64,
) -> Blocks {
    let runs: Vec<Image> = (0..RUNS)
        .map(|run| {
            let caustics = if caustics { Caustics::On } else { Caustics::Off };
            let settings = Settings { caustics, max_depth, ..settings(integrator, SIDE, samples, seed + run) };
            common::run(world, &settings).image
        })
        .collect();
    blocks(&runs, BLOCK)
}

/// Path tracing against BDPT with caustic connections: per-block z-scores like N(0, 1) at a family-wise
/// level of 1e-3, and the mean within 4 standard errors.
fn agree(name: &str, builder: &Builder, path_samples: u32, bdpt_samples: u32) {
    let world = builder.commit();
    assert!(world.requirements.caustics);
    let path = measure(&world, Integrator::Path, false, path_samples, 1000);
    for (what, integrator) in [("bdpt", Integrator::Bdpt), ("mnee", Integrator::Mnee)] {
        let ours = measure(&world, integrator, true, bdpt_samples, 5000);
        let z = z_scores(&ours, &path);
        let error = ours.total.1.hypot(path.total.1);
        let bias = ours.total.0 / path.total.0 - 1.0;
        println!("{name}, {what}: bias {:+.3} % +- {:.3} %", bias * 100.0, error / path.total.0 * 100.0);
        check_normal(&format!("{name}, {what}"), &z, (RUNS - 1) as f64).expect("equal expectations");
        assert!((ours.total.0 - path.total.0).abs() < 4.0 * error, "{name}, {what}: bias {bias}");
    }
}

#[test]
fn ball() {
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    agree("ball", &b, 128, 32);
}

/// A part of the frame has other light subpaths and weights. Path tracing has the same bits there as in the whole
/// (`job.rs`); light tracing, which misses what is behind glass, is held against itself.
/// Each path has its colour once, however its dispersive parts are shared between the subpaths: all go through the pane.
#[test]
fn dispersive_ball_behind_a_pane() {
    let mut b = under_a_lamp(1.5);
    let inside = Medium { abbe: 15.0, ..Medium::new(1.5, Rgb::ZERO) };
    let glass = b.material(Scattering::Dielectric { inside, outside: Medium::VACUUM, roughness: 0.0, tint: Rgb::ONE });
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    b.cuboid(Vec3::new(-2.0, 0.5, 2.0), Vec3::new(2.0, 2.5, 2.1), false, glass);
    agree("dispersive ball", &b, 384, 96);
}

#[test]
fn a_region_is_that_part_of_the_whole() {
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    let world = b.commit();
    let part = Region { x: 8, y: 12, width: 12, height: 9 };
    let measure = |region, integrator, caustics, samples, seed| {
        let image = |run| {
            let settings = Settings { region, caustics, ..settings(integrator, SIDE, samples, seed + run) };
            let image = common::run(&world, &settings).image;
            let Region { x, y, width, height } = part;
            let place = move |i: u32| ((y + i / width) * SIDE + x + i % width) as usize;
            match region {
                Some(_) => image,
                None => Image::new(width, height, (0..width * height).map(|i| image.pixels[place(i)]).collect()),
            }
        };
        blocks(&(0..RUNS).map(image).collect::<Vec<_>>(), 3)
    };
    let path = measure(Some(part), Integrator::Path, Caustics::Off, 1024, 1000);
    let light = measure(None, Integrator::Light, Caustics::Off, 64, 1000);
    for (integrator, caustics, truth) in [
        (Integrator::Light, Caustics::Off, &light),
        (Integrator::Bdpt, Caustics::Off, &path),
        (Integrator::Bdpt, Caustics::On, &path),
        (Integrator::Mnee, Caustics::On, &path),
    ] {
        let ours = measure(Some(part), integrator, caustics, 256, 5000);
        let name = format!("region, {integrator:?}, caustics {caustics:?}");
        let error = ours.total.1.hypot(truth.total.1);
        let bias = ours.total.0 / truth.total.0 - 1.0;
        println!("{name}: bias {:+.3} % +- {:.3} %", bias * 100.0, error / truth.total.0 * 100.0);
        check_normal(&name, &z_scores(&ours, truth), (RUNS - 1) as f64).expect("equal expectations");
        assert!((ours.total.0 - truth.total.0).abs() < 4.0 * error, "{name}: bias {bias}");
    }
}

#[test]
fn the_depth_cap_counts_the_vertices_of_a_chain() {
    // Four segments from the camera to the lamp through the ball: camera, floor, ball, ball, lamp.
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    let world = b.commit();
    for (depth, walks) in [(3, false), (4, true)] {
        let settings = Settings { max_depth: depth, ..settings(Integrator::Mnee, SIDE, 4, 1) };
        let found = common::run(&world, &settings).statistics.walks.connections > 0;
        assert_eq!(found, walks, "walks at depth {depth}");
    }
}

#[test]
fn smooth_mesh() {
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.5, 0.0);
    // Flattened to a lens; interpolated normals.
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, 0.5, 1.0),
        glam::DQuat::IDENTITY,
        DVec3::new(0.0, 0.6, 0.0),
    );
    b.mesh(icosphere(0.5, 3, true), glass, place);
    agree("smooth mesh", &b, 128, 32);
}

#[test]
fn slab() {
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.5, 0.0);
    b.cuboid(Vec3::new(-1.0, 0.4, -1.0), Vec3::new(1.0, 0.6, 1.0), false, glass);
    agree("slab", &b, 128, 32);
}

#[test]
fn rough_ball() {
    // Path tracing, which does not walk, scatters at the microfacets.
    let mut b = under_a_lamp(1.5);
    let glass = b.walked_glass(1.5, 0.35);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    agree("rough ball", &b, 128, 32);
    // Rough glass is curved glass, too.
    let settings = Settings { caustics: Caustics::On, ..settings(Integrator::Mnee, 8, 1, 0) };
    assert_eq!(common::run(&b.commit(), &settings).statistics.seeds, MOST_SEEDS);
}

/// A sheet of water without rim or bottom, smaller than the floor and seen from its height: paths that get beside and
/// under it are taken for paths in air until they meet it.
#[test]
fn an_open_sheet() {
    let mut b = under_a_lamp(1.0);
    let water = b.glass(1.33, 0.0);
    let bumps = grid(24, |x, z| {
        let (p, q) = ((4.0 * x).cos(), (4.0 * z).cos());
        let slope = |along: f32, other: f32| 0.05 * 4.0 * (4.0 * along).sin() * other;
        (Vec3::new(x, 0.5 + 0.05 * p * q, z), Vec3::new(slope(x, q), 1.0, slope(z, p)))
    });
    b.mesh(bumps, water, DAffine3::from_scale(DVec3::new(0.8, 1.0, 0.8)));
    b.0.cameras.clear();
    b.perspective([0.0, 0.5, 3.0], [0.0, 0.3, 0.0], 0.7);
    agree("open sheet", &b, 256, 64);
}

#[test]
fn endless_ink_hides_the_sky() {
    // However it is sampled: by next-event estimation, by rays that leave the scene, from the sky.
    let mut b = Builder::default();
    b.0.environment = Rgb::ONE.into();
    let white = b.diffuse(0.6);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let bubble = b.material(Scattering::Dielectric {
        inside: Medium::new(1.0, Rgb::ZERO),
        outside: Medium::new(1.33, Rgb::new(0.5, 1.0, 2.0)),
        roughness: 0.0,
        tint: Rgb::ONE,
    });
    b.sphere(DVec3::new(0.0, 2.0, 3.0), 1.0, bubble);
    b.perspective([0.0, 0.5, 3.0], [0.0, 0.3, 0.0], 0.7);
    let world = b.commit();
    for integrator in [Integrator::Path, Integrator::Mnee] {
        let image = common::run(&world, &settings(integrator, SIDE, 64, 0)).image;
        assert!(image.pixels.iter().all(|p| *p == Rgb::ZERO), "{integrator:?}");
    }
}

#[test]
fn rough_mesh_with_a_smooth_core() {
    let mut b = under_a_lamp(1.5);
    let glass = b.walked_glass(1.5, 0.5);
    let water = b.material(Scattering::Dielectric {
        inside: Medium::new(1.33, Rgb::new(0.9, 0.4, 0.1)),
        outside: Medium::new(1.5, Rgb::ZERO),
        roughness: 0.0,
        tint: Rgb::ONE,
    });
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, 0.5, 1.0),
        glam::DQuat::IDENTITY,
        DVec3::new(0.0, 0.6, 0.0),
    );
    b.mesh(icosphere(0.5, 3, true), glass, place);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.2, water);
    agree("rough mesh", &b, 512, 128);
}

#[test]
fn light_that_passes_beside_what_blocks_the_straight_line() {
    // A thick plate displaces the light: a bar under it, as broad as the plate's shift, stands in the
    // straight lines of a strip of the floor that the light reaches.
    let mut b = Builder::default();
    let (white, black, glass) = (b.diffuse(0.6), b.diffuse(0.0), b.glass(1.5, 0.0));
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    b.cuboid(Vec3::new(-1.5, 0.6, -1.5), Vec3::new(1.5, 1.4, 1.5), false, glass);
    b.cuboid(Vec3::new(0.0, 0.3, -1.0), Vec3::new(0.15, 0.4, 1.0), false, black);
    b.light(LightKind::Point { position: DVec3::new(-1.6, 2.6, 0.0), intensity: Rgb::splat(8.0) });
    b.perspective([0.6, 0.25, 2.6], [0.3, 0.0, 0.0], 0.35);
    let world = b.commit();
    let plain = measure_paths(&world, Integrator::Bdpt, false, 4, 256, 1000);
    let walks = measure_paths(&world, Integrator::Mnee, true, 4, 64, 5000);
    let error = walks.total.1.hypot(plain.total.1);
    let bias = walks.total.0 / plain.total.0 - 1.0;
    println!("beside a bar: bias {:+.3} % +- {:.3} %", bias * 100.0, error / plain.total.0 * 100.0);
    check_normal("beside a bar", &z_scores(&walks, &plain), (RUNS - 1) as f64).expect("equal expectations");
    assert!(bias.abs() * plain.total.0 < 4.0 * error, "bias {bias}");
}

#[test]
fn rough_glass_is_evaluated_where_there_are_delta_lights() {
    // The glow of a point light in frosted glass is found by evaluating the refraction, and by nothing else.
    let mut b = Builder::default();
    let glass = b.walked_glass(1.5, 0.5);
    b.cuboid(Vec3::new(-1.0, 0.2, -0.1), Vec3::new(1.0, 1.8, 0.1), false, glass);
    b.light(LightKind::Point { position: DVec3::new(0.2, 1.0, -1.5), intensity: Rgb::splat(5.0) });
    b.perspective([0.0, 1.0, 3.0], [0.0, 0.9, 0.0], 0.5);
    let world = b.commit();
    assert!(world.walked.is_none() && !world.requirements.caustics);
}

#[test]
fn absorbing_water_in_a_glass_ball() {
    let mut b = under_a_lamp(1.5);
    let water = Medium::new(1.33, Rgb::new(0.9, 0.4, 0.1));
    let glass = b.glass(1.5, 0.0);
    let inner = b.material(Scattering::Dielectric {
        inside: water,
        outside: Medium::new(1.5, Rgb::ZERO),
        roughness: 0.0,
        tint: Rgb::new(1.0, 0.9, 1.0),
    });
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.4, inner);
    agree("nested water", &b, 128, 32);
}

#[test]
fn light_in_a_glass_ball() {
    let mut b = under_a_lamp(0.5);
    let glass = b.glass(1.5, 0.0);
    let lamp = b.lamp(6.0);
    b.sphere(DVec3::new(0.3, 0.9, 0.0), 0.3, glass);
    b.sphere(DVec3::new(0.3, 0.9, 0.0), 0.12, lamp);
    agree("light inside glass", &b, 128, 32);
}

#[test]
fn camera_in_glass() {
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.4, 0.0);
    b.sphere(DVec3::new(0.0, 1.8, 3.0), 0.4, glass);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    agree("camera inside glass", &b, 128, 32);
}

/// Parts of the lens are in dark glass, parts before it.
#[test]
fn a_lens_that_glass_covers_in_part() {
    let mut b = under_a_lamp(1.5);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    let camera = &mut b.0.cameras[0];
    let covered = camera.transform.transform_point3(DVec3::new(-0.3, 0.0, -0.1));
    camera.lens = Some(Lens { radius: 0.3, focus: 2.5 });
    camera.shift = DVec2::new(0.05, 0.1);
    let dark = b.absorbing(1.5, Rgb::new(1.0, 2.0, 4.0));
    b.sphere(covered, 0.3, dark);
    agree("lens", &b, 128, 32);
}

#[test]
fn indirect_light_through_a_ball() {
    // The lamp shines on a wall only; the wall lights the floor through the ball.
    let mut b = Builder::default();
    let white = b.diffuse(0.8);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0, white);
    let lamp = b.lamp(20.0);
    b.quad(Vec3::new(-1.0, 1.2, -0.6), Vec3::Y * 0.8, Vec3::X * 2.0, lamp);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.5, 0.3), 0.45, glass);
    b.perspective([0.0, 2.0, 3.5], [0.0, 0.3, 0.3], 0.7);
    agree("indirect", &b, 256, 32);
}

#[test]
fn environment_through_a_ball() {
    let mut b = Builder::default();
    let white = b.diffuse(0.6);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    b.0.environment = Rgb::splat(0.7).into();
    b.perspective([0.0, 1.8, 3.0], [0.0, 0.3, 0.0], 0.7);
    agree("environment", &b, 128, 32);
}

#[test]
fn sky_through_a_ball() {
    let mut b = Builder::default();
    let white = b.diffuse(0.6);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    b.0.environment = scenes::sky();
    b.perspective([0.0, 1.8, 3.0], [0.0, 0.3, 0.0], 0.7);
    agree("sky", &b, 128, 32);
}

#[test]
fn textures_and_stained_glass() {
    let mut b = Builder::default();
    scenes::textures(&mut b);
    scenes::stained_glass(&mut b);
    b.perspective([0.375, 1.75, 4.25], [0.0, 0.7, 0.0], 0.62);
    agree("stained glass", &b, 256, 64);
}

#[test]
fn delta_lights_through_a_ball() {
    // No path tracer finds these; plain BDPT does, by light tracing, since the camera sees the floor.
    let mut b = Builder::default();
    let white = b.diffuse(0.6);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    b.light(LightKind::Point { position: DVec3::new(0.3, 3.0, 0.2), intensity: Rgb::splat(8.0) });
    b.light(LightKind::Directional { direction: DVec3::new(0.4, -1.0, 0.1), irradiance: Rgb::splat(1.0) });
    b.perspective([0.0, 2.4, 2.4], [0.0, 0.0, 0.4], 0.7);
    let world = b.commit();
    // With more segments ours also finds the caustic as seen in or through the ball, which nothing else does.
    let plain = measure_paths(&world, Integrator::Bdpt, false, 4, 256, 1000);
    let ours = measure_paths(&world, Integrator::Bdpt, true, 4, 48, 5000);
    let error = ours.total.1.hypot(plain.total.1);
    println!(
        "delta lights: bias {:+.3} % +- {:.3} %",
        (ours.total.0 / plain.total.0 - 1.0) * 100.0,
        error / plain.total.0 * 100.0
    );
    check_normal("delta lights", &z_scores(&ours, &plain), (RUNS - 1) as f64).expect("equal expectations");
}

#[test]
fn without_glass_nothing_changes() {
    let world = under_a_lamp(1.0).commit();
    let image = |caustics| {
        let settings = Settings { caustics, ..settings(Integrator::Bdpt, SIDE, 4, 1) };
        let output = common::run(&world, &settings);
        (output.image, output.statistics.rays())
    };
    assert_eq!(image(Caustics::On), image(Caustics::Off));
    assert_eq!(image(Caustics::Auto), image(Caustics::Off));
}
