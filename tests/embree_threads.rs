//! A plugin starts no threads behind its host's back: this file holds one test, so that nothing else in
//! its process does.
#![cfg(all(feature = "embree", target_os = "linux"))]

use caustica::geometry::{Mesh, Shape};
use caustica::intersect::{Backend, Build, build};
use glam::Vec3;

#[test]
fn a_build_with_one_thread_starts_none() {
    let threads = || std::fs::read_dir("/proc/self/task").map(|d| d.count()).unwrap();
    // A grid large enough for Embree to share the work of building, if it may.
    let n = 300u32;
    let positions = (0..n * n).map(|i| Vec3::new((i % n) as f32, (i % 7 * i % 5) as f32, (i / n) as f32)).collect();
    let triangles = (0..n * (n - 1) - 1).map(|i| [i, i + 1, i + n]).collect();
    let shapes = [Shape::Mesh(Mesh { positions, normals: vec![], triangles }.into())];
    let before = threads();
    let structure = build(Backend::Embree, &shapes, Build::Static, 1).unwrap();
    assert_eq!(threads(), before, "{}", structure.describe());
}
