//! `caustica backends`: Embree and obvhs on the same rays and on the same image.

use crate::args::Backends;
use crate::console::{self, Console};
use crate::progress::{Meter, spaced};
use crate::scene::Opened;
use crate::{Failure, compare, scene, units};
use caustica::geometry::Ray;
use caustica::intersect::{self, Backend};
use caustica::math::{Frame, Sampler, Stream, warp};
use caustica::render::compare as images;
use caustica::render::{self, Cancel, Output, Settings};
use caustica::scene::{CommitOptions, World};
use glam::Vec3;
use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

pub(crate) fn run(args: &Backends) -> Result<(), Failure> {
    let console = Console { quiet: false };
    let options = |backend| CommitOptions { backend, threads: args.threads, ..CommitOptions::default() };
    let Opened { description, world: embree, .. } = scene::open(&args.scene, options(Backend::Embree), None, console)?;
    let obvhs = scene::commit(&args.scene, &description, options(Backend::Obvhs))?;
    let rays = rays(&embree, args.rays, args.seed)?;

    let mut text = format!("{}: {} triangles\n\n", args.scene.display(), embree.triangle_count());
    writeln!(
        text,
        "{:<38} {:>8}  {:>10}  {:>12}  {:>12}",
        "speed, one thread", "build", "memory", "closest", "occluded"
    )?;
    for world in [&embree, &obvhs] {
        let tracer = &world.intersector;
        let closest = rate(&rays, |ray| tracer.closest(ray).is_some());
        let occluded = rate(&rays, |ray| tracer.occluded(ray));
        writeln!(
            text,
            "  {:<36} {:>8}  {:>10}  {:>6}rays/s  {:>6}rays/s",
            tracer.describe(),
            units::time(world.commit_seconds),
            units::bytes(tracer.memory()),
            spaced(units::si(closest)),
            spaced(units::si(occluded)),
        )?;
    }
    let hits = intersect::compare::compare(&*embree.intersector, &*obvhs.intersector, &embree.shapes, &rays);
    writeln!(text, "\nhits\n{hits}")?;
    console::print(&text)?;

    let settings = Settings {
        width: args.size.0,
        height: args.size.1,
        samples: args.spp,
        seed: args.seed,
        threads: args.threads,
        camera: scene::camera(&description.cameras, None)?,
        ..Settings::default()
    };
    let [a, b] = [render(&embree, &settings)?, render(&obvhs, &settings)?];
    let (width, height) = args.size;
    let mut text =
        format!("\nimages, {width}x{height}, {} per pixel\n", units::count(args.spp as usize, "sample", "samples"));
    for output in [&a, &b] {
        let s = &output.statistics;
        let rate = spaced(units::si(s.rays() as f64 / s.render_seconds.max(1e-9)));
        writeln!(text, "  {:<36} {:>8}  {rate:>6}rays/s", s.backend, units::time(s.render_seconds))?;
    }
    let same = a.image.pixels.iter().zip(&b.image.pixels).filter(|(p, q)| p == q).count();
    writeln!(text, "  {same} of {} pixels equal bit for bit; obvhs against Embree:", a.image.pixels.len())?;
    for line in compare::table(&images::compare(&b.image, &a.image)?).lines() {
        writeln!(text, "  {line}")?;
    }
    console::print(&text)
}

fn render(world: &World, settings: &Settings) -> Result<Output, Failure> {
    let meter = Meter::new(false);
    let output = render::render(world, settings, &Cancel::default(), &|progress| meter.report(progress))?;
    meter.finish();
    Ok(output)
}

/// Rays as paths have them: each path enters along a random chord of the bounding sphere and goes on
/// from where it hits, in a cosine-distributed direction, until it leaves.
fn rays(world: &World, count: u64, seed: u64) -> Result<Vec<Ray>, Failure> {
    // Longer paths of a closed scene would leave out its outside.
    const LONGEST: usize = 8;
    let n = usize::try_from(count)?;
    let mut rays = Vec::new();
    rays.try_reserve_exact(n).map_err(|_| format!("not enough memory for {n} rays"))?;
    let (center, radius) = world.bounds;
    let mut path = 0;
    while rays.len() < n {
        let mut numbers = Sampler::new(seed, path, 0, Stream::Camera);
        path = path.wrapping_add(1);
        let on_sphere = |u| center + radius * warp::sphere(u);
        let (from, to) = (on_sphere(numbers.next_2d()), on_sphere(numbers.next_2d()));
        let direction = (to - from).normalize_or(Vec3::X);
        let mut ray = Ray { origin: from, direction, t_max: f32::INFINITY };
        for _ in 0..LONGEST.min(n - rays.len()) {
            rays.push(ray);
            let Some(hit) = world.intersector.closest(&ray) else { break };
            let point = world.shapes[hit.shape as usize].surface(&ray, &hit);
            let facing = if point.ng.dot(ray.direction) < 0.0 { point.ng } else { -point.ng };
            let local = warp::cosine_hemisphere(numbers.next_2d());
            ray = Ray::leaving(&point, Frame::around(facing).to_world(local));
        }
    }
    Ok(rays)
}

/// Rays per second of one thread.
fn rate(rays: &[Ray], trace: impl Fn(&Ray) -> bool) -> f64 {
    let start = Instant::now();
    black_box(rays.iter().filter(|ray| trace(ray)).count());
    rays.len() as f64 / start.elapsed().as_secs_f64().max(1e-9)
}
