//! Light sources: drawing a light point for next-event estimation, drawing an emitted ray, and what a
//! camera path finds when it hits a light.
//!
//! The densities are those of Georgiev et al. 2012 as tabulated in Speierer et al. 2018 setting:
//! `R_m` generates the light vertex itself, `R_{m-1}` the next one, `D` draws the light vertex for a
//! given receiver. A delta position or direction is left out of the measure.
//!
//! A density is a function of the light vertex, the direction and the receiver (at infinity, of a place on the ray:
//! rounding may put that on either side of the rim of what is aimed at), never of the random numbers that drew them:
//! whichever technique asks for it gets the same bits, and the weights of all techniques of one path sum to 1.
//!
//! Emission chooses a light by power, mixed with a small uniform share (`P`); next-event estimation by what arrives at the
//! receiver, mixed with a share of `P` (`P'`), or with less than two lights at finite places alike.

mod area;
mod choose;
mod glow;
mod infinite;
mod light;
mod map;
mod point;
mod sphere;
mod spot;
mod surface;
#[cfg(test)]
mod tests;
mod tree;

use crate::camera::Endpoint;
use crate::geometry::{Aim, BoundingDisk, Shape, SurfacePoint, Targets};
use crate::math::Rgb;
use crate::scene::description::{self, LightKind, Material, MeshDescription};
pub use choose::MOST_LIGHTS;
use choose::{Choice, Power};
use glam::{DVec3, Vec2, Vec3};
use glow::Glow;
use infinite::Environment;
use light::{EmittedRay, Light, Link};
pub use map::{EnvironmentMap, EnvironmentMapError};
use std::sync::Arc;
use surface::SurfaceEmission;

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
    /// Density of the direction without aim, over that with it.
    pub plain: f64,
    /// Densities; `direct` is 0 here, since the receiver is not known yet:
    /// see [`Lights::direct_density`].
    pub densities: LightDensities,
}

/// All lights of a scene and the choice among them.
#[derive(Clone, Debug)]
pub struct Lights {
    lights: Arc<[Light]>,
    /// `None` if there are no lights.
    choice: Option<Choice>,
    /// The light that each shape is.
    of_shape: Vec<Option<u32>>,
    /// The light that the environment is.
    environment: Option<u32>,
    /// Toward the directional lights.
    suns: Vec<Vec3>,
    /// Where emission goes more often than its brightness says.
    aim: Option<Aim>,
}

impl Lights {
    /// Collects the emissive shapes, the other lights and the environment. `materials[i]` belongs to
    /// `shapes[i]`, with what has its texture coordinates, if it has any; `center` and `radius` bound the scene. What emits nothing is no light.
    pub fn new(
        shapes: &[Shape],
        materials: &[(&Material, Option<&Arc<MeshDescription>>)],
        lights: &[LightKind],
        environment: &description::Environment,
        center: Vec3,
        radius: f32,
    ) -> Lights {
        let mut all = Vec::new();
        let mut powers = Vec::new();
        let mut add = |light: Light| {
            let (flux, place) = (light.power().dot(LUMINANCE), light.bounds(shapes));
            (flux > 0.0).then(|| {
                all.push(light);
                powers.push(Power { flux, place });
                all.len() as u32 - 1
            })
        };

        let glows = materials.iter().filter(|(material, mesh)| material.textures.emission.is_some() && mesh.is_some());
        let points = glow::points(glows.count());
        let of_shape = (0u32..)
            .zip(shapes.iter().zip(materials))
            .map(|(i, (shape, (material, mesh)))| {
                let emission = SurfaceEmission { radiance: material.emission, two_sided: material.emission_two_sided };
                // An image that nothing tells the place of: most of it may be black.
                let lost = material.textures.emission.is_some() && mesh.is_none();
                if emission.radiance == Rgb::ZERO || lost {
                    None
                } else {
                    let glow = material.textures.emission.as_ref().zip(*mesh);
                    let glow = glow.map(|(map, mesh)| Arc::new(Glow { map: map.clone(), mesh: mesh.clone(), points }));
                    Light::of_shape(i, shape, emission, glow).and_then(&mut add)
                }
            })
            .collect();
        let disk = BoundingDisk::new(center, radius);
        for kind in lights {
            add(Light::of_kind(kind, disk));
        }
        let environment = add(Light::Environment(Environment::new(environment, disk)));
        let suns = all.iter().filter_map(Light::direction).collect();

        Lights { choice: Choice::by_power(&powers), lights: all.into(), of_shape, environment, suns, aim: None }
    }

    /// The same lights with a share of the emission of each aimed. (The projection maps of Jensen 2001, §9.3,
    /// but with the density of the mixture, as the weights need it.)
    pub fn aimed(&self, aim: Aim) -> Lights {
        Lights { aim: Some(aim), ..self.clone() }
    }

    /// Number of lights; an emissive shape counts as one.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there is no light.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether any light can be hit by a camera path (emissive shape or environment).
    pub fn any_hittable(&self) -> bool {
        self.lights.iter().any(Light::hittable)
    }

    /// Whether a light at `at` is one that no camera path can hit. (Of an environment, nothing lies in exactly the
    /// direction of a directional light.)
    #[inline]
    pub fn is_delta(&self, at: &Endpoint) -> bool {
        match at {
            Endpoint::Surface(_) => false,
            Endpoint::Point(_) => true,
            Endpoint::Infinite(direction) => self.suns.contains(direction),
        }
    }

    /// The light vertex that [`Lights::sample_direct`] draws from the same numbers, whether or not it
    /// shines along the straight line, and its density `D`.
    #[inline]
    pub fn sample_vertex(
        &self,
        shapes: &[Shape],
        receiver: Vec3,
        u_light: f32,
        u: Vec2,
    ) -> Option<(u32, Endpoint, f64)> {
        let light = self.choice.as_ref()?.sample_for(receiver, u_light);
        let at = self.lights[light as usize].sample_for(shapes, receiver, u)?;
        let direct = self.direct_density(shapes, light, &at, receiver);
        (direct > 0.0).then_some((light, at, direct))
    }

    /// What leaves `at` of a light along `direction`: radiance; for a point, intensity; for parallel
    /// light, perpendicular irradiance.
    #[inline]
    pub fn emitted(&self, shapes: &[Shape], light: u32, at: &Endpoint, direction: Vec3) -> Rgb {
        self.lights[light as usize].emitted(shapes, at, direction)
    }

    /// Draws a light vertex for a receiver at `receiver`. `None` where that vertex gives no light.
    #[inline]
    pub fn sample_direct(&self, shapes: &[Shape], receiver: Vec3, u_light: f32, u: Vec2) -> Option<DirectSample> {
        let index = self.choice.as_ref()?.sample_for(receiver, u_light);
        let light = &self.lights[index as usize];
        let at = light.sample_for(shapes, receiver, u)?;
        let link = Link::between(receiver, &at)?;
        let wi = link.direction.as_vec3();

        let emitted = light.emitted(shapes, &at, -wi);
        let densities = self.densities(shapes, index, &at, (-wi, receiver), receiver);
        if emitted == Rgb::ZERO || densities.direct <= 0.0 {
            return None;
        }
        let incident = scale(emitted, link.geometry.abs() / densities.direct);
        Some(DirectSample { light: index, at, wi, incident, densities })
    }

    /// Whether emission is aimed, and [`Lights::sample_emission`] needs its last number.
    #[inline]
    pub fn aims(&self) -> bool {
        self.aim.is_some()
    }

    /// Draws an emitted ray. `None` if it carries nothing.
    #[inline]
    pub fn sample_emission(
        &self,
        shapes: &[Shape],
        u_light: f32,
        u_position: Vec2,
        u_direction: Vec2,
        u_aim: f32,
    ) -> Option<EmissionSample> {
        let index = self.choice.as_ref()?.sample(u_light);
        let light = &self.lights[index as usize];
        let aim = self.aim_of(index);
        let EmittedRay { at, origin, direction } = light.sample_ray(shapes, u_position, u_direction, u_aim, aim)?;

        let emitted = light.emitted(shapes, &at, direction);
        let (position, direction_density) = self.emission_densities(index, &at, direction, origin);
        // An image's cells without light have no density, and rounding may lead just into one.
        if emitted == Rgb::ZERO || !(position > 0.0 && direction_density > 0.0) {
            return None;
        }
        let cos = match &at {
            Endpoint::Surface(s) => s.ng.as_dvec3().dot(direction.as_dvec3()).abs(),
            Endpoint::Point(_) | Endpoint::Infinite(_) => 1.0,
        };
        let beta = scale(emitted, cos / (position * direction_density));
        let densities =
            LightDensities { direct: 0.0, position, direction: direction_density, hittable: light.hittable() };
        let plain = aim.map_or(1.0, |_| light.plain_direction_density(&at, direction) / direction_density);
        Some(EmissionSample { light: index, at, origin, direction, beta, plain, densities })
    }

    /// `D`: density with which [`Lights::sample_direct`] from `receiver` draws the vertex `at` of
    /// light `light`.
    #[inline]
    pub fn direct_density(&self, shapes: &[Shape], light: u32, at: &Endpoint, receiver: Vec3) -> f64 {
        let choice = self.choice.as_ref().map_or(0.0, |c| c.probability_for(receiver, light));
        choice * self.lights[light as usize].direct_density(shapes, receiver, at)
    }

    /// The light index of an emissive shape.
    #[inline]
    pub fn of_shape(&self, shape: u32) -> Option<u32> {
        self.of_shape.get(shape as usize).copied().flatten()
    }

    /// The light index of the environment.
    #[inline]
    pub fn environment(&self) -> Option<u32> {
        self.environment
    }

    /// Bytes of images.
    pub fn memory(&self) -> u64 {
        self.environment.map_or(0, |light| self.lights[light as usize].memory())
    }

    /// Position of a light that is a point.
    pub fn position(&self, light: u32) -> Option<Vec3> {
        self.lights[light as usize].position()
    }

    /// Radiance that the surface point of light `light` sends along `direction` (leaving the
    /// surface), with its densities for the receiver there; `None` where it is dark.
    #[inline]
    pub fn hit(
        &self,
        shapes: &[Shape],
        light: u32,
        at: &SurfacePoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<(Rgb, LightDensities)> {
        let at = Endpoint::Surface(*at);
        let radiance = self.lights[light as usize].emitted(shapes, &at, direction);
        (radiance != Rgb::ZERO).then(|| (radiance, self.densities(shapes, light, &at, (direction, receiver), receiver)))
    }

    /// Radiance that arrives along a ray that left the scene from `origin` in direction `direction`.
    #[inline]
    pub fn escape(&self, origin: Vec3, direction: Vec3) -> Option<(Rgb, LightDensities)> {
        let light = self.environment?;
        let at = Endpoint::Infinite(direction);
        let radiance = self.lights[light as usize].emitted(&[], &at, -direction);
        if radiance == Rgb::ZERO {
            return None;
        }
        // It is drawn alike for every receiver.
        Some((radiance, self.densities(&[], light, &at, (-direction, origin), Vec3::ZERO)))
    }

    /// Where a light's emission goes more often, and what share of it.
    #[inline]
    fn aim_of(&self, light: u32) -> Option<(&Targets, f32)> {
        let aim = self.aim.as_ref()?;
        let share = aim.share(light);
        (share > 0.0).then_some((aim.targets(), share))
    }

    /// `R_m`, and the density of the direction.
    #[inline]
    fn emission_densities(&self, light: u32, at: &Endpoint, direction: Vec3, through: Vec3) -> (f64, f64) {
        let l = &self.lights[light as usize];
        let choice = self.choice.as_ref().map_or(0.0, |c| c.probability(light));
        (choice * l.position_density(at), l.direction_density(at, direction, through, self.aim_of(light)))
    }

    /// The densities of light vertex `at` for a path that leaves it along `direction` and passes `through` a place, which tells
    /// rays from infinity apart, and for a receiver.
    #[inline]
    pub fn densities(
        &self,
        shapes: &[Shape],
        light: u32,
        at: &Endpoint,
        (direction, through): (Vec3, Vec3),
        receiver: Vec3,
    ) -> LightDensities {
        let (position, direction) = self.emission_densities(light, at, direction, through);
        LightDensities {
            direct: self.direct_density(shapes, light, at, receiver),
            position,
            direction,
            hittable: self.lights[light as usize].hittable(),
        }
    }
}

/// Luminance in f64, where the power of a dim and tiny light does not vanish.
const LUMINANCE: DVec3 = DVec3::new(0.212_639, 0.715_169, 0.072_192);

#[inline]
fn scale(c: Rgb, s: f64) -> Rgb {
    (c.as_dvec3() * s).as_vec3()
}
