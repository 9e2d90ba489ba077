//! Embree and obvhs give the same hits for the same million rays on every scene, also scaled and moved.
#![cfg(feature = "embree")]

use caustica::geometry::Ray;
use caustica::intersect::compare::compare;
use caustica::intersect::{self, Backend, Build};
use caustica::math::{Frame, Sampler, Stream, warp};
use caustica::pool;
use caustica::scene::{CommitOptions, World};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

const RAYS: usize = 1_000_000;

/// Bounds for [`RAYS`] rays of one scene. A ray that differs passes an edge within this many roundings
/// of a vertex relative to the ray's origin (measured: 8.2 for one grazing ray, below 0.3 for all
/// others), and there are few of them (measured: at most 3).
const MOST_ROUNDINGS: f64 = 16.0;
const MOST_DIFFERENT: u64 = 10;

/// Half of the rays from outside toward the scene, half from its surfaces.
fn rays(world: &World) -> Vec<Ray> {
    let (center, radius) = world.bounds;
    let mut s = Sampler::new(5, 0, 0, Stream::Camera);
    let mut rays = Vec::with_capacity(RAYS);
    while rays.len() < RAYS {
        let out = warp::sphere(s.next_2d());
        let frame = Frame::around(-out);
        let disk = warp::disk(s.next_2d()) * radius;
        let origin = center + out * (2.0 * radius) + frame.s * disk.x + frame.t * disk.y;
        let ray = Ray { origin, direction: -out, t_max: f32::INFINITY };
        rays.push(ray);
        if let Some(hit) = world.intersector.closest(&ray) {
            let at = world.shapes[hit.shape as usize].surface(&ray, &hit);
            rays.push(Ray::leaving(&at, warp::sphere(s.next_2d())));
        }
    }
    rays.truncate(RAYS);
    rays
}

fn variant(scene: &str, change: DAffine3) -> World {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
    let mut loaded = caustica::io::gltf::load(&path).expect("a scene of this repository");
    for instance in &mut loaded.description.instances {
        instance.transform = change * instance.transform;
    }
    World::commit(
        &loaded.description,
        CommitOptions { backend: Backend::Embree, threads: 1, ..CommitOptions::default() },
    )
    .expect("a valid scene")
}

#[test]
fn the_same_rays_hit_the_same() {
    let directory = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut scenes: Vec<String> = std::fs::read_dir(directory)
        .expect("the scenes")
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".glb"))
        // Their images are read by OpenImageIO.
        .filter(|name| cfg!(feature = "oiio") || !name.starts_with("stained_glass"))
        .collect();
    scenes.sort();
    assert!(scenes.len() >= 7, "scenes are missing: {scenes:?}");
    let scale = |s: f64| DAffine3::from_mat3(DMat3::from_diagonal(DVec3::splat(s)));
    let changes = [
        ("", DAffine3::IDENTITY),
        (" x 1e-4", scale(1e-4)),
        (" x 1e4", scale(1e4)),
        (" + 1e4", DAffine3::from_translation(DVec3::new(1e4, -1e4, 1e4))),
    ];
    let jobs: Vec<_> = scenes.iter().flat_map(|s| changes.iter().map(move |c| (s, c))).collect();
    let next = AtomicUsize::new(0);
    let lines = Mutex::new(Vec::new());
    let work = |_: usize| {
        while let Some((scene, (suffix, change))) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            let world = variant(scene, *change);
            let obvhs = intersect::build(Backend::Obvhs, &world.shapes, Build::Static, 1).expect("obvhs");
            let c = compare(&*world.intersector, &*obvhs, &world.shapes, &rays(&world));
            let line = format!(
                "{scene}{suffix}: {} of {} differ ({} hit or miss), {} tied, within {:.2} roundings of an edge, \
                 {:.1e} of the triangle; {} occlusion differs; claimed error used {:.2}",
                c.different(),
                c.rays,
                c.hit_miss,
                c.tied,
                c.max_edge_roundings,
                c.max_edge_distance,
                c.occluded_differs,
                c.max_claimed_error
            );
            let good = c.rays == RAYS as u64
                && c.different() <= MOST_DIFFERENT
                && c.max_edge_roundings <= MOST_ROUNDINGS
                && c.max_claimed_error <= 1.0
                && c.occluded_differs <= MOST_DIFFERENT;
            lines.lock().expect("no panic").push((good, line));
        }
    };
    pool::broadcast(2, work).expect("no panic");
    let lines = lines.into_inner().expect("no panic");
    assert_eq!(lines.len(), jobs.len());
    for (_, line) in &lines {
        println!("{line}");
    }
    let bad: Vec<_> = lines.iter().filter(|l| !l.0).map(|l| &l.1).collect();
    assert!(bad.is_empty(), "{bad:#?}");
}
