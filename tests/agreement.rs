//! Estimators that share little must have the same expectation.
//!
//! 1. Each technique (s, t) without its weight makes all paths of its length, if nothing in the scene
//!    is smooth: all techniques of one length agree, per block and in the mean.
//! 2. The path tracer and the bidirectional one agree, on everything.
//!
//! Levels: z-scores per block consistent with N(0, 1) at a family-wise level of 1e-3 per comparison;
//! bias of the mean excluded at 99 % confidence beyond what each test states.

mod common;

use caustica::math::luminance;
use caustica::render::Image;
use caustica::render::job::{Integrator, Settings, Technique};
use common::oracle::{check_bias, check_integrators, t_quantile};
use common::stats::{block_means, check_normal, mean_and_error};
use common::{Builder, run, scenes, settings};
use std::collections::BTreeMap;

const RUNS: u64 = 16;
const BLOCK: u32 = 4;

/// All techniques of paths of 2 to `longest` segments.
///
/// Differences are taken within a run, where techniques share their subpaths, and their error over
/// runs: whatever correlates cancels, and the differences follow Student's t with RUNS - 1 degrees.
fn techniques_agree(name: &str, builder: &Builder, longest: u32, samples: u32, limit: f64) {
    let world = builder.commit();
    let base = Settings { per_technique: true, max_depth: longest, ..settings(Integrator::Bdpt, 24, samples, 0) };
    let start = std::time::Instant::now();
    let runs: Vec<BTreeMap<Technique, (Image, Image)>> =
        (0..RUNS).map(|seed| run(&world, &Settings { seed, ..base.clone() }).techniques).collect();
    eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    let degrees = RUNS as f64 - 1.0;
    let mut wrong = Vec::new();
    for length in 2..=longest {
        let unweighted = |run: &BTreeMap<Technique, (Image, Image)>, s: u32| {
            let image = run.get(&(s, length + 1 - s)).map(|images| &images.1);
            block_means(image.unwrap_or_else(|| panic!("{name}: no technique s = {s} of length {length}")), BLOCK)
        };
        // [s][run][block]
        let means: Vec<Vec<Vec<f64>>> = (0..=length).map(|s| runs.iter().map(|r| unweighted(r, s)).collect()).collect();
        for (s, r) in (0..=length).flat_map(|s| (0..s).map(move |r| (s, r))) {
            let name = format!("{name}, length {length}, s = {s} against s = {r}");
            let (a, b) = (&means[s as usize], &means[r as usize]);
            let difference = |block: usize| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a[block] - b[block]).collect() };
            let z: Vec<f64> = (0..a[0].len())
                .map(|block| mean_and_error(&difference(block)))
                .map(|(d, error)| if error > 0.0 { d / error } else { 0.0 })
                .collect();
            let average = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            let totals: Vec<f64> = a.iter().zip(b).map(|(a, b)| average(a) - average(b)).collect();
            let (d, error) = mean_and_error(&totals);
            let level = average(&b.iter().map(|b| average(b)).collect::<Vec<_>>());
            wrong.extend(check_normal(&name, &z, degrees).err());
            wrong.extend(check_bias(&name, d / level, error / level, degrees, limit).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn techniques_on_diffuse_surfaces() {
    techniques_agree("diffuse", &scenes::diffuse(), 4, 64, 0.02);
}

#[test]
fn techniques_on_glossy_surfaces() {
    techniques_agree("glossy", &scenes::glossy(), 4, 64, 0.02);
}

#[test]
fn techniques_with_shading_normals() {
    techniques_agree("smooth normals", &scenes::smooth_normals(), 4, 64, 0.02);
}

#[test]
fn techniques_through_rough_absorbing_glass() {
    techniques_agree("rough glass", &scenes::rough_glass(), 4, 64, 0.05);
}

#[test]
fn techniques_within_an_absorbing_medium() {
    techniques_agree("murky", &scenes::murky(), 3, 64, 0.02);
}

fn integrators_agree(name: &str, builder: &Builder, samples: [u32; 2]) {
    let base = Settings { max_depth: 7, ..settings(Integrator::Path, 32, 1, 0) };
    check_integrators(name, &builder.commit(), &base, samples, RUNS, BLOCK).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn integrators_on_glossy_surfaces() {
    integrators_agree("glossy", &scenes::glossy(), [64, 64]);
}

#[test]
fn integrators_with_shading_normals() {
    integrators_agree("smooth normals", &scenes::smooth_normals(), [64, 64]);
}

#[test]
fn integrators_with_rough_glass() {
    integrators_agree("rough glass", &scenes::rough_glass(), [64, 64]);
}

#[test]
fn integrators_with_smooth_glass() {
    integrators_agree("smooth glass", &scenes::smooth_glass(), [64, 64]);
}

#[test]
fn integrators_with_absorbing_glass() {
    integrators_agree("absorbing glass", &scenes::absorbing_glass(), [64, 64]);
}

#[test]
fn integrators_within_an_absorbing_medium() {
    integrators_agree("murky", &scenes::murky(), [64, 64]);
}

#[test]
fn integrators_with_delta_lights() {
    integrators_agree("delta lights", &scenes::delta_lights(), [64, 64]);
}

#[test]
fn integrators_with_an_environment() {
    integrators_agree("environment", &scenes::environment(), [64, 64]);
}

#[test]
fn integrators_with_the_camera_in_glass() {
    integrators_agree("camera in glass", &scenes::camera_in_glass(), [64, 64]);
}

#[test]
fn integrators_with_a_light_in_glass() {
    integrators_agree("light in glass", &scenes::light_in_glass(), [64, 64]);
}

#[test]
fn integrators_in_parallel_projection() {
    integrators_agree("orthographic", &scenes::orthographic(), [64, 64]);
}
