//! The committed scene: immutable, shared by renders.

use super::description::{self, Description, Geometry, Material, Medium};
use super::glass::Glass;
use super::media::{Boundary, LightMedia, boundary};
use super::place::{self, bounding_sphere, place, reserve};
use super::spectrum::Spectrum;
use super::textured::{self, Textured, textured};
use super::{SceneError, Warning, fingerprint, rebase, validate};
use crate::emitter::{Lights, MOST_LIGHTS};
use crate::geometry::{Ray, Shape, Sphere, SurfacePoint};
use crate::intersect::{self, Backend, BackendError, Build, Hit, Intersector};
use crate::math::Rgb;
use crate::pool::thread_count;
use crate::scatter::Bsdf;
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Choices of a commit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommitOptions {
    /// The ray tracer.
    pub backend: Backend,
    /// What that is built for.
    pub build: Build,
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
    pub shapes: Arc<[Shape]>,
    /// Material of each shape.
    pub shape_material: Vec<u32>,
    /// Compiled materials; of one with textures, its factors: see [`World::bsdf`].
    pub bsdfs: Vec<Bsdf>,
    /// What varies over each shape; empty if nothing does.
    textured: Vec<Option<Textured>>,
    /// Bytes of textures and their coordinates.
    texture_memory: u64,
    /// The media that each material separates, if it refracts.
    pub boundaries: Vec<Option<Boundary>>,
    /// All media; the first is vacuum.
    pub media: Vec<Medium>,
    /// All lights.
    pub lights: Arc<Lights>,
    /// What is around each light.
    pub(super) light_media: Vec<LightMedia>,
    /// The ray tracer.
    pub intersector: Arc<dyn Intersector>,
    /// Cameras as described.
    pub cameras: Vec<description::Camera>,
    /// What refracts smoothly.
    pub glass: Glass,
    /// With rough ones; `None` if there are none, and where there are delta lights.
    pub walked: Option<Walked>,
    /// If the index of some glass varies over the spectrum.
    pub spectrum: Option<Spectrum>,
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
    pub warnings: Vec<Warning>,
    hash: u64,
    /// Of each shape.
    shape_hashes: Vec<u64>,
    options: CommitOptions,
}

impl World {
    /// Validates the description, flattens its instances, builds the ray tracer and the light tables.
    pub fn commit(description: &Description, options: CommitOptions) -> Result<World, SceneError> {
        World::commit_after(None, description, options)
    }

    /// The same, which shares with a `previous` world the shapes that stay as and where they are, and, if all do or the build
    /// is [editable](Build::Editable), what the ray tracer has of them. They are told by a hash of 64 bits.
    pub fn commit_after(
        previous: Option<&World>,
        description: &Description,
        options: CommitOptions,
    ) -> Result<World, SceneError> {
        let start = Instant::now();
        validate::validate(description)?;
        let origin = rebase::origin(description);
        let (meshes, hash) = (&description.meshes, fingerprint::fingerprint(description));
        let moved = (origin != DVec3::ZERO).then(|| rebase::moved(description, origin));
        let description = moved.as_ref().unwrap_or(description);

        let mut media = vec![Medium::VACUUM];
        let bsdfs: Vec<Bsdf> = description.materials.iter().map(textured::factors).collect();
        let mut boundaries = reserve(bsdfs.len())?;
        for bsdf in &bsdfs {
            boundaries.push(bsdf.media().map(|(i, o)| boundary(&mut media, i, o)).transpose()?);
        }
        intersect::check_count(description.instances.iter().map(|instance| match instance.geometry {
            Geometry::Mesh(mesh) => meshes[mesh].triangles.len().max(meshes[mesh].positions.len()) as u64,
            Geometry::Sphere { .. } => 1,
        }))
        .map_err(SceneError::TooLarge)?;

        let mut shape_material = reserve(description.instances.len())?;
        shape_material.extend(description.instances.iter().map(|i| i.material as u32));
        let near = previous.filter(|world| world.origin == origin);
        let same = near.filter(|world| world.shape_hashes == hash.shapes);
        let shapes = match same {
            Some(world) => world.shapes.clone(),
            None => {
                let kept = near
                    .into_iter()
                    .flat_map(|world| world.shape_hashes.iter().copied().zip(world.shapes.iter().cloned()));
                place(description, meshes, &hash.shapes, kept)?.into()
            }
        };
        let mut warnings = place::warnings(description, &shapes, |material| bsdfs[material].media());
        textured::warnings(description, meshes, &mut warnings);
        let bounds = bounding_sphere(&shapes);

        let materials: Vec<_> = description
            .instances
            .iter()
            .map(|i| (&description.materials[i.material], textured::coordinates(i.geometry, meshes)))
            .collect();
        let kinds: Vec<description::LightKind> = description.lights.iter().map(|l| l.kind).collect();
        let lights = Lights::new(&shapes, &materials, &kinds, &description.environment, bounds.0, bounds.1);
        if lights.len() > MOST_LIGHTS {
            return Err(SceneError::TooLarge(format!("{} lights; at most {MOST_LIGHTS} are taken", lights.len())));
        }
        if lights.is_empty() {
            let text = "the scene has no light: the image will be black".to_owned();
            warnings.push(Warning { instance: None, text });
        }
        let threads = thread_count(options.threads);
        let built = |world: &&World| (world.options.backend, world.options.build) == (options.backend, options.build);
        let intersector = match same.filter(built) {
            Some(world) => world.intersector.clone(),
            None => previous
                .filter(|world| options.build == Build::Editable && world.options.backend == options.backend)
                .and_then(|world| world.intersector.rebuilt(&shapes, threads))
                .unwrap_or_else(|| intersect::build(options.backend, &shapes, options.build, threads))
                .map_err(backend)?
                .into(),
        };

        let glass = Glass::new(&shapes, &shape_material, &bsdfs)?;
        let delta_lights = description.lights.iter().any(|l| l.kind.emits());
        // What the camera sees of a delta light through frosted glass, only evaluation finds.
        let walked = walked(&description.materials, &bsdfs).filter(|_| !delta_lights);
        let walked = match walked {
            Some(bsdfs) => Some(Walked { glass: Glass::new(&shapes, &shape_material, &bsdfs)?, bsdfs }),
            None => None,
        };
        let spectrum = Spectrum::new(&description.materials, &media, walked.is_some())?;
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
            textured: textured(description, meshes),
            texture_memory: textured::memory(description, meshes),
            boundaries,
            media,
            lights: Arc::new(lights),
            light_media: Vec::new(),
            intersector,
            cameras: description.cameras.clone(),
            glass,
            walked,
            spectrum,
            requirements,
            origin,
            bounds,
            commit_seconds: 0.0,
            warnings,
            hash: hash.scene,
            shape_hashes: hash.shapes,
            options,
        };
        world.light_media = match previous.filter(|previous| world.lights_stand_as_in(previous)) {
            Some(previous) => previous.light_media.clone(),
            None => world.probe_lights(),
        };
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

    /// Bytes of geometry, acceleration structure and images.
    pub fn memory(&self) -> u64 {
        let geometry: usize = self
            .shapes
            .iter()
            .map(|s| match s {
                Shape::Mesh(m) => (m.positions.len() + m.normals.len() + m.triangles.len()) * 12,
                Shape::Sphere(_) => size_of::<Sphere>(),
            })
            .sum();
        let spectrum = self.spectrum.as_ref().map_or(0, Spectrum::memory);
        spectrum
            + geometry as u64
            + self.intersector.memory()
            + self.glass.memory()
            + self.lights.memory()
            + self.texture_memory
    }

    /// The surface at a hit of `ray`, with the shading normal of an image, where there is one.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let shape = &self.shapes[hit.shape as usize];
        let mut at = shape.surface(ray, hit);
        if let Some(Some(textured)) = self.textured.get(hit.shape as usize)
            && let Shape::Mesh(mesh) = shape
        {
            at.ns = textured.normal(mesh, &at);
        }
        at
    }

    /// The material at a point: `plain`, or one that is made at `place` where there are textures, in light of one wavelength,
    /// if that is given. With the rough refraction that walks lead through, if `walked`.
    #[inline]
    pub fn bsdf<'a>(
        &self,
        plain: &'a Bsdf,
        at: &SurfacePoint,
        walked: bool,
        wavelength: Option<f64>,
        place: &'a mut Option<Bsdf>,
    ) -> &'a Bsdf {
        if let Some(Some(textured)) = self.textured.get(at.shape as usize)
            && textured.scatters()
            && let Shape::Mesh(mesh) = &self.shapes[at.shape as usize]
        {
            return place.insert(textured.bsdf(mesh, at, walked, wavelength));
        }
        plain
    }
}

fn backend(error: BackendError) -> SceneError {
    match error {
        BackendError::OutOfMemory { .. } => SceneError::OutOfMemory(error.to_string()),
        _ => SceneError::Backend(error.to_string()),
    }
}

/// The materials for caustic connections, if some of them have rough refraction to walk through.
pub(super) fn walked(materials: &[Material], bsdfs: &[Bsdf]) -> Option<Vec<Bsdf>> {
    let mut any = false;
    let walked = materials.iter().zip(bsdfs).map(|(material, bsdf)| {
        let walked = bsdf.walked(material.walked_roughness);
        any |= walked.is_some();
        walked.unwrap_or_else(|| bsdf.clone())
    });
    let walked = walked.collect();
    any.then_some(walked)
}
