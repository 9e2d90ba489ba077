//! Whether the library loaded agrees with the headers compiled against. Embree's ray structure depends
//! on build options that its library name does not tell, and a host may have loaded a copy of its own;
//! a longer structure would be written past the end of ours. So one ray is traced through one instance,
//! between guard bytes, before any other.

use super::device::Device;
use super::{ffi, query};
use crate::geometry::Ray;
use crate::intersect::BackendError;
use glam::Vec3;

const GUARD: u8 = 0xa5;
const MARGIN: usize = 256;

/// Embree divides by estimated reciprocals, which differ between makes of processor in the last place of a hit, here
/// at most 6e-8. Sixteen times that is still far below what any other layout would leave there.
const ROUNDED: f32 = 1e-6;

#[repr(C, align(64))]
struct Guarded<T> {
    before: [u8; MARGIN],
    inside: T,
    after: [u8; MARGIN],
}

impl<T> Guarded<T> {
    fn new(inside: T) -> Guarded<T> {
        Guarded { before: [GUARD; MARGIN], inside, after: [GUARD; MARGIN] }
    }

    fn intact(&self) -> bool {
        self.before.iter().chain(&self.after).all(|&b| b == GUARD)
    }
}

/// Traces one ray whose hit is known.
pub(super) fn run(device: &Device) -> Result<(), BackendError> {
    let mut leaf = device.scene()?;
    let triangle = crate::geometry::Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![],
        triangles: vec![[0, 1, 2]],
    };
    super::attach_mesh(device, &mut leaf, 5, &triangle)?;
    device.commit(&mut leaf, 1)?;
    let mut top = device.scene()?;
    device.attach(&mut top, ffi::RTC_GEOMETRY_TYPE_INSTANCE, 3, |geometry| {
        // Column-major: the identity, moved two units along z.
        let transform = [1.0f32, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0];
        // SAFETY: a live instance geometry, a committed scene of the same device, twelve floats.
        unsafe {
            ffi::rtcSetGeometryInstancedScene(geometry, leaf.raw());
            ffi::rtcSetGeometryTransform(geometry, 0, ffi::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.as_ptr().cast());
        }
        Ok(())
    })?;
    device.commit(&mut top, 1)?;

    let ray = Ray { origin: Vec3::new(0.25, 0.5, 0.0), direction: Vec3::new(0.0, 0.0, 4.0), t_max: 1.0 };
    // Read back through a pointer the compiler cannot see through: the library may write anywhere.
    let mut closest = Guarded::new(query::ray_hit(&ray));
    let mut shadow = Guarded::new(query::ray(&ray));
    // SAFETY: a committed scene; the guards take what a larger structure would write.
    unsafe {
        let whole = (&raw mut closest).cast::<u8>();
        ffi::rtcIntersect1(top.raw(), whole.add(MARGIN).cast(), std::ptr::null_mut());
        let whole = (&raw mut shadow).cast::<u8>();
        ffi::rtcOccluded1(top.raw(), whole.add(MARGIN).cast(), std::ptr::null_mut());
    }
    device.check()?;
    verdict(&closest, &shadow)
}

fn verdict(closest: &Guarded<ffi::RTCRayHit>, shadow: &Guarded<ffi::RTCRay>) -> Result<(), BackendError> {
    let refuse = |what: &str| {
        Err(BackendError::Incompatible(format!(
            "the Embree library in this process is not the one compiled against ({what}): was another copy loaded first?"
        )))
    };
    if !closest.intact() || !shadow.intact() {
        return refuse("it writes past the ray structure");
    }
    let (ray, hit) = (&closest.inside.ray, &closest.inside.hit);
    let near = |x: f32, truth: f32| (x - truth).abs() < ROUNDED;
    let right = near(ray.tfar, 0.5)
        && near(hit.u, 0.25)
        && near(hit.v, 0.5)
        && (hit.primID, hit.geomID, hit.instID[0]) == (0, 5, 3)
        && (hit.Ng_x, hit.Ng_y) == (0.0, 0.0)
        && hit.Ng_z != 0.0
        && (ray.mask, ray.id, ray.flags, ray.dir_z) == (u32::MAX, 0, 0, 4.0)
        && shadow.inside.tfar == f32::NEG_INFINITY;
    if right { Ok(()) } else { refuse("a known ray gave a wrong hit") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers() -> (Guarded<ffi::RTCRayHit>, Guarded<ffi::RTCRay>) {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::new(0.0, 0.0, 4.0), t_max: 1.0 };
        let mut closest = Guarded::new(query::ray_hit(&ray));
        closest.inside.ray.tfar = 0.5;
        let hit = &mut closest.inside.hit;
        (hit.u, hit.v, hit.Ng_z, hit.primID, hit.geomID, hit.instID[0]) = (0.25, 0.5, 1.0, 0, 5, 3);
        let mut shadow = Guarded::new(query::ray(&ray));
        shadow.inside.tfar = f32::NEG_INFINITY;
        (closest, shadow)
    }

    #[test]
    fn the_installed_library_passes_and_a_different_layout_is_refused() {
        run(&Device::new().unwrap()).unwrap();
        let (closest, shadow) = answers();
        verdict(&closest, &shadow).unwrap();

        // Another make of processor.
        let (mut closest, shadow) = answers();
        closest.inside.ray.tfar = 0.5f32.next_down();
        verdict(&closest, &shadow).unwrap();

        let (mut closest, shadow) = answers();
        closest.after[0] = 0;
        let error = verdict(&closest, &shadow).unwrap_err().to_string();
        assert!(error.contains("past the ray structure"), "{error}");

        // One word less before the ids, as in Embree 4.2's structure.
        let (mut closest, shadow) = answers();
        closest.inside.hit.geomID = 3;
        let error = verdict(&closest, &shadow).unwrap_err().to_string();
        assert!(error.contains("wrong hit"), "{error}");
    }
}
