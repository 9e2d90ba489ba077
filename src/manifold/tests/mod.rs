//! A small f64 world for the walk, independent oracles, and the numbers both must give.

mod ball;
mod block_form;
mod blocks;
mod closed_forms;
mod cost;
mod extremes;
mod fuzz;
mod jacobian;
mod rough;
mod starts;

use super::*;
use crate::geometry::differential::{Ball, Facet};
use crate::math::{Sampler, Stream};

/// A surface that refracts, in world coordinates.
#[derive(Clone, Debug)]
enum Surface {
    Ball(Ball),
    /// Triangles that end at their edges.
    Soup(Vec<Facet>),
    /// The plane of a triangle, normals extrapolated.
    Plane(Facet),
}

/// A surface with the refractive indices on its front and back.
#[derive(Clone, Debug)]
struct Solid {
    surface: Surface,
    front: f64,
    back: f64,
}

impl Solid {
    fn ball(center: DVec3, radius: f64, index: f64) -> Solid {
        Solid { surface: Surface::Ball(Ball { center, radius }), front: 1.0, back: index }
    }

    /// The plane at height `z`, seen from below at its front.
    fn plane(z: f64, before: f64, after: f64) -> Solid {
        let corners = [DVec3::new(-1.0, -1.0, z), DVec3::new(-1.0, 1.0, z), DVec3::new(1.0, 0.0, z)];
        let facet = Facet { corners, normals: None, primitive: 0 };
        Solid { surface: Surface::Plane(facet), front: before, back: after }
    }

    fn scaled(&self, by: f64) -> Solid {
        let facet = |f: &Facet| Facet { corners: f.corners.map(|p| p * by), ..*f };
        let surface = match &self.surface {
            Surface::Ball(b) => Surface::Ball(Ball { center: b.center * by, radius: b.radius * by }),
            Surface::Soup(facets) => Surface::Soup(facets.iter().map(facet).collect()),
            Surface::Plane(f) => Surface::Plane(facet(f)),
        };
        Solid { surface, ..*self }
    }
}

/// The solids as seen from `a`.
struct Local<'a> {
    solids: &'a [Solid],
    a: DVec3,
}

impl Interfaces for Local<'_> {
    fn meet(&self, interface: u32, probe: &Probe) -> Option<(f64, Differential)> {
        let (o, d) = (probe.origin, probe.direction);
        let source = probe.source.filter(|s| s.interface == interface).map(|s| s.primitive);
        let local = |f: &Facet| Facet { corners: f.corners.map(|p| p - self.a), ..*f };
        match &self.solids[interface as usize].surface {
            Surface::Ball(b) => Ball { center: b.center - self.a, ..*b }.meet(o, d, source.is_some()),
            Surface::Plane(f) => {
                let facet = local(f);
                let (t, u, v) = facet.crossing(o, d)?;
                (t > 0.0 && source.is_none()).then_some(())?;
                Some((t, facet.at(u, v)?))
            }
            Surface::Soup(facets) => {
                let inside = |&(t, u, v): &(f64, f64, f64)| t > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0;
                let hit = |f: &Facet| local(f).crossing(o, d).filter(inside).map(|(t, u, v)| (t, u, v, local(f)));
                let others = || facets.iter().filter(|f| Some(f.primitive) != source);
                if let Some(hinted) = others().filter(|f| Some(f.primitive) == probe.hint).find_map(hit) {
                    return Some((hinted.0, hinted.3.at(hinted.1, hinted.2)?));
                }
                let (t, u, v, facet) = others().filter_map(hit).min_by(|x, y| x.0.total_cmp(&y.0))?;
                Some((t, facet.at(u, v)?))
            }
        }
    }
}

/// What the straight segment from `a` crosses, in order.
fn seed(local: &Local, end: End) -> Result<Seed, Rejection> {
    let (direction, reach) = match end {
        End::Point(b) => (b.normalize(), b.length()),
        End::Direction(d) => (d, f64::INFINITY),
    };
    let mut hits = Vec::new();
    for (id, solid) in local.solids.iter().enumerate() {
        let id = id as u32;
        let mut probe = Probe { origin: DVec3::ZERO, direction, source: None, hint: None };
        let mut travelled = 0.0;
        // A ray meets each triangle once; the bound is for soups.
        for _ in 0..64 {
            let Some((t, at)) = local.meet(id, &probe) else { break };
            travelled += t;
            if travelled >= reach {
                break;
            }
            let inward = direction.dot(at.ng) < 0.0;
            let (n_i, n_o) = if inward { (solid.front, solid.back) } else { (solid.back, solid.front) };
            hits.push((travelled, Crossing { interface: id, inward, n_i, n_o }, at));
            probe.origin = at.p;
            probe.source = Some(Source { interface: id, primitive: at.primitive });
        }
    }
    hits.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.interface.cmp(&y.1.interface)));
    let mut seed = Seed::default();
    hits.iter().try_for_each(|(_, crossing, at)| seed.push(*crossing, at))?;
    Ok(seed)
}

/// Seed and walk from `a` to `b`, both in world coordinates.
fn connect(solids: &[Solid], a: DVec3, b: DVec3, settings: &WalkSettings) -> Result<Chain, Rejected> {
    reach(solids, a, End::Point(b - a), settings)
}

/// Seed and walk from `a` to an end relative to it.
fn reach(solids: &[Solid], a: DVec3, end: End, settings: &WalkSettings) -> Result<Chain, Rejected> {
    let local = Local { solids, a };
    let seed = seed(&local, end).map_err(|reason| Rejected { reason, iterations: 0 })?;
    walk(&local, None, end, &seed, None, settings)
}

/// Settings that leave no error beside rounding.
const EXACT: WalkSettings = WalkSettings { max_iterations: 64, tolerance: 1e-14, min_step: 1e-4, careful: 5 };

/// Settings that drive the residual down to what scenes with thin or grazing geometry allow.
const TIGHT: WalkSettings = WalkSettings { tolerance: 1e-12, ..EXACT };

/// Uniform random numbers.
struct Random(Sampler);

impl Random {
    fn new(seed: u64) -> Random {
        Random(Sampler::new(seed, 0, 0, Stream::Camera))
    }

    /// Uniform in `lo .. hi`.
    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.0.next_1d() as f64
    }

    /// Uniform in the cube of half-width `r`.
    fn cube(&mut self, r: f64) -> DVec3 {
        DVec3::new(self.within(-r, r), self.within(-r, r), self.within(-r, r))
    }

    /// Uniform on the unit sphere.
    fn direction(&mut self) -> DVec3 {
        crate::math::warp::sphere(self.0.next_2d()).as_dvec3().normalize()
    }

    /// Uniform on a disk of radius `r` at height `z`.
    fn disk(&mut self, r: f64, z: f64) -> DVec3 {
        let (phi, rho) = (self.within(0.0, std::f64::consts::TAU), r * self.within(0.0, 1.0).sqrt());
        DVec3::new(rho * phi.cos(), rho * phi.sin(), z)
    }
}

/// Relative difference.
fn error(value: f64, expected: f64) -> f64 {
    (value / expected - 1.0).abs()
}

/// Two triangles that cross the z axis with vertex normals of their own, over each other: a slab between
/// media `n[0]`, `n[1]`, `n[2]`, seen from below at the fronts.
fn bent_slab(random: &mut Random, n: [f64; 3]) -> Vec<Solid> {
    let mut layer = |z: f64, before: f64, after: f64| {
        let corner = |x: f64, y: f64, r: &mut Random| DVec3::new(x, y, z) + r.cube(0.15);
        let corners = [corner(-3.0, -2.0, random), corner(0.0, 3.5, random), corner(3.0, -2.0, random)];
        let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let mut normal = || (ng + random.cube(0.15)).normalize();
        let normals = Some([normal(), normal(), normal()]);
        Solid { surface: Surface::Plane(Facet { corners, normals, primitive: 0 }), front: before, back: after }
    };
    vec![layer(1.0, n[0], n[1]), layer(1.6, n[1], n[2])]
}
