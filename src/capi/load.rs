//! Scene files into a scene.

use super::camera::Camera;
use super::device::{Device, SEVERITY_WARNING};
use super::error::*;
use super::guard;
use super::handle::Handle;
use super::instance::{Geometry, Instance, Placement};
use super::light::Light;
use super::material::Material;
use super::mesh::Mesh;
use super::pointer::{MAX_PATH, Out, Text};
use super::scene::Scene;
use crate::io::gltf::{self, GltfError, Loaded};
use crate::math::Rgb;
use crate::scene::description::{self, Description};
use std::path::Path;
use std::sync::Arc;

guard::export! {
    /// Adds all that a file holds.
    fn caustica_scene_load(device, scene: Handle<Scene>, path: Text, warning_count: Out<u32>) = load;
}

fn load(device: &Arc<Device>, scene: Handle<Scene>, path: Text, warning_count: Out<u32>) -> Result<i32, Failure> {
    let scene = device.scenes.get(scene)?;
    let path = path.read("path", MAX_PATH)?;
    if path.is_empty() {
        return Err(Failure::argument("path", "is empty"));
    }
    let Loaded { description, warnings, .. } = gltf::load(Path::new(&path)).map_err(failure)?;
    let Description { meshes, materials, instances, lights, environment, cameras } = description;

    // Only cameras get handles, so only they can fail; the scene changes after that.
    let mut contents = scene.edit()?;
    let mut new_cameras = Vec::new();
    for state in cameras {
        match device.cameras.insert(|id| Camera::new(id, &scene, state)) {
            Ok((_, camera)) => new_cameras.push(camera),
            Err(failure) => {
                new_cameras.iter().for_each(|camera| drop(device.cameras.remove(Handle::new(camera.id))));
                return Err(failure);
            }
        }
    }
    contents.cameras.append(&mut new_cameras);
    let meshes: Vec<_> = meshes.into_iter().map(|data| Arc::new(Mesh::new(0, data))).collect();
    let materials: Vec<_> = materials.into_iter().map(|state| Arc::new(Material::new(0, state))).collect();
    for instance in instances {
        let geometry = match instance.geometry {
            description::Geometry::Mesh(index) => Geometry::Mesh(meshes[index].clone()),
            description::Geometry::Sphere { radius } => Geometry::Sphere { radius },
        };
        let placement = Placement::new(materials[instance.material].clone(), instance.transform);
        let order = contents.next_order();
        let instance = Instance::new(0, (&scene, order), instance.name, geometry, placement);
        contents.instances.insert(order, Arc::new(instance));
    }
    contents.lights.extend(lights.into_iter().map(|state| Arc::new(Light::new(0, &scene, state))));
    if environment.radiance != Rgb::ZERO {
        contents.environment = environment;
    }
    drop(contents);

    for warning in &warnings {
        let message = Failure::new(OK, warning.as_str()).object(OBJECT_SCENE, scene.id, "");
        device.messages.send(SEVERITY_WARNING, &message);
    }
    warning_count.write(warnings.len() as u32);
    Ok(OK)
}

fn failure(error: GltfError) -> Failure {
    let text = error.to_string();
    let with = |code, parameter: String| Failure { parameter, ..Failure::new(code, text.as_str()) };
    match error {
        GltfError::Io { source, .. } if source.kind() == std::io::ErrorKind::OutOfMemory => {
            with(ERROR_OUT_OF_MEMORY, "path".to_owned())
        }
        GltfError::Io { .. } => with(ERROR_IO, "path".to_owned()),
        GltfError::Image { object, field, source } => {
            Failure { object_name: object.name.clone(), ..with(super::write::failure(source).code, field) }
        }
        GltfError::OutOfMemory { object, .. } => {
            Failure { object_name: object.name.clone(), ..with(ERROR_OUT_OF_MEMORY, "path".to_owned()) }
        }
        GltfError::NotGltf(_) => with(ERROR_INVALID_ARGUMENT, "path".to_owned()),
        GltfError::Unsupported { object, feature } => {
            Failure { object_name: object.name.clone(), ..with(ERROR_UNSUPPORTED, feature) }
        }
        GltfError::Invalid { object, field, .. } => {
            Failure { object_name: object.name.clone(), ..with(ERROR_INVALID_ARGUMENT, field) }
        }
        GltfError::Internal(_) => Failure::new(ERROR_INTERNAL, text),
    }
}
