//! The committed scene: immutable, shared by renders.

use super::description::{self, Description, Geometry, Instance, Medium, MeshDescription};
use super::{SceneError, fingerprint, rebase, validate};
use crate::emitter::{Lights, MOST_LIGHTS};
use crate::geometry::{Mesh, Ray, Shape, Sphere, SurfacePoint};
use crate::intersect::{self, Backend, BackendError, Intersector, MAX_COORDINATE};
use crate::math::Rgb;
use crate::scatter::Bsdf;
use crate::text::shown;
use glam::{DMat3, DVec3, Vec3};
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Instant;

/// Choices of a commit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommitOptions {
    /// The ray tracer.
    pub backend: Backend,
    /// Threads for the build; 0 for as many as the process may use.
    pub threads: usize,
}

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

/// What this scene needs at render time; everything else is off and costs nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirements {
    /// Some surface refracts: the medium is tracked along subpaths.
    pub media: bool,
    /// Some medium absorbs: segments have a transmittance.
    pub absorption: bool,
    /// Some surface refracts smoothly, or nearly so, and there is light: caustic connections exist.
    pub caustics: bool,
    /// Some light is a point or at one direction, so that no camera path hits it.
    pub delta_lights: bool,
    /// Some light can be hit by a camera path: the technique s = 0 exists.
    pub hittable_lights: bool,
    /// There is any light: light subpaths and next-event estimation exist.
    pub lights: bool,
}

/// What walks lead through, where some of that is rough: caustic connections see these materials in place
/// of [`World::bsdfs`].
#[derive(Clone, Debug)]
pub struct Walked {
    /// Compiled materials; rough refraction below its material's threshold is not connectable.
    pub bsdfs: Vec<Bsdf>,
    /// The shapes that refract smoothly, or so.
    pub refractors: Vec<Refractor>,
}

/// A shape whose refraction walks lead through.
#[derive(Clone, Copy, Debug)]
pub struct Refractor {
    /// Which.
    pub shape: u32,
    /// Lower corner of its box.
    pub low: Vec3,
    /// Upper corner of its box.
    pub high: Vec3,
    /// Radius of a sphere around it, about the middle of its box.
    pub radius: f32,
    /// Whether its normal turns, so that several paths may lead through it from one point to another.
    pub curved: bool,
    /// Its triangles, if some of them are not parallel, else 0.
    pub facets: u32,
}

/// A committed scene.
pub struct World {
    /// Shapes in world space; instances are flattened.
    pub shapes: Vec<Shape>,
    /// Material of each shape.
    pub shape_material: Vec<u32>,
    /// Compiled materials.
    pub bsdfs: Vec<Bsdf>,
    /// The media that each material separates, if it refracts.
    pub boundaries: Vec<Option<Boundary>>,
    /// All media; the first is vacuum.
    pub media: Vec<Medium>,
    /// All lights.
    pub lights: Arc<Lights>,
    /// Medium at the front of each light (at the back where it emits to both sides, second).
    pub light_media: Vec<[MediumId; 2]>,
    /// The ray tracer.
    pub intersector: Box<dyn Intersector>,
    /// Cameras as described.
    pub cameras: Vec<description::Camera>,
    /// The shapes that refract smoothly: a segment outside all of their boxes sees no glass.
    pub refractors: Vec<Refractor>,
    /// With rough ones; `None` if there are none, and where there are delta lights.
    pub walked: Option<Walked>,
    /// What is switched on.
    pub requirements: Requirements,
    /// Where the world's origin lies in the description's space: 0, unless the scene is so far from
    /// its origin that f32 would lose its shape.
    pub origin: DVec3,
    /// Centre and radius of a sphere around all shapes.
    pub bounds: (Vec3, f32),
    /// Seconds that the commit took.
    pub commit_seconds: f64,
    /// Things worth telling that are not errors, e.g. degenerate triangles.
    pub warnings: Vec<String>,
    hash: u64,
}

impl World {
    /// Validates the description, flattens its instances, builds the ray tracer and the light tables.
    pub fn commit(description: &Description, options: CommitOptions) -> Result<World, SceneError> {
        let start = Instant::now();
        validate::validate(description)?;
        let origin = rebase::origin(description);
        let (meshes, hash) = (&description.meshes, fingerprint::fingerprint(description));
        let moved = (origin != DVec3::ZERO).then(|| rebase::moved(description, origin));
        let description = moved.as_ref().unwrap_or(description);
        let mut warnings = Vec::new();

        let mut media = vec![Medium::VACUUM];
        let bsdfs: Vec<Bsdf> = description.materials.iter().map(|m| Bsdf::new(&m.scattering)).collect();
        let mut boundaries = reserve(bsdfs.len())?;
        for bsdf in &bsdfs {
            boundaries.push(bsdf.media().map(|(i, o)| boundary(&mut media, i, o)).transpose()?);
        }
        intersect::check_count(description.instances.iter().map(|instance| match instance.geometry {
            Geometry::Mesh(mesh) => meshes[mesh].triangles.len().max(meshes[mesh].positions.len()) as u64,
            Geometry::Sphere { .. } => 1,
        }))
        .map_err(SceneError::TooLarge)?;

        let mut shapes = reserve(description.instances.len())?;
        let mut shape_material = reserve(description.instances.len())?;
        let mut warned = HashSet::new();
        for (index, instance) in description.instances.iter().enumerate() {
            let shape = match instance.geometry {
                Geometry::Sphere { radius } => {
                    let placed = place_sphere(instance, radius);
                    check_sphere(index, instance, &placed)?;
                    Shape::Sphere(placed)
                }
                Geometry::Mesh(mesh) => {
                    let placed = place_mesh(instance, &meshes[mesh])?;
                    let first = warned.insert(mesh);
                    check_placed(index, instance, &placed, &mut warnings, first)?;
                    Shape::Mesh(placed)
                }
            };
            shapes.push(shape);
            shape_material.push(instance.material as u32);
        }
        let bounds = bounding_sphere(&shapes);

        let materials: Vec<&description::Material> =
            description.instances.iter().map(|i| &description.materials[i.material]).collect();
        let kinds: Vec<description::LightKind> = description.lights.iter().map(|l| l.kind).collect();
        let lights = Lights::new(&shapes, &materials, &kinds, description.environment, bounds.0, bounds.1);
        if lights.len() > MOST_LIGHTS {
            return Err(SceneError::TooLarge(format!("{} lights; at most {MOST_LIGHTS} are taken", lights.len())));
        }
        if lights.is_empty() {
            warnings.push("the scene has no light: the image will be black".to_owned());
        }
        let threads = crate::pool::thread_count(options.threads);
        let intersector = intersect::build(options.backend, &shapes, threads).map_err(|error| match error {
            BackendError::OutOfMemory { .. } => SceneError::OutOfMemory(error.to_string()),
            _ => SceneError::Backend(error.to_string()),
        })?;

        let refractors = refractors(&shapes, &shape_material, &bsdfs);
        let delta_lights = description.lights.iter().any(|l| l.kind.emits());
        // What the camera sees of a delta light through frosted glass, only evaluation finds.
        let walked = walked(description, &bsdfs).filter(|_| !delta_lights);
        let walked =
            walked.map(|bsdfs| Walked { refractors: self::refractors(&shapes, &shape_material, &bsdfs), bsdfs });
        let glass = walked.as_ref().map_or(&refractors, |w| &w.refractors);
        let requirements = Requirements {
            caustics: !glass.is_empty() && !lights.is_empty(),
            delta_lights,
            media: boundaries.iter().any(Option::is_some),
            absorption: media.iter().any(|m| m.absorption != Rgb::ZERO),
            hittable_lights: lights.any_hittable(),
            lights: !lights.is_empty(),
        };
        let mut world = World {
            shapes,
            shape_material,
            bsdfs,
            boundaries,
            media,
            lights: Arc::new(lights),
            light_media: Vec::new(),
            intersector,
            cameras: description.cameras.clone(),
            refractors,
            walked,
            requirements,
            origin,
            bounds,
            commit_seconds: 0.0,
            warnings,
            hash,
        };
        world.light_media = world.probe_light_media(description);
        world.commit_seconds = start.elapsed().as_secs_f64();
        Ok(world)
    }

    /// A hash of all that was committed, for an image's metadata.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Triangles in world space, instances counted as often as they stand.
    pub fn triangle_count(&self) -> u64 {
        self.shapes.iter().map(|s| if let Shape::Mesh(m) = s { m.triangles.len() as u64 } else { 0 }).sum()
    }

    /// Bytes of geometry and acceleration structure.
    pub fn memory(&self) -> u64 {
        let geometry: usize = self
            .shapes
            .iter()
            .map(|s| match s {
                Shape::Mesh(m) => (m.positions.len() + m.normals.len() + m.triangles.len()) * 12,
                Shape::Sphere(_) => size_of::<Sphere>(),
            })
            .sum();
        geometry as u64 + self.intersector.memory()
    }

    /// The compiled material of a shape.
    #[inline]
    pub fn bsdf(&self, shape: u32) -> &Bsdf {
        &self.bsdfs[self.shape_material[shape as usize] as usize]
    }

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

    /// A light surface is taken to lie in one medium as a whole: the one at its largest triangle. Where some others lie
    /// elsewhere, that is warned about.
    fn probe_light_media(&mut self, description: &Description) -> Vec<[MediumId; 2]> {
        let mut media = vec![[0; 2]; self.lights.len()];
        if !self.requirements.media {
            return media;
        }
        let around = |at: SurfacePoint| [at.ng, -at.ng].map(|axis| self.probe(axis, |d| Ray::leaving(&at, d)));
        let mut warnings = Vec::new();
        for (shape, geometry) in self.shapes.iter().enumerate() {
            let Some(light) = self.lights.of_shape(shape as u32) else { continue };
            media[light as usize] = match geometry {
                Shape::Mesh(mesh) => {
                    let area = |t: &u32| mesh.area(*t);
                    let largest = (0..mesh.triangles.len() as u32).max_by(|a, b| area(a).total_cmp(&area(b)));
                    let Some(triangle) = largest else { continue };
                    let middle = |t: u32| mesh.surface(t, 1.0 / 3.0, 1.0 / 3.0);
                    let its = around(middle(triangle));
                    let step = mesh.triangles.len().div_ceil(LAMP_PROBES);
                    let some = (0..mesh.triangles.len() as u32).step_by(step).filter(|&t| mesh.area(t) > 0.0);
                    if some.map(|t| around(middle(t))).any(|other| other != its) {
                        let name = shown(&description.instances[shape].name);
                        let what = "a lamp in several media is taken to lie where its largest triangle does; split it";
                        warnings.push(format!("instance {shape} '{name}': {what}"));
                    }
                    its
                }
                Shape::Sphere(sphere) => around(sphere.at(glam::DVec3::Y)),
            };
        }
        for (light, medium) in media.iter_mut().enumerate() {
            if let Some(p) = self.lights.position(light as u32) {
                *medium = [self.medium_at(p); 2];
            }
        }
        self.warnings.extend(warnings);
        media
    }
}

/// Offsets, across an axis of length 1, of the rays that ask for the medium around a point: near the axis, for what is
/// open elsewhere (a surface of water), and on none of the planes and axes that models are symmetric about.
const PROBES: [[f32; 2]; 5] = [[0.013, 0.029], [0.071, -0.047], [-0.083, -0.061], [-0.037, 0.109], [0.127, 0.053]];

/// Most triangles of a lamp that are asked whether they lie in one medium: ten rays each, a millisecond for a lamp, and of
/// its parts none above a 64th of the triangles is missed. Not tuned: it decides on a warning alone.
const LAMP_PROBES: usize = 64;

/// The materials for caustic connections, if some of them have rough refraction to walk through.
fn walked(description: &Description, bsdfs: &[Bsdf]) -> Option<Vec<Bsdf>> {
    let mut any = false;
    let walked = description.materials.iter().zip(bsdfs).map(|(material, bsdf)| {
        let walked = bsdf.walked(material.walked_roughness);
        any |= walked.is_some();
        walked.unwrap_or_else(|| bsdf.clone())
    });
    let walked = walked.collect();
    any.then_some(walked)
}

/// The shapes that walks lead through.
fn refractors(shapes: &[Shape], shape_material: &[u32], bsdfs: &[Bsdf]) -> Vec<Refractor> {
    let shapes = (0..).zip(shapes.iter().zip(shape_material));
    let refracting = shapes.filter(|(_, (_, m))| bsdfs[**m as usize].walked_refraction().is_some());
    let refractor = |(shape, (geometry, _)): (u32, (&Shape, &u32))| {
        let (low, high) = padded(geometry.bounds());
        let radius = geometry.radius_about(0.5 * (low + high)) + (high - low).max_element() * 1e-4;
        Refractor { shape, low, high, radius, curved: geometry.is_curved(), facets: geometry.facets() }
    };
    refracting.map(refractor).collect()
}

/// A box a little larger, by far more than the rounding of a hit.
fn padded((low, high): (Vec3, Vec3)) -> (Vec3, Vec3) {
    let pad = Vec3::splat(((high - low).max_element() + low.abs().max(high.abs()).max_element()) * 1e-5);
    (low - pad, high + pad)
}

fn boundary(media: &mut Vec<Medium>, inside: Medium, outside: Medium) -> Result<Boundary, SceneError> {
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

/// A vector with room for `n`, or an error instead of an abort.
fn reserve<T>(n: usize) -> Result<Vec<T>, SceneError> {
    let mut v = Vec::new();
    match v.try_reserve_exact(n) {
        Ok(()) => Ok(v),
        Err(_) => Err(SceneError::OutOfMemory(format!("no memory for {n} elements of {} bytes", size_of::<T>()))),
    }
}

fn place_sphere(instance: &Instance, radius: f64) -> Sphere {
    let t = &instance.transform;
    Sphere { center: t.translation.as_vec3(), radius: (radius * t.matrix3.x_axis.length()) as f32 }
}

fn place_mesh(instance: &Instance, mesh: &MeshDescription) -> Result<Mesh, SceneError> {
    let t = &instance.transform;
    let mut positions = reserve(mesh.positions.len())?;
    positions.extend(mesh.positions.iter().map(|&p| t.transform_point3(Vec3::from(p).as_dvec3()).as_vec3()));
    // Normals go with the inverse transpose; its sign is that of the front side (see below).
    let normal_matrix: DMat3 = t.matrix3.inverse().transpose();
    let mut normals = reserve(mesh.normals.len())?;
    normals.extend(
        mesh.normals.iter().map(|&n| (normal_matrix * Vec3::from(n).as_dvec3().normalize()).normalize().as_vec3()),
    );
    let mut triangles = reserve(mesh.triangles.len())?;
    // A mirroring transform turns the winding round; swapping two vertices keeps the front in front.
    let mirrored = t.matrix3.determinant() < 0.0;
    triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }));
    Ok(Mesh { positions, normals, triangles })
}

/// What only the placed sphere can show: its size, and that it is of one.
fn check_sphere(index: usize, instance: &Instance, sphere: &Sphere) -> Result<(), SceneError> {
    let Sphere { center, radius } = *sphere;
    let small = |p: Vec3| p.abs().max_element() <= MAX_COORDINATE;
    if radius > 0.0 && small(Vec3::splat(radius)) && small(center) {
        return Ok(());
    }
    Err(SceneError::Invalid {
        kind: "instance",
        index,
        name: instance.name.clone(),
        field: "transform of the sphere".to_owned(),
        value: format!("one to {center} with a radius of {radius}"),
        expected: "coordinates and a radius below 1e18 were expected, the radius above 0".to_owned(),
    })
}

/// What only the placed mesh can show: overflow of the transform and triangles without area.
/// Warnings stand once, at the `first` instance of a mesh.
fn check_placed(
    index: usize,
    instance: &Instance,
    mesh: &Mesh,
    warnings: &mut Vec<String>,
    first: bool,
) -> Result<(), SceneError> {
    if let Some((i, p)) = mesh.positions.iter().enumerate().find(|(_, p)| !(p.abs().max_element() <= MAX_COORDINATE)) {
        return Err(SceneError::Invalid {
            kind: "instance",
            index,
            name: instance.name.clone(),
            field: format!("transform of position {i}"),
            value: p.to_string(),
            expected: "coordinates below 1e18 were expected".to_owned(),
        });
    }
    if !first {
        return Ok(());
    }
    let flat = (0..mesh.triangles.len() as u32).filter(|&t| mesh.area(t) == 0.0).count();
    if flat > 0 {
        let name = shown(&instance.name);
        warnings.push(format!("instance {index} '{name}': {flat} triangles without area are never hit"));
    }
    if mesh.triangles.is_empty() {
        warnings.push(format!("instance {index} '{}' has no triangles", shown(&instance.name)));
    }
    Ok(())
}

/// Around the box around all shapes.
fn bounding_sphere(shapes: &[Shape]) -> (Vec3, f32) {
    let (lo, hi) = shapes.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), s| {
        let (a, b) = s.bounds();
        (lo.min(a), hi.max(b))
    });
    if lo.x > hi.x {
        return (Vec3::ZERO, 1.0);
    }
    let center = lo * 0.5 + hi * 0.5;
    // A little larger, so that the emission disk of a distant light lies outside in spite of rounding.
    (center, ((hi - center).length() * 1.001).max(f32::MIN_POSITIVE))
}
