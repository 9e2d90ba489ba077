//! Whether triangles are closed, and what they face.

use glam::DVec3;

/// What a set of triangles encloses, as far as sums tell: of cracks and missing ends see [`is_sealed`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enclosure {
    /// It is open: its area vectors do not sum to 0.
    Open,
    /// Fronts and backs face as much: a sheet that lies on itself, or nothing at all.
    Nothing,
    /// Fronts face away from what is within.
    Outward,
    /// Fronts face toward what is within.
    Inward,
}

impl Enclosure {
    /// By the sum of the area vectors, which is 0 of what is closed, and the sign of the volume (Gauss).
    pub fn of(triangles: &[[u32; 3]], position: impl Fn(u32) -> DVec3) -> Enclosure {
        let origin = triangles.first().map_or(DVec3::ZERO, |t| position(t[0]));
        let (mut area, mut sum, mut volume) = (0.0, DVec3::ZERO, 0.0);
        for triangle in triangles {
            let [p0, p1, p2] = triangle.map(|i| position(i) - origin);
            let m = 0.5 * (p1 - p0).cross(p2 - p0);
            (area, sum, volume) = (area + m.length(), sum + m, volume + p0.dot(m) / 3.0);
        }
        // An open sheet has a sum as large as its area; a pane of a thousandth of its width has a volume of 4e-4.
        let (open, least) = (sum.length() > 1e-4 * area, 1e-6 * area.powf(1.5));
        match volume {
            _ if open => Enclosure::Open,
            v if v > least => Enclosure::Outward,
            v if v < -least => Enclosure::Inward,
            _ => Enclosure::Nothing,
        }
    }

    /// Whether there is an inside.
    pub fn is_body(self) -> bool {
        matches!(self, Enclosure::Outward | Enclosure::Inward)
    }
}

/// Whether each edge of a triangle is one of another, the other way round: a tube without ends, whose area vectors sum to 0,
/// too, is not sealed. By positions, as vertices of a seam stand twice; by sums of hashes, which are 0 by chance once in 2^64.
pub fn is_sealed(triangles: &[[u32; 3]], position: impl Fn(u32) -> DVec3) -> bool {
    // Adding zero turns -0 into 0. The finalizer of MurmurHash3 (Appleby 2011).
    let mix = |h: u64| {
        let h = (h ^ (h >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        let h = (h ^ (h >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        h ^ (h >> 33)
    };
    let hash =
        |i: u32| position(i).to_array().into_iter().fold(1, |h: u64, x| mix(h.rotate_left(7) ^ (x + 0.0).to_bits()));
    let edge = |from: u64, to: u64| mix(from.rotate_left(1) ^ to.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut sum = 0u64;
    for triangle in triangles {
        let [a, b, c] = triangle.map(hash);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            sum = sum.wrapping_add(edge(from, to)).wrapping_sub(edge(to, from));
        }
    }
    sum == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_turned_and_cut() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * 1e-3 + DVec3::splat(1e3));
        let outward = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let inward = outward.map(|[a, b, c]| [a, c, b]);
        let of = |triangles: &[[u32; 3]]| Enclosure::of(triangles, |i| corners[i as usize]);
        assert_eq!((of(&outward), of(&inward)), (Enclosure::Outward, Enclosure::Inward));
        assert_eq!(of(&outward[..3]), Enclosure::Open);
        assert_eq!((of(&[[0, 1, 2], [0, 2, 1]]), of(&[])), (Enclosure::Nothing, Enclosure::Nothing));
        let sealed = |triangles: &[[u32; 3]]| is_sealed(triangles, |i| corners[i as usize]);
        assert!(sealed(&outward) && sealed(&inward) && sealed(&[[0, 1, 2], [0, 2, 1]]) && !sealed(&outward[..3]));
        // One of them the wrong way round.
        assert!(!sealed(&[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 3, 2]]));
    }

    /// Four walls without floor and roof, whose corners stand twice: sums alone do not tell.
    #[test]
    fn walls_are_no_body() {
        let corner = |i: u32| {
            let (x, z) = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][((i / 2 + i % 2) % 4) as usize];
            DVec3::new(x, if i < 8 { 0.0 } else { 1.0 }, z)
        };
        // Wall i from corner i to i + 1, its own vertices 2 i and 2 i + 1, and these 8 later above.
        let wall = |i: u32| [[2 * i, 2 * i + 8, 2 * i + 1], [2 * i + 1, 2 * i + 8, 2 * i + 9]];
        let mut triangles: Vec<[u32; 3]> = (0..4).flat_map(wall).collect();
        assert!(Enclosure::of(&triangles, corner).is_body() && !is_sealed(&triangles, corner));
        // Floor and roof.
        triangles.extend([[0, 2, 4], [0, 4, 6], [8, 12, 10], [8, 14, 12]]);
        assert!(Enclosure::of(&triangles, corner).is_body() && is_sealed(&triangles, corner));
    }
}
