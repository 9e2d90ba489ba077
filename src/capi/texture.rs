//! Textures: copied when made or set; what a commit has seen stays as it was.

use super::device::Device;
use super::error::{Failure, OBJECT_TEXTURE, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::pointer::{In, MAX_NAME, MAX_PATH, Out, Sized32, Text, copy_elements};
use super::write::failure;
use crate::io::image::read_texture;
use crate::math::Rgb;
use crate::scene::description::{self, Encoding, Filter, MOST_SIDE, PixelsError, TextureMap, Wrap};
use glam::Affine2;
use std::collections::HashMap;
use std::ffi::c_void;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Three bytes, a colour by the transfer function of sRGB.
pub const TEXELS_SRGB8: u32 = 1;
/// Three bytes, numbers from 0 to 1.
pub const TEXELS_LINEAR8: u32 = 2;
/// Three floats, linear.
pub const TEXELS_FLOAT: u32 = 3;

/// The image again.
pub const WRAP_REPEAT: u32 = 0;
/// The image again, every other one reversed.
pub const WRAP_MIRROR: u32 = 1;
/// The texels of the edge.
pub const WRAP_CLAMP: u32 = 2;

/// Linear between the centres of texels.
pub const FILTER_LINEAR: u32 = 0;
/// The nearest texel.
pub const FILTER_NEAREST: u32 = 1;

/// `caustica_texture_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct TextureDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// What a texel is.
    pub format: u32,
    /// For messages.
    pub name: Text,
    /// Columns of `texels`.
    pub width: u32,
    /// Rows of `texels`.
    pub height: u32,
    /// From the top left on, or null.
    pub texels: *const c_void,
    /// Bytes from one texel to the next; 0 for 3 or 12.
    pub texel_stride: u64,
    /// An image file, or null.
    pub path: Text,
    /// To the right and left.
    pub wrap_u: u32,
    /// Above and below.
    pub wrap_v: u32,
    /// Between texels.
    pub filter: u32,
    /// Zero.
    pub reserved: u32,
}

// SAFETY: `repr(C)`, `u32` first, integers and pointers only.
unsafe impl Sized32 for TextureDesc {
    const NAME: &'static str = "caustica_texture_desc";
    const FIRST_SIZE: usize = 64;
}

/// A texture; lives as long as the host or a material refers to it.
pub struct Texture {
    id: u64,
    map: Mutex<TextureMap>,
}

impl Kind for Texture {
    const KIND: u32 = OBJECT_TEXTURE;
    const NAME: &'static str = "texture";
    const PLURAL: &'static str = "textures";
}

/// Textures as a commit first saw them: all materials of a snapshot have the same.
#[derive(Default)]
pub(super) struct Textures(HashMap<*const Texture, TextureMap>);

impl Textures {
    /// A texture, found by transformed coordinates.
    pub(super) fn map(&mut self, texture: &Arc<Texture>, transform: Affine2) -> TextureMap {
        // The lock is held for an assignment or a copy of a pointer only, which cannot panic.
        let now = || texture.map.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let seen = self.0.entry(Arc::as_ptr(texture)).or_insert_with(now);
        TextureMap { transform, ..seen.clone() }
    }
}

guard::export! {
    /// Makes a texture from a copy of the host's texels or from a file.
    fn caustica_texture_create(device, desc: In<TextureDesc>, texture: Out<Handle<Texture>>) = create;

    /// Replaces all values.
    fn caustica_texture_set(device, texture: Handle<Texture>, desc: In<TextureDesc>) = set;

    /// Gives up the host's claim.
    fn caustica_texture_release(device, texture: Handle<Texture>) = release;
}

fn create(device: &Arc<Device>, desc: In<TextureDesc>, texture: Out<Handle<Texture>>) -> Result<i32, Failure> {
    let out = texture.required("texture")?;
    let map = read(desc, 0)?;
    let (handle, _) = device.textures.insert(|id| Texture { id, map: Mutex::new(map) })?;
    out.write(handle);
    Ok(OK)
}

fn set(device: &Arc<Device>, texture: Handle<Texture>, desc: In<TextureDesc>) -> Result<i32, Failure> {
    let object = device.textures.get(texture)?;
    let map = read(desc, object.id)?;
    *object.map.lock().unwrap_or_else(PoisonError::into_inner) = map;
    Ok(OK)
}

fn release(device: &Arc<Device>, texture: Handle<Texture>) -> Result<i32, Failure> {
    device.textures.remove(texture)?;
    Ok(OK)
}

fn read(desc: In<TextureDesc>, id: u64) -> Result<TextureMap, Failure> {
    let desc = desc.read("desc")?;
    let name = desc.name.read("name", MAX_NAME)?;
    convert(&desc).map_err(|failure| failure.object_if_none(OBJECT_TEXTURE, id, &name))
}

fn convert(desc: &TextureDesc) -> Result<TextureMap, Failure> {
    if desc.reserved != 0 {
        return Err(Failure::argument("reserved", format!("is {}; 0 was expected", desc.reserved)));
    }
    if !(TEXELS_SRGB8..=TEXELS_FLOAT).contains(&desc.format) {
        return Err(Failure::argument("format", format!("is {}; a CAUSTICA_TEXELS_ was expected", desc.format)));
    }
    let wrap = [wrap("wrap_u", desc.wrap_u)?, wrap("wrap_v", desc.wrap_v)?];
    let filter = match desc.filter {
        FILTER_LINEAR => Filter::Linear,
        FILTER_NEAREST => Filter::Nearest,
        other => return Err(Failure::argument("filter", format!("is {other}; a CAUSTICA_FILTER_ was expected"))),
    };
    let path = desc.path.read("path", MAX_PATH)?;
    let texture = match (desc.texels.is_null(), path.is_empty()) {
        (false, false) => return Err(Failure::argument("path", "is given beside texels; one of them was expected")),
        (true, true) => return Err(Failure::argument("texels", "are null, and so is path; one of them was expected")),
        (true, false) => {
            let encoding = if desc.format == TEXELS_SRGB8 { Encoding::Srgb } else { Encoding::Linear };
            read_texture(Path::new(&path), encoding).map_err(failure)?
        }
        (false, true) => copy(desc)?,
    };
    Ok(TextureMap { wrap, filter, ..TextureMap::new(Arc::new(texture)) })
}

fn wrap(parameter: &'static str, value: u32) -> Result<Wrap, Failure> {
    match value {
        WRAP_REPEAT => Ok(Wrap::Repeat),
        WRAP_MIRROR => Ok(Wrap::Mirror),
        WRAP_CLAMP => Ok(Wrap::Clamp),
        other => Err(Failure::argument(parameter, format!("is {other}; a CAUSTICA_WRAP_ was expected"))),
    }
}

fn copy(desc: &TextureDesc) -> Result<description::Texture, Failure> {
    check_sides(desc.width, desc.height)?;
    let (width, height) = (desc.width as usize, desc.height as usize);
    let (count, stride) = (u64::from(desc.width) * u64::from(desc.height), desc.texel_stride);
    let encoding = if desc.format == TEXELS_SRGB8 { Encoding::Srgb } else { Encoding::Linear };
    // SAFETY: the header asks that as many texels of the format be readable as the size and the stride say.
    let texture = unsafe {
        if desc.format == TEXELS_FLOAT {
            let texels: Vec<[f32; 3]> = copy_elements("texels", desc.texels.cast(), count, stride)?;
            description::Texture::of_floats(width, height, texels.into_iter().map(Rgb::from_array).collect())
        } else {
            let texels = copy_elements("texels", desc.texels.cast::<u8>(), count, stride)?;
            description::Texture::of_bytes(width, height, texels, encoding)
        }
    };
    texture.map_err(|error| of_pixels("texels", desc.width, &error))
}

/// For an image of so many columns that the host gave as `parameter`.
pub(super) fn of_pixels(parameter: &str, width: u32, error: &PixelsError) -> Failure {
    match error {
        PixelsError::Size { .. } => Failure::argument("width", error.to_string()),
        PixelsError::Pixel { x, y, .. } => {
            Failure::argument(parameter, error.to_string()).at(*y as u64 * u64::from(width) + *x as u64)
        }
    }
}

/// The sides that a host gives of an image.
pub(super) fn check_sides(width: u32, height: u32) -> Result<(), Failure> {
    for (name, side) in [("width", width), ("height", height)] {
        if !(1..=MOST_SIDE).contains(&(side as usize)) {
            return Err(Failure::argument(name, format!("is {side}; 1 to {MOST_SIDE} were expected")));
        }
    }
    Ok(())
}
