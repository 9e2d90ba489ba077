//! What denoisers ask of a sample beside its light: colour and direction of what it sees (Rousselle, Manzi and Zwicker
//! 2013; Open Image Denoise calls them auxiliary images).

use crate::camera::Endpoint;
use crate::math::Rgb;
use crate::scatter::TransportMode;
use crate::transport::Tracer;
use glam::Vec3;

/// Of the first surface that is not smooth glass nor a mirror, seen through those.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feature {
    /// Its colour, see [`crate::scatter::Bsdf::albedo`], and the radiance of lamps and environment that come before it or
    /// where there is none; times the colour of glass and mirrors, at most 1.
    pub albedo: Rgb,
    /// Its shading normal or that of a lamp before it, world space, unit, on the side that is seen. 0 where there is none.
    pub normal: Vec3,
}

impl Feature {
    /// Of the camera subpath that was just traced.
    pub(super) fn of(tracer: &Tracer) -> Feature {
        let mut feature = Feature::default();
        for hit in tracer.emitter_hits.iter().filter(|hit| hit.vertices == 0) {
            let normal = if let Endpoint::Surface(at) = &hit.light.at { at.ns } else { Vec3::ZERO };
            feature.see(hit.value, normal, hit.direction);
        }
        if let Some(vertex) = tracer.camera_vertices.first() {
            let albedo = tracer.material(vertex, TransportMode::Radiance).albedo();
            feature.see(vertex.beta * albedo, vertex.at.ns, vertex.wo);
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
