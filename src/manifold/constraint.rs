//! Snell's law as two equations per vertex, and their derivatives.
//!
//! The generalised half vector `h0 = -(n_i w_i + n_o w_o)` of unit directions `w` that leave the vertex
//! is parallel to the shading normal where the law holds; the equations are its components along two
//! unit tangents `s`, `t` of the shading normal. A reflection-like root, both directions on one side,
//! obeys them as well; the walk's last checks sort it out.

use super::geometry_term::RayDifferential;
use crate::geometry::Differential;
use glam::DVec3;

/// How the half vector is normalised. Same roots, other basins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// `h = h0`: the gradient of the optical path length; well conditioned between nearly equal media.
    Unnormalised,
    /// `h = h0/|h0|` (Jakob and Marschner 2012): the larger basins.
    HalfVector,
}

impl Form {
    /// Below this difference of the indices [`Form::HalfVector`] would amplify rounding by its reciprocal.
    const NEARLY_EQUAL: f64 = 1e-3;

    /// The form to use between two media.
    #[inline]
    pub(super) fn between(n_i: f64, n_o: f64) -> Form {
        if (n_i - n_o).abs() < Form::NEARLY_EQUAL { Form::Unnormalised } else { Form::HalfVector }
    }
}

/// A 2x2 block, row by row: `[equation][tangent]`.
pub(super) type Block = [[f64; 2]; 2];

/// A vertex with its two segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint<'a> {
    /// The surface.
    pub(super) at: &'a Differential,
    /// Unit direction toward `a`, and the reciprocal of the distance to the previous vertex.
    pub(super) w_i: DVec3,
    /// Reciprocal of that distance.
    pub(super) inverse_r_i: f64,
    /// Unit direction toward `b`.
    pub(super) w_o: DVec3,
    /// Reciprocal of the distance to the next vertex; 0 if that is infinitely far.
    pub(super) inverse_r_o: f64,
    /// Refractive index on the side of `w_i`.
    pub(super) n_i: f64,
    /// Refractive index on the side of `w_o`.
    pub(super) n_o: f64,
}

impl Joint<'_> {
    /// The generalised half vector.
    #[inline]
    fn half_vector(&self) -> DVec3 {
        -(self.w_i * self.n_i + self.w_o * self.n_o)
    }

    /// The unnormalised residual over the mean index: an angle in radians, without regard to scale.
    #[inline]
    pub(super) fn residual(&self) -> f64 {
        perpendicular(self.at.ns, self.half_vector()).length() / (0.5 * (self.n_i + self.n_o))
    }
}

/// `P(w) v`, the part of `v` perpendicular to `w`.
#[inline]
fn perpendicular(w: DVec3, v: DVec3) -> DVec3 {
    v - w * w.dot(v)
}

/// A joint with what its equations and all their derivatives share.
pub(super) struct Constraint<'a> {
    joint: Joint<'a>,
    form: Form,
    s: DVec3,
    t: DVec3,
    h: DVec3,
    /// `1/|s0|` of `s = s0/|s0|`.
    inverse_s0: f64,
    /// `|h0|`.
    length: f64,
}

impl<'a> Constraint<'a> {
    #[inline]
    pub(super) fn new(joint: Joint<'a>, form: Form) -> Constraint<'a> {
        let n = joint.at.ns;
        let s0 = perpendicular(n, joint.at.p_u);
        let inverse_s0 = 1.0 / s0.length();
        let s = s0 * inverse_s0;
        let h0 = joint.half_vector();
        let length = h0.length();
        let h = match form {
            Form::Unnormalised => h0,
            Form::HalfVector => h0 / length,
        };
        Constraint { joint, form, s, t: n.cross(s), h, inverse_s0, length }
    }

    /// The two equations' left-hand sides.
    #[inline]
    pub(super) fn value(&self) -> [f64; 2] {
        [self.s.dot(self.h), self.t.dot(self.h)]
    }

    /// Derivative of `h` from that of `h0`.
    #[inline]
    fn normalised(&self, dh0: DVec3) -> DVec3 {
        match self.form {
            Form::Unnormalised => dh0,
            Form::HalfVector => perpendicular(self.h, dh0) / self.length,
        }
    }

    #[inline]
    fn neighbour(&self, w: DVec3, scale: f64, tangents: [DVec3; 2]) -> Block {
        let [x, y] = tangents.map(|p| self.normalised(perpendicular(w, p) * -scale));
        [[self.s.dot(x), self.s.dot(y)], [self.t.dot(x), self.t.dot(y)]]
    }

    /// Derivative when the previous vertex moves along its tangents.
    #[inline]
    pub(super) fn previous(&self, tangents: [DVec3; 2]) -> Block {
        self.neighbour(self.joint.w_i, self.joint.n_i * self.joint.inverse_r_i, tangents)
    }

    /// Derivative when the next vertex moves along its tangents.
    #[inline]
    pub(super) fn next(&self, tangents: [DVec3; 2]) -> Block {
        self.neighbour(self.joint.w_o, self.joint.n_o * self.joint.inverse_r_o, tangents)
    }

    /// Derivative when `w_o` itself moves along two tangents of the unit sphere.
    #[cfg(test)]
    pub(super) fn direction(&self, tangents: [DVec3; 2]) -> Block {
        let [x, y] = tangents.map(|p| self.normalised(p * -self.joint.n_o));
        [[self.s.dot(x), self.s.dot(y)], [self.t.dot(x), self.t.dot(y)]]
    }

    /// Derivative when the vertex itself moves along its tangents: the directions turn, and so do the
    /// normal and with it `s` and `t`.
    #[inline]
    pub(super) fn own(&self) -> Block {
        let Joint { at, w_i, inverse_r_i, .. } = self.joint;
        let column = |p: DVec3, dn: DVec3| self.column(p, dn, perpendicular(w_i, p) * -inverse_r_i);
        let (u, v) = (column(at.p_u, at.n_u), column(at.p_v, at.n_v));
        [[u[0], v[0]], [u[1], v[1]]]
    }

    /// Derivative when the vertex moves by `p`, its normal turns by `dn`, and `w_i` by `dw_i`.
    #[inline]
    fn column(&self, p: DVec3, dn: DVec3, dw_i: DVec3) -> [f64; 2] {
        let Joint { at, w_o, inverse_r_o, n_i, n_o, .. } = self.joint;
        let dh = self.normalised(perpendicular(w_o, p) * (n_o * inverse_r_o) - dw_i * n_i);
        let ds0 = -(at.ns * at.p_u.dot(dn) + dn * at.p_u.dot(at.ns));
        let ds = perpendicular(self.s, ds0) * self.inverse_s0;
        let dt = dn.cross(self.s) + at.ns.cross(ds);
        [self.s.dot(dh) + self.h.dot(ds), self.t.dot(dh) + self.h.dot(dt)]
    }

    /// Derivative with respect to the two changes of a ray's first direction, the ray having arrived here:
    /// all equations of the vertices before hold by construction and stay so.
    #[inline]
    pub(super) fn along(&self, ray: &RayDifferential) -> Block {
        let column = |k: usize| {
            let (p, direction) = ray.derivatives(k);
            self.column(p, ray.normal_d(self.joint.at, k), -direction)
        };
        let (u, v) = (column(0), column(1));
        [[u[0], v[0]], [u[1], v[1]]]
    }
}
