//! Lights that are not surfaces. They belong to one scene.

use super::device::Device;
use super::error::{Failure, OBJECT_LIGHT, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::pointer::{In, MAX_NAME, Out, Sized32, Text};
use super::scene::Scene;
use crate::math::Rgb;
use crate::scene::description::{self, LightKind};
use glam::DVec3;
use std::sync::{Arc, Mutex, Weak};

/// The same intensity everywhere.
pub const LIGHT_POINT: u32 = 1;
/// Within a cone.
pub const LIGHT_SPOT: u32 = 2;
/// Parallel.
pub const LIGHT_DIRECTIONAL: u32 = 3;

/// `caustica_light_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct LightDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Its kind.
    pub kind: u32,
    /// For messages.
    pub name: Text,
    /// World space.
    pub position: [f64; 3],
    /// The way the light travels.
    pub direction: [f64; 3],
    /// Half-angle of full intensity, radians.
    pub inner_angle: f64,
    /// Half-angle of zero intensity, radians.
    pub outer_angle: f64,
    /// W/sr, or W/m² for a directional light.
    pub intensity: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

// SAFETY: `repr(C)`, `u32` first, numbers and pointers only.
unsafe impl Sized32 for LightDesc {
    const NAME: &'static str = "caustica_light_desc";
    const FIRST_SIZE: usize = 96;
}

/// A light of a scene.
pub struct Light {
    pub(super) id: u64,
    /// Where to take it out from.
    scene: Weak<Scene>,
    state: Mutex<description::Light>,
}

impl Kind for Light {
    const KIND: u32 = OBJECT_LIGHT;
    const NAME: &'static str = "light";
    const PLURAL: &'static str = "lights";
}

impl Light {
    pub(super) fn new(id: u64, scene: &Arc<Scene>, state: description::Light) -> Light {
        Light { id, scene: Arc::downgrade(scene), state: Mutex::new(state) }
    }

    /// Its values now.
    pub(super) fn describe(&self) -> Result<description::Light, Failure> {
        Ok(self.state.lock().map_err(|_| self.broken())?.clone())
    }

    fn broken(&self) -> Failure {
        Failure::internal("an earlier call on this light failed").object(OBJECT_LIGHT, self.id, "")
    }
}

guard::export! {
    /// Puts a light into a scene.
    fn caustica_scene_add_light(device, scene: Handle<Scene>, desc: In<LightDesc>, light: Out<Handle<Light>>) = add;

    /// Replaces all values.
    fn caustica_light_set(device, light: Handle<Light>, desc: In<LightDesc>) = set;

    /// Takes it out of its scene.
    fn caustica_light_remove(device, light: Handle<Light>) = remove;
}

fn add(
    device: &Arc<Device>,
    scene: Handle<Scene>,
    desc: In<LightDesc>,
    light: Out<Handle<Light>>,
) -> Result<i32, Failure> {
    let scene = device.scenes.get(scene)?;
    let state = read(desc, 0)?;
    let mut contents = scene.edit()?;
    let (handle, object) = device.lights.insert(|id| Light::new(id, &scene, state))?;
    contents.lights.push(object);
    light.write(handle);
    Ok(OK)
}

fn set(device: &Arc<Device>, light: Handle<Light>, desc: In<LightDesc>) -> Result<i32, Failure> {
    let object = device.lights.get(light)?;
    let state = read(desc, object.id)?;
    *object.state.lock().map_err(|_| object.broken())? = state;
    Ok(OK)
}

fn remove(device: &Arc<Device>, light: Handle<Light>) -> Result<i32, Failure> {
    let object = device.lights.get(light)?;
    if let Some(scene) = object.scene.upgrade() {
        scene.edit()?.lights.retain(|other| !Arc::ptr_eq(other, &object));
    }
    device.lights.remove(light)?;
    Ok(OK)
}

fn read(desc: In<LightDesc>, id: u64) -> Result<description::Light, Failure> {
    let desc = desc.read("desc")?;
    let name = desc.name.read("name", MAX_NAME)?;
    let kind = convert(&desc).map_err(|failure| failure.object_if_none(OBJECT_LIGHT, id, &name))?;
    Ok(description::Light { name, kind })
}

fn convert(d: &LightDesc) -> Result<LightKind, Failure> {
    if d.reserved != 0 {
        return Err(Failure::argument("reserved", format!("is {}; 0 was expected", d.reserved)));
    }
    let (position, direction) = (DVec3::from_array(d.position), DVec3::from_array(d.direction));
    let intensity = Rgb::from_array(d.intensity);
    match d.kind {
        LIGHT_POINT => Ok(LightKind::Point { position, intensity }),
        LIGHT_SPOT => {
            Ok(LightKind::Spot { position, direction, intensity, inner: d.inner_angle, outer: d.outer_angle })
        }
        LIGHT_DIRECTIONAL => Ok(LightKind::Directional { direction, irradiance: intensity }),
        other => Err(Failure::argument("kind", format!("is {other}; a CAUSTICA_LIGHT_ was expected"))),
    }
}
