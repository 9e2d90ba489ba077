//! glTF 2.0 in (Khronos Group, *glTF 2.0 Specification*, 2021; cited as \[glTF\] in this folder).
//!
//! The crate `gltf` gives the types of the JSON document. Its validator and its readers are not
//! used: the validator indexes `accessors` with an unchecked POSITION index and refuses the
//! required extensions `KHR_materials_volume` and `_specular`; the readers unwrap invalid
//! enumerations, missing lights and `count - 1` of empty accessors; index values are cut to 32
//! bits. Everything that comes from the file is therefore looked up and measured here, before use.
//!
//! The way of a file: `container` (text and binary chunk) -> `document` (typed JSON, checked
//! look-ups) -> `buffer` (bytes) -> `accessor` (typed arrays) -> `mesh`, `texture`, `material` -> `node` (what
//! stands where). `budget` bounds what a small file may unfold to; images have a bound of their own, in `io::image`.
//!
//! Beyond \[glTF\], `extras.caustica` is read: on a node `{"sphere": {"radius": r}}` puts an
//! analytic sphere in place of the node's mesh; on a scene `{"environment": [r, g, b]}` is a
//! constant radiance from all around, and `{"environment_image": "sky.exr", "environment_rotation": degrees}` an image
//! that it multiplies, turned about +y; on a material `{"exterior_ior": n, "exterior_absorption":
//! [r, g, b], "exterior_dispersion": d}` names the medium before the surface, for media that touch; on a camera `{"lens_radius": r,
//! "focus_distance": d, "shift": [x, y]}`.

mod accessor;
mod budget;
mod buffer;
mod container;
mod document;
mod error;
mod extras;
mod material;
mod mesh;
mod node;
mod texture;

pub use error::{GltfError, Object};

use crate::scene::description::Description;
use std::panic::catch_unwind;
use std::path::Path;

/// What a file holds.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene; its numbers are finite but for vertex data, their ranges are checked at commit.
    pub description: Description,
    /// Of each camera, width over height of the picture that it was meant for, where the file says so.
    pub aspects: Vec<Option<f64>>,
    /// What the file asks for and is not rendered, each naming its object.
    pub warnings: Vec<String>,
}

/// Reads a `.gltf` or `.glb` file, and the buffers and the images beside it.
pub fn load(path: &Path) -> Result<Loaded, GltfError> {
    let bytes = container::read_file(path)?;
    load_slice(&bytes, Some(path.parent().unwrap_or(Path::new(""))))
}

/// Reads a `.gltf` or `.glb` file in memory; `base` is the folder of its external buffers and images, `None`
/// forbids them.
pub fn load_slice(bytes: &[u8], base: Option<&Path>) -> Result<Loaded, GltfError> {
    // The checks above are meant to leave no way to panic. Should one be missed, in our code or in
    // the JSON crates, a damaged file must still not take the host down with it.
    catch_unwind(|| convert(bytes, base)).unwrap_or_else(|payload| {
        let message = payload.downcast_ref::<&str>().map(|s| s.to_string());
        let message = message.or_else(|| payload.downcast_ref::<String>().cloned());
        Err(GltfError::Internal(message.unwrap_or_default()))
    })
}

fn convert(bytes: &[u8], base: Option<&Path>) -> Result<Loaded, GltfError> {
    let container = container::split(bytes)?;
    let mut warnings = Vec::new();
    let document = document::Document::parse(container.json, &mut warnings)?;
    let buffers = buffer::Buffers::load(&document, container.bin, base)?;
    let mut budget = budget::Budget::of_input(bytes.len() + buffers.external_bytes());
    let mut images = texture::Images::new(&document, &buffers, base);
    let materials = material::convert_all(&document, &mut images, &mut warnings)?;
    let (description, aspects) = node::convert_scene(&document, &buffers, base, materials, &mut budget, &mut warnings)?;
    Ok(Loaded { description, aspects, warnings })
}
