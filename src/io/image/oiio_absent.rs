//! Stands in for the OpenImageIO module in a build without the feature `oiio`.

use super::picture::Picture;
use super::{Failure, Format, Metadata, Stored};

fn absent() -> Failure {
    Failure::Module("this build is without the cargo feature 'oiio'; EXR works without it".to_owned())
}

/// OpenImageIO's version; never there.
pub(super) fn version() -> Result<&'static str, Failure> {
    Err(absent())
}

pub(super) fn encode(_: Format, _: &Picture, _: &Metadata) -> Result<Vec<u8>, Failure> {
    Err(absent())
}

pub(super) fn decode(_: Format, _: &[u8], _: usize) -> Result<Stored, Failure> {
    Err(absent())
}
