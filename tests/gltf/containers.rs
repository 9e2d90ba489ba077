//! Containers, buffers, versions, extensions.

use crate::builder::{Builder, CORNERS, assert_warns, glb_of, message};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use caustica::io::gltf::{GltfError, load, load_slice};
use serde_json::json;
use std::fs;
use std::path::Path;

/// The triangle as `.gltf`, its buffer at `uri`.
fn text(uri: &str) -> Vec<u8> {
    let mut document = Builder::triangle().json;
    document["buffers"] = json!([{"byteLength": 36, "uri": uri}]);
    serde_json::to_vec_pretty(&document).unwrap()
}

#[test]
fn buffers_in_data_uris() {
    let bin = Builder::triangle().bin;
    let padded = BASE64_STANDARD.encode([&bin[..], b"x"].concat());
    assert!(padded.ends_with("=="));
    for uri in [
        format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(&bin)),
        format!("data:application/gltf-buffer;base64,{padded}"),
        format!("data:;base64,{}", padded.trim_end_matches('=')),
    ] {
        let loaded = load_slice(&text(&uri), None).unwrap();
        assert_eq!(loaded.description.meshes[0].positions, CORNERS);
    }
    let error = |uri| message(load_slice(&text(uri), None));
    assert!(error("data:;base64,AA*A").starts_with("buffer 0: uri is broken base64; "));
    assert_eq!(error("data:;base64,AAAA"), "buffer 0: byteLength is 36; its data has 3 bytes");
    assert_eq!(
        error("data:text/plain,A"),
        "buffer 0: a data URI of type 'text/plain' (only base64 is) is not supported"
    );
    assert_eq!(error("data:;base64"), "buffer 0: uri is data:;base64; expected a comma before the data");
}

#[test]
fn buffers_in_files_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let bin = Builder::triangle().bin;
    fs::create_dir(folder.path().join("data")).unwrap();
    for name in ["tri.bin", "two words.bin", "data/t\u{e9}.bin"] {
        fs::write(folder.path().join(name), &bin).unwrap();
    }
    let scene = folder.path().join("scene.gltf");
    for uri in ["tri.bin", "./tri.bin", "two%20words.bin", "two words.bin", "data/t%C3%A9.bin", "data/t\u{e9}.bin"] {
        fs::write(&scene, text(uri)).unwrap();
        assert_eq!(load(&scene).unwrap().description.meshes[0].positions, CORNERS, "{uri}");
    }
    fs::write(&scene, text("absent.bin")).unwrap();
    let error = load(&scene).unwrap_err();
    assert!(matches!(&error, GltfError::Io { path, .. } if path.ends_with("absent.bin")), "{error}");
    fs::write(&scene, text("data")).unwrap();
    assert!(message(load(&scene)).ends_with("data: not a regular file"));
    fs::write(folder.path().join("short.bin"), &bin[..35]).unwrap();
    fs::write(&scene, text("short.bin")).unwrap();
    assert_eq!(message(load(&scene)), "buffer 0: byteLength is 36; its data has 35 bytes");
    assert_eq!(
        message(load_slice(&text("tri.bin"), None)),
        "buffer 0: a file beside a scene in memory is not supported"
    );
}

#[test]
fn buffers_outside_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    fs::create_dir(&inner).unwrap();
    fs::write(folder.path().join("tri.bin"), Builder::triangle().bin).unwrap();
    let absolute = folder.path().join("tri.bin").display().to_string();
    let encoded = absolute.replace('/', "%2F");
    let uris = ["../tri.bin", "%2e%2e/tri.bin", "..%2Ftri.bin", "a/../../tri.bin", "", ".", "a/..", "a%00b"];
    for uri in uris.into_iter().chain([absolute.as_str(), encoded.as_str()]) {
        let error = message(load_slice(&text(uri), Some(&inner)));
        let expected = "expected a path inside the scene's folder: copy the file there";
        assert_eq!(error, format!("buffer 0: uri is '{uri}'; {expected}"));
    }
    let error = message(load_slice(&text("a\\tri.bin"), Some(&inner)));
    assert_eq!(error, "buffer 0: uri is 'a\\tri.bin'; expected / between folders, not \\");
    // A way out and back in, and a percent sign that is one.
    for (uri, name) in [("a/../in.bin", "in.bin"), ("50%.bin", "50%.bin"), ("5%25%2.bin", "5%%2.bin"), ("%+1", "%+1")] {
        fs::write(inner.join(name), Builder::triangle().bin).unwrap();
        assert!(load_slice(&text(uri), Some(&inner)).is_ok(), "{uri}");
    }
    for scheme in ["http", "file"] {
        let error = message(load_slice(&text(&format!("{scheme}://tri.bin")), Some(&inner)));
        assert_eq!(error, format!("buffer 0: a URI with the scheme '{scheme}' is not supported"));
    }
}

#[test]
fn one_file_for_many_buffers_is_read_once() {
    // 1000 names of one file of 8 MB: 8 GB, were each read.
    let folder = tempfile::tempdir().unwrap();
    let mut bin = Builder::triangle().bin;
    bin.resize(8 << 20, 0);
    fs::write(folder.path().join("tri.bin"), bin).unwrap();
    let mut document = Builder::triangle().json;
    let buffer = |i: usize| json!({"byteLength": 8 << 20, "uri": format!("{}tri.bin", "./".repeat(i))});
    document["buffers"] = (0..1000).map(buffer).collect();
    let loaded = load_slice(&serde_json::to_vec(&document).unwrap(), Some(folder.path())).unwrap();
    assert_eq!(loaded.description.meshes[0].positions, CORNERS);
}

#[test]
fn the_binary_chunk_is_the_first_buffer_only() {
    let mut document = Builder::triangle().json;
    document["buffers"] = json!([{"byteLength": 36}, {"byteLength": 36}]);
    let bin = Builder::triangle().bin;
    assert!(load_slice(&glb_of(&serde_json::to_vec(&document).unwrap(), &bin), None).is_ok());
    document["bufferViews"][0]["buffer"] = json!(1);
    let error = message(load_slice(&glb_of(&serde_json::to_vec(&document).unwrap(), &bin), None));
    assert_eq!(error, "buffer 1: uri is missing; the file has no bytes for it");
    document["buffers"][0]["byteLength"] = json!(37);
    let error = message(load_slice(&glb_of(&serde_json::to_vec(&document).unwrap(), &bin), None));
    assert_eq!(error, "buffer 0: byteLength is 37; its data has 36 bytes");
}

#[test]
fn chunks_of_other_types_are_ignored() {
    let mut bytes = Builder::triangle().glb();
    bytes.extend([4, 0, 0, 0]);
    bytes.extend(b"XTRAabcd");
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    assert_eq!(load_slice(&bytes, None).unwrap().description.meshes[0].positions, CORNERS);
}

#[test]
fn what_is_not_gltf_says_so() {
    let error = |bytes: &[u8]| message(load_slice(bytes, None));
    let head = "not a readable glTF 2.0 file: ";
    assert_eq!(error(b""), format!("{head}it is empty"));
    assert_eq!(error(b"\x89PNG\r\n"), format!("{head}it begins with neither 'glTF' nor a JSON object"));
    assert_eq!(error(b"glTF\x02\0\0\0"), format!("{head}it ends within its header"));
    let glb = Builder::triangle().glb();
    let with_word = |at: usize, value: u32| {
        let mut bytes = glb.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        error(&bytes)
    };
    assert_eq!(with_word(4, 1), format!("{head}its container version is 1; expected 2"));
    // Below 12 the crate's own reader subtracts past zero.
    assert_eq!(with_word(8, 3), format!("{head}its header says 3 bytes, the file has {}", glb.len()));
    assert_eq!(with_word(8, u32::MAX), format!("{head}its header says 4294967295 bytes, the file has {}", glb.len()));
    assert_eq!(with_word(12, u32::MAX), format!("{head}chunk 0 says 4294967295 bytes, {} are left", glb.len() - 20));
    assert_eq!(with_word(16, u32::from_le_bytes(*b"NOSJ")), format!("{head}chunk 0 is 'NOSJ'; expected 'JSON'"));
    assert!(error(b"{\"asset\": ").starts_with(&format!("{head}its JSON does not fit: EOF")));
    let deep = [b"{\"extras\":".to_vec(), vec![b'['; 1 << 20]].concat();
    assert!(error(&deep).starts_with(&format!("{head}its JSON does not fit: ")));
    let absent = Path::new("no/such/file.glb");
    assert!(matches!(load(absent), Err(GltfError::Io { path, .. }) if path == absent));
    assert!(message(load(Path::new("."))).ends_with("not a regular file"));
}

#[test]
fn other_versions_are_refused() {
    let mut builder = Builder::triangle();
    for version in ["1.0", "3.0", "two"] {
        builder.json["asset"]["version"] = json!(version);
        assert_eq!(builder.error(), format!("asset: glTF version {version} is not supported"));
    }
    builder.json["asset"]["version"] = json!("2.1");
    assert!(builder.load().is_ok());
    builder.json["asset"]["minVersion"] = json!("2.1");
    assert_eq!(builder.error(), "asset: glTF version 2.1, which the file requires, is not supported");
    // glTF 1.0 keeps its objects in maps, which do not even parse as 2.0.
    let old = br#"{"asset": {"version": "1.0"}, "nodes": {"a": {}}}"#;
    assert_eq!(message(load_slice(old, None)), "asset: glTF version 1.0 is not supported");
}

#[test]
fn a_byte_order_mark_and_scenes_without_nodes_are_taken() {
    let text = "\u{feff}{\"asset\": {\"version\": \"2.0\"}, \"scenes\": [{}]}";
    assert!(load_slice(text.as_bytes(), None).unwrap().description.instances.is_empty());
}

#[test]
fn extensions_are_supported_required_or_told() {
    let mut builder = Builder::triangle();
    // The crate's validator refuses two of these.
    let supported = json!([
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_volume"
    ]);
    builder.json["extensionsUsed"] = supported.clone();
    builder.json["extensionsRequired"] = supported;
    assert_eq!(builder.load().unwrap().warnings, [""; 0]);
    builder.json["extensionsUsed"] = json!(["KHR_materials_clearcoat"]);
    assert_warns(&builder.load().unwrap(), &["extension 'KHR_materials_clearcoat' is not supported and ignored"]);
    builder.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    assert_eq!(
        builder.error(),
        "asset: extension 'KHR_draco_mesh_compression', which the file requires, is not supported"
    );
    // Textures are left out, with what moves them.
    builder.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
    builder.json["extensionsUsed"] = json!(["KHR_texture_transform\u{1b}]0;title"]);
    assert_warns(&builder.load().unwrap(), &["extension 'KHR_texture_transform\\u{1b}]0;title'"]);
}

#[test]
fn skins_and_animations_are_told() {
    let mut builder = Builder::triangle();
    builder.json["nodes"][0]["skin"] = json!(0);
    builder.json["skins"] = json!([{"joints": [0]}]);
    builder.json["animations"] = json!([{"channels": [], "samplers": []}, {"channels": [], "samplers": []}]);
    let loaded = builder.load().unwrap();
    assert_warns(&loaded, &["skins are ignored (1 in the file)"]);
    assert_warns(&loaded, &["animations are ignored (2 in the file)"]);
}

#[test]
fn an_index_of_more_than_32_bits_is_not_cut() {
    // The typed document would read 2^32 as 0.
    for pointer in ["/nodes/0/mesh", "/scene", "/scenes/0/nodes/0", "/accessors/0/bufferView"] {
        let mut builder = Builder::triangle();
        *builder.json.pointer_mut(pointer).unwrap() = json!(1u64 << 32);
        assert!(builder.error().ends_with("is 4294967296; expected at most 32 bits"), "{pointer}");
    }
    let mut builder = Builder::triangle();
    builder.json["meshes"][0]["extras"] = json!({"id": 1u64 << 40, "\"mesh": "\\\": 99999999999"});
    assert!(builder.load().is_ok());
}
