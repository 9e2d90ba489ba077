//! What a host or a file says about a scene. Plain data: anything may be wrong in it until
//! [`super::World::commit`] has looked.

pub use crate::emitter::{EnvironmentMap, EnvironmentMapError};
use crate::math::Rgb;
pub use crate::texture::{Encoding, Filter, MOST_SIDE, PixelsError, Texture, TextureMap, Wrap};
use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::sync::Arc;

/// A scene as described, before validation.
///
/// Metres, right-handed, y up as in glTF; radiance in W/(m² sr) per channel, linear Rec. 709.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Triangle meshes, in their own space; drawn where an [`Instance`] refers to them.
    pub meshes: Vec<Arc<MeshDescription>>,
    /// Surface descriptions, referred to by instances.
    pub materials: Vec<Material>,
    /// What stands in the scene.
    pub instances: Vec<Instance>,
    /// Lights that are not surfaces.
    pub lights: Vec<Light>,
    /// What is infinitely far away; radiance zero for nothing.
    pub environment: Environment,
    /// Viewpoints.
    pub cameras: Vec<Camera>,
}

impl Description {
    /// Lower and upper corner of the box around all shapes, as far as their numbers are finite.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut corners: Option<(DVec3, DVec3)> = None;
        let mut add = |low: DVec3, high: DVec3| {
            if low.is_finite() && high.is_finite() {
                let (a, b) = corners.unwrap_or((low, high));
                corners = Some((a.min(low), b.max(high)));
            }
        };
        for instance in &self.instances {
            match instance.geometry {
                Geometry::Mesh(index) => {
                    for p in self.meshes.get(index).map_or(&[][..], |mesh| &mesh.positions) {
                        let p = instance.transform.transform_point3(DVec3::from(p.map(f64::from)));
                        add(p, p);
                    }
                }
                Geometry::Sphere { radius } => {
                    let m = instance.transform;
                    let r = DVec3::splat(radius * m.matrix3.x_axis.length());
                    add(m.translation - r, m.translation + r);
                }
            }
        }
        corners
    }
}

/// Light from all around.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// W/(m² sr), the same from everywhere; what the image is multiplied by, if there is one.
    pub radiance: Rgb,
    /// An image of it.
    pub image: Option<Arc<EnvironmentMap>>,
    /// From the image's space to the scene's: a rotation.
    pub rotation: DMat3,
}

impl From<Rgb> for Environment {
    fn from(radiance: Rgb) -> Environment {
        Environment { radiance, ..Environment::default() }
    }
}

/// A triangle mesh.
#[derive(Clone, Debug, Default)]
pub struct MeshDescription {
    /// For messages.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Vertex normals, one per position, any non-zero length; empty for flat shading.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one per position; empty for none.
    pub texture_coordinates: Vec<[f32; 2]>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// A shape placed in the scene.
#[derive(Clone, Debug)]
pub struct Instance {
    /// For messages.
    pub name: String,
    /// Its shape.
    pub geometry: Geometry,
    /// Index into [`Description::materials`].
    pub material: usize,
    /// Object to world. A mirroring transform keeps the front side the front side.
    pub transform: DAffine3,
}

/// The shape of an instance.
#[derive(Clone, Copy, Debug)]
pub enum Geometry {
    /// Index into [`Description::meshes`].
    Mesh(usize),
    /// A sphere about the instance's origin; the transform may scale it uniformly only.
    Sphere {
        /// Radius, positive.
        radius: f64,
    },
}

/// A surface.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// How it scatters.
    pub scattering: Scattering,
    /// What of that varies over meshes with texture coordinates.
    pub textures: Textures,
    /// Emitted radiance, W/(m² sr).
    pub emission: Rgb,
    /// Whether the back side emits too.
    pub emission_two_sided: bool,
    /// Refraction of a lower roughness than this is crossed by manifold walks, with microfacets drawn
    /// beforehand, where caustic connections are made and all lights have an extent; else it is evaluated as
    /// any surface that scatters. 0 to 1; smooth refraction is always crossed.
    pub walked_roughness: f32,
}

/// Images that a material's numbers are multiplied by.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    /// Of the reflectance, the tint or the base colour. The product is at most 1.
    pub color: Option<TextureMap>,
    /// Of the metallic-roughness model where nothing is transmitted: green for roughness, blue for metallic. A surface
    /// that is rough without it stays so: [`LEAST_TEXTURED_ROUGHNESS`] at least.
    pub metallic_roughness: Option<TextureMap>,
    /// Of the emission.
    pub emission: Option<TextureMap>,
    /// Of the shading normal, where nothing refracts: walks know the mesh's alone.
    pub normal: Option<NormalMap>,
}

/// An image of shading normals: of red, green and blue from 0 to 1 twice the number less 1 is the part to the right in the
/// image, upward in it, and along the mesh's normal.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// The image.
    pub map: TextureMap,
    /// Factor of the first two.
    pub scale: f32,
}

/// No image makes a mirror of what is rough, nor the other way round: what is decided for a whole material hangs on that.
pub const LEAST_TEXTURED_ROUGHNESS: f32 = 0.032;

/// Default of [`Material::walked_roughness`]. At 0.1 walks lower the error of caustics (at equal time, ball
/// and plate under a lamp of 10 cm) 2.4 times, from 0.4 on they raise it; and what the camera sees of a small
/// lamp through glass that is walked through, chance alone finds.
pub const WALKED_ROUGHNESS: f32 = 0.15;

/// How a surface scatters. Roughness is perceptual: the GGX width is its square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scattering {
    /// Lambertian, both sides.
    Diffuse {
        /// Albedo, `[0, 1]`.
        reflectance: Rgb,
    },
    /// The boundary of a solid or liquid: refraction with exact Fresnel terms.
    Dielectric {
        /// What is behind the surface (against its normal).
        inside: Medium,
        /// What is before it; vacuum unless this surface separates two materials.
        outside: Medium,
        /// 0 for smooth.
        roughness: f32,
        /// Multiplies transmitted light; white for clear glass.
        tint: Rgb,
    },
    /// A sheet without thickness, which transmits straight on.
    ThinDielectric {
        /// Refractive index of the sheet.
        ior: f32,
        /// 0 for smooth.
        roughness: f32,
        /// Multiplies transmitted light.
        tint: Rgb,
    },
    /// A metal with Schlick's Fresnel term.
    Conductor {
        /// Reflectance at normal incidence.
        reflectance: Rgb,
        /// 0 for a mirror.
        roughness: f32,
    },
    /// The glTF 2.0 metallic-roughness model with `KHR_materials_ior`, `_specular`, `_transmission`
    /// and `_volume`.
    MetallicRoughness(MetallicRoughness),
}

impl Scattering {
    /// Whether it transmits through thin walls since nobody said that it is solid.
    pub(crate) fn is_thin_by_default(&self) -> bool {
        matches!(self, Scattering::MetallicRoughness(m) if m.transmission > 0.0 && m.metallic < 1.0 && !m.solid)
    }
}

/// A homogeneous medium that refracts and may absorb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Refractive index relative to vacuum, at least 1; of the yellow helium line, 587.56 nm, if it varies.
    pub ior: f32,
    /// Absorption coefficient, 1/m.
    pub absorption: Rgb,
    /// The Abbe number `V_d = (n_d - 1) / (n_F - n_C)`, how little the index varies over the spectrum: 20 to 95 for glasses;
    /// 0 where it does not.
    pub abbe: f32,
}

impl Medium {
    /// Index 1, no absorption.
    pub const VACUUM: Medium = Medium::new(1.0, Rgb::ZERO);

    /// Of the same index for all light.
    pub const fn new(ior: f32, absorption: Rgb) -> Medium {
        Medium { ior, absorption, abbe: 0.0 }
    }
}

/// Parameters of the glTF material, Khronos glTF 2.0 specification, appendix B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// Linear, `[0, 1]`.
    pub base_color: Rgb,
    /// `[0, 1]`.
    pub metallic: f32,
    /// Perceptual, `[0, 1]`.
    pub roughness: f32,
    /// Refractive index of the dielectric part.
    pub ior: f32,
    /// Strength of the dielectric reflection, `[0, 1]`; 0 leaves a Lambertian base.
    pub specular: f32,
    /// Colour of the dielectric reflection at normal incidence.
    pub specular_color: Rgb,
    /// Share of the dielectric base that transmits instead of scattering diffusely, `[0, 1]`.
    pub transmission: f32,
    /// Whether transmission enters a solid (`KHR_materials_volume` thickness > 0) or a thin sheet.
    pub solid: bool,
    /// Absorption coefficient of the solid, 1/m; of no effect in a thin sheet.
    pub absorption: Rgb,
    /// Of the solid, see [`Medium::abbe`].
    pub abbe: f32,
}

impl Default for MetallicRoughness {
    /// The specification's: rough white metal.
    fn default() -> MetallicRoughness {
        MetallicRoughness {
            base_color: Rgb::ONE,
            metallic: 1.0,
            roughness: 1.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: Rgb::ONE,
            transmission: 0.0,
            solid: false,
            absorption: Rgb::ZERO,
            abbe: 0.0,
        }
    }
}

/// A light that is not a surface.
#[derive(Clone, Debug)]
pub struct Light {
    /// For messages.
    pub name: String,
    /// Its kind.
    pub kind: LightKind,
}

/// Kinds of lights that are not surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// The same intensity in all directions.
    Point {
        /// World space.
        position: DVec3,
        /// Radiant intensity, W/sr.
        intensity: Rgb,
    },
    /// A point light within a cone (`KHR_lights_punctual`'s recommended falloff between the cones).
    Spot {
        /// World space.
        position: DVec3,
        /// Axis, any non-zero length.
        direction: DVec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Rgb,
        /// Half-angle of full intensity, radians.
        inner: f64,
        /// Half-angle where it reaches zero, radians; above `inner`, at most pi/2.
        outer: f64,
    },
    /// Parallel light.
    Directional {
        /// The way the light travels, any non-zero length.
        direction: DVec3,
        /// Irradiance on a surface perpendicular to it, W/m².
        irradiance: Rgb,
    },
}

impl LightKind {
    /// Whether it gives any light.
    pub fn emits(&self) -> bool {
        let (LightKind::Point { intensity: strength, .. }
        | LightKind::Spot { intensity: strength, .. }
        | LightKind::Directional { irradiance: strength, .. }) = self;
        *strength != Rgb::ZERO
    }

    /// So many times as bright.
    pub fn scale(&mut self, by: f32) {
        let (LightKind::Point { intensity: strength, .. }
        | LightKind::Spot { intensity: strength, .. }
        | LightKind::Directional { irradiance: strength, .. }) = self;
        *strength *= by;
    }
}

/// A viewpoint: looks along -z of its own space, y up.
#[derive(Clone, Debug)]
pub struct Camera {
    /// For messages and for choosing one.
    pub name: String,
    /// Camera to world; scaling is ignored.
    pub transform: DAffine3,
    /// Its projection.
    pub projection: Projection,
    /// Of a perspective camera: its lens, if that is no pinhole.
    pub lens: Option<Lens>,
    /// By how much the film is moved to the right and up, over the height of the picture.
    pub shift: DVec2,
}

impl Camera {
    /// One without a lens, its film in the middle.
    pub fn new(name: impl Into<String>, transform: DAffine3, projection: Projection) -> Camera {
        Camera { name: name.into(), transform, projection, lens: None, shift: DVec2::ZERO }
    }
}

/// A thin round lens. What lies at its focus is sharp, all else a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of its opening, metres.
    pub radius: f64,
    /// Depth of what is sharp, along the direction of view, metres.
    pub focus: f64,
}

/// How a camera maps directions to the film. The film's aspect ratio comes from the image size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Full vertical field of view, radians.
        yfov: f64,
    },
    /// Parallel.
    Orthographic {
        /// Half the height of the film, metres.
        ymag: f64,
    },
}
