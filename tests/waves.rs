//! Under waves the walk from the straight line often ends in a reflection-like root, for the normal where it crosses the
//! surface misleads; walks from other starts find the chain. Whatever they find, light tracing, which knows no walks,
//! says how much light there is.
// The second backend is held against the first ray by ray, in `backends.rs`.
#![cfg(feature = "embree")]

mod common;

use caustica::camera::{Camera, Endpoint, Region};
use caustica::integrator::Sample;
use caustica::integrator::bdpt::{self, View};
use caustica::math::Rgb;
use caustica::render::{Caustics, Integrator, Settings};
use caustica::scene::World;
use caustica::scene::description::*;
use caustica::transport::Tracer;
use caustica::transport::options::{CausticOptions, MOST_SEEDS};
use caustica::transport::walk_count::WalkCount;
use common::oracle::{check_reference, first_seed, renders};
use common::stats::{Blocks, blocks};
use common::{Builder, grid, icosphere};
use glam::{DAffine3, DVec3, Vec3};
use std::sync::atomic::AtomicBool;

const RUNS: u64 = 16;
const SIDE: u32 = 24;
const BLOCK: u32 = 6;

/// A floor under a pane with a wavy upper side, seen from between them.
fn under_waves(lights: impl Fn(&mut Builder)) -> World {
    let mut b = Builder::default();
    let white = b.diffuse(0.6);
    b.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, white);
    let glass = b.glass(1.33, 0.0);
    let (height, number) = (0.04f32, 9.0f32);
    // Upward; its normals are those of the waves, too.
    let waves = grid(96, |x, z| {
        let (p, q) = ((number * x).sin(), (number * z).sin());
        let slope = |along: f32, other: f32| -height * number * (number * along).cos() * other;
        (Vec3::new(x, 1.1 + height * p * q, z), Vec3::new(slope(x, q), 1.0, slope(z, p)))
    });
    b.mesh(waves, glass, DAffine3::IDENTITY);
    b.quad(Vec3::new(-2.0, 1.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, glass);
    lights(&mut b);
    b.perspective([0.0, 0.9, 0.9], [0.0, 0.0, 0.0], 0.5);
    b.commit()
}

fn with(integrator: Integrator, samples: u32, seeds: Option<u32>, search: Option<f32>) -> Settings {
    let caustic_options = CausticOptions { seeds, search, ..CausticOptions::default() };
    // Floor, two refractions, light.
    Settings { max_depth: 4, caustic_options, ..common::settings(integrator, SIDE, samples, 0) }
}

fn measure(name: &str, world: &World, settings: &Settings) -> Blocks {
    let seed = first_seed(name);
    blocks(&renders(world, settings, seed..seed + RUNS), BLOCK)
}

fn walks(world: &World, seeds: u32) -> WalkCount {
    common::run(world, &with(Integrator::Mnee, 16, Some(seeds), None)).statistics.walks
}

#[test]
fn a_lamp_through_waves() {
    // What the walks miss the path tracer's hits find, and the weights must know which.
    let world = under_waves(|b| {
        let lamp = b.lamp(4.0);
        b.quad(Vec3::new(1.0, 2.0, -0.5), Vec3::X, Vec3::Z, lamp);
    });
    let expected = measure("lamp", &world, &with(Integrator::Light, 1024, None, None));
    // What searches find varies most.
    for (seeds, search, samples) in [(1, None, 64), (MOST_SEEDS, None, 64), (MOST_SEEDS, Some(0.25), 256)] {
        let name = format!("lamp, at most {seeds} walks, searches {search:?}");
        let ours = measure(&name, &world, &with(Integrator::Mnee, samples, Some(seeds), search));
        check_reference(&name, &ours, &expected, (RUNS - 1) as f64, 0.025).unwrap_or_else(|e| panic!("{e}"));
    }
    let [one, all] = [1, MOST_SEEDS].map(|seeds| walks(&world, seeds));
    eprintln!("{} of {} found, {} of {}", one.connected, one.connections, all.connected, all.connections);
    assert_eq!(one.retried, 0);
    assert!(all.rescued * 3 > all.retried, "{all:?}");
}

#[test]
fn a_point_light_through_waves() {
    // Nothing but walks finds it: what they miss is lost, and of several chains between two ends they find one.
    let light = LightKind::Point { position: DVec3::new(1.5, 2.0, 0.0), intensity: Vec3::splat(3.0) };
    let world = under_waves(|b| b.light(light));
    let expected = measure("point light", &world, &with(Integrator::Light, 2048, None, None));
    let name = "point light, searches with 0.25";
    let ours = measure(name, &world, &with(Integrator::Mnee, 256, None, Some(0.25)));
    check_reference(name, &ours, &expected, (RUNS - 1) as f64, 0.025).unwrap_or_else(|e| panic!("{e}"));
    let without = measure("point light, no searches", &world, &with(Integrator::Mnee, 128, None, None));
    let missed = 1.0 - without.total.0 / expected.total.0;
    eprintln!("missed without searches {:.1} %", 100.0 * missed);
    assert!((0.2..0.4).contains(&missed), "{missed}");
    // Unasked, bidirectional path tracing searches to such lights, and manifold next-event estimation does not.
    for (integrator, searches) in [(Integrator::Bdpt, true), (Integrator::Mnee, false)] {
        let settings = Settings { caustics: Caustics::On, ..with(integrator, 1, None, None) };
        assert_eq!(common::run(&world, &settings).statistics.walks.searches > 0, searches, "{integrator:?}");
    }
}

/// A sky is hit, whatever other lights there are: no connection searches to it unasked.
#[test]
fn a_sky_beside_a_lamp_that_cannot_be_hit() {
    let world = under_waves(|b| {
        b.0.environment = Rgb::ONE.into();
        // In a box, so that few look for it.
        b.light(LightKind::Point { position: DVec3::new(0.0, 9.0, 0.0), intensity: Rgb::splat(1e-9) });
        let black = b.diffuse(0.0);
        b.mesh(icosphere(0.5, 0, false), black, DAffine3::from_translation(DVec3::new(0.0, 9.0, 0.0)));
    });
    let settings = Settings { caustics: Caustics::On, ..with(Integrator::Bdpt, 16, None, None) };
    let WalkCount { connections, searches, .. } = common::run(&world, &settings).statistics.walks;
    // A quarter of those to the lamp do.
    assert!(connections > 1000 && searches * 20 < connections, "{connections}, {searches}");
    assert!(
        world.lights.is_delta(&Endpoint::Point(Vec3::ZERO)) && !world.lights.is_delta(&Endpoint::Infinite(Vec3::Y))
    );
    let direction = DVec3::new(0.3, -0.7, 0.2);
    let sun = under_waves(|b| b.light(LightKind::Directional { direction, irradiance: Rgb::ONE }));
    let toward = Endpoint::Infinite(-direction.normalize().as_vec3());
    assert!(sun.lights.is_delta(&toward) && !sun.lights.is_delta(&Endpoint::Infinite(Vec3::Y)));
}

/// Until a chain is found again takes many walks here; whoever cancels waits for none of these.
#[test]
fn a_cancel_ends_searches() {
    let world = under_waves(|b| {
        b.light(LightKind::Point { position: DVec3::new(0.2, 3.0, 0.1), intensity: Rgb::ONE });
    });
    let walks = |stop: bool| {
        let stop = AtomicBool::new(stop);
        let mut tracer = Tracer::new(&world, 9);
        tracer.connect_through_glass();
        tracer.options.search = Some(1.0);
        tracer.stop = Some(&stop);
        let region = Region::all(16, 16);
        let camera = Camera::new(&world.cameras[0], 16, 16, region);
        let view = View { medium: Some(0), camera, columns: 16, region };
        for (pass, pixel) in (0..16).flat_map(|pass| (0..16 * 16).map(move |pixel| (pass, pixel))) {
            bdpt::sample(&mut tracer, &view, 1, pixel, pass, &mut Sample::default(), &mut ());
        }
        tracer.walks
    };
    let (stopped, all) = (walks(true), walks(false));
    assert!(all.discovered > 0 && all.search_walks > all.searches + all.discovered, "{all:?}");
    assert_eq!(stopped.search_walks, stopped.searches, "{stopped:?}");
}

#[test]
fn a_point_light_through_a_roof() {
    // Flat facets have no curvature, and yet there are two ways to what lies under the ridge.
    let mut b = Builder::default();
    let (white, glass) = (b.diffuse(0.6), b.glass(1.5, 0.0));
    b.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, white);
    let (base, ridge) = (1.0, 1.25);
    b.mesh(
        MeshDescription {
            positions: vec![
                [-1.0, base, -1.0],
                [1.0, base, -1.0],
                [1.0, base, 1.0],
                [-1.0, base, 1.0],
                [0.0, ridge, -1.0],
                [0.0, ridge, 1.0],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4], [1, 4, 5], [1, 5, 2], [0, 4, 1], [3, 2, 5]],
            ..MeshDescription::default()
        },
        glass,
        DAffine3::IDENTITY,
    );
    b.light(LightKind::Point { position: DVec3::new(0.0, 3.0, 0.0), intensity: Vec3::splat(3.0) });
    b.perspective([0.0, 0.9, 0.9], [0.0, 0.0, 0.0], 0.5);
    let world = b.commit();
    let expected = measure("roof", &world, &with(Integrator::Light, 1024, None, None));
    let ours = measure("roof, searches", &world, &with(Integrator::Mnee, 128, None, Some(0.5)));
    check_reference("roof, searches", &ours, &expected, (RUNS - 1) as f64, 0.025).unwrap_or_else(|e| panic!("{e}"));
    let without = measure("roof, no searches", &world, &with(Integrator::Mnee, 64, None, None));
    let missed = 1.0 - without.total.0 / expected.total.0;
    eprintln!("missed without searches {:.1} %", 100.0 * missed);
    assert!((0.05..0.5).contains(&missed), "{missed}");
    let settings = Settings { caustics: Caustics::On, ..with(Integrator::Bdpt, 1, None, None) };
    assert!(common::run(&world, &settings).statistics.walks.searches > 0);
}

#[test]
fn a_spot_through_a_cut_stone() {
    // Each of many facets is seldom found by a search. Were the weights to take it for often, what the light image finds
    // at ease would be left to rare and bright finds.
    let mut b = Builder::default();
    let (white, glass) = (b.diffuse(0.6), b.glass(1.5, 0.0));
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    b.mesh(icosphere(0.5, 1, false), glass, DAffine3::from_translation(DVec3::Y * 0.6));
    b.light(LightKind::Spot {
        position: DVec3::new(-1.0, 2.0, 1.0),
        direction: DVec3::new(1.0, -1.7, -1.0),
        intensity: Vec3::splat(20.0),
        inner: 0.2,
        outer: 0.6,
    });
    b.perspective([0.0, 1.6, 3.2], [0.0, 0.4, 0.0], 0.7);
    let world = b.commit();
    let with_search = |search| Settings {
        caustics: Caustics::On,
        caustics_only: true,
        max_depth: 8,
        ..with(Integrator::Bdpt, 64, None, Some(search))
    };
    let name = "cut stone, searches";
    let [without, always] = [0.0, 1.0].map(|search| measure(name, &world, &with_search(search)));
    check_reference(name, &always, &without, (RUNS - 1) as f64, 0.05).unwrap_or_else(|e| panic!("{e}"));
    let noise = |b: &Blocks| b.error.iter().map(|e| e * e).sum::<f64>();
    let ratio = noise(&always) / noise(&without);
    eprintln!("variance with searches over that without {ratio:.2}");
    assert!(ratio < 2.0, "{ratio}");
}
