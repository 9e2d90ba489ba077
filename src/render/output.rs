//! What a render gives: images and statistics.

use super::film::FEATURES;
use super::{Image, Plane};
use crate::transport::walk_count::WalkCount;
use std::collections::BTreeMap;

/// What caustic connections or aimed light subpaths bring and cost, by a few samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Variance of the caustics without them over that with them, at equal samples.
    pub variance: f32,
    /// Work with them over that without them, per sample.
    pub work: f32,
}

/// Numbers a user needs to judge a render.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Passes in the image.
    pub samples: u32,
    /// Nearest-hit rays from the camera.
    pub camera_rays: u64,
    /// Nearest-hit rays that continue camera subpaths.
    pub camera_path_rays: u64,
    /// Nearest-hit rays of light subpaths.
    pub light_path_rays: u64,
    /// Visibility rays.
    pub shadow_rays: u64,
    /// Rays of manifold walks.
    pub walk_rays: u64,
    /// Manifold walks.
    pub walks: WalkCount,
    /// Whether caustic connections were made.
    pub caustics: bool,
    /// On what [`super::Caustics::Auto`] decided; `None` where there was nothing to decide.
    pub forecast: Option<Forecast>,
    /// Whether light subpaths were aimed at glass.
    pub aimed: bool,
    /// On what that was decided; `None` where there was nothing to decide.
    pub aim_forecast: Option<Forecast>,
    /// Light subpaths per sample.
    pub light_subpaths: f32,
    /// Most walks from one pair of ends, other than to lights that cannot be hit; 0 without connections.
    pub seeds: u32,
    /// On what that was decided; `None` where there was nothing to decide.
    pub seeds_forecast: Option<Forecast>,
    /// Probability with which connections searched for one more chain, other than to lights that cannot be hit.
    pub search: f32,
    /// On what that was decided; `None` where there was nothing to decide.
    pub search_forecast: Option<Forecast>,
    /// Share of the light that [`super::Settings::clamp`] has taken.
    pub clamped: f32,
    /// Samples whose value was NaN or infinite; dropped from the image.
    pub non_finite: u64,
    /// Pixel and sample of the first of them.
    pub first_non_finite: Option<(u32, u32)>,
    /// Seconds to build the acceleration structure and the light tables.
    pub commit_seconds: f64,
    /// Seconds to render.
    pub render_seconds: f64,
    /// Bytes of geometry and acceleration structure.
    pub scene_bytes: u64,
    /// Bytes of the film.
    pub film_bytes: u64,
    /// Worker threads.
    pub threads: u32,
    /// The ray tracer.
    pub backend: String,
}

impl Statistics {
    /// All rays.
    pub fn rays(&self) -> u64 {
        self.camera_rays + self.camera_path_rays + self.light_path_rays + self.shadow_rays + self.walk_rays
    }
}

/// One technique: the number of light-subpath vertices and of camera-subpath vertices (Veach's s, t).
pub type Technique = (u32, u32);

/// The images of one technique.
#[derive(Clone, Debug, Default)]
pub struct TechniqueImages {
    /// What it adds to the picture.
    pub weighted: Image,
    /// What it says on its own, of the paths that it can make.
    pub unweighted: Image,
    /// The caustic paths' part of `weighted`.
    pub caustic: Image,
}

/// A finished (or cancelled, with what was whole) render.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// The image.
    pub image: Image,
    /// Albedo, normal and depth, if they were asked for.
    pub features: Option<[Image; FEATURES]>,
    /// By technique. Empty unless asked for.
    pub techniques: BTreeMap<Technique, TechniqueImages>,
    /// What happened.
    pub statistics: Statistics,
    /// Whether it was cancelled before the last pass.
    pub cancelled: bool,
}

impl Output {
    /// One of its images, if it was asked for.
    pub fn plane(&self, plane: Plane) -> Option<&Image> {
        match (plane, &self.features) {
            (Plane::Radiance, _) => Some(&self.image),
            (Plane::Albedo, Some([albedo, ..])) => Some(albedo),
            (Plane::Normal, Some([_, normal, _])) => Some(normal),
            (Plane::Depth, Some([.., depth])) => Some(depth),
            (_, None) => None,
        }
    }
}
