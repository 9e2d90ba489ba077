//! Damaged scene files from the file to the picture: an error that says what, or a harmless scene that
//! renders; never a panic, a crash or an output file of a failed render.

mod common;

use caustica::io::gltf;
use caustica::math::{Sampler, Stream};
use caustica::render::{Cancel, Integrator, render};
use caustica::scene::{CommitOptions, World};
use common::settings;
use std::path::{Path, PathBuf};
use std::process::Command;

const FILES: u32 = 200;

fn original(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).expect("a scene of this repository")
}

/// The n-th damage: cut off, bytes changed, a number of the JSON made absurd, or a stretch of the
/// vertex data filled with NaN or infinity.
fn damaged(n: u32) -> Vec<u8> {
    // Without OpenImageIO there are no images to be damaged.
    let names = ["cornell.glb", "glass_sphere.glb", "slab.glb", "furnace.glb", "stained_glass.glb"];
    let count = if cfg!(feature = "oiio") { 5 } else { 4 };
    let mut bytes = original(names[(n % count) as usize]);
    let mut s = Sampler::new(99, n, 0, Stream::Camera);
    let mut below = |k: usize| (s.next_1d() * k as f32) as usize;
    match n / count % 5 {
        0 => bytes.truncate(below(bytes.len())),
        1 => {
            for _ in 0..1 + below(8) {
                let at = below(bytes.len());
                bytes[at] = below(256) as u8;
            }
        }
        2 => {
            let json = 20..20 + u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
            let digits: Vec<usize> = json.filter(|&i| bytes[i].is_ascii_digit()).collect();
            for _ in 0..1 + below(3) {
                bytes[digits[below(digits.len())]] = b'9';
            }
        }
        3 => {
            let end = bytes.len();
            let start = end - (4 * (1 + below(64))).min(end / 2);
            let value = [f32::NAN, f32::INFINITY, 3e38][below(3)];
            for word in bytes[start..].chunks_exact_mut(4) {
                word.copy_from_slice(&value.to_le_bytes());
            }
        }
        _ => {
            // Indices and lengths of the binary chunk.
            let at = bytes.len() / 2 + below(bytes.len() / 2 - 4);
            bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        }
    }
    bytes
}

#[test]
fn two_hundred_damaged_files_render_or_say_why_not() {
    let (mut refused, mut rendered) = (0, 0);
    for n in 0..FILES {
        let description = match gltf::load_slice(&damaged(n), None) {
            Ok(loaded) => loaded.description,
            Err(error) => {
                assert!(error.to_string().len() > 10, "file {n}: {error}");
                refused += 1;
                continue;
            }
        };
        match World::commit(&description, CommitOptions::default()) {
            Err(error) => {
                assert!(error.to_string().len() > 10, "file {n}: {error}");
                refused += 1;
            }
            Ok(world) if world.cameras.is_empty() => refused += 1,
            Ok(world) => {
                render(&world, &settings(Integrator::Bdpt, 6, 1, 0), &Cancel::default(), &|_| ()).expect("a render");
                rendered += 1;
            }
        }
    }
    println!("{refused} refused, {rendered} rendered");
    assert!(refused > FILES / 4 && rendered > 0, "{refused} refused, {rendered} rendered: the damage tests nothing");
}

#[test]
fn the_command_line_fails_cleanly_and_leaves_no_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("out.exr");
    let mut failed = 0;
    let cases = (0..FILES).step_by(9).map(|n| (format!("{n}.glb"), Some(damaged(n))));
    for (name, bytes) in cases.chain([("missing.glb".to_owned(), None)]) {
        let scene: PathBuf = folder.path().join(name);
        if let Some(bytes) = bytes {
            std::fs::write(&scene, bytes).expect("a file");
        }
        let run = Command::new(env!("CARGO_BIN_EXE_caustica"))
            .args(["render", "--size", "6x6", "--spp", "1", "--quiet", "-o"])
            .args([&output, &scene])
            .output()
            .expect("the program");
        let stderr = String::from_utf8_lossy(&run.stderr);
        match run.status.code() {
            Some(0) => std::fs::remove_file(&output).expect("the picture"),
            Some(1) => {
                failed += 1;
                assert!(!output.exists(), "{}: an output file of a failed render", scene.display());
                assert!(stderr.contains("caustica") && !stderr.contains("panicked"), "{stderr}");
            }
            code => panic!("{}: exit code {code:?}: {stderr}", scene.display()),
        }
        let left: Vec<_> = std::fs::read_dir(folder.path()).expect("the folder").flatten().collect();
        assert!(left.iter().all(|e| e.path().extension().is_some_and(|x| x == "glb")), "{left:?}");
    }
    assert!(failed > 5, "only {failed} of the damaged files failed");
}
