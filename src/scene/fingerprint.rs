//! A hash of a description that is the same on every machine and for every compiler.

use super::description::*;
use crate::math::Fnv;
use std::fmt::Write;

/// Hashes of a description.
pub(super) struct Fingerprint {
    /// Of everything that can change an image of the scene. Names do not.
    pub(super) scene: u64,
    /// Of what is where, whatever it is made of: of each instance.
    pub(super) shapes: Vec<u64>,
}

pub(super) fn fingerprint(d: &Description) -> Fingerprint {
    let meshes: Vec<u64> = d.meshes.iter().map(|mesh| geometry(mesh)).collect();
    let mut h = Fnv::default();
    meshes.iter().for_each(|hash| h.bytes(&hash.to_le_bytes()));
    // Debug formatting of numbers is exact (shortest round-trip), and writing to a hash cannot fail.
    let shape = |i: &Instance| {
        let mut h = Fnv::default();
        match i.geometry {
            Geometry::Mesh(mesh) => h.bytes(&meshes[mesh].to_le_bytes()),
            Geometry::Sphere { radius } => h.bytes(&radius.to_bits().to_le_bytes()),
        }
        let sphere = matches!(i.geometry, Geometry::Sphere { .. });
        let _ = write!(h, "{sphere}{:?}", i.transform);
        h.value()
    };
    let shapes = d.instances.iter().map(shape).collect();
    if d.materials.iter().any(|m| m.textures.any()) {
        for mesh in &d.meshes {
            h.bytes(&(mesh.texture_coordinates.len() as u64).to_le_bytes());
            for [u, v] in &mesh.texture_coordinates {
                h.triple([u.to_bits(), v.to_bits(), 0]);
            }
        }
        for m in &d.materials {
            let _ = write!(h, "{:?}", m.textures);
        }
    }
    for m in &d.materials {
        let _ = write!(h, "{:?}{:?}{}{}", m.scattering, m.emission, m.emission_two_sided, m.walked_roughness);
    }
    for i in &d.instances {
        let _ = write!(h, "{:?}{}{:?}", i.geometry, i.material, i.transform);
    }
    for l in &d.lights {
        let _ = write!(h, "{:?}", l.kind);
    }
    for c in &d.cameras {
        let _ = write!(h, "{:?}{:?}{:?}{}", c.transform, c.projection, c.lens, c.shift);
    }
    let Environment { radiance, image, rotation } = &d.environment;
    let _ = write!(h, "{radiance:?}");
    if let Some(image) = image {
        let _ = write!(h, "{:?}{rotation:?}", image.hash());
    }
    Fingerprint { scene: h.value(), shapes }
}

/// Of a mesh without its texture coordinates.
fn geometry(mesh: &MeshDescription) -> u64 {
    let mut h = Fnv::default();
    // The lengths first: what follows can be read in one way alone.
    for length in [mesh.positions.len(), mesh.normals.len(), mesh.triangles.len()] {
        h.bytes(&(length as u64).to_le_bytes());
    }
    for v in mesh.positions.iter().chain(&mesh.normals) {
        h.triple(v.map(f32::to_bits));
    }
    for t in &mesh.triangles {
        h.triple(*t);
    }
    h.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same numbers one after the other, three of them as normals or as triangles.
    #[test]
    fn meshes_of_the_same_bytes_differ() {
        let mesh = |normals: usize, triangles: usize| MeshDescription {
            name: String::new(),
            positions: vec![[0.0; 3]; 3],
            normals: vec![[0.0; 3]; normals],
            triangles: vec![[0; 3]; triangles],
            texture_coordinates: vec![],
        };
        assert_ne!(geometry(&mesh(3, 1)), geometry(&mesh(0, 4)));
    }

    /// By FNV's product, two that share a corner and differ in the order of their sides had the same.
    #[test]
    fn faces_of_a_box_differ() {
        let sides = [0.2f32, 2.5, 2.5];
        let add = |mut p: [f32; 3], axis: usize| {
            p[axis] += sides[axis];
            p
        };
        let mut seen = std::collections::BTreeSet::new();
        for (corner, a, b) in (0..8).flat_map(|corner| (0..9).map(move |ab| (corner, ab / 3, ab % 3))) {
            let low = [-0.1f32, -1.25, -1.25];
            let from = (0..3).filter(|axis| corner >> axis & 1 == 1).fold(low, add);
            let mesh = MeshDescription {
                name: String::new(),
                positions: vec![from, add(from, a), add(add(from, a), b), add(from, b)],
                normals: vec![],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                texture_coordinates: vec![],
            };
            assert!(seen.insert(geometry(&mesh)), "{:?}", mesh.positions);
        }
    }
}
