//! What denoisers and compositors ask of a sample beside its light: colour, direction and depth of what it sees (Rousselle,
//! Manzi and Zwicker 2013; Open Image Denoise calls the first two auxiliary images).

use crate::camera::{Camera, Endpoint};
use crate::math::Rgb;
use crate::scatter::TransportMode;
use crate::scene::description::Medium;
use crate::scene::media::MediumId;
use crate::transport::Tracer;
use glam::Vec3;

/// Of the first surface that is not all smooth glass or mirror, seen through those.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feature {
    /// Its colour, see [`crate::scatter::Bsdf::albedo`], and the radiance of lamps and environment up to there; times the
    /// colour of glass and mirrors, at most 1.
    pub albedo: Rgb,
    /// Its shading normal or that of a lamp before it, world space, unit, on the side that is seen. 0 where there is none.
    pub normal: Vec3,
    /// Depth of the first surface of all, glass and mirrors too, see [`crate::camera::Camera::depth`].
    pub depth: Option<f32>,
}

impl Feature {
    /// Of the camera subpath that was just traced.
    pub(super) fn of(tracer: &Tracer, camera: &Camera) -> Feature {
        let start = tracer.camera_medium;
        let depth = tracer.camera_hit.map(|p| camera.depth(p));
        let mut feature = Feature { depth, ..Feature::default() };
        let first = tracer.camera_vertices.first();
        // Past a vertex that is in part a mirror, hits have no vertex before them either.
        let until = first.map_or(u32::MAX, |vertex| vertex.segments);
        for hit in tracer.emitter_hits.iter().filter(|hit| hit.vertices == 0 && hit.segments <= until) {
            let normal = if let Endpoint::Surface(at) = &hit.light.at { at.ns } else { Vec3::ZERO };
            feature.see(hit.white * color_scale(tracer.media, start, hit.medium), normal, hit.direction);
        }
        if let Some(vertex) = first {
            let albedo = tracer.material(vertex, TransportMode::Radiance).albedo();
            feature.see(
                vertex.beta * albedo * color_scale(tracer.media, start, vertex.medium),
                vertex.at.ns,
                vertex.wo,
            );
        }
        feature
    }

    /// Adds what is seen from `wo`.
    pub(super) fn see(&mut self, albedo: Rgb, normal: Vec3, wo: Vec3) {
        self.albedo = (self.albedo + albedo).min(Rgb::ONE);
        if self.normal == Vec3::ZERO {
            self.normal = if normal.dot(wo) < 0.0 { -normal } else { normal };
        }
    }
}

/// The throughput of radiance between two media to that of colour: radiance over the squared index is what refraction
/// keeps.
pub(super) fn color_scale(media: &[Medium], start: MediumId, end: MediumId) -> f32 {
    let [start, end] = [start, end].map(|medium| media[medium as usize].ior);
    (end / start).powi(2)
}
