//! Small glTF files, written piece by piece.

use caustica::io::gltf::{GltfError, Loaded, load_slice};
use serde_json::{Value, json};

/// A document and its one buffer.
#[derive(Clone)]
pub(crate) struct Builder {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

/// Corners of the triangle that most tests use.
pub(crate) const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

impl Builder {
    /// An empty scene.
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [], "materials": [], "cameras": [],
        });
        Builder { json, bin: Vec::new() }
    }

    /// One triangle, without indices, normals or material, at one node.
    pub(crate) fn triangle() -> Self {
        let mut this = Self::new();
        let positions = this.vectors(&CORNERS);
        this.mesh(json!([{"attributes": {"POSITION": positions}}]));
        this.root(json!({"mesh": 0}));
        this
    }

    /// Appends to a list of the document; its index.
    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// A view of new bytes, which begin at a multiple of 4.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0xee);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// An accessor of three floats each.
    pub(crate) fn vectors(&mut self, values: &[[f32; 3]]) -> usize {
        let view = self.view(&bytes_of(values));
        let accessor = json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": values.len()});
        self.push("accessors", accessor)
    }

    /// An accessor of indices, of a component type of 1, 2 or 4 bytes.
    pub(crate) fn indices(&mut self, component: u32, values: &[u32]) -> usize {
        let size = [1, 0, 2, 0, 4][component as usize - 5121];
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()[..size].to_vec()).collect();
        let view = self.view(&bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": "SCALAR", "count": values.len()});
        self.push("accessors", accessor)
    }

    /// A mesh of primitives.
    pub(crate) fn mesh(&mut self, primitives: Value) -> usize {
        self.push("meshes", json!({"primitives": primitives}))
    }

    /// A node at the root of the scene.
    pub(crate) fn root(&mut self, node: Value) -> usize {
        let node = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
        node
    }

    /// A light, at a root node of its own.
    pub(crate) fn light(&mut self, light: Value, mut node: Value) {
        self.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        node["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
        self.root(node);
    }

    /// The document with its buffer in the binary chunk.
    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        document["buffers"] = json!([{"byteLength": self.bin.len()}]);
        glb_of(&serde_json::to_vec(&document).unwrap(), &self.bin)
    }

    /// The loaded file.
    pub(crate) fn load(&self) -> Result<Loaded, GltfError> {
        load_slice(&self.glb(), None)
    }

    /// The message of the error that the file must give, which may not be the last guard's.
    pub(crate) fn error(&self) -> String {
        message(self.load())
    }
}

/// As [`Builder::error`].
pub(crate) fn message(result: Result<Loaded, GltfError>) -> String {
    match result {
        Ok(_) => panic!("loaded without an error"),
        Err(GltfError::Internal(what)) => panic!("caught by the last guard: {what}"),
        Err(error) => error.to_string(),
    }
}

/// A `.glb` of a JSON text and a binary chunk.
pub(crate) fn glb_of(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    let word = |value: usize, bytes: &mut Vec<u8>| bytes.extend((value as u32).to_le_bytes());
    word(2, &mut bytes);
    word(12 + 8 + json.len() + 8 + bin.len(), &mut bytes);
    word(json.len(), &mut bytes);
    bytes.extend(b"JSON");
    bytes.extend(json);
    word(bin.len(), &mut bytes);
    bytes.extend(b"BIN\0");
    bytes.extend(bin);
    bytes
}

/// Little-endian floats.
pub(crate) fn bytes_of(values: &[[f32; 3]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

/// Fails unless exactly one warning contains all of `parts`.
pub(crate) fn assert_warns(loaded: &Loaded, parts: &[&str]) {
    let hits = loaded.warnings.iter().filter(|w| parts.iter().all(|part| w.contains(part))).count();
    assert_eq!(hits, 1, "{parts:?} in {:#?}", loaded.warnings);
}
