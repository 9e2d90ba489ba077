//! What the samples see, for denoisers, against closed values; and that it changes no picture.

mod common;

use caustica::math::Rgb;
use caustica::render::preview::Preview;
use caustica::render::{Cancel, Caustics, Image, Integrator, Plane, RenderError, Settings, render, render_shown};
use caustica::scene::description::*;
use common::{Builder, icosphere, settings};
use glam::{DVec3, Vec3};
use std::sync::Mutex;

const COLOR: Rgb = Rgb::new(0.7, 0.5, 0.2);

fn with_features(integrator: Integrator, side: u32, samples: u32) -> Settings {
    Settings { features: true, ..settings(integrator, side, samples, 3) }
}

/// Looks along -z at a wall in the plane z = 0, from z = 4; `before` is added to it.
fn wall(scattering: Scattering, emission: Rgb, before: impl FnOnce(&mut Builder)) -> Builder {
    let mut b = Builder::default();
    let material = b.emitter(scattering, emission);
    // Lamps shine to their front, toward the camera; other walls are seen from behind.
    let [e1, e2] = if emission == Rgb::ZERO { [Vec3::Y, Vec3::X] } else { [Vec3::X, Vec3::Y] };
    b.quad(Vec3::new(-9.0, -9.0, 0.0), e1 * 18.0, e2 * 18.0, material);
    before(&mut b);
    b.camera(DVec3::Z * 4.0, DVec3::ZERO, Projection::Orthographic { ymag: 1.0 });
    b
}

fn means(b: &Builder, integrator: Integrator) -> [Vec3; 2] {
    let features = common::run(&b.commit(), &with_features(integrator, 16, 16)).features.expect("features");
    let [albedo, normal, _] = features.map(|image| image.pixels.iter().sum::<Vec3>() / image.pixels.len() as f32);
    [albedo, normal]
}

#[test]
fn what_is_seen_has_its_colour_and_its_side() {
    let matte = || Scattering::Diffuse { reflectance: COLOR };
    let black = || Scattering::Diffuse { reflectance: Rgb::ZERO };
    let plain = |s, e| wall(s, e, |_| ());
    let gltf = |metallic| {
        Scattering::MetallicRoughness(MetallicRoughness { base_color: COLOR, metallic, ..MetallicRoughness::default() })
    };
    let frosted = Scattering::ThinDielectric { ior: 1.5, roughness: 0.5, tint: COLOR };
    let mut sky = Builder::default();
    sky.0.environment = Rgb::splat(0.3).into();
    sky.perspective([0.0; 3], [0.0, 0.0, 1.0], 0.7);
    // A mirror at 45 degrees before the camera, which shows a second wall to the right.
    let mirror = |b: &mut Builder| {
        let mirror = b.material(Scattering::Conductor { reflectance: Rgb::ONE, roughness: 0.0 });
        b.quad(Vec3::new(-2.0, -2.0, 1.0), Vec3::new(4.0, 0.0, 4.0), Vec3::Y * 4.0, mirror);
        let green = b.material(Scattering::Diffuse { reflectance: Rgb::Y * 0.5 });
        b.quad(Vec3::new(-9.0, -9.0, -9.0), Vec3::Z * 18.0, Vec3::Y * 18.0, green);
        b.quad(Vec3::new(9.0, -9.0, -9.0), Vec3::Z * 18.0, Vec3::Y * 18.0, green);
    };
    let cases: [(&str, Builder, Rgb, Vec3); 10] = [
        ("matte", plain(matte(), Rgb::ZERO), COLOR, Vec3::Z),
        ("rough metal", plain(Scattering::Conductor { reflectance: COLOR, roughness: 0.4 }, Rgb::ZERO), COLOR, Vec3::Z),
        ("glTF", plain(gltf(0.0), Rgb::ZERO), COLOR + 0.04, Vec3::Z),
        ("glTF, half metal", plain(gltf(0.5), Rgb::ZERO), COLOR + 0.02, Vec3::Z),
        ("glTF metal", plain(gltf(1.0), Rgb::ZERO), COLOR, Vec3::Z),
        ("lamp", plain(black(), Rgb::splat(0.25)), Rgb::splat(0.25), Vec3::Z),
        ("bright lamp", plain(matte(), Rgb::new(90.0, 0.0, 0.0)), Rgb::new(1.0, 0.5, 0.2), Vec3::Z),
        ("in a mirror", wall(matte(), Rgb::ZERO, mirror), Rgb::Y * 0.5, Vec3::NAN),
        ("frosted glass", plain(frosted, Rgb::ZERO), COLOR, Vec3::Z),
        ("sky", sky, Rgb::splat(0.3), Vec3::ZERO),
    ];
    for (name, b, albedo, normal) in &cases {
        for integrator in [Integrator::Path, Integrator::Bdpt, Integrator::Mnee] {
            let [a, n] = means(b, integrator);
            assert!((a - *albedo).abs().max_element() < 1e-5, "{name}, {integrator:?}: {a}");
            let sideways = normal.is_nan() && (n.x.abs() - 1.0).abs() < 1e-5 && n.y.hypot(n.z) < 1e-6;
            assert!(sideways || (n - *normal).length() < 1e-5, "{name}, {integrator:?}: {n}");
        }
    }
}

/// Stokes 1862: a sheet of index n reflects 2 F / (1 + F) head-on, F = ((n - 1) / (n + 1))^2.
#[test]
fn what_is_behind_a_pane_is_seen_through_it() {
    let tint = Rgb::new(0.9, 0.6, 0.3);
    let b = wall(Scattering::Diffuse { reflectance: COLOR }, Rgb::ZERO, |b| {
        let pane = b.material(Scattering::ThinDielectric { ior: 1.5, roughness: 0.0, tint });
        b.quad(Vec3::new(-9.0, -9.0, 1.0), Vec3::Y * 18.0, Vec3::X * 18.0, pane);
    });
    let reflected = 0.08 / 1.04;
    // 65536 samples that see the wall or nothing: 4 standard errors.
    let slack = 4.0 * (reflected * (1.0 - reflected) / 65536.0f32).sqrt();
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        let features = common::run(&b.commit(), &with_features(integrator, 64, 16)).features.expect("features");
        let [albedo, normal, _] = features.map(|image| image.pixels.iter().sum::<Vec3>() / 4096.0);
        let error = albedo / (tint * COLOR * (1.0 - reflected)) - 1.0;
        assert!(error.abs().max_element() < slack / (1.0 - reflected), "{albedo}");
        assert!((normal - Vec3::Z * (1.0 - reflected)).length() < slack, "{normal}");
    }
}

/// Fresnel head-on, F = ((n - 1) / (n + 1))^2. Radiance in the water is n^2 times as much, which is no colour.
#[test]
fn what_is_in_water_is_seen_from_above_and_from_within() {
    // The water ends at z = 1, before or behind the camera.
    for [low, high] in [[-99.0, 1.0], [1.0, 99.0]] {
        // Nor has it that of the bands in which it is seen.
        for (color, lamp, abbe) in [(COLOR, Rgb::ZERO, 0.0), (Rgb::ZERO, COLOR, 0.0), (Rgb::ZERO, COLOR, 60.0)] {
            let b = wall(Scattering::Diffuse { reflectance: color }, lamp, |b| {
                let inside = Medium { abbe, ..Medium::new(1.33, Rgb::ZERO) };
                let water = b.material(Scattering::Dielectric {
                    inside,
                    outside: Medium::VACUUM,
                    roughness: 0.0,
                    tint: Rgb::ONE,
                });
                b.cuboid(Vec3::new(-99.0, -99.0, low), Vec3::new(99.0, 99.0, high), false, water);
            });
            let reflected = (0.33f32 / 2.33).powi(2);
            let slack = 4.0 * (reflected * (1.0 - reflected) / 65536.0f32).sqrt();
            for integrator in [Integrator::Path, Integrator::Bdpt] {
                let features = common::run(&b.commit(), &with_features(integrator, 64, 16)).features.expect("features");
                let [albedo, ..] = features.map(|image| image.pixels.iter().sum::<Vec3>() / 4096.0);
                let error = albedo / (COLOR * (1.0 - reflected)) - 1.0;
                assert!(error.abs().max_element() < slack / (1.0 - reflected), "{low}, {integrator:?}: {albedo}");
            }
        }
    }
}

/// A wall, and a ball of glass that hides half of it, from a pinhole and by a parallel projection; and nothing.
#[test]
fn depth_is_that_of_the_first_surface_along_the_view() {
    let sky = |b: &mut Builder| b.0.environment = Rgb::ONE.into();
    for integrator in [Integrator::Path, Integrator::Bdpt, Integrator::Mnee] {
        for pinhole in [false, true] {
            let mut b = wall(Scattering::Diffuse { reflectance: COLOR }, Rgb::ZERO, sky);
            let glass = b.glass(1.5, 0.0);
            b.quad(Vec3::new(0.0, -9.0, 1.0), Vec3::X * 9.0, Vec3::Y * 18.0, glass);
            if pinhole {
                b.0.cameras.clear();
                b.perspective([0.0, 0.0, 4.0], [0.0; 3], 0.8);
            }
            let depths = common::run(&b.commit(), &with_features(integrator, 16, 4));
            let depths = depths.plane(Plane::Depth).expect("it was asked for");
            for (i, depth) in depths.pixels.iter().enumerate() {
                let expected = if i % 16 < 8 { 4.0 } else { 3.0 };
                assert!((*depth - expected).abs().max_element() < 1e-5, "{integrator:?}, {pinhole}: {depth} at {i}");
            }
            // Beside it.
            let mut b = wall(Scattering::Diffuse { reflectance: COLOR }, Rgb::ZERO, sky);
            b.0.cameras.clear();
            b.perspective([0.0, 0.0, 4.0], [0.0, 0.0, 9.0], 0.8);
            let nothing = common::run(&b.commit(), &with_features(integrator, 4, 1));
            assert!(nothing.plane(Plane::Depth).is_some_and(|d| d.pixels.iter().all(|p| *p == Vec3::ZERO)));
        }
    }
}

fn room() -> Builder {
    let mut b = Builder::default();
    let white = b.diffuse(0.7);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let glass = b.glass(1.5, 0.0);
    b.mesh(icosphere(0.5, 2, true), glass, glam::DAffine3::from_translation(DVec3::new(0.0, 0.6, 0.0)));
    let lamp = b.lamp(10.0);
    b.quad(Vec3::new(-0.3, 2.0, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, lamp);
    b.0.environment = Rgb::splat(0.1).into();
    // Under the lamp, in part a mirror.
    let polished =
        MetallicRoughness { base_color: COLOR, metallic: 0.0, roughness: 0.0, ..MetallicRoughness::default() };
    let polished = b.material(Scattering::MetallicRoughness(polished));
    b.quad(Vec3::new(-0.5, 1.2, 0.5), Vec3::Z * 1.0, Vec3::X * 1.0, polished);
    b.perspective([0.0, 1.5, 4.0], [0.0, 0.8, 0.0], 0.8);
    b
}

#[test]
fn paths_and_subpaths_see_the_same() {
    let world = room().commit();
    for max_depth in [1, 2, 3, 10] {
        let seen = |integrator, caustics| {
            let settings = Settings { caustics, max_depth, ..with_features(integrator, 32, 8) };
            common::run(&world, &settings).features.expect("features")
        };
        let path = seen(Integrator::Path, Caustics::Off);
        for image in &path {
            assert!(image.pixels.iter().any(|p| *p != image.pixels[0]));
        }
        for (integrator, caustics) in
            [(Integrator::Bdpt, Caustics::Off), (Integrator::Bdpt, Caustics::On), (Integrator::Mnee, Caustics::On)]
        {
            for (ours, path) in seen(integrator, caustics).iter().zip(&path) {
                let error = ours.pixels.iter().zip(&path.pixels).map(|(a, b)| (*a - *b).abs().max_element());
                let error = error.fold(0.0, f32::max);
                assert!(error < 1e-6, "{integrator:?}, {caustics:?}, {max_depth} segments: {error}");
            }
        }
    }
}

#[test]
fn pictures_are_the_same_with_features() {
    let world = room().commit();
    let plain = settings(Integrator::Bdpt, 24, 4, 3);
    for settings in [
        plain.clone(),
        Settings { integrator: Integrator::Path, ..plain.clone() },
        Settings { caustics_only: true, ..plain.clone() },
        Settings { per_technique: true, caustics: Caustics::On, ..plain.clone() },
        Settings { region: Some(caustica::render::Region { x: 3, y: 5, width: 11, height: 7 }), ..plain.clone() },
    ] {
        let without = common::run(&world, &settings);
        let with = common::run(&world, &Settings { features: true, ..settings.clone() });
        assert_eq!(with.image, without.image, "{settings:?}");
        assert!(without.features.is_none() && without.plane(Plane::Normal).is_none());
        let [albedo, normal, depth] = with.features.clone().expect("features");
        assert!(albedo.pixels.len() == with.image.pixels.len() && normal.pixels.len() == with.image.pixels.len());
        assert!(with.plane(Plane::Albedo) == Some(&albedo) && with.plane(Plane::Normal) == Some(&normal));
        assert!(with.plane(Plane::Depth) == Some(&depth));
        assert!(with.statistics.film_bytes > without.statistics.film_bytes);
    }
}

/// As the picture is shown while it renders, so are its features.
#[test]
fn features_are_shown_while_it_renders() {
    let world = room().commit();
    let request = |samples| Settings { threads: 1, samples, ..with_features(Integrator::Bdpt, 40, 1) };
    let (cancel, preview) = (Cancel::default(), Preview::default());
    let shown: Mutex<Option<(Vec<Image>, u32)>> = Mutex::new(None);
    let progress = |_| {
        let planes: Option<Vec<(Image, u32)>> = [Plane::Albedo, Plane::Normal, Plane::Depth]
            .into_iter()
            .map(|plane| preview.image(plane).expect("memory"))
            .collect();
        if let Some(planes) = planes {
            let samples = planes[0].1;
            *shown.lock().unwrap() = Some((planes.into_iter().map(|(image, _)| image).collect(), samples));
            cancel.cancel();
        }
    };
    render_shown(&world, &request(1 << 20), &cancel, &progress, &preview).expect("a render");
    let (images, samples) = shown.lock().unwrap().take().expect("a report with samples");
    assert_eq!(common::run(&world, &request(samples)).features.expect("features").to_vec(), images);

    let without = Settings { features: false, ..request(1) };
    let preview = Preview::default();
    render_shown(&world, &without, &Cancel::default(), &|_| (), &preview).expect("a render");
    assert!(matches!(preview.image(Plane::Albedo), Err(RenderError::Setting { setting: "features", .. })));
}

#[test]
fn light_tracing_sees_nothing() {
    match render(&room().commit(), &with_features(Integrator::Light, 8, 1), &Cancel::default(), &|_| ()) {
        Err(RenderError::Setting { setting, .. }) => assert_eq!(setting, "features"),
        other => panic!("{other:?}"),
    }
}
