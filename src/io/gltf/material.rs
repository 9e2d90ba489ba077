//! Materials: the metallic-roughness model of \[glTF\] 3.9 and its extensions.

use super::document::Document;
use super::error::{GltfError, Object};
use super::extras::Caustica;
use super::texture::{self, Images};
use crate::math::Rgb;
use crate::scene::description::{
    Encoding, Material, Medium, MetallicRoughness, NormalMap, Scattering, Textures, WALKED_ROUGHNESS,
};
use crate::text::shown;
use gltf::json::material::AlphaMode;
use gltf::json::texture::{Info, Texture};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use std::collections::HashSet;

/// A material, and the set of texture coordinates that it needs, if it has textures.
pub(super) struct Converted {
    pub(super) material: Material,
    pub(super) set: Option<u32>,
}

/// All materials of the file, in its order; images of those alone that a mesh has.
pub(super) fn convert_all(
    document: &Document,
    images: &mut Images,
    warnings: &mut Vec<String>,
) -> Result<Vec<Converted>, GltfError> {
    let primitives = || document.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let used: HashSet<usize> = primitives().filter_map(|p| p.material).map(|index| index.value()).collect();
    let mut materials = Vec::with_capacity(document.root.materials.len());
    for (i, material) in document.root.materials.iter().enumerate() {
        let object = Object { kind: "material", index: Some(i), name: material.name.clone().unwrap_or_default() };
        materials.push(convert(document, material, &object, used.contains(&i), images, warnings)?);
    }
    Ok(materials)
}

/// What a primitive without a material has: all properties at their defaults (\[glTF\] 3.9.6).
pub(super) fn default_material() -> Material {
    let scattering = Scattering::MetallicRoughness(MetallicRoughness::default());
    Material {
        name: "default".into(),
        scattering,
        textures: Textures::default(),
        emission: Rgb::ZERO,
        emission_two_sided: false,
        walked_roughness: WALKED_ROUGHNESS,
    }
}

fn convert(
    document: &Document,
    material: &json::Material,
    object: &Object,
    used: bool,
    images: &mut Images,
    warnings: &mut Vec<String>,
) -> Result<Converted, GltfError> {
    let pbr = &material.pbr_metallic_roughness;
    let extensions = material.extensions.clone().unwrap_or_default();
    let specular = extensions.specular.unwrap_or_default();
    let transmission = extensions.transmission.unwrap_or_default();
    let volume = extensions.volume.unwrap_or_default();

    let dispersion = extensions.others.get("KHR_materials_dispersion").and_then(|d| d.get("dispersion"));
    let expected = "expected a number, not below 0";
    let dispersion = match dispersion {
        Some(value) => value.as_f64().ok_or_else(|| object.invalid("dispersion", value, expected))?,
        None => 0.0,
    };

    let [r, g, b, _] = object.all_finite("baseColorFactor", pbr.base_color_factor.0)?.map(rounded_down);
    let solid = object.finite("thicknessFactor", volume.thickness_factor.0)? > 0.0;
    let model = MetallicRoughness {
        base_color: Rgb::new(r, g, b),
        metallic: object.finite("metallicFactor", pbr.metallic_factor.0)?,
        roughness: object.finite("roughnessFactor", pbr.roughness_factor.0)?,
        ior: object.finite("ior", extensions.ior.unwrap_or_default().ior.0)?,
        specular: object.finite("specularFactor", specular.specular_factor.0)?,
        specular_color: object.all_finite("specularColorFactor", specular.specular_color_factor.0)?.into(),
        transmission: object.finite("transmissionFactor", transmission.transmission_factor.0)?,
        solid,
        // Of thin walls it has no effect, unless they are made solid.
        absorption: absorption(&volume, object)
            .or_else(|e| if solid { Err(e) } else { Ok(None) })?
            .unwrap_or(Rgb::ZERO),
        abbe: abbe("dispersion", dispersion, object, warnings)?,
    };
    if model.transmission > 0.0 && (model.specular, model.specular_color) != (1.0, Rgb::ONE) {
        let what = "specularFactor and specularColorFactor are ignored where light is transmitted";
        warnings.push(format!("{object}: {what}: its reflection is that of its ior"));
    }

    let strength = extensions.emissive_strength.unwrap_or_default().emissive_strength.0;
    let strength = object.finite("emissiveStrength", strength)?;
    let factor = object.all_finite("emissiveFactor", material.emissive_factor.0)?;
    let mut emission = object.all_finite("emissiveFactor * emissiveStrength", factor.map(|c| c * strength))?;

    let mut set = None;
    let mut map = |info: &Option<Info>, encoding, slot: &str, factor: f32| {
        let Some(info) = info.as_ref().filter(|_| used && factor > 0.0) else { return Ok(None) };
        let wanted = texture::set(info);
        if let Some(first) = set.filter(|&first| first != wanted) {
            warnings.push(format!("{object}: {slot} is ignored: its texCoord is {wanted}, that of others {first}"));
            return Ok(None);
        }
        let map = images.map(info, encoding, object, slot, warnings)?;
        set = set.or(map.as_ref().map(|_| wanted));
        Ok(map)
    };
    let color = map(&pbr.base_color_texture, Encoding::Srgb, "baseColorTexture", model.base_color.max_element())?;
    let opaque = if model.transmission > 0.0 { 0.0 } else { model.metallic.max(model.roughness) };
    let slot = "metallicRoughnessTexture";
    let metallic_roughness = map(&pbr.metallic_roughness_texture, Encoding::Linear, slot, opaque)?;
    let glow = Rgb::from(emission).max_element();
    let emissive = map(&material.emissive_texture, Encoding::Srgb, "emissiveTexture", glow)?;
    let lost = used && glow > 0.0 && material.emissive_texture.is_some() && emissive.is_none();
    let normal = match &material.normal_texture {
        Some(normal) if !(solid && model.transmission > 0.0) => {
            let scale = object.finite("normalTexture.scale", normal.scale)?;
            let info = Some(texture::info_of_normal(normal, object)?);
            map(&info, Encoding::Linear, "normalTexture", scale.abs())?.map(|map| NormalMap { map, scale })
        }
        _ => None,
    };
    if lost {
        // Most of it may be black.
        emission = [0.0; 3];
        warnings.push(format!("{object}: it emits nothing without its emissiveTexture"));
    }
    if normal.is_none() && solid && model.transmission > 0.0 && material.normal_texture.is_some() {
        warnings.push(format!("{object}: normalTexture is ignored where light is refracted"));
    }
    if model.transmission > 0.0 && pbr.metallic_roughness_texture.is_some() {
        warnings.push(format!("{object}: {slot} is ignored where light is transmitted"));
    }
    let textures = [
        ("occlusionTexture", material.occlusion_texture.as_ref().map(|t| t.index)),
        ("transmissionTexture", index(&transmission.transmission_texture)),
        ("thicknessTexture", index(&volume.thickness_texture)),
        ("specularTexture", index(&specular.specular_texture)),
        ("specularColorTexture", index(&specular.specular_color_texture)),
    ];
    for (slot, texture) in textures {
        if let Some(texture) = texture {
            warnings.push(format!("{object}: {slot} is ignored: {}", image_name(document, texture)));
        }
    }
    match material.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => {}
        Checked::Valid(mode) => warnings.push(format!("{object}: alphaMode {mode:?} is ignored, it is opaque")),
        Checked::Invalid => {
            let value = document.literal(&format!("/materials/{}/alphaMode", object.index.unwrap_or_default()));
            return Err(object.invalid("alphaMode", value, "expected OPAQUE, MASK or BLEND"));
        }
    }

    let material = Material {
        name: object.label(),
        scattering: with_exterior(model, material, object, warnings)?,
        textures: Textures { color, metallic_roughness, emission: emissive, normal },
        emission: emission.into(),
        emission_two_sided: material.double_sided,
        walked_roughness: WALKED_ROUGHNESS,
    };
    Ok(Converted { material, set })
}

/// A factor that was meant to be 1 but for a writer's rounding: some tens of steps of f32, far below what can be seen.
fn rounded_down(factor: f32) -> f32 {
    if factor > 1.0 && factor < 1.0 + 1e-5 { 1.0 } else { factor }
}

/// Absorption of what lets nothing through, 1/m.
const OPAQUE: f32 = 1e30;

/// `-ln(attenuationColor) / attenuationDistance` per channel, 1/m (`KHR_materials_volume`,
/// "Absorption"); `None` where nothing is absorbed.
fn absorption(volume: &json::extensions::material::Volume, object: &Object) -> Result<Option<Rgb>, GltfError> {
    let distance = volume.attenuation_distance.0;
    let color = volume.attenuation_color.0;
    if distance.is_nan() || distance <= 0.0 {
        return Err(object.invalid("attenuationDistance", distance, "expected a positive number"));
    }
    for (i, c) in color.into_iter().enumerate() {
        if !(0.0..=1.0).contains(&c) {
            return Err(object.invalid(format!("attenuationColor[{i}]"), c, "expected 0 to 1"));
        }
    }
    if distance == f32::INFINITY {
        return Ok(None);
    }
    // Black would be an infinite coefficient; this one transmits nothing either, however thin the glass. `max` turns the
    // -0 of white into 0.
    let coefficient = color.map(|c| if c == 0.0 { OPAQUE } else { (-c.ln()).max(0.0) / distance });
    Ok(Some(object.all_finite("-ln(attenuationColor) / attenuationDistance", coefficient)?.into()))
}

/// Abbe's number, of which `KHR_materials_dispersion` has 20 times the inverse; 0 for none, or next to none.
fn abbe(field: &str, dispersion: f64, object: &Object, warnings: &mut Vec<String>) -> Result<f32, GltfError> {
    const MOST: f64 = 20.0;
    if !(dispersion >= 0.0) {
        return Err(object.invalid(field, dispersion, "expected a number, not below 0"));
    }
    if dispersion > MOST {
        warnings.push(format!("{object}: {field} is {dispersion}, and taken for {MOST}"));
    }
    Ok(if dispersion < 20.0 * 1e-6 { 0.0 } else { (20.0 / dispersion.min(MOST)) as f32 })
}

/// The model itself, or the boundary between two media if extras name the outer one.
fn with_exterior(
    model: MetallicRoughness,
    material: &json::Material,
    object: &Object,
    warnings: &mut Vec<String>,
) -> Result<Scattering, GltfError> {
    let mut extras = Caustica::of(&material.extras, object)?;
    let ior = extras.number("exterior_ior")?;
    let absorption = extras.list("exterior_absorption")?;
    let dispersion = extras.number("exterior_dispersion")?;
    extras.finish(warnings);
    let Some(ior) = ior else {
        let needs = |what: &str| object.invalid("extras.caustica.exterior_ior", "missing", format!("{what} needs it"));
        return match (absorption, dispersion) {
            (Some(_), _) => Err(needs("exterior_absorption")),
            (None, Some(_)) => Err(needs("exterior_dispersion")),
            (None, None) => Ok(Scattering::MetallicRoughness(model)),
        };
    };
    let needs = "extras.caustica.exterior_ior needs a solid dielectric";
    if model.transmission != 1.0 {
        return Err(object.invalid("transmissionFactor", model.transmission, format!("{needs}: 1")));
    }
    if model.metallic != 0.0 {
        return Err(object.invalid("metallicFactor", model.metallic, format!("{needs}: 0")));
    }
    if !model.solid {
        return Err(object.invalid("thicknessFactor", 0, format!("{needs}: above 0")));
    }
    Ok(Scattering::Dielectric {
        inside: Medium { ior: model.ior, absorption: model.absorption, abbe: model.abbe },
        outside: Medium {
            ior: object.finite("extras.caustica.exterior_ior", ior as f32)?,
            absorption: absorption.map_or(Rgb::ZERO, Rgb::from),
            abbe: abbe("extras.caustica.exterior_dispersion", dispersion.unwrap_or(0.0), object, warnings)?,
        },
        roughness: model.roughness,
        tint: model.base_color,
    })
}

fn index(info: &Option<Info>) -> Option<Index<Texture>> {
    info.as_ref().map(|info| info.index)
}

/// How a message calls the image of a texture.
fn image_name(document: &Document, texture: Index<Texture>) -> String {
    let Some(found) = document.root.get(texture) else { return format!("texture {texture} (missing)") };
    let object = document.object(found.source);
    let uri = document.root.get(found.source).and_then(|image| image.uri.as_deref());
    match uri.filter(|uri| !uri.starts_with("data:")) {
        Some(uri) => format!("{object} ({})", shown(uri)),
        None if document.root.get(found.source).is_some() => object.to_string(),
        None => document.object(texture).to_string(),
    }
}
