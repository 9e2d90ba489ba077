//! Shapes and the surface at a hit.

pub mod differential;
pub mod mesh;
pub mod ray;
pub mod sphere;
pub mod surface;

pub use differential::Differential;
pub use mesh::Mesh;
pub use ray::Ray;
pub use sphere::Sphere;
pub use surface::SurfacePoint;

use crate::intersect::Hit;

/// A shape in world space.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles.
    Mesh(Mesh),
    /// An analytic sphere.
    Sphere(Sphere),
}

impl Shape {
    /// The surface at a hit of `ray`.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let point = match self {
            Shape::Mesh(mesh) => mesh.surface(hit.primitive, hit.u, hit.v),
            Shape::Sphere(sphere) => sphere.surface(ray, hit.t),
        };
        SurfacePoint { shape: hit.shape, ..point }
    }

    /// World-space corners of the bounding box.
    pub fn bounds(&self) -> (glam::Vec3, glam::Vec3) {
        match self {
            Shape::Mesh(mesh) => mesh.bounds(),
            Shape::Sphere(s) => {
                let r = glam::Vec3::splat(s.radius);
                (s.center - r, s.center + r)
            }
        }
    }
}
