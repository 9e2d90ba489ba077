//! The scene's refracting shapes, as manifold walks ask for them.

use crate::geometry::{Differential, Ray, Shape, SurfacePoint};
use crate::manifold::{Interfaces, Probe, Source};
use crate::scene::World;
use glam::DVec3;
use std::cell::Cell;

/// Other surfaces that a walk's ray may pass before it meets the interface it looks for. A bound for
/// degenerate scenes; walks through glass pass none as a rule.
const MOST_PASSED: u32 = 64;

/// The shapes relative to one end of the chain.
pub(super) struct Refractors<'w> {
    pub(super) world: &'w World,
    /// The camera-side end, world space.
    pub(super) origin: DVec3,
    /// Rays traced.
    pub(super) rays: Cell<u64>,
}

impl Refractors<'_> {
    /// The surface point, with the offsets of its shape, at a vertex of a chain.
    pub(super) fn surface_point(&self, interface: u32, at: &Differential) -> SurfacePoint {
        self.point_on(interface, at.primitive, at.p)
    }

    fn point_on(&self, interface: u32, primitive: u32, p: DVec3) -> SurfacePoint {
        let p = p + self.origin;
        let at = match &self.world.shapes[interface as usize] {
            Shape::Mesh(mesh) => SurfacePoint { p: p.as_vec3(), ..mesh.surface(primitive, 1.0 / 3.0, 1.0 / 3.0) },
            Shape::Sphere(sphere) => sphere.at((p - sphere.center.as_dvec3()).normalize_or(DVec3::Z)),
        };
        SurfacePoint { shape: interface, primitive, ..at }
    }
}

impl Interfaces for Refractors<'_> {
    fn meet(&self, interface: u32, probe: &Probe) -> Option<(f64, Differential)> {
        let mesh = match &self.world.shapes[interface as usize] {
            Shape::Mesh(mesh) => mesh,
            Shape::Sphere(sphere) => {
                let leaving = probe.source.is_some_and(|s| s.interface == interface);
                return sphere.local(self.origin).meet(probe.origin, probe.direction, leaving);
            }
        };
        if let Some(primitive) = probe.hint
            && probe.source != Some(Source { interface, primitive })
            && let facet = mesh.local(primitive, self.origin)
            && let Some((t, u, v)) = facet.crossing(probe.origin, probe.direction)
            && t > 0.0
            && u >= 0.0
            && v >= 0.0
            && u + v <= 1.0
        {
            return Some((t, facet.at(u, v)?));
        }
        // The tracer finds the triangle in f32; the point on it is then computed in f64.
        let direction = probe.direction.as_vec3();
        let mut ray = match probe.source {
            Some(s) => Ray::leaving(&self.point_on(s.interface, s.primitive, probe.origin), direction),
            None => Ray { origin: (probe.origin + self.origin).as_vec3(), direction, t_max: f32::INFINITY },
        };
        for _ in 0..MOST_PASSED {
            self.rays.set(self.rays.get() + 1);
            let hit = self.world.intersector.closest(&ray)?;
            if hit.shape == interface {
                let facet = mesh.local(hit.primitive, self.origin);
                let (t, u, v) = facet.crossing(probe.origin, probe.direction)?;
                return if t > 0.0 { Some((t, facet.at(u, v)?)) } else { None };
            }
            let at = self.world.shapes[hit.shape as usize].surface(&ray, &hit);
            ray = Ray::leaving(&at, direction);
        }
        None
    }
}
