//! Materials that vary over a mesh: compiled anew at each point. What is decided for a whole shape (where walks lead, what
//! light is aimed from) goes by the factors: no image makes glass of what is none, nor a mirror of what is rough.

use super::Warning;
use super::description::{
    Description, Geometry, LEAST_TEXTURED_ROUGHNESS, Material, MeshDescription, NormalMap, Scattering, TextureMap,
    Textures,
};
use crate::geometry::{Mesh, SurfacePoint};
use crate::math::Rgb;
use crate::scatter::Bsdf;
use crate::text::shown;
use glam::{Vec2, Vec3};
use std::collections::HashSet;
use std::sync::Arc;

/// A material on a mesh with texture coordinates.
pub(super) struct Textured {
    material: Arc<Material>,
    mesh: Arc<MeshDescription>,
}

impl Textured {
    /// The material at a point of the `placed` mesh, in light of one wavelength, if that is given; as walks see it, if
    /// `walked`.
    #[inline(never)]
    pub(super) fn bsdf(&self, placed: &Mesh, at: &SurfacePoint, walked: bool, wavelength: Option<f64>) -> Bsdf {
        let scattering = scattering(&self.material, self.coordinates(placed, at));
        let bsdf = Bsdf::new(&wavelength.map_or(scattering, |wavelength| scattering.at(wavelength)));
        if !walked {
            return bsdf;
        }
        bsdf.walked(self.material.walked_roughness).unwrap_or(bsdf)
    }

    /// Whether the material is another one at each point, beside its normal.
    pub(super) fn scatters(&self) -> bool {
        self.material.textures.scatter()
    }

    fn coordinates(&self, placed: &Mesh, at: &SurfacePoint) -> Vec2 {
        placed.interpolate(at, &self.mesh.texture_coordinates)
    }

    /// The shading normal at a point of the `placed` mesh. That of the mesh, where the image has none on its side.
    #[inline(never)]
    pub(super) fn normal(&self, placed: &Mesh, at: &SurfacePoint) -> Vec3 {
        self.bent(placed, at).filter(|n| n.dot(at.ng) > 0.0).unwrap_or(at.ns)
    }

    fn bent(&self, placed: &Mesh, at: &SurfacePoint) -> Option<Vec3> {
        let NormalMap { map, scale } = self.material.textures.normal.as_ref()?;
        let local = map.at(self.coordinates(placed, at)) * 2.0 - 1.0;
        let of_vertex = |i: usize| map.transform.transform_point2(self.mesh.texture_coordinates[i].into());
        let [right, down] = placed.gradients(at.primitive, of_vertex)?;
        let n = at.ns;
        let tangent = (right - n * n.dot(right)).try_normalize()?;
        let up = n.cross(tangent);
        let up = up * -1f32.copysign(up.dot(down));
        (tangent * (local.x * scale) + up * (local.y * scale) + n * local.z).try_normalize()
    }
}

impl Textures {
    fn scatter(&self) -> bool {
        self.color.is_some() || self.metallic_roughness.is_some()
    }

    /// Whether paths go another way for them.
    fn bear_on_paths(&self) -> bool {
        self.scatter() || self.normal.is_some()
    }

    /// Whether there are any.
    pub(super) fn any(&self) -> bool {
        self.all().next().is_some()
    }

    fn all(&self) -> impl Iterator<Item = &TextureMap> {
        let normal = self.normal.as_ref().map(|normal| &normal.map);
        [&self.color, &self.metallic_roughness, &self.emission].into_iter().flatten().chain(normal)
    }
}

/// The textured material of each instance that has one; none at all if no instance does.
pub(super) fn textured(d: &Description, meshes: &[Arc<MeshDescription>]) -> Vec<Option<Textured>> {
    let materials: Vec<Option<Arc<Material>>> =
        d.materials.iter().map(|m| m.textures.bear_on_paths().then(|| Arc::new(m.clone()))).collect();
    if materials.iter().all(Option::is_none) {
        return Vec::new();
    }
    let of_instance = d.instances.iter().map(|instance| {
        let material = materials[instance.material].as_ref()?;
        let mesh = coordinates(instance.geometry, meshes)?;
        Some(Textured { material: material.clone(), mesh: mesh.clone() })
    });
    let all: Vec<_> = of_instance.collect();
    if all.iter().all(Option::is_none) { Vec::new() } else { all }
}

/// The mesh, if it has texture coordinates.
pub(super) fn coordinates(geometry: Geometry, meshes: &[Arc<MeshDescription>]) -> Option<&Arc<MeshDescription>> {
    match geometry {
        Geometry::Mesh(mesh) => Some(&meshes[mesh]).filter(|mesh| !mesh.texture_coordinates.is_empty()),
        Geometry::Sphere { .. } => None,
    }
}

/// Textures that nothing tells the place of; once for each material.
pub(super) fn warnings(d: &Description, meshes: &[Arc<MeshDescription>], warnings: &mut Vec<Warning>) {
    let mut seen = HashSet::new();
    for (index, instance) in d.instances.iter().enumerate() {
        let material = &d.materials[instance.material];
        let lost = material.textures.any() && coordinates(instance.geometry, meshes).is_none();
        // Each lamp that is dark for it, and each material.
        let dark = material.textures.emission.is_some();
        if lost && (seen.insert(instance.material) || dark) {
            let light = if dark { ", and its light with them" } else { "" };
            let material = shown(&material.name);
            let text =
                format!("it has no texture coordinates: the textures of its material '{material}' are left out{light}");
            warnings.push(Warning::of(index, &instance.name, text));
        }
    }
}

/// Bytes of the textures and texture coordinates that instances show, each counted once.
pub(super) fn memory(d: &Description, meshes: &[Arc<MeshDescription>]) -> u64 {
    let (mut seen, mut seen_meshes, mut bytes) = (HashSet::new(), HashSet::new(), 0);
    for instance in &d.instances {
        let textures = &d.materials[instance.material].textures;
        let Some(mesh) = coordinates(instance.geometry, meshes).filter(|_| textures.any()) else { continue };
        if seen_meshes.insert(Arc::as_ptr(mesh)) {
            bytes += size_of_val(&mesh.texture_coordinates[..]) as u64;
        }
        let new = textures.all().filter(|map| seen.insert(Arc::as_ptr(&map.texture)));
        bytes += new.map(|map| map.texture.memory()).sum::<u64>();
    }
    bytes
}

/// The material at texture coordinates.
fn scattering(material: &Material, coordinates: Vec2) -> Scattering {
    let Textures { color, metallic_roughness, .. } = &material.textures;
    let mut scattering = material.scattering;
    if let Some(map) = color {
        let value = map.at(coordinates);
        // The largest texel keeps the product within 1 but for rounding.
        let tinted = |c: Rgb| (c * value).min(Rgb::ONE);
        match &mut scattering {
            Scattering::Diffuse { reflectance: c }
            | Scattering::Conductor { reflectance: c, .. }
            | Scattering::Dielectric { tint: c, .. }
            | Scattering::ThinDielectric { tint: c, .. } => *c = tinted(*c),
            Scattering::MetallicRoughness(m) => m.base_color = tinted(m.base_color),
        }
    }
    if let (Some(map), Scattering::MetallicRoughness(m)) = (metallic_roughness, &mut scattering) {
        let value = map.at(coordinates);
        m.roughness = (m.roughness * value.y).max(m.roughness.min(LEAST_TEXTURED_ROUGHNESS)).min(1.0);
        m.metallic = (m.metallic * value.z).min(1.0);
    }
    scattering
}

/// A material by its factors alone.
pub(super) fn factors(material: &Material) -> Bsdf {
    let bsdf = Bsdf::new(&material.scattering);
    if material.textures.scatter() { bsdf.varying() } else { bsdf }
}
