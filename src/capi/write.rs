//! The image of a render into a file.

use super::device::{Device, SEVERITY_WARNING};
use super::error::*;
use super::guard;
use super::handle::Handle;
use super::pointer::{MAX_PATH, Text};
use super::render::Render;
use crate::io::image::{self, ImageError, Metadata, WriteOptions};
use std::path::Path;
use std::sync::Arc;

guard::export! {
    /// Writes the image in the format that the extension names.
    fn caustica_render_write(device, render: Handle<Render>, path: Text) = write;
}

fn write(device: &Arc<Device>, render: Handle<Render>, path: Text) -> Result<i32, Failure> {
    let object = device.renders.get(render)?;
    let path = path.read("path", MAX_PATH)?;
    if path.is_empty() {
        return Err(Failure::argument("path", "is empty"));
    }
    let finished = object.finished()?;
    let about = |failure: Failure| failure.object_if_none(OBJECT_RENDER, render.id(), "");
    let output = finished.output().map_err(about)?;
    let path = Path::new(&path);
    let metadata = Metadata::of_render(&finished.settings, &finished.camera, finished.scene_hash, &output.statistics);
    let written = image::write(path, &output.image, &metadata, &WriteOptions::default())
        .map_err(|error| about(failure(error)))?;
    let counted = [(written.non_finite, "were NaN or infinite, now black"), (written.clamped, "were clamped")];
    let counted = counted.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} pixels {what}"));
    let dim = written.too_dim.then(|| "so dim that 16-bit floats lose digits; a TIFF has 32 bits".to_owned());
    for what in counted.chain(dim) {
        let message = Failure::new(OK, format!("{}: {what}", path.display())).object(OBJECT_RENDER, render.id(), "");
        device.messages.send(SEVERITY_WARNING, &message);
    }
    Ok(OK)
}

pub(super) fn failure(error: ImageError) -> Failure {
    let code = match error {
        ImageError::Io { .. } | ImageError::Codec { .. } => ERROR_IO,
        ImageError::Unsupported { .. } | ImageError::Module { .. } => ERROR_UNSUPPORTED,
        ImageError::OutOfMemory { .. } => ERROR_OUT_OF_MEMORY,
    };
    Failure { parameter: "path".to_owned(), ..Failure::new(code, error.to_string()) }
}
