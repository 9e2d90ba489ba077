//! A hash of a description that is the same on every machine and for every compiler.

use super::description::*;
use std::fmt::Write;

/// FNV-1a, 64 bits (Fowler, Noll, Vo 1991): stable by definition, unlike the standard library's.
struct Fnv(u64);

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        for &b in bytes {
            self.0 = (self.0 ^ b as u64).wrapping_mul(0x0000_0100_0000_01b3);
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
        for v in mesh.positions.iter().chain(&mesh.normals).flatten() {
            h.bytes(&v.to_bits().to_le_bytes());
        }
        for i in mesh.triangles.iter().flatten() {
            h.bytes(&i.to_le_bytes());
        }
        h.bytes(&(mesh.positions.len() as u64).to_le_bytes());
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
    let _ = write!(h, "{:?}", d.environment);
    Fingerprint { scene: h.0, shapes: shapes.0 }
}
