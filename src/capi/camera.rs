//! Cameras. They belong to one scene, as in a glTF file, and are part of its snapshots.

use super::device::Device;
use super::error::{Failure, OBJECT_CAMERA, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::instance::{rows, transform};
use super::pointer::{In, MAX_NAME, Out, OutStruct, Sized32, Text};
use super::scene::Scene;
use crate::scene::description::{self, Lens, Projection};
use std::sync::{Arc, Mutex, Weak};

/// A pinhole.
pub const CAMERA_PERSPECTIVE: u32 = 1;
/// Parallel.
pub const CAMERA_ORTHOGRAPHIC: u32 = 2;

/// `caustica_camera_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct CameraDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Its projection.
    pub projection: u32,
    /// For messages.
    pub name: Text,
    /// Camera to world, 3x4, row-major; all zero for the identity.
    pub transform: [f64; 12],
    /// Perspective: full vertical field of view, radians.
    pub yfov: f64,
    /// Orthographic: half the height of the film, metres.
    pub ymag: f64,
    /// Perspective: radius of the lens, metres; 0 for a pinhole.
    pub lens_radius: f64,
    /// With a lens: depth of what is sharp, metres.
    pub focus_distance: f64,
    /// By how much the film is moved to the right and up, over the height of the picture.
    pub shift: [f64; 2],
}

// SAFETY: `repr(C)`, `u32` first, numbers and pointers only.
unsafe impl Sized32 for CameraDesc {
    const NAME: &'static str = "caustica_camera_desc";
    const FIRST_SIZE: usize = 160;
}

/// A camera of a scene.
pub struct Camera {
    pub(super) id: u64,
    /// Where to take it out from.
    scene: Weak<Scene>,
    state: Mutex<description::Camera>,
}

impl Kind for Camera {
    const KIND: u32 = OBJECT_CAMERA;
    const NAME: &'static str = "camera";
    const PLURAL: &'static str = "cameras";
}

impl Camera {
    pub(super) fn new(id: u64, scene: &Arc<Scene>, state: description::Camera) -> Camera {
        Camera { id, scene: Arc::downgrade(scene), state: Mutex::new(state) }
    }

    /// Its values now.
    pub(super) fn describe(&self) -> Result<description::Camera, Failure> {
        Ok(self.state.lock().map_err(|_| self.broken())?.clone())
    }

    fn broken(&self) -> Failure {
        Failure::internal("an earlier call on this camera failed").object(OBJECT_CAMERA, self.id, "")
    }
}

guard::export! {
    /// Puts a camera into a scene.
    fn caustica_scene_add_camera(device, scene: Handle<Scene>, desc: In<CameraDesc>, camera: Out<Handle<Camera>>) = add;

    /// How many cameras a scene has.
    fn caustica_scene_camera_count(device, scene: Handle<Scene>, count: Out<u64>) = count_cameras;

    /// One of a scene's cameras.
    fn caustica_scene_camera(device, scene: Handle<Scene>, index: u64, camera: Out<Handle<Camera>>) = at;

    /// Replaces all values.
    fn caustica_camera_set(device, camera: Handle<Camera>, desc: In<CameraDesc>) = set;

    /// Its values.
    fn caustica_camera_get(device, camera: Handle<Camera>, desc: OutStruct<CameraDesc>) = get;

    /// Takes it out of its scene.
    fn caustica_camera_remove(device, camera: Handle<Camera>) = remove;
}

fn add(
    device: &Arc<Device>,
    scene: Handle<Scene>,
    desc: In<CameraDesc>,
    camera: Out<Handle<Camera>>,
) -> Result<i32, Failure> {
    let scene = device.scenes.get(scene)?;
    let state = read(desc, "desc", 0)?;
    let mut contents = scene.edit()?;
    let (handle, object) = device.cameras.insert(|id| Camera::new(id, &scene, state))?;
    contents.cameras.push(object);
    camera.write(handle);
    Ok(OK)
}

fn count_cameras(device: &Arc<Device>, scene: Handle<Scene>, count: Out<u64>) -> Result<i32, Failure> {
    let out = count.required("count")?;
    let scene = device.scenes.get(scene)?;
    out.write(scene.edit()?.cameras.len() as u64);
    Ok(OK)
}

fn at(device: &Arc<Device>, scene: Handle<Scene>, index: u64, camera: Out<Handle<Camera>>) -> Result<i32, Failure> {
    let out = camera.required("camera")?;
    let scene = device.scenes.get(scene)?;
    let contents = scene.edit()?;
    let found = usize::try_from(index).ok().and_then(|i| contents.cameras.get(i)).ok_or_else(|| {
        Failure::argument("index", format!("is {index}; the scene has {} cameras", contents.cameras.len()))
    })?;
    out.write(Handle::new(found.id));
    Ok(OK)
}

fn set(device: &Arc<Device>, camera: Handle<Camera>, desc: In<CameraDesc>) -> Result<i32, Failure> {
    let object = device.cameras.get(camera)?;
    let mut new = read(desc, "desc", object.id)?;
    let mut state = object.state.lock().map_err(|_| object.broken())?;
    if new.name.is_empty() {
        new.name = std::mem::take(&mut state.name);
    }
    *state = new;
    Ok(OK)
}

fn get(device: &Arc<Device>, camera: Handle<Camera>, desc: OutStruct<CameraDesc>) -> Result<i32, Failure> {
    let place = desc.required("desc")?;
    let state = device.cameras.get(camera)?.describe()?;
    let (projection, yfov, ymag) = match state.projection {
        Projection::Perspective { yfov } => (CAMERA_PERSPECTIVE, yfov, 0.0),
        Projection::Orthographic { ymag } => (CAMERA_ORTHOGRAPHIC, 0.0, ymag),
    };
    let transform = rows(&state.transform);
    let (lens_radius, focus_distance) = state.lens.map_or((0.0, 0.0), |lens| (lens.radius, lens.focus));
    place.write(&CameraDesc {
        struct_size: 0,
        projection,
        name: Text::NULL,
        transform,
        yfov,
        ymag,
        lens_radius,
        focus_distance,
        shift: state.shift.to_array(),
    });
    Ok(OK)
}

fn remove(device: &Arc<Device>, camera: Handle<Camera>) -> Result<i32, Failure> {
    let object = device.cameras.get(camera)?;
    if let Some(scene) = object.scene.upgrade() {
        scene.edit()?.cameras.retain(|other| !Arc::ptr_eq(other, &object));
    }
    device.cameras.remove(camera)?;
    Ok(OK)
}

/// The camera of a struct that the host passes as `parameter`; `id` 0 for one without a handle.
pub(super) fn read(desc: In<CameraDesc>, parameter: &'static str, id: u64) -> Result<description::Camera, Failure> {
    let d = desc.read(parameter)?;
    let name = d.name.read("name", MAX_NAME)?;
    let named = |failure: Failure| failure.object_if_none(OBJECT_CAMERA, id, &name);
    let projection = match d.projection {
        CAMERA_PERSPECTIVE => Projection::Perspective { yfov: d.yfov },
        CAMERA_ORTHOGRAPHIC => Projection::Orthographic { ymag: d.ymag },
        other => {
            let text = format!("is {other}; a CAUSTICA_CAMERA_ was expected");
            return Err(named(Failure::argument("projection", text)));
        }
    };
    let matrix = Some(d.transform).filter(|m| m.iter().any(|&x| x != 0.0));
    let transform = transform("transform", matrix).map_err(named)?;
    let lens = (d.lens_radius != 0.0).then_some(Lens { radius: d.lens_radius, focus: d.focus_distance });
    Ok(description::Camera { name, transform, projection, lens, shift: d.shift.into() })
}
