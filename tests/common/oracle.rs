//! Two estimates of one image, held against each other: per block, and in the mean.
//!
//! Seeds are fixed, so a test passes or fails for good. Blocks: z-scores consistent with N(0, 1) (Student's
//! t, since errors are estimated), false alarm 1e-3 per comparison. Mean: the upper confidence bound
//! of its bias lies below a limit, so that a true bias of that size passes with a probability of
//! 5 % at most.

use super::stats::{Blocks, block_means, check_normal, mean_and_error, z_scores};
use caustica::render::{Image, Integrator, Settings};
use caustica::scene::World;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;

/// Bias of the mean that a test between integrators or with a reference must exclude.
pub const BIAS_LIMIT: f64 = 0.002;

/// Confidence of the statement that a bias is below its limit.
pub const BIAS_CONFIDENCE: f64 = 0.95;

/// A first seed of a comparison's own, so that scenes with parts in common do not share their luck
/// (FNV-1a, Fowler, Noll, Vo 1991).
pub fn first_seed(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3)) & !0xffff
}

/// One render per seed.
pub fn renders(world: &World, settings: &Settings, seeds: Range<u64>) -> Vec<Image> {
    seeds.map(|seed| super::run(world, &Settings { seed, ..settings.clone() }).image).collect()
}

/// States with [`BIAS_CONFIDENCE`] that a relative `difference` with a standard `error` is below
/// `limit`.
pub fn check_bias(name: &str, difference: f64, error: f64, degrees: f64, limit: f64) -> Result<(), String> {
    let student = StudentsT::new(0.0, 1.0, degrees).map_err(|e| e.to_string())?;
    let bound = difference.abs() + student.inverse_cdf(BIAS_CONFIDENCE) * error;
    let [difference, error, bound, limit] = [difference, error, bound, limit].map(|x| 100.0 * x);
    let text = format!("{name}: bias {difference:+.4} % +- {error:.4} %, below {bound:.4} % (demanded {limit:.2} %)");
    eprintln!("{text}");
    if bound < limit { Ok(()) } else { Err(text) }
}

fn check_blocks(name: &str, z: &[f64], degrees: f64) -> Result<(), String> {
    let worst = z.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let square = z.iter().map(|v| v * v).sum::<f64>() / z.len() as f64;
    eprintln!("{name}: {} blocks, max |z| {worst:.2}, mean z² {square:.2}", z.len());
    check_normal(name, z, degrees)
}

/// An estimate against a reference whose errors are known; `degrees` belong to the estimate's.
pub fn check_reference(name: &str, a: &Blocks, b: &Blocks, degrees: f64, limit: f64) -> Result<(), String> {
    let (difference, error) = (a.total.0 - b.total.0, a.total.1.hypot(b.total.1));
    check_blocks(name, &z_scores(a, b), degrees)?;
    check_bias(name, difference / b.total.0, error / b.total.0, degrees, limit)
}

/// Two estimates that may share random numbers, a run of one with a run of the other: differences
/// are taken within the pairs, where what they share cancels, and their errors over the pairs.
pub fn check_pairs(name: &str, a: &[Image], b: &[Image], block: u32, limit: f64) -> Result<(), String> {
    let [a, b] = [a, b].map(|runs| runs.iter().map(|i| block_means(i, block)).collect::<Vec<_>>());
    check_paired_blocks(name, &a, &b, limit)
}

/// The same with the block means of each run.
pub fn check_paired_blocks(name: &str, a: &[Vec<f64>], b: &[Vec<f64>], limit: f64) -> Result<(), String> {
    let degrees = a.len() as f64 - 1.0;
    let pairs = || a.iter().zip(b);
    let score = |block: usize| {
        let (d, error) = mean_and_error(&pairs().map(|(a, b)| a[block] - b[block]).collect::<Vec<_>>());
        // Blocks that are always equal (black in both) say nothing.
        (error > 0.0).then(|| d / error)
    };
    let z: Vec<f64> = (0..a[0].len()).filter_map(score).collect();
    let average = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (d, error) = mean_and_error(&pairs().map(|(a, b)| average(a) - average(b)).collect::<Vec<_>>());
    let level = average(&b.iter().map(|b| average(b)).collect::<Vec<_>>());
    check_blocks(name, &z, degrees)?;
    check_bias(name, d / level, error / level, degrees, limit)
}

/// The path tracer and the bidirectional one. With equal seeds they share camera paths and light
/// points, which leaves a difference with a third of the variance of independent estimates.
pub fn check_integrators(name: &str, world: &World, base: &Settings, runs: u64, block: u32) -> Result<(), String> {
    let seed = first_seed(name);
    let [path, bdpt] = [Integrator::Path, Integrator::Bdpt]
        .map(|integrator| renders(world, &Settings { integrator, ..base.clone() }, seed..seed + runs));
    check_pairs(name, &bdpt, &path, block, BIAS_LIMIT)
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
