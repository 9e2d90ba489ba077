//! The JSON document: parsed within bounds, asked only through checked look-ups.

use super::error::{GltfError, Object};
use crate::text::shown;
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use gltf::json::{self, Index, Root};
use serde_json::Value;

/// Extensions that are rendered.
const SUPPORTED: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    QUANTIZATION,
    "KHR_texture_transform",
];

/// Vertices in integers.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// Formats of images that are not read: a texture has another one, or is left out.
const OF_TEXTURES: [&str; 4] = ["EXT_texture_avif", "EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"];

/// Most objects and list items of a document together. Each takes up to a kilobyte when parsed,
/// and a JSON parser cannot be told to stop when memory is short.
const MAX_ITEMS: usize = 1 << 23;

/// Properties that are read and of which the typed document keeps the lower 32 bits only.
const NARROW: [&str; 21] = [
    "scene",
    "nodes",
    "children",
    "mesh",
    "camera",
    "light",
    "material",
    "indices",
    "POSITION",
    "NORMAL",
    "magFilter",
    "wrapS",
    "wrapT",
    "texCoord",
    "index",
    "source",
    "sampler",
    "bufferView",
    "buffer",
    "mode",
    "componentType",
];

/// A parsed document.
pub(super) struct Document<'a> {
    /// Typed, not validated: indices may point anywhere, enumerations may be unknown.
    pub(super) root: Root,
    json: &'a [u8],
}

impl<'a> Document<'a> {
    /// Parses and checks version and extensions.
    pub(super) fn parse(json: &'a [u8], warnings: &mut Vec<String>) -> Result<Self, GltfError> {
        check_text(json)?;
        let asset = Object { kind: "asset", index: None, name: String::new() };
        let parsed = json::deserialize::from_slice(json).or_else(|e| mended(json).ok_or(e));
        let root: Root = parsed.map_err(|e| match literal(json, "/asset/version") {
            // Other versions differ in their types too: say what is really wrong.
            Some(Value::String(v)) if !v.starts_with("2.") => asset.unsupported(format!("glTF version {v}")),
            _ => GltfError::NotGltf(format!("its JSON does not fit: {e}")),
        })?;
        if !root.asset.version.starts_with("2.") {
            return Err(asset.unsupported(format!("glTF version {}", root.asset.version)));
        }
        if let Some(version) = root.asset.min_version.as_ref().filter(|v| *v != "2.0") {
            return Err(asset.unsupported(format!("glTF version {version}, which the file requires,")));
        }
        for name in &root.extensions_required {
            if !SUPPORTED.contains(&name.as_str()) && !OF_TEXTURES.contains(&name.as_str()) {
                return Err(asset.unsupported(format!("extension '{name}', which the file requires,")));
            }
        }
        for (name, users) in unsupported(&root) {
            let users = if users.is_empty() { String::new() } else { format!(" (by {})", listed(&users)) };
            warnings.push(format!("extension '{}' is not supported and ignored{users}", shown(name)));
        }
        for (count, what) in [(root.animations.len(), "animations"), (root.skins.len(), "skins")] {
            if count > 0 {
                warnings.push(format!("{what} are ignored ({count} in the file)"));
            }
        }
        Ok(Document { root, json })
    }

    /// Whether positions, normals and texture coordinates may be integers as they come.
    pub(super) fn quantized(&self) -> bool {
        let mut used = self.root.extensions_used.iter().chain(&self.root.extensions_required);
        used.any(|name| name == QUANTIZATION)
    }

    /// The object that `index` names; `field` of `from` holds it.
    pub(super) fn get<T: Named>(&self, index: Index<T>, from: &Object, field: &str) -> Result<&T, GltfError>
    where
        Root: AsRef<[T]>,
    {
        let all: &[T] = self.root.as_ref();
        all.get(index.value())
            .ok_or_else(|| from.invalid(field, index, format!("the file has {} of kind {}", all.len(), T::KIND)))
    }

    /// How messages call the object that `index` names.
    pub(super) fn object<T: Named>(&self, index: Index<T>) -> Object
    where
        Root: AsRef<[T]>,
    {
        let all: &[T] = self.root.as_ref();
        let name = all.get(index.value()).and_then(Named::name).unwrap_or_default().to_string();
        Object { kind: T::KIND, index: Some(index.value()), name }
    }

    /// What the file says at a JSON pointer, for messages: an unknown enumeration value is not
    /// kept in the typed document.
    pub(super) fn literal(&self, pointer: &str) -> String {
        literal(self.json, pointer).map_or("unknown".into(), |value| value.to_string())
    }
}

/// Extensions that the file says it uses, in its order, then others that it uses all the same; and the materials and nodes
/// that do.
fn unsupported(root: &Root) -> Vec<(&str, Vec<String>)> {
    let mut found: Vec<(&str, Vec<String>)> = Vec::new();
    let mut add = |name, user: Option<String>| {
        if !SUPPORTED.contains(&name) {
            let at = found.iter().position(|(other, _)| *other == name);
            let at = at.unwrap_or_else(|| {
                found.push((name, Vec::new()));
                found.len() - 1
            });
            found[at].1.extend(user);
        }
    };
    root.extensions_used.iter().for_each(|name| add(name, None));
    for (i, material) in root.materials.iter().enumerate() {
        let user = || Object { kind: "material", index: Some(i), name: material.name.clone().unwrap_or_default() };
        let others = material.extensions.iter().flat_map(|extensions| extensions.others.keys());
        others.for_each(|name| add(name, Some(user().to_string())));
    }
    for (i, node) in root.nodes.iter().enumerate() {
        let user = || Object { kind: "node", index: Some(i), name: node.name.clone().unwrap_or_default() };
        let others = node.extensions.iter().flat_map(|extensions| extensions.others.keys());
        others.for_each(|name| add(name, Some(user().to_string())));
    }
    found
}

/// The first few of them.
fn listed(names: &[String]) -> String {
    const FEW: usize = 3;
    let first = names[..names.len().min(FEW)].join(", ");
    if names.len() > FEW { format!("{first} and {} more", names.len() - FEW) } else { first }
}

/// A second try at what some writers get wrong and what the typed document insists on: values that are null instead of
/// absent, as infinity becomes in JavaScript, and scenes without nodes.
fn mended(json: &[u8]) -> Option<Root> {
    fn without_nulls(value: &mut Value) {
        match value {
            Value::Object(map) => {
                map.retain(|_, value| !value.is_null());
                map.values_mut().for_each(without_nulls);
            }
            Value::Array(list) => list.iter_mut().for_each(without_nulls),
            _ => {}
        }
    }
    let mut value: Value = serde_json::from_slice(json).ok()?;
    without_nulls(&mut value);
    for scene in value.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        scene.as_object_mut()?.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    json::deserialize::from_slice(&serde_json::to_vec(&value).ok()?).ok()
}

fn literal(json: &[u8], pointer: &str) -> Option<Value> {
    serde_json::from_slice::<Value>(json).ok()?.pointer(pointer).cloned()
}

/// Objects with a kind and a name.
pub(super) trait Named {
    /// For messages.
    const KIND: &'static str;
    /// As the file says.
    fn name(&self) -> Option<&str>;
}

macro_rules! named {
    ($($type:ty => $kind:literal),* $(,)?) => {$(
        impl Named for $type {
            const KIND: &'static str = $kind;
            fn name(&self) -> Option<&str> {
                self.name.as_deref()
            }
        }
    )*};
}

named! {
    json::Accessor => "accessor",
    json::Buffer => "buffer",
    json::buffer::View => "bufferView",
    json::Camera => "camera",
    json::Image => "image",
    json::Material => "material",
    json::Mesh => "mesh",
    json::Node => "node",
    json::Scene => "scene",
    json::Texture => "texture",
    json::texture::Sampler => "sampler",
    Light => "light",
}

/// Refuses a text that would take too much memory when parsed, or whose indices would lose their
/// upper bits. One pass without allocation; what is not JSON is left to the parser.
fn check_text(json: &[u8]) -> Result<(), GltfError> {
    let mut items = 0;
    let mut key: &[u8] = b"";
    let mut at = 0;
    while at < json.len() {
        match json[at] {
            b'"' => {
                let start = at + 1;
                at = start;
                while at < json.len() && json[at] != b'"' {
                    at += if json[at] == b'\\' { 2 } else { 1 };
                }
                let after = json.iter().skip(at + 1).find(|b| !b.is_ascii_whitespace());
                if after == Some(&b':') {
                    key = json.get(start..at).unwrap_or_default();
                }
            }
            b'0'..=b'9' => {
                let start = at;
                while at + 1 < json.len() && matches!(json[at + 1], b'0'..=b'9' | b'.' | b'e' | b'E' | b'+' | b'-') {
                    at += 1;
                }
                let number = std::str::from_utf8(&json[start..=at]).unwrap_or_default();
                // Ten digits are the fewest that can exceed 32 bits.
                let whole = number.len() >= 10 && number.bytes().all(|b| b.is_ascii_digit());
                if whole
                    && number.parse::<u32>().is_err()
                    && (key.starts_with(b"TEXCOORD_") || NARROW.iter().any(|name| name.as_bytes() == key))
                {
                    let key = key.escape_ascii();
                    return Err(GltfError::NotGltf(format!("'{key}' is {number}; expected at most 32 bits")));
                }
            }
            b'{' | b',' => items += 1,
            _ => {}
        }
        at += 1;
    }
    if items > MAX_ITEMS {
        return Err(GltfError::NotGltf(format!("its JSON has {items} items; at most {MAX_ITEMS} are read")));
    }
    Ok(())
}
