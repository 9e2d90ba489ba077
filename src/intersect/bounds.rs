//! Boxes around primitives.

use crate::geometry::Sphere;
use glam::Vec3;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) lo: Vec3,
    pub(crate) hi: Vec3,
}

impl Bounds {
    pub(crate) const EMPTY: Bounds = Bounds { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// Rounded outward: centre plus radius is not a number of f32 in general.
    pub(crate) fn of_sphere(sphere: &Sphere) -> Bounds {
        let (c, r) = (sphere.center, Vec3::splat(sphere.radius));
        // Three roundings of half an ulp, each of at most this sum.
        let margin = (c.abs() + r) * (2.0 * f32::EPSILON);
        Bounds { lo: c - r - margin, hi: c + r + margin }
    }

    pub(crate) fn of_triangle([a, b, c]: [Vec3; 3]) -> Bounds {
        Bounds { lo: a.min(b).min(c), hi: a.max(b).max(c) }
    }

    pub(crate) fn union(self, other: Bounds) -> Bounds {
        Bounds { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }
}
