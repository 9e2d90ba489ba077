//! What each option of caustic connections costs and brings: one at a time away from the default.

use crate::measure::{Budget, Estimate, Method, Reference};
use crate::report::{Report, number};
use crate::{Options, SEED, Scene};
use caustica::render::{Caustics, Integrator};
use caustica::transport::options::{CausticOptions, Check, FEW, GeometryTerm, MOST_SEEDS};
use caustica::transport::roulette::Roulette;
use std::fmt::Write;

/// Where they are varied.
pub(crate) const SCENES: [&str; 5] = ["figure4a_small", "eye_small", "water_small", "glass_sphere", "demo"];

/// Renders of each, with seeds of their own.
const RENDERS: u64 = 4;

/// Microseconds of one sample, on one thread, for the estimate alone.
const SAMPLE_MICROSECONDS: f64 = 15.0;

/// The default, and all that differ from it in one option.
fn variations() -> Vec<(String, CausticOptions)> {
    let default = CausticOptions::default();
    let mut all = vec![("default".to_owned(), default)];
    let mut vary = |name: String, change: &dyn Fn(&mut CausticOptions)| {
        let mut options = default;
        change(&mut options);
        if options != default {
            all.push((name, options));
        }
    };
    for (name, check) in [("exact", Check::Exact), (&*format!("{FEW} steps"), Check::Few), ("off", Check::Off)] {
        vary(format!("direct geometry term, check {name}"), &|o| {
            (o.geometry_term, o.check) = (GeometryTerm::Direct, check);
        });
    }
    for n in 1..=MOST_SEEDS {
        vary(format!("seeds {n}"), &|o| o.seeds = Some(n));
    }
    for p in [0.0, 0.25, 1.0] {
        vary(format!("searches with probability {p}"), &|o| o.search = Some(p));
    }
    for n in [8, 16, 24, 32, 64] {
        vary(format!("at most {n} iterations"), &|o| o.max_iterations = Some(n));
    }
    for angle in [1e-5, 1e-6, 1e-8, 1e-11] {
        vary(format!("tolerance {angle:e}"), &|o| o.walk.tolerance = angle);
    }
    for n in [0, 5, 10] {
        vary(format!("careful {n}"), &|o| o.walk.careful = n);
    }
    for share in [0.0, 0.25, 0.5, 0.75] {
        vary(format!("aim {share}"), &|o| o.aim = Some(share));
    }
    for number in [0.25, 0.5, 1.0, 2.0] {
        vary(format!("{number} light subpaths"), &|o| o.light_subpaths = Some(number));
    }
    vary("roulette off".to_owned(), &|o| o.roulette = Roulette::Off);
    vary("roulette by lengths".to_owned(), &|o| o.roulette = Roulette::Lengths);
    for threshold in [0.1, 0.5, 2.0] {
        vary(format!("roulette by contribution, {threshold}"), &|o| o.roulette = Roulette::Contribution(threshold));
    }
    all
}

fn side(options: &Options) -> u32 {
    (options.side / 4).max(1)
}

/// Seconds of [`run`].
pub(crate) fn estimate(scene: &Scene, options: &Options) -> f64 {
    let samples = f64::from(options.knob_samples) * f64::from(side(options)).powi(2);
    let renders = variations().len() as f64 * RENDERS as f64;
    scene.factor * options.reference_seconds
        + renders * samples * SAMPLE_MICROSECONDS * 1e-6 / options.threads.max(1) as f64
}

/// Renders all variations and writes the scene's table.
pub(crate) fn run(scene: &Scene, options: &Options, report: &Report) {
    let subject = options.open(scene, side(options));
    let ours = Method::new("ours", Integrator::Bdpt, Caustics::On);
    let reference = Reference::new(&subject, options.reference_seconds * scene.factor);
    let mut body = format!(
        "{side} x {side} pixels, {} samples. Noise of the reference (relMSE): {}; of its mean about {:.2} %.\n\n\
         | | relMSE inside | bias | time (s) | efficiency |\n|---|--:|--:|--:|--:|\n",
        options.knob_samples,
        number(reference.noise[0]),
        100.0 * reference.drift,
        side = subject.side
    );
    let mut default_cost = None;
    for (name, caustic_options) in variations() {
        let method = Method { options: caustic_options, ..ours };
        let (mut errors, mut biases, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..RENDERS {
            let output = subject.render(&method, Budget::Samples(options.knob_samples), SEED + k, false);
            errors.push(reference.errors(&output.image)[0]);
            biases.push(reference.bias(&output.image));
            seconds.push(output.statistics.render_seconds);
        }
        let (error, bias) = (Estimate::of(&errors).mean, Estimate::of(&biases));
        let time = Estimate::of(&seconds).mean;
        let efficiency = *default_cost.get_or_insert(error * time) / (error * time);
        eprintln!("  {name:36} {} {bias} {time:.2} s", number(error));
        _ = writeln!(body, "| {name} | {} | {bias} | {time:.2} | {efficiency:.2} |", number(error));
    }
    report.knobs(scene.name, &body);
}
