//! The shapes that manifold walks lead through, and whether a segment may meet any.

use super::SceneError;
use crate::geometry::{Ray, Shape};
use crate::intersect::{Bounds, Wide};
use crate::scatter::Bsdf;
use glam::Vec3;
use std::ops::ControlFlow;

/// A shape whose refraction walks lead through.
#[derive(Clone, Copy, Debug)]
pub struct Refractor {
    /// Which.
    pub shape: u32,
    /// Lower corner of its box.
    pub low: Vec3,
    /// Upper corner of its box.
    pub high: Vec3,
    /// Radius of a sphere around it, about the middle of its box.
    pub radius: f32,
    /// Whether its normal turns, so that several paths may lead through it from one point to another.
    pub curved: bool,
    /// Its triangles, if some of them are not parallel, else 0.
    pub facets: u32,
}

impl Refractor {
    fn new(shape: u32, geometry: &Shape) -> Refractor {
        let (low, high) = padded(geometry.bounds());
        let radius = geometry.radius_about(0.5 * (low + high)) + (high - low).max_element() * 1e-4;
        Refractor { shape, low, high, radius, curved: geometry.is_curved(), facets: geometry.facets() }
    }

    /// Whether the segment meets its box.
    #[inline]
    fn boxed(&self, ray: &Ray) -> bool {
        let inverse = ray.direction.recip();
        let (a, b) = ((self.low - ray.origin) * inverse, (self.high - ray.origin) * inverse);
        // A NaN of 0 * infinity is dropped by `min` and `max`, which keeps the answer conservative.
        let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
        !(near.max(0.0) > far.min(ray.t_max) * 1.000_01)
    }
}

/// All that walks lead through.
pub struct Glass {
    bodies: Vec<Refractor>,
    /// Over their boxes, with its leaves' order, if there are more than [`FEW`].
    tree: Option<(Wide, Vec<u32>)>,
}

/// Bodies that are looked at one by one: the tree takes a quarter of a microsecond, as much as some 40 of these.
const FEW: usize = 32;

impl Glass {
    /// The shapes whose material refracts so that walks lead through.
    pub(super) fn new(shapes: &[Shape], shape_material: &[u32], bsdfs: &[Bsdf]) -> Result<Glass, SceneError> {
        let shapes = (0..).zip(shapes.iter().zip(shape_material));
        let refracting = shapes.filter(|(_, (_, m))| bsdfs[**m as usize].walked_refraction().is_some());
        let bodies: Vec<_> = refracting.map(|(shape, (geometry, _))| Refractor::new(shape, geometry)).collect();
        Glass::over(bodies)
    }

    fn over(bodies: Vec<Refractor>) -> Result<Glass, SceneError> {
        let tree = if bodies.len() > FEW {
            let boxes: Vec<_> = bodies.iter().map(|b| Bounds { lo: b.low, hi: b.high }).collect();
            let refuse = |_| SceneError::OutOfMemory(format!("no memory for {} glass bodies", bodies.len()));
            Some(Wide::build(&boxes).map_err(refuse)?)
        } else {
            None
        };
        Ok(Glass { bodies, tree })
    }

    /// The shapes, in their order.
    pub fn bodies(&self) -> &[Refractor] {
        &self.bodies
    }

    /// Bytes.
    pub(super) fn memory(&self) -> u64 {
        let tree = self.tree.as_ref().map_or(0, |(tree, order)| tree.memory() + size_of_val(&order[..]) as u64);
        size_of_val(&self.bodies[..]) as u64 + tree
    }

    /// What is known of a shape, if it is one of these.
    pub fn body(&self, shape: u32) -> Option<&Refractor> {
        self.bodies.binary_search_by_key(&shape, |r| r.shape).ok().map(|i| &self.bodies[i])
    }

    /// Whether the segment meets the box of any: without one, there is no glass on it.
    #[inline]
    pub fn on(&self, ray: &Ray) -> bool {
        let Some((tree, order)) = &self.tree else { return self.bodies.iter().any(|b| b.boxed(ray)) };
        let mut any = false;
        tree.walk(ray, |i, t_max| {
            any = self.bodies[order[i as usize] as usize].boxed(ray);
            if any { ControlFlow::Break(()) } else { ControlFlow::Continue(t_max) }
        });
        any
    }
}

/// A box a little larger, by far more than the rounding of a hit.
fn padded((low, high): (Vec3, Vec3)) -> (Vec3, Vec3) {
    let pad = Vec3::splat(((high - low).max_element() + low.abs().max(high.abs()).max_element()) * 1e-5);
    (low - pad, high + pad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Sphere;
    use crate::math::{Sampler, Stream};

    /// The tree leaves out no body that a segment meets, and nothing but boxes counts.
    #[test]
    fn tree() {
        let mut random = Sampler::new(5, 0, 0, Stream::Camera);
        for n in [FEW + 1, 1000] {
            let mut place = || Vec3::new(random.next_1d(), random.next_1d(), random.next_1d());
            let radius = 0.2 / (n as f32).cbrt();
            let spheres: Vec<_> = (0..n).map(|_| Sphere { center: place(), radius }).collect();
            let bodies = (0..).zip(&spheres).map(|(shape, sphere)| Refractor::new(shape, &Shape::Sphere(*sphere)));
            let glass = Glass::over(bodies.collect()).unwrap();
            assert!(glass.tree.is_some());
            let mut met = 0;
            for _ in 0..20_000 {
                let origin = place();
                let ray = Ray { origin, direction: place() - origin, t_max: 1.0 };
                let on = glass.on(&ray);
                assert!(on || spheres.iter().all(|s| s.intersect(&ray).is_none()), "{ray:?} among {n}");
                assert!(!on || glass.bodies.iter().any(|b| b.boxed(&ray)), "{ray:?} among {n}");
                met += u32::from(on);
            }
            assert!((2000..18_000).contains(&met), "{met}");
        }
    }
}
