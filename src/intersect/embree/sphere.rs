//! Spheres as Embree user geometry with the sphere test of all backends, in f64. Embree's own sphere
//! points were tried: no faster, and `t` off by up to 1.6e-5 of its value where this is off by 2e-7.

use super::device::{Device, Scene};
use super::ffi;
use crate::geometry::{Ray, Sphere};
use crate::intersect::BackendError;
use crate::intersect::bounds::Bounds;
use glam::Vec3;
use std::ffi::c_void;

/// Adds a sphere under the number `id`.
///
/// # Safety
/// `sphere` outlives `scene`.
pub(super) unsafe fn attach(
    device: &Device,
    scene: &mut Scene,
    id: u32,
    sphere: *const Sphere,
) -> Result<(), BackendError> {
    device.attach(scene, ffi::RTC_GEOMETRY_TYPE_USER, id, |geometry| {
        // SAFETY: a live geometry of the user type; the callbacks read the sphere, which by contract
        // lives as long as the scene that calls them.
        unsafe {
            ffi::rtcSetGeometryUserPrimitiveCount(geometry, 1);
            ffi::rtcSetGeometryUserData(geometry, sphere.cast_mut().cast());
            ffi::rtcSetGeometryBoundsFunction(geometry, Some(bounds), std::ptr::null_mut());
            ffi::rtcSetGeometryIntersectFunction(geometry, Some(intersect));
            ffi::rtcSetGeometryOccludedFunction(geometry, Some(occluded));
        }
        Ok(())
    })
}

// None of the callbacks can panic: they do arithmetic only.

unsafe extern "C" fn bounds(args: *const ffi::RTCBoundsFunctionArguments) {
    // SAFETY: Embree passes live arguments with the pointer set in `attach`, and a box to write.
    let (sphere, out) = unsafe { (&*(*args).geometryUserPtr.cast::<Sphere>(), &mut *(*args).bounds_o) };
    let b = Bounds::of_sphere(sphere);
    (out.lower_x, out.lower_y, out.lower_z) = b.lo.into();
    (out.upper_x, out.upper_y, out.upper_z) = b.hi.into();
}

/// The sphere's hit within the ray's present segment.
#[inline]
fn test(user: *const c_void, ray: &ffi::RTCRay) -> Option<f32> {
    // SAFETY: the pointer set in `attach`.
    let sphere = unsafe { &*user.cast::<Sphere>() };
    sphere.intersect(&Ray {
        origin: Vec3::new(ray.org_x, ray.org_y, ray.org_z),
        direction: Vec3::new(ray.dir_x, ray.dir_y, ray.dir_z),
        t_max: ray.tfar,
    })
}

unsafe extern "C" fn intersect(args: *const ffi::RTCIntersectFunctionNArguments) {
    // SAFETY: live arguments; only single-ray queries are made (see query.rs), so N is 1 and the packet
    // is an RTCRayHit.
    let (args, query) = unsafe { (&*args, &mut *(*args).rayhit.cast::<ffi::RTCRayHit>()) };
    if let Some(t) = test(args.geometryUserPtr, &query.ray) {
        query.ray.tfar = t;
        query.hit.u = 0.0;
        query.hit.v = 0.0;
        query.hit.geomID = args.geomID;
        query.hit.primID = args.primID;
        // Asked of each callback; now Embree comes to the meshes with scenes of their own after all spheres.
        // SAFETY: the context of this query.
        query.hit.instID = unsafe { (*args.context).instID };
    }
}

unsafe extern "C" fn occluded(args: *const ffi::RTCOccludedFunctionNArguments) {
    // SAFETY: as in `intersect`; the packet is an RTCRay.
    let (args, ray) = unsafe { (&*args, &mut *(*args).ray.cast::<ffi::RTCRay>()) };
    if test(args.geometryUserPtr, ray).is_some() {
        ray.tfar = f32::NEG_INFINITY;
    }
}
