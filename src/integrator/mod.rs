//! Estimators of an image: one sample of one pixel at a time.

pub mod bdpt;
mod feature;
pub mod light;
pub mod path;

pub use feature::Feature;

use crate::math::Rgb;
use crate::transport::connect::Joined;
use crate::transport::vertex::on_path;
use crate::transport::{EmitterHit, LightVertex, Vertex};

/// What one sample adds to the image.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Most that a path may add to a pixel, in its largest channel, unless the camera sees the light directly, by mirrors
    /// or through smooth glass: rare bright paths are noise. Biased.
    pub most: f32,
    /// Whether to leave out what the camera sees of the environment with nothing before it, for another background.
    pub transparent: bool,
    /// Whether the camera sees a surface; where it is asked for that.
    pub covered: bool,
    /// What was more, of all paths.
    pub cut: Rgb,
    /// Radiance of the sample's own pixel.
    pub radiance: Rgb,
    /// Light-image contributions, anywhere on the film.
    pub splats: Vec<Splat>,
    /// What it sees, which is filled in if there is room for it.
    pub feature: Option<Feature>,
}

impl Default for Sample {
    fn default() -> Sample {
        Sample {
            most: f32::INFINITY,
            transparent: false,
            covered: true,
            cut: Rgb::ZERO,
            radiance: Rgb::ZERO,
            splats: Vec::new(),
            feature: None,
        }
    }
}

impl Sample {
    /// Forgets the sample before it.
    pub fn clear(&mut self) {
        self.splats.clear();
        (self.radiance, self.cut) = (Rgb::ZERO, Rgb::ZERO);
    }

    /// Adds a path's light to its own pixel; what of it is within the limit, if that holds for it, and the rest.
    #[inline]
    fn add(&mut self, light: Rgb, limited: bool) -> [Rgb; 2] {
        let [kept, rest] = if limited { self.limit(light) } else { [light, Rgb::ZERO] };
        self.radiance += kept;
        self.cut += rest;
        [kept, rest]
    }

    /// Adds it to another pixel; the same.
    #[inline]
    fn splat(&mut self, pixel: u32, light: Rgb) -> [Rgb; 2] {
        let [value, rest] = self.limit(light);
        self.splats.push(Splat { pixel, value });
        self.cut += rest;
        [value, rest]
    }

    /// What is not finite stays so.
    #[inline]
    fn limit(&self, light: Rgb) -> [Rgb; 2] {
        let largest = light.max_element();
        if largest > self.most && light.is_finite() {
            let kept = light * (self.most / largest);
            return [kept, light - kept];
        }
        [light, Rgb::ZERO]
    }
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
    /// Weight of all techniques that need no light subpath (s <= 1) together.
    pub camera_only: f64,
    /// What it adds to the image. Finite also where the value is infinite and the weight zero.
    pub weighted: Rgb,
    /// What [`Sample::most`] has taken from that.
    pub cut: Rgb,
    /// Connectable vertices from the camera, without the camera's own; see [`on_path`].
    pub camera: &'a [Vertex],
    /// Connectable vertices from the light, without the light's own; see [`on_path`].
    pub light: &'a [Vertex],
    /// The light vertex of the path.
    pub start: &'a LightVertex,
    /// The chain that the technique walked, if it was a caustic connection.
    pub chain: Option<&'a crate::transport::caustic::CausticEdge>,
    /// For s = 0: the macro-edge to the light.
    pub hit: Option<&'a EmitterHit>,
}

impl<'a> Contribution<'a> {
    /// The technique s = 0.
    fn of_hit(hit: &'a EmitterHit, pixel: u32, camera: &'a [Vertex]) -> Contribution<'a> {
        Contribution {
            s: 0,
            t: hit.segments + 1,
            pixel,
            value: hit.value,
            weight: hit.weight,
            camera_only: hit.camera_only,
            weighted: hit.value * hit.weight as f32,
            cut: Rgb::ZERO,
            camera,
            light: &[],
            start: &hit.light,
            chain: None,
            hit: Some(hit),
        }
    }

    /// A technique (s, t) that joined two subpaths.
    fn of_joined(
        joined: &'a Joined,
        (s, t): (u32, u32),
        pixel: u32,
        camera: &'a [Vertex],
        light: &'a [Vertex],
        start: &'a LightVertex,
    ) -> Contribution<'a> {
        Contribution {
            s,
            t,
            pixel,
            value: joined.value,
            weight: joined.weight,
            camera_only: joined.camera_only,
            weighted: joined.weighted,
            cut: Rgb::ZERO,
            camera,
            light,
            start,
            chain: joined.chain.as_ref(),
            hit: None,
        }
    }

    /// The same, of which a sample has taken so much, and the rest not.
    fn limited(self, [weighted, cut]: [Rgb; 2]) -> Contribution<'a> {
        Contribution { weighted, cut, ..self }
    }

    /// Whether the path has a chain of smooth refractions or reflections that the light crosses before
    /// the vertex that the camera sees. A chain between that vertex and the camera makes no caustic. Rough refraction counts
    /// as smooth where connections walk through it, and only there.
    pub fn is_caustic(&self) -> bool {
        let through = |v: &Vertex| v.edge.chain > 0;
        if self.camera.is_empty() {
            return on_path(self.light).any(through);
        }
        self.chain.is_some()
            || self.hit.is_some_and(|hit| hit.edge.chain > 0)
            || on_path(self.camera).skip(1).chain(on_path(self.light)).any(through)
    }
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
