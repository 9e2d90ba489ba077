//! Two estimates of one image, held against each other: per block, and in the mean.
//!
//! Seeds are fixed, so a test passes or fails for good. The levels say how likely a right renderer
//! was to fail when the seeds were chosen (false alarm), and how large an error was to be missed.

use super::stats::{Blocks, blocks, check_normal, mean_and_error, z_scores};
use caustica::render::Image;
use caustica::render::job::{Integrator, Settings};
use caustica::scene::World;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;

/// Largest bias of the mean that a test may overlook.
pub const BIAS_LIMIT: f64 = 0.002;

/// Confidence of the statement "the bias is below [`BIAS_LIMIT`]".
pub const BIAS_CONFIDENCE: f64 = 0.99;

/// One render per seed.
pub fn renders(world: &World, settings: &Settings, seeds: Range<u64>) -> Vec<Image> {
    seeds.map(|seed| super::run(world, &Settings { seed, ..settings.clone() }).image).collect()
}

/// Upper quantile of Student's t distribution.
pub fn t_quantile(confidence: f64, degrees: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees).expect("degrees").inverse_cdf(confidence)
}

/// States with [`BIAS_CONFIDENCE`] that `difference` (relative) is below `limit`: its upper
/// confidence bound is. A true bias of `limit` passes with a probability of 1 % at most; whether
/// an unbiased estimate passes is a matter of `error`, for which `limit / 6` leaves 1e-3.
pub fn check_bias(name: &str, difference: f64, error: f64, degrees: f64, limit: f64) -> Result<(), String> {
    let bound = difference.abs() + t_quantile(BIAS_CONFIDENCE, degrees) * error;
    let text = format!(
        "{name}: bias {:+.4} % +- {:.4} %, below {:.4} % at {} %",
        100.0 * difference,
        100.0 * error,
        100.0 * bound,
        100.0 * BIAS_CONFIDENCE
    );
    eprintln!("{text}");
    if bound < limit { Ok(()) } else { Err(format!("{text}; {:.2} % was demanded", 100.0 * limit)) }
}

/// Blocks and mean of two estimates with `degrees` of freedom in the smaller one's errors.
pub fn check_equal(name: &str, a: &Blocks, b: &Blocks, degrees: f64, limit: f64) -> Result<(), String> {
    let z = z_scores(a, b);
    let n = z.len() as f64;
    let worst = z.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let square = z.iter().map(|v| v * v).sum::<f64>() / n;
    let typical = |b: &Blocks| {
        let relative = b.mean.iter().zip(&b.error).filter(|(m, _)| **m > 0.0).map(|(m, e)| e / m);
        let mut relative: Vec<f64> = relative.collect();
        relative.sort_by(f64::total_cmp);
        relative.get(relative.len() / 2).map_or(0.0, |e| 100.0 * e)
    };
    eprintln!(
        "{name}: {n} blocks, errors {:.2} % and {:.2} %, max |z| {worst:.2}, mean z² {square:.2}",
        typical(a),
        typical(b)
    );
    let difference = (a.total.0 - b.total.0) / b.total.0;
    let error = a.total.1.hypot(b.total.1) / b.total.0;
    check_normal(name, &z, degrees)?;
    check_bias(name, difference, error, degrees, limit)
}

/// Both integrators on the same scene, with different seeds: equal ones share camera paths.
pub fn check_integrators(
    name: &str,
    world: &World,
    base: &Settings,
    samples: [u32; 2],
    runs: u64,
    block: u32,
) -> Result<(), String> {
    let start = std::time::Instant::now();
    let path = Settings { integrator: Integrator::Path, samples: samples[0], ..base.clone() };
    let bdpt = Settings { integrator: Integrator::Bdpt, samples: samples[1], ..base.clone() };
    let path = blocks(&renders(world, &path, 1000..1000 + runs), block);
    let middle = start.elapsed();
    let bdpt = blocks(&renders(world, &bdpt, 2000..2000 + runs), block);
    eprintln!("{name}: path {:.1} s, bdpt {:.1} s", middle.as_secs_f64(), (start.elapsed() - middle).as_secs_f64());
    // Welch's degrees of freedom lie between those of one estimate and of both.
    check_equal(name, &bdpt, &path, runs as f64 - 1.0, BIAS_LIMIT)
}

/// Mean of each channel with its standard error, over runs.
pub fn channel_means(runs: &[Image]) -> [(f64, f64); 3] {
    [0, 1, 2].map(|c| {
        let mean = |image: &Image| {
            image.pixels.iter().map(|p| f64::from(p.to_array()[c])).sum::<f64>() / image.pixels.len() as f64
        };
        mean_and_error(&runs.iter().map(mean).collect::<Vec<_>>())
    })
}
