//! Estimators of an image: one sample of one pixel at a time.

pub mod bdpt;
pub mod path;

use crate::math::Rgb;
use crate::transport::{LightVertex, Vertex};

/// What one sample adds to the image.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// Radiance of the sample's own pixel.
    pub radiance: Rgb,
    /// Light-image contributions, anywhere on the film.
    pub splats: Vec<Splat>,
}

/// A light-image contribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Pixel index, row by row from the top.
    pub pixel: u32,
    /// Its value, to be averaged over passes.
    pub value: Rgb,
}

/// One full path that a technique made; what an [`Observer`] is shown.
#[derive(Clone, Copy, Debug)]
pub struct Contribution<'a> {
    /// Vertices of the light subpath, chains and endpoint included (Veach's s).
    pub s: u32,
    /// Vertices of the camera subpath, chains and endpoint included (Veach's t).
    pub t: u32,
    /// Pixel it falls on.
    pub pixel: u32,
    /// Without weight.
    pub value: Rgb,
    /// Its weight.
    pub weight: f64,
    /// Connectable vertices from the camera, without the camera's own.
    pub camera: &'a [Vertex],
    /// Connectable vertices from the light, without the light's own.
    pub light: &'a [Vertex],
    /// The light vertex of the path.
    pub start: &'a LightVertex,
    /// The chain that the technique walked, if it was a caustic connection.
    pub chain: Option<&'a crate::transport::caustic::CausticEdge>,
    /// For s = 0: the macro-edge to the light.
    pub hit: Option<&'a crate::transport::EmitterHit>,
}

/// Looks at every full path, for images per technique and for tests. The unit type looks at nothing
/// and costs nothing.
pub trait Observer {
    /// Called for each path with a non-zero value.
    fn observe(&mut self, contribution: &Contribution);
}

impl Observer for () {
    #[inline]
    fn observe(&mut self, _: &Contribution) {}
}
