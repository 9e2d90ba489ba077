//! The render job: the same bits for any number of threads and any order of work, cancel, progress,
//! time limit, settings that cannot be.

mod common;

use caustica::camera::Region;
use caustica::intersect::{Backend, Build};
use caustica::math::{Rgb, luminance};
use caustica::render::preview::Preview;
use caustica::render::{
    Cancel, Caustics, Image, Integrator, LEAST_PASSES, MOST_BY_NOISE, Plane, Progress, RenderError, Settings,
    TechniqueImages, render, render_shown,
};
use caustica::scene::description::{Camera, Geometry, LightKind, Projection, Scattering};
use caustica::scene::{CommitOptions, World};
use common::{Builder, settings};
use glam::{DAffine3, DVec3, Vec3};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

fn scene() -> Builder {
    let mut b = Builder::default();
    let white = b.diffuse(0.7);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.0, 0.6, 0.0), 0.5, glass);
    let lamp = b.lamp(10.0);
    b.quad(Vec3::new(-0.3, 2.5, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, lamp);
    b.perspective([0.0, 1.5, 4.0], [0.0, 0.5, 0.0], 0.8);
    b
}

fn world() -> World {
    scene().commit()
}

#[test]
fn a_commit_shares_shapes_and_ray_tracer_where_these_stay() {
    type Edit = fn(&mut Builder);
    let stay: &[(&str, Edit)] = &[
        ("camera", |b| b.0.cameras[0].transform.translation.x += 0.3),
        ("material", |b| b.0.materials[1] = b.0.materials[0].clone()),
        ("its choice", |b| b.0.instances[0].material = 1),
        ("environment", |b| b.0.environment = Rgb::ONE.into()),
        ("image of the environment", |b| b.0.environment = common::scenes::sky()),
    ];
    let go: &[(&str, Edit)] = &[
        ("place", |b| b.0.instances[1].transform.translation.x += 0.125),
        ("radius", |b| b.0.instances[1].geometry = Geometry::Sphere { radius: 0.25 }),
        ("vertex", |b| Arc::make_mut(&mut b.0.meshes[0]).positions[0][1] = 0.25),
        ("one less", |b| _ = b.0.instances.pop()),
    ];
    let image = |world: &World| common::run(world, &settings(Integrator::Bdpt, 24, 4, 3)).image;
    for (shares, edits) in [(true, stay), (false, go)] {
        for (what, edit) in edits {
            let mut b = scene();
            let before = b.commit();
            edit(&mut b);
            let after = World::commit_after(Some(&before), &b.0, CommitOptions::default()).expect("a scene");
            assert_eq!(Arc::ptr_eq(&before.shapes, &after.shapes), shares, "{what}");
            assert_eq!(Arc::ptr_eq(&before.intersector, &after.intersector), shares, "{what}");
            let fresh = b.commit();
            assert_eq!(image(&after), image(&fresh), "{what}");
            assert_eq!((after.hash(), &after.warnings), (fresh.hash(), &fresh.warnings), "{what}");
            assert_ne!(after.hash(), before.hash(), "{what}");
        }
    }
    let before = world();
    let obvhs = CommitOptions { backend: Backend::Obvhs, ..CommitOptions::default() };
    let after = World::commit_after(Some(&before), &scene().0, obvhs).expect("a scene");
    assert_eq!(Arc::ptr_eq(&before.intersector, &after.intersector), Backend::default() == Backend::Obvhs);
}

/// What is built for edits shows the same, whatever the way to it.
#[test]
fn an_editable_commit_is_the_commit_of_what_is_there() {
    let mut b = scene();
    let white = b.diffuse(0.5);
    b.mesh(common::icosphere(0.4, 4, true), white, DAffine3::from_translation(DVec3::new(-0.7, 0.4, 0.3)));
    let moved = b.0.instances.len() - 1;
    let options = CommitOptions { build: Build::Editable, ..CommitOptions::default() };
    let image = |world: &World| common::run(world, &settings(Integrator::Bdpt, 24, 4, 3)).image;
    let before = b.commit();
    let mut editable = World::commit_after(Some(&before), &b.0, options).expect("a scene");
    assert!(Arc::ptr_eq(&before.shapes, &editable.shapes) && !Arc::ptr_eq(&before.intersector, &editable.intersector));
    for (what, edit) in [1, 1, moved].into_iter().enumerate() {
        b.0.instances[edit].transform.translation.x += 0.125;
        editable = World::commit_after(Some(&editable), &b.0, options).expect("a scene");
        let fresh = World::commit(&b.0, options).expect("a scene");
        assert!(image(&editable) == image(&fresh), "edit {what}");
        // Where a ray meets an edge, either triangle may count.
        let (found, plain) = (image(&editable), image(&b.commit()));
        let same = found.pixels.iter().zip(&plain.pixels).filter(|(a, b)| a == b).count();
        assert!(same * 100 > found.pixels.len() * 95, "edit {what}: {same} pixels are the same");
    }
}

/// The media around lights are taken from the commit before only where they are the same.
#[test]
fn a_commit_knows_the_media_around_lights_anew() {
    type Edit = fn(&mut Builder);
    let point = |y: f64| LightKind::Point { position: DVec3::new(0.0, y, 0.2), intensity: Rgb::ONE };
    let edits: [(&str, Edit); 5] = [
        ("index", |b| {
            let other = b.glass(1.33, 0.0);
            b.0.materials[1] = b.0.materials[other].clone();
        }),
        ("no glass", |b| b.0.materials[1] = b.0.materials[0].clone()),
        ("the other lamp", |b| (b.0.instances[2].material, b.0.instances[3].material) = (0, 2)),
        ("a light moves out", |b| {
            b.0.lights[0].kind = LightKind::Point { position: DVec3::Y * 2.0, intensity: Rgb::ONE }
        }),
        ("camera", |b| b.0.cameras[0].transform.translation.x += 0.3),
    ];
    for (what, edit) in edits {
        let mut b = scene();
        let (white, murky) = (0, b.absorbing(1.5, Rgb::splat(2.0)));
        b.0.materials[1] = b.0.materials[murky].clone();
        b.quad(Vec3::new(-0.1, 0.6, -0.1), Vec3::X * 0.2, Vec3::Z * 0.2, white);
        (b.0.instances[2].material, b.0.instances[3].material) = (2, 0);
        b.light(point(0.7));
        let before = b.commit();
        edit(&mut b);
        let after = World::commit_after(Some(&before), &b.0, CommitOptions::default()).expect("a scene");
        let image = |world: &World| common::run(world, &settings(Integrator::Bdpt, 24, 4, 3)).image;
        assert!(Arc::ptr_eq(&before.shapes, &after.shapes), "{what}");
        assert!(image(&after) == image(&b.commit()), "{what}");
    }
}

#[test]
fn what_is_shown_while_it_renders_is_the_image_of_as_many_samples() {
    let world = world();
    // One worker, so that nothing is added while it reports.
    let request = |samples| Settings { threads: 1, ..settings(Integrator::Bdpt, 40, samples, 3) };
    let (cancel, preview, shown) = (Cancel::default(), Preview::default(), Mutex::new(None));
    assert!(preview.image(Plane::Radiance).expect("memory").is_none());
    let progress = |p: Progress| {
        let so_far = preview.image(Plane::Radiance).expect("memory");
        assert_eq!(so_far.as_ref().map_or(0, |(_, samples)| *samples), p.samples);
        if so_far.is_some() {
            *shown.lock().unwrap() = so_far;
            cancel.cancel();
        }
    };
    let whole = render_shown(&world, &request(1 << 20), &cancel, &progress, &preview).expect("a render");
    assert_eq!(preview.image(Plane::Radiance).expect("memory"), Some((whole.image, whole.statistics.samples)));
    preview.close();
    assert!(preview.image(Plane::Radiance).expect("memory").is_none());
    let (image, samples) = shown.lock().unwrap().take().expect("a report with samples");
    assert_eq!(image, common::run(&world, &request(samples)).image);
}

/// Between two calls of a host's callback the render has the time to itself, however long the callback takes. A time
/// from below: a machine that is slow makes it longer.
#[test]
fn a_slow_callback_is_called_no_more_often() {
    let (cancel, ended, pauses) = (Cancel::default(), Mutex::new(None::<Instant>), Mutex::new(Vec::new()));
    let progress = |_: Progress| {
        let mut pauses = pauses.lock().unwrap();
        pauses.extend(ended.lock().unwrap().map(|last| last.elapsed()));
        if pauses.len() >= 4 {
            cancel.cancel();
        }
        std::thread::sleep(Duration::from_millis(110));
        *ended.lock().unwrap() = Some(Instant::now());
    };
    let request = Settings { threads: 2, ..settings(Integrator::Path, 32, 1 << 20, 3) };
    assert!(render(&world(), &request, &cancel, &progress).expect("a render").cancelled);
    let pauses = pauses.into_inner().unwrap();
    assert!(pauses.len() >= 4 && pauses.iter().all(|p| *p >= Duration::from_millis(100)), "{pauses:?}");
}

#[test]
fn images_are_equal_bit_for_bit_for_any_number_of_threads() {
    let world = world();
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        // 70x70 pixels: several tiles, the last one partial.
        let image = |threads| {
            let settings = Settings { threads, ..settings(integrator, 70, 5, 3) };
            common::run(&world, &settings).image
        };
        let one = image(1);
        assert!(one.pixels.iter().any(|p| *p != Rgb::ZERO));
        for threads in [2, 3, 7] {
            assert_eq!(one, image(threads), "{integrator:?} on {threads} threads");
        }
    }
}

#[test]
fn samples_do_not_depend_on_how_many_come_after_them() {
    // The grouping of passes into requests: the sum of 1 and of 3 passes is that of 4, since a pass
    // depends on its number alone; here by the difference of the sums.
    let world = world();
    let sum = |samples: u32| {
        let image = common::run(&world, &settings(Integrator::Bdpt, 32, samples, 9)).image;
        image.pixels.iter().map(|p| p.as_dvec3() * f64::from(samples)).collect::<Vec<_>>()
    };
    let (three, four, five) = (sum(3), sum(4), sum(5));
    let again = sum(4);
    assert_eq!(four, again);
    // Every pass adds light and none takes any away, to the rounding of the averages to f32.
    for i in 0..four.len() {
        let slack = five[i].max_element() * 1e-6;
        assert!((four[i] - three[i]).min_element() >= -slack && (five[i] - four[i]).min_element() >= -slack);
    }
}

#[test]
fn a_region_traced_by_paths_has_the_bits_of_the_whole() {
    let mut b = scene();
    let parallel = Projection::Orthographic { ymag: 1.2 };
    b.camera(DVec3::new(0.0, 1.5, 4.0), DVec3::new(0.0, 0.5, 0.0), parallel);
    let world = b.commit();
    let region = Region { x: 7, y: 29, width: 33, height: 10 };
    for camera in [0, 1] {
        let frame = Settings { width: 51, height: 40, camera, ..settings(Integrator::Path, 0, 3, 5) };
        let [whole, part] = [None, Some(region)]
            .map(|region| common::run(&world, &Settings { region, ..frame.clone() }))
            .map(|output| output.image);
        assert_eq!((part.width, part.height), (33, 10));
        for (y, row) in part.pixels.chunks_exact(33).enumerate() {
            let start = (29 + y) * 51 + 7;
            assert_eq!(row, &whole.pixels[start..start + 33], "row {y}");
        }
    }
}

#[test]
fn renders_of_successive_samples_average_to_that_of_all() {
    let world = world();
    let sum = |first_sample: u32, samples: u32| {
        let image = common::run(&world, &Settings { first_sample, ..settings(Integrator::Bdpt, 32, samples, 9) }).image;
        image.pixels.into_iter().map(move |p| p.as_dvec3() * f64::from(samples))
    };
    for ((a, b), all) in sum(0, 3).zip(sum(3, 5)).zip(sum(0, 8)) {
        assert!((a + b - all).abs().max_element() <= 1e-6 * all.max_element(), "{a} and {b}, {all}");
    }
}

/// A view has the picture of a camera of the scene, also where all lies so far away that the scene is moved.
#[test]
fn a_view_is_as_good_as_a_camera() {
    for far in [0.0, 1e5] {
        let mut b = scene();
        let away = DVec3::new(far, 0.0, far);
        b.0.instances.iter_mut().for_each(|i| i.transform.translation += away);
        b.0.cameras[0].transform.translation += away;
        let world = b.commit();
        let camera = b.0.cameras.remove(0);
        let expected = common::run(&world, &settings(Integrator::Bdpt, 24, 2, 5)).image;
        let view = Some(camera.clone());
        let settings = Settings { view, camera: 9, ..settings(Integrator::Bdpt, 24, 2, 5) };
        let same = |world: &World| common::run(world, &settings).image == expected;
        assert!(same(&world) && same(&b.commit()), "{far}");
        let projection = Projection::Perspective { yfov: f64::NAN };
        let wrong = Settings { view: Some(Camera { projection, ..camera }), ..settings.clone() };
        let error = render(&world, &wrong, &Cancel::default(), &|_| ()).expect_err("no view").to_string();
        assert!(error.contains("yfov is NaN"), "{error}");
    }
}

/// What is left out of a transparent picture is the sky's share, whatever else is asked for.
#[test]
fn what_is_transparent_lacks_the_sky() {
    let sky = Rgb::new(0.5, 0.25, 2.0);
    let mut b = scene();
    b.0.environment = sky.into();
    let (glass, ball) = (b.glass(1.5, 0.0), DVec3::new(0.4, 0.6, 0.2));
    b.sphere(ball, 0.5, glass);
    b.0.cameras.clear();
    b.perspective([0.0, 1.2, 6.0], [0.0, 0.8, 0.0], 0.9);
    let world = b.commit();
    for (integrator, caustics, caustics_only, per_technique) in [
        (Integrator::Path, Caustics::Off, false, false),
        (Integrator::Path, Caustics::Off, true, false),
        (Integrator::Mnee, Caustics::On, false, false),
        (Integrator::Bdpt, Caustics::Off, false, false),
        (Integrator::Bdpt, Caustics::On, false, true),
        (Integrator::Bdpt, Caustics::On, true, false),
    ] {
        let settings =
            Settings { caustics, caustics_only, per_technique, features: true, ..settings(integrator, 32, 4, 3) };
        let [opaque, through] =
            [false, true].map(|transparent| common::run(&world, &Settings { transparent, ..settings.clone() }));
        assert!(opaque.image.alpha.is_empty());
        let albedo = &through.plane(Plane::Albedo).expect("it was asked for").pixels;
        assert!(albedo.iter().zip(&through.image.alpha).all(|(a, alpha)| (*a == Rgb::ZERO) == (*alpha == 0.0)));
        let behind = if caustics_only { Rgb::ZERO } else { sky };
        let mut seen = [0; 3];
        for ((a, b), &alpha) in opaque.image.pixels.iter().zip(&through.image.pixels).zip(&through.image.alpha) {
            let difference = *a - (*b + behind * (1.0 - alpha));
            assert!(difference.abs().max_element() <= 1e-5 * a.max_element(), "{integrator:?}: {a} {b} {alpha}");
            seen[if alpha == 0.0 { 0 } else { 1 + usize::from(alpha == 1.0) }] += 1;
        }
        assert!(seen.iter().all(|n| *n > 20), "{seen:?}");
    }
    let wrong = Settings { transparent: true, ..settings(Integrator::Light, 8, 1, 0) };
    assert!(render(&world, &wrong, &Cancel::default(), &|_| ()).is_err());
}

/// What a limit leaves out of the same samples, it tells; lamps that the camera sees stay as they are.
#[test]
fn clamped_light_and_what_is_left_out_are_all_light() {
    let mut b = scene();
    let seen = b.lamp(10.0);
    b.quad(Vec3::new(-1.6, 0.6, -1.5), Vec3::X, Vec3::Y, seen);
    let world = b.commit();
    let light = |image: &Image| image.pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>();
    for (integrator, caustics, caustics_only, per_technique) in [
        (Integrator::Path, Caustics::Off, false, false),
        (Integrator::Path, Caustics::Off, true, false),
        (Integrator::Light, Caustics::Off, false, false),
        (Integrator::Mnee, Caustics::On, false, false),
        (Integrator::Bdpt, Caustics::Off, false, false),
        (Integrator::Bdpt, Caustics::On, false, true),
        (Integrator::Bdpt, Caustics::On, true, false),
    ] {
        let settings = Settings { caustics, caustics_only, per_technique, ..settings(integrator, 32, 16, 1) };
        let render = |clamp| common::run(&world, &Settings { clamp, ..settings.clone() });
        let (all, far, near) = (render(None), render(Some(1e9)), render(Some(0.2)));
        assert_eq!(far.image, all.image);
        assert_eq!((all.statistics.clamped, far.statistics.clamped), (0.0, 0.0));
        let clamped = f64::from(near.statistics.clamped);
        let name = format!("{integrator:?}, {caustics:?}, caustics only {caustics_only}");
        assert!(clamped > 0.01 && clamped < 0.99, "{name}: {clamped}");
        let error = light(&near.image) / (light(&all.image) * (1.0 - clamped)) - 1.0;
        assert!(error.abs() < 1e-5, "{name}: {error}");
        for (i, pixel) in near.image.pixels.iter().enumerate().filter(|_| per_technique) {
            let sum: Rgb = near.techniques.values().map(|t| t.weighted.pixels[i]).sum();
            assert!((sum - *pixel).abs().max_element() <= 1e-5 * pixel.max_element().max(1e-3), "pixel {i}");
        }
        // The lamp that is seen, of radiance 10.
        let brightest = |image: &Image| image.pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max);
        assert!(caustics_only || brightest(&near.image) >= 10.0);
    }
}

/// Lamps in a mirror and behind smooth glass are seen like lamps before all; behind frosted glass, whether walks lead
/// through it or not, chance finds them.
#[test]
fn lamps_that_are_seen_are_not_clamped() {
    for frosted in [false, true] {
        let mut b = Builder::default();
        let lamp = b.lamp(10.0);
        let glass = if frosted { b.walked_glass(1.5, 0.1) } else { b.glass(1.5, 0.0) };
        let mirror =
            b.material(Scattering::Conductor { reflectance: Rgb::ONE, roughness: if frosted { 0.1 } else { 0.0 } });
        // One lamp behind a plate, to the left, and one behind the camera, in a mirror to the right.
        b.quad(Vec3::new(-1.5, -1.0, -2.0), Vec3::X, Vec3::Y * 2.0, lamp);
        b.cuboid(Vec3::new(-2.0, -2.0, -1.0), Vec3::new(-0.1, 2.0, -0.5), false, glass);
        b.quad(Vec3::new(0.1, -1.0, -1.0), Vec3::X, Vec3::Y * 2.0, mirror);
        b.quad(Vec3::new(-1.0, -2.0, 5.0), Vec3::Y * 4.0, Vec3::X * 4.0, lamp);
        b.perspective([0.0, 0.0, 3.0], [0.0, 0.0, 0.0], 0.8);
        let world = b.commit();
        for (integrator, caustics) in
            [(Integrator::Path, Caustics::Off), (Integrator::Bdpt, Caustics::Off), (Integrator::Bdpt, Caustics::On)]
        {
            // Three segments lead through the plate to the lamp.
            let settings = Settings { caustics, max_depth: 3, ..settings(integrator, 24, 16, 1) };
            let brightest = |clamp: f32| {
                let clamp = Some(clamp);
                let image = common::run(&world, &Settings { clamp, ..settings.clone() }).image;
                image.pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max)
            };
            let (all, near) = (brightest(1e9), brightest(1.0));
            assert!(all > 4.0, "{integrator:?}, {caustics:?}: {all}");
            // By next-event estimation and by a hit at most.
            assert!(if frosted { near <= 2.0 } else { near == all }, "{integrator:?}, {caustics:?}: {near} of {all}");
        }
    }
}

#[test]
fn other_seeds_give_other_images() {
    let world = world();
    let image = |seed| common::run(&world, &settings(Integrator::Bdpt, 32, 2, seed)).image;
    assert_ne!(image(1), image(2));
}

#[test]
fn the_technique_images_sum_to_the_image() {
    let world = world();
    let settings = Settings { per_technique: true, ..settings(Integrator::Bdpt, 32, 4, 1) };
    let output = common::run(&world, &settings);
    assert!(output.techniques.len() > 10, "{:?}", output.techniques.keys());
    for (i, pixel) in output.image.pixels.iter().enumerate() {
        let sum: Rgb = output.techniques.values().map(|t| t.weighted.pixels[i]).sum();
        assert!((sum - *pixel).abs().max_element() <= 1e-5 * pixel.max_element().max(1e-3), "pixel {i}: {sum} {pixel}");
    }
    let plain = Settings { per_technique: false, ..settings };
    assert_eq!(common::run(&world, &plain).image, output.image);
}

#[test]
fn the_technique_images_of_caustics_sum_to_the_caustics() {
    let world = world();
    let all = Settings { per_technique: true, ..settings(Integrator::Bdpt, 32, 4, 1) };
    let output = common::run(&world, &Settings { caustics_only: true, ..all.clone() });
    let sum = |techniques: &BTreeMap<_, TechniqueImages>, i: usize| -> Rgb {
        techniques.values().map(|t| t.weighted.pixels[i]).sum()
    };
    let everything = common::run(&world, &all);
    let mut less = 0;
    for (i, pixel) in output.image.pixels.iter().enumerate() {
        let caustics = sum(&output.techniques, i);
        let error = (caustics - *pixel).abs().max_element();
        assert!(error <= 1e-5 * pixel.max_element().max(1e-3), "pixel {i}: {caustics} {pixel}");
        less += usize::from(caustics.x < sum(&everything.techniques, i).x);
    }
    assert!(less > 400, "other light in {less} of 1024 pixels");
}

#[test]
fn a_cancelled_render_keeps_its_whole_passes() {
    let world = world();
    let (cancel, some) = (Cancel::default(), AtomicBool::new(false));
    // Minutes, if nobody heeds the cancel.
    let settings = settings(Integrator::Bdpt, 64, 10_000, 1);
    let progress = |p: Progress| some.store(p.samples > 0, Ordering::Relaxed);
    let (output, latency) = std::thread::scope(|scope| {
        let call = || (render(&world, &settings, &cancel, &progress), Instant::now());
        let render = scope.spawn(call);
        while !some.load(Ordering::Relaxed) && !render.is_finished() {
            std::thread::sleep(Duration::from_millis(10));
        }
        let asked = Instant::now();
        cancel.cancel();
        let (output, ended) = render.join().expect("no panic");
        (output.expect("a cancelled render is no error"), ended - asked)
    });
    // 50 ms on an idle machine.
    println!("cancelled within {latency:?}");
    assert!(output.cancelled);
    let passes = output.statistics.samples;
    assert!(passes > 0);
    let whole = common::run(&world, &Settings { samples: passes, ..settings.clone() });
    assert_eq!(whole.image, output.image, "after {passes} passes");
    cancel.cancel();
}

#[test]
fn progress_never_falls_and_ends_at_one() {
    let world = world();
    let seen = Mutex::new(Vec::new());
    let settings = settings(Integrator::Bdpt, 64, 24, 1);
    render(&world, &settings, &Cancel::default(), &|p| seen.lock().expect("no panic").push(p)).expect("a render");
    let seen = seen.into_inner().expect("no panic");
    assert_eq!((seen[0].fraction, seen.last().map(|p| p.fraction)), (0.0, Some(1.0)));
    assert!(seen.windows(2).all(|w| w[0].fraction <= w[1].fraction && w[0].samples <= w[1].samples));
    assert!(seen[..seen.len() - 1].iter().all(|p| p.fraction < 1.0));
    let last = seen.last().expect("some");
    assert!(last.samples == 24 && last.rays > 0 && last.noise > 0.0);
}

#[test]
fn a_time_limit_ends_the_render_after_a_whole_pass() {
    let world = world();
    let limit = Some(Duration::from_millis(200));
    let settings = Settings { time_limit: limit, ..settings(Integrator::Bdpt, 32, 1_000_000, 1) };
    let output = render(&world, &settings, &Cancel::default(), &|_| ()).expect("a render");
    let passes = output.statistics.samples;
    assert!(passes > 0 && passes < 1_000_000 && !output.cancelled);
    assert_eq!(common::run(&world, &Settings { samples: passes, time_limit: None, ..settings }).image, output.image);
}

/// The noise that was asked for is reached by as many samples, whatever the number of threads; half of it takes some four
/// times as many.
#[test]
fn a_noise_limit_ends_the_render_at_that_noise() {
    let mut b = scene();
    // Without glass: no rare bright paths.
    b.0.materials[1] = b.0.materials[0].clone();
    let world = b.commit();
    let until = |limit: f32, threads: usize| {
        let noise = Mutex::new(0.0);
        let progress = |p: Progress| *noise.lock().unwrap() = p.noise;
        let settings =
            Settings { noise_limit: Some(limit), threads, ..settings(Integrator::Bdpt, 32, MOST_BY_NOISE, 1) };
        let output = render(&world, &settings, &Cancel::default(), &progress).expect("a render");
        let noise = *noise.lock().unwrap();
        assert!(!output.cancelled && noise <= limit && noise > 0.5 * limit, "{noise} for {limit}");
        (output.statistics.samples, output.image)
    };
    let (samples, image) = until(0.03, 1);
    assert_eq!(until(0.03, 3), (samples, image.clone()));
    assert_eq!(common::run(&world, &settings(Integrator::Bdpt, 32, samples, 1)).image, image);
    let (more, _) = until(0.015, 2);
    assert!(samples > LEAST_PASSES && (2 * samples..8 * samples).contains(&more), "{samples}, {more}");
}

#[test]
fn the_noise_estimate_is_the_noise() {
    // Against the spread of independent runs, over all pixels.
    let world = world();
    let runs: Vec<_> =
        (0..12).map(|seed| common::run(&world, &settings(Integrator::Path, 32, 32, seed)).image).collect();
    let n = runs[0].pixels.len();
    let luminance = |r: usize, i: usize| f64::from(caustica::math::luminance(runs[r].pixels[i]));
    let mut variance = 0.0;
    let mut mean = 0.0;
    for i in 0..n {
        let values: Vec<f64> = (0..runs.len()).map(|r| luminance(r, i)).collect();
        let (m, error) = common::stats::mean_and_error(&values);
        variance += error * error * runs.len() as f64 / n as f64;
        mean += m / n as f64;
    }
    let seen = Mutex::new(0.0);
    render(&world, &settings(Integrator::Path, 32, 32, 77), &Cancel::default(), &|p| {
        *seen.lock().expect("no panic") = f64::from(p.noise);
    })
    .expect("a render");
    let (estimate, truth) = (seen.into_inner().expect("no panic"), variance.sqrt() / mean);
    println!("noise estimated {estimate:.4}, measured {truth:.4}");
    // The estimate compares two halves of a picture with bright single paths: it is a rough number.
    assert!((0.5..2.0).contains(&(estimate / truth)), "{estimate} against {truth}");
}

#[test]
fn settings_that_cannot_be_are_errors_that_name_them() {
    let world = world();
    let good = settings(Integrator::Bdpt, 8, 1, 0);
    let cases: [(&str, Settings); 13] = [
        ("width", Settings { width: 0, ..good.clone() }),
        ("height", Settings { height: 1 << 20, ..good.clone() }),
        ("size", Settings { width: 65536, height: 65536, ..good.clone() }),
        ("samples", Settings { samples: 0, ..good.clone() }),
        ("max_depth", Settings { max_depth: 0, ..good.clone() }),
        ("camera", Settings { camera: 1, ..good.clone() }),
        ("region", Settings { region: Some(Region { x: 0, y: 0, width: 9, height: 1 }), ..good.clone() }),
        ("region", Settings { region: Some(Region { x: 8, y: 0, width: 1, height: 1 }), ..good.clone() }),
        ("region", Settings { region: Some(Region { x: 0, y: 2, width: 1, height: u32::MAX }), ..good.clone() }),
        ("clamp", Settings { clamp: Some(0.0), ..good.clone() }),
        ("clamp", Settings { clamp: Some(f32::INFINITY), ..good.clone() }),
        ("first_sample", Settings { first_sample: u32::MAX, ..good.clone() }),
        ("threads", Settings { threads: 1 << 30, ..good }),
    ];
    for (name, settings) in cases {
        match render(&world, &settings, &Cancel::default(), &|_| ()) {
            Err(RenderError::Setting { setting, .. }) => assert_eq!(setting, name),
            other => panic!("{name}: {other:?}"),
        }
    }
}
