//! Analytic spheres.

use super::surface::{ROUNDOFF, position_error};
use super::{Ray, SurfacePoint};
use glam::{DVec3, Vec3};

/// A sphere in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, positive.
    pub radius: f32,
}

impl Sphere {
    /// Both parameters, in order, at which the line of `ray` crosses the sphere.
    ///
    /// In f64, with the discriminant from the distance between line and centre and the smaller root
    /// from the product of both, so that neither distance nor a start on the sphere costs digits
    /// (Haines et al. 2019, "Precision improvements for ray/sphere intersection").
    #[inline]
    pub fn crossings(&self, ray: &Ray) -> Option<(f64, f64)> {
        let d = ray.direction.as_dvec3();
        let f = ray.origin.as_dvec3() - self.center.as_dvec3();
        let r2 = (self.radius as f64).powi(2);
        let a = d.length_squared();
        let b = f.dot(d);
        let h2 = r2 - (f - d * (b / a)).length_squared();
        if h2 < 0.0 || h2.is_nan() {
            return None;
        }
        let q = -(b + (a * h2).sqrt().copysign(b));
        if q == 0.0 {
            // The line touches the sphere at the ray's origin.
            return Some((0.0, 0.0));
        }
        let (t0, t1) = (q / a, (f.length_squared() - r2) / q);
        Some((t0.min(t1), t0.max(t1)))
    }

    /// The first crossing with `0 < t <= ray.t_max`.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<f32> {
        let (near, far) = self.crossings(ray)?;
        let t = if near > 0.0 { near } else { far };
        (t > 0.0 && t <= ray.t_max as f64).then_some(t as f32)
    }

    /// The surface where `ray` meets the sphere near parameter `t`. The crossing is computed anew in
    /// f64, so that a rounded `t` does not move the point along the sphere; the caller fills in `shape`.
    #[inline]
    pub fn surface(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let near = |x: f64| (x - t as f64).abs();
        let t = match self.crossings(ray) {
            Some((t0, t1)) if near(t0) <= near(t1) => t0,
            Some((_, t1)) => t1,
            None => t as f64,
        };
        let hit = ray.origin.as_dvec3() + ray.direction.as_dvec3() * t;
        self.at((hit - self.center.as_dvec3()).try_normalize().unwrap_or(DVec3::Z))
    }

    /// Bound on how far from the true sphere f32 rounding puts a point of it; the rest is left to the
    /// intersection test.
    #[inline]
    pub fn rounding(&self) -> f32 {
        8.0 * f32::EPSILON * (self.center.abs().max_element() + self.radius)
    }

    /// The surface at a unit direction from the centre; the caller fills in `shape`.
    #[inline]
    pub fn at(&self, n: DVec3) -> SurfacePoint {
        let p = (self.center.as_dvec3() + n * self.radius as f64).as_vec3();
        let ng = n.as_vec3();
        // The test works in f64; what is left beside the position's rounding is that of `t`, which a
        // backend stores in f32.
        SurfacePoint {
            p,
            ng,
            ns: ng,
            offset: position_error(p, ng) + 4.0 * ROUNDOFF * self.radius,
            offset_per_length: 4.0 * ROUNDOFF,
            shape: 0,
            primitive: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_are_those_of_the_closed_form() {
        let sphere = Sphere { center: Vec3::new(0.0, 0.0, 5.0), radius: 1.0 };
        let ray = |o: Vec3, d: Vec3| Ray { origin: o, direction: d, t_max: f32::INFINITY };
        assert_eq!(sphere.crossings(&ray(Vec3::ZERO, Vec3::Z)), Some((4.0, 6.0)));
        assert_eq!(sphere.crossings(&ray(Vec3::ZERO, Vec3::Z * 2.0)), Some((2.0, 3.0)));
        assert_eq!(sphere.intersect(&ray(sphere.center, Vec3::X * 0.5)), Some(2.0));
        assert_eq!(sphere.intersect(&ray(Vec3::Z * 10.0, Vec3::Z)), None);
        assert_eq!(sphere.crossings(&ray(Vec3::X * 1.5, Vec3::Z)), None);
        // From 10^4 radii away, at 0.999 of the radius: f32 arithmetic is wrong in the second digit.
        let far = ray(Vec3::new(0.999, 0.0, -9_995.0), Vec3::Z);
        let half = (1.0 - (0.999f32 as f64).powi(2)).sqrt();
        let (t0, t1) = sphere.crossings(&far).unwrap();
        assert!((t0 - (10_000.0 - half)).abs() < 1e-9 && (t1 - (10_000.0 + half)).abs() < 1e-9);
    }

    #[test]
    fn the_surface_point_does_not_follow_an_error_in_t() {
        let sphere = Sphere { center: Vec3::new(1.0, 2.0, 3.0), radius: 0.5 };
        let ray = Ray { origin: Vec3::new(1.2, 2.0, -7.0), direction: Vec3::Z, t_max: f32::INFINITY };
        let t = sphere.intersect(&ray).unwrap();
        let (a, b) = (sphere.surface(&ray, t), sphere.surface(&ray, t + 1e-3));
        assert_eq!(a.p, b.p);
        assert!(a.ng.z < 0.0 && (a.p - sphere.center).length() - 0.5 < 1e-6);
    }
}
