//! Whether triangles are closed, and what they face.

use glam::DVec3;

/// What a set of triangles encloses, as far as sums tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enclosure {
    /// It is open: its area vectors do not sum to 0.
    Open,
    /// Closed, and fronts and backs face as much: a sheet that lies on itself, or nothing at all.
    Nothing,
    /// Closed, with its fronts outside.
    Outward,
    /// Closed, with its fronts toward what it encloses.
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
    }
}
