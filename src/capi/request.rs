//! What a host asks of a render: its descriptor, checked and converted to the renderer's settings.

use super::camera::{self, Camera, CameraDesc};
use super::device::{Device, MAX_THREADS, User};
use super::error::*;
use super::handle::Handle;
use super::options::CausticOptions;
use super::pointer::{In, Sized32};
use super::render::{DoneCallback, ProgressCallback};
use super::scene::{Scene, Snapshot};
use crate::render::{self, Caustics, Integrator, Settings};
use std::ffi::c_void;
use std::sync::Arc;
use std::time::Duration;

/// The library's choice.
pub const INTEGRATOR_DEFAULT: u32 = 0;
/// Path tracing.
pub const INTEGRATOR_PATH: u32 = 1;
/// Bidirectional path tracing.
pub const INTEGRATOR_BDPT: u32 = 2;
/// Path tracing with manifold next-event estimation.
pub const INTEGRATOR_MNEE: u32 = 3;
/// Bidirectional path tracing without caustic connections.
pub const INTEGRATOR_BDPT_PLAIN: u32 = 4;
/// Light tracing.
pub const INTEGRATOR_LIGHT: u32 = 5;

/// `caustica_render_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RenderDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// The estimator.
    pub integrator: u32,
    /// Committed.
    pub scene: Handle<Scene>,
    /// 0 for the scene's first.
    pub camera: Handle<Camera>,
    /// Pixels; 0 for 512.
    pub width: u32,
    /// Pixels; 0 for 512.
    pub height: u32,
    /// Per pixel; 0 for 64.
    pub samples: u32,
    /// Segments of the longest path; 0 for 12.
    pub max_depth: u32,
    /// Selects the random numbers.
    pub seed: u64,
    /// 0 for none.
    pub time_limit_seconds: f64,
    /// 0 for the device's.
    pub num_threads: u32,
    /// 1 to leave out all other light, else 0.
    pub caustics_only: u32,
    /// Null for none.
    pub progress: Option<ProgressCallback>,
    /// Passed to `progress`.
    pub user: *mut c_void,
    /// Null for the defaults.
    pub caustic_options: In<CausticOptions>,
    /// 0 for none.
    pub noise_limit: f32,
    /// 0 for the usual.
    pub first_sample: u32,
    /// All 0 for the whole frame.
    pub region: Region,
    /// 1 to keep albedo and normals, else 0.
    pub features: u32,
    /// 0 for none.
    pub clamp: f32,
    /// 1 to leave the background to another picture, else 0.
    pub transparent: u32,
    /// Zero.
    pub reserved: u32,
    /// In place of `camera`; null for that.
    pub camera_desc: In<CameraDesc>,
    /// Null for none.
    pub done: Option<DoneCallback>,
}

/// `caustica_region`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Region {
    /// Columns left of it.
    pub x: u32,
    /// Rows above it.
    pub y: u32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

// SAFETY: `repr(C)`, `u32` first; callback and options are C's nullable pointers, the rest are numbers.
unsafe impl Sized32 for RenderDesc {
    const NAME: &'static str = "caustica_render_desc";
    const FIRST_SIZE: usize = 144;
}

/// A checked request.
pub(super) struct Request {
    pub(super) snapshot: Arc<Snapshot>,
    pub(super) settings: Settings,
    pub(super) progress: Option<ProgressCallback>,
    pub(super) done: Option<DoneCallback>,
    pub(super) user: User,
}

/// What the host asks for, converted and checked.
pub(super) fn request(device: &Arc<Device>, desc: In<RenderDesc>) -> Result<Request, Failure> {
    let d = desc.read("desc")?;
    if d.features > 1 {
        return Err(Failure::argument("features", format!("is {}; 0 or 1 was expected", d.features)));
    }
    if d.transparent > 1 {
        return Err(Failure::argument("transparent", format!("is {}; 0 or 1 was expected", d.transparent)));
    }
    if d.reserved != 0 {
        return Err(Failure::argument("reserved", format!("is {}; 0 was expected", d.reserved)));
    }
    if d.caustics_only > 1 {
        return Err(Failure::argument("caustics_only", format!("is {}; 0 or 1 was expected", d.caustics_only)));
    }
    let integrator = match d.integrator {
        INTEGRATOR_DEFAULT => Integrator::default(),
        INTEGRATOR_PATH => Integrator::Path,
        INTEGRATOR_BDPT | INTEGRATOR_BDPT_PLAIN => Integrator::Bdpt,
        INTEGRATOR_MNEE => Integrator::Mnee,
        INTEGRATOR_LIGHT => Integrator::Light,
        other => {
            return Err(Failure::argument("integrator", format!("is {other}; a CAUSTICA_INTEGRATOR_ was expected")));
        }
    };
    if d.num_threads > MAX_THREADS {
        return Err(Failure::limit("num_threads", format!("is {}; at most {MAX_THREADS}", d.num_threads)));
    }
    let seconds = d.time_limit_seconds;
    if !(seconds >= 0.0 && seconds.is_finite()) {
        let text = format!("is {seconds}; a finite number of at least 0 was expected");
        return Err(Failure::argument("time_limit_seconds", text));
    }
    if (d.width == 0) != (d.height == 0) {
        let zero = if d.width == 0 { "width" } else { "height" };
        return Err(Failure::argument(zero, "is 0 beside another that is not; both or none were expected"));
    }
    let Region { x, y, width, height } = d.region;
    let region = render::Region { x, y, width, height };
    let noise = d.noise_limit;
    let scene = device.scenes.get(d.scene)?;
    let snapshot = scene.snapshot().ok_or_else(|| {
        Failure::new(ERROR_WRONG_STATE, "the scene was never committed").object(OBJECT_SCENE, scene.id, "")
    })?;
    let view = if d.camera_desc.is_null() { None } else { Some(camera::read(d.camera_desc, "camera_desc", 0)?) };
    if view.is_some() && d.camera.id() != 0 {
        return Err(Failure::argument("camera", "is given beside camera_desc; one of them was expected"));
    }
    let caustic_options = d.caustic_options.read_optional("caustic_options")?.map(|o| o.convert()).transpose()?;
    let defaults = Settings::default();
    let settings = Settings {
        integrator,
        caustics: match d.integrator {
            INTEGRATOR_DEFAULT => Caustics::Auto,
            INTEGRATOR_BDPT_PLAIN => Caustics::Off,
            _ => Caustics::On,
        },
        width: or(d.width, defaults.width),
        height: or(d.height, defaults.height),
        region: (region != render::Region::all(0, 0)).then_some(region),
        camera: if view.is_some() { 0 } else { camera_index(device, &snapshot, d.camera)? },
        view,
        // Without a number, the limits alone decide.
        samples: or(d.samples, render::samples_by_limits(seconds > 0.0, noise != 0.0, d.first_sample)),
        first_sample: d.first_sample,
        // A limit too long for a `Duration` is none.
        time_limit: (seconds > 0.0).then(|| Duration::try_from_secs_f64(seconds).ok()).flatten(),
        noise_limit: (noise != 0.0).then_some(noise),
        max_depth: or(d.max_depth, defaults.max_depth),
        seed: d.seed,
        threads: or(d.num_threads, device.threads as u32) as usize,
        caustic_options: caustic_options.unwrap_or(defaults.caustic_options),
        caustics_only: d.caustics_only == 1,
        features: d.features == 1,
        transparent: d.transparent == 1,
        clamp: (d.clamp != 0.0).then_some(d.clamp),
        ..defaults
    };
    render::validate(&snapshot.world, &settings)?;
    Ok(Request { snapshot, settings, progress: d.progress, done: d.done, user: User(d.user) })
}

/// Zero means the default.
fn or(value: u32, default: u32) -> u32 {
    if value == 0 { default } else { value }
}

fn camera_index(device: &Arc<Device>, snapshot: &Snapshot, camera: Handle<Camera>) -> Result<usize, Failure> {
    if camera.id() == 0 {
        let none = || Failure::new(ERROR_WRONG_STATE, "the committed scene has no camera");
        return if snapshot.cameras.is_empty() { Err(none()) } else { Ok(0) };
    }
    let object = device.cameras.get(camera)?;
    snapshot.cameras.iter().position(|&id| id == object.id).ok_or_else(|| {
        let text = "the camera was not in the scene when it was last committed";
        Failure::new(ERROR_WRONG_STATE, text).object(OBJECT_CAMERA, object.id, "")
    })
}
