//! Estimators that share little must have the same expectation.
//!
//! 1. Each technique (s, t) without its weight makes all paths of its length, if nothing in the scene
//!    is smooth: all techniques of one length agree, per block and in the mean.
//! 2. The path tracer and the bidirectional one agree, on everything.
//!
//! Levels: tests/common/oracle.rs.
// The second backend is held against the first ray by ray, in `backends.rs`.
#![cfg(feature = "embree")]

mod common;

use caustica::render::{Integrator, Settings, Technique, TechniqueImages};
use caustica::scene::description::Lens;

use common::oracle::{check_integrators, check_paired_blocks, first_seed};
use common::stats::block_means;
use common::{Builder, run, scenes, settings};
use glam::DVec2;
use std::collections::BTreeMap;

const RUNS: u64 = 16;
const BLOCK: u32 = 4;
/// Techniques have heavier tails, and smaller images.
const TECHNIQUE_BLOCK: u32 = 6;

/// All techniques of each length from 2 on, pair by pair. `limits`: relative bias of the mean that is
/// excluded, for lengths 2, 3, ...; s = 0, which has to find the lamp, decides how small it can be.
fn techniques_agree(name: &str, builder: &Builder, samples: u32, limits: &[f64]) {
    let world = builder.commit();
    let longest = limits.len() as u32 + 1;
    let base = Settings { per_technique: true, max_depth: longest, ..settings(Integrator::Bdpt, 24, samples, 0) };
    let first = first_seed(name);
    let runs: Vec<BTreeMap<Technique, TechniqueImages>> =
        (first..first + RUNS).map(|seed| run(&world, &Settings { seed, ..base.clone() }).techniques).collect();
    let mut wrong = Vec::new();
    for (length, &limit) in (2..).zip(limits) {
        // Per technique and run.
        let means: Vec<Vec<Vec<f64>>> = (0..=length)
            .map(|s| {
                let t = length + 1 - s;
                let unweighted = |techniques: &BTreeMap<Technique, TechniqueImages>| {
                    let images = techniques.get(&(s, t));
                    block_means(
                        &images.unwrap_or_else(|| panic!("{name}: no paths of ({s}, {t})")).unweighted,
                        TECHNIQUE_BLOCK,
                    )
                };
                runs.iter().map(unweighted).collect()
            })
            .collect();
        for (s, r) in (0..=length as usize).flat_map(|s| (0..s).map(move |r| (s, r))) {
            let name = format!("{name}, length {length}, s = {s} against s = {r}");
            wrong.extend(check_paired_blocks(&name, &means[s], &means[r], limit).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn techniques_on_diffuse_surfaces() {
    techniques_agree("diffuse", &scenes::diffuse(), 256, &[0.015, 0.03, 0.08]);
}

#[test]
fn techniques_on_glossy_surfaces() {
    techniques_agree("glossy", &scenes::glossy(), 256, &[0.015, 0.03, 0.08]);
}

#[test]
fn techniques_with_shading_normals() {
    // Of 256 samples the mean of unweighted connections of 3 segments had errors of 0.8 to 2 %, by single bright paths.
    techniques_agree("smooth normals", &scenes::smooth_normals(), 1024, &[0.015, 0.04]);
}

#[test]
fn techniques_through_rough_absorbing_glass() {
    techniques_agree("through rough glass", &scenes::lamp_behind_rough_glass(), 256, &[0.02, 0.04]);
}

#[test]
fn techniques_within_an_absorbing_medium() {
    techniques_agree("murky", &scenes::murky(), 256, &[0.015, 0.04]);
}

fn integrators_agree(name: &str, builder: &Builder, samples: u32) {
    let base = Settings { max_depth: 7, ..settings(Integrator::Path, 32, samples, 0) };
    check_integrators(name, &builder.commit(), &base, RUNS, BLOCK).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn integrators_with_textures() {
    integrators_agree("textured", &scenes::textured(), 128);
}

#[test]
fn integrators_on_glossy_surfaces() {
    integrators_agree("glossy", &scenes::glossy(), 128);
}

#[test]
fn integrators_with_shading_normals() {
    integrators_agree("smooth normals", &scenes::smooth_normals(), 256);
}

#[test]
fn integrators_through_glass_with_shading_normals() {
    integrators_agree("leaning slab", &scenes::leaning_slab(), 768);
}

#[test]
fn integrators_with_rough_glass() {
    integrators_agree("rough glass", &scenes::rough_glass(), 128);
}

#[test]
fn integrators_with_smooth_glass() {
    integrators_agree("smooth glass", &scenes::smooth_glass(), 160);
}

#[test]
fn integrators_with_absorbing_glass() {
    integrators_agree("absorbing glass", &scenes::absorbing_glass(), 128);
}

#[test]
fn integrators_within_an_absorbing_medium() {
    integrators_agree("murky", &scenes::murky(), 128);
}

#[test]
fn integrators_with_delta_lights() {
    integrators_agree("delta lights", &scenes::delta_lights(), 256);
}

#[test]
fn integrators_with_an_environment() {
    integrators_agree("environment", &scenes::environment(), 64);
}

#[test]
fn integrators_with_an_image_of_the_sky() {
    integrators_agree("under a sky", &scenes::under_a_sky(), 96);
}

#[test]
fn integrators_with_the_camera_in_glass() {
    integrators_agree("camera in glass", &scenes::camera_in_glass(), 160);
}

#[test]
fn integrators_with_everything_but_the_lamp_in_glass() {
    integrators_agree("aquarium", &scenes::aquarium(), 384);
}

#[test]
fn integrators_with_a_light_in_glass() {
    integrators_agree("light in glass", &scenes::light_in_glass(), 128);
}

#[test]
fn integrators_with_a_light_across_a_boundary() {
    integrators_agree("light across a boundary", &scenes::light_across_a_boundary(), 96);
}

#[test]
fn integrators_with_sphere_lights() {
    integrators_agree("sphere lights", &scenes::sphere_lights(), 128);
}

#[test]
fn integrators_through_a_lens() {
    let mut b = scenes::smooth_glass();
    for camera in &mut b.0.cameras {
        camera.lens = Some(Lens { radius: 0.2, focus: 2.0 });
        camera.shift = DVec2::new(-0.1, 0.2);
    }
    integrators_agree("lens", &b, 160);
}

#[test]
fn integrators_in_parallel_projection() {
    integrators_agree("orthographic", &scenes::orthographic(), 160);
}
