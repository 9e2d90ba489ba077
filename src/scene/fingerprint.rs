//! A hash of a description that is the same on every machine and for every compiler.

use super::description::*;
use std::fmt::Write;

/// After FNV-1a, 64 bits (Fowler, Noll, Vo 1991): stable by definition, unlike the standard library's.
struct Fnv(u64);

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.step(b.into()));
    }

    #[inline]
    fn step(&mut self, x: u64) {
        self.0 = (self.0 ^ x).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// Three numbers at once, for speed: the upper half of the sum is folded into the lower, where a product alone would
    /// not carry it.
    #[inline]
    fn triple(&mut self, [a, b, c]: [u32; 3]) {
        for x in [u64::from(a) | u64::from(b) << 32, u64::from(c)] {
            self.step(x);
            self.0 ^= self.0 >> 32;
        }
    }
}

impl Write for Fnv {
    fn write_str(&mut self, s: &str) -> std::fmt::Result {
        self.bytes(s.as_bytes());
        Ok(())
    }
}

/// Hashes of a description.
pub(super) struct Fingerprint {
    /// Of everything that can change an image of the scene. Names do not.
    pub(super) scene: u64,
    /// Of what is where, whatever it is made of.
    pub(super) shapes: u64,
}

pub(super) fn fingerprint(d: &Description) -> Fingerprint {
    let mut h = Fnv(0xcbf2_9ce4_8422_2325);
    for mesh in &d.meshes {
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
    }
    // Debug formatting of numbers is exact (shortest round-trip), and writing to a hash cannot fail.
    let mut shapes = Fnv(h.0);
    for i in &d.instances {
        let _ = write!(shapes, "{:?}{:?}", i.geometry, i.transform);
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
        let _ = write!(h, "{:?}{:?}", c.transform, c.projection);
    }
    let Environment { radiance, image, rotation } = &d.environment;
    let _ = write!(h, "{radiance:?}");
    if let Some(image) = image {
        let _ = write!(h, "{:?}{rotation:?}", image.hash());
    }
    Fingerprint { scene: h.0, shapes: shapes.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// The same numbers one after the other, three of them as normals or as triangles.
    #[test]
    fn meshes_of_the_same_bytes_differ() {
        let mesh = |normals: usize, triangles: usize| MeshDescription {
            name: String::new(),
            positions: vec![[0.0; 3]; 3],
            normals: vec![[0.0; 3]; normals],
            triangles: vec![[0; 3]; triangles],
        };
        let hash = |mesh| fingerprint(&Description { meshes: vec![Arc::new(mesh)], ..Description::default() }).shapes;
        assert_ne!(hash(mesh(3, 1)), hash(mesh(0, 4)));
    }

    /// Each bit of each number counts, also where several change.
    #[test]
    fn each_bit_of_a_vertex_counts() {
        let hash = |bits: [u32; 3]| {
            let mut h = Fnv(1);
            h.triple(bits);
            h.triple([0; 3]);
            h.0
        };
        let mut seen = std::collections::BTreeSet::from([hash([0; 3])]);
        for (i, j) in (0..96).flat_map(|i| (i..96).map(move |j| (i, j))) {
            let mut bits = [0; 3];
            bits[i / 32] |= 1 << (i % 32);
            bits[j / 32] |= 1 << (j % 32);
            assert!(seen.insert(hash(bits)), "{i}, {j}");
        }
    }
}
