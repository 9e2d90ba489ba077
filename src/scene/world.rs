//! The committed scene: immutable, shared by renders.

use super::description::{self, Description, Geometry, Instance, Medium, MeshDescription};
use super::glass::Glass;
use super::media::{Boundary, LightMedia, boundary};
use super::{SceneError, fingerprint, rebase, validate};
use crate::emitter::{Lights, MOST_LIGHTS};
use crate::geometry::{Mesh, Shape, Sphere};
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
pub struct Walked {
    /// Compiled materials; rough refraction below its material's threshold is not connectable.
    pub bsdfs: Vec<Bsdf>,
    /// What refracts smoothly, or so.
    pub glass: Glass,
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
    /// What is around each light.
    pub(super) light_media: Vec<LightMedia>,
    /// The ray tracer.
    pub intersector: Box<dyn Intersector>,
    /// Cameras as described.
    pub cameras: Vec<description::Camera>,
    /// What refracts smoothly.
    pub glass: Glass,
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
                    let refracts = boundaries[instance.material].is_some();
                    check_placed(index, instance, &placed, &mut warnings, first, refracts)?;
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

        let glass = Glass::new(&shapes, &shape_material, &bsdfs)?;
        let delta_lights = description.lights.iter().any(|l| l.kind.emits());
        // What the camera sees of a delta light through frosted glass, only evaluation finds.
        let walked = walked(description, &bsdfs).filter(|_| !delta_lights);
        let walked = match walked {
            Some(bsdfs) => Some(Walked { glass: Glass::new(&shapes, &shape_material, &bsdfs)?, bsdfs }),
            None => None,
        };
        let some_glass = !walked.as_ref().map_or(&glass, |w| &w.glass).bodies().is_empty();
        let requirements = Requirements {
            caustics: some_glass && !lights.is_empty(),
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
            glass,
            walked,
            requirements,
            origin,
            bounds,
            commit_seconds: 0.0,
            warnings,
            hash,
        };
        world.light_media = world.probe_lights();
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

    /// What caustic connections lead through.
    pub fn walked_glass(&self) -> &Glass {
        self.walked.as_ref().map_or(&self.glass, |walked| &walked.glass)
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
}

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
    refracts: bool,
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
    if refracts && mesh.faces_inward() {
        let name = shown(&instance.name);
        warnings.push(format!(
            "instance {index} '{name}': closed glass whose triangles face inward has its glass around it; right for a hollow within other glass only"
        ));
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
