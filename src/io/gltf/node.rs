//! What stands where: the node hierarchy with its meshes, spheres, lights and cameras.

use super::budget::Budget;
use super::buffer::{Buffers, relative_path};
use super::document::{Document, Named};
use super::error::{GltfError, Object};
use super::extras::Caustica;
use super::material::{self, Converted};
use super::mesh::{self, Part};
use crate::io::image::read_environment;
use crate::math::Rgb;
use crate::scene::description::{
    Camera, Description, Environment, Geometry, Instance, Lens, Light, LightKind, MeshDescription, Projection,
};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec2};
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::{self, Type as LightType};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Deepest hierarchy; beyond it lies a mistake of the writer, and rounding that adds up.
const MAX_DEPTH: usize = 1024;

/// A matrix whose columns span less than this share of the box of their lengths counts as
/// singular: products of flat transforms leave about 1e-16 by rounding.
const SINGULAR: f64 = 1e-12;

/// Converts the file's scene: the one it names, else its first.
pub(super) fn convert_scene(
    document: &Document,
    buffers: &Buffers,
    base: Option<&Path>,
    materials: Vec<Converted>,
    budget: &mut Budget,
    warnings: &mut Vec<String>,
) -> Result<(Description, Vec<Option<f64>>), GltfError> {
    let file = Object { kind: "file", index: None, name: String::new() };
    let index = document.root.scene.unwrap_or(Index::new(0));
    if document.root.scene.is_none() && document.root.scenes.len() > 1 {
        warnings.push(format!("the file names no default scene: {} is taken", document.object(index)));
    }
    if document.root.scenes.is_empty() {
        return Err(GltfError::NotGltf("it has no scene".to_owned()));
    }
    let scene = document.get(index, &file, "scene")?;
    let object = document.object(index);
    let mut extras = Caustica::of(&scene.extras, &object)?;
    let environment = environment(&mut extras, &object, base)?;
    extras.finish(warnings);

    let sets = materials.iter().map(|m| m.set).collect();
    let materials = materials.into_iter().map(|m| m.material).collect();
    let mut walk = Walk {
        document,
        buffers,
        budget,
        warnings,
        description: Description { materials, environment, ..Description::default() },
        sets,
        meshes: HashMap::new(),
        default_material: None,
        aspects: Vec::new(),
    };
    walk.run(scene, &object)?;
    Ok((walk.description, walk.aspects))
}

/// What surrounds the scene: `environment` and, from a file in the folder `base`, `environment_image` with
/// `environment_rotation`.
fn environment(extras: &mut Caustica, object: &Object, base: Option<&Path>) -> Result<Environment, GltfError> {
    let radiance = extras.list("environment")?.map(Rgb::from);
    let Some(uri) = extras.text("environment_image")? else { return Ok(radiance.unwrap_or(Rgb::ZERO).into()) };
    let Some(base) = base else {
        return Err(object.unsupported("an environment image beside a scene in memory"));
    };
    let field = "extras.caustica.environment_image";
    let path = base.join(relative_path(&uri, field, object)?);
    let unread = |source| GltfError::Image { object: Box::new(object.clone()), field: field.to_owned(), source };
    let image = read_environment(&path).map_err(unread)?;
    let degrees = extras.number("environment_rotation")?.unwrap_or(0.0);
    Ok(Environment {
        radiance: radiance.unwrap_or(Rgb::ONE),
        image: Some(Arc::new(image)),
        rotation: DMat3::from_rotation_y(degrees.to_radians()),
    })
}

/// State of the conversion.
struct Walk<'a> {
    document: &'a Document<'a>,
    buffers: &'a Buffers<'a>,
    budget: &'a mut Budget,
    warnings: &'a mut Vec<String>,
    description: Description,
    /// Of texture coordinates, by material.
    sets: Vec<Option<u32>>,
    /// Mesh of the description by what it is made of; `None` for one without triangles.
    meshes: HashMap<MeshKey, Option<usize>>,
    default_material: Option<usize>,
    /// See [`super::Loaded::aspects`].
    aspects: Vec<Option<f64>>,
}

/// Primitives of one key are the same triangles: writers give each material a mesh of its own, over the same accessors.
#[derive(PartialEq, Eq, Hash)]
enum MeshKey {
    Triangles {
        mode: u32,
        positions: usize,
        normals: Option<usize>,
        coordinates: Option<usize>,
        indices: Option<usize>,
    },
    /// What is not rendered as it stands has warnings of its own.
    Other { mesh: usize, primitive: usize, set: Option<u32> },
}

impl MeshKey {
    fn of(primitive: &Primitive, mesh: Index<json::Mesh>, number: usize, set: Option<u32>) -> MeshKey {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
        match (primitive.mode, attribute(Semantic::Positions)) {
            (Checked::Valid(mode), Some(positions)) if primitive.targets.is_none() => MeshKey::Triangles {
                mode: mode.as_gl_enum(),
                positions,
                normals: attribute(Semantic::Normals),
                coordinates: mesh::coordinates(primitive, set).map(|i| i.value()),
                indices: primitive.indices.map(|i| i.value()),
            },
            _ => MeshKey::Other { mesh: mesh.value(), primitive: number, set },
        }
    }
}

/// A node to be visited.
struct Visit {
    node: Index<json::Node>,
    /// Parent to world.
    parent: DAffine3,
    depth: usize,
}

impl<'a> Walk<'a> {
    fn run(&mut self, scene: &json::Scene, scene_object: &Object) -> Result<(), GltfError> {
        let mut seen = vec![false; self.document.root.nodes.len()];
        let mut stack = Vec::new();
        // Pushed backwards, so that nodes come in the order of the file.
        for (i, &node) in scene.nodes.iter().enumerate().rev() {
            self.document.get(node, scene_object, &format!("nodes[{i}]"))?;
            stack.push(Visit { node, parent: DAffine3::IDENTITY, depth: 0 });
        }
        while let Some(Visit { node: index, parent, depth }) = stack.pop() {
            let object = self.document.object(index);
            let node = self.document.get(index, scene_object, "nodes")?;
            match seen.get_mut(index.value()) {
                Some(seen) if !*seen => *seen = true,
                _ => return Err(object.invalid("parent", "not the only one", "nodes must form trees without cycles")),
            }
            if depth > MAX_DEPTH {
                return Err(object.invalid("depth", depth, format!("at most {MAX_DEPTH} nodes below a root")));
            }
            let transform = parent * local_transform(node, &object)?;
            self.visit(node, &object, transform)?;
            for (i, &child) in node.children.as_deref().unwrap_or_default().iter().enumerate().rev() {
                self.document.get(child, &object, &format!("children[{i}]"))?;
                stack.push(Visit { node: child, parent: transform, depth: depth + 1 });
            }
        }
        Ok(())
    }

    fn visit(&mut self, node: &json::Node, object: &Object, transform: DAffine3) -> Result<(), GltfError> {
        let mut extras = Caustica::of(&node.extras, object)?;
        let sphere = extras.sphere_radius()?;
        extras.finish(self.warnings);
        let light = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        if sphere.is_none() && node.mesh.is_none() && light.is_none() && node.camera.is_none() {
            return Ok(());
        }
        if !is_invertible(transform, object)? {
            // Exporters hide by a scale of 0 what is not to be seen ([glTF] 3.5.2).
            let how =
                if transform.matrix3 == DMat3::ZERO { "hidden by a scale of 0" } else { "flattened by its scale" };
            self.warnings.push(format!("{object}: {how}, it is left out"));
            return Ok(());
        }
        match (sphere, node.mesh) {
            (Some(radius), mesh) => self.place_sphere(radius, mesh, object, transform)?,
            (None, Some(mesh)) => self.place_mesh(mesh, object, transform)?,
            (None, None) => {}
        }
        if let Some(light) = light {
            let light = convert_light(self.document, light.light, object, transform, self.warnings)?;
            self.budget.charge(1, size_of::<Light>() + light.name.len(), object)?;
            self.description.lights.push(light);
        }
        if let Some(camera) = node.camera {
            let (camera, aspect) = convert_camera(self.document, camera, object, transform, self.warnings)?;
            self.aspects.push(aspect);
            self.budget.charge(1, size_of::<Camera>() + camera.name.len(), object)?;
            self.description.cameras.push(camera);
        }
        Ok(())
    }

    /// An instance for each primitive of a mesh.
    fn place_mesh(&mut self, index: Index<json::Mesh>, node: &Object, transform: DAffine3) -> Result<(), GltfError> {
        let document = self.document;
        let mesh = document.get(index, node, "mesh")?;
        let object = document.object(index);
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let set = primitive.material.and_then(|m| *self.sets.get(m.value())?);
            let key = MeshKey::of(primitive, index, number, set);
            let shape = match self.meshes.get(&key) {
                Some(&shape) => shape,
                None => {
                    let shape = self.convert_primitive(&Part { primitive, number, set }, &object)?;
                    let shape = shape.map(|shape| {
                        self.description.meshes.push(shape.into());
                        self.description.meshes.len() - 1
                    });
                    self.meshes.insert(key, shape);
                    shape
                }
            };
            if let Some(shape) = shape {
                let material = self.material(primitive, number, &object)?;
                self.place(Geometry::Mesh(shape), material, node, transform)?;
            }
        }
        Ok(())
    }

    fn convert_primitive(&mut self, part: &Part, object: &Object) -> Result<Option<MeshDescription>, GltfError> {
        mesh::convert(self.document, self.buffers, part, object, self.budget, self.warnings)
    }

    /// A sphere instead of a mesh, which lends its material only.
    fn place_sphere(
        &mut self,
        radius: f64,
        mesh: Option<Index<json::Mesh>>,
        node: &Object,
        transform: DAffine3,
    ) -> Result<(), GltfError> {
        let field = "extras.caustica.sphere";
        let Some(index) = mesh else {
            return Err(node.invalid("mesh", "missing", format!("{field} takes its material from there")));
        };
        let mesh = self.document.get(index, node, "mesh")?;
        let object = self.document.object(index);
        let Some(primitive) = mesh.primitives.first() else {
            return Err(object.invalid("primitives", "empty", format!("{field} takes its material from the first")));
        };
        let material = self.material(primitive, 0, &object)?;
        self.place(Geometry::Sphere { radius }, material, node, transform)
    }

    fn place(
        &mut self,
        geometry: Geometry,
        material: usize,
        node: &Object,
        transform: DAffine3,
    ) -> Result<(), GltfError> {
        let name = node.label();
        self.budget.charge(1, size_of::<Instance>() + name.len(), node)?;
        self.description.instances.push(Instance { name, geometry, material, transform });
        Ok(())
    }

    /// Index of a primitive's material in the description.
    fn material(&mut self, primitive: &Primitive, number: usize, mesh: &Object) -> Result<usize, GltfError> {
        if let Some(index) = primitive.material {
            self.document.get(index, mesh, &format!("primitives[{number}].material"))?;
            return Ok(index.value());
        }
        let materials = &mut self.description.materials;
        Ok(*self.default_material.get_or_insert_with(|| {
            materials.push(material::default_material());
            materials.len() - 1
        }))
    }
}

/// Node to parent (\[glTF\] 3.5.2, "Transformations").
fn local_transform(node: &json::Node, object: &Object) -> Result<DAffine3, GltfError> {
    if let Some(matrix) = node.matrix {
        let m = object.all_finite("matrix", matrix)?.map(f64::from);
        let last_row = [m[3], m[7], m[11], m[15]];
        // Products of matrices are rounded: some tens of steps of f32.
        if last_row.iter().zip([0.0, 0.0, 0.0, 1.0]).any(|(x, exact)| (x - exact).abs() > 1e-5) {
            return Err(object.invalid("matrix, last row", format!("{last_row:?}"), "expected [0, 0, 0, 1]"));
        }
        let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        return Ok(DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) });
    }
    let vector = |field, value: Option<[f32; 3]>, default| -> Result<DVec3, GltfError> {
        Ok(object.all_finite(field, value.unwrap_or([default; 3]))?.map(f64::from).into())
    };
    let translation = vector("translation", node.translation, 0.0)?;
    let scale = vector("scale", node.scale, 1.0)?;
    let rotation = object.all_finite("rotation", node.rotation.unwrap_or_default().0)?.map(f64::from);
    let rotation = DQuat::from_array(rotation);
    if rotation.length_squared() == 0.0 {
        return Err(object.invalid("rotation", "zero", "expected a unit quaternion"));
    }
    // Unit but for rounding; what is left of that would scale.
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}

/// Whether a transform keeps volumes, or an error if it is not finite.
fn is_invertible(transform: DAffine3, object: &Object) -> Result<bool, GltfError> {
    let m = transform.matrix3;
    let volume = m.determinant();
    let bound = SINGULAR * m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    if transform.is_finite() && volume.is_finite() {
        return Ok(volume.abs() > bound);
    }
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.to_array());
    Err(object.invalid("transform to world", format!("{columns:?}"), "expected a finite one"))
}

/// `KHR_lights_punctual`: photometric units are taken as radiometric ones, per channel.
fn convert_light(
    document: &Document,
    index: Index<khr_lights_punctual::Light>,
    node: &Object,
    transform: DAffine3,
    warnings: &mut Vec<String>,
) -> Result<Light, GltfError> {
    let light = document.get(index, node, "KHR_lights_punctual.light")?;
    let object = document.object(index);
    let color = object.all_finite("color", light.color)?;
    let intensity = object.finite("intensity", light.intensity)?;
    let intensity = Rgb::from(object.all_finite("color * intensity", color.map(|c| c * intensity))?);
    if let Some(range) = light.range {
        warnings.push(format!("{object}: range {range} is ignored, light does not end"));
    }
    let position = transform.translation;
    // Lights shine along -z of their node; scale bears on the direction only by shearing it.
    let direction = transform.transform_vector3(DVec3::NEG_Z).normalize();
    let kind = match light.type_ {
        Checked::Valid(LightType::Point) => LightKind::Point { position, intensity },
        Checked::Valid(LightType::Directional) => LightKind::Directional { direction, irradiance: intensity },
        Checked::Valid(LightType::Spot) => {
            let Some(spot) = &light.spot else {
                return Err(object.invalid("spot", "missing", "a light of type spot needs it"));
            };
            let inner = f64::from(object.finite("spot.innerConeAngle", spot.inner_cone_angle)?);
            let outer = f64::from(object.finite("spot.outerConeAngle", spot.outer_cone_angle)?);
            LightKind::Spot { position, direction, intensity, inner, outer }
        }
        Checked::Invalid => {
            let value = document.literal(&format!("/extensions/KHR_lights_punctual/lights/{index}/type"));
            return Err(object.invalid("type", value, "expected point, spot or directional"));
        }
    };
    Ok(Light { name: name_of(node, light), kind })
}

fn convert_camera(
    document: &Document,
    index: Index<json::Camera>,
    node: &Object,
    transform: DAffine3,
    warnings: &mut Vec<String>,
) -> Result<(Camera, Option<f64>), GltfError> {
    let camera = document.get(index, node, "camera")?;
    let object = document.object(index);
    let missing = |field| object.invalid(field, "missing", "the camera's type needs it");
    let (projection, aspect) = match camera.type_ {
        Checked::Valid(CameraType::Perspective) => {
            let lens = camera.perspective.as_ref().ok_or_else(|| missing("perspective"))?;
            let yfov = object.finite("perspective.yfov", lens.yfov)?.into();
            (Projection::Perspective { yfov }, lens.aspect_ratio)
        }
        Checked::Valid(CameraType::Orthographic) => {
            let lens = camera.orthographic.as_ref().ok_or_else(|| missing("orthographic"))?;
            let ymag = object.finite("orthographic.ymag", lens.ymag)?;
            (Projection::Orthographic { ymag: ymag.into() }, Some(lens.xmag / ymag))
        }
        Checked::Invalid => {
            let value = document.literal(&format!("/cameras/{index}/type"));
            return Err(object.invalid("type", value, "expected perspective or orthographic"));
        }
    };
    // No more than a wish.
    let aspect = aspect.map(f64::from).filter(|aspect| *aspect > 0.0 && aspect.is_finite());
    let mut extras = Caustica::of(&camera.extras, &object)?;
    let [radius, focus] = [extras.number("lens_radius")?, extras.number("focus_distance")?];
    let lens = match (radius.filter(|radius| *radius != 0.0), focus) {
        (Some(radius), Some(focus)) => Some(Lens { radius, focus }),
        (Some(_), None) => {
            return Err(object.invalid("extras.caustica.focus_distance", "missing", "lens_radius needs it"));
        }
        (None, _) => None,
    };
    let shift = extras.list("shift")?.map_or(DVec2::ZERO, |shift| Vec2::from_array(shift).as_dvec2());
    extras.finish(warnings);
    Ok((Camera { lens, shift, ..Camera::new(name_of(node, camera), transform, projection) }, aspect))
}

/// The name of a node, else of what it carries, else its number.
fn name_of(node: &Object, carried: &impl Named) -> String {
    match carried.name() {
        Some(name) if node.name.is_empty() && !name.is_empty() => name.to_string(),
        _ => node.label(),
    }
}
