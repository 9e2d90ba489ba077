//! An Embree device with its error and memory records, and the owners of its handles.

use super::ffi;
use crate::intersect::{BackendError, failed};
use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, Ordering};

unsafe extern "C" {
    /// shim.cpp: commits within a task arena of `threads`; 0 for success, else a message.
    fn caustica_embree_commit(scene: ffi::RTCScene, threads: c_int, message: *mut c_char, size: usize) -> c_int;
}

/// What Embree tells through its callbacks, from any thread.
#[derive(Default)]
pub(super) struct Record {
    /// The first error not yet taken.
    error: Mutex<Option<BackendError>>,
    /// Bytes it holds.
    bytes: AtomicI64,
}

/// A device of one structure and of those rebuilt from it. Errors and memory are told of the device: who builds holds `building`.
pub(super) struct Device {
    raw: ffi::RTCDevice,
    pub(super) building: Mutex<()>,
    /// On the heap: the callbacks hold its address.
    record: Box<Record>,
}

/// A scene of a device that outlives it.
pub(super) struct Scene {
    raw: ffi::RTCScene,
}

// SAFETY: an RTCDevice is reference-counted and synchronised by Embree; Record is Sync.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}
// SAFETY: queries on a committed RTCScene are thread-safe; only commit changes it, through `&mut`.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

unsafe extern "C" fn on_error(user: *mut c_void, code: ffi::RTCError, text: *const c_char) {
    // SAFETY: `user` is the Record given in `Device::new`, which outlives the device.
    let record = unsafe { &*user.cast::<Record>() };
    let words = if text.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a terminated string that lives during the call.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    };
    if let Ok(mut error) = record.error.lock() {
        error.get_or_insert(of_code(code, format!("error {code}: {words}")));
    }
}

fn of_code(code: ffi::RTCError, message: String) -> BackendError {
    match code {
        ffi::RTC_ERROR_OUT_OF_MEMORY => BackendError::OutOfMemory { backend: "embree", message },
        _ => failed("embree", message),
    }
}

unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: as in `on_error`.
    unsafe { &*user.cast::<Record>() }.bytes.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

impl Device {
    /// A device of the library's defaults, but without the 128 MiB cache for subdivision surfaces, which
    /// do not occur. Its threads are not set here: that option limits the whole process.
    pub(super) fn new() -> Result<Device, BackendError> {
        let record = Box::<Record>::default();
        // SAFETY: a terminated string of our own.
        let raw = unsafe { ffi::rtcNewDevice(c"tessellation_cache_size=1".as_ptr()) };
        if raw.is_null() {
            // SAFETY: a null device asks for the calling thread's own error.
            let code = unsafe { ffi::rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(of_code(code, format!("no device (error {code})")));
        }
        let user = (&raw const *record).cast_mut().cast::<c_void>();
        // SAFETY: the record is on the heap and dropped after the device (see Drop), and is only shared.
        unsafe {
            ffi::rtcSetDeviceErrorFunction(raw, Some(on_error), user);
            ffi::rtcSetDeviceMemoryMonitorFunction(raw, Some(on_memory), user);
        }
        Ok(Device { raw, building: Mutex::new(()), record })
    }

    /// The library's version, as `RTC_VERSION` counts.
    pub(super) fn version(&self) -> u32 {
        // SAFETY: a live device.
        unsafe { ffi::rtcGetDeviceProperty(self.raw, ffi::RTC_DEVICE_PROPERTY_VERSION) as u32 }
    }

    /// Bytes Embree holds for this device.
    pub(super) fn memory(&self) -> u64 {
        self.record.bytes.load(Ordering::Relaxed).max(0) as u64
    }

    /// The first error since the last call, as an `Err`.
    pub(super) fn check(&self) -> Result<(), BackendError> {
        let error = self.record.error.lock().map_or(None, |mut e| e.take());
        error.map_or(Ok(()), Err)
    }

    /// A new scene: robust, and of high build quality, which traced soups of small triangles 8 % faster
    /// than medium and other scenes as fast.
    pub(super) fn scene(&self) -> Result<Scene, BackendError> {
        // SAFETY: a live device.
        let raw = unsafe { ffi::rtcNewScene(self.raw) };
        self.check()?;
        if raw.is_null() {
            return Err(failed("embree", "no scene".into()));
        }
        // SAFETY: a live scene, not yet committed.
        unsafe {
            ffi::rtcSetSceneFlags(raw, ffi::RTC_SCENE_FLAG_ROBUST);
            ffi::rtcSetSceneBuildQuality(raw, ffi::RTC_BUILD_QUALITY_HIGH);
        }
        Ok(Scene { raw })
    }

    /// Adds to `scene` a geometry of `kind` under the number `id`; `fill` gives it its data.
    pub(super) fn attach(
        &self,
        scene: &mut Scene,
        kind: ffi::RTCGeometryType,
        id: u32,
        fill: impl FnOnce(ffi::RTCGeometry) -> Result<(), BackendError>,
    ) -> Result<(), BackendError> {
        // SAFETY: a live device.
        let geometry = unsafe { ffi::rtcNewGeometry(self.raw, kind) };
        self.check()?;
        if geometry.is_null() {
            return Err(failed("embree", "no geometry".into()));
        }
        let filled = fill(geometry);
        if filled.is_ok() {
            // SAFETY: geometry and scene are live and of this device; the scene keeps its own reference.
            unsafe {
                ffi::rtcCommitGeometry(geometry);
                ffi::rtcAttachGeometryByID(scene.raw, geometry, id);
            }
        }
        // SAFETY: gives up the reference of rtcNewGeometry.
        unsafe { ffi::rtcReleaseGeometry(geometry) };
        filled.and_then(|()| self.check())
    }

    /// Builds the scene's hierarchy with at most `threads` threads.
    pub(super) fn commit(&self, scene: &mut Scene, threads: usize) -> Result<(), BackendError> {
        let mut message = [0u8; 256];
        let threads = threads.clamp(1, 1024) as c_int;
        // SAFETY: a live scene, and a buffer of the length told; no exception leaves the shim.
        let code = unsafe { caustica_embree_commit(scene.raw, threads, message.as_mut_ptr().cast(), message.len()) };
        self.check()?;
        if code != 0 {
            let text = CStr::from_bytes_until_nul(&message).map_or("".into(), |m| m.to_string_lossy());
            return Err(failed("embree", format!("building failed: {text}")));
        }
        Ok(())
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: our reference. The callbacks are taken out first, since other holders of the device
        // (its scenes) may outlive the record.
        unsafe {
            ffi::rtcSetDeviceErrorFunction(self.raw, None, std::ptr::null_mut());
            ffi::rtcSetDeviceMemoryMonitorFunction(self.raw, None, std::ptr::null_mut());
            ffi::rtcReleaseDevice(self.raw);
        }
    }
}

impl Scene {
    #[inline]
    pub(super) fn raw(&self) -> ffi::RTCScene {
        self.raw
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: our reference.
        unsafe { ffi::rtcReleaseScene(self.raw) };
    }
}
