//! Images of what surrounds a scene.

use super::error::Failure;
use super::{Format, ImageError, decode, load, openexr};
use crate::scene::description::{EnvironmentMap, EnvironmentMapError};
use std::path::Path;

/// Reads an image as [`super::read()`] does, for [`EnvironmentMap`]: latitude by longitude, the top row around +y. A part of one,
/// by the windows of an EXR file, and a cube map are refused.
pub fn read_environment(path: &Path) -> Result<EnvironmentMap, ImageError> {
    let (format, bytes) = load(path)?;
    map(format, &bytes).map_err(|failure| failure.at(path))
}

fn map(format: Format, bytes: &[u8]) -> Result<EnvironmentMap, Failure> {
    if format == Format::Exr {
        openexr::check_surrounds(bytes)?;
    }
    let image = decode(format, bytes)?;
    EnvironmentMap::new(image.width as usize, image.height as usize, image.pixels).map_err(|error| match error {
        EnvironmentMapError::OutOfMemory { .. } => Failure::OutOfMemory,
        EnvironmentMapError::Pixels(error) => Failure::Unsupported(error.to_string()),
    })
}
