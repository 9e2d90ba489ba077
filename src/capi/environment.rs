//! What surrounds a scene, infinitely far away.

use super::device::Device;
use super::error::{ERROR_OUT_OF_MEMORY, ERROR_WRONG_STATE, Failure, OBJECT_SCENE, OK};
use super::guard;
use super::handle::Handle;
use super::instance::transform;
use super::pointer::{In, MAX_PATH, Sized32, Text, Values, copy_elements};
use super::scene::Scene;
use super::texture::{check_sides, of_pixels};
use super::write::failure;
use crate::io::image::read_environment;
use crate::math::Rgb;
use crate::scene::description::{Environment, EnvironmentMap, EnvironmentMapError};
use std::path::Path;
use std::sync::Arc;

/// `caustica_environment_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct EnvironmentDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Columns of `pixels`.
    pub width: u32,
    /// Rows of `pixels`.
    pub height: u32,
    /// W/(m² sr), what the image is multiplied by.
    pub radiance: [f32; 3],
    /// Three floats per pixel, from the top left on, or null.
    pub pixels: *const f32,
    /// Bytes from one pixel to the next; 0 for 12.
    pub pixel_stride: u64,
    /// An image file, or null.
    pub path: Text,
    /// From the image to the world, a rotation.
    pub transform: [f64; 12],
}

// SAFETY: `repr(C)`, `u32` first, numbers and pointers only.
unsafe impl Sized32 for EnvironmentDesc {
    const NAME: &'static str = "caustica_environment_desc";
    const FIRST_SIZE: usize = 144;
}

guard::export! {
    /// Sets the radiance that arrives from infinity.
    fn caustica_scene_set_environment(device, scene: Handle<Scene>, radiance: Values<f32, 3>) = set_uniform;

    /// Sets an image of what is at infinity.
    fn caustica_scene_set_environment_image(device, scene: Handle<Scene>, desc: In<EnvironmentDesc>) = set_image;
}

fn set_uniform(device: &Arc<Device>, scene: Handle<Scene>, radiance: Values<f32, 3>) -> Result<i32, Failure> {
    let scene = device.scenes.get(scene)?;
    let radiance = radiance.read().ok_or_else(|| Failure::argument("radiance", "is null"))?;
    let radiance = check(radiance).map_err(|failure| failure.object(OBJECT_SCENE, scene.id, ""))?;
    scene.edit()?.environment = radiance.into();
    Ok(OK)
}

fn set_image(device: &Arc<Device>, scene: Handle<Scene>, desc: In<EnvironmentDesc>) -> Result<i32, Failure> {
    let scene = device.scenes.get(scene)?;
    let named = |failure: Failure| failure.object(OBJECT_SCENE, scene.id, "");
    let new = read(desc).map_err(named)?;
    let mut contents = scene.edit()?;
    let Some(image) = new.image.or_else(|| contents.environment.image.clone()) else {
        return Err(named(Failure::new(
            ERROR_WRONG_STATE,
            "the scene has no image that could stay; pixels or path was expected",
        )));
    };
    contents.environment = Environment { image: Some(image), ..new };
    Ok(OK)
}

fn check(radiance: [f32; 3]) -> Result<Rgb, Failure> {
    match radiance.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
        Some(at) => {
            let text = format!("is {}; finite numbers of at least 0 were expected", radiance[at]);
            Err(Failure::argument("radiance", text).at(at as u64))
        }
        None => Ok(Rgb::from_array(radiance)),
    }
}

/// All but an image that stays as it was.
fn read(desc: In<EnvironmentDesc>) -> Result<Environment, Failure> {
    let desc = desc.read("desc")?;
    let radiance = check(desc.radiance)?;
    let matrix = Some(desc.transform).filter(|m| m.iter().any(|&x| x != 0.0));
    let rotation = transform("transform", matrix)?.matrix3;
    let path = desc.path.read("path", MAX_PATH)?;
    let image = match (desc.pixels.is_null(), path.is_empty()) {
        (false, false) => return Err(Failure::argument("path", "is given beside pixels; one of them was expected")),
        (true, false) => Some(read_environment(Path::new(&path)).map_err(failure)?),
        (false, true) => Some(copy(&desc)?),
        (true, true) if desc.width != 0 || desc.height != 0 => {
            let text = format!("are null, but width and height are {} and {}", desc.width, desc.height);
            return Err(Failure::argument("pixels", text));
        }
        (true, true) => None,
    };
    Ok(Environment { radiance, image: image.map(Arc::new), rotation })
}

fn copy(desc: &EnvironmentDesc) -> Result<EnvironmentMap, Failure> {
    check_sides(desc.width, desc.height)?;
    let count = u64::from(desc.width) * u64::from(desc.height);
    // SAFETY: the header asks that as many pixels be readable as the size and the stride say.
    let pixels = unsafe { copy_elements("pixels", desc.pixels, count, desc.pixel_stride)? };
    let pixels = pixels.into_iter().map(Rgb::from_array).collect();
    EnvironmentMap::new(desc.width as usize, desc.height as usize, pixels).map_err(|error| match error {
        EnvironmentMapError::OutOfMemory { .. } => {
            Failure { parameter: "pixels".to_owned(), ..Failure::new(ERROR_OUT_OF_MEMORY, error.to_string()) }
        }
        EnvironmentMapError::Pixels(error) => of_pixels("pixels", desc.width, &error),
    })
}
