//! The Embree backend (Wald et al. 2014): triangles by its robust test, spheres by ours.
#![allow(unsafe_code)]

mod device;
mod ffi;
mod query;
mod self_test;
mod sphere;

use super::{BackendError, Build, Hit, Intersector, failed};
use crate::geometry::{Mesh, Ray, Shape, Sphere};
use device::{Device, Scene};
use std::collections::HashMap;
use std::sync::{Arc, PoisonError};

/// Oldest usable library: 4.3.0, the first with today's ray layout. The build script asks the same of
/// the headers.
const OLDEST: u32 = 40300;

/// Triangles from which on a mesh of an editable build has a scene of its own. Not tuned: so many are built in about half a
/// millisecond, at the rate of a mesh of two million.
const PART: usize = 1 << 11;

/// A mesh that is built for itself.
struct Part {
    mesh: Arc<Mesh>,
    scene: Scene,
    /// Bytes of the scene.
    bytes: u64,
}

/// Ray queries by Embree. Its device is its own and that of those who were [rebuilt](Intersector::rebuilt) from it, and so are
/// errors and memory.
pub struct Embree {
    scene: Scene,
    /// In the order of the shapes.
    parts: Vec<Arc<Part>>,
    device: Arc<Device>,
    /// Bytes of scene and parts.
    bytes: u64,
    /// Read by the callbacks of `scene`, hence dropped after it.
    _spheres: Box<[Sphere]>,
}

impl Embree {
    /// Builds with at most `threads` threads. Refuses a library that is older than 4.3 or whose ray
    /// structure differs from the one compiled against: another copy may have been loaded by the host
    /// under the same name.
    pub fn build(shapes: &[Shape], build: Build, threads: usize) -> Result<Embree, BackendError> {
        let device = Device::new()?;
        let version = device.version();
        if version < OLDEST {
            return Err(BackendError::Incompatible(format!(
                "Embree {} is loaded, 4.3 or newer is needed",
                version_text(version)
            )));
        }
        self_test::run(&device)?;
        Embree::on(device.into(), shapes, (build == Build::Editable).then_some(&[]), threads)
    }

    /// On a device that was tested: all in one, or in parts, those that are kept among them.
    fn on(
        device: Arc<Device>,
        shapes: &[Shape],
        kept: Option<&[Arc<Part>]>,
        threads: usize,
    ) -> Result<Embree, BackendError> {
        super::check(shapes)?;
        let building = device.building.lock().unwrap_or_else(PoisonError::into_inner);
        let known: HashMap<*const Mesh, &Arc<Part>> =
            kept.into_iter().flatten().map(|part| (Arc::as_ptr(&part.mesh), part)).collect();
        let is_sphere = |s: &Shape| if let Shape::Sphere(s) = s { Some(*s) } else { None };
        let spheres: Box<[Sphere]> = shapes.iter().filter_map(is_sphere).collect();
        let mut next_sphere = spheres.iter();
        let (mut parts, mut kept_bytes) = (Vec::new(), 0);
        let before = device.memory();
        let mut scene = device.scene()?;
        for (id, shape) in shapes.iter().enumerate() {
            let id = id as u32;
            match shape {
                // Embree takes no empty buffer.
                Shape::Mesh(mesh) if mesh.triangles.is_empty() => {}
                Shape::Mesh(mesh) if kept.is_none() || mesh.triangles.len() < PART => {
                    attach_mesh(&device, &mut scene, id, mesh)?
                }
                Shape::Mesh(mesh) => {
                    let part = match known.get(&Arc::as_ptr(mesh)) {
                        Some(&part) => {
                            kept_bytes += part.bytes;
                            part.clone()
                        }
                        None => Arc::new(Part::build(&device, mesh.clone(), threads)?),
                    };
                    attach_scene(&device, &mut scene, id, &part.scene)?;
                    parts.push(part);
                }
                Shape::Sphere(_) => {
                    if let Some(sphere) = next_sphere.next() {
                        // SAFETY: `spheres` is on the heap and kept until the scene is gone.
                        unsafe { sphere::attach(&device, &mut scene, id, sphere)? }
                    }
                }
            }
        }
        device.commit(&mut scene, threads)?;
        // Less what a structure held that ended meanwhile.
        let bytes = device.memory().saturating_sub(before) + kept_bytes;
        drop(building);
        Ok(Embree { scene, parts, device, bytes, _spheres: spheres })
    }

    /// Bare `rtcIntersect1` calls on the rays, for measuring what the trait costs: how many hit.
    #[doc(hidden)]
    pub fn bench_raw_closest(&self, rays: &[Ray]) -> usize {
        let hits = rays.iter().filter(|&ray| {
            let mut q = query::ray_hit(ray);
            // SAFETY: a committed scene, a structure of the layout the self-test confirmed.
            unsafe { ffi::rtcIntersect1(self.scene.raw(), &mut q, std::ptr::null_mut()) };
            q.hit.geomID != ffi::INVALID_GEOMETRY
        });
        hits.count()
    }

    /// Bare `rtcOccluded1` calls, likewise.
    #[doc(hidden)]
    pub fn bench_raw_occluded(&self, rays: &[Ray]) -> usize {
        let hits = rays.iter().filter(|&ray| {
            let mut q = query::ray(ray);
            // SAFETY: as above.
            unsafe { ffi::rtcOccluded1(self.scene.raw(), &mut q, std::ptr::null_mut()) };
            q.tfar < 0.0
        });
        hits.count()
    }
}

impl Intersector for Embree {
    #[inline]
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        // SAFETY: the scene was committed in `on` and lives as long as `self`.
        unsafe { query::closest(self.scene.raw(), ray) }
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        // SAFETY: as above.
        unsafe { query::occluded(self.scene.raw(), ray) }
    }

    fn describe(&self) -> String {
        format!("Embree {} (built against {})", version_text(self.device.version()), version_text(ffi::RTC_VERSION))
    }

    fn memory(&self) -> u64 {
        self.bytes
    }

    fn rebuilt(&self, shapes: &[Shape], threads: usize) -> Option<Result<Box<dyn Intersector>, BackendError>> {
        let built = Embree::on(self.device.clone(), shapes, Some(&self.parts), threads);
        Some(built.map(|embree| Box::new(embree) as Box<dyn Intersector>))
    }
}

impl Part {
    fn build(device: &Device, mesh: Arc<Mesh>, threads: usize) -> Result<Part, BackendError> {
        let before = device.memory();
        let mut scene = device.scene()?;
        attach_mesh(device, &mut scene, 0, &mesh)?;
        device.commit(&mut scene, threads)?;
        Ok(Part { mesh, scene, bytes: device.memory().saturating_sub(before) })
    }
}

fn version_text(v: u32) -> String {
    format!("{}.{}.{}", v / 10000, v / 100 % 100, v % 100)
}

/// Copies a mesh into buffers of Embree's own: they carry the padding that its 16-byte reads of the last
/// vertex need.
fn attach_mesh(device: &Device, scene: &mut Scene, id: u32, mesh: &Mesh) -> Result<(), BackendError> {
    device.attach(scene, ffi::RTC_GEOMETRY_TYPE_TRIANGLE, id, |geometry| {
        let vertices = mesh.positions.iter().map(|p| p.to_array());
        // SAFETY: a live triangle geometry; formats and strides are those of three floats or indices.
        unsafe {
            fill(device, geometry, ffi::RTC_BUFFER_TYPE_VERTEX, ffi::RTC_FORMAT_FLOAT3, vertices)?;
            fill(device, geometry, ffi::RTC_BUFFER_TYPE_INDEX, ffi::RTC_FORMAT_UINT3, mesh.triangles.iter().copied())
        }
    })
}

/// Puts a committed scene into another, where it is: the identity leaves rays and hits as they are, bit for bit.
fn attach_scene(device: &Device, scene: &mut Scene, id: u32, part: &Scene) -> Result<(), BackendError> {
    device.attach(scene, ffi::RTC_GEOMETRY_TYPE_INSTANCE, id, |geometry| {
        // SAFETY: a live instance geometry and a committed scene of the same device, to which it keeps its own reference.
        unsafe { ffi::rtcSetGeometryInstancedScene(geometry, part.raw()) };
        Ok(())
    })
}

/// Allocates slot 0 of a buffer and fills it.
///
/// # Safety
/// `geometry` is live, takes a buffer of this type, and `format` is that of `T`, without padding.
unsafe fn fill<T: Copy>(
    device: &Device,
    geometry: ffi::RTCGeometry,
    buffer: ffi::RTCBufferType,
    format: ffi::RTCFormat,
    items: impl ExactSizeIterator<Item = T>,
) -> Result<(), BackendError> {
    let count = items.len();
    // SAFETY: by contract.
    let to = unsafe { ffi::rtcSetNewGeometryBuffer(geometry, buffer, 0, format, size_of::<T>(), count) };
    device.check()?;
    if to.is_null() {
        return Err(failed("embree", format!("no buffer for {count} items")));
    }
    for (i, item) in items.enumerate() {
        // SAFETY: the buffer holds `count` items of this size, and `i < count`.
        unsafe { to.cast::<T>().add(i).write(item) };
    }
    Ok(())
}
