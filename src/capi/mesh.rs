//! Triangle meshes: copied when made or set; what a commit has seen stays as it was.

use super::device::Device;
use super::error::{Failure, OBJECT_MESH, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::pointer::{In, MAX_NAME, Out, Sized32, Text, copy_elements};
use crate::scene::description::MeshDescription;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// `caustica_mesh_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct MeshDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// For messages.
    pub name: Text,
    /// Three floats per vertex.
    pub positions: *const f32,
    /// Bytes from one position to the next; 0 for 12.
    pub position_stride: u64,
    /// Three floats per vertex, or null for flat shading.
    pub normals: *const f32,
    /// Bytes from one normal to the next; 0 for 12.
    pub normal_stride: u64,
    /// Number of positions, and of normals if there are any.
    pub vertex_count: u64,
    /// Three per triangle, without gaps.
    pub indices: *const u32,
    /// A multiple of three.
    pub index_count: u64,
    /// Two floats per vertex, or null.
    pub texture_coordinates: *const f32,
    /// Bytes from one pair to the next; 0 for 8.
    pub texture_coordinate_stride: u64,
}

// SAFETY: `repr(C)`, `u32` first, integers and pointers only.
unsafe impl Sized32 for MeshDesc {
    const NAME: &'static str = "caustica_mesh_desc";
    const FIRST_SIZE: usize = 88;
}

/// A mesh; lives as long as the host or an instance refers to it.
pub struct Mesh {
    pub(super) id: u64,
    data: Mutex<Arc<MeshDescription>>,
}

impl Kind for Mesh {
    const KIND: u32 = OBJECT_MESH;
    const NAME: &'static str = "mesh";
    const PLURAL: &'static str = "meshes";
}

guard::export! {
    /// Makes a mesh from copies of the host's arrays.
    fn caustica_mesh_create(device, desc: In<MeshDesc>, mesh: Out<Handle<Mesh>>) = create;

    /// Replaces all values.
    fn caustica_mesh_set(device, mesh: Handle<Mesh>, desc: In<MeshDesc>) = set;

    /// Gives up the host's claim.
    fn caustica_mesh_release(device, mesh: Handle<Mesh>) = release;
}

fn create(device: &Arc<Device>, desc: In<MeshDesc>, mesh: Out<Handle<Mesh>>) -> Result<i32, Failure> {
    let out = mesh.required("mesh")?;
    let data = read(desc, 0)?;
    let (handle, _) = device.meshes.insert(|id| Mesh::new(id, data))?;
    out.write(handle);
    Ok(OK)
}

fn set(device: &Arc<Device>, mesh: Handle<Mesh>, desc: In<MeshDesc>) -> Result<i32, Failure> {
    let object = device.meshes.get(mesh)?;
    let data = read(desc, object.id)?;
    *object.lock() = data;
    Ok(OK)
}

fn read(desc: In<MeshDesc>, id: u64) -> Result<Arc<MeshDescription>, Failure> {
    let desc = desc.read("desc")?;
    let name = desc.name.read("name", MAX_NAME)?;
    copy(&desc, &name).map(Arc::new).map_err(|failure| failure.object_if_none(OBJECT_MESH, id, &name))
}

fn copy(desc: &MeshDesc, name: &str) -> Result<MeshDescription, Failure> {
    if desc.reserved != 0 {
        return Err(Failure::argument("reserved", format!("is {}; 0 was expected", desc.reserved)));
    }
    if desc.vertex_count > u32::MAX as u64 {
        let text = format!("is {}; 32-bit indices reach {}", desc.vertex_count, u32::MAX);
        return Err(Failure::limit("vertex_count", text));
    }
    if !desc.index_count.is_multiple_of(3) {
        return Err(Failure::argument("index_count", format!("is {}; a multiple of 3 was expected", desc.index_count)));
    }
    let count_of = |array: *const f32| if array.is_null() { 0 } else { desc.vertex_count };
    let (normal_count, coordinate_count) = (count_of(desc.normals), count_of(desc.texture_coordinates));
    // SAFETY: the header asks that the arrays be readable for the counts and strides given.
    let (positions, normals, texture_coordinates, triangles) = unsafe {
        (
            copy_elements("positions", desc.positions, desc.vertex_count, desc.position_stride)?,
            copy_elements("normals", desc.normals, normal_count, desc.normal_stride)?,
            copy_elements(
                "texture_coordinates",
                desc.texture_coordinates,
                coordinate_count,
                desc.texture_coordinate_stride,
            )?,
            copy_elements("indices", desc.indices, desc.index_count / 3, 0)?,
        )
    };
    Ok(MeshDescription { name: name.to_owned(), positions, normals, texture_coordinates, triangles })
}

fn release(device: &Arc<Device>, mesh: Handle<Mesh>) -> Result<i32, Failure> {
    device.meshes.remove(mesh)?;
    Ok(OK)
}

impl Mesh {
    /// `id` 0 for one without a handle.
    pub(super) fn new(id: u64, data: Arc<MeshDescription>) -> Mesh {
        Mesh { id, data: Mutex::new(data) }
    }

    /// The lock is held for an assignment or a copy of the pointer only, which cannot panic.
    fn lock(&self) -> MutexGuard<'_, Arc<MeshDescription>> {
        self.data.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Its values now.
    pub(super) fn describe(&self) -> Arc<MeshDescription> {
        self.lock().clone()
    }
}
