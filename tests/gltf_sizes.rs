//! glTF files that claim more than any machine holds: errors, not allocations.
//!
//! A process of its own: the address space is measured, to which each thread of a test adds.

#![cfg(target_os = "linux")]

#[allow(dead_code)]
#[path = "gltf/builder.rs"]
mod builder;

use builder::{Builder, glb_of, message};
use caustica::io::gltf::load_slice;
use serde_json::{Value, json};

/// The indexed triangle with one number changed.
fn edit(pointer: &str, value: u64) -> Vec<u8> {
    let mut builder = Builder::triangle();
    let indices = builder.indices(5125, &[0, 1, 2]);
    builder.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    builder.json["bufferViews"][0]["byteStride"] = json!(12);
    builder.json["accessors"][0]["byteOffset"] = json!(0);
    builder.json["buffers"] = json!([{"byteLength": builder.bin.len()}]);
    *builder.json.pointer_mut(pointer).unwrap() = json!(value);
    glb_of(builder.json.to_string().as_bytes(), &builder.bin)
}

/// Primitives of `count` vertices each, all zeros but the first.
fn zeros(count: u64, primitives: usize) -> Vec<u8> {
    let mut builder = Builder::triangle();
    let index = builder.view(&[0]);
    // Over the same accessor they would be one mesh.
    builder.json["accessors"] = Value::from(vec![
        json!({"componentType": 5126, "type": "VEC3", "count": count, "sparse": {
        "count": 1, "indices": {"bufferView": index, "componentType": 5121}, "values": {"bufferView": 0}}});
        primitives
    ]);
    let primitive = |accessor: usize| json!({"attributes": {"POSITION": accessor}});
    builder.json["meshes"][0]["primitives"] = (0..primitives).map(primitive).collect::<Vec<_>>().into();
    builder.glb()
}

/// Nodes of a mesh of as many primitives.
fn square(side: usize) -> Vec<u8> {
    let mut builder = Builder::triangle();
    builder.json["meshes"][0]["primitives"] = vec![json!({"attributes": {"POSITION": 0}}); side].into();
    for _ in 1..side {
        builder.root(json!({"mesh": 0}));
    }
    builder.glb()
}

/// Kilobytes of the address space at its largest.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

#[test]
fn absurd_sizes_are_errors_not_allocations() {
    let files = [
        ("vertices", "accessor 0: ", edit("/accessors/0/count", u32::MAX.into())),
        ("more vertices", "accessor 0: ", edit("/accessors/0/count", u64::MAX)),
        ("indices", "accessor 1: ", edit("/accessors/1/count", u32::MAX.into())),
        ("offset in a view", "accessor 0: ", edit("/accessors/0/byteOffset", u64::MAX)),
        ("stride", "accessor 0: ", edit("/bufferViews/0/byteStride", u64::MAX)),
        ("view", "bufferView 0: ", edit("/bufferViews/0/byteLength", 1 << 62)),
        ("offset", "bufferView 0: ", edit("/bufferViews/0/byteOffset", u64::MAX)),
        ("buffer", "buffer 0: ", edit("/buffers/0/byteLength", 1 << 62)),
        ("zeros", "mesh 0: memory needed", zeros(u32::MAX.into(), 1)),
        // No single primitive is too large.
        ("zeros many times", "mesh 0: memory needed", zeros(10_000_000, 8)),
        ("instances", "node ", square(3000)),
        ("objects", "not a readable", [b"{\"nodes\":[".to_vec(), b"{},".repeat(6 << 20), b"{}]}".to_vec()].concat()),
    ];
    // What is not absurd loads.
    assert!(load_slice(&edit("/accessors/0/count", 3), None).is_ok());
    assert!(load_slice(&zeros(1000, 2), None).is_ok());
    assert!(load_slice(&square(30), None).is_ok());
    for (what, start, bytes) in files {
        let before = peak();
        let error = message(load_slice(&bytes, None));
        assert!(error.starts_with(start), "{what}: {error}");
        let grown = peak() - before;
        assert!(grown < 1 << 20, "{what}: the address space grew by {grown} kB");
        println!("{what}: {grown} kB: {error}");
    }
}
