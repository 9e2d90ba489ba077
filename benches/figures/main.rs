//! docs/results.md: error against time of all integrators on the scenes of this repository.
//!
//! Each scene, and each scene's table of options, is a piece of its own under `target/figures`; the
//! document is put together from the pieces that are there, and from its own for those that are not, so that a long run
//! can be made in parts, each on any checkout.

mod knobs;
mod measure;
mod plot;
mod report;
mod strip;
mod study;

use clap::Parser;
use measure::{Method, Subject};
use report::Report;
use std::path::Path;
use std::time::Instant;

/// Seed of the renders that are compared; references have their own.
const SEED: u64 = 1;

/// A scene of the document.
struct Scene {
    name: &'static str,
    /// Of the time budget.
    factor: f64,
    /// Whether techniques without walks find all paths, in time that can be waited for.
    checked: bool,
}

const fn scene(name: &'static str, factor: f64, checked: bool) -> Scene {
    Scene { name, factor, checked }
}

/// In the order of the document.
const SCENES: [Scene; 22] = [
    scene("figure4a", 0.5, true),
    scene("figure4a_small", 0.6, false),
    scene("figure4b", 0.7, true),
    scene("figure4b_small", 0.7, false),
    scene("figure4c", 0.6, false),
    scene("figure4c_small", 1.5, false),
    scene("eye", 0.4, true),
    scene("eye_small", 0.5, false),
    scene("water", 0.6, true),
    scene("water_small", 2.0, false),
    scene("window", 0.3, true),
    scene("window_small", 2.0, false),
    scene("pane_sphere", 1.5, false),
    scene("glass_sphere", 0.3, false),
    scene("demo", 0.5, true),
    scene("lumpy", 0.7, true),
    scene("water_glass", 0.3, true),
    scene("frosted", 0.4, true),
    scene("sky", 0.4, true),
    scene("water_glass_sky", 0.4, true),
    scene("stained_glass", 0.4, true),
    scene("cornell", 0.15, true),
];

/// Compares the integrators and writes docs/results.md.
#[derive(Parser)]
pub(crate) struct Options {
    /// Scenes; all if there is none
    scenes: Vec<String>,
    /// Seconds of an equal-time render, times the scene's factor
    #[arg(long, default_value_t = 15.0)]
    seconds: f64,
    /// Seconds of a reference, times the scene's factor
    #[arg(long, default_value_t = 90.0)]
    reference_seconds: f64,
    /// Methods beside bdpt, mnee and ours, which always are; none for long runs
    #[arg(long, value_delimiter = ',', default_value = "path,light,paper")]
    also: Vec<String>,
    /// Samples per pixel of the equal-sample renders
    #[arg(long, default_value_t = 16)]
    samples: u32,
    /// Samples per pixel of the renders with other options
    #[arg(long, default_value_t = 64)]
    knob_samples: u32,
    /// Columns and rows; a quarter of it for the renders with other options
    #[arg(long, default_value_t = 256)]
    side: u32,
    /// Worker threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Leave out the tables of options
    #[arg(long)]
    no_knobs: bool,
    /// Make the tables of options only
    #[arg(long, conflicts_with = "no_knobs")]
    only_knobs: bool,
    /// Render nothing, put the document together
    #[arg(long)]
    only_report: bool,
    /// `cargo bench` says so
    #[arg(long, hide = true)]
    bench: bool,
}

impl Options {
    fn open(&self, scene: &Scene, side: u32) -> Subject {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        Subject::open(&folder.join(format!("{}.glb", scene.name)), side, self.threads)
    }

    fn methods(&self) -> Vec<Method> {
        let always = ["bdpt", "mnee", "ours"];
        let asked = |m: &Method| always.contains(&m.name) || self.also.iter().any(|name| name == m.name);
        Method::all().into_iter().filter(asked).collect()
    }

    fn wanted(&self) -> impl Iterator<Item = &'static Scene> {
        let named = |s: &Scene| self.scenes.is_empty() || self.scenes.iter().any(|name| name == s.name);
        SCENES.iter().filter(move |s| !self.only_report && named(s))
    }

    fn studied(&self) -> impl Iterator<Item = &'static Scene> {
        self.wanted().filter(|_| !self.only_knobs)
    }

    fn varied(&self) -> impl Iterator<Item = &'static Scene> {
        self.wanted().filter(|s| !self.no_knobs && knobs::SCENES.contains(&s.name))
    }

    fn estimate(&self) -> f64 {
        self.studied().map(|s| study::estimate(s, self)).sum::<f64>()
            + self.varied().map(|s| knobs::estimate(s, self)).sum::<f64>()
    }
}

fn main() {
    // `cargo test --benches` runs this too; only `cargo bench` measures.
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    let options = Options::parse();
    if let Some(name) = options.scenes.iter().find(|name| SCENES.iter().all(|s| s.name != **name)) {
        eprintln!("no scene '{name}'; there are {}", SCENES.map(|s| s.name).join(", "));
        std::process::exit(2);
    }
    if let Some(name) =
        options.also.iter().find(|name| !name.is_empty() && Method::all().iter().all(|m| m.name != **name))
    {
        eprintln!(
            "no method '{name}'; there are {}",
            Method::all().iter().map(|m| m.name).collect::<Vec<_>>().join(", ")
        );
        std::process::exit(2);
    }
    let report = Report::new(&options);
    println!("{}", report.provenance());
    if !options.only_report {
        eprintln!("about {:.0} minutes", options.estimate() / 60.0);
    }
    let start = Instant::now();
    let minutes = || start.elapsed().as_secs_f64() / 60.0;
    for scene in options.studied() {
        eprintln!("{}, after {:.1} minutes", scene.name, minutes());
        study::run(scene, &options, &report);
        report.assemble();
    }
    for scene in options.varied() {
        eprintln!("options on {}, after {:.1} minutes", scene.name, minutes());
        knobs::run(scene, &options, &report);
        report.assemble();
    }
    report.assemble();
    println!("docs/results.md after {:.1} minutes", minutes());
}
