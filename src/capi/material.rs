//! Materials: one flat descriptor, of which each model reads its part.

use super::device::Device;
use super::error::{Failure, OBJECT_MATERIAL, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::pointer::{In, MAX_NAME, Out, OutStruct, Sized32, Text};
use crate::math::Rgb;
use crate::scene::description::{self, Medium, MetallicRoughness, Scattering, WALKED_ROUGHNESS};
use std::sync::{Arc, Mutex};

/// Lambertian.
pub const MATERIAL_DIFFUSE: u32 = 1;
/// The boundary of a refracting solid or liquid.
pub const MATERIAL_DIELECTRIC: u32 = 2;
/// A refracting sheet without thickness.
pub const MATERIAL_THIN_DIELECTRIC: u32 = 3;
/// A metal.
pub const MATERIAL_CONDUCTOR: u32 = 4;
/// The glTF 2.0 model.
pub const MATERIAL_METALLIC_ROUGHNESS: u32 = 5;

/// `caustica_material_desc`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct MaterialDesc {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// How it scatters.
    pub model: u32,
    /// For messages.
    pub name: Text,
    /// Reflectance, tint of transmitted light, or base colour.
    pub color: [f32; 3],
    /// Perceptual.
    pub roughness: f32,
    /// Refractive index; 0 for 1.5.
    pub ior: f32,
    /// Refractive index before the surface; 0 for 1.
    pub ior_outside: f32,
    /// 1/m, behind the surface.
    pub absorption: [f32; 3],
    /// 1/m, before the surface.
    pub absorption_outside: [f32; 3],
    /// Of the metallic-roughness model, as the following.
    pub metallic: f32,
    /// Strength of the dielectric reflection.
    pub specular: f32,
    /// Colour of the dielectric reflection at normal incidence.
    pub specular_color: [f32; 3],
    /// Share that transmits.
    pub transmission: f32,
    /// 1: transmission enters a solid; 0: a thin sheet.
    pub solid: u32,
    /// Emitted radiance, W/(m² sr).
    pub emission: [f32; 3],
    /// 1: the back emits too.
    pub emission_two_sided: u32,
    /// Rough refraction below this roughness is crossed by walks.
    pub walked_roughness: f32,
}

// SAFETY: `repr(C)`, `u32` first, numbers and pointers only.
unsafe impl Sized32 for MaterialDesc {
    const NAME: &'static str = "caustica_material_desc";
    const FIRST_SIZE: usize = 112;
}

/// A material; lives as long as the host or an instance refers to it.
pub struct Material {
    pub(super) id: u64,
    state: Mutex<description::Material>,
}

impl Kind for Material {
    const KIND: u32 = OBJECT_MATERIAL;
    const NAME: &'static str = "material";
    const PLURAL: &'static str = "materials";
}

impl Material {
    /// A material that the host has no handle of has the id 0.
    pub(super) fn new(id: u64, state: description::Material) -> Material {
        Material { id, state: Mutex::new(state) }
    }

    /// Its values now.
    pub(super) fn describe(&self) -> Result<description::Material, Failure> {
        let state = self.state.lock().map_err(|_| self.broken())?;
        Ok(state.clone())
    }

    fn broken(&self) -> Failure {
        Failure::internal("an earlier call on this material failed").object(OBJECT_MATERIAL, self.id, "")
    }
}

guard::export! {
    /// Fills a descriptor with a model's defaults.
    free fn caustica_material_desc_init(desc: OutStruct<MaterialDesc>, model: u32) = init;
}

guard::export! {
    /// Makes a material.
    fn caustica_material_create(device, desc: In<MaterialDesc>, material: Out<Handle<Material>>) = create;

    /// Replaces all values.
    fn caustica_material_set(device, material: Handle<Material>, desc: In<MaterialDesc>) = set;

    /// Gives up the host's claim.
    fn caustica_material_release(device, material: Handle<Material>) = release;
}

fn init(desc: OutStruct<MaterialDesc>, model: u32) -> Result<i32, Failure> {
    let place = desc.required("desc")?;
    check_model(model)?;
    let gltf = if model == MATERIAL_METALLIC_ROUGHNESS { 1.0 } else { 0.0 };
    place.write(&MaterialDesc {
        struct_size: 0,
        model,
        name: Text::NULL,
        color: [1.0; 3],
        roughness: gltf,
        ior: 1.5,
        ior_outside: 1.0,
        absorption: [0.0; 3],
        absorption_outside: [0.0; 3],
        metallic: gltf,
        specular: 1.0,
        specular_color: [1.0; 3],
        transmission: 0.0,
        solid: 0,
        emission: [0.0; 3],
        emission_two_sided: 0,
        walked_roughness: WALKED_ROUGHNESS,
    });
    Ok(OK)
}

fn check_model(model: u32) -> Result<(), Failure> {
    match model {
        MATERIAL_DIFFUSE..=MATERIAL_METALLIC_ROUGHNESS => Ok(()),
        other => Err(Failure::argument("model", format!("is {other}; a CAUSTICA_MATERIAL_ was expected"))),
    }
}

fn create(device: &Arc<Device>, desc: In<MaterialDesc>, material: Out<Handle<Material>>) -> Result<i32, Failure> {
    let out = material.required("material")?;
    let state = read(desc, 0)?;
    let (handle, _) = device.materials.insert(|id| Material::new(id, state))?;
    out.write(handle);
    Ok(OK)
}

fn set(device: &Arc<Device>, material: Handle<Material>, desc: In<MaterialDesc>) -> Result<i32, Failure> {
    let object = device.materials.get(material)?;
    let state = read(desc, object.id)?;
    *object.state.lock().map_err(|_| object.broken())? = state;
    Ok(OK)
}

fn release(device: &Arc<Device>, material: Handle<Material>) -> Result<i32, Failure> {
    device.materials.remove(material)?;
    Ok(OK)
}

fn read(desc: In<MaterialDesc>, id: u64) -> Result<description::Material, Failure> {
    let desc = desc.read("desc")?;
    let name = desc.name.read("name", MAX_NAME)?;
    convert(&desc, &name).map_err(|failure| failure.object_if_none(OBJECT_MATERIAL, id, &name))
}

fn convert(d: &MaterialDesc, name: &str) -> Result<description::Material, Failure> {
    check_model(d.model)?;
    let color = Rgb::from_array(d.color);
    let ior = or_default(d.ior, 1.5);
    let absorption = Rgb::from_array(d.absorption);
    let solid = boolean("solid", d.solid)?;
    let scattering = match d.model {
        MATERIAL_DIELECTRIC => Scattering::Dielectric {
            inside: Medium { ior, absorption },
            outside: Medium { ior: or_default(d.ior_outside, 1.0), absorption: Rgb::from_array(d.absorption_outside) },
            roughness: d.roughness,
            tint: color,
        },
        MATERIAL_THIN_DIELECTRIC => Scattering::ThinDielectric { ior, roughness: d.roughness, tint: color },
        MATERIAL_CONDUCTOR => Scattering::Conductor { reflectance: color, roughness: d.roughness },
        MATERIAL_METALLIC_ROUGHNESS => Scattering::MetallicRoughness(MetallicRoughness {
            base_color: color,
            metallic: d.metallic,
            roughness: d.roughness,
            ior,
            specular: d.specular,
            specular_color: Rgb::from_array(d.specular_color),
            transmission: d.transmission,
            solid,
            absorption,
        }),
        _ => Scattering::Diffuse { reflectance: color },
    };
    Ok(description::Material {
        name: name.to_owned(),
        scattering,
        emission: Rgb::from_array(d.emission),
        emission_two_sided: boolean("emission_two_sided", d.emission_two_sided)?,
        walked_roughness: d.walked_roughness,
    })
}

/// Zero means the default: no medium has the refractive index 0.
fn or_default(value: f32, default: f32) -> f32 {
    if value == 0.0 { default } else { value }
}

fn boolean(parameter: &'static str, value: u32) -> Result<bool, Failure> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Failure::argument(parameter, format!("is {other}; 0 or 1 was expected"))),
    }
}
