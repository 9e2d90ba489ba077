//! Two ray tracers on the same rays. They may differ only where rounding decides: for a ray that passes
//! an edge within a few roundoffs, or meets two surfaces at the same distance.

use super::{Hit, Intersector};
use crate::geometry::{Ray, Shape};
use glam::{DVec3, Vec3};
use std::fmt;

/// How the hits of two backends agree.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Rays traced through both.
    pub rays: u64,
    /// Rays with the same answer: both miss, or both hit the same primitive.
    pub same: u64,
    /// Both hit, but different primitives, at distances that differ: the nearer was missed by the other.
    pub different_primitive: u64,
    /// Both hit, but different primitives, at the same distance within [`SAME_DISTANCE`].
    pub tied: u64,
    /// One hits, the other does not.
    pub hit_miss: u64,
    /// Rays for which `occluded` of a backend contradicts its own `closest`.
    pub occluded_differs: u64,
    /// Over rays that differ and are not tied: how far the ray passes from the nearest edge of the
    /// disputed triangle (or from the rim of the sphere), in units of its longest edge (its radius).
    pub max_edge_distance: f64,
    /// The same, in units of `f32::EPSILON` times the distance of the farthest vertex from the origin
    /// of the ray: what one rounding of a vertex relative to the origin may move it.
    pub max_edge_roundings: f64,
    /// Over rays that hit the same primitive: largest difference of `t`, relative to `t`. It grows without
    /// bound for rays that start close to a surface or graze it; the next number does not.
    pub max_t_error: f64,
    /// Over the same rays: the distance along the normal between both hits, in units of the error that
    /// the surface claims for a ray of that length ([`crate::geometry::SurfacePoint::offset`]). Above 1,
    /// offsets are too small.
    pub max_claimed_error: f64,
    /// The rays that differ most, by `edge_roundings`, at most [`EXAMPLES`].
    pub worst: Vec<Difference>,
}

/// A ray on which the backends differ.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// The ray.
    pub ray: Ray,
    /// What the first backend says.
    pub a: Option<Hit>,
    /// What the second says.
    pub b: Option<Hit>,
    /// As in [`Comparison::max_edge_distance`].
    pub edge_distance: f64,
    /// As in [`Comparison::max_edge_roundings`].
    pub edge_roundings: f64,
}

/// Relative difference of `t` below which two hits lie at the same distance.
pub const SAME_DISTANCE: f64 = 16.0 * f32::EPSILON as f64;

/// Examples kept.
pub const EXAMPLES: usize = 8;

/// Traces `rays` through both backends, which were built over the same `shapes`.
pub fn compare(a: &dyn Intersector, b: &dyn Intersector, shapes: &[Shape], rays: &[Ray]) -> Comparison {
    let mut c = Comparison::default();
    for ray in rays {
        let (ha, hb) = (a.closest(ray), b.closest(ray));
        c.rays += 1;
        c.occluded_differs += u64::from(a.occluded(ray) != ha.is_some() || b.occluded(ray) != hb.is_some());
        let disputed = match (ha, hb) {
            (None, None) => None,
            (Some(x), Some(y)) if (x.shape, x.primitive) == (y.shape, y.primitive) => {
                c.max_t_error = c.max_t_error.max(gap(&x, &y));
                c.max_claimed_error = c.max_claimed_error.max(claimed(&shapes[x.shape as usize], ray, &x, &y));
                None
            }
            (Some(x), Some(y)) if gap(&x, &y) <= SAME_DISTANCE => {
                c.tied += 1;
                continue;
            }
            (Some(x), Some(y)) => {
                c.different_primitive += 1;
                Some(if x.t < y.t { x } else { y })
            }
            (Some(x), None) | (None, Some(x)) => {
                c.hit_miss += 1;
                Some(x)
            }
        };
        let Some(hit) = disputed else {
            c.same += 1;
            continue;
        };
        let (edge_distance, edge_roundings) = edge_distance(&shapes[hit.shape as usize], hit.primitive, ray);
        c.max_edge_distance = c.max_edge_distance.max(edge_distance);
        c.max_edge_roundings = c.max_edge_roundings.max(edge_roundings);
        c.keep(Difference { ray: *ray, a: ha, b: hb, edge_distance, edge_roundings });
    }
    c
}

impl Comparison {
    /// Rays with different answers, ties apart.
    pub fn different(&self) -> u64 {
        self.different_primitive + self.hit_miss
    }

    fn keep(&mut self, d: Difference) {
        let at = self.worst.partition_point(|w| w.edge_roundings >= d.edge_roundings);
        self.worst.insert(at, d);
        self.worst.truncate(EXAMPLES);
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = |n: u64| 1e6 * n as f64 / self.rays.max(1) as f64;
        writeln!(f, "{} rays, {} same", self.rays, self.same)?;
        writeln!(
            f,
            "  another primitive   {:>8}  ({:.1} per million)",
            self.different_primitive,
            part(self.different_primitive)
        )?;
        writeln!(f, "  hit against miss    {:>8}  ({:.1} per million)", self.hit_miss, part(self.hit_miss))?;
        writeln!(f, "  at equal distance   {:>8}  ({:.1} per million)", self.tied, part(self.tied))?;
        writeln!(f, "  occluded != closest {:>8}", self.occluded_differs)?;
        writeln!(
            f,
            "  these rays pass an edge within {:.2e} of the triangle's size, {:.2} roundings",
            self.max_edge_distance, self.max_edge_roundings
        )?;
        write!(
            f,
            "  elsewhere t differs by up to {:.2e} of t, {:.2} of the error allowed for in offsets",
            self.max_t_error, self.max_claimed_error
        )
    }
}

/// Difference of `t`, relative to the larger.
fn gap(x: &Hit, y: &Hit) -> f64 {
    let (x, y) = (x.t as f64, y.t as f64);
    if x == y { 0.0 } else { (x - y).abs() / x.max(y) }
}

fn claimed(shape: &Shape, ray: &Ray, x: &Hit, y: &Hit) -> f64 {
    let point = shape.surface(ray, x);
    let along = (x.t as f64 - y.t as f64).abs() * point.ng.as_dvec3().dot(ray.direction.as_dvec3()).abs();
    let length = x.t as f64 * ray.direction.as_dvec3().length();
    along / (point.offset as f64 + point.offset_per_length as f64 * length)
}

/// How far the line of a ray passes from the outline of a primitive as seen along the ray: in units of
/// its size, and of the rounding of its farthest vertex.
fn edge_distance(shape: &Shape, primitive: u32, ray: &Ray) -> (f64, f64) {
    let d = ray.direction.as_dvec3().normalize_or_zero();
    let across = |p: Vec3| {
        let v = p.as_dvec3() - ray.origin.as_dvec3();
        v - d * v.dot(d)
    };
    let far = |p: Vec3| (p.as_dvec3() - ray.origin.as_dvec3()).length();
    let (distance, size, reach) = match shape {
        Shape::Mesh(mesh) => {
            let [a, b, c] = mesh.corners(primitive);
            let [p, q, r] = [a, b, c].map(across);
            let distance = to_segment(p, q).min(to_segment(q, r)).min(to_segment(r, p));
            (distance, a.distance(b).max(b.distance(c)).max(c.distance(a)), far(a).max(far(b)).max(far(c)))
        }
        Shape::Sphere(s) => {
            ((across(s.center).length() - s.radius as f64).abs(), s.radius, far(s.center) + s.radius as f64)
        }
    };
    (distance / size as f64, distance / (reach * f32::EPSILON as f64))
}

/// Distance of the origin from a segment.
fn to_segment(p: DVec3, q: DVec3) -> f64 {
    let e = q - p;
    let s = (-p.dot(e) / e.length_squared()).clamp(0.0, 1.0);
    if s.is_nan() { p.length() } else { (p + e * s).length() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;

    /// Answers what it was told.
    struct Told(Option<Hit>);

    impl Intersector for Told {
        fn closest(&self, _: &Ray) -> Option<Hit> {
            self.0
        }
        fn occluded(&self, _: &Ray) -> bool {
            false
        }
        fn describe(&self) -> String {
            "told".into()
        }
        fn memory(&self) -> u64 {
            0
        }
    }

    #[test]
    fn each_kind_of_difference_is_counted_and_measured() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
        let mesh = Mesh { positions: corners, normals: vec![], triangles: vec![[0, 1, 2], [1, 3, 2]] };
        let shapes = [Shape::Mesh(mesh.into())];
        let ray = Ray { origin: Vec3::new(0.5, 0.125, 2.0), direction: Vec3::NEG_Z, t_max: f32::INFINITY };
        let hit = |t, primitive| Some(Hit { t, u: 0.0, v: 0.0, shape: 0, primitive });
        let of = |a, b| compare(&Told(a), &Told(b), &shapes, &[ray]);

        let same = of(hit(2.0, 0), hit(2.002, 0));
        assert_eq!((same.same, same.different(), same.occluded_differs), (1, 0, 1));
        assert!((same.max_t_error - 0.001).abs() < 1e-5);
        let claim = shapes[0].surface(&ray, &hit(2.0, 0).unwrap());
        let claim = (claim.offset + 2.0 * claim.offset_per_length) as f64;
        assert!((same.max_claimed_error * claim - 0.002).abs() < 1e-6);
        assert_eq!(of(hit(2.0, 0), hit(2.0, 1)).tied, 1);
        assert_eq!(of(None, None).same, 1);

        let miss = of(None, hit(2.0, 0));
        assert_eq!((miss.hit_miss, miss.same), (1, 0));
        // The nearest edge is that along x, an eighth away; the longest is the diagonal.
        assert!((miss.max_edge_distance - 0.125 / 2f64.sqrt()).abs() < 1e-7);
        let other = of(hit(2.0, 0), hit(2.5, 1));
        assert_eq!((other.different_primitive, other.worst.len()), (1, 1));
        assert_eq!(other.worst[0].edge_distance, other.max_edge_distance);
        assert!(other.max_edge_roundings > 1e5);
    }
}
