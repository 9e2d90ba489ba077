//! One ray through Embree: the only place that fills its ray structures.

use super::ffi;
use crate::geometry::Ray;
use crate::intersect::Hit;

#[inline(always)]
pub(super) fn ray(ray: &Ray) -> ffi::RTCRay {
    ffi::RTCRay {
        org_x: ray.origin.x,
        org_y: ray.origin.y,
        org_z: ray.origin.z,
        // Above 0: a surface in which the origin lies is not in the way, as obvhs has it.
        tnear: f32::MIN_POSITIVE,
        dir_x: ray.direction.x,
        dir_y: ray.direction.y,
        dir_z: ray.direction.z,
        time: 0.0,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// A ray with no hit yet.
#[inline(always)]
pub(super) fn ray_hit(r: &Ray) -> ffi::RTCRayHit {
    ffi::RTCRayHit {
        ray: ray(r),
        hit: ffi::RTCHit {
            primID: ffi::INVALID_GEOMETRY,
            geomID: ffi::INVALID_GEOMETRY,
            instID: [ffi::INVALID_GEOMETRY; ffi::RTC_MAX_INSTANCE_LEVEL_COUNT as usize],
            ..Default::default()
        },
    }
}

/// The nearest hit of the scene.
///
/// # Safety
/// `scene` is committed and lives during the call.
#[inline(always)]
pub(super) unsafe fn closest(scene: ffi::RTCScene, r: &Ray) -> Option<Hit> {
    let mut query = ray_hit(r);
    // SAFETY: the scene by contract; the structure is the one whose layout the self-test confirmed; null
    // arguments stand for the defaults.
    unsafe { ffi::rtcIntersect1(scene, &mut query, std::ptr::null_mut()) };
    let hit = &query.hit;
    (hit.geomID != ffi::INVALID_GEOMETRY).then_some(Hit {
        t: query.ray.tfar,
        u: hit.u,
        v: hit.v,
        // Of a mesh with a scene of its own, where it stands in the other.
        shape: if hit.instID[0] == ffi::INVALID_GEOMETRY { hit.geomID } else { hit.instID[0] },
        primitive: hit.primID,
    })
}

/// Whether the scene has any hit.
///
/// # Safety
/// As for [`closest`].
#[inline(always)]
pub(super) unsafe fn occluded(scene: ffi::RTCScene, r: &Ray) -> bool {
    let mut query = ray(r);
    // SAFETY: as in `closest`.
    unsafe { ffi::rtcOccluded1(scene, &mut query, std::ptr::null_mut()) };
    // Embree marks a hit by an end before every start.
    query.tfar == f32::NEG_INFINITY
}
