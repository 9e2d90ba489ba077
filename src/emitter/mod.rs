//! Light sources: drawing a light point for next-event estimation, drawing an emitted ray, and what a
//! camera path finds when it hits a light.
//!
//! The densities are those of Georgiev et al. 2012 as tabulated in Speierer et al. 2018 setting:
//! `R_m` generates the light vertex itself, `R_{m-1}` the next one, `D` draws the light vertex for a
//! given receiver. A delta position or direction is left out of the measure.

use crate::camera::Endpoint;
use crate::geometry::{Shape, SurfacePoint};
use crate::math::Rgb;
use crate::scene::description::{LightKind, Material};
use glam::{Vec2, Vec3};

/// Densities that the weights need at a light vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightDensities {
    /// `D`: next-event estimation from the given receiver draws this light vertex. Per area on a
    /// surface, per solid angle at infinity, a probability for a delta light.
    pub direct: f64,
    /// `R_m`: emission draws this light vertex, in the same measure as `direct`.
    pub position: f64,
    /// Emission leaves in this direction: per solid angle for a light at a finite place; for one at
    /// infinity, the density per area perpendicular to the direction.
    pub direction: f64,
    /// `a_m`: whether a camera path can hit the light.
    pub hittable: bool,
}

/// A light vertex drawn for a receiver.
#[derive(Clone, Copy, Debug)]
pub struct DirectSample {
    /// Index of the light.
    pub light: u32,
    /// The light vertex.
    pub at: Endpoint,
    /// From the receiver to the light, unit.
    pub wi: Vec3,
    /// Incident radiance over the density of `wi` (per solid angle at the receiver):
    /// `L_e cos_y / (d² D)`, for a point light `I / (d² D)`, for a directional one `E / D`.
    pub incident: Rgb,
    /// Densities of the light vertex, the direction being the one to the receiver.
    pub densities: LightDensities,
}

/// A ray drawn from the emission of all lights.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// Index of the light.
    pub light: u32,
    /// The light vertex.
    pub at: Endpoint,
    /// Where the ray starts when the light is at infinity: a point of the disk before the scene.
    pub origin: Vec3,
    /// Direction of travel, unit.
    pub direction: Vec3,
    /// Flux weight: `L_e cos_g / (R_m p_direction)`, and alike for the other kinds.
    pub beta: Rgb,
    /// Densities; `direct` is 0 here, since the receiver is not known yet:
    /// see [`Lights::direct_density`].
    pub densities: LightDensities,
}

/// All lights of a scene and the choice among them.
pub struct Lights {}

impl Lights {
    /// Collects the emissive shapes, the other lights and the environment. `materials[i]` belongs to
    /// `shapes[i]`; `center` and `radius` bound the scene.
    pub fn new(
        _shapes: &[Shape],
        _materials: &[&Material],
        _lights: &[LightKind],
        _environment: Rgb,
        _center: Vec3,
        _radius: f32,
    ) -> Lights {
        todo!()
    }

    /// Number of lights; an emissive shape counts as one.
    pub fn len(&self) -> usize {
        todo!()
    }

    /// Whether there is no light.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether any light can be hit by a camera path (emissive shape or environment).
    pub fn any_hittable(&self) -> bool {
        todo!()
    }

    /// Draws a light vertex for a receiver at `receiver`.
    pub fn sample_direct(&self, _shapes: &[Shape], _receiver: Vec3, _u_light: f32, _u: Vec2) -> Option<DirectSample> {
        todo!()
    }

    /// Draws an emitted ray.
    pub fn sample_emission(
        &self,
        _shapes: &[Shape],
        _u_light: f32,
        _u_position: Vec2,
        _u_direction: Vec2,
    ) -> Option<EmissionSample> {
        todo!()
    }

    /// `D`: density with which [`Lights::sample_direct`] from `receiver` draws the vertex `at` of
    /// light `light`.
    pub fn direct_density(&self, _shapes: &[Shape], _light: u32, _at: &Endpoint, _receiver: Vec3) -> f64 {
        todo!()
    }

    /// The light index of an emissive shape.
    pub fn of_shape(&self, _shape: u32) -> Option<u32> {
        todo!()
    }

    /// Radiance that the surface point of light `light` sends along `direction` (leaving the
    /// surface), with its densities for the receiver there; `None` where it is dark.
    pub fn hit(
        &self,
        _shapes: &[Shape],
        _light: u32,
        _at: &SurfacePoint,
        _direction: Vec3,
        _receiver: Vec3,
    ) -> Option<(Rgb, LightDensities)> {
        todo!()
    }

    /// Radiance that arrives along a ray that left the scene in direction `direction`.
    pub fn escape(&self, _direction: Vec3) -> Option<(Rgb, LightDensities)> {
        todo!()
    }
}
