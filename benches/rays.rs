//! Rays per second: Embree's bare C calls, the same rays through the trait, obvhs, and whole renders,
//! with the share of a render that is spent inside Embree. All in one run, since absolute times drift.
//!
//! Then what walks cost: nanoseconds per step, everything around it included, as a ratio to a bare Embree
//! ray of the same render, and their share of the time.
//!
//! The rays are those of a real render: a recording intersector keeps every query of some passes of
//! the bidirectional path tracer, in order. Each measurement is the fastest of several repetitions
//! that take turns, on one thread.

use caustica::geometry::Ray;
use caustica::intersect::{Backend, Hit, Intersector};
#[cfg(feature = "embree")]
use caustica::intersect::{Build, build, embree::Embree};
use caustica::io::gltf;
use caustica::render::{Cancel, Caustics, Integrator, Settings, render};
use caustica::scene::{CommitOptions, World};
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::time::Instant;

const SEED: u64 = 1;
const REPETITIONS: usize = 7;
const SIDE: u32 = 128;
const PASSES: u32 = 8;

/// Keeps the rays that pass through it.
struct Recorder {
    inner: Arc<dyn Intersector>,
    closest: Arc<Mutex<Vec<Ray>>>,
    occluded: Arc<Mutex<Vec<Ray>>>,
}

impl Intersector for Recorder {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest.lock().expect("one thread").push(*ray);
        self.inner.closest(ray)
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.occluded.lock().expect("one thread").push(*ray);
        self.inner.occluded(ray)
    }
    fn describe(&self) -> String {
        self.inner.describe()
    }
    fn memory(&self) -> u64 {
        self.inner.memory()
    }
}

fn settings(integrator: Integrator) -> Settings {
    let caustics = Caustics::On;
    let settings = Settings { integrator, caustics, width: SIDE, height: SIDE, samples: PASSES, ..Settings::default() };
    Settings { seed: SEED, threads: 1, ..settings }
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

/// The fastest of several repetitions of each piece of work, taking turns.
fn fastest<const N: usize>(mut work: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut best = [f64::INFINITY; N];
    for _ in 0..REPETITIONS {
        for (w, b) in work.iter_mut().zip(&mut best) {
            *b = b.min(seconds(w));
        }
    }
    best
}

fn count_closest(intersector: &dyn Intersector, rays: &[Ray]) {
    black_box(rays.iter().filter(|&r| intersector.closest(r).is_some()).count());
}

fn count_occluded(intersector: &dyn Intersector, rays: &[Ray]) {
    black_box(rays.iter().filter(|&r| intersector.occluded(r)).count());
}

fn world(scene: &Path, backend: Backend) -> World {
    let loaded = gltf::load(scene).expect("a scene of this repository");
    World::commit(&loaded.description, CommitOptions { backend, threads: 1, ..CommitOptions::default() })
        .expect("a valid scene")
}

fn first_line(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output();
    let text = output.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()).unwrap_or_default();
    text.lines().next().unwrap_or("unknown").to_owned()
}

fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|l| l.strip_prefix("model name"));
    model.map_or_else(|| "unknown CPU".to_owned(), |m| m.trim_start_matches([' ', '\t', ':']).to_owned())
}

fn measure(name: &str) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut recorded = world(&scene, Backend::default());
    let (closest, occluded) = (Arc::new(Mutex::new(Vec::new())), Arc::new(Mutex::new(Vec::new())));
    let inner = recorded.intersector;
    recorded.intersector = Arc::new(Recorder { inner, closest: closest.clone(), occluded: occluded.clone() });
    let render = |world: &World, settings| render(world, &settings, &Cancel::default(), &|_| ()).expect("a render");
    let run = |world: &World, integrator| _ = black_box(render(world, settings(integrator)));
    run(&recorded, Integrator::Bdpt);
    let closest = std::mem::take(&mut *closest.lock().expect("one thread"));
    let occluded = std::mem::take(&mut *occluded.lock().expect("one thread"));

    let plain = world(&scene, Backend::default());
    let path_rays = render(&plain, settings(Integrator::Path)).statistics.rays() as f64;
    let (c, o) = (closest.len() as f64, occluded.len() as f64);
    println!("{name}: {c:.0} nearest-hit and {o:.0} visibility rays of {PASSES} passes at {SIDE}x{SIDE}");

    let through_trait = &*plain.intersector;
    let obvhs = world(&scene, Backend::Obvhs);
    let [trait_c, trait_o, bdpt, path, obvhs_c, obvhs_o] = fastest([
        &mut || count_closest(through_trait, &closest),
        &mut || count_occluded(through_trait, &occluded),
        &mut || run(&plain, Integrator::Bdpt),
        &mut || run(&plain, Integrator::Path),
        &mut || count_closest(&*obvhs.intersector, &closest),
        &mut || count_occluded(&*obvhs.intersector, &occluded),
    ]);
    let row = |what: &str, rays: f64, time: f64| println!("  {what:<34}{:>8.2} Mrays/s", rays / time * 1e-6);

    #[cfg(feature = "embree")]
    {
        let embree = Embree::build(&plain.shapes, Build::Static, 1).expect("Embree");
        let editable = build(Backend::Embree, &plain.shapes, Build::Editable, 1).expect("Embree");
        let [raw_c, raw_o, again_c, again_o, parts_c, parts_o] = fastest([
            &mut || _ = black_box(embree.bench_raw_closest(&closest)),
            &mut || _ = black_box(embree.bench_raw_occluded(&occluded)),
            &mut || count_closest(through_trait, &closest),
            &mut || count_occluded(through_trait, &occluded),
            &mut || count_closest(&*editable, &closest),
            &mut || count_occluded(&*editable, &occluded),
        ]);
        row("nearest hit, bare Embree calls", c, raw_c);
        row("nearest hit, through the trait", c, again_c);
        row("visibility, bare Embree calls", o, raw_o);
        row("visibility, through the trait", o, again_o);
        row("nearest hit, editable build", c, parts_c);
        row("visibility, editable build", o, parts_o);
        let cost = |ours: f64, raw: f64| (ours / raw - 1.0) * 100.0;
        println!(
            "  cost of the trait: nearest {:.1} %, visibility {:.1} %",
            cost(again_c, raw_c),
            cost(again_o, raw_o)
        );
        println!("  share of BDPT inside Embree: {:.1} %", (raw_c + raw_o) / bdpt * 100.0);
    }
    #[cfg(not(feature = "embree"))]
    println!("  (without Embree: {:.3} s + {:.3} s through the trait)", trait_c, trait_o);
    let _ = (trait_c, trait_o);
    row("nearest hit, obvhs", c, obvhs_c);
    row("visibility, obvhs", o, obvhs_o);
    row("BDPT, all rays of the render", c + o, bdpt);
    row("path tracer, all rays", path_rays, path);

    if !plain.requirements.caustics {
        let without = Settings { caustics: Caustics::Off, ..settings(Integrator::Bdpt) };
        let [on, off] = fastest([&mut || run(&plain, Integrator::Bdpt), &mut || {
            black_box(render(&plain, without.clone()));
        }]);
        println!("  cost of --caustics on where there is no glass: {:.1} %", (on / off - 1.0) * 100.0);
    }
}

/// Walks of a scene's render.
#[cfg(feature = "embree")]
fn measure_walks(name: &str) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(format!("{name}.glb"));
    let (mut recorded, closest) = (world(&scene, Backend::default()), Arc::new(Mutex::new(Vec::new())));
    let inner = recorded.intersector;
    recorded.intersector = Arc::new(Recorder { inner, closest: closest.clone(), occluded: Arc::default() });
    let run = |world: &World| {
        render(world, &settings(Integrator::Bdpt), &Cancel::default(), &|_| ()).expect("a render").statistics
    };
    run(&recorded);
    let closest = std::mem::take(&mut *closest.lock().expect("one thread"));
    let plain = world(&scene, Backend::default());
    let embree = Embree::build(&plain.shapes, Build::Static, 1).expect("Embree");
    let mut best: Option<caustica::render::Statistics> = None;
    let [raw, _] = fastest([&mut || _ = black_box(embree.bench_raw_closest(&closest)), &mut || {
        let statistics = run(&plain);
        if best.as_ref().is_none_or(|b| statistics.render_seconds < b.render_seconds) {
            best = Some(statistics);
        }
    }]);
    let Some(best) = best else { return };
    let (walks, ray) = (&best.walks, raw * 1e9 / closest.len() as f64);
    let [connecting, checking] = walks.nanoseconds.map(|n| n as f64);
    let steps = walks.iterations as f64;
    let step = (connecting + checking) / steps;
    println!(
        "  {name:<14}{:>7.2}{:>9.0}{ray:>9.0}{:>8.1}{:>10.1}{:>10.1}",
        steps / walks.total() as f64,
        step,
        step / ray,
        connecting * 1e-7 / best.render_seconds,
        checking * 1e-7 / best.render_seconds
    );
}

fn main() {
    // `cargo test --benches` runs this too; only `cargo bench` measures.
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    println!("machine: {}, one thread", cpu());
    println!("commit: {}, seed {SEED}", first_line("git", &["describe", "--always", "--dirty"]));
    println!("best of {REPETITIONS} repetitions\n");
    for scene in ["cornell.glb", "demo.glb"] {
        measure(scene);
    }
    #[cfg(feature = "embree")]
    {
        println!("\nwalks: steps each, ns per step, ns per bare ray, ratio, % of the time: connections, checks");
        for scene in
            ["slab", "glass_sphere", "figure4a", "figure4b", "window_small", "water_small", "eye_small", "lumpy"]
        {
            measure_walks(scene);
        }
    }
}
