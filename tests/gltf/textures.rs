//! Textures: which image, decoded how, found where. Values are worked out by hand.

use crate::builder::{Builder, assert_warns, message};
use caustica::io::gltf::load;
use caustica::math::Rgb;
use caustica::scene::description::{Filter, Material, TextureMap, Wrap};
use glam::Vec2;
use serde_json::{Value, json};

/// PNG, 2 x 2, 8 bits: red, green; blue, a grey of 118.
pub(crate) const FOUR: &str =
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAIAAAD91JpzAAAAE0lEQVR42mP4z8DAAMIM/8vKygAcuARgoR6sjAAAAABJRU5ErkJggg==";
/// PNG, 2 x 1, with alpha: (255, 128, 0), which is transparent, and (10, 20, 30).
const ALPHA: &str =
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAYAAAD0In+KAAAAEUlEQVR42mP438DAwCUi9x8ADSACuxntEH4AAAAASUVORK5CYII=";
/// PNG, 1 x 1, 16 bits: 0x8000, 0xffff, 0.
const DEEP: &str = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABEAIAAADA54+dAAAAD0lEQVR42mNoYPj/n4EBAAoAAn+Iv13qAAAAAElFTkSuQmCC";
/// PNG, 2 x 1, grey, 8 bits: 118, 255.
const ONE_CHANNEL: &str =
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAC0lEQVR42mMo+w8AAe4BdgMU9YcAAAAASUVORK5CYII=";
/// 118 / 255 by the transfer function of sRGB.
const GREY: f32 = 0.181_164;

fn bytes(base64: &str) -> Vec<u8> {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.decode(base64).unwrap()
}

pub(crate) fn data(base64: &str) -> Value {
    json!({"uri": format!("data:image/png;base64,{base64}")})
}

/// A triangle of one material, with coordinates, and textures 0, 1, ... of these images.
fn with(material: Value, images: &[Value]) -> Builder {
    let mut builder = Builder::triangle();
    let view = builder.view(&[0.0f32, 0.25, 1.0, 0.5, 0.75, 2.0].map(f32::to_le_bytes).concat());
    let accessor = json!({"bufferView": view, "componentType": 5126, "type": "VEC2", "count": 3});
    let coordinates = builder.push("accessors", accessor);
    builder.push("materials", material);
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["attributes"]["TEXCOORD_0"] = json!(coordinates);
    builder.json["images"] = json!(images);
    builder.json["textures"] = (0..images.len()).map(|source| json!({"source": source})).collect();
    builder
}

fn base_color(info: Value) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorTexture": info}})
}

fn material(builder: &Builder) -> Material {
    let loaded = builder.load().unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.description.materials[0].clone()
}

fn color(builder: &Builder) -> TextureMap {
    material(builder).textures.color.expect("a texture")
}

fn near(a: Rgb, b: [f32; 3]) {
    assert!((a - Rgb::from(b)).abs().max_element() < 1e-5, "{a} is not {b:?}");
}

#[test]
fn each_slot_has_its_image_and_its_encoding() {
    let mut builder = with(
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}},
            "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1],
        }),
        &[data(FOUR)],
    );
    // The second one is in the buffer.
    let view = builder.view(&bytes(FOUR));
    let image = builder.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    builder.push("textures", json!({"source": image}));
    let textures = material(&builder).textures;
    let corner = Vec2::new(0.75, 0.75);
    for map in [&textures.color, &textures.emission] {
        let map = map.as_ref().expect("a texture");
        near(map.at(corner), [GREY; 3]);
        near(map.at(Vec2::new(0.25, 0.25)), [1.0, 0.0, 0.0]);
        near(map.at(Vec2::new(0.75, 0.25)), [0.0, 1.0, 0.0]);
        near(map.at(Vec2::new(0.25, 0.75)), [0.0, 0.0, 1.0]);
    }
    near(textures.metallic_roughness.as_ref().expect("a texture").at(corner), [118.0 / 255.0; 3]);
    // One image, read once.
    let same = |a: &Option<TextureMap>, b: &Option<TextureMap>| match (a, b) {
        (Some(a), Some(b)) => std::ptr::eq(&*a.texture, &*b.texture),
        _ => false,
    };
    assert!(same(&textures.color, &textures.emission));
    assert!(!same(&textures.color, &textures.metallic_roughness));

    let mesh = builder.load().unwrap().description.meshes[0].clone();
    assert_eq!(mesh.texture_coordinates, [[0.0, 0.25], [1.0, 0.5], [0.75, 2.0]]);
}

#[test]
fn normals() {
    let material = |extra: Value| {
        let mut material = json!({"normalTexture": {"index": 0, "scale": 0.5,
            "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}});
        material.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
        let mut builder = with(material, &[data(FOUR)]);
        builder.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
        builder
    };
    let loaded = material(json!({})).load().unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let normal = loaded.description.materials[0].textures.normal.clone().expect("a texture");
    assert_eq!(normal.scale, 0.5);
    near(normal.map.at(Vec2::new(0.75 / 2.0, 0.75 / 3.0)), [118.0 / 255.0; 3]);
    assert_eq!(loaded.description.meshes[0].texture_coordinates.len(), 3);

    let glass = json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1}}});
    let loaded = material(glass).load().unwrap();
    assert_warns(&loaded, &["material 0: normalTexture is ignored where light is refracted"]);
    let mut wrong = material(json!({}));
    wrong.json["materials"][0]["normalTexture"]["extensions"]["KHR_texture_transform"]["scale"] = json!("x");
    assert!(wrong.error().starts_with("material 0: normalTexture.KHR_texture_transform is"), "{}", wrong.error());
}

#[test]
fn colours_are_not_multiplied_by_alpha() {
    let map = color(&with(base_color(json!({"index": 0})), &[data(ALPHA)]));
    near(map.at(Vec2::new(0.25, 0.5)), [1.0, 0.215_861, 0.0]);
}

#[test]
fn other_kinds_of_png() {
    let map = |image| color(&with(base_color(json!({"index": 0})), &[data(image)]));
    near(map(DEEP).at(Vec2::splat(0.5)), [0.214_058, 1.0, 0.0]);
    assert_eq!(map(DEEP).texture.memory(), 12);
    near(map(ONE_CHANNEL).at(Vec2::new(0.25, 0.5)), [GREY; 3]);
    near(map(ONE_CHANNEL).at(Vec2::new(0.75, 0.5)), [1.0; 3]);
    assert_eq!(map(ONE_CHANNEL).texture.memory(), 6);
}

#[test]
fn samplers_and_transforms() {
    let mut builder = with(
        base_color(json!({"index": 0, "extensions": {"KHR_texture_transform":
            {"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.25]}}})),
        &[data(FOUR)],
    );
    builder.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    builder.json["samplers"] = json!([{"wrapS": 33648, "wrapT": 33071, "magFilter": 9728, "minFilter": 9987}]);
    builder.json["textures"][0]["sampler"] = json!(0);
    let map = color(&builder);
    assert_eq!((map.wrap, map.filter), ([Wrap::Mirror, Wrap::Clamp], Filter::Nearest));
    // The extension's own example uses "only the lower left quadrant".
    for ((u, v), (x, y)) in [((0.0, 0.0), (0.0, 1.0)), ((1.0, 0.0), (0.0, 0.5)), ((0.0, 1.0), (0.25, 1.0))] {
        let found = map.transform.transform_point2(Vec2::new(u, v));
        assert!(found.distance(Vec2::new(x, y)) < 1e-6, "{found}");
    }

    let plain = color(&with(base_color(json!({"index": 0})), &[data(FOUR)]));
    assert_eq!((plain.wrap, plain.filter), ([Wrap::Repeat; 2], Filter::Linear));
}

#[test]
fn coordinates_of_each_type_and_set() {
    for (component, bytes, scale) in [(5121, vec![0u8, 51, 255, 102, 204, 0], 255.0), (5123, vec![], 65535.0)] {
        let bytes =
            if bytes.is_empty() { [0u16, 13107, 65535, 26214, 52428, 0].map(u16::to_le_bytes).concat() } else { bytes };
        let mut builder = with(base_color(json!({"index": 0, "texCoord": 1})), &[data(FOUR)]);
        let view = builder.view(&bytes);
        let accessor =
            json!({"bufferView": view, "componentType": component, "normalized": true, "type": "VEC2", "count": 3});
        let coordinates = builder.push("accessors", accessor);
        builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(coordinates);
        let mesh = builder.load().unwrap().description.meshes[0].clone();
        let expected = [[0.0, 0.2], [1.0, 0.4], [0.8, 0.0]];
        let error =
            mesh.texture_coordinates.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0f32, f32::max) < 0.5 / scale, "{:?}", mesh.texture_coordinates);
    }
    // With `KHR_mesh_quantization`, integers as they are.
    let mut builder = with(base_color(json!({"index": 0})), &[data(FOUR)]);
    let view = builder.view(&[-3i16, 2, 0, 700, -1, 1].map(i16::to_le_bytes).concat());
    let coordinates = json!({"bufferView": view, "componentType": 5122, "type": "VEC2", "count": 3});
    let coordinates = builder.push("accessors", coordinates);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(coordinates);
    assert!(builder.error().contains("componentType 5122"), "{}", builder.error());
    builder.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    let mesh = builder.load().unwrap().description.meshes[0].clone();
    assert_eq!(mesh.texture_coordinates, [[-3.0, 2.0], [0.0, 700.0], [-1.0, 1.0]]);
    // The extension has the last word on the set; a slot of another set is left out.
    let mut builder = with(
        json!({
            "pbrMetallicRoughness": {"baseColorTexture":
                {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"texCoord": 0}}}},
            "emissiveTexture": {"index": 0, "texCoord": 1}, "emissiveFactor": [1, 1, 1],
        }),
        &[data(FOUR)],
    );
    builder.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    let loaded = builder.load().unwrap();
    assert_warns(&loaded, &["material 0: emissiveTexture is ignored: its texCoord is 1, that of others 0"]);
    assert_eq!(loaded.description.meshes[0].texture_coordinates.len(), 3);
    assert!(loaded.description.materials[0].textures.emission.is_none());
    // Most of it may have been black.
    assert_warns(&loaded, &["material 0: it emits nothing without its emissiveTexture"]);
    assert_eq!(loaded.description.materials[0].emission, Rgb::ZERO);
}

#[test]
fn images_of_materials_that_nothing_has_are_not_read() {
    let mut builder = with(json!({}), &[json!({"uri": "missing.png"})]);
    builder.push("materials", json!({"emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1]}));
    let loaded = builder.load().unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn what_no_texture_needs_is_not_read() {
    // Coordinates without a texture, and textures that a factor of 0 makes black.
    let builder = with(
        json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0, 0, 0, 1]},
            "emissiveTexture": {"index": 0}}),
        &[json!({"uri": "missing.png"})],
    );
    let loaded = builder.load().unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    assert!(loaded.description.meshes[0].texture_coordinates.is_empty());
}

#[test]
fn primitives_that_differ_in_coordinates_alone_are_two_meshes() {
    let mut builder = with(base_color(json!({"index": 0})), &[data(FOUR)]);
    builder.push("materials", json!({}));
    let mut plain = builder.json["meshes"][0]["primitives"][0].clone();
    plain["material"] = json!(1);
    builder.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(plain);
    let lengths: Vec<_> =
        builder.load().unwrap().description.meshes.iter().map(|m| m.texture_coordinates.len()).collect();
    assert_eq!(lengths, [3, 0]);
}

#[test]
fn files_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let builder = with(base_color(json!({"index": 0})), &[json!({"uri": "my%20tiles.jpg"})]);
    let path = folder.path().join("scene.glb");
    std::fs::write(&path, builder.glb()).unwrap();
    let error = message(load(&path));
    assert!(error.contains("my tiles.jpg"), "{error}");
    // What it is says the file, not its name.
    std::fs::write(folder.path().join("my tiles.jpg"), bytes(FOUR)).unwrap();
    let loaded = load(&path).unwrap();
    let map = loaded.description.materials[0].textures.color.clone().expect("a texture");
    near(map.at(Vec2::new(0.75, 0.75)), [GREY; 3]);
    std::fs::write(folder.path().join("my tiles.jpg"), b"GIF89a").unwrap();
    let error = message(load(&path));
    assert_eq!(error, "image 0: uri: my%20tiles.jpg: neither PNG nor JPEG, by its first bytes");
    assert_eq!(builder.error(), "image 0: an image beside a scene in memory is not supported");
}

#[test]
fn what_is_wrong_is_named() {
    let slot = || base_color(json!({"index": 0}));
    let mut builder = with(slot(), &[data(FOUR)]);
    builder.json["textures"] = json!([]);
    assert!(builder.error().starts_with("material 0: baseColorTexture.index is 0;"), "{}", builder.error());
    let mut builder = with(slot(), &[data(FOUR)]);
    builder.json["textures"][0]["source"] = json!(7);
    assert!(builder.error().starts_with("texture 0: source is 7;"), "{}", builder.error());
    let mut builder = with(slot(), &[data(FOUR)]);
    builder.json["textures"][0]["sampler"] = json!(1);
    assert!(builder.error().starts_with("texture 0: sampler is 1;"), "{}", builder.error());
    builder.json["samplers"] = json!([{}, {"wrapT": 12}]);
    assert_eq!(builder.error(), "sampler 1: wrapT is 12; expected 33071, 33648 or 10497");
    assert_eq!(with(slot(), &[json!({})]).error(), "image 0: uri is missing; expected it or bufferView");
    assert!(with(slot(), &[json!({"bufferView": 9})]).error().starts_with("image 0: bufferView is 9;"));
    let cut = &FOUR[..60];
    assert!(with(slot(), &[data(cut)]).error().starts_with("image 0: uri: its data: "));
    let mut builder = with(slot(), &[data(FOUR)]);
    let accessor = builder.json["accessors"].as_array().unwrap().len() - 1;
    builder.json["accessors"][accessor]["count"] = json!(2);
    assert_eq!(
        builder.error(),
        format!("accessor {accessor}: count is 2; expected its POSITION has 3").replace("expected ", "")
    );

    let mut builder = with(slot(), &[]);
    builder.json["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
    let loaded = builder.load().unwrap();
    assert_warns(&loaded, &["material 0: baseColorTexture is ignored: its image is that of KHR_texture_basisu alone"]);
}

#[test]
fn coordinates_that_are_not_finite_are_told() {
    let mut builder = with(base_color(json!({"index": 0})), &[data(FOUR)]);
    let view = builder.view(&[0.0f32, f32::NAN, 1.0, 0.5, f32::INFINITY, 2.0].map(f32::to_le_bytes).concat());
    let accessor = json!({"bufferView": view, "componentType": 5126, "type": "VEC2", "count": 3});
    let coordinates = builder.push("accessors", accessor);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(coordinates);
    let loaded = builder.load().unwrap();
    assert_warns(&loaded, &["primitives[0].attributes.TEXCOORD_0: 2 not finite are taken as 0"]);
    assert_eq!(loaded.description.meshes[0].texture_coordinates, [[0.0; 2], [1.0, 0.5], [0.0; 2]]);
}
