//! Shapes and the surface at a hit.

pub mod differential;
pub mod disk;
pub mod enclosure;
pub mod mesh;
pub mod ray;
pub mod sphere;
pub mod surface;
pub mod targets;

pub use differential::Differential;
pub use disk::BoundingDisk;
pub use enclosure::Enclosure;
pub use mesh::Mesh;
pub use ray::Ray;
pub use sphere::Sphere;
pub use surface::SurfacePoint;
pub use targets::{Aim, Reach, Targets};

use crate::intersect::Hit;
use glam::Vec3;
use std::sync::Arc;

/// A shape in world space.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles, which snapshots of a scene share.
    Mesh(Arc<Mesh>),
    /// An analytic sphere.
    Sphere(Sphere),
}

/// Facets are parallel within this angle, radians.
const PARALLEL: f64 = 1e-3;

impl Shape {
    /// The surface at a hit of `ray`.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let point = match self {
            Shape::Mesh(mesh) => mesh.surface_along(ray, hit.primitive, hit.u, hit.v),
            Shape::Sphere(sphere) => sphere.surface(ray, hit.t),
        };
        SurfacePoint { shape: hit.shape, ..point }
    }

    /// Whether the shading normal turns along some part of the surface.
    pub fn is_curved(&self) -> bool {
        match self {
            Shape::Mesh(mesh) => {
                let turns = |[a, b, c]: &[u32; 3]| {
                    let n = |i: &u32| mesh.normals[*i as usize];
                    n(a) != n(b) || n(a) != n(c)
                };
                !mesh.normals.is_empty() && mesh.triangles.iter().any(turns)
            }
            Shape::Sphere(_) => true,
        }
    }

    /// Its triangles, if some of them are not parallel: as behind curved glass, several ways may lead through it. Else 0.
    pub fn facets(&self) -> u32 {
        let Shape::Mesh(mesh) = self else { return 0 };
        let mut normals = (0..mesh.triangles.len() as u32).filter_map(|t| mesh.normal(t));
        let first = normals.next();
        let several = first.is_some_and(|f| normals.any(|n| n.cross(f).length_squared() > PARALLEL * PARALLEL));
        if several { mesh.triangles.len() as u32 } else { 0 }
    }

    /// Radius of the smallest sphere around `center` that holds the shape.
    pub fn radius_about(&self, center: Vec3) -> f32 {
        match self {
            Shape::Mesh(mesh) => mesh.positions.iter().map(|p| p.distance(center)).fold(0.0, f32::max),
            Shape::Sphere(s) => s.center.distance(center) + s.radius,
        }
    }

    /// World-space corners of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Shape::Mesh(mesh) => mesh.bounds(),
            Shape::Sphere(s) => {
                let r = Vec3::splat(s.radius);
                (s.center - r, s.center + r)
            }
        }
    }
}
