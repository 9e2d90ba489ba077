//! Looks at a description once, before anything is built from it. Afterwards the render code asserts
//! nothing about its input.

use super::SceneError;
use super::description::*;
use crate::math::Rgb;
use glam::{DAffine3, DMat3, DVec3};

/// Embree drops triangles beyond about 1.8e18 without a word (measured, 4.3.3).
const LARGEST_COORDINATE: f64 = 1e18;
/// Most heights of its picture by which a film may be moved, and most by which a lens may be wider than its focus is away.
const LARGEST_SHIFT: f64 = 1e3;

/// Names the object while its fields are checked.
struct Object<'a> {
    kind: &'static str,
    index: usize,
    name: &'a str,
}

/// Whether there is a way back. Relative to the axes' lengths, so that a tiny but sound scale passes.
pub(crate) fn is_invertible(m: &DMat3) -> bool {
    let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    m.determinant().abs() > 1e-12 * volume && volume != 0.0
}

impl Object<'_> {
    fn fail<T>(&self, field: impl Into<String>, value: impl ToString, expected: &str) -> Result<T, SceneError> {
        Err(SceneError::Invalid {
            kind: self.kind,
            index: self.index,
            name: self.name.to_owned(),
            field: field.into(),
            value: value.to_string(),
            expected: expected.to_owned(),
        })
    }

    fn range(&self, field: &str, value: f64, low: f64, high: f64) -> Result<(), SceneError> {
        if value >= low && value <= high {
            return Ok(());
        }
        self.fail(field, value, &format!("a number in [{}, {}] was expected", short(low), short(high)))
    }

    fn color(&self, field: &str, value: Rgb, high: f32) -> Result<(), SceneError> {
        for (c, channel) in value.to_array().into_iter().zip(["r", "g", "b"]) {
            if !(c >= 0.0 && c <= high) {
                return self.fail(format!("{field}.{channel}"), c, &format!("a number in [0, {high}] was expected"));
            }
        }
        Ok(())
    }

    fn point(&self, field: &str, value: DVec3) -> Result<(), SceneError> {
        if value.is_finite() && value.abs().max_element() <= LARGEST_COORDINATE {
            return Ok(());
        }
        self.fail(field, value, "finite coordinates below 1e18 were expected")
    }

    fn direction(&self, field: &str, value: DVec3) -> Result<(), SceneError> {
        if value.is_finite() && value.length() > 0.0 && value.length().is_finite() {
            return Ok(());
        }
        self.fail(field, value, "a finite vector of non-zero length was expected")
    }

    fn transform(&self, value: &DAffine3) -> Result<(), SceneError> {
        self.point("transform.translation", value.translation)?;
        let m = value.matrix3;
        if !m.is_finite() {
            return self.fail("transform", rows(&m), "finite numbers were expected");
        }
        if !is_invertible(&m) {
            return self.fail("transform", rows(&m), "an invertible matrix was expected");
        }
        Ok(())
    }

    fn index_below(&self, field: &str, value: usize, count: usize) -> Result<(), SceneError> {
        if value < count {
            return Ok(());
        }
        self.fail(field, value, &format!("there are {count}"))
    }
}

/// Checks every object of a description; the first fault found is the error.
pub(super) fn validate(d: &Description) -> Result<(), SceneError> {
    for (index, mesh) in d.meshes.iter().enumerate() {
        validate_mesh(&Object { kind: "mesh", index, name: &mesh.name }, mesh)?;
    }
    for (index, material) in d.materials.iter().enumerate() {
        let object = Object { kind: "material", index, name: &material.name };
        object.color("emission", material.emission, f32::MAX)?;
        object.range("walked_roughness", material.walked_roughness.into(), 0.0, 1.0)?;
        validate_scattering(&object, &material.scattering)?;
        validate_textures(&object, material)?;
    }
    for (index, instance) in d.instances.iter().enumerate() {
        validate_instance(&Object { kind: "instance", index, name: &instance.name }, instance, d)?;
    }
    for (index, light) in d.lights.iter().enumerate() {
        validate_light(&Object { kind: "light", index, name: &light.name }, &light.kind)?;
    }
    validate_environment(&d.environment)?;
    for (index, camera) in d.cameras.iter().enumerate() {
        validate_camera(index, camera)?;
    }
    Ok(())
}

/// Checks a camera, in a description or beside one.
pub(crate) fn validate_camera(index: usize, camera: &Camera) -> Result<(), SceneError> {
    let object = Object { kind: "camera", index, name: &camera.name };
    object.transform(&camera.transform)?;
    object.range("shift[0]", camera.shift.x, -LARGEST_SHIFT, LARGEST_SHIFT)?;
    object.range("shift[1]", camera.shift.y, -LARGEST_SHIFT, LARGEST_SHIFT)?;
    if let Some(lens) = camera.lens {
        object.range("lens_radius", lens.radius, f64::MIN_POSITIVE, LARGEST_COORDINATE)?;
        // Nearer, and rays would leave the lens along it.
        object.range("focus_distance", lens.focus, lens.radius / LARGEST_SHIFT, LARGEST_COORDINATE)?;
        if !matches!(camera.projection, Projection::Perspective { .. }) {
            return object.fail("lens_radius", lens.radius, "0 was expected: parallel projections have no lens");
        }
    }
    match camera.projection {
        Projection::Perspective { yfov } => object.range("yfov", yfov, 1e-6, std::f64::consts::PI - 1e-6),
        Projection::Orthographic { ymag } => object.range("ymag", ymag, f64::MIN_POSITIVE, LARGEST_COORDINATE),
    }
}

fn validate_environment(environment: &Environment) -> Result<(), SceneError> {
    let object = Object { kind: "environment", index: 0, name: "" };
    object.color("radiance", environment.radiance, f32::MAX)?;
    let Some(image) = &environment.image else { return Ok(()) };
    if !(environment.radiance * image.largest()).is_finite() {
        let value = format!("{} times an image of up to {}", environment.radiance.max_element(), image.largest());
        return object.fail("radiance", value, "a product within the range of floats was expected");
    }
    let m = environment.rotation;
    let orthonormal = (m * m.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-6);
    if !(orthonormal && m.determinant() > 0.0) {
        return object.fail("rotation", rows(&m), "a rotation was expected");
    }
    Ok(())
}

/// Without hundreds of zeros.
fn short(bound: f64) -> String {
    if bound == 0.0 || (1e-7..1e7).contains(&bound.abs()) { bound.to_string() } else { format!("{bound:e}") }
}

fn validate_mesh(object: &Object, mesh: &MeshDescription) -> Result<(), SceneError> {
    let count = mesh.positions.len();
    if count > u32::MAX as usize || mesh.triangles.len() > u32::MAX as usize {
        return object.fail("positions", count, "at most 2^32 - 1 vertices and triangles were expected");
    }
    for (i, p) in mesh.positions.iter().enumerate() {
        for (c, axis) in p.iter().zip(["x", "y", "z"]) {
            if !(c.abs() as f64 <= LARGEST_COORDINATE) {
                return object.fail(format!("positions[{i}].{axis}"), c, "a finite number below 1e18 was expected");
            }
        }
    }
    if !mesh.normals.is_empty() && mesh.normals.len() != count {
        let expected = format!("none, or one for each of the {count} positions, was expected");
        return object.fail("normals.len()", mesh.normals.len(), &expected);
    }
    for (i, n) in mesh.normals.iter().enumerate() {
        let n = DVec3::from(n.map(f64::from));
        if !(n.is_finite() && n.length_squared() > 0.0) {
            return object.fail(format!("normals[{i}]"), n, "a finite vector of non-zero length was expected");
        }
    }
    let coordinates = &mesh.texture_coordinates;
    if !coordinates.is_empty() && coordinates.len() != count {
        let expected = format!("none, or one for each of the {count} positions, was expected");
        return object.fail("texture_coordinates.len()", coordinates.len(), &expected);
    }
    for (i, c) in coordinates.iter().enumerate() {
        for (c, axis) in c.iter().zip(["u", "v"]) {
            if !c.is_finite() {
                return object.fail(format!("texture_coordinates[{i}].{axis}"), c, "a finite number was expected");
            }
        }
    }
    for (i, t) in mesh.triangles.iter().enumerate() {
        for (k, &v) in t.iter().enumerate() {
            if v as usize >= count {
                let expected = format!("the mesh has {count} positions");
                return object.fail(format!("triangles[{i}][{k}]"), v, &expected);
            }
        }
    }
    Ok(())
}

fn validate_scattering(object: &Object, scattering: &Scattering) -> Result<(), SceneError> {
    let abbe = |field: &str, abbe: f32| if abbe == 0.0 { Ok(()) } else { object.range(field, abbe.into(), 1.0, 1e6) };
    let medium = |side: &str, m: &Medium| {
        object.range(&format!("{side}.ior"), m.ior as f64, 1.0, 10.0)?;
        abbe(&format!("{side}.abbe"), m.abbe)?;
        object.color(&format!("{side}.absorption"), m.absorption, f32::MAX)
    };
    match scattering {
        Scattering::Diffuse { reflectance } => object.color("reflectance", *reflectance, 1.0),
        Scattering::Dielectric { inside, outside, roughness, tint } => {
            medium("inside", inside)?;
            medium("outside", outside)?;
            object.range("roughness", *roughness as f64, 0.0, 1.0)?;
            object.color("tint", *tint, 1.0)
        }
        Scattering::ThinDielectric { ior, roughness, tint } => {
            object.range("ior", *ior as f64, 1.0, 10.0)?;
            object.range("roughness", *roughness as f64, 0.0, 1.0)?;
            object.color("tint", *tint, 1.0)
        }
        Scattering::Conductor { reflectance, roughness } => {
            object.color("reflectance", *reflectance, 1.0)?;
            object.range("roughness", *roughness as f64, 0.0, 1.0)
        }
        Scattering::MetallicRoughness(m) => {
            object.color("base_color", m.base_color, 1.0)?;
            object.range("metallic", m.metallic as f64, 0.0, 1.0)?;
            object.range("roughness", m.roughness as f64, 0.0, 1.0)?;
            // Where nothing is refracted it says how much is reflected; 0 and infinity: all.
            let (least, most) = if m.transmission > 0.0 { (1.0, 10.0) } else { (0.0, f32::MAX) };
            object.range("ior", m.ior as f64, least, most as f64)?;
            object.range("specular", m.specular as f64, 0.0, 1.0)?;
            // KHR_materials_specular allows colours above 1; the reflectance is clamped to 1 there.
            object.color("specular_color", m.specular_color, f32::MAX)?;
            object.range("transmission", m.transmission as f64, 0.0, 1.0)?;
            abbe("abbe", m.abbe)?;
            object.color("absorption", m.absorption, f32::MAX)
        }
    }
}

fn shown(c: Rgb) -> String {
    format!("({}, {}, {})", c.x, c.y, c.z)
}

/// Whether it bounds a medium.
fn refracts(scattering: &Scattering) -> bool {
    match scattering {
        Scattering::Dielectric { .. } => true,
        Scattering::MetallicRoughness(m) => m.solid && m.transmission > 0.0,
        _ => false,
    }
}

fn validate_textures(object: &Object, material: &Material) -> Result<(), SceneError> {
    let Textures { color, metallic_roughness, emission, normal } = &material.textures;
    let product = |field: &str, map: Option<&TextureMap>, factor: Rgb, most: f32| {
        let Some(map) = map else { return Ok(()) };
        if !map.transform.is_finite() {
            let value = format!("{:?}", map.transform.to_cols_array());
            return object.fail(format!("{field}.transform"), value, "finite numbers were expected");
        }
        let largest = map.texture.largest();
        if !((factor * largest).max_element() <= most) {
            let value = format!("{} times an image of up to {}", shown(factor), shown(largest));
            return object.fail(field, value, &format!("a product of at most {} was expected", short(most.into())));
        }
        Ok(())
    };
    let factor = match &material.scattering {
        Scattering::Diffuse { reflectance: c }
        | Scattering::Conductor { reflectance: c, .. }
        | Scattering::Dielectric { tint: c, .. }
        | Scattering::ThinDielectric { tint: c, .. } => *c,
        Scattering::MetallicRoughness(m) => m.base_color,
    };
    product("textures.color", color.as_ref(), factor, 1.0)?;
    product("textures.emission", emission.as_ref(), material.emission, f32::MAX)?;
    if let Some(NormalMap { map, scale }) = normal {
        product("textures.normal", Some(map), Rgb::ONE, 1.0)?;
        // Far beyond it the mesh's normal would count for nothing. Not tuned.
        object.range("textures.normal.scale", (*scale).into(), -1e6, 1e6)?;
        if refracts(&material.scattering) {
            return object.fail("textures.normal", "given", "a surface that does not refract was expected with it");
        }
    }
    if metallic_roughness.is_none() {
        return Ok(());
    }
    let Scattering::MetallicRoughness(m) = &material.scattering else {
        return object.fail(
            "textures.metallic_roughness",
            "given",
            "the metallic-roughness model was expected with it",
        );
    };
    if m.transmission > 0.0 {
        return object.fail("transmission", m.transmission, "0 was expected beside textures.metallic_roughness");
    }
    product("textures.metallic_roughness", metallic_roughness.as_ref(), Rgb::new(0.0, m.roughness, m.metallic), 1.0)
}

/// Row by row, as the C interface has it.
fn rows(m: &DMat3) -> String {
    format!("{:?}", m.transpose().to_cols_array_2d())
}

fn validate_instance(object: &Object, instance: &Instance, d: &Description) -> Result<(), SceneError> {
    object.index_below("material", instance.material, d.materials.len())?;
    object.transform(&instance.transform)?;
    match instance.geometry {
        Geometry::Mesh(mesh) => object.index_below("geometry", mesh, d.meshes.len()),
        Geometry::Sphere { radius } => {
            object.range("radius", radius, f64::MIN_POSITIVE, LARGEST_COORDINATE)?;
            let m = instance.transform.matrix3;
            let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
            let s = x.length();
            let uneven = [y.length() - s, z.length() - s, x.dot(y) / s, y.dot(z) / s, z.dot(x) / s];
            if uneven.iter().any(|u| u.abs() > 1e-5 * s) {
                return object.fail("transform", rows(&m), "a sphere may be scaled uniformly only");
            }
            Ok(())
        }
    }
}

fn validate_light(object: &Object, kind: &LightKind) -> Result<(), SceneError> {
    match *kind {
        LightKind::Point { position, intensity } => {
            object.point("position", position)?;
            object.color("intensity", intensity, f32::MAX)
        }
        LightKind::Spot { position, direction, intensity, inner, outer } => {
            object.point("position", position)?;
            object.direction("direction", direction)?;
            object.color("intensity", intensity, f32::MAX)?;
            // As f32 has it, pi/2 is a little more.
            object.range("outer", outer, 1e-6, f64::from(std::f32::consts::FRAC_PI_2))?;
            if !(inner >= 0.0 && inner <= outer) {
                return object.fail(
                    "inner",
                    inner,
                    &format!("an angle from 0 to the outer one, {outer}, was expected"),
                );
            }
            Ok(())
        }
        LightKind::Directional { direction, irradiance } => {
            object.direction("direction", direction)?;
            object.color("irradiance", irradiance, f32::MAX)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_told_row_by_row() {
        let m = DMat3::from_cols(DVec3::new(1.0, 0.0, 0.0), DVec3::new(2.0, 0.0, 0.0), DVec3::Z);
        assert_eq!(rows(&m), "[[1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]");
    }
}
