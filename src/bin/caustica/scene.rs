//! From a scene file to a committed world, with errors that name the file.

use crate::args::{Picture, Surroundings};
use crate::console::Console;
use crate::view::View;
use crate::{Failure, units};
use caustica::io::gltf::{self, Loaded};
use caustica::io::image::read_environment;
use caustica::math::Rgb;
use caustica::scene::description::{Camera, Description, Environment, Projection};
use caustica::scene::{CommitOptions, World};
use glam::DMat3;
use std::path::Path;
use std::sync::Arc;

/// Reads the file. Warnings are left to the caller.
pub(crate) fn load(path: &Path) -> Result<Loaded, Failure> {
    gltf::load(path).map_err(|error| at(path, &error))
}

/// Validates and builds. Warnings are left to the caller.
pub(crate) fn commit(path: &Path, description: &Description, options: CommitOptions) -> Result<World, Failure> {
    World::commit(description, options).map_err(|error| at(path, &error))
}

/// A file, as it is rendered.
pub(crate) struct Opened {
    pub(crate) description: Description,
    /// See [`Loaded::aspects`].
    pub(crate) aspects: Vec<Option<f64>>,
    pub(crate) world: World,
}

/// Both, with the warnings printed, and with what `picture` puts in place of what the scene says.
pub(crate) fn open(
    path: &Path,
    options: CommitOptions,
    picture: Option<&Picture>,
    console: Console,
) -> Result<Opened, Failure> {
    let mut loaded = load(path)?;
    let scene = &mut loaded.description;
    if let Some(picture) = picture {
        if picture.solid_glass {
            let bodies = units::count(scene.solidify(), "instance is", "instances are");
            console.note(&format!("{}: {bodies} made solid", path.display()));
        }
        scene.lights.iter_mut().for_each(|light| light.kind.scale(picture.light_scale as f32));
        let walked_roughness = picture.connections.walked_roughness;
        for material in &mut scene.materials {
            material.walked_roughness = walked_roughness.unwrap_or(material.walked_roughness);
        }
        surround(&mut scene.environment, &picture.surroundings)?;
    }
    let given = View::default();
    let view = picture.map_or(&given, |picture| &picture.view);
    if let Some(option) = view.without_place().filter(|_| !scene.cameras.is_empty()) {
        return Err(format!("{option} needs --look-from: the scene has a camera of its own").into());
    }
    if view.look_from.is_some() || scene.cameras.is_empty() {
        let (width, height) = picture.map_or((1, 1), |picture| picture.size(None));
        let camera = view.camera(scene, f64::from(width) / f64::from(height));
        if view.look_from.is_none() {
            let at = camera.transform.translation;
            console.note(&format!(
                "{}: seen from {:.4},{:.4},{:.4}; see --look-from",
                path.display(),
                at.x,
                at.y,
                at.z
            ));
        }
        scene.cameras.push(camera);
    }
    if let Some(lens) = view.lens() {
        let perspective = |camera: &&mut Camera| matches!(camera.projection, Projection::Perspective { .. });
        scene.cameras.iter_mut().filter(perspective).for_each(|camera| camera.lens = Some(lens));
    }
    let world = commit(path, &loaded.description, options)?;
    for warning in loaded.warnings.iter().cloned().chain(world.warnings.iter().map(ToString::to_string)) {
        console.warn(&format!("{}: {warning}", path.display()));
    }
    Ok(Opened { description: loaded.description, aspects: loaded.aspects, world })
}

fn surround(environment: &mut Environment, by: &Surroundings) -> Result<(), Failure> {
    if let Some(path) = &by.environment {
        let image = read_environment(path).map_err(|error| at(path, &error))?;
        *environment = Environment { image: Some(Arc::new(image)), ..Rgb::ONE.into() };
    }
    if let Some(degrees) = by.environment_rotation {
        if environment.image.is_none() {
            return Err("--environment-rotation: neither --environment nor the scene gives an image to turn".into());
        }
        environment.rotation = DMat3::from_rotation_y(f64::from(degrees).to_radians());
    }
    environment.radiance *= by.environment_scale;
    Ok(())
}

/// Which of the cameras, of which there are some, a user asked for: by its name, else by its index; the first if nothing was
/// said.
pub(crate) fn camera(cameras: &[Camera], wanted: Option<&str>) -> Result<usize, Failure> {
    let Some(wanted) = wanted else {
        return Ok(0);
    };
    if let Some(index) = cameras.iter().position(|camera| camera.name == wanted) {
        return Ok(index);
    }
    if let Some(index) = wanted.parse().ok().filter(|&index: &usize| index < cameras.len()) {
        return Ok(index);
    }
    let known: Vec<String> = cameras.iter().enumerate().map(|(i, c)| format!("{i} {:?}", c.name)).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    Err(format!("no camera {wanted:?}; the scene has {known}").into())
}

fn at(path: &Path, error: &dyn std::error::Error) -> Failure {
    let name = path.display().to_string();
    let text = crate::console::chain(error);
    if text.contains(&name) { text.into() } else { format!("{name}: {text}").into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustica::scene::description::Projection;

    fn named(names: &[&str]) -> Vec<Camera> {
        let projection = Projection::Perspective { yfov: 1.0 };
        let camera = |name: &&str| Camera::new(*name, glam::DAffine3::IDENTITY, projection);
        names.iter().map(camera).collect()
    }

    #[test]
    fn a_name_goes_before_an_index() {
        let cameras = named(&["front", "0", "side"]);
        assert_eq!(camera(&cameras, None).unwrap(), 0);
        assert_eq!(camera(&cameras, Some("side")).unwrap(), 2);
        assert_eq!(camera(&cameras, Some("0")).unwrap(), 1);
        assert_eq!(camera(&cameras, Some("2")).unwrap(), 2);
    }

    #[test]
    fn an_unknown_camera_is_named_with_those_there_are() {
        let error = camera(&named(&["front"]), Some("back")).unwrap_err().to_string();
        assert!(error.contains("\"back\"") && error.contains("0 \"front\""), "{error}");
        assert!(camera(&named(&["front"]), Some("1")).is_err());
    }
}
