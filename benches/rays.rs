//! Rays per second: Embree's bare C calls, the same rays through the trait, obvhs, and whole renders,
//! with the share of a render that is spent inside Embree. All in one run, since absolute times drift.
//!
//! The rays are those of a real render: a recording intersector keeps every query of some passes of
//! the bidirectional path tracer, in order. Each measurement is the fastest of several repetitions
//! that take turns, on one thread.

use caustica::geometry::Ray;
use caustica::intersect::{Backend, Hit, Intersector};
use caustica::io::gltf;
use caustica::render::job::{Cancel, Integrator, Settings, render};
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
    inner: Box<dyn Intersector>,
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
    Settings { integrator, width: SIDE, height: SIDE, samples: PASSES, seed: SEED, threads: 1, ..Settings::default() }
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
    World::commit(&loaded.description, CommitOptions { backend, threads: 1 }).expect("a valid scene")
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
    recorded.intersector = Box::new(Recorder { inner, closest: closest.clone(), occluded: occluded.clone() });
    let run = |world: &World, integrator| {
        black_box(render(world, &settings(integrator), &Cancel::default(), &|_| ()).expect("a render"));
    };
    run(&recorded, Integrator::Bdpt);
    let closest = std::mem::take(&mut *closest.lock().expect("one thread"));
    let occluded = std::mem::take(&mut *occluded.lock().expect("one thread"));

    let plain = world(&scene, Backend::default());
    let path_rays = render(&plain, &settings(Integrator::Path), &Cancel::default(), &|_| ()).expect("a render");
    let path_rays = path_rays.statistics.rays() as f64;
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
        let embree = caustica::intersect::embree::Embree::build(&plain.shapes, 1).expect("Embree");
        let [raw_c, raw_o, again_c, again_o] = fastest([
            &mut || _ = black_box(embree.bench_raw_closest(&closest)),
            &mut || _ = black_box(embree.bench_raw_occluded(&occluded)),
            &mut || count_closest(through_trait, &closest),
            &mut || count_occluded(through_trait, &occluded),
        ]);
        row("nearest hit, bare Embree calls", c, raw_c);
        row("nearest hit, through the trait", c, again_c);
        row("visibility, bare Embree calls", o, raw_o);
        row("visibility, through the trait", o, again_o);
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
}
