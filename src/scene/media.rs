//! The media of a scene, and which of them is where.

use super::description::Medium;
use super::{SceneError, World};
use crate::camera::Endpoint;
use crate::geometry::{Mesh, Ray, Shape, SurfacePoint};
use crate::math::{Discrete, Rgb, pixel_position, warp};
use glam::Vec3;
use std::sync::Arc;

/// Index into [`World::media`]; 0 is vacuum.
pub type MediumId = u16;

/// The media on the two sides of a refracting surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boundary {
    /// Behind the surface.
    pub inside: MediumId,
    /// Before it.
    pub outside: MediumId,
}

impl Boundary {
    /// The medium on the side that `direction`, leaving the surface, points to.
    #[inline]
    pub fn medium_toward(&self, at: &SurfacePoint, direction: Vec3) -> MediumId {
        if at.ng.dot(direction) < 0.0 { self.inside } else { self.outside }
    }
}

/// The media around a light.
#[derive(Clone)]
pub(super) enum LightMedia {
    /// At its front and at its back.
    One([MediumId; 2]),
    /// It crosses a boundary: asked wherever a light subpath starts.
    Several,
}

/// The media on the sides of a surface; what is new is added to `media`.
pub(super) fn boundary(media: &mut Vec<Medium>, inside: Medium, outside: Medium) -> Result<Boundary, SceneError> {
    let mut id = |m: Medium| {
        let found = media.iter().position(|k| *k == m);
        let index = found.unwrap_or_else(|| {
            media.push(m);
            media.len() - 1
        });
        match MediumId::try_from(index) {
            Ok(id) if id < MediumId::MAX => Ok(id),
            _ => Err(SceneError::TooLarge(format!("more than {} different media", MediumId::MAX))),
        }
    };
    Ok(Boundary { inside: id(inside)?, outside: id(outside)? })
}

/// Offsets, across an axis of length 1, of the rays that ask for the medium around a point: near the axis, for what is
/// open elsewhere (a surface of water), and on none of the planes and axes that models are symmetric about.
const PROBES: [[f32; 2]; 5] = [[0.013, 0.029], [0.071, -0.047], [-0.083, -0.061], [-0.037, 0.109], [0.127, 0.053]];

/// Points of a lamp that are asked for its media, ten rays each: many, a few milliseconds, where its box meets that of a
/// surface that refracts, so that no contact of more than a few thousandths of the lamp is missed; else a surface of
/// water ends above it at most. Of very many lamps all together, in a second or two. Not tuned.
const LAMP_PROBES: u32 = 16;
const NEAR_LAMP_PROBES: u32 = 1024;
const ALL_LAMPS_PROBES: u32 = 1 << 17;

impl World {
    /// The media a shape separates, if it refracts.
    #[inline]
    pub fn boundary(&self, shape: u32) -> Option<Boundary> {
        self.boundaries[self.shape_material[shape as usize] as usize]
    }

    /// Beer-Lambert transmittance of a segment.
    #[inline]
    pub fn transmittance(&self, medium: MediumId, length: f32) -> Rgb {
        let m = &self.media[medium as usize];
        // An infinite segment, kept finite so that a channel without absorption does not become 0 * inf.
        if m.absorption == Rgb::ZERO { Rgb::ONE } else { (-m.absorption * length.min(f32::MAX)).exp() }
    }

    /// The medium around a point in space: that of the near side of the first refracting surface upward, vacuum if
    /// there is none. Surfaces that do not refract are passed.
    pub fn medium_at(&self, p: Vec3) -> MediumId {
        self.probe(Vec3::Y, |direction| Ray { origin: p, direction, t_max: f32::INFINITY })
    }

    /// What most of [`PROBES`] about an axis meet: some may slip through a pole or a seam that is not quite closed.
    fn probe(&self, axis: Vec3, ray: impl Fn(Vec3) -> Ray) -> MediumId {
        if !self.requirements.media {
            return 0;
        }
        let (u, v) = axis.any_orthonormal_pair();
        let found = PROBES.map(|[x, y]| self.medium_along(ray((axis + u * x + v * y).normalize())));
        let votes = |medium: &MediumId| found.iter().filter(|m| *m == medium).count();
        found.into_iter().max_by_key(votes).unwrap_or(0)
    }

    fn medium_along(&self, mut ray: Ray) -> MediumId {
        // Each step leaves one surface behind; the count guards against coincident surfaces.
        for _ in 0..1000 {
            let Some(hit) = self.intersector.closest(&ray) else { return 0 };
            let at = self.shapes[hit.shape as usize].surface(&ray, &hit);
            if let Some(boundary) = self.boundary(hit.shape) {
                return boundary.medium_toward(&at, -ray.direction);
            }
            ray = Ray::leaving(&at, ray.direction);
        }
        0
    }

    /// The medium into which a light shines at a point of it: at its back, or at its front.
    #[inline]
    pub fn medium_of_light(&self, light: u32, at: &Endpoint, back: bool) -> MediumId {
        match (&self.light_media[light as usize], at) {
            (LightMedia::Several, Endpoint::Surface(at)) => self.medium_before(at, back),
            (LightMedia::One(media), _) => media[usize::from(back)],
            (LightMedia::Several, _) => 0,
        }
    }

    /// The medium at one side of a surface that does not refract.
    fn medium_before(&self, at: &SurfacePoint, back: bool) -> MediumId {
        let axis = if back { -at.ng } else { at.ng };
        self.probe(axis, |direction| Ray::leaving(at, direction))
    }

    /// Whether the media around all lights are those of another world, as it has them.
    pub(super) fn lights_stand_as_in(&self, other: &World) -> bool {
        let (lights, others) = (&self.lights, &other.lights);
        let same_shape =
            |shape| self.boundary(shape) == other.boundary(shape) && lights.of_shape(shape) == others.of_shape(shape);
        Arc::ptr_eq(&self.shapes, &other.shapes)
            && self.media == other.media
            && lights.len() == others.len()
            && (0..self.shapes.len() as u32).all(same_shape)
            && (0..lights.len() as u32).all(|light| lights.position(light) == others.position(light))
    }

    /// The media around all lights.
    pub(super) fn probe_lights(&self) -> Vec<LightMedia> {
        let around_point = |light| self.lights.position(light).map_or(0, |p| self.medium_at(p));
        let mut media: Vec<_> =
            (0..self.lights.len() as u32).map(|light| LightMedia::One([around_point(light); 2])).collect();
        if !self.requirements.media {
            return media;
        }
        let refracts = (0..).zip(self.shapes.iter()).filter(|(shape, _)| self.boundary(*shape).is_some());
        let boundaries: Vec<_> = refracts.map(|(_, shape)| shape.bounds()).collect();
        for (shape, geometry) in (0..).zip(self.shapes.iter()) {
            let Some(light) = self.lights.of_shape(shape) else { continue };
            let (low, high) = geometry.bounds();
            let meets = |(l, h): &(Vec3, Vec3)| l.cmple(high).all() && h.cmpge(low).all();
            let probes = if boundaries.iter().any(meets) { NEAR_LAMP_PROBES } else { LAMP_PROBES };
            let most = (ALL_LAMPS_PROBES / self.lights.len() as u32).max(1);
            media[light as usize] = self.probe_lamp(geometry, probes.min(most));
        }
        media
    }

    /// By points that spread evenly over it.
    fn probe_lamp(&self, lamp: &Shape, probes: u32) -> LightMedia {
        let areas = |mesh: &Mesh| Discrete::new((0..mesh.triangles.len() as u32).map(|t| f64::from(mesh.area(t))));
        let triangles = if let Shape::Mesh(mesh) = lamp { areas(mesh) } else { None };
        let point = |i: u32| {
            let u = pixel_position(0, 0, i);
            match (lamp, &triangles) {
                (Shape::Mesh(mesh), Some(triangles)) => {
                    let triangle = triangles.sample((f64::from(i) + 0.5) / f64::from(probes));
                    let b = warp::triangle(u);
                    Some(mesh.surface(triangle as u32, b.x, b.y))
                }
                (Shape::Sphere(sphere), _) => Some(sphere.at(warp::sphere(u).as_dvec3())),
                (Shape::Mesh(_), None) => None,
            }
        };
        let around = |at: SurfacePoint| [false, true].map(|back| self.medium_before(&at, back));
        let mut media = (0..probes).filter_map(point).map(around);
        let first = media.next().unwrap_or_default();
        if media.all(|other| other == first) { LightMedia::One(first) } else { LightMedia::Several }
    }
}
