//! Snell's law and Fresnel's formulae in f64, and what one passage through an interface carries.

use crate::geometry::Differential;
use glam::DVec3;

/// Indices that differ by less than this share count as equal: nothing is reflected.
const EQUAL_INDICES: f64 = 1e-8;

/// Square of the refracted ray's cosine; not positive for total reflection. The indices' difference is
/// taken as a factor, so that nothing cancels between nearly equal media.
#[inline]
pub(super) fn cosine_squared(n_i: f64, n_o: f64, cos_i: f64) -> f64 {
    let e = n_i / n_o * cos_i;
    (n_o - n_i) * (n_o + n_i) / (n_o * n_o) + e * e
}

/// Direction of travel `d` refracted at a surface of unit normal `n` (either side); `None` for total
/// reflection.
#[inline]
pub(super) fn refract(d: DVec3, n: DVec3, n_i: f64, n_o: f64) -> Option<DVec3> {
    if n_i == n_o {
        return Some(d);
    }
    let along = d.dot(n);
    let squared = cosine_squared(n_i, n_o, along);
    if !(squared > 0.0) {
        return None;
    }
    let e = n_i / n_o;
    // The normal turned along the ray: d' = e d + (c_o - e c_i) n.
    Some((d * e + n * (squared.sqrt().copysign(along) - e * along)).normalize())
}

/// Reflectance of unpolarised light from the cosines of Snell's law on both sides, the same whichever
/// side comes first (the form of [`crate::scatter::fresnel::reflectance`], in f64).
#[inline]
pub(super) fn reflectance(n_a: f64, cos_a: f64, n_b: f64, cos_b: f64) -> f64 {
    let (n_1, c_1, n_2, c_2) = if n_a <= n_b { (n_a, cos_a, n_b, cos_b) } else { (n_b, cos_b, n_a, cos_a) };
    if n_2 - n_1 <= EQUAL_INDICES * n_2 {
        return 0.0;
    }
    let difference = (n_2 - n_1) * (n_2 + n_1);
    let ratio = n_1 / n_2;
    let sin2 = (1.0 - c_1) * (1.0 + c_1);
    let s = n_1 * c_1 + n_2 * c_2;
    let p = n_2 * c_1 + n_1 * c_2;
    let r_s = difference / (s * s);
    let r_p = difference * (1.0 - sin2 * (1.0 + ratio * ratio)) / (p * p);
    (0.5 * (r_s * r_s + r_p * r_p)).min(1.0)
}

/// A passage through an interface: the direction of travel before and after, and the cosines.
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// Cosines of the direction of travel before, with `ng` and `ns`.
    before: [f64; 2],
    /// The same after.
    after: [f64; 2],
    n_i: f64,
    n_o: f64,
}

impl Passage {
    /// From the medium `n_i`, travelling along `before`, into `n_o`, travelling along `after`.
    #[inline]
    pub fn new(at: &Differential, before: DVec3, after: DVec3, n_i: f64, n_o: f64) -> Passage {
        let cosines = |d: DVec3| [d.dot(at.ng), d.dot(at.ns)];
        Passage { before: cosines(before), after: cosines(after), n_i, n_o }
    }

    /// Whether the path really crosses the interface, by the geometric and by the shading normal, from
    /// the front to the back if `inward`, else the other way.
    #[inline]
    pub fn crosses(&self, inward: bool) -> bool {
        let sign = if inward { -1.0 } else { 1.0 };
        [self.before, self.after].as_flattened().iter().all(|c| sign * c > 0.0)
    }

    /// The share that is not reflected, 0 for total reflection.
    #[inline]
    pub fn transmittance(&self) -> f64 {
        let cos_i = self.before[1].abs();
        let squared = cosine_squared(self.n_i, self.n_o, cos_i);
        if squared > 0.0 { 1.0 - reflectance(self.n_i, cos_i, self.n_o, squared.sqrt().min(1.0)) } else { 0.0 }
    }

    /// The factor by which shading normals break the conservation of étendue:
    /// `cos^g_after cos^s_before / (cos^g_before cos^s_after)`, the reciprocal of Veach's adjoint factor
    /// (1997, §5.3) for the way from `b` to `a`. 1 where both normals agree.
    #[inline]
    pub fn kappa(&self) -> f64 {
        (self.after[0] * self.before[1] / (self.before[0] * self.after[1])).abs()
    }
}
