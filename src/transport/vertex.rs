//! The connectable vertices of a subpath.

use super::weight::Partial;
use crate::camera::Endpoint;
use crate::emitter::LightDensities;
use crate::geometry::SurfacePoint;
use crate::manifold::MAX_CHAIN;
use crate::math::Rgb;
use crate::scene::World;
use crate::scene::media::MediumId;
use glam::Vec3;

/// A vertex that connections may use: a point on a surface with a connectable lobe.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// The surface.
    pub at: SurfacePoint,
    /// Where its material was made for this point, if it has textures: see [`super::Tracer::material`].
    pub made: Option<u32>,
    /// Direction to the previous vertex of the subpath, unit.
    pub wo: Vec3,
    /// Throughput on arrival. Camera subpath: scales radiance. Light subpath: flux weight.
    pub beta: Rgb,
    /// The techniques that end before this vertex.
    pub partial: Partial,
    /// Of a light subpath's vertex: those of them that need no light subpath (s <= 1).
    pub camera_only: Partial,
    /// Segments between the subpath's start and this vertex, those inside chains included.
    pub segments: u32,
    /// Medium on the side of `wo`.
    pub medium: MediumId,
    /// [`crate::geometry::Targets::total`] of the glass that light is aimed at from here; 0 where it is not.
    pub aimed: f64,
    /// Of a light subpath's vertex: density with which it would be drawn without any aim, over that with it.
    pub plain: f64,
    /// Of a camera subpath's vertex: density with which aimed light leaves it along `wo`.
    pub toward: f64,
    /// The macro-edge that leads here.
    pub edge: EdgeRecord,
    /// Whether that leaves the camera or a light. Not all such vertices are the first of their subpath: some before may
    /// be [`passed`](Self::passed).
    pub first: bool,
    /// Whether the subpath went on from here by a lobe that is not connectable: then this is a vertex of the
    /// paths that are joined here, and none of those that go further.
    pub passed: bool,
    /// Whether the subpath met glass whose index varies over the spectrum, here or before.
    pub dispersed: bool,
}

/// The vertices of the path that ends at the last of these.
pub fn on_path(subpath: &[Vertex]) -> impl DoubleEndedIterator<Item = &Vertex> + Clone {
    let last = subpath.len().saturating_sub(1);
    subpath.iter().enumerate().filter(move |(i, v)| *i == last || !v.passed).map(|(_, v)| v)
}

impl Vertex {
    /// Veach's shading-normal factor of the incident side, `cos_s(wo) / cos_g(wo)`, by which a light
    /// subpath's connection differs from a camera subpath's (Veach 1997, §5.3; the cosines of the
    /// outgoing side cancel against the geometry term).
    #[inline]
    pub fn incident_adjoint(&self) -> f32 {
        if self.at.ns == self.at.ng {
            return 1.0;
        }
        self.at.ns.dot(self.wo).abs() / self.at.ng.dot(self.wo).abs()
    }

    /// The medium into which the path leaves along `w`: the one it came through, unless it crosses
    /// a refracting surface here.
    #[inline]
    pub fn medium_toward(&self, world: &World, w: Vec3) -> MediumId {
        match world.boundary(self.at.shape) {
            Some(boundary) => boundary.medium_toward(&self.at, w),
            None => self.medium,
        }
    }

    /// Absolute cosine of a direction with the geometric normal.
    #[inline]
    pub fn cos_g(&self, w: Vec3) -> f32 {
        self.at.ng.dot(w).abs()
    }

    /// Absolute cosine of a direction with the shading normal.
    #[inline]
    pub fn cos_s(&self, w: Vec3) -> f32 {
        self.at.ns.dot(w).abs()
    }
}

/// What the weights need to know of a macro-edge after it was closed, to rebuild them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeRecord {
    /// Non-connectable vertices in between.
    pub chain: u32,
    /// Their shapes in the order of the subpath, as far as they fit.
    pub shapes: [u32; MAX_CHAIN],
    /// Whether all of them refract.
    pub refracted: bool,
    /// Product of the probabilities with which a subpath scatters along the chain: toward the light, and
    /// toward the camera. Where all is smooth they are the same; microfacets count by their densities over
    /// `D(h) |n.h|`.
    pub chain_probability: [f64; 2],
    /// The chain's reverse Jacobian over its forward one: `n_a² kappa cos_a / (n_b² cos_b)` with `a` the
    /// camera-side end. Unused without a chain.
    pub etendue_ratio: f64,
    /// What stands for the technique across a chain: `1/J` where a connection would find the chain, a share of it where a
    /// search might, 0 where neither would. (So a caustic's infinite `J` is a zero.)
    pub technique: f64,
    /// Whether a connection finds the same again for sure: no chain, or a smooth one that takes no search.
    pub sure: bool,
    /// Direction in which the path left the old vertex.
    pub departure: Vec3,
}

/// The start of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex {
    /// Index of the light.
    pub light: u32,
    /// Where.
    pub at: Endpoint,
    /// A place on the ray that leaves it.
    pub through: Vec3,
    /// Densities for the path that leaves here.
    pub densities: LightDensities,
}
