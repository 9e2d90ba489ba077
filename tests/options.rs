//! What the options of caustic connections may change: cost and noise, and with a shortened check the
//! picture. Caustic paths alone, on a floor under a glass ball that gathers the light of a lamp.
// The second backend is held against the first ray by ray, in `backends.rs`.
#![cfg(feature = "embree")]

mod common;

use caustica::math::Rgb;
use caustica::render::{Cancel, Caustics, Integrator, RenderError, Settings, render};
use caustica::scene::description::LightKind;
use caustica::scene::{CommitOptions, World};
use caustica::transport::options::{CausticOptions, Check, GeometryTerm, LAMP_SEARCH, MOST_SEEDS};
use caustica::transport::roulette::Roulette;
use common::oracle::{check_reference, first_seed, renders};
use common::scenes::{sky, under_a_lamp};
use common::stats::{Blocks, blocks};
use common::{Builder, icosphere};
use glam::{DAffine3, DVec3, Vec3};
use std::sync::LazyLock;

const RUNS: u64 = 16;
const SIDE: u32 = 24;
const BLOCK: u32 = 6;
const SAMPLES: u32 = 128;

/// Bias of the caustic paths' mean that is excluded with 95 % confidence.
const LIMIT: f64 = 0.025;

static WORLD: LazyLock<World> = LazyLock::new(|| {
    let mut b = under_a_lamp(1.5);
    let wall = b.diffuse(0.8);
    b.quad(Vec3::new(-2.0, 0.0, -1.5), Vec3::X * 4.0, Vec3::Y * 3.0, wall);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    b.0.cameras.clear();
    b.perspective([0.0, 0.9, 3.0], [0.0, 0.0, 0.0], 0.2);
    b.commit()
});

static BY_DEFAULT: LazyLock<Blocks> = LazyLock::new(|| measure("by default", CausticOptions::default()));

fn with(caustic_options: CausticOptions) -> Settings {
    let settings = common::settings(Integrator::Bdpt, SIDE, SAMPLES, 0);
    Settings { max_depth: 6, caustics: Caustics::On, caustics_only: true, caustic_options, ..settings }
}

/// Seeds differ from case to case: differences between runs with equal seeds are zero but for rare large
/// ones, which sixteen runs need not have.
fn measure(name: &str, options: CausticOptions) -> Blocks {
    let seed = first_seed(name);
    blocks(&renders(&WORLD, &with(options), seed..seed + RUNS), BLOCK)
}

fn changes_nothing(name: &str, options: CausticOptions, limit: f64) {
    let ours = measure(name, options);
    check_reference(name, &ours, &BY_DEFAULT, (RUNS - 1) as f64, limit).expect("the picture by default");
}

fn direct(check: Check) -> CausticOptions {
    CausticOptions { geometry_term: GeometryTerm::Direct, check, ..CausticOptions::default() }
}

/// Relative difference of the mean from that by default, and in standard errors.
fn difference(name: &str, options: CausticOptions) -> (f64, f64) {
    let ((ours, error), (default, its_error)) = (measure(name, options).total, BY_DEFAULT.total);
    let (bias, error) = ((ours - default) / default, error.hypot(its_error) / default);
    eprintln!("{name}: {:+.2} % +- {:.2} %, z {:+.1}", 100.0 * bias, 100.0 * error, bias / error);
    (bias, bias / error)
}

#[test]
fn the_direct_term_in_the_weights_changes_nothing() {
    // But the noise: at a fold the weighted contribution has no bound. Far below what a wrong check does.
    changes_nothing("direct term", direct(Check::Exact), 0.1);
}

#[test]
fn a_check_of_few_steps_counts_light_twice() {
    let (bias, z) = difference("few steps", direct(Check::Few));
    assert!(bias > 0.0 && z > 6.0, "{bias}, z {z}");
}

#[test]
fn without_a_check_light_is_lost() {
    let (bias, z) = difference("no check", direct(Check::Off));
    assert!(bias < 0.0 && z < -6.0, "{bias}, z {z}");
}

#[test]
fn roulette_changes_nothing() {
    let with_roulette = |roulette| CausticOptions { roulette, ..CausticOptions::default() };
    changes_nothing("no roulette", with_roulette(Roulette::Off), LIMIT);
    changes_nothing("roulette by lengths", with_roulette(Roulette::Lengths), LIMIT);
    // And by contribution by default. That it is at work:
    let default = CausticOptions::default().roulette;
    for (roulette, spares) in [(Roulette::Off, false), (Roulette::Lengths, true), (default, true)] {
        let settings = Settings { samples: 1, ..with(with_roulette(roulette)) };
        let spared = common::run(&WORLD, &settings).statistics.walks.spared;
        assert_eq!(spared > 0, spares, "{roulette:?} spared {spared}");
    }
}

#[test]
fn the_number_of_walks_changes_nothing() {
    for seeds in 1..=MOST_SEEDS {
        let options = CausticOptions { seeds: Some(seeds), ..CausticOptions::default() };
        changes_nothing(&format!("at most {seeds} walks"), options, LIMIT);
    }
}

#[test]
fn walks_of_few_steps_change_nothing() {
    // The check is the connection's own walk: what it gives up, the other techniques find.
    for n in [8, 64] {
        let options = CausticOptions { max_iterations: Some(n), ..CausticOptions::default() };
        changes_nothing(&format!("at most {n} steps"), options, LIMIT);
    }
}

#[test]
fn aim_changes_nothing() {
    for share in [0.0, 0.5, 0.9] {
        let options = CausticOptions { aim: Some(share), ..CausticOptions::default() };
        changes_nothing(&format!("aim {share}"), options, LIMIT);
    }
}

/// Light tracing under a sun, and bidirectional path tracing under a sky, where the camera sees the caustic of a ball.
#[test]
fn aim_of_light_from_infinity_changes_nothing() {
    let sun = |b: &mut Builder| {
        b.light(LightKind::Directional { direction: DVec3::new(0.3, -1.0, 0.2), irradiance: Rgb::splat(2.0) });
    };
    let sky = |b: &mut Builder| b.0.environment = sky();
    type Light = fn(&mut Builder);
    for (name, integrator, light) in [
        ("sun", Integrator::Light, sun as Light),
        ("sun and connections", Integrator::Bdpt, sun),
        ("sky", Integrator::Bdpt, sky),
    ] {
        let mut b = Builder::default();
        let white = b.diffuse(0.6);
        b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
        let glass = b.glass(1.5, 0.0);
        b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.4, glass);
        b.mesh(icosphere(0.2, 3, true), glass, DAffine3::from_translation(DVec3::new(0.7, 0.3, 0.2)));
        b.perspective([0.0, 2.0, 2.2], [0.1, 0.0, 0.1], 0.6);
        light(&mut b);
        let world = b.commit();
        let of = |share: f32, samples| {
            let name = format!("{name}, aim {share}");
            let caustic_options = CausticOptions { aim: Some(share), ..CausticOptions::default() };
            let settings =
                Settings { caustics: Caustics::On, caustic_options, ..common::settings(integrator, SIDE, samples, 0) };
            let seed = first_seed(&name);
            let images = renders(&world, &settings, seed..seed + RUNS);
            blocks(&images, BLOCK)
        };
        check_reference(name, &of(0.6, 128), &of(0.0, 256), (RUNS - 1) as f64, 0.02).expect("the picture without aim");
    }
}

#[test]
fn the_number_of_light_subpaths_changes_nothing() {
    for number in [0.25, 2.5] {
        let options = CausticOptions { light_subpaths: Some(number), ..CausticOptions::default() };
        changes_nothing(&format!("{number} light subpaths"), options, LIMIT);
    }
}

fn scene_of_this_repository(scene: &str) -> World {
    let file = format!("{}/scenes/{scene}.glb", env!("CARGO_MANIFEST_DIR"));
    let loaded = caustica::io::gltf::load(file.as_ref()).expect("a scene of this repository");
    World::commit(&loaded.description, CommitOptions::default()).expect("a valid scene")
}

#[test]
fn there_are_as_many_light_subpaths_as_pay() {
    // By the forecast: where a point light shines on a ball, next-event estimation through the glass does most, and aimed
    // light subpaths, though they find what it does not, cost more than all the rest. The eye has its light from a wall.
    for (scene, fewer) in [("glass_sphere", true), ("eye", false), ("pane_sphere", false)] {
        let world = scene_of_this_repository(scene);
        let render = |light_subpaths, caustics| {
            let caustic_options = CausticOptions { aim: Some(0.5), light_subpaths, ..CausticOptions::default() };
            let settings = Settings { caustics, caustic_options, ..common::settings(Integrator::Bdpt, 64, 8, 3) };
            common::run(&world, &settings).statistics
        };
        let auto = render(None, Caustics::Auto);
        assert_eq!(auto.light_subpaths < 1.0, fewer, "{scene}: {}", auto.light_subpaths);
        let one = render(Some(1.0), Caustics::Auto);
        assert_eq!(one.light_subpaths, 1.0);
        // In proportion, but for a few standard errors.
        let share = auto.light_path_rays as f32 / one.light_path_rays as f32;
        assert!((share / auto.light_subpaths - 1.0).abs() < 0.05, "{scene}: {share} of the rays");
        assert_eq!(
            render(None, Caustics::Off).light_subpaths,
            1.0,
            "plain bidirectional path tracing is left as it is"
        );
    }
}

#[test]
fn walks_start_elsewhere_where_it_pays() {
    // By the forecast: under waves, where the straight line's normal misleads; hardly ever at a cornea. A pane is flat, and
    // there is nothing to decide.
    for (scene, seeds) in [("water", MOST_SEEDS), ("water_small", MOST_SEEDS), ("eye", 1), ("window", 1)] {
        let world = scene_of_this_repository(scene);
        let caustic_options = CausticOptions { aim: Some(0.0), ..CausticOptions::default() };
        let settings = common::settings(Integrator::Bdpt, 64, 2, 3);
        let settings = Settings { caustics: Caustics::Auto, caustic_options, ..settings };
        let statistics = common::run(&world, &settings).statistics;
        assert_eq!(statistics.seeds, seeds, "{scene}: {:?}", statistics.seeds_forecast);
        assert_eq!(statistics.seeds_forecast.is_some(), scene != "window", "{scene}");
        assert_eq!(statistics.walks.retried > 0, seeds > 1, "{scene}");
    }
}

#[test]
fn searches_are_made_where_they_pay() {
    // By the forecast: where what a search finds would be left to hits of a tiny lamp, under waves. Out of a hollow globe
    // and at a cornea walks find nearly all.
    for (scene, search) in [("water_small", LAMP_SEARCH), ("figure4b_small", 0.0), ("eye", 0.0)] {
        let world = scene_of_this_repository(scene);
        let settings = common::settings(Integrator::Bdpt, 128, 1, 3);
        let settings = Settings { caustics: Caustics::Auto, ..settings };
        let statistics = common::run(&world, &settings).statistics;
        assert_eq!(statistics.search, search, "{scene}: {:?}", statistics.search_forecast);
        assert_eq!(statistics.walks.searches > 0, search > 0.0, "{scene}");
        let given = CausticOptions { search: Some(0.0), ..CausticOptions::default() };
        let statistics = common::run(&world, &Settings { caustic_options: given, ..settings }).statistics;
        assert!(statistics.search_forecast.is_none() && statistics.walks.searches == 0, "{scene}");
    }
}

#[test]
fn light_is_aimed_where_it_pays() {
    // By the forecast: at the glass of Figure 4a, not at a pane that fills half of what the lamp sees. At lumpy glass it
    // pays because no connections will be made, whose walks it would multiply.
    let scenes = [
        ("figure4a", true),
        ("water_glass", true),
        ("pane_sphere", true),
        ("glass_sphere", true),
        ("lumpy", true),
        ("window", false),
    ];
    for (scene, aims) in scenes {
        let world = scene_of_this_repository(scene);
        let render = |aim, caustics| {
            let caustic_options = CausticOptions { aim, ..CausticOptions::default() };
            let settings = Settings { caustics, caustic_options, ..common::settings(Integrator::Bdpt, 64, 1, 3) };
            common::run(&world, &settings)
        };
        let auto = render(None, Caustics::Auto);
        assert_eq!(auto.statistics.aimed, aims, "{scene}: {:?}", auto.statistics.aim_forecast);
        assert!(auto.statistics.aim_forecast.is_some());
        let never = render(Some(0.0), Caustics::Auto);
        assert_eq!(auto.image == never.image, !aims, "{scene}");
        assert!(!never.statistics.aimed && never.statistics.aim_forecast.is_none());
        assert!(render(Some(0.3), Caustics::Off).statistics.aimed, "{scene}: as asked for");
        // Plain bidirectional path tracing is left as it is.
        assert!(!render(None, Caustics::Off).statistics.aimed, "{scene}");
    }
}

#[test]
fn connections_are_made_where_they_pay() {
    // By the forecast: a window's room has its light through the pane alone; the panel of Figure 4a is wide,
    // and the camera sees the floor. In Figure 4b it sees the lamp in the globe, which has no noise and must
    // not outweigh the caustics. The sun of the sky gathers in spots so small that few groups of samples meet them; the lumpy
    // glass has single paths which are as rare, and no more. With a delta light there is nothing to decide.
    for (scene, as_with) in [
        ("window", Caustics::On),
        ("figure4a", Caustics::Off),
        ("figure4b", Caustics::On),
        ("sky", Caustics::On),
        ("lumpy", Caustics::Off),
        ("glass_sphere", Caustics::On),
        ("cornell", Caustics::Off),
    ] {
        let world = scene_of_this_repository(scene);
        let render = |caustics| {
            let caustic_options = CausticOptions { aim: Some(0.0), ..CausticOptions::default() };
            let settings = Settings { caustics, caustic_options, ..common::settings(Integrator::Bdpt, 64, 1, 3) };
            common::run(&world, &settings)
        };
        let auto = render(Caustics::Auto);
        let expected = render(as_with);
        assert_eq!(auto.image, expected.image, "{scene}");
        assert_eq!(auto.statistics.caustics, expected.statistics.caustics, "{scene}");
        if scene == "figure4b" {
            // The lamp is no part of the mean radiance either, by which roulette spares attempts.
            let walks = auto.statistics.walks;
            assert!(walks.spared < walks.connections / 2, "{walks:?}");
        }
        let decides = world.requirements.caustics && !world.requirements.delta_lights;
        assert_eq!(auto.statistics.forecast.is_some(), decides, "{scene}");
    }
}

#[test]
fn a_tolerance_that_the_check_cannot_follow_is_refused() {
    for tolerance in [1e-3, 0.0, 1e-300, f64::NAN] {
        let mut options = CausticOptions::default();
        options.walk.tolerance = tolerance;
        let error = render(&WORLD, &with(options), &Cancel::default(), &|_| ()).expect_err("refused");
        assert!(matches!(error, RenderError::Setting { setting: "walk tolerance", .. }), "{error}");
    }
}

#[test]
fn a_share_that_leaves_too_little_for_the_rest_is_refused() {
    for share in [-0.1, 0.96, 1.0, f32::NAN] {
        let options = CausticOptions { aim: Some(share), ..CausticOptions::default() };
        let error = render(&WORLD, &with(options), &Cancel::default(), &|_| ()).expect_err("refused");
        assert!(matches!(error, RenderError::Setting { setting: "aim", .. }), "{error}");
    }
}

#[test]
fn a_number_of_light_subpaths_that_is_none_is_refused() {
    for number in [0.0, -1.0, 65.0, f32::NAN, f32::INFINITY] {
        let options = CausticOptions { light_subpaths: Some(number), ..CausticOptions::default() };
        let error = render(&WORLD, &with(options), &Cancel::default(), &|_| ()).expect_err("refused");
        assert!(matches!(error, RenderError::Setting { setting: "light subpaths", .. }), "{error}");
    }
}

#[test]
fn a_number_of_walks_that_there_are_no_starts_for_is_refused() {
    for number in [0, MOST_SEEDS + 1] {
        let options = CausticOptions { seeds: Some(number), ..CausticOptions::default() };
        let error = render(&WORLD, &with(options), &Cancel::default(), &|_| ()).expect_err("refused");
        assert!(matches!(error, RenderError::Setting { setting: "seeds", .. }), "{error}");
    }
}

#[test]
fn searches_that_no_check_could_follow_are_refused() {
    let default = CausticOptions::default();
    let not_a_probability = [-0.1, 1.1, f32::NAN].map(|p| CausticOptions { search: Some(p), ..default });
    let few = CausticOptions { search: Some(0.5), ..direct(Check::Few) };
    for options in not_a_probability.into_iter().chain([few]) {
        let error = render(&WORLD, &with(options), &Cancel::default(), &|_| ()).expect_err("refused");
        assert!(matches!(error, RenderError::Setting { setting: "search", .. }), "{error}");
    }
}

#[test]
fn inexact_checks_need_the_direct_term() {
    for check in [Check::Few, Check::Off] {
        let settings = with(CausticOptions { check, ..CausticOptions::default() });
        let error = render(&WORLD, &settings, &Cancel::default(), &|_| ()).expect_err("refused");
        assert!(matches!(error, RenderError::Setting { setting: "check", .. }), "{error}");
        assert!(error.to_string().contains("check"), "{error}");
    }
}
