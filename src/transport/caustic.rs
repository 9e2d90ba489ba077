//! Caustic connections (Speierer et al. 2018, §3, Algorithm 1): where the segment between two
//! connectable vertices is blocked by refracting surfaces alone, a manifold walk from that segment
//! finds the path through them.
//!
//! `S(a, b)`, [`Tracer::solve`], is one pure function of the ordered pair, camera side first. Connections
//! use its result; and when a subpath has sampled a chain, the same call decides whether a connection
//! would have found that very chain, and so whether the technique counts in the weights (§3.3.1's
//! check, run to convergence: fewer iterations are biased).

use super::Tracer;
use super::interfaces::{Refractors, meets_box};
use crate::camera::Endpoint;
use crate::geometry::{Ray, Shape};
use crate::manifold::{Crossing, End, MAX_CHAIN, Rejection, Seed, Source, WalkSettings, walk};
use crate::math::Rgb;
use crate::scene::world::MediumId;
use glam::{DVec3, Vec3};
use std::cell::Cell;

/// Largest difference of the directions at an end, in radians, for two chains to be the same. Two
/// solutions this close lie within the square of it of a fold, where there is no energy to speak of.
const SAME_CHAIN: f32 = 1e-4;

/// What lies between two ends.
pub enum Sight {
    /// Nothing.
    Clear,
    /// Something opaque, or a chain that cannot be walked.
    Blocked,
    /// Refracting surfaces only.
    Refracted(Box<Seen>),
}

/// The refracting surfaces on a straight segment.
pub struct Seen {
    seed: Seed,
    /// Medium of each segment.
    media: [MediumId; MAX_CHAIN + 1],
}

impl Seen {
    /// Segments of a path through the chain: one more than it has vertices.
    pub(super) fn segments(&self) -> u32 {
        self.seed.crossings().len() as u32 + 1
    }
}

/// A chain between two ends, as the estimators need it.
#[derive(Clone, Copy, Debug)]
pub struct CausticEdge {
    /// Interfaces crossed.
    pub len: usize,
    /// Which, from the camera side.
    pub shapes: [u32; MAX_CHAIN],
    /// Unit direction at the camera-side end, into the chain.
    pub first: Vec3,
    /// Unit direction at the light-side end, into the chain.
    pub last: Vec3,
    /// `cos_b / J`, see [`crate::manifold::Chain::inverse_jacobian`].
    pub inverse_jacobian: f64,
    /// Shading-normal factor of the étendue identity.
    pub kappa: f64,
    /// `(n_a / n_b)²`: scales radiance from `b` to `a`.
    pub index_ratio: f64,
    /// Fresnel, tint and absorption of the whole chain.
    pub transmittance: Rgb,
    /// Probability that a random walk chooses the lobes of the chain.
    pub probability: f64,
}

impl CausticEdge {
    /// `n_a² kappa cos_a / (n_b² cos_b)`: the reverse Jacobian over the forward one.
    #[inline]
    pub fn etendue_ratio(&self, cos_a: f64, cos_b: f64) -> f64 {
        self.index_ratio * self.kappa * cos_a / cos_b
    }
}

/// Numbers about walks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkCount {
    /// Walks tried for connections.
    pub connections: u64,
    /// Of these, those that gave a chain.
    pub connected: u64,
    /// Walks run to check a sampled chain.
    pub checks: u64,
    /// Of these, those that found the chain.
    pub confirmed: u64,
    /// Newton steps of all walks, halved ones included.
    pub iterations: u64,
    /// Walks whose chain was blocked.
    pub occluded: u64,
    /// Walks without convergence, or to a wrong root, by reason: see [`Rejection`].
    pub rejected: [u64; REASONS.len()],
}

/// The reasons that [`WalkCount::rejected`] counts, in its order.
pub const REASONS: [Rejection; 9] = [
    Rejection::Empty,
    Rejection::TooLong,
    Rejection::Media,
    Rejection::Miss,
    Rejection::TotalReflection,
    Rejection::Singular,
    Rejection::IterationCap,
    Rejection::WrongSide,
    Rejection::Opaque,
];

impl WalkCount {
    /// Walks of both kinds.
    pub fn total(&self) -> u64 {
        self.connections + self.checks
    }
}

impl std::ops::AddAssign for WalkCount {
    fn add_assign(&mut self, o: WalkCount) {
        self.connections += o.connections;
        self.connected += o.connected;
        self.checks += o.checks;
        self.confirmed += o.confirmed;
        self.iterations += o.iterations;
        self.occluded += o.occluded;
        for (r, n) in self.rejected.iter_mut().zip(o.rejected) {
            *r += n;
        }
    }
}

/// The open segment between two ends; neither is its own occluder.
fn segment(a: &Endpoint, b: &Endpoint) -> Option<Ray> {
    Some(match (a, b) {
        (Endpoint::Surface(a), Endpoint::Surface(b)) => Ray::between(a, b),
        (Endpoint::Surface(a), Endpoint::Point(p)) => Ray::to_point(a, *p),
        (Endpoint::Surface(a), Endpoint::Infinite(d)) => Ray::leaving(a, *d),
        (Endpoint::Point(p), Endpoint::Surface(b)) => {
            let end = b.offset_from(*p - b.p);
            Ray { origin: *p, direction: end - *p, t_max: 1.0 }
        }
        (Endpoint::Point(p), Endpoint::Point(q)) => Ray { origin: *p, direction: *q - *p, t_max: 1.0 },
        (Endpoint::Point(p), Endpoint::Infinite(d)) => Ray { origin: *p, direction: *d, t_max: f32::INFINITY },
        (Endpoint::Infinite(_), _) => return None,
    })
}

impl Tracer<'_> {
    /// Whether the segment meets a box around glass; without one there is no chain on it.
    #[inline]
    pub(super) fn may_see_glass(&self, a: &Endpoint, b: &Endpoint) -> bool {
        segment(a, b).is_some_and(|ray| self.world.refractors.iter().any(|(low, high)| meets_box(&ray, *low, *high)))
    }

    /// What lies on the segment from `a` to `b`: the visibility test and, where refracting surfaces alone
    /// block it, the seed of a walk.
    pub fn sight(&mut self, a: &Endpoint, b: &Endpoint) -> Sight {
        let world = self.world;
        let Some(mut ray) = segment(a, b) else { return Sight::Blocked };
        if !world.refractors.iter().any(|(low, high)| meets_box(&ray, *low, *high)) {
            return if self.visible(&ray) { Sight::Clear } else { Sight::Blocked };
        }
        let origin = a.position().as_dvec3();
        let direction = ray.direction.as_dvec3();
        let mut seen: Option<Box<Seen>> = None;
        for _ in 0..=MAX_CHAIN {
            self.rays.shadow += 1;
            let Some(hit) = world.intersector.closest(&ray) else {
                return seen.map_or(Sight::Clear, Sight::Refracted);
            };
            let bsdf = world.bsdf(hit.shape);
            let (Some(boundary), true) = (world.boundary(hit.shape), bsdf.has_delta_refraction()) else {
                return Sight::Blocked;
            };
            let shape = &world.shapes[hit.shape as usize];
            let at = crate::geometry::SurfacePoint { shape: hit.shape, ..shape.surface(&ray, &hit) };
            let differential = match shape {
                Shape::Mesh(mesh) => {
                    let facet = mesh.local(hit.primitive, origin);
                    let crossing = facet.crossing(ray.origin.as_dvec3() - origin, direction);
                    match crossing.and_then(|(_, u, v)| facet.at(u, v)) {
                        Some(differential) => differential,
                        None => return Sight::Blocked,
                    }
                }
                Shape::Sphere(sphere) => {
                    let n = at.p.as_dvec3() - sphere.center.as_dvec3();
                    sphere.local(origin).at(n.normalize_or(DVec3::Z))
                }
            };
            let before = boundary.medium_toward(&at, -ray.direction);
            let after = boundary.medium_toward(&at, ray.direction);
            let index = |m: MediumId| f64::from(world.media[m as usize].ior);
            let seen = seen.get_or_insert_with(|| Box::new(Seen { seed: Seed::default(), media: [0; MAX_CHAIN + 1] }));
            let crossing = Crossing {
                interface: hit.shape,
                inward: at.ng.dot(ray.direction) < 0.0,
                n_i: index(before),
                n_o: index(after),
            };
            if seen.seed.push(crossing, &differential).is_err() {
                return Sight::Blocked;
            }
            let crossed = seen.seed.crossings().len();
            seen.media[crossed - 1] = before;
            seen.media[crossed] = after;
            // Onward to the same end.
            ray = match b {
                Endpoint::Surface(b) => Ray::between(&at, b),
                Endpoint::Point(p) => Ray::to_point(&at, *p),
                Endpoint::Infinite(d) => Ray::leaving(&at, *d),
            };
        }
        Sight::Blocked
    }

    /// `S(a, b)` from its seed: the unobstructed chain from `a` (camera side) to `b` (light side), or
    /// nothing.
    pub fn solve(&mut self, a: &Endpoint, b: &Endpoint, seen: &Seen) -> Option<CausticEdge> {
        let world = self.world;
        let origin = a.position().as_dvec3();
        let refractors = Refractors { world, origin, rays: Cell::new(0) };
        let end = match b {
            Endpoint::Infinite(d) => End::Direction(d.as_dvec3()),
            _ => End::Point(b.position().as_dvec3() - origin),
        };
        let source = match a {
            Endpoint::Surface(at) => Some(Source { interface: at.shape, primitive: at.primitive }),
            _ => None,
        };
        let chain = walk(&refractors, source, end, &seen.seed, &WalkSettings::default());
        self.rays.walk += refractors.rays.get();
        let chain = match chain {
            Ok(chain) => {
                self.walks.iterations += u64::from(chain.iterations);
                chain
            }
            Err(rejected) => {
                self.walks.iterations += u64::from(rejected.iterations);
                if let Some(i) = REASONS.iter().position(|r| *r == rejected.reason) {
                    self.walks.rejected[i] += 1;
                }
                return None;
            }
        };
        // Every segment must be free.
        let crossings = chain.crossings();
        let mut from = *a;
        for (crossing, vertex) in crossings.iter().zip(chain.vertices()) {
            let to = Endpoint::Surface(refractors.surface_point(crossing.interface, vertex));
            if !self.visible(&segment(&from, &to)?) {
                self.walks.occluded += 1;
                return None;
            }
            from = to;
        }
        if !self.visible(&segment(&from, b)?) {
            self.walks.occluded += 1;
            return None;
        }
        let mut edge = CausticEdge {
            len: crossings.len(),
            shapes: [0; MAX_CHAIN],
            first: chain.first.as_vec3(),
            last: chain.last.as_vec3(),
            inverse_jacobian: chain.inverse_jacobian,
            kappa: chain.kappa,
            index_ratio: {
                let (n_a, n_b) = chain.end_indices();
                (n_a / n_b).powi(2)
            },
            transmittance: Rgb::splat(chain.transmittance as f32),
            probability: chain.transmittance,
        };
        for (i, crossing) in crossings.iter().enumerate() {
            let (albedo, probability) = world.bsdf(crossing.interface).delta_refraction()?;
            edge.shapes[i] = crossing.interface;
            edge.transmittance *= albedo;
            edge.probability *= f64::from(probability);
        }
        if world.requirements.absorption {
            for (length, medium) in chain.lengths().iter().zip(seen.media) {
                edge.transmittance *= world.transmittance(medium, *length as f32);
            }
        }
        Some(edge)
    }

    /// Whether a connection of `a` and `b` would have found a chain that was sampled: through `shapes`,
    /// leaving `a` along `first` and `b` along `last`.
    pub(super) fn confirm(
        &mut self,
        a: &Endpoint,
        b: &Endpoint,
        shapes: &[u32],
        first: Vec3,
        last: Vec3,
    ) -> Option<CausticEdge> {
        let Sight::Refracted(seen) = self.sight(a, b) else { return None };
        if !seen.seed.crossings().iter().map(|c| c.interface).eq(shapes.iter().copied()) {
            return None;
        }
        self.walks.checks += 1;
        let edge = self.solve(a, b, &seen)?;
        let same = edge.first.distance(first) < SAME_CHAIN && edge.last.distance(last) < SAME_CHAIN;
        self.walks.confirmed += u64::from(same);
        same.then_some(edge)
    }
}
