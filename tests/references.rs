//! Both integrators against images of another renderer (Mitsuba 3; tests/references/README.md).
//!
//! Per block of 8 x 8 pixels: z-scores with both renderers' errors, consistent with N(0, 1) at a
//! family-wise level of 1e-3. Per channel: bias of the image mean below 0.2 % at 95 % confidence.
// The second backend is held against the first ray by ray, in `backends.rs`.
#![cfg(feature = "embree")]

mod common;

use caustica::io::{gltf, image};
use caustica::math::luminance;
use caustica::render::{Caustics, Image, Integrator, Settings};
use caustica::scene::{CommitOptions, World};
use common::oracle::{BIAS_LIMIT, channel_means, check_bias, check_reference, renders};
use common::stats::{Blocks, block_means, blocks};
use std::path::{Path, PathBuf};

const BLOCK: u32 = 8;
const RUNS: u64 = 16;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

struct Reference {
    blocks: Blocks,
    /// Mean and standard error per channel.
    means: [(f64, f64); 3],
    size: u32,
    max_depth: u32,
}

impl Reference {
    fn load(name: &str) -> Reference {
        let folder = root().join("tests/references");
        let read = |file: &Path| image::read(file).unwrap_or_else(|e| panic!("{e}"));
        let mean = read(&folder.join(format!("{name}.exr")));
        let error = read(&folder.join(format!("{name}_stderr.exr")));
        let table = std::fs::read_to_string(folder.join("references.json")).expect("references.json");
        let table: serde_json::Value = serde_json::from_str(&table).expect("JSON");
        let entry = &table[name];
        let number = |key: &str| entry[key].as_u64().unwrap_or_else(|| panic!("{name}: no {key}")) as u32;
        let channel = |key: &str, c: usize| entry[key][c].as_f64().unwrap_or_else(|| panic!("{name}: no {key}"));
        let means = [0, 1, 2].map(|c| (channel("mean", c), channel("mean_stderr", c)));
        let (size, max_depth) = (number("size"), number("max_depth"));
        assert_eq!((mean.width, mean.height, error.width, error.height), (size, size, size, size));
        Reference { blocks: reference_blocks(&mean, &error), means, size, max_depth }
    }
}

/// Pixels of the reference are independent; its channels are not, and their errors are added, which
/// is the upper bound for the luminance.
fn reference_blocks(mean: &Image, error: &Image) -> Blocks {
    let squares = error.pixels.iter().map(|&e| glam::Vec3::splat(luminance(e).powi(2))).collect();
    let squares = Image::new(error.width, error.height, squares);
    let pixels = f64::from(BLOCK * BLOCK);
    let error: Vec<f64> = block_means(&squares, BLOCK).iter().map(|s| (s / pixels).sqrt()).collect();
    let mean = block_means(mean, BLOCK);
    let n = mean.len() as f64;
    let total_error = error.iter().map(|e| e * e).sum::<f64>().sqrt() / n;
    Blocks { total: (mean.iter().sum::<f64>() / n, total_error), mean, error }
}

/// How one integrator is held against a reference.
struct Estimate {
    integrator: Integrator,
    caustics: Caustics,
    /// Per pixel and run.
    samples: u32,
    first_seed: u64,
    /// Bias of the mean that is excluded.
    limit: f64,
}

fn path(samples: u32) -> Estimate {
    Estimate { integrator: Integrator::Path, caustics: Caustics::Off, samples, first_seed: 100, limit: BIAS_LIMIT }
}

fn bdpt(samples: u32) -> Estimate {
    Estimate { integrator: Integrator::Bdpt, caustics: Caustics::Off, samples, first_seed: 200, limit: BIAS_LIMIT }
}

fn check(name: &str, estimate: Estimate) {
    let reference = Reference::load(name);
    let file = root().join(format!("scenes/{name}.glb"));
    let loaded = gltf::load(&file).unwrap_or_else(|e| panic!("{e}"));
    let world = World::commit(&loaded.description, CommitOptions::default()).expect("a valid scene");
    let Estimate { integrator, caustics, samples, first_seed, limit } = estimate;
    let name = format!("{name}, {integrator:?}");
    let start = std::time::Instant::now();
    let settings = Settings {
        integrator,
        width: reference.size,
        height: reference.size,
        samples,
        max_depth: reference.max_depth,
        caustics,
        ..Settings::default()
    };
    let images = renders(&world, &settings, first_seed..first_seed + RUNS);
    eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    let degrees = RUNS as f64 - 1.0;
    let mut wrong = Vec::new();
    wrong.extend(check_reference(&name, &blocks(&images, BLOCK), &reference.blocks, degrees, limit).err());
    for ((channel, ours), theirs) in "RGB".chars().zip(channel_means(&images)).zip(reference.means) {
        let (difference, error) = ((ours.0 - theirs.0) / theirs.0, ours.1.hypot(theirs.1) / theirs.0);
        wrong.extend(check_bias(&format!("{name}, {channel}"), difference, error, degrees, limit).err());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn cornell_path() {
    check("cornell", path(80));
}

#[test]
fn cornell_bdpt() {
    check("cornell", bdpt(50));
}

#[test]
fn rough_glass_path() {
    check("rough_glass", path(160));
}

#[test]
fn rough_glass_bdpt() {
    check("rough_glass", bdpt(52));
}

#[test]
fn smooth_normals_path() {
    check("smooth_normals", path(32));
}

#[test]
fn smooth_normals_bdpt() {
    check("smooth_normals", bdpt(60));
}

/// An image all around, whose sun is a few degrees wide.
#[test]
fn sky_path() {
    check("sky", path(64));
}

#[test]
fn sky_bdpt() {
    check("sky", bdpt(48));
}

/// Glass that an image colours, over tiles. (A path tracer has blocks whose light it finds too seldom for statistics.)
#[test]
#[cfg(feature = "oiio")]
fn stained_glass_large_bdpt() {
    check("stained_glass_large", bdpt(60));
}

#[test]
#[cfg(feature = "oiio")]
fn stained_glass_large_caustic_connections() {
    check("stained_glass_large", Estimate { caustics: Caustics::On, ..bdpt(72) });
}

/// The lamp lights a panel only; everything else is lit by the panel, also through smooth glass. A
/// path tracer finds the panel by chance, so that the excluded bias is larger here.
#[test]
fn figure4a_large_path() {
    check("figure4a_large", Estimate { limit: 0.007, ..path(250) });
}

/// The same at full power: about three minutes on two cores.
#[test]
#[ignore = "minutes"]
fn figure4a_large_path_long() {
    check("figure4a_large", path(9000));
}

#[test]
fn figure4a_large_bdpt() {
    check("figure4a_large", bdpt(350));
}
