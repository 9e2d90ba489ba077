//! Files: scenes in, images out.

pub mod gltf;
pub mod image;
