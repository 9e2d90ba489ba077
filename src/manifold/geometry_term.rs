//! The generalised geometry term by ray differentials (Igehy 1999).
//!
//! Two directions perpendicular to the one that leaves `a` are carried along the chain. The area they
//! span at `b` is the reciprocal of `J = d omega_a / d A_b`. Nothing divides by what vanishes at a
//! caustic, where the reciprocal is a clean zero; and nothing is lost on a thin shell or at an inner
//! focal point, where the block system of the constraints is ill conditioned.

use super::refraction::cosine_squared;
use crate::geometry::Differential;
use crate::geometry::differential::tangents;
use crate::math::difference_of_products;
use glam::DVec3;

/// A ray with its derivatives with respect to two orthonormal changes of its first direction.
#[derive(Clone, Copy, Debug)]
pub struct RayDifferential {
    /// Unit direction of travel.
    direction: DVec3,
    /// Derivatives of the position, on the surface last met.
    position_d: [DVec3; 2],
    /// Derivatives of the direction.
    direction_d: [DVec3; 2],
}

impl RayDifferential {
    /// A ray that leaves a fixed point along a unit direction.
    #[inline]
    pub fn leaving(direction: DVec3) -> RayDifferential {
        let (u, v) = tangents(direction);
        RayDifferential { direction, position_d: [DVec3::ZERO; 2], direction_d: [u, v] }
    }

    /// Unit direction of travel.
    #[inline]
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// Travels the distance `t` to a surface of geometric normal `ng`.
    #[inline]
    pub fn transfer(&mut self, t: f64, ng: DVec3) {
        let along = 1.0 / self.direction.dot(ng);
        for k in 0..2 {
            let q = self.position_d[k] + self.direction_d[k] * t;
            self.position_d[k] = q - self.direction * (q.dot(ng) * along);
        }
    }

    /// Refracts at the surface last met; false for total reflection.
    #[inline]
    pub fn refract(&mut self, at: &Differential, n_i: f64, n_o: f64) -> bool {
        let d = self.direction;
        let sign = if d.dot(at.ns) > 0.0 { -1.0 } else { 1.0 };
        let n = at.ns * sign;
        let e = n_i / n_o;
        let cos_i = -d.dot(n);
        let squared = cosine_squared(n_i, n_o, cos_i);
        if !(squared > 0.0) {
            return false;
        }
        let cos_o = squared.sqrt();
        let bend = e * cos_i - cos_o;
        for k in 0..2 {
            let dn = self.normal_d(at, k) * sign;
            let dcos_i = -(self.direction_d[k].dot(n) + d.dot(dn));
            let dcos_o = e * e * cos_i * dcos_i / cos_o;
            self.direction_d[k] = self.direction_d[k] * e + n * (e * dcos_i - dcos_o) + dn * bend;
        }
        self.direction = (d * e + n * bend).normalize();
        true
    }

    /// Derivatives of the position, on the surface last met, and of the direction, with respect to change `k`.
    #[inline]
    pub(super) fn derivatives(&self, k: usize) -> (DVec3, DVec3) {
        (self.position_d[k], self.direction_d[k])
    }

    /// The same of the shading normal of the surface last met.
    #[inline]
    pub(super) fn normal_d(&self, at: &Differential, k: usize) -> DVec3 {
        at.n_u * self.position_d[k].dot(at.p_u) + at.n_v * self.position_d[k].dot(at.p_v)
    }

    /// Area perpendicular to the ray, per solid angle at `a`, after a further distance `t`: the
    /// reciprocal of `J` for a surface that faces the ray. For one of geometric cosine `cos_b`,
    /// `J = cos_b / area`.
    #[inline]
    pub fn area(&self, t: f64) -> f64 {
        let q = |k: usize| self.position_d[k] + self.direction_d[k] * t;
        self.spanned(q(0), q(1))
    }

    /// Solid angle of the final direction per solid angle at `a`: the reciprocal of
    /// `J_dir = d omega_a / d omega_b`, for an end infinitely far away.
    #[inline]
    pub fn solid_angle(&self) -> f64 {
        self.spanned(self.direction_d[0], self.direction_d[1])
    }

    /// `|w . (x cross y)|`: the components along the ray drop out.
    #[inline]
    fn spanned(&self, x: DVec3, y: DVec3) -> f64 {
        let cross = DVec3::new(
            difference_of_products(x.y, y.z, x.z, y.y),
            difference_of_products(x.z, y.x, x.x, y.z),
            difference_of_products(x.x, y.y, x.y, y.x),
        );
        self.direction.dot(cross).abs()
    }
}
