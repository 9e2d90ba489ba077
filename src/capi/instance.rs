//! Instances: shapes placed in a scene.

use super::device::Device;
use super::error::{Failure, OBJECT_INSTANCE, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::material::Material;
use super::mesh::Mesh;
use super::pointer::{MAX_NAME, Out, Text, Values};
use super::scene::Scene;
use crate::scene::is_invertible;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::{Arc, Mutex, MutexGuard, Weak};

/// What an instance shows.
#[derive(Clone)]
pub(super) enum Geometry {
    /// A mesh, alive as long as this.
    Mesh(Arc<Mesh>),
    /// A sphere about the instance's origin.
    Sphere {
        /// Metres.
        radius: f64,
    },
}

/// What may change.
#[derive(Clone)]
pub(super) struct Placement {
    pub(super) material: Arc<Material>,
    pub(super) transform: DAffine3,
    pub(super) visible: bool,
}

impl Placement {
    /// Seen, wherever it is put.
    pub(super) fn new(material: Arc<Material>, transform: DAffine3) -> Placement {
        Placement { material, transform, visible: true }
    }

    /// Whether it is scaled to nothing, as hosts do to hide things, or flattened.
    pub(super) fn collapsed(&self) -> bool {
        !is_invertible(&self.transform.matrix3)
    }
}

/// An instance of a scene.
pub struct Instance {
    pub(super) id: u64,
    pub(super) name: String,
    pub(super) geometry: Geometry,
    /// Its place in the scene's list.
    pub(super) order: u64,
    /// Where to take it out from.
    scene: Weak<Scene>,
    placement: Mutex<Placement>,
}

impl Kind for Instance {
    const KIND: u32 = OBJECT_INSTANCE;
    const NAME: &'static str = "instance";
    const PLURAL: &'static str = "instances";
}

impl Instance {
    /// An instance that stands at `order` in `scene`.
    pub(super) fn new(
        id: u64,
        (scene, order): (&Arc<Scene>, u64),
        name: String,
        geometry: Geometry,
        placement: Placement,
    ) -> Instance {
        Instance { id, name, geometry, order, scene: Arc::downgrade(scene), placement: Mutex::new(placement) }
    }

    /// Its material and transform, to read or to change.
    pub(super) fn placement(&self) -> Result<MutexGuard<'_, Placement>, Failure> {
        self.placement.lock().map_err(|_| {
            Failure::internal("an earlier call on this instance failed").object(OBJECT_INSTANCE, self.id, &self.name)
        })
    }
}

type Matrix = Values<f64, 12>;

guard::export! {
    /// Places a mesh.
    fn caustica_scene_add_mesh(
        device, scene: Handle<Scene>, mesh: Handle<Mesh>, material: Handle<Material>, transform: Matrix, name: Text,
        instance: Out<Handle<Instance>>
    ) = add_mesh;

    /// Places a sphere.
    fn caustica_scene_add_sphere(
        device, scene: Handle<Scene>, radius: f64, material: Handle<Material>, transform: Matrix, name: Text,
        instance: Out<Handle<Instance>>
    ) = add_sphere;

    /// Moves it.
    fn caustica_instance_set_transform(device, instance: Handle<Instance>, transform: Matrix) = set_transform;

    /// Gives it another material.
    fn caustica_instance_set_material(device, instance: Handle<Instance>, material: Handle<Material>) = set_material;

    /// Hides it, or shows it again.
    fn caustica_instance_set_visible(device, instance: Handle<Instance>, visible: u32) = set_visible;

    /// Takes it out of its scene.
    fn caustica_instance_remove(device, instance: Handle<Instance>) = remove;
}

fn add_mesh(
    device: &Arc<Device>,
    scene: Handle<Scene>,
    mesh: Handle<Mesh>,
    material: Handle<Material>,
    matrix: Matrix,
    name: Text,
    instance: Out<Handle<Instance>>,
) -> Result<i32, Failure> {
    let geometry = Geometry::Mesh(device.meshes.get(mesh)?);
    add(device, scene, geometry, material, matrix, name, instance)
}

fn add_sphere(
    device: &Arc<Device>,
    scene: Handle<Scene>,
    radius: f64,
    material: Handle<Material>,
    matrix: Matrix,
    name: Text,
    instance: Out<Handle<Instance>>,
) -> Result<i32, Failure> {
    add(device, scene, Geometry::Sphere { radius }, material, matrix, name, instance)
}

fn add(
    device: &Arc<Device>,
    scene: Handle<Scene>,
    geometry: Geometry,
    material: Handle<Material>,
    matrix: Matrix,
    name: Text,
    instance: Out<Handle<Instance>>,
) -> Result<i32, Failure> {
    let scene = device.scenes.get(scene)?;
    let material = device.materials.get(material)?;
    let name = name.read("name", MAX_NAME)?;
    let named = |failure: Failure| failure.object_if_none(OBJECT_INSTANCE, 0, &name);
    if let Geometry::Sphere { radius } = geometry
        && !(radius > 0.0 && radius.is_finite())
    {
        return Err(named(Failure::argument("radius", format!("is {radius}; a positive number was expected"))));
    }
    let transform = transform("transform", matrix.read()).map_err(named)?;
    let mut contents = scene.edit()?;
    let placement = Placement::new(material, transform);
    let place = (&scene, contents.next_order());
    let (handle, object) = device.instances.insert(|id| Instance::new(id, place, name, geometry, placement))?;
    contents.instances.insert(object.order, object);
    instance.write(handle);
    Ok(OK)
}

fn set_transform(device: &Arc<Device>, instance: Handle<Instance>, matrix: Matrix) -> Result<i32, Failure> {
    let object = device.instances.get(instance)?;
    let transform = transform("transform", matrix.read())
        .map_err(|failure| failure.object_if_none(OBJECT_INSTANCE, object.id, &object.name))?;
    object.placement()?.transform = transform;
    Ok(OK)
}

fn set_material(device: &Arc<Device>, instance: Handle<Instance>, material: Handle<Material>) -> Result<i32, Failure> {
    let object = device.instances.get(instance)?;
    let material = device.materials.get(material)?;
    object.placement()?.material = material;
    Ok(OK)
}

fn set_visible(device: &Arc<Device>, instance: Handle<Instance>, visible: u32) -> Result<i32, Failure> {
    let object = device.instances.get(instance)?;
    if visible > 1 {
        let failure = Failure::argument("visible", format!("is {visible}; 0 or 1 was expected"));
        return Err(failure.object_if_none(OBJECT_INSTANCE, object.id, &object.name));
    }
    object.placement()?.visible = visible == 1;
    Ok(OK)
}

fn remove(device: &Arc<Device>, instance: Handle<Instance>) -> Result<i32, Failure> {
    let object = device.instances.get(instance)?;
    if let Some(scene) = object.scene.upgrade() {
        scene.edit()?.instances.remove(&object.order);
    }
    device.instances.remove(instance)?;
    Ok(OK)
}

/// A 3x4 row-major matrix for column vectors, the translation in the last column; nothing for the
/// identity.
pub(super) fn transform(parameter: &'static str, matrix: Option<[f64; 12]>) -> Result<DAffine3, Failure> {
    let Some(m) = matrix else {
        return Ok(DAffine3::IDENTITY);
    };
    if let Some(at) = m.iter().position(|x| !x.is_finite()) {
        return Err(Failure::argument(parameter, format!("is {}; finite numbers were expected", m[at])).at(at as u64));
    }
    let column = |c: usize| DVec3::new(m[c], m[4 + c], m[8 + c]);
    Ok(DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) })
}

/// The way back.
pub(super) fn rows(t: &DAffine3) -> [f64; 12] {
    let (m, p) = (t.matrix3.transpose(), t.translation);
    let row = |r: DVec3, p: f64| [r.x, r.y, r.z, p];
    let rows = [row(m.x_axis, p.x), row(m.y_axis, p.y), row(m.z_axis, p.z)];
    std::array::from_fn(|i| rows[i / 4][i % 4])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_is_row_major_with_the_translation_last() {
        let m = [0.0, -1.0, 0.0, 10.0, 1.0, 0.0, 0.0, 20.0, 0.0, 0.0, 1.0, 30.0];
        let t = transform("transform", Some(m)).unwrap();
        // A quarter turn about z takes x to y.
        assert_eq!(t.transform_point3(DVec3::X), DVec3::new(10.0, 21.0, 30.0));
        assert_eq!(rows(&t), m);
    }
}
