//! glTF files in: what each feature becomes, and what damaged files do.
//!
//! The files are built by the tests (`builder`); expected values are worked out by hand from the
//! specification, not taken from the loader.

mod builder;
mod containers;
mod damage;
mod geometry;
mod materials;
mod nodes;
#[cfg(feature = "oiio")]
mod textures;
