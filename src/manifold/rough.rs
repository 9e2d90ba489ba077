//! Rough interfaces in a chain: a microfacet normal is drawn for each before the walk, at a fixed offset
//! from the surface's normal, and the walk refracts at it (Hanika, Droske and Fascione 2015, §5).
//!
//! An offset needs a frame that follows the surface smoothly. Here the normal `n0` of the straight
//! segment's crossing is turned by the smallest rotation into the normal at hand, and the microfacet
//! normal with it: no seam between triangles, no pole but `-n0`. The rotation depends on the ends alone,
//! which are fixed while densities change variables from offsets to positions.
//!
//! **Measures.** Offsets are drawn from `D(h) |n.h|`, per solid angle. The path's densities are taken
//! relative to it, so that `D` cancels: what is left of a BSDF's density by visible normals is
//! `(1 - F) G1(w) |w.h| / (|w.n| |n.h|)`, and of its value times the cosine that times the other `G1`
//! (Walter et al. 2007, eq. 41, with the Jacobian taken into `J` at fixed offsets).

use crate::geometry::Differential;
use crate::geometry::differential::tangents;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A microfacet normal that follows its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// Unit normal of the surface at the seed's crossing.
    reference: DVec3,
    /// Unit normal of the microfacet there.
    microfacet: DVec3,
    /// Width of the distribution (GGX).
    alpha: f64,
}

/// `v` turned by the smallest rotation that takes `from` into `to`.
#[inline]
fn turned(from: DVec3, to: DVec3, v: DVec3) -> DVec3 {
    let k = from + to;
    v - k * (k.dot(v) / (1.0 + from.dot(to))) + to * (2.0 * from.dot(v))
}

impl Tilt {
    /// Draws one for a surface of unit normal `n`: density `D(h) |n.h|` per solid angle, GGX of width
    /// `alpha`.
    #[inline]
    pub fn sample(n: DVec3, alpha: f64, u: DVec2) -> Tilt {
        let cos2 = (1.0 - u.x) / (1.0 + (alpha * alpha - 1.0) * u.x);
        let (sin, cos) = (TAU * u.y).sin_cos();
        let (s, t) = tangents(n);
        let across = (1.0 - cos2).max(0.0).sqrt();
        Tilt { reference: n, microfacet: (s * cos + t * sin) * across + n * cos2.sqrt(), alpha }
    }

    /// That of a microfacet of unit normal `h` at a point of unit normal `n`, for a seed whose crossing has
    /// the unit normal `reference`.
    #[inline]
    pub fn of(reference: DVec3, n: DVec3, h: DVec3, alpha: f64) -> Tilt {
        Tilt { reference, microfacet: turned(n, reference, h).normalize(), alpha }
    }

    /// The surface with the microfacet's normal, and that normal's derivatives, for its own.
    #[inline]
    pub fn applied(&self, at: &Differential) -> Differential {
        let (n, v) = (self.reference, self.microfacet);
        let k = n + at.ns;
        let inverse = 1.0 / (1.0 + n.dot(at.ns));
        let (along, twice) = (k.dot(v) * inverse, 2.0 * n.dot(v));
        let derivative = |dn: DVec3| dn * (twice - along) - k * ((dn.dot(v) - along * n.dot(dn)) * inverse);
        Differential {
            ns: (v - k * along + at.ns * twice).normalize(),
            n_u: derivative(at.n_u),
            n_v: derivative(at.n_v),
            ..*at
        }
    }

    /// What the passage `before` to `after` through a surface of unit normal `n` and a microfacet of unit
    /// normal `h` carries beside `1 - F`: its value, and the densities of scattering from `before` into
    /// `after` and the reverse way, over that of the offset. Zero for a microfacet seen from behind.
    #[inline]
    pub fn carried(&self, n: DVec3, h: DVec3, before: DVec3, after: DVec3) -> Carried {
        let (n_i, n_o) = (before.dot(n), after.dot(n));
        let (h_i, h_o) = (before.dot(h), after.dot(h));
        let nh = n.dot(h);
        if !(n_i * n_o > 0.0 && h_i * h_o > 0.0 && n_i * h_i > 0.0 && nh > 0.0) {
            return Carried { value: 0.0, density: [0.0; 2] };
        }
        // G1(w) / |w.n|, finite at the horizon.
        let a2 = self.alpha * self.alpha;
        let visible = |c: f64| 2.0 / (c.abs() + (c * c + a2 * (1.0 - c * c).max(0.0)).sqrt());
        let (v_i, v_o) = (visible(n_i), visible(n_o));
        let density = [v_i * h_i.abs() / nh, v_o * h_o.abs() / nh];
        Carried { value: density[0] * v_o * n_o.abs(), density }
    }
}

/// See [`Tilt::carried`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// `f cos / p(h)` without `1 - F` and without the scaling of radiance.
    pub value: f64,
    /// Densities over the offset's: of `after` given `before`, and the reverse.
    pub density: [f64; 2],
}
