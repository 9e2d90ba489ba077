//! A hash that is the same on every machine and for every compiler.

use super::mix;
use std::fmt::Write;

/// After FNV-1a, 64 bits (Fowler, Noll, Vo 1991): stable by definition, unlike the standard library's.
#[derive(Clone, Copy, Debug)]
pub struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    /// Byte by byte.
    pub fn bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.step(b.into()));
    }

    #[inline]
    fn step(&mut self, x: u64) {
        self.0 = (self.0 ^ x).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// Three numbers at once, for speed, and with all bits spread over all others: by FNV's product, squares that differ in
    /// signs had equal sums.
    #[inline]
    pub fn triple(&mut self, [a, b, c]: [u32; 3]) {
        for x in [u64::from(a) | u64::from(b) << 32, u64::from(c)] {
            self.0 = mix(self.0 ^ x).wrapping_add(1);
        }
    }

    /// Of all so far.
    pub fn value(&self) -> u64 {
        self.0
    }
}

impl Write for Fnv {
    fn write_str(&mut self, s: &str) -> std::fmt::Result {
        self.bytes(s.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
