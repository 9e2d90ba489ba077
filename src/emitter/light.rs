//! One light of any kind: its points, its rays and their densities, given that it was chosen.

use super::area::MeshLight;
use super::glow::Glow;
use super::infinite::{DirectionalLight, Environment};
use super::point::PointLight;
use super::sphere::SphereLight;
use super::spot::SpotLight;
use super::surface::SurfaceEmission;
use crate::camera::Endpoint;
use crate::geometry::{BoundingDisk, Mesh, Reach, Shape, Sphere, Targets};
use crate::math::Rgb;
use crate::scene::description::LightKind;
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// A light.
#[derive(Clone, Debug)]
pub(super) enum Light {
    Mesh(MeshLight),
    Sphere(SphereLight),
    Point(PointLight),
    Spot(SpotLight),
    Directional(DirectionalLight),
    Environment(Environment),
}

/// A ray of emission; `origin` is where it starts, for a light at infinity too.
pub(super) struct EmittedRay {
    pub(super) at: Endpoint,
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
}

/// The straight line from a receiver to a light vertex.
pub(super) struct Link {
    /// Toward the light vertex, unit.
    pub(super) direction: DVec3,
    /// What turns a density per solid angle at the receiver into one of the vertex's own measure:
    /// signed `cos/d²` on a surface, `1/d²` at a point, 1 at infinity.
    pub(super) geometry: f64,
}

impl Link {
    /// `None` where the two are at the same place.
    #[inline]
    pub(super) fn between(receiver: Vec3, at: &Endpoint) -> Option<Link> {
        let to_place = |p: Vec3| {
            let d = p.as_dvec3() - receiver.as_dvec3();
            let d2 = d.length_squared();
            (d2 > 0.0).then(|| (d / d2.sqrt(), d2))
        };
        Some(match at {
            Endpoint::Surface(s) => {
                let (direction, d2) = to_place(s.p)?;
                Link { direction, geometry: -s.ng.as_dvec3().dot(direction) / d2 }
            }
            Endpoint::Point(p) => {
                let (direction, d2) = to_place(*p)?;
                Link { direction, geometry: 1.0 / d2 }
            }
            Endpoint::Infinite(direction) => Link { direction: direction.as_dvec3(), geometry: 1.0 },
        })
    }
}

/// The direction of a vertex of the environment, which has no other.
fn to_infinity(at: &Endpoint) -> Vec3 {
    match at {
        Endpoint::Infinite(direction) => *direction,
        Endpoint::Surface(_) | Endpoint::Point(_) => Vec3::ZERO,
    }
}

fn mesh(shapes: &[Shape], i: u32) -> Option<&Mesh> {
    match &shapes[i as usize] {
        Shape::Mesh(mesh) => Some(mesh),
        Shape::Sphere(_) => None,
    }
}

fn sphere(shapes: &[Shape], i: u32) -> Option<&Sphere> {
    match &shapes[i as usize] {
        Shape::Sphere(sphere) => Some(sphere),
        Shape::Mesh(_) => None,
    }
}

impl Light {
    /// The light that a shape is; `None` if it has no area.
    pub(super) fn of_shape(
        index: u32,
        shape: &Shape,
        emission: SurfaceEmission,
        glow: Option<Arc<Glow>>,
    ) -> Option<Light> {
        Some(match shape {
            Shape::Mesh(mesh) => Light::Mesh(MeshLight::new(index, mesh, emission, glow)?),
            Shape::Sphere(sphere) => Light::Sphere(SphereLight::new(index, sphere, emission)),
        })
    }

    /// A light that is not a shape.
    pub(super) fn of_kind(kind: &LightKind, disk: BoundingDisk) -> Light {
        match *kind {
            LightKind::Point { position, intensity } => {
                Light::Point(PointLight { position: position.as_vec3(), intensity })
            }
            LightKind::Spot { position, direction, intensity, inner, outer } => {
                Light::Spot(SpotLight::new(position.as_vec3(), direction, intensity, inner, outer))
            }
            LightKind::Directional { direction, irradiance } => {
                Light::Directional(DirectionalLight::new(direction, irradiance, disk))
            }
        }
    }

    /// Emitted flux, W per channel; of a light at infinity, what passes the scene's disk.
    pub(super) fn power(&self) -> DVec3 {
        match self {
            Light::Mesh(l) => l.mean_radiance() * l.emission.flux(l.area()),
            Light::Sphere(l) => l.emission.radiance.as_dvec3() * l.emission.flux(l.area),
            Light::Point(l) => l.intensity.as_dvec3() * PointLight::FLUX,
            Light::Spot(l) => l.intensity.as_dvec3() * l.flux(),
            Light::Directional(l) => l.irradiance.as_dvec3() * l.flux(),
            Light::Environment(l) => l.power(),
        }
    }

    /// Corners of its box; `None` if it shines from infinity.
    pub(super) fn bounds(&self, shapes: &[Shape]) -> Option<(Vec3, Vec3)> {
        match self {
            Light::Mesh(MeshLight { shape, .. }) | Light::Sphere(SphereLight { shape, .. }) => {
                Some(shapes[*shape as usize].bounds())
            }
            Light::Point(_) | Light::Spot(_) => self.position().map(|p| (p, p)),
            Light::Directional(_) | Light::Environment(_) => None,
        }
    }

    /// Its place, if it is a point.
    pub(super) fn position(&self) -> Option<Vec3> {
        match self {
            Light::Point(light) => Some(light.position),
            Light::Spot(light) => Some(light.position),
            Light::Mesh(_) | Light::Sphere(_) | Light::Directional(_) | Light::Environment(_) => None,
        }
    }

    /// Bytes of its image, if it has one.
    pub(super) fn memory(&self) -> u64 {
        if let Light::Environment(light) = self { light.memory() } else { 0 }
    }

    /// Toward it, if it is infinitely far away in a single direction.
    pub(super) fn direction(&self) -> Option<Vec3> {
        if let Light::Directional(light) = self { Some(-light.direction) } else { None }
    }

    /// Whether a camera path can hit it.
    #[inline]
    pub(super) fn hittable(&self) -> bool {
        match self {
            Light::Mesh(_) | Light::Sphere(_) | Light::Environment(_) => true,
            Light::Point(_) | Light::Spot(_) | Light::Directional(_) => false,
        }
    }

    /// What leaves `at` along `direction`: radiance, intensity or perpendicular irradiance.
    #[inline]
    pub(super) fn emitted(&self, shapes: &[Shape], at: &Endpoint, direction: Vec3) -> Rgb {
        let radiance = |emission: &SurfaceEmission| match at {
            Endpoint::Surface(s) => emission.radiance(s.ng, direction),
            Endpoint::Point(_) | Endpoint::Infinite(_) => Rgb::ZERO,
        };
        match self {
            Light::Mesh(l) => match (&l.glow, at) {
                (Some(glow), Endpoint::Surface(s)) => {
                    mesh(shapes, l.shape).map_or(Rgb::ZERO, |m| glow.at(m, s)) * radiance(&l.emission)
                }
                _ => radiance(&l.emission),
            },
            Light::Sphere(l) => radiance(&l.emission),
            Light::Point(l) => l.intensity,
            Light::Spot(l) => l.intensity(direction),
            Light::Directional(l) => l.irradiance,
            Light::Environment(l) => l.radiance(to_infinity(at)),
        }
    }

    /// A light vertex for a receiver, drawn with [`Light::direct_density`].
    #[inline]
    pub(super) fn sample_for(&self, shapes: &[Shape], receiver: Vec3, u: Vec2) -> Option<Endpoint> {
        Some(match self {
            Light::Mesh(l) => Endpoint::Surface(l.sample_point(mesh(shapes, l.shape)?, u)),
            Light::Sphere(l) => Endpoint::Surface(l.sample_point_for(sphere(shapes, l.shape)?, receiver, u)),
            Light::Point(l) => Endpoint::Point(l.position),
            Light::Spot(l) => Endpoint::Point(l.position),
            Light::Directional(l) => Endpoint::Infinite(-l.direction),
            Light::Environment(l) => Endpoint::Infinite(l.sample_direction(u)),
        })
    }

    /// `D` without the choice: a function of the light, the vertex and the receiver alone, so that
    /// every technique that asks gets the same bits. 1 for a delta light.
    #[inline]
    pub(super) fn direct_density(&self, shapes: &[Shape], receiver: Vec3, at: &Endpoint) -> f64 {
        match self {
            Light::Mesh(l) => 1.0 / l.area(),
            Light::Sphere(l) => match (sphere(shapes, l.shape), Link::between(receiver, at)) {
                (Some(s), Some(link)) => l.direct_density(s, receiver, link.geometry),
                _ => 0.0,
            },
            Light::Point(_) | Light::Spot(_) | Light::Directional(_) => 1.0,
            Light::Environment(l) => l.density(to_infinity(at)),
        }
    }

    /// The disk that its rays pass, if it is at infinity: there, the place of a ray is aimed and not its direction.
    #[inline]
    fn disk(&self) -> Option<&BoundingDisk> {
        match self {
            Light::Directional(l) => Some(&l.disk),
            Light::Environment(l) => Some(&l.disk),
            Light::Mesh(_) | Light::Sphere(_) | Light::Point(_) | Light::Spot(_) => None,
        }
    }

    /// What emission from `at` reaches; `None` at infinity.
    #[inline]
    fn reach(&self, at: &Endpoint) -> Option<Reach> {
        let surface = |emission: &SurfaceEmission| match at {
            Endpoint::Surface(_) if emission.two_sided => Some(Reach::ALL),
            Endpoint::Surface(s) => Some(Reach::above(s.ng)),
            Endpoint::Point(_) | Endpoint::Infinite(_) => None,
        };
        match self {
            Light::Mesh(l) => surface(&l.emission),
            Light::Sphere(l) => surface(&l.emission),
            Light::Point(_) => Some(Reach::ALL),
            Light::Spot(l) => Some(l.reach()),
            Light::Directional(_) | Light::Environment(_) => None,
        }
    }

    /// A ray of emission: its vertex with [`Light::position_density`], then, given that, its
    /// direction, or at infinity its place, with [`Light::direction_density`].
    #[inline]
    pub(super) fn sample_ray(
        &self,
        shapes: &[Shape],
        u_position: Vec2,
        u_direction: Vec2,
        u_aim: f32,
        aim: Option<(&Targets, f32)>,
    ) -> Option<EmittedRay> {
        let direction = |at: &Endpoint, plain: &dyn Fn(Vec2) -> Vec3| {
            let aimed = aim.and_then(|(targets, share)| {
                let (reach, from) = (self.reach(at)?, at.position());
                let total = targets.total(from, &reach);
                let aims = total > 0.0 && u_aim < share;
                aims.then(|| targets.sample(from, &reach, total, u_aim / share, u_direction))
            });
            aimed.unwrap_or_else(|| Some(plain(u_direction)))
        };
        let from_surface = |s: crate::geometry::SurfacePoint, emission: &SurfaceEmission| {
            let at = Endpoint::Surface(s);
            let direction = direction(&at, &|u| emission.sample_direction(s.ng, u))?;
            Some(EmittedRay { at, origin: s.p, direction })
        };
        let from_point = |p, plain: &dyn Fn(Vec2) -> Vec3| {
            let at = Endpoint::Point(p);
            Some(EmittedRay { at, origin: p, direction: direction(&at, plain)? })
        };
        let from_infinity = |direction: Vec3, disk: &BoundingDisk| {
            let aimed = aim.and_then(|(targets, share)| {
                let total = targets.total_parallel(disk);
                let aims = total > 0.0 && u_aim < share;
                aims.then(|| targets.sample_parallel(disk, direction, total, u_aim / share, u_position))
            });
            let origin = aimed.unwrap_or_else(|| Some(disk.sample(direction, u_position)))?;
            Some(EmittedRay { at: Endpoint::Infinite(-direction), origin, direction })
        };
        match self {
            Light::Mesh(l) => from_surface(l.sample_point(mesh(shapes, l.shape)?, u_position), &l.emission),
            Light::Sphere(l) => from_surface(l.sample_point(sphere(shapes, l.shape)?, u_position), &l.emission),
            Light::Point(l) => from_point(l.position, &PointLight::sample_direction),
            Light::Spot(l) => from_point(l.position, &|u| l.sample_direction(u)),
            Light::Directional(l) => from_infinity(l.direction, &l.disk),
            Light::Environment(l) => from_infinity(-l.sample_direction(u_direction), &l.disk),
        }
    }

    /// `R_m` without the choice: per area on a surface, per solid angle for the environment, 1 for a
    /// delta position or direction.
    #[inline]
    pub(super) fn position_density(&self, at: &Endpoint) -> f64 {
        match self {
            Light::Mesh(l) => 1.0 / l.area(),
            Light::Sphere(l) => 1.0 / l.area,
            Light::Point(_) | Light::Spot(_) | Light::Directional(_) => 1.0,
            Light::Environment(l) => l.density(to_infinity(at)),
        }
    }

    /// Density of the emitted direction per solid angle; at infinity, of the ray's place per
    /// perpendicular area, which lies `through` a place.
    #[inline]
    pub(super) fn direction_density(
        &self,
        at: &Endpoint,
        direction: Vec3,
        through: Vec3,
        aim: Option<(&Targets, f32)>,
    ) -> f64 {
        let plain = self.plain_direction_density(at, direction);
        let Some((targets, share)) = aim else { return plain };
        if let Some(disk) = self.disk() {
            let total = targets.total_parallel(disk);
            if !(total > 0.0) {
                return plain;
            }
            let share = f64::from(share);
            return (1.0 - share) * plain + share * targets.density_parallel(disk, direction, total, through);
        }
        let Some(reach) = self.reach(at) else { return plain };
        let from = at.position();
        let total = targets.total(from, &reach);
        if !(total > 0.0) {
            return plain;
        }
        let share = f64::from(share);
        (1.0 - share) * plain + share * targets.density(from, &reach, total, direction)
    }

    #[inline]
    pub(super) fn plain_direction_density(&self, at: &Endpoint, direction: Vec3) -> f64 {
        let from_surface = |emission: &SurfaceEmission| match at {
            Endpoint::Surface(s) => emission.direction_density(s.ng, direction),
            Endpoint::Point(_) | Endpoint::Infinite(_) => 0.0,
        };
        match self {
            Light::Mesh(l) => from_surface(&l.emission),
            Light::Sphere(l) => from_surface(&l.emission),
            Light::Point(_) => PointLight::DIRECTION_DENSITY,
            Light::Spot(l) => l.direction_density(direction),
            Light::Directional(l) => 1.0 / l.disk.area(),
            Light::Environment(l) => 1.0 / l.disk.area(),
        }
    }
}
