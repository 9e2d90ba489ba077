//! Maps from the unit square to directions and points, each with its density.
//! Densities are per unit solid angle (suffix `_w`) or per unit area (suffix `_a`).

use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Uniform point on the unit disk (Shirley and Chiu 1997). Density `1/pi` per area.
#[inline]
pub fn disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (r, theta) =
        if p.x.abs() > p.y.abs() { (p.x, PI / 4.0 * (p.y / p.x)) } else { (p.y, PI / 2.0 - PI / 4.0 * (p.x / p.y)) };
    let (sin, cos) = theta.sin_cos();
    Vec2::new(r * cos, r * sin)
}

/// Direction about +z with density [`cosine_hemisphere_pdf_w`].
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// `cos/pi` above the horizon, else 0.
#[inline]
pub fn cosine_hemisphere_pdf_w(cos: f32) -> f32 {
    cos.max(0.0) / PI
}

/// Uniform direction, density `1/(4 pi)`.
#[inline]
pub fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Uniform direction about +z within a cone of half-angle `theta`, given `one_minus_cos` =
/// `1 - cos(theta)`: that difference, not the cosine, so that a narrow cone keeps its digits.
#[inline]
pub fn cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    let h = u.x * one_minus_cos;
    let r = (h * (2.0 - h)).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, 1.0 - h)
}

/// Uniform barycentrics `(u, v)` of the second and third vertex (Heitz 2019, "A low-distortion map
/// between triangle and square"). Density `1/area`.
#[inline]
pub fn triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let b = u.x / 2.0;
        Vec2::new(b, u.y - b)
    } else {
        let b = u.y / 2.0;
        Vec2::new(u.x - b, b)
    }
}
