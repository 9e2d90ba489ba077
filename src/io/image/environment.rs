//! Images of what surrounds a scene.

use super::{ImageError, read};
use crate::scene::description::{EnvironmentMap, EnvironmentMapError};
use std::path::Path;

/// Reads an image as [`read()`] does, for [`EnvironmentMap`]: latitude by longitude, the top row around +y.
pub fn read_environment(path: &Path) -> Result<EnvironmentMap, ImageError> {
    let image = read(path)?;
    EnvironmentMap::new(image.width as usize, image.height as usize, image.pixels).map_err(|error| match error {
        EnvironmentMapError::OutOfMemory { .. } => ImageError::OutOfMemory { path: path.into() },
        EnvironmentMapError::Size { .. } | EnvironmentMapError::Pixel { .. } => {
            ImageError::Unsupported { path: path.into(), reason: error.to_string() }
        }
    })
}
