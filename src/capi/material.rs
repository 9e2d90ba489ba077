//! Materials: one flat descriptor, of which each model reads its part.

use super::device::Device;
use super::error::{Failure, OBJECT_MATERIAL, OK};
use super::guard;
use super::handle::{Handle, Kind};
use super::pointer::{In, MAX_NAME, Out, OutStruct, Sized32, Text};
use super::texture::Texture;
use crate::math::Rgb;
use crate::scene::description::{self, Medium, MetallicRoughness, NormalMap, Scattering, Textures, WALKED_ROUGHNESS};
use glam::Affine2;
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
    /// Multiplies `color`; none for id 0, as the following.
    pub color_texture: Handle<Texture>,
    /// Its green multiplies `roughness`, its blue `metallic`.
    pub metallic_roughness_texture: Handle<Texture>,
    /// Multiplies `emission`.
    pub emission_texture: Handle<Texture>,
    /// Of the shading normal.
    pub normal_texture: Handle<Texture>,
    /// Factor of its tangential parts; 0 for 1.
    pub normal_scale: f32,
    /// Zero.
    pub reserved: u32,
    /// Two rows of three, from texture coordinates to the images; all 0 for the identity.
    pub texture_transform: [f32; 6],
    /// How little the index varies over the spectrum; 0 where it does not.
    pub abbe_number: f32,
    /// Outside.
    pub abbe_number_outside: f32,
}

/// The textures that a host has given a material.
#[derive(Clone, Default)]
struct Bound {
    color: Option<Arc<Texture>>,
    metallic_roughness: Option<Arc<Texture>>,
    emission: Option<Arc<Texture>>,
    normal: Option<(Arc<Texture>, f32)>,
    transform: Affine2,
}

// SAFETY: `repr(C)`, `u32` first, numbers and pointers only.
unsafe impl Sized32 for MaterialDesc {
    const NAME: &'static str = "caustica_material_desc";
    const FIRST_SIZE: usize = 184;
}

/// A material; lives as long as the host or an instance refers to it.
pub struct Material {
    pub(super) id: u64,
    state: Mutex<(description::Material, Bound)>,
}

impl Kind for Material {
    const KIND: u32 = OBJECT_MATERIAL;
    const NAME: &'static str = "material";
    const PLURAL: &'static str = "materials";
}

impl Material {
    /// A material that the host has no handle of has the id 0.
    pub(super) fn new(id: u64, state: description::Material) -> Material {
        Material { id, state: Mutex::new((state, Bound::default())) }
    }

    /// Its values now.
    pub(super) fn describe(&self, seen: &mut super::texture::Textures) -> Result<description::Material, Failure> {
        let (mut state, bound) = self.state.lock().map_err(|_| self.broken())?.clone();
        let mut map = |texture: &Arc<Texture>| seen.map(texture, bound.transform);
        let Textures { color, metallic_roughness, emission, normal } = &mut state.textures;
        for (place, texture) in
            [(color, &bound.color), (metallic_roughness, &bound.metallic_roughness), (emission, &bound.emission)]
        {
            *place = texture.as_ref().map(&mut map).or(place.take());
        }
        if let Some((texture, scale)) = &bound.normal {
            *normal = Some(NormalMap { map: map(texture), scale: *scale });
        }
        Ok(state)
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
        color_texture: Handle::new(0),
        metallic_roughness_texture: Handle::new(0),
        emission_texture: Handle::new(0),
        normal_texture: Handle::new(0),
        normal_scale: 1.0,
        reserved: 0,
        texture_transform: [0.0; 6],
        abbe_number: 0.0,
        abbe_number_outside: 0.0,
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
    let state = read(device, desc, 0)?;
    let (handle, _) = device.materials.insert(|id| Material { id, state: Mutex::new(state) })?;
    out.write(handle);
    Ok(OK)
}

fn set(device: &Arc<Device>, material: Handle<Material>, desc: In<MaterialDesc>) -> Result<i32, Failure> {
    let object = device.materials.get(material)?;
    let state = read(device, desc, object.id)?;
    *object.state.lock().map_err(|_| object.broken())? = state;
    Ok(OK)
}

fn release(device: &Arc<Device>, material: Handle<Material>) -> Result<i32, Failure> {
    device.materials.remove(material)?;
    Ok(OK)
}

fn read(device: &Device, desc: In<MaterialDesc>, id: u64) -> Result<(description::Material, Bound), Failure> {
    let desc = desc.read("desc")?;
    let name = desc.name.read("name", MAX_NAME)?;
    let both = convert(&desc, &name).and_then(|material| Ok((material, bound(device, &desc)?)));
    both.map_err(|failure| failure.object_if_none(OBJECT_MATERIAL, id, &name))
}

fn bound(device: &Device, d: &MaterialDesc) -> Result<Bound, Failure> {
    let texture = |parameter: &str, handle: Handle<Texture>| match handle.id() {
        0 => Ok(None),
        _ => {
            let found = device.textures.get(handle);
            found.map(Some).map_err(|failure| Failure { parameter: parameter.to_owned(), ..failure })
        }
    };
    if d.reserved != 0 {
        return Err(Failure::argument("reserved", format!("is {}; 0 was expected", d.reserved)));
    }
    if !d.normal_scale.is_finite() {
        return Err(Failure::argument("normal_scale", format!("is {}; a finite number was expected", d.normal_scale)));
    }
    if let Some(at) = d.texture_transform.iter().position(|x| !x.is_finite()) {
        let text = format!("is {}; finite numbers were expected", d.texture_transform[at]);
        return Err(Failure::argument("texture_transform", text).at(at as u64));
    }
    let [a, b, c, e, f, g] = d.texture_transform;
    Ok(Bound {
        color: texture("color_texture", d.color_texture)?,
        metallic_roughness: texture("metallic_roughness_texture", d.metallic_roughness_texture)?,
        emission: texture("emission_texture", d.emission_texture)?,
        normal: texture("normal_texture", d.normal_texture)?.map(|texture| (texture, or_default(d.normal_scale, 1.0))),
        transform: match d.texture_transform.iter().all(|&x| x == 0.0) {
            true => Affine2::IDENTITY,
            false => Affine2::from_cols_array(&[a, e, b, f, c, g]),
        },
    })
}

fn convert(d: &MaterialDesc, name: &str) -> Result<description::Material, Failure> {
    check_model(d.model)?;
    let color = Rgb::from_array(d.color);
    let ior = or_default(d.ior, 1.5);
    let absorption = Rgb::from_array(d.absorption);
    let solid = boolean("solid", d.solid)?;
    let scattering = match d.model {
        MATERIAL_DIELECTRIC => Scattering::Dielectric {
            inside: Medium { ior, absorption, abbe: d.abbe_number },
            outside: Medium {
                ior: or_default(d.ior_outside, 1.0),
                absorption: Rgb::from_array(d.absorption_outside),
                abbe: d.abbe_number_outside,
            },
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
            abbe: d.abbe_number,
        }),
        _ => Scattering::Diffuse { reflectance: color },
    };
    Ok(description::Material {
        name: name.to_owned(),
        scattering,
        textures: Textures::default(),
        emission: Rgb::from_array(d.emission),
        emission_two_sided: boolean("emission_two_sided", d.emission_two_sided)?,
        walked_roughness: d.walked_roughness,
    })
}

/// Zero means the default: no medium has the refractive index 0, and no image of normals is for nothing.
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
