//! Glass that its writer took for solid, and did not say so.

use super::description::{Description, Geometry, Scattering};
use crate::geometry::Enclosure;
use crate::geometry::enclosure::is_sealed;
use glam::DVec3;
use std::collections::HashMap;

impl Description {
    /// Makes thin walls of the glTF material ([`Scattering::MetallicRoughness`]) that close around an inside solid: many
    /// writers leave the thickness at 0, where light goes straight on. Their normal textures, which nothing that refracts
    /// has, are left out. How many instances it was.
    pub fn solidify(&mut self) -> usize {
        let (mut solid, mut bodies, mut count) = (HashMap::new(), HashMap::new(), 0);
        for i in 0..self.instances.len() {
            let (geometry, index) = (self.instances[i].geometry, self.instances[i].material);
            let material = self.materials.get(index);
            let thin = material.is_some_and(|m| m.scattering.is_thin_by_default());
            let body = match geometry {
                Geometry::Sphere { .. } => true,
                Geometry::Mesh(mesh) => thin && *bodies.entry(mesh).or_insert_with(|| self.is_body(mesh)),
            };
            if !(thin && body) {
                continue;
            }
            count += 1;
            let materials = &mut self.materials;
            self.instances[i].material = *solid.entry(index).or_insert_with(|| {
                let mut material = materials[index].clone();
                if let Scattering::MetallicRoughness(m) = &mut material.scattering {
                    m.solid = true;
                }
                material.textures.normal = None;
                materials.push(material);
                materials.len() - 1
            });
        }
        count
    }

    fn is_body(&self, mesh: usize) -> bool {
        let Some(mesh) = self.meshes.get(mesh) else { return false };
        let position = |i: u32| DVec3::from(mesh.positions[i as usize].map(f64::from));
        let known = |i: &u32| (*i as usize) < mesh.positions.len();
        mesh.triangles.as_flattened().iter().all(known)
            && Enclosure::of(&mesh.triangles, position).is_body()
            && is_sealed(&mesh.triangles, position)
    }
}

#[cfg(test)]
mod tests {
    use crate::math::Rgb;
    use crate::scene::description::*;
    use glam::DAffine3;

    #[test]
    fn what_closes_becomes_solid_and_nothing_else() {
        let thin = MetallicRoughness { transmission: 1.0, metallic: 0.0, ..MetallicRoughness::default() };
        let material = |scattering| Material {
            name: String::new(),
            scattering,
            textures: Textures::default(),
            emission: Rgb::ZERO,
            emission_two_sided: false,
            walked_roughness: WALKED_ROUGHNESS,
        };
        let opaque = Scattering::Diffuse { reflectance: Rgb::ONE };
        let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let all = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mesh = |triangles: &[[u32; 3]]| {
            let triangles = triangles.to_vec();
            MeshDescription { positions: corners.clone(), triangles, ..MeshDescription::default() }.into()
        };
        let instance =
            |geometry, material| Instance { name: String::new(), geometry, material, transform: DAffine3::IDENTITY };
        let mut scene = Description {
            meshes: vec![mesh(&all), mesh(&all[..3]), mesh(&[[0, 1, 9]])],
            materials: vec![material(Scattering::MetallicRoughness(thin)), material(opaque)],
            instances: vec![
                instance(Geometry::Mesh(0), 0),
                instance(Geometry::Mesh(1), 0),
                instance(Geometry::Sphere { radius: 1.0 }, 0),
                instance(Geometry::Mesh(0), 1),
                // What a commit refuses.
                instance(Geometry::Mesh(2), 0),
                instance(Geometry::Mesh(0), 7),
            ],
            ..Description::default()
        };
        assert_eq!(scene.solidify(), 2);
        let materials: Vec<_> = scene.instances.iter().map(|i| i.material).collect();
        assert_eq!(materials, [2, 0, 2, 1, 0, 7]);
        let solid = Scattering::MetallicRoughness(MetallicRoughness { solid: true, ..thin });
        assert_eq!((scene.materials[2].scattering, scene.solidify()), (solid, 0));
    }
}
