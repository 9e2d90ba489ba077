//! What a render leaves: pixels and numbers.

use super::device::Device;
use super::error::{ERROR_INTERNAL, Failure, OBJECT_RENDER, OK, chars};
use super::guard;
use super::handle::Handle;
use super::pointer::{In, Sized32};
use super::render::Render;
use crate::math::Rgb;
use crate::render::{Image, Output, Plane};
use std::ffi::{c_char, c_void};
use std::sync::Arc;

/// Three floats.
pub const FORMAT_RGB_F32: u32 = 1;
/// Four floats, alpha 1.
pub const FORMAT_RGBA_F32: u32 = 2;

/// The picture.
pub const IMAGE_RADIANCE: u32 = 0;
/// What is seen: its colour.
pub const IMAGE_ALBEDO: u32 = 1;
/// What is seen: its shading normal.
pub const IMAGE_NORMAL: u32 = 2;
/// How far away it is.
pub const IMAGE_DEPTH: u32 = 3;

/// `caustica_pixels`: where the host wants the image.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Pixels {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// A `FORMAT_`.
    pub format: u32,
    /// Any alignment.
    pub data: *mut c_void,
    /// Bytes at `data`.
    pub size: u64,
    /// Bytes from one row to the next; 0 for no gap.
    pub row_stride: u64,
    /// Where to write the number of samples per pixel, or null.
    pub samples: *mut u32,
    /// An `IMAGE_`.
    pub image: u32,
    /// Zero.
    pub reserved: u32,
}

// SAFETY: `repr(C)`, `u32` first, integers and pointers only.
unsafe impl Sized32 for Pixels {
    const NAME: &'static str = "caustica_pixels";
    const FIRST_SIZE: usize = 48;
}

/// `caustica_statistics`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Statistics {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Per pixel.
    pub samples: u32,
    /// Nearest-hit rays from the camera.
    pub camera_rays: u64,
    /// Nearest-hit rays that continue camera subpaths.
    pub camera_path_rays: u64,
    /// Nearest-hit rays of light subpaths.
    pub light_path_rays: u64,
    /// Visibility rays.
    pub shadow_rays: u64,
    /// Rays of manifold walks.
    pub walk_rays: u64,
    /// Walks for connections.
    pub connection_walks: u64,
    /// Of these, successful.
    pub connected_walks: u64,
    /// Walks that check sampled chains.
    pub check_walks: u64,
    /// Of these, successful.
    pub confirmed_walks: u64,
    /// Steps of all walks.
    pub walk_iterations: u64,
    /// Walks that roulette spared.
    pub spared_walks: u64,
    /// See [`crate::render::Forecast`]; NaN without.
    pub forecast_variance: f32,
    /// See [`crate::render::Forecast`]; NaN without.
    pub forecast_work: f32,
    /// Samples that were NaN or infinite.
    pub non_finite: u64,
    /// Pixel of the first, or `UINT32_MAX`.
    pub first_non_finite_pixel: u32,
    /// Sample of the first, or `UINT32_MAX`.
    pub first_non_finite_sample: u32,
    /// Building the scene.
    pub commit_seconds: f64,
    /// Rendering.
    pub render_seconds: f64,
    /// Geometry and acceleration structure.
    pub scene_bytes: u64,
    /// Film.
    pub film_bytes: u64,
    /// Workers.
    pub threads: u32,
    /// Relative standard error of the image; NaN if unknown.
    pub noise: f32,
    /// Share of the light that a clamp took.
    pub clamped: f32,
    /// Whether caustic connections were made.
    pub caustics: u32,
    /// Whether light subpaths were aimed at glass.
    pub aimed: u32,
    /// See [`crate::render::Forecast`], of aiming; NaN without.
    pub aim_forecast_variance: f32,
    /// See [`crate::render::Forecast`], of aiming; NaN without.
    pub aim_forecast_work: f32,
    /// Light subpaths per sample.
    pub light_subpaths: f32,
    /// Most walks from one pair of ends.
    pub seeds: u32,
    /// Probability of a search for one more chain.
    pub search: f32,
    /// See [`crate::render::Forecast`], of walks from other starts; NaN without.
    pub seeds_forecast_variance: f32,
    /// See [`crate::render::Forecast`], of walks from other starts; NaN without.
    pub seeds_forecast_work: f32,
    /// See [`crate::render::Forecast`], of searches; NaN without.
    pub search_forecast_variance: f32,
    /// See [`crate::render::Forecast`], of searches; NaN without.
    pub search_forecast_work: f32,
    /// The ray tracer.
    pub backend: [c_char; 64],
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for Statistics {
    const NAME: &'static str = "caustica_statistics";
    const FIRST_SIZE: usize = 280;
}

impl Statistics {
    /// For the host.
    pub(super) fn new(output: &Output, noise: f32) -> Statistics {
        let s = &output.statistics;
        let (pixel, sample) = s.first_non_finite.unwrap_or((u32::MAX, u32::MAX));
        Statistics {
            struct_size: size_of::<Statistics>() as u32,
            width: output.image.width,
            height: output.image.height,
            samples: s.samples,
            camera_rays: s.camera_rays,
            camera_path_rays: s.camera_path_rays,
            light_path_rays: s.light_path_rays,
            shadow_rays: s.shadow_rays,
            walk_rays: s.walk_rays,
            connection_walks: s.walks.connections,
            connected_walks: s.walks.connected,
            check_walks: s.walks.checks,
            confirmed_walks: s.walks.confirmed,
            walk_iterations: s.walks.iterations,
            spared_walks: s.walks.spared,
            forecast_variance: s.forecast.map_or(f32::NAN, |f| f.variance),
            forecast_work: s.forecast.map_or(f32::NAN, |f| f.work),
            non_finite: s.non_finite,
            first_non_finite_pixel: pixel,
            first_non_finite_sample: sample,
            commit_seconds: s.commit_seconds,
            render_seconds: s.render_seconds,
            scene_bytes: s.scene_bytes,
            film_bytes: s.film_bytes,
            threads: s.threads,
            noise,
            clamped: s.clamped,
            caustics: s.caustics.into(),
            aimed: s.aimed.into(),
            aim_forecast_variance: s.aim_forecast.map_or(f32::NAN, |f| f.variance),
            aim_forecast_work: s.aim_forecast.map_or(f32::NAN, |f| f.work),
            light_subpaths: s.light_subpaths,
            seeds: s.seeds,
            search: s.search,
            seeds_forecast_variance: s.seeds_forecast.map_or(f32::NAN, |f| f.variance),
            seeds_forecast_work: s.seeds_forecast.map_or(f32::NAN, |f| f.work),
            search_forecast_variance: s.search_forecast.map_or(f32::NAN, |f| f.variance),
            search_forecast_work: s.search_forecast.map_or(f32::NAN, |f| f.work),
            backend: chars(&s.backend),
        }
    }
}

guard::export! {
    /// Copies the image.
    callback_safe fn caustica_render_read(device, render: Handle<Render>, pixels: In<Pixels>) = read;
}

fn read(device: &Arc<Device>, render: Handle<Render>, pixels: In<Pixels>) -> Result<i32, Failure> {
    let target = pixels.read("pixels")?;
    let object = device.renders.get(render)?;
    if target.reserved != 0 {
        return Err(Failure::argument("reserved", format!("is {}; 0 was expected", target.reserved)));
    }
    let plane = match target.image {
        IMAGE_RADIANCE => Plane::Radiance,
        IMAGE_ALBEDO => Plane::Albedo,
        IMAGE_NORMAL => Plane::Normal,
        IMAGE_DEPTH => Plane::Depth,
        other => return Err(Failure::argument("image", format!("is {other}; a CAUSTICA_IMAGE_ was expected"))),
    };
    if plane != Plane::Radiance && !object.features {
        let text = format!("is {}; the render was not asked for features", target.image);
        return Err(Failure::argument("image", text).object_if_none(OBJECT_RENDER, render.id(), ""));
    }
    let copied = match object.so_far(plane)? {
        Ok(finished) => finished.output().and_then(|o| match o.plane(plane) {
            Some(image) => copy(image, o.statistics.samples, &target),
            None => Err(Failure::new(ERROR_INTERNAL, "the render has no features")),
        }),
        Err((image, samples)) => copy(&image, samples, &target),
    };
    copied.map_err(|failure| failure.object_if_none(OBJECT_RENDER, render.id(), ""))
}

fn copy(image: &Image, samples: u32, target: &Pixels) -> Result<i32, Failure> {
    let channels: u64 = match target.format {
        FORMAT_RGB_F32 => 3,
        FORMAT_RGBA_F32 => 4,
        other => return Err(Failure::argument("format", format!("is {other}; a CAUSTICA_FORMAT_ was expected"))),
    };
    if target.data.is_null() {
        return Err(Failure::argument("data", "is null"));
    }
    let row = image.width as u64 * channels * size_of::<f32>() as u64;
    let stride = if target.row_stride == 0 { row } else { target.row_stride };
    if stride < row {
        return Err(Failure::argument("row_stride", format!("is {stride}; at least {row} bytes were expected")));
    }
    // The last row needs no gap after it.
    let needed = stride.checked_mul(image.height.saturating_sub(1) as u64).and_then(|n| n.checked_add(row));
    let needed = needed.ok_or_else(|| Failure::argument("row_stride", format!("is {stride}, which overflows")))?;
    if target.size < needed {
        return Err(Failure::argument("size", format!("is {}; at least {needed} bytes were expected", target.size)));
    }
    let alpha = |i: usize| image.alpha.get(i).copied().unwrap_or(1.0);
    for (y, pixels) in image.pixels.chunks_exact(image.width.max(1) as usize).enumerate() {
        for (x, pixel) in pixels.iter().enumerate() {
            let at = y as u64 * stride + x as u64 * channels * size_of::<f32>() as u64;
            // SAFETY: the host says that `size` bytes are writable; the pixel ends within `needed`,
            // which is not more.
            unsafe {
                let to = target.data.cast::<u8>().add(at as usize);
                match target.format {
                    FORMAT_RGBA_F32 => {
                        let alpha = alpha(y * image.width as usize + x);
                        to.cast::<[f32; 4]>().write_unaligned(pixel.extend(alpha).to_array());
                    }
                    _ => to.cast::<[f32; 3]>().write_unaligned(Rgb::to_array(pixel)),
                }
            }
        }
    }
    if !target.samples.is_null() {
        // SAFETY: the host says that a `uint32_t` is writable there.
        unsafe { target.samples.write_unaligned(samples) };
    }
    Ok(OK)
}
