//! Devices: the root of all objects.
//!
//! A device pointer is never dereferenced. It is a number in the clothes of a pointer, made of the
//! process id and a count, and looked up in the list of living devices, which is process-wide state for
//! this one purpose: a released or invented pointer is an error and not a crash, and so is a device
//! that a forked child inherited, which is seen before any lock is touched (another thread of the
//! parent may have held it at the fork).

use super::camera::Camera;
use super::error::{self, *};
use super::guard;
use super::handle::{DEVICE_BITS, Kind, Table};
use super::instance::Instance;
use super::light::Light;
use super::material::Material;
use super::mesh::Mesh;
use super::pointer::{In, Out, Sized32};
use super::render::Render;
use super::scene::Scene;
use super::texture::Texture;
use crate::geometry::{Shape, Sphere};
use crate::intersect::{self, Backend, Build};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A remark.
pub const SEVERITY_INFO: u32 = 1;
/// Something the user should look at.
pub const SEVERITY_WARNING: u32 = 2;
/// A call or a render failed.
pub const SEVERITY_ERROR: u32 = 3;

/// Embree where it is built in.
pub const BACKEND_DEFAULT: u32 = 0;
/// Embree.
pub const BACKEND_EMBREE: u32 = 1;
/// obvhs.
pub const BACKEND_OBVHS: u32 = 2;

/// More threads than any machine has; a greater number is garbage.
pub const MAX_THREADS: u32 = 4096;

/// Called with what the host may want to know.
pub type MessageCallback = unsafe extern "C" fn(user: *mut c_void, severity: u32, detail: *const Detail);

/// `caustica_device_options`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct DeviceOptions {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Version of the host's header.
    pub version: u32,
    /// Worker threads; 0 for as many as the process may use.
    pub num_threads: u32,
    /// The ray tracer.
    pub backend: u32,
    /// Null for none.
    pub message: Option<MessageCallback>,
    /// Passed to `message`.
    pub user: *mut c_void,
}

// SAFETY: `repr(C)`, `u32` first; the callback is C's nullable pointer, the rest are integers.
unsafe impl Sized32 for DeviceOptions {
    const NAME: &'static str = "caustica_device_options";
    const FIRST_SIZE: usize = 32;
}

/// C's `caustica_device*`; see the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct DevicePointer(*mut c_void);

const _: () = assert!(usize::BITS == 64, "a device pointer holds 60 bits of number");

impl DevicePointer {
    /// Any number as a pointer.
    pub const fn new(number: usize) -> DevicePointer {
        DevicePointer(std::ptr::without_provenance_mut(number))
    }

    /// No device.
    pub const fn null() -> DevicePointer {
        DevicePointer::new(0)
    }

    pub(super) fn is_null(self) -> bool {
        self.0.is_null()
    }

    fn of(process: u32, count: u32) -> DevicePointer {
        // Four zero bits at the end, as in the address of any allocation.
        DevicePointer::new((process as usize) << 32 | (count as usize) << 4)
    }

    fn process(self) -> u32 {
        (self.0.addr() >> 32) as u32
    }
}

/// The host's opaque `void* user`: carried around, never looked at.
#[derive(Clone, Copy)]
pub(super) struct User(pub(super) *mut c_void);

// SAFETY: never dereferenced here. The header tells the host on which threads its callbacks run.
unsafe impl Send for User {}
// SAFETY: as above.
unsafe impl Sync for User {}

thread_local! {
    /// Whether the host's message callback runs on this thread.
    static IN_MESSAGE: Cell<bool> = const { Cell::new(false) };
}

/// Where messages go.
pub(super) struct Messages {
    callback: Option<MessageCallback>,
    user: User,
}

impl Messages {
    /// Passes a failure on. A call that fails inside a message callback does not call it again.
    pub(super) fn error(&self, failure: &Failure) {
        if !IN_MESSAGE.try_with(Cell::get).unwrap_or(true) {
            self.send(SEVERITY_ERROR, failure);
        }
    }

    /// Passes any message on. No lock may be held here.
    pub(super) fn send(&self, severity: u32, failure: &Failure) {
        if let Some(callback) = self.callback {
            let detail = failure.detail();
            let outer = IN_MESSAGE.try_with(|flag| flag.replace(true)).unwrap_or(true);
            // SAFETY: the host promised a function of this type when it made the device, and that it
            // neither throws nor jumps out.
            guard::call_host(|| unsafe { callback(self.user.0, severity, &detail) });
            let _ = IN_MESSAGE.try_with(|flag| flag.set(outer));
        }
    }
}

/// A device: tables of objects and what they share.
pub struct Device {
    pub(super) backend: Backend,
    pub(super) threads: usize,
    pub(super) messages: Arc<Messages>,
    pub(super) textures: Table<Texture>,
    pub(super) meshes: Table<Mesh>,
    pub(super) materials: Table<Material>,
    pub(super) scenes: Table<Scene>,
    pub(super) instances: Table<Instance>,
    pub(super) lights: Table<Light>,
    pub(super) cameras: Table<Camera>,
    pub(super) renders: Table<Render>,
}

static COUNT: AtomicU32 = AtomicU32::new(0);
static LIVING: Mutex<BTreeMap<usize, Arc<Device>>> = Mutex::new(BTreeMap::new());

/// Each use is one operation on the map, which a panic cannot leave half done.
fn living() -> MutexGuard<'static, BTreeMap<usize, Arc<Device>>> {
    LIVING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The device behind a pointer.
pub(super) fn find(pointer: DevicePointer) -> Result<Arc<Device>, Failure> {
    check_process(pointer)?;
    living().get(&pointer.0.addr()).cloned().ok_or_else(unknown)
}

fn unknown() -> Failure {
    let text = "the device is not one that caustica_device_create made, or it was released";
    Failure::new(ERROR_INVALID_HANDLE, text).object(OBJECT_DEVICE, 0, "")
}

fn check_process(pointer: DevicePointer) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(ERROR_INVALID_HANDLE, "the device is null").object(OBJECT_DEVICE, 0, ""));
    }
    if pointer.process() != std::process::id() {
        let text = "the device was not made by this process; after a fork, the child cannot use it";
        return Err(Failure::new(ERROR_INVALID_HANDLE, text).object(OBJECT_DEVICE, 0, ""));
    }
    Ok(())
}

guard::export! {
    /// Makes a device.
    free fn caustica_device_create(options: In<DeviceOptions>, device: Out<DevicePointer>) = create;
}

guard::symbol! {
    /// Ends a device and all that belongs to it.
    fn caustica_device_release(device: DevicePointer) -> i32 {
        guard::about_device(device, || release(device))
    }
}

fn create(options: In<DeviceOptions>, device: Out<DevicePointer>) -> Result<i32, Failure> {
    let out = device.required("device")?;
    let options = options.read("options")?;
    check_version(options.version)?;
    if options.num_threads > MAX_THREADS {
        return Err(Failure::limit("num_threads", format!("is {}; at most {MAX_THREADS}", options.num_threads)));
    }
    let backend = match options.backend {
        BACKEND_DEFAULT => Backend::default(),
        BACKEND_EMBREE => Backend::Embree,
        BACKEND_OBVHS => Backend::Obvhs,
        other => return Err(Failure::argument("backend", format!("is {other}; a CAUSTICA_BACKEND_ was expected"))),
    };
    try_backend(backend)?;

    let count = COUNT.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
    if count == 0 || count >> DEVICE_BITS != 0 {
        return Err(Failure::limit("device", "numbers have run out in this process"));
    }
    let pointer = DevicePointer::of(std::process::id(), count);
    let made = Device {
        backend,
        threads: options.num_threads as usize,
        messages: Arc::new(Messages { callback: options.message, user: User(options.user) }),
        textures: Table::new(count),
        meshes: Table::new(count),
        materials: Table::new(count),
        scenes: Table::new(count),
        instances: Table::new(count),
        lights: Table::new(count),
        cameras: Table::new(count),
        renders: Table::new(count),
    };
    living().insert(pointer.0.addr(), Arc::new(made));
    out.write(pointer);
    Ok(OK)
}

fn check_version(header: u32) -> Result<(), Failure> {
    let library = super::info::VERSION;
    let (major, minor) = (header >> 22, header >> 12 & 0x3ff);
    let (library_major, library_minor) = (library >> 22, library >> 12 & 0x3ff);
    // Before 1.0, each minor version is an interface of its own.
    let compatible = if library_major == 0 { minor == library_minor } else { minor <= library_minor };
    if major == library_major && compatible {
        return Ok(());
    }
    let text = format!(
        "of the header is {major}.{minor}.{}, of the library {}; CAUSTICA_VERSION was expected",
        header & 0xfff,
        env!("CARGO_PKG_VERSION")
    );
    Err(Failure::incompatible("version", text))
}

/// Builds over one sphere, so that a ray tracer that is missing or not the one compiled against is
/// reported now and not at the first commit.
fn try_backend(backend: Backend) -> Result<(), Failure> {
    let shape = Shape::Sphere(Sphere { center: glam::Vec3::ZERO, radius: 1.0 });
    intersect::build(backend, &[shape], Build::Static, 1).map(drop).map_err(|error| {
        let code = match error {
            intersect::BackendError::Missing(_) => ERROR_UNSUPPORTED,
            intersect::BackendError::Incompatible(_) => ERROR_INCOMPATIBLE_VERSION,
            intersect::BackendError::OutOfMemory { .. } => ERROR_OUT_OF_MEMORY,
            intersect::BackendError::Failed { .. } => ERROR_BACKEND,
        };
        Failure { parameter: "backend".to_owned(), ..Failure::new(code, error.to_string()) }
    })
}

fn release(pointer: DevicePointer) -> Result<i32, Failure> {
    check_process(pointer)?;
    let device = living().remove(&pointer.0.addr()).ok_or_else(unknown)?;

    let renders = device.renders.close();
    renders.iter().for_each(|render| render.cancel());
    renders.iter().for_each(|render| render.finish());

    let mut left = Vec::new();
    count::<Render>(&mut left, renders.len());
    count::<Instance>(&mut left, device.instances.close().len());
    count::<Light>(&mut left, device.lights.close().len());
    count::<Camera>(&mut left, device.cameras.close().len());
    count::<Scene>(&mut left, device.scenes.close().len());
    count::<Material>(&mut left, device.materials.close().len());
    count::<Mesh>(&mut left, device.meshes.close().len());
    count::<Texture>(&mut left, device.textures.close().len());
    if !left.is_empty() {
        let text = format!("the device was released with objects alive: {}", left.join(", "));
        device.messages.send(SEVERITY_INFO, &Failure::new(error::OK, text).object(OBJECT_DEVICE, 0, ""));
    }
    Ok(OK)
}

fn count<T: Kind>(left: &mut Vec<String>, n: usize) {
    if n > 0 {
        left.push(if n == 1 { format!("1 {}", T::NAME) } else { format!("{n} {}", T::PLURAL) });
    }
}
