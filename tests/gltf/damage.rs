//! Damaged files: each gives an error or a harmless description; none a panic, an abort or a
//! large allocation. All mutations are deterministic.

use crate::builder::{Builder, CORNERS, bytes_of, glb_of};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use caustica::io::gltf::{GltfError, load_slice};
use caustica::scene::description::{Description, Geometry, LightKind};
use serde_json::{Value, json};

/// A file that uses everything.
fn rich() -> Builder {
    let mut builder = Builder::new();
    let positions = builder.vectors(&CORNERS);
    let normals = builder.vectors(&[[0.0, 0.0, 1.0]; 3]);
    let bytes = builder.indices(5121, &[0, 1, 2, 2]);
    let shorts = builder.indices(5123, &[2, 1, 0]);
    let words = builder.indices(5125, &[0, 2, 1]);
    let values = builder.view(&bytes_of(&[[5.0, 6.0, 7.0]]));
    let moved = builder.push(
        "accessors",
        json!({"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "name": "moved", "sparse": {
            "count": 1, "indices": {"bufferView": 3, "componentType": 5123}, "values": {"bufferView": values}}}),
    );
    let zeros = builder.push(
        "accessors",
        json!({"componentType": 5126, "type": "VEC3", "count": 4, "sparse": {
            "count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": values}}}),
    );
    let strided = builder.view(&bytes_of(&[[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3], [5.0; 3]]));
    builder.json["bufferViews"][strided]["byteStride"] = json!(24);
    let strided = json!({"bufferView": strided, "byteOffset": 12, "componentType": 5126, "type": "VEC3", "count": 3});
    let strided = builder.push("accessors", strided);
    builder.push(
        "materials",
        json!({
            "name": "glass", "alphaMode": "BLEND", "doubleSided": true, "emissiveFactor": [1, 0.5, 0.25],
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1], "metallicFactor": 0, "roughnessFactor": 0.5},
            "extensions": {
                "KHR_materials_ior": {"ior": 1.33},
                "KHR_materials_emissive_strength": {"emissiveStrength": 3},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 1, 0]},
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 1],
                    "attenuationDistance": 2},
            },
            "extras": {"caustica": {"exterior_ior": 1.5, "exterior_absorption": [0, 1, 2]}},
        }),
    );
    builder.mesh(json!([
        {"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": bytes, "mode": 5, "material": 0},
        {"attributes": {"POSITION": moved}, "indices": shorts, "mode": 6},
        {"attributes": {"POSITION": zeros, "COLOR_0": 0}, "indices": words, "targets": [{"POSITION": 0}]},
        {"attributes": {"POSITION": strided}, "mode": 4},
    ]));
    #[cfg(feature = "oiio")]
    {
        builder.json["images"] = json!([crate::textures::data(crate::textures::FOUR)]);
        builder.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]);
        builder.json["textures"] = json!([{"source": 0, "sampler": 0}]);
        builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0, "texCoord": 0,
            "extensions": {"KHR_texture_transform": {"offset": [0.5, 1], "rotation": 1, "scale": [2, 3]}}});
        let view = builder.view(&[0u8, 1, 2, 3, 4, 5]);
        let coordinates = json!({"bufferView": view, "componentType": 5121, "type": "VEC2", "count": 3});
        let coordinates = builder.push("accessors", coordinates);
        builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(coordinates);
    }
    builder.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}));
    builder.push(
        "cameras",
        json!({"type": "orthographic",
        "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}),
    );
    builder.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 3, "color": [1, 0.5, 0.25], "range": 9},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.7}}, {"type": "directional"}]}});
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_clearcoat"]);
    let light = |light: u32| json!({"KHR_lights_punctual": {"light": light}});
    builder.json["nodes"] = json!([
        {"name": "root", "children": [1, 2, 3], "translation": [1, 2, 3], "rotation": [0, 1, 0, 0]},
        {"mesh": 0, "scale": [-1, 2, 3], "extensions": light(0)},
        {"camera": 0, "extensions": light(1), "children": [4], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 4,5,6,1]},
        {"mesh": 0, "extras": {"caustica": {"sphere": {"radius": 0.5}}}},
        {"camera": 1, "extensions": light(2), "mesh": 0},
    ]);
    builder.json["scenes"] =
        json!([{"nodes": [0], "extras": {"caustica": {"environment": [1, 1, 1], "environment_rotation": 30}}}]);
    builder
}

/// The same as text, its buffer in a data URI.
fn as_text(builder: &Builder) -> Vec<u8> {
    let mut document = builder.json.clone();
    let uri = format!("data:;base64,{}", BASE64_STANDARD.encode(&builder.bin));
    document["buffers"] = json!([{"byteLength": builder.bin.len(), "uri": uri}]);
    serde_json::to_vec(&document).unwrap()
}

/// Whether the file loads; fails on the last guard and on a description that would do harm.
fn try_load(bytes: &[u8], what: &dyn Fn() -> String) -> bool {
    match load_slice(bytes, None) {
        Ok(loaded) => {
            check(&loaded.description, what);
            true
        }
        Err(GltfError::Internal(why)) => panic!("{}: caught by the last guard: {why}", what()),
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// Indices point somewhere and numbers are finite.
fn check(scene: &Description, what: &dyn Fn() -> String) {
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices), "{}", what());
        assert!(mesh.normals.is_empty() || mesh.normals.len() == vertices, "{}", what());
    }
    for instance in &scene.instances {
        assert!(instance.material < scene.materials.len(), "{}", what());
        assert!(instance.transform.inverse().is_finite(), "{}", what());
        match instance.geometry {
            Geometry::Mesh(mesh) => assert!(mesh < scene.meshes.len(), "{}", what()),
            Geometry::Sphere { radius } => assert!(radius > 0.0 && radius.is_finite(), "{}", what()),
        }
    }
    for light in &scene.lights {
        let finite = match light.kind {
            LightKind::Point { position, intensity } => position.is_finite() && intensity.is_finite(),
            LightKind::Spot { position, direction, intensity, inner, outer } => {
                position.is_finite()
                    && direction.is_normalized()
                    && intensity.is_finite()
                    && (inner + outer).is_finite()
            }
            LightKind::Directional { direction, irradiance } => direction.is_normalized() && irradiance.is_finite(),
        };
        assert!(finite, "{}", what());
    }
    assert!(scene.cameras.iter().all(|camera| camera.transform.is_finite()), "{}", what());
    assert!(scene.materials.iter().all(|material| material.emission.is_finite()), "{}", what());
    assert!(scene.environment.radiance.is_finite() && scene.environment.rotation.is_finite(), "{}", what());
}

/// JSON pointers to all values of a document.
fn pointers(value: &Value, at: String, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| pointers(value, format!("{at}/{key}"), out)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| pointers(value, format!("{at}/{i}"), out)),
        _ => {}
    }
    out.push(at);
}

/// The rich document with its buffer, and pointers into it.
fn rich_document() -> (Value, Vec<u8>, Vec<String>) {
    let Builder { mut json, bin } = rich();
    json["buffers"] = json!([{"byteLength": bin.len()}]);
    let mut all = Vec::new();
    pointers(&json, String::new(), &mut all);
    (json, bin, all)
}

/// A xorshift generator (Marsaglia 2003).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}

#[test]
fn the_undamaged_file_uses_everything() {
    for bytes in [rich().glb(), as_text(&rich())] {
        let scene = load_slice(&bytes, None).unwrap().description;
        assert_eq!((scene.meshes.len(), scene.instances.len(), scene.lights.len()), (4, 9, 3));
        assert_eq!((scene.materials.len(), scene.cameras.len()), (2, 2));
        check(&scene, &|| "undamaged".into());
    }
}

#[test]
fn every_truncation_is_an_error() {
    for bytes in [rich().glb(), as_text(&rich())] {
        for length in 0..bytes.len() {
            let what = || format!("the first {length} bytes");
            assert!(!try_load(&bytes[..length], &what), "{} load", what());
        }
    }
}

#[test]
fn flipped_bytes() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for bytes in [rich().glb(), as_text(&rich()), Builder::triangle().glb()] {
        for at in 0..bytes.len() {
            for flip in [1 << random.below(8), 0xff, 0x20] {
                let mut bytes = bytes.clone();
                bytes[at] ^= flip;
                try_load(&bytes, &|| format!("byte {at} ^ {flip:#x}"));
            }
        }
        for round in 0..2000 {
            let mut bytes = bytes.clone();
            for _ in 0..=random.below(8) {
                let at = random.below(bytes.len());
                bytes[at] = random.below(256) as u8;
            }
            try_load(&bytes, &|| format!("round {round}"));
        }
    }
}

#[test]
fn moved_doubled_and_missing_stretches() {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for bytes in [rich().glb(), as_text(&rich())] {
        for round in 0..2000 {
            let (a, b) = (random.below(bytes.len()), random.below(64));
            let stretch = bytes[a..(a + b).min(bytes.len())].to_vec();
            let mut bytes = bytes.clone();
            match round % 3 {
                0 => drop(bytes.drain(a..a + stretch.len())),
                1 => drop(bytes.splice(a..a, stretch)),
                _ => {
                    let to = random.below(bytes.len() - stretch.len());
                    bytes[to..to + stretch.len()].copy_from_slice(&stretch);
                }
            }
            try_load(&bytes, &|| format!("round {round}"));
        }
    }
}

#[test]
fn every_value_replaced() {
    let (json, bin, pointers) = rich_document();
    let values = [
        "-1",
        "0",
        "1",
        "2",
        "3",
        "7",
        "255",
        "65535",
        "65536",
        "2147483647",
        "2147483648",
        "4294967295",
        "4294967296",
        "9223372036854775807",
        "18446744073709551615",
        "18446744073709551616",
        "0.5",
        "-0.0",
        "1e-45",
        "1e-300",
        "1e20",
        "1e39",
        "-1e39",
        "1e300",
        "1e999",
        "null",
        "true",
        "\"\"",
        "\"x\"",
        "[]",
        "{}",
        "[[]]",
        "[0,0,0]",
        "[1e39,0,0]",
        "[4,3,2,1,0]",
        "[0,0,0,0]",
        "5121",
        "5125",
        "5126",
        "\"SCALAR\"",
        "\"VEC3\"",
        "\"spot\"",
        "\"perspective\"",
    ];
    let (mut loaded, mut refused) = (0, 0);
    for pointer in &pointers {
        for value in values {
            // By text: some of the values are no `Value`.
            let mut json = json.clone();
            *json.pointer_mut(pointer).unwrap() = json!("@@");
            let text = json.to_string().replacen("\"@@\"", value, 1);
            let what = || format!("{pointer} = {value}");
            if try_load(&glb_of(text.as_bytes(), &bin), &what) { loaded += 1 } else { refused += 1 }
        }
    }
    // Were all files refused alike, the test would show nothing.
    assert!(loaded > 1000 && refused > 1000, "{loaded} loaded, {refused} refused");
}

#[test]
fn every_value_missing() {
    let (json, bin, pointers) = rich_document();
    for pointer in pointers.iter().filter(|pointer| !pointer.is_empty()) {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let mut json = json.clone();
        match json.pointer_mut(parent).unwrap() {
            Value::Object(map) => drop(map.remove(key)),
            Value::Array(list) => drop(list.remove(key.parse().unwrap())),
            _ => unreachable!("a parent is a list or an object"),
        }
        try_load(&glb_of(json.to_string().as_bytes(), &bin), &|| format!("without {pointer}"));
    }
}

#[test]
fn every_word_of_the_buffer_extreme() {
    let (json, bin, _) = rich_document();
    let text = json.to_string();
    let words = [0, 1, u32::MAX, 0x7fff_ffff, f32::NAN.to_bits(), f32::INFINITY.to_bits(), f32::MAX.to_bits()];
    for at in (0..bin.len() / 4 * 4).step_by(4) {
        for word in words {
            let mut bin = bin.clone();
            bin[at..at + 4].copy_from_slice(&word.to_le_bytes());
            try_load(&glb_of(text.as_bytes(), &bin), &|| format!("word {word:#x} at {at} of the buffer"));
        }
    }
}

#[test]
fn every_header_word_extreme() {
    let bytes = rich().glb();
    let json = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    for at in [0, 4, 8, 12, 16, 20 + json, 24 + json] {
        for word in [0u32, 1, 3, 11, 12, 13, 19, 20, 21, 28, 0x7fff_ffff, 0x8000_0000, u32::MAX - 7, u32::MAX] {
            let mut bytes = bytes.clone();
            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            let what = || format!("header word {word} at {at}");
            assert!(!try_load(&bytes, &what), "{} loads", what());
        }
    }
}
