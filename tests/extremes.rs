//! The same scene tiny, huge and far away; needles, grazing light, index ratios next to 1, total
//! reflection. Every render must be free of non-finite samples.
//!
//! Scaled and moved scenes are rendered with the seeds of the plain one: almost all paths are the same
//! but for rounding, so that the differences, taken within pairs of renders, are far smaller than the noise of
//! either. Scenes are laid on a grid of 2^-9 m, which f32 keeps 1e4 m from the origin.

mod common;

use caustica::camera::Endpoint;
use caustica::geometry::Ray;
use caustica::math::{Rgb, luminance};
use caustica::render::{Caustics, Integrator, Settings};
use caustica::scene::description::*;
use caustica::scene::{CommitOptions, SceneError, World};
use caustica::transport::options::CausticOptions;
use common::oracle::{BIAS_LIMIT, check_bias, check_pairs, first_seed, renders};
use common::stats::{block_means, mean_and_error};
use common::{Builder, icosphere, scenes, settings};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

const RUNS: u64 = 8;
const BLOCK: u32 = 4;

/// Every vertex, sphere and camera on the grid, all transforms but a sphere's place undone.
fn on_grid(mut d: Description) -> Description {
    let snap = |p: DVec3| (p * 512.0).round() / 512.0;
    for instance in &mut d.instances {
        match instance.geometry {
            Geometry::Mesh(mesh) => {
                for p in &mut Arc::make_mut(&mut d.meshes[mesh]).positions {
                    let placed = instance.transform.transform_point3(Vec3::from(*p).as_dvec3());
                    *p = snap(placed).as_vec3().to_array();
                }
                instance.transform = DAffine3::IDENTITY;
            }
            Geometry::Sphere { .. } => instance.transform.translation = snap(instance.transform.translation),
        }
    }
    for camera in &mut d.cameras {
        camera.transform.translation = snap(camera.transform.translation);
    }
    for light in &mut d.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position = snap(*position),
            LightKind::Directional { .. } => {}
        }
    }
    d
}

/// The scene `scale` times as large about the origin, then moved: the image stays the same if
/// intensities go by the square of the scale, and absorption by its inverse.
fn similar(d: &Description, scale: f64, shift: DVec3) -> Description {
    let mut d = d.clone();
    let place = |p: DVec3| p * scale + shift;
    let outer = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), glam::DQuat::IDENTITY, shift);
    for instance in &mut d.instances {
        instance.transform = outer * instance.transform;
    }
    for camera in &mut d.cameras {
        camera.transform.translation = place(camera.transform.translation);
        if let Projection::Orthographic { ymag } = &mut camera.projection {
            *ymag *= scale;
        }
    }
    for light in &mut d.lights {
        match &mut light.kind {
            LightKind::Point { position, intensity } | LightKind::Spot { position, intensity, .. } => {
                *position = place(*position);
                *intensity *= (scale * scale) as f32;
            }
            LightKind::Directional { .. } => {}
        }
    }
    for material in &mut d.materials {
        if let Scattering::Dielectric { inside, outside, .. } = &mut material.scattering {
            inside.absorption /= scale as f32;
            outside.absorption /= scale as f32;
        }
    }
    d
}

/// Diffuse, glossy, rough, smooth and absorbing things under unequal area lights.
fn everything() -> Builder {
    let mut b = scenes::rough_glass();
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.5, 1.0), 0.375, glass);
    let metal = b.material(Scattering::Conductor { reflectance: Rgb::splat(0.8), roughness: 0.5 });
    b.mesh(icosphere(0.25, 2, true), metal, DAffine3::from_translation(DVec3::new(0.0, 0.5, -0.5)));
    b
}

fn world(d: &Description) -> World {
    World::commit(d, CommitOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders of the plain scene and of similar ones (scale and shift), as [`check_same`].
fn check_similar(name: &str, builder: &Builder, changes: &[(f64, DVec3)], tolerance: f64) {
    let bases = [Integrator::Path, Integrator::Bdpt].map(|i| Settings { max_depth: 7, ..settings(i, 32, 16, 0) });
    check_all_similar(name, builder, changes, &bases, tolerance);
}

fn check_all_similar(name: &str, builder: &Builder, changes: &[(f64, DVec3)], bases: &[Settings], tolerance: f64) {
    let plain = on_grid(builder.0.clone());
    let changed = changes
        .iter()
        .map(|&(scale, shift)| (format!("{name}, scale {scale:e}, shift {shift}"), similar(&plain, scale, shift)));
    check_same(&plain, &changed.collect::<Vec<_>>(), bases, tolerance);
}

/// Renders of a scene and of those, with their names, that should look the same. Blocks: the difference is within its
/// noise (4 standard errors) but for `tolerance` of the block's value, which rounding may cost; the mean's bias is below
/// `tolerance`.
fn check_same(plain: &Description, changed: &[(String, Description)], bases: &[Settings], tolerance: f64) {
    let mut wrong = Vec::new();
    for base in bases {
        let seed = first_seed("similar");
        let runs = |d: &Description| {
            let images = renders(&world(d), base, seed..seed + RUNS);
            images.iter().map(|i| block_means(i, BLOCK)).collect::<Vec<_>>()
        };
        let b = runs(plain);
        for (name, changed) in changed {
            let name = format!("{name}, {:?}", base.integrator);
            let a = runs(changed);
            let mut totals = vec![0.0; RUNS as usize];
            let mut level = 0.0;
            let mut worst = 0.0f64;
            for block in 0..a[0].len() {
                let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a[block] - b[block]).collect();
                let value = b.iter().map(|b| b[block]).sum::<f64>() / b.len() as f64;
                let (d, error) = mean_and_error(&differences);
                totals.iter_mut().zip(&differences).for_each(|(t, d)| *t += d);
                level += value;
                worst = worst.max(d.abs() / value);
                if d.abs() > 4.0 * error + tolerance * value {
                    wrong.push(format!("{name}: block {block} differs by {d} +- {error} of {value}"));
                }
            }
            let (d, error) = mean_and_error(&totals);
            eprintln!("{name}: largest difference of a block {:.3} %", 100.0 * worst);
            wrong.extend(check_bias(&name, d / level, error / level, RUNS as f64 - 1.0, tolerance).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A millionth of the size, a million times as large, and ten kilometres away.
fn sizes() -> [(f64, DVec3); 3] {
    [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e4)].map(|(scale, shift)| (scale, DVec3::splat(shift)))
}

#[test]
fn everything_at_all_sizes() {
    let mut changes: Vec<_> = [1e-6, 1e-4, 1e4, 1e6].map(|scale| (scale, DVec3::ZERO)).into();
    changes.push((1.0, DVec3::new(1e4, -1e4, 1e4)));
    check_similar("everything", &everything(), &changes, 0.002);
}

#[test]
fn delta_lights_at_all_sizes() {
    check_similar("delta lights", &scenes::delta_lights(), &sizes(), 0.002);
}

#[test]
fn an_environment_at_all_sizes() {
    check_similar("environment", &scenes::environment(), &sizes(), 0.002);
}

#[test]
fn an_image_of_the_sky_at_all_sizes() {
    check_similar("sky", &scenes::under_a_sky(), &sizes(), 0.002);
}

/// Images of colours, normals, roughness and metal, and of a lamp.
#[test]
fn textures_at_all_sizes() {
    check_similar("textures", &scenes::textured(), &sizes(), 0.002);
}

/// A small ball of glass close above the floor, under a lamp and a pane, all seen through another.
fn caustics(light: impl Fn(&mut Builder)) -> Builder {
    let mut b = Builder::default();
    let (white, glass) = (b.diffuse(0.6), b.glass(1.5, 0.0));
    b.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, white);
    b.sphere(DVec3::new(0.0, 0.0625, 0.0), 0.06, glass);
    b.mesh(icosphere(0.0625, 3, true), glass, DAffine3::from_translation(DVec3::new(0.25, 0.125, 0.0)));
    for y in [0.5, 0.53125] {
        // Up the upper side, down the lower.
        let (u, v) = if y > 0.51 { (Vec3::Z, Vec3::X) } else { (Vec3::X, Vec3::Z) };
        b.quad(Vec3::new(-1.0, y, -1.0), u * 2.0, v * 2.0, glass);
    }
    light(&mut b);
    b.perspective([0.0, 0.75, 0.75], [0.125, 0.0, 0.0], 0.5);
    b
}

/// Without searches: what they find counts by how long it takes, which no rounding leaves as it was.
fn connected(integrator: Integrator) -> Settings {
    let caustic_options = CausticOptions { search: Some(0.0), ..CausticOptions::default() };
    Settings {
        caustic_options,
        max_depth: 8,
        caustics: Caustics::On,
        caustics_only: true,
        ..settings(integrator, 32, 16, 0)
    }
}

fn under_a_small_lamp() -> Builder {
    caustics(|b| {
        let lamp = b.lamp(60.0);
        b.quad(Vec3::new(-0.25, 1.0, -0.125), Vec3::X * 0.25, Vec3::Z * 0.25, lamp);
    })
}

fn under_a_point_light() -> Builder {
    let light = LightKind::Point { position: DVec3::new(-0.25, 1.0, 0.0), intensity: Rgb::ONE };
    caustics(|b| b.light(light))
}

#[test]
fn caustics_at_all_sizes() {
    for (name, b) in [("lamp", under_a_small_lamp()), ("point light", under_a_point_light())] {
        let bases = [Integrator::Mnee, Integrator::Bdpt].map(connected);
        check_all_similar(&format!("caustics, {name}"), &b, &sizes(), &bases, 0.002);
    }
}

#[test]
fn caustics_at_the_rim_of_a_large_scene() {
    // Something far away keeps the scene from being moved to the origin. Of the point light, the light image alone finds
    // what glass reflects on the way: too few bright points for a comparison.
    let (mnee, bdpt) = (connected(Integrator::Mnee), connected(Integrator::Bdpt));
    for (name, b, bases) in
        [("lamp", under_a_small_lamp(), vec![mnee.clone(), bdpt]), ("point light", under_a_point_light(), vec![mnee])]
    {
        let plain = on_grid(b.0.clone());
        let mut far = Builder(similar(&plain, 1.0, DVec3::X * 512.0));
        let black = far.diffuse(0.0);
        far.quad(Vec3::new(-512.0, 0.0, 0.0), Vec3::X, Vec3::Y, black);
        let name = format!("caustics at the rim, {name}");
        check_same(&plain, &[(name, far.0)], &bases, 0.002);
    }
}

/// A rectangle from `corner`, cut along its first edge into needles of a width of 1e-5 and less beside
/// wide strips, with triangles that have no area or are given twice over as points and lines.
fn needles(corner: Vec3, e1: Vec3, e2: Vec3) -> MeshDescription {
    let cuts = [0.0, 1e-7, 2e-6, 0.25, 0.25 + 1e-6, 0.25 + 1e-5, 0.5, 0.5 + 3e-7, 0.9, 1.0];
    let mut mesh = MeshDescription { name: "needles".to_owned(), ..Default::default() };
    for cut in cuts {
        mesh.positions.push((corner + e1 * cut).to_array());
        mesh.positions.push((corner + e1 * cut + e2).to_array());
    }
    for i in 0..cuts.len() as u32 - 1 {
        let (a, b, c, d) = (2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1);
        mesh.triangles.extend([[a, b, c], [a, c, d], [a, a, c], [b, b, b]]);
    }
    // Three points of one edge.
    mesh.triangles.push([0, 6, 18]);
    mesh
}

/// The stage and a lamp of whole rectangles, or of needles.
fn cut(into_needles: bool) -> Builder {
    let mut b = Builder::default();
    let rectangles = [
        (Vec3::new(-1.75, 0.0, -1.5), Vec3::Z * 3.0, Vec3::X * 3.5, 0.6, 0.0),
        (Vec3::new(-1.5, 0.25, -2.0), Vec3::X * 3.0, Vec3::Y * 1.5, 0.4, 0.0),
        (Vec3::new(-1.25, 2.5, -1.0), Vec3::X * 2.5, Vec3::Z * 2.0, 0.25, 2.0),
    ];
    for (corner, e1, e2, albedo, emission) in rectangles {
        let material = b.emitter(Scattering::Diffuse { reflectance: Rgb::splat(albedo) }, Rgb::splat(emission));
        if into_needles {
            b.mesh(needles(corner, e1, e2), material, DAffine3::IDENTITY);
        } else {
            b.quad(corner, e1, e2, material);
        }
    }
    let ball = b.diffuse(0.8);
    b.sphere(DVec3::new(-0.5, 0.875, 0.0), 0.5, ball);
    b.perspective([0.375, 1.75, 4.25], [0.0, 0.7, 0.0], 0.62);
    b
}

#[test]
fn needles_and_flat_triangles() {
    let (whole, cut) = (cut(false).commit(), cut(true).commit());
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        let name = format!("needles, {integrator:?}");
        let seed = first_seed(&name);
        let base = Settings { max_depth: 7, ..settings(integrator, 32, 192, 0) };
        let [a, b] = [&cut, &whole].map(|world| renders(world, &base, seed..seed + 16));
        check_pairs(&name, &a, &b, BLOCK, BIAS_LIMIT).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// A sun a third of a degree over the floor, and a lamp that stands on end beside it.
#[test]
fn grazing_lights() {
    let mut b = Builder::default();
    scenes::stage(&mut b);
    let ball = b.glass(1.5, 0.5);
    b.mesh(icosphere(0.4, 1, true), ball, DAffine3::from_translation(DVec3::new(0.3, 0.6, 0.0)));
    b.light(LightKind::Directional { direction: DVec3::new(1.0, -0.006, -0.2), irradiance: Rgb::splat(5.0) });
    let lamp = b.lamp(4.0);
    b.quad(Vec3::new(-2.0, 0.0, 1.0), Vec3::NEG_Z * 2.0, Vec3::Y * 0.75, lamp);
    b.perspective([0.375, 1.75, 4.25], [0.0, 0.5, 0.0], 0.62);
    let world = b.commit();
    let seed = first_seed("grazing");
    let [path, bdpt] = [Integrator::Path, Integrator::Bdpt].map(|integrator| {
        let base = Settings { max_depth: 7, ..settings(integrator, 32, 384, 0) };
        renders(&world, &base, seed..seed + 16)
    });
    check_pairs("grazing", &bdpt, &path, BLOCK, BIAS_LIMIT).unwrap_or_else(|e| panic!("{e}"));
}

/// A camera and a light that stand on the floor, in its plane exactly: the floor is not in the way of what is above it.
#[test]
fn a_camera_and_a_light_in_the_plane_of_the_floor() {
    let seed = first_seed("in plane");
    for turn in [DQuat::IDENTITY, DQuat::from_rotation_z(0.3)] {
        let turned = |p: Vec3| (turn * p.as_dvec3()).as_vec3();
        let mut b = Builder::default();
        let (white, lamp) = (b.diffuse(0.6), b.lamp(2.0));
        for (corner, u, v, material) in [
            (Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white),
            (Vec3::new(-1.5, 0.25, -2.0), Vec3::X * 3.0, Vec3::Y * 1.5, white),
            (Vec3::new(-1.0, 2.5, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, lamp),
        ] {
            b.quad(turned(corner), turned(u), turned(v), material);
        }
        let place = |p: Vec3| turned(p).to_array().map(f64::from);
        let position = DVec3::from(place(Vec3::new(0.3, 0.0, 0.2)));
        b.light(LightKind::Point { position, intensity: Rgb::splat(1.0) });
        b.perspective(place(Vec3::Z), place(Vec3::new(0.0, 0.5, -1.0)), 0.6);
        let world = b.commit();
        let [path, bdpt] = [Integrator::Path, Integrator::Bdpt].map(|integrator| {
            let base = Settings { max_depth: 6, ..settings(integrator, 32, 128, 0) };
            renders(&world, &base, seed..seed + 16)
        });
        // Turned, rounding puts light and camera on either side of the floor: which, it says alone.
        if turn == DQuat::IDENTITY {
            check_pairs("in plane", &bdpt, &path, BLOCK, BIAS_LIMIT).unwrap_or_else(|e| panic!("{e}"));
        }
        common::run(&world, &settings(Integrator::Light, 32, 64, 0));
    }
}

/// Glass of index 1 + 1e-6, smooth or rough, is not there. (Flat: a shading normal makes a surface dark
/// where it disagrees with the geometric one, whatever the index.)
#[test]
fn glass_of_index_one() {
    let lit = |index: Option<(f32, f32)>| {
        let mut b = Builder::default();
        scenes::stage(&mut b);
        if let Some((ior, roughness)) = index {
            let glass = b.glass(ior, roughness);
            b.sphere(DVec3::new(-0.5, 0.75, 0.0), 0.5, glass);
            b.mesh(icosphere(0.5, 1, false), glass, DAffine3::from_translation(DVec3::new(0.75, 0.75, 0.25)));
        }
        b.0.environment = Rgb::splat(0.5).into();
        let lamp = b.lamp(1.0);
        b.quad(Vec3::new(-2.5, 2.5, -2.0), Vec3::X * 5.0, Vec3::Z * 4.5, lamp);
        b.perspective([0.375, 1.75, 4.25], [0.0, 0.7, 0.0], 0.62);
        b.commit()
    };
    // Long enough that the segments in glass cut nothing off.
    let base = |integrator| Settings { max_depth: 24, ..settings(integrator, 32, 64, 0) };
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        let seed = first_seed("index one");
        let none = renders(&lit(None), &base(integrator), seed..seed + 16);
        for (ior, roughness) in [(1.0, 0.0), (1.000001, 0.0), (1.000001, 0.5)] {
            let with = renders(&lit(Some((ior, roughness))), &base(integrator), seed..seed + 16);
            let name = format!("index {ior}, roughness {roughness}, {integrator:?}");
            check_pairs(&name, &with, &none, BLOCK, BIAS_LIMIT).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

/// A camera in one end of a glass bar, a lamp across the other: whatever the way, by total reflection
/// off the sides, each pixel is the lamp's radiance.
#[test]
fn total_reflection_loses_nothing() {
    let mut b = Builder::default();
    let glass = b.glass(1.5, 0.0);
    b.cuboid(Vec3::new(-0.25, -0.25, -4.0), Vec3::new(0.25, 0.25, 0.5), false, glass);
    let lamp = b.lamp(2.0);
    b.quad(Vec3::new(-0.5, -0.5, -3.5), Vec3::X, Vec3::Y, lamp);
    b.perspective([0.01, 0.02, 0.25], [0.0, 0.0, -1.0], 1.2);
    let world = b.commit();
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        let settings = Settings { max_depth: 40, ..settings(integrator, 32, 16, 5) };
        let image = common::run(&world, &settings).image;
        for (i, pixel) in image.pixels.iter().enumerate() {
            assert!((luminance(*pixel) - 2.0).abs() < 1e-5, "{integrator:?}: pixel {i} is {pixel}");
        }
    }
}

#[test]
fn what_no_ray_tracer_holds_is_refused_before_it_is_made() {
    let commit = |d: &Description| World::commit(d, CommitOptions::default()).err();
    let sphere = |radius, scale| {
        let mut b = Builder::default();
        let glass = b.glass(1.5, 0.0);
        b.sphere(DVec3::ZERO, radius, glass);
        b.0.instances[0].transform = DAffine3::from_scale(DVec3::splat(scale));
        b.0
    };
    assert!(commit(&sphere(1e-10, 1.0)).is_none());
    for (radius, scale) in [(1e-46, 1.0), (1.0, 1e40), (1e17, 100.0)] {
        let error = commit(&sphere(radius, scale));
        let named = matches!(&error, Some(SceneError::Invalid { kind: "instance", index: 0, .. }));
        assert!(named, "radius {radius:e}, scale {scale:e}: {error:?}");
    }

    let sky = |radiance: f32, rotation| {
        let environment = Environment { radiance: Rgb::splat(radiance), rotation, ..scenes::sky() };
        Description { environment, ..sphere(1.0, 1.0) }
    };
    assert!(commit(&sky(1e36, DMat3::from_rotation_z(2.0))).is_none());
    for (radiance, rotation) in [(2e37, DMat3::IDENTITY), (1.0, -DMat3::IDENTITY), (1.0, DMat3::IDENTITY * 1.001)] {
        let error = commit(&sky(radiance, rotation));
        let named = matches!(&error, Some(SceneError::Invalid { kind: "environment", .. }));
        assert!(named, "radiance {radiance:e}, rotation {rotation}: {error:?}");
    }

    // A forest of which one tree fits into memory.
    let mut b = Builder::default();
    let white = b.diffuse(0.5);
    b.mesh(icosphere(0.5, 4, true), white, DAffine3::IDENTITY);
    let triangles = b.0.meshes[0].triangles.len();
    b.0.instances = vec![b.0.instances[0].clone(); (1 << 30) / triangles + 1];
    let error = commit(&b.0);
    assert!(matches!(error, Some(SceneError::TooLarge(_))), "{error:?}");
}

#[test]
fn what_files_say_at_the_edge_of_what_is_allowed_is_taken() {
    let mut b = scenes::delta_lights();
    // pi/2 in single precision is a little more than that.
    let outer = f64::from(std::f32::consts::FRAC_PI_2);
    let (position, direction) = (DVec3::new(0.5, 1.5, 0.5), DVec3::NEG_Y);
    b.light(LightKind::Spot { position, direction, intensity: Rgb::ONE, inner: 0.5, outer });
    let glossy = |ior, transmission| {
        Scattering::MetallicRoughness(MetallicRoughness {
            base_color: Rgb::splat(0.5),
            metallic: 0.0,
            roughness: 0.5,
            ior,
            specular: 1.0,
            specular_color: Rgb::splat(0.04),
            transmission,
            solid: true,
            ..MetallicRoughness::default()
        })
    };
    for (i, ior) in [0.0, 1000.0, f32::MAX].into_iter().enumerate() {
        let material = b.material(glossy(ior, 0.0));
        b.mesh(icosphere(0.1, 2, true), material, DAffine3::from_translation(DVec3::new(0.3 * i as f64, 0.2, 0.0)));
    }
    let image = &renders(&b.commit(), &settings(Integrator::Bdpt, 16, 8, 0), 0..1)[0];
    assert!(image.pixels.iter().all(|p| p.is_finite()));
    // Where light is refracted there is no such glass.
    let material = b.material(glossy(1000.0, 0.5));
    b.sphere(DVec3::new(0.0, 0.2, 0.0), 0.1, material);
    let error = World::commit(&b.0, CommitOptions::default()).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("ior is 1000"), "{error}");
}

/// A ball of glass as modellers write it, by longitude and latitude: its poles are rings of vertices 1e-16 apart.
fn globe(columns: u32, rows: u32) -> MeshDescription {
    let at = |row: u32, column: u32| {
        let (theta, phi) = (PI * f64::from(row) / f64::from(rows), 2.0 * PI * f64::from(column) / f64::from(columns));
        [-phi.cos() * theta.sin(), theta.cos(), phi.sin() * theta.sin()].map(|x| x as f32)
    };
    let corner = |row, column| row * (columns + 1) + column;
    let cell = |row, column| {
        let [a, b, c, d] =
            [(row, column + 1), (row, column), (row + 1, column), (row + 1, column + 1)].map(|(r, c)| corner(r, c));
        [(row > 0).then_some([a, b, d]), (row + 1 < rows).then_some([b, c, d])]
    };
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    MeshDescription {
        name: "globe".to_owned(),
        positions: (0..=rows).flat_map(|row| (0..=columns).map(move |column| at(row, column))).collect(),
        triangles: cells.flat_map(|(row, column)| cell(row, column)).flatten().collect(),
        ..MeshDescription::default()
    }
}

#[test]
fn what_is_below_a_pole_is_not_within_glass() {
    for (columns, rows) in [(24, 16), (32, 32), (64, 32), (64, 64), (128, 64)] {
        let mut b = Builder::default();
        let glass = b.glass(1.5, 0.0);
        b.mesh(globe(columns, rows), glass, DAffine3::IDENTITY);
        b.perspective([0.0, -3.0, 0.0], [0.0, -4.0, 0.1], 0.5);
        let world = b.commit();
        let [below, within] = [-3.0, 0.0].map(|y| world.medium_at(Vec3::new(0.0, y, 0.0)));
        assert_eq!(world.media[below as usize].ior, 1.0, "{columns}x{rows}");
        assert_eq!(world.media[within as usize].ior, 1.5, "{columns}x{rows}");
    }
}

/// A ball half in glass, and a luminous table with a block on it that no corner and no middle of its triangles touch.
#[test]
fn a_lamp_knows_its_medium_at_each_point() {
    let mut b = Builder::default();
    let (glass, lamp) = (b.glass(1.5, 0.0), b.lamp(1.0));
    b.cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false, glass);
    let ball = b.0.instances.len();
    b.sphere(DVec3::new(0.0, 1.0, 0.0), 0.25, lamp);
    b.cuboid(Vec3::new(9.6, -0.1, 0.3), Vec3::new(9.8, 0.5, 0.5), false, glass);
    let table = b.0.instances.len();
    b.quad(Vec3::new(9.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, lamp);
    b.perspective([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 0.5);
    let world = b.commit();
    let at = |shape: usize, p: Vec3| {
        let ray = |toward: Vec3| Ray { origin: p + toward * 0.05, direction: -toward, t_max: 0.1 };
        let toward = if shape == ball { (p - Vec3::Y).normalize() } else { Vec3::Y };
        let hit = world.intersector.closest(&ray(toward)).expect("a point of the lamp");
        assert_eq!(hit.shape as usize, shape);
        let light = world.lights.of_shape(hit.shape).expect("a light");
        let at = world.shapes[shape].surface(&ray(toward), &hit);
        let medium = world.medium_of_light(light, &Endpoint::Surface(at), false);
        world.media[medium as usize].ior
    };
    assert_eq!(at(ball, Vec3::new(0.0, 0.75, 0.0)), 1.5);
    assert_eq!(at(ball, Vec3::new(0.0, 1.25, 0.0)), 1.0);
    assert_eq!(at(table, Vec3::new(9.7, 0.0, 0.4)), 1.5);
    assert_eq!(at(table, Vec3::new(9.3, 0.0, 0.4)), 1.0);
}

#[test]
fn glass_that_is_inside_out_is_told() {
    for inward in [false, true] {
        let mut b = Builder::default();
        let (glass, lamp) = (b.glass(1.5, 0.0), b.lamp(1.0));
        let turned = |mesh: MeshDescription| MeshDescription {
            triangles: mesh.triangles.iter().map(|&[a, b, c]| if inward { [a, c, b] } else { [a, b, c] }).collect(),
            ..mesh
        };
        let at = |x: f64, size: DVec3| {
            DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, DVec3::new(x, 0.0, 0.0))
        };
        b.mesh(turned(globe(12, 8)), glass, at(1000.0, DVec3::ONE));
        b.mesh(turned(globe(12, 8)), glass, at(0.0, DVec3::new(1.0, 1.0, 1e-3)));
        // Mirrored, its front stays in front.
        b.mesh(turned(globe(12, 8)), glass, at(4.0, DVec3::new(-1.0, 1.0, 1.0)));
        // No glass, or open.
        b.mesh(turned(globe(12, 8)), lamp, at(8.0, DVec3::ONE));
        let half = globe(12, 8);
        let below = |t: &[u32; 3]| t.iter().all(|&v| half.positions[v as usize][1] < 0.1);
        let triangles = half.triangles.iter().copied().filter(below).collect();
        b.mesh(turned(MeshDescription { triangles, ..half.clone() }), glass, at(12.0, DVec3::ONE));
        b.perspective([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 0.5);
        let warnings = b.commit().warnings;
        let told = warnings.iter().filter(|w| w.text.contains("face inward")).count();
        assert_eq!(told, if inward { 3 } else { 0 }, "{warnings:#?}");
    }
}

/// Glass whose writer forgot that it is solid, and a medium that nothing closes.
#[test]
fn glass_that_may_be_meant_otherwise_is_told() {
    let told = |material: Scattering, open: bool| {
        let mut b = Builder::default();
        let glass = b.material(material);
        let ball = icosphere(0.5, 1, false);
        let triangles = if open { ball.triangles[1..].to_vec() } else { ball.triangles.clone() };
        b.mesh(MeshDescription { triangles, ..ball }, glass, DAffine3::IDENTITY);
        b.0.environment = Rgb::ONE.into();
        b.commit().warnings.into_iter().map(|w| w.text).collect::<Vec<_>>()
    };
    let gltf = |solid: bool, absorption: f32| {
        Scattering::MetallicRoughness(MetallicRoughness {
            transmission: 1.0,
            metallic: 0.0,
            solid,
            absorption: Rgb::splat(absorption),
            ..MetallicRoughness::default()
        })
    };
    let thin = told(gltf(false, 0.0), false);
    assert!(thin.len() == 1 && thin[0].contains("as a thin wall does"), "{thin:?}");
    assert!(told(gltf(false, 0.0), true).is_empty() && told(gltf(true, 3.0), false).is_empty());
    let open = told(gltf(true, 3.0), true);
    assert!(open.len() == 1 && open[0].contains("absorbs"), "{open:?}");
    assert!(told(gltf(true, 0.0), true).is_empty());
    // Who asks for a thin dielectric has it.
    let film = Scattering::ThinDielectric { ior: 1.3, roughness: 0.0, tint: Rgb::ONE };
    assert!(told(film, false).is_empty());
}

#[test]
fn warnings_stand_once() {
    let mut b = Builder::default();
    let lamp = b.lamp(1.0);
    let square = |y: f32, side: f32| [[0.0, y, 0.0], [0.0, y, side], [side, y, side], [side, y, 0.0]];
    let of = |squares: &[(f32, f32)]| MeshDescription {
        name: "lamps".to_owned(),
        positions: squares.iter().flat_map(|&(y, side)| square(y, side)).collect(),
        triangles: (0..squares.len() as u32)
            .flat_map(|i| [[0, 1, 2], [0, 2, 3], [0, 0, 1]].map(|t| t.map(|v| 4 * i + v)))
            .collect(),
        ..MeshDescription::default()
    };
    b.mesh(of(&[(0.5, 0.2), (2.0, 0.1)]), lamp, DAffine3::IDENTITY);
    b.mesh(of(&[(0.5, 0.2)]), lamp, DAffine3::IDENTITY);
    let last = b.0.instances.last().expect("a lamp").clone();
    b.0.instances.push(last);
    b.perspective([0.0, 3.0, 3.0], [0.0, 0.0, 0.0], 0.5);
    let warnings = b.commit().warnings;
    let about = |what: &str| warnings.iter().filter(|w| w.text.contains(what)).count();
    assert_eq!(about("triangles without area"), 2, "{warnings:#?}");
}

/// A small block a gap of 1 mm above a ground of 600 m. In two triangles it gives the picture of a ground with small
/// triangles in the middle: level to the last bits; else rays start above it by almost half of the gap, which may show
/// beside the block, and not in what light goes through it.
#[test]
fn large_triangles_below_small_things() {
    const FAR: f32 = 300.0;
    let scene = |middle: Option<f32>, tilt: DQuat| {
        let mut b = Builder::default();
        let ground = b.diffuse(0.6);
        let square = |half: f32| [[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]];
        let mut mesh = MeshDescription { triangles: vec![[0, 1, 2], [0, 2, 3]], ..MeshDescription::default() };
        mesh.positions = square(middle.unwrap_or(FAR)).to_vec();
        if middle.is_some() {
            mesh.positions.extend(square(FAR));
            mesh.triangles.extend((0..4).flat_map(|i| {
                let next = (i + 1) % 4;
                [[i, 4 + i, 4 + next], [i, 4 + next, next]]
            }));
        }
        b.mesh(mesh, ground, DAffine3::IDENTITY);
        let glass = b.glass(1.5, 0.0);
        b.cuboid(Vec3::new(-0.03, 0.001, -0.03), Vec3::new(0.03, 0.041, 0.03), false, glass);
        let lamp = b.lamp(3.0);
        b.quad(Vec3::new(-0.05, 0.3, -0.05), Vec3::X * 0.1, Vec3::Z * 0.1, lamp);
        b.perspective([0.1, 0.15, 0.2], [0.0, 0.01, 0.0], 0.5);
        let tilt = DAffine3::from_quat(tilt);
        b.0.instances.iter_mut().for_each(|i| i.transform = tilt * i.transform);
        b.0.cameras.iter_mut().for_each(|c| c.transform = tilt * c.transform);
        b.commit()
    };
    let tilts = [("level", DQuat::IDENTITY), ("tilted", DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.47))];
    for (name, tilt) in tilts {
        let [large, small] = [None, Some(0.2)].map(|middle| scene(middle, tilt));
        for integrator in [Integrator::Path, Integrator::Bdpt, Integrator::Mnee] {
            let base = Settings { max_depth: 7, caustics: Caustics::Off, ..settings(integrator, 32, 32, 0) };
            let seed = first_seed(name);
            let [large, small] = [&large, &small].map(|world| renders(world, &base, seed..seed + RUNS));
            let about = format!("{name}, {integrator:?}");
            let checked = if name == "level" {
                check_pairs(&about, &large, &small, BLOCK, 1e-4)
            } else {
                let mean = |image| block_means(image, 32)[0];
                let ratios: Vec<_> = large.iter().zip(&small).map(|(l, s)| mean(l) / mean(s) - 1.0).collect();
                let (difference, error) = mean_and_error(&ratios);
                check_bias(&about, difference, error, RUNS as f64 - 1.0, 0.005)
            };
            checked.unwrap_or_else(|e| panic!("{e}"));
        }
    }
}
