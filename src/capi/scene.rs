//! Scenes: what a host puts together, and the snapshots that its commits leave. A render uses the
//! snapshot it started with, so the host may edit at once.

use super::camera::Camera;
use super::device::{Device, SEVERITY_INFO, SEVERITY_WARNING};
use super::error::{ERROR_BUSY, Failure, OBJECT_INSTANCE, OBJECT_SCENE, OK, Origins};
use super::guard;
use super::handle::{Handle, Kind, stale};
use super::instance::{Geometry, Instance};
use super::light::Light;
use super::material::Material;
use super::mesh::Mesh;
use super::pointer::{Out, OutStruct, Sized32};
use super::texture::Textures;
use crate::intersect::Build;
use crate::scene::description::{self, Description, Environment};
use crate::scene::{CommitOptions, Warning, World};
use crate::transport::limits::limits;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Instant;

/// All in one, for fast renders.
pub const BUILD_STATIC: u32 = 1;
/// In parts, for fast commits.
pub const BUILD_EDITABLE: u32 = 2;

/// `caustica_commit_report`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct CommitReport {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// How many warnings went to the message callback.
    pub warning_count: u32,
    /// In world space.
    pub triangle_count: u64,
    /// Of all that was committed.
    pub scene_hash: u64,
    /// How long it took.
    pub seconds: f64,
    /// Of a sphere around all instances.
    pub center: [f64; 3],
    /// Of that sphere.
    pub radius: f64,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CommitReport {
    const NAME: &'static str = "caustica_commit_report";
    const FIRST_SIZE: usize = 64;
}

/// What the host has put in.
#[derive(Default)]
pub(super) struct Contents {
    /// By the order in which they came.
    pub(super) instances: BTreeMap<u64, Arc<Instance>>,
    pub(super) lights: Vec<Arc<Light>>,
    pub(super) cameras: Vec<Arc<Camera>>,
    pub(super) environment: Environment,
    build: Build,
    instances_so_far: u64,
    /// Whether the scene is gone, for a call that found it just before.
    released: bool,
}

impl Contents {
    /// The next instance's place.
    pub(super) fn next_order(&mut self) -> u64 {
        self.instances_so_far += 1;
        self.instances_so_far
    }
}

/// A committed scene, with the ids of its cameras in the order of their indices.
pub(super) struct Snapshot {
    pub(super) world: World,
    pub(super) cameras: Vec<u64>,
    /// What was or had been told of it.
    remarks: Vec<Remark>,
}

/// What there is to tell of a scene, or of an instance: its id and its name.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Remark {
    severity: u32,
    instance: Option<(u64, String)>,
    text: String,
}

impl Remark {
    fn warning(warning: &Warning, instances: &[u64]) -> Remark {
        let instance = warning.instance.as_ref().map(|(index, name)| (instances[*index], name.clone()));
        Remark { severity: SEVERITY_WARNING, instance, text: warning.without_index() }
    }
}

/// A scene. A panic while its contents are locked poisons the lock: the scene says so from then on.
pub struct Scene {
    pub(super) id: u64,
    contents: Mutex<Contents>,
    /// Held by a commit, and by the release.
    committing: Mutex<()>,
    snapshot: Mutex<Option<Arc<Snapshot>>>,
}

impl Kind for Scene {
    const KIND: u32 = OBJECT_SCENE;
    const NAME: &'static str = "scene";
    const PLURAL: &'static str = "scenes";
}

impl Scene {
    /// The contents, for one thread at a time. Held for moments: nothing is read, built or called meanwhile.
    pub(super) fn edit(&self) -> Result<MutexGuard<'_, Contents>, Failure> {
        let failed = |_| Failure::internal("an earlier call on this scene failed").object(OBJECT_SCENE, self.id, "");
        let contents = self.contents.lock().map_err(failed)?;
        if contents.released { Err(stale::<Scene>(self.id)) } else { Ok(contents) }
    }

    fn empty(id: u64) -> Scene {
        Scene { id, contents: Mutex::default(), committing: Mutex::default(), snapshot: Mutex::default() }
    }

    /// The right to commit, which does not keep others from editing.
    fn start_commit(&self) -> Result<MutexGuard<'_, ()>, Failure> {
        match self.committing.try_lock() {
            Ok(committing) => Ok(committing),
            // An earlier commit that failed inside has left nothing half done.
            Err(TryLockError::Poisoned(error)) => Ok(error.into_inner()),
            Err(TryLockError::WouldBlock) => Err(self.busy()),
        }
    }

    fn busy(&self) -> Failure {
        Failure::new(ERROR_BUSY, "another thread is working on this scene").object(OBJECT_SCENE, self.id, "").expected()
    }

    /// The last commit's result. The lock is held for an assignment only.
    pub(super) fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshot.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

guard::export! {
    /// Makes an empty scene.
    fn caustica_scene_create(device, scene: Out<Handle<Scene>>) = create;

    /// Ends a scene, with its instances, lights and cameras.
    fn caustica_scene_release(device, scene: Handle<Scene>) = release;

    /// What later snapshots are built for.
    fn caustica_scene_set_build(device, scene: Handle<Scene>, build: u32) = set_build;

    /// Makes a snapshot for renders.
    fn caustica_scene_commit(device, scene: Handle<Scene>, report: OutStruct<CommitReport>) = commit;
}

fn create(device: &Arc<Device>, scene: Out<Handle<Scene>>) -> Result<i32, Failure> {
    let out = scene.required("scene")?;
    out.write(device.scenes.insert(Scene::empty)?.0);
    Ok(OK)
}

fn release(device: &Arc<Device>, scene: Handle<Scene>) -> Result<i32, Failure> {
    let object = device.scenes.get(scene)?;
    let _committing = object.start_commit()?;
    // A scene that failed can still be released.
    let mut contents = object.contents.lock().unwrap_or_else(PoisonError::into_inner);
    device.scenes.remove(scene)?;
    let contents = std::mem::replace(&mut *contents, Contents { released: true, ..Contents::default() });
    // What was loaded from a file has no handle, and what has one may be gone by another thread.
    contents.instances.values().for_each(|x| drop(device.instances.remove(Handle::new(x.id))));
    contents.lights.iter().for_each(|x| drop(device.lights.remove(Handle::new(x.id))));
    contents.cameras.iter().for_each(|x| drop(device.cameras.remove(Handle::new(x.id))));
    Ok(OK)
}

fn set_build(device: &Arc<Device>, scene: Handle<Scene>, build: u32) -> Result<i32, Failure> {
    let object = device.scenes.get(scene)?;
    object.edit()?.build = match build {
        BUILD_STATIC => Build::Static,
        BUILD_EDITABLE => Build::Editable,
        other => return Err(Failure::argument("build", format!("is {other}; a CAUSTICA_BUILD_ was expected"))),
    };
    Ok(OK)
}

fn commit(device: &Arc<Device>, scene: Handle<Scene>, report: OutStruct<CommitReport>) -> Result<i32, Failure> {
    let place = report.optional("report")?;
    let scene = device.scenes.get(scene)?;
    let start = Instant::now();
    let committing = scene.start_commit()?;
    let contents = scene.edit()?;
    let (description, origins, left_out) = describe(&contents)?;
    let options = CommitOptions { backend: device.backend, build: contents.build, threads: device.threads };
    drop(contents);
    let previous = scene.snapshot();
    let world = World::commit_after(previous.as_ref().map(|snapshot| &snapshot.world), &description, options)
        .map_err(|error| origins.explain(error).object_if_none(OBJECT_SCENE, scene.id, ""))?;
    let told: HashSet<Remark> =
        previous.map_or_else(HashSet::new, |snapshot| snapshot.remarks.iter().cloned().collect());
    let warnings = world.warnings.iter().map(|warning| Remark::warning(warning, &origins.instances));
    let limits = limits(&world).into_iter().map(|text| Remark { severity: SEVERITY_INFO, instance: None, text });
    let remarks = warnings.chain(left_out).chain(limits).collect();
    let snapshot = Arc::new(Snapshot { world, cameras: origins.cameras, remarks });
    let old = scene.snapshot.lock().unwrap_or_else(PoisonError::into_inner).replace(snapshot.clone());
    // Not under the lock: it may be large.
    drop(old);
    drop(committing);

    let world = &snapshot.world;
    for remark in snapshot.remarks.iter().filter(|remark| !told.contains(*remark)) {
        let message = Failure::new(OK, remark.text.as_str());
        let message = match &remark.instance {
            Some((id, name)) => message.object(OBJECT_INSTANCE, *id, name),
            None => message.object(OBJECT_SCENE, scene.id, ""),
        };
        device.messages.send(remark.severity, &message);
    }
    place.write(&CommitReport {
        struct_size: 0,
        warning_count: snapshot.remarks.iter().filter(|remark| remark.severity == SEVERITY_WARNING).count() as u32,
        triangle_count: world.triangle_count(),
        scene_hash: world.hash(),
        seconds: start.elapsed().as_secs_f64(),
        center: (world.bounds.0.as_dvec3() + world.origin).to_array(),
        radius: world.bounds.1.into(),
    });
    Ok(OK)
}

/// The contents as a description: objects become indices, each mesh and material standing once. And what was left out.
fn describe(contents: &Contents) -> Result<(Description, Origins, Vec<Remark>), Failure> {
    let mut description = Description { environment: contents.environment.clone(), ..Description::default() };
    let (mut origins, mut left_out) = (Origins::default(), Vec::new());
    let mut meshes: HashMap<*const Mesh, usize> = HashMap::new();
    let mut materials: HashMap<*const Material, usize> = HashMap::new();
    let mut textures = Textures::default();
    for instance in contents.instances.values() {
        let placement = instance.placement()?.clone();
        if !placement.visible {
            continue;
        }
        if placement.collapsed() {
            let warning =
                Warning::of(0, &instance.name, "its transform scales it to nothing or flattens it: it is left out");
            left_out.push(Remark::warning(&warning, &[instance.id]));
            continue;
        }
        let geometry = match &instance.geometry {
            Geometry::Sphere { radius } => description::Geometry::Sphere { radius: *radius },
            Geometry::Mesh(mesh) => {
                let next = description.meshes.len();
                let index = *meshes.entry(Arc::as_ptr(mesh)).or_insert(next);
                if index == next {
                    description.meshes.push(mesh.describe());
                    origins.meshes.push(mesh.id);
                }
                description::Geometry::Mesh(index)
            }
        };
        let next = description.materials.len();
        let material = *materials.entry(Arc::as_ptr(&placement.material)).or_insert(next);
        if material == next {
            description.materials.push(placement.material.describe(&mut textures)?);
            origins.materials.push(placement.material.id);
        }
        let (name, transform) = (instance.name.clone(), placement.transform);
        description.instances.push(description::Instance { name, geometry, material, transform });
        origins.instances.push(instance.id);
    }
    for light in &contents.lights {
        description.lights.push(light.describe()?);
        origins.lights.push(light.id);
    }
    for camera in &contents.cameras {
        description.cameras.push(camera.describe()?);
        origins.cameras.push(camera.id);
    }
    Ok((description, origins, left_out))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capi::error::{ERROR_INTERNAL, OBJECT_SCENE};

    #[test]
    fn a_second_commit_is_told_that_the_scene_is_busy() {
        let scene = Scene::empty(9);
        let _first = scene.start_commit().unwrap();
        let failure = std::thread::scope(|s| s.spawn(|| scene.start_commit().err()).join().unwrap()).unwrap();
        assert_eq!((failure.code, failure.object_kind, failure.object_id), (ERROR_BUSY, OBJECT_SCENE, 9));
    }

    #[test]
    fn a_scene_whose_change_panicked_says_so_from_then_on() {
        let scene = Scene::empty(9);
        let inside = guard::catch::<()>(|| {
            let _contents = scene.edit()?;
            panic!("halfway");
        });
        assert_eq!(inside.err().map(|failure| failure.code), Some(ERROR_INTERNAL));
        assert_eq!(scene.edit().err().map(|failure| failure.code), Some(ERROR_INTERNAL));
    }
}
