//! Cameras: primary rays, and the importance that a point in the scene has for the film.

use crate::geometry::SurfacePoint;
use crate::scene::description;
use glam::{Vec2, Vec3};

/// Where a path ends: on a surface, at a point in space, or at infinity.
#[derive(Clone, Copy, Debug)]
pub enum Endpoint {
    /// On a surface.
    Surface(SurfacePoint),
    /// A pinhole or a point light.
    Point(Vec3),
    /// Parallel light or projection: the unit direction from the scene toward the endpoint.
    Infinite(Vec3),
}

/// How the camera sees a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraConnection {
    /// Raster position; pixel (0, 0) covers `[0, 1)²` at the top left.
    pub raster: Vec2,
    /// From the point toward the camera, unit.
    pub wi: Vec3,
    /// Where the segment to the camera ends.
    pub target: Vec3,
    /// Density, per perpendicular area at the point, with which primary rays over the whole film
    /// reach it: pinhole `1/(A_1 cos³ d²)`, parallel `1/A_film`. With a box filter this is also the
    /// importance over `N_pixels`.
    pub density: f64,
}

/// A camera with its film size.
#[derive(Clone, Debug)]
pub struct Camera {}

impl Camera {
    /// From a validated description and an image size in pixels.
    pub fn new(_description: &description::Camera, _width: u32, _height: u32) -> Camera {
        todo!()
    }

    /// The primary ray through a raster position: origin and unit direction. Its sampling weight is 1.
    pub fn generate(&self, _raster: Vec2) -> (Vec3, Vec3) {
        todo!()
    }

    /// The endpoint a path through this camera has: its pinhole or its direction of view.
    pub fn endpoint(&self) -> Endpoint {
        todo!()
    }

    /// The density of [`CameraConnection`] for a point that lies `distance` along the primary ray
    /// with unit direction `direction`.
    pub fn density(&self, _direction: Vec3, _distance: f32) -> f64 {
        todo!()
    }

    /// How the camera sees `p`, if `p` projects onto the film.
    pub fn connect(&self, _p: Vec3) -> Option<CameraConnection> {
        todo!()
    }
}
