//! Caustic connections (Speierer et al. 2018, §3, Algorithm 1): where the segment between two
//! connectable vertices crosses refracting surfaces, a manifold walk from that segment finds the path
//! through them. Opaque surfaces on the segment do not matter, only those on the path; in the paper they
//! do.
//!
//! `S(a, b)` is one pure function of the ordered pair, camera side first: the set of chains to which the
//! walks from the straight segment and from a few other starts lead. Connections use them all; and when a
//! subpath has sampled a chain, the same walks decide whether it is in the set, and so whether the
//! technique counts in the weights (§3.3.1's check, run to convergence: fewer iterations are biased). The
//! paper has one walk, as we have by default; what it misses is left to the other techniques, and so to
//! their noise.

use super::Tracer;
use super::interfaces::{Refractors, meets_box};
use super::roulette::Roulette;
use crate::camera::Endpoint;
use crate::geometry::{Ray, Shape, SurfacePoint};
use crate::manifold::{
    Crossing, End, MAX_CHAIN, MAX_STARTS, Rejection, Seed, Source, Tilt, WalkSettings, starts, walk,
};
use crate::math::Rgb;
use crate::scene::world::MediumId;
use glam::{DVec3, Vec3};
use std::cell::Cell;
use std::time::Instant;

/// Largest difference of the directions at an end, in radians, for two chains to be the same. Two
/// solutions this close lie within the square of it of a fold, where there is no energy to speak of.
const SAME_CHAIN: f32 = 1e-4;

/// Largest [`WalkSettings::tolerance`] of a render: an angle a tenth as large as what tells chains apart.
/// Beyond, the check fails to recognise what connections find, and light is counted twice (at 1e-3 radians
/// 18 % of Figure 4a's caustics).
pub const LARGEST_TOLERANCE: f64 = 1e-5;

/// Opaque surfaces that the straight segment may cross: light that glass bends passes beside them, as the
/// light that reaches an iris from the side does, for which the straight line runs through the sclera.
/// Without this those paths are left to techniques that seldom find them (eye_small: 115 times the error).
const MOST_OPAQUE: u32 = 4;

/// Which geometry term of a chain enters the weights. Contributions always have the exact one, so both
/// are unbiased.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GeometryTerm {
    /// The generalised geometry term. Where the light gathers, the weight falls as the contribution grows.
    #[default]
    Exact,
    /// As if the ends saw each other (Speierer et al. 2018, §3.2), with the cosines of the real directions.
    /// Near a caustic the weighted contribution is unbounded.
    Direct,
}

/// How a sampled chain is recognised as one that a connection would have found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Check {
    /// By the connection's own walk.
    #[default]
    Exact,
    /// By the first [`FEW`] steps of it (Speierer et al. 2018, §3.3.1). Biased: counts energy twice where
    /// the walk needs more steps.
    Few,
    /// Not at all. Biased: loses the energy of all chains that no walk finds.
    Off,
}

/// Steps of [`Check::Few`].
pub const FEW: u32 = 3;

/// "Close enough" for [`Check::Few`]: largest deviation from Snell's law, and from the sampled
/// directions, in radians.
const CLOSE_ENOUGH: f64 = 0.02;

/// Most steps of a walk between ends that other techniques join, too. Of the walks that arrive 1 to 5 %
/// need more, and hopeless ones run to the end: with 24 instead of 64 the error at equal time falls by 1 %
/// (water_glass) to 30 % (lumpy).
pub const HURRIED: u32 = 24;

/// Share that is aimed at glass, where any is. The error of caustics at equal time is about the same from 0.3 to 0.75.
pub const AIM: f32 = 0.5;

/// Largest share that may be aimed: what goes elsewhere would be all noise.
pub const LARGEST_AIM: f32 = 0.95;

/// Largest [`CausticOptions::light_subpaths`]: far beyond what pays.
pub const MOST_LIGHT_SUBPATHS: f32 = 64.0;

/// Smallest: far below what pays.
pub const LEAST_LIGHT_SUBPATHS: f32 = 1e-3;

/// How caustic connections are made and weighed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticOptions {
    /// In the weights.
    pub geometry_term: GeometryTerm,
    /// Of sampled chains. All but the exact one need [`GeometryTerm::Direct`]: without the walk's result
    /// the generalised term of a sampled chain is not known.
    pub check: Check,
    /// Most steps of a walk; by default those of `walk` to a light that cannot be hit, else [`HURRIED`].
    pub max_iterations: Option<u32>,
    /// The walk.
    pub walk: WalkSettings,
    /// Walks from one pair of ends, the one from the straight segment included; behind flat glass there is
    /// no other. At most `1 +` [`MAX_STARTS`].
    pub seeds: u32,
    /// Probability with which a connection tries the starts after the first. A check always does.
    pub further: f32,
    /// Which connections are tried.
    pub roulette: Roulette,
    /// Share of what light subpaths draw at lights and at surfaces that is aimed at glass, at most [`LARGEST_AIM`]; 0
    /// for none. By default [`AIM`] where a few samples before the render forecast that it pays, unless connections
    /// are switched off. For bidirectional path tracing and, on demand, light tracing.
    pub aim: Option<f32>,
    /// Light subpaths per sample, from [`LEAST_LIGHT_SUBPATHS`] to [`MOST_LIGHT_SUBPATHS`]; with fewer than 1 some samples
    /// have none. By default 1, or where connections are made as few as those samples forecast to pay. For
    /// bidirectional path tracing.
    pub light_subpaths: Option<f32>,
}

impl Default for CausticOptions {
    fn default() -> Self {
        CausticOptions {
            geometry_term: GeometryTerm::Exact,
            check: Check::Exact,
            max_iterations: None,
            walk: WalkSettings::default(),
            seeds: 1,
            further: 0.25,
            roulette: Roulette::Contribution(0.5),
            aim: None,
            light_subpaths: None,
        }
    }
}

impl CausticOptions {
    /// What the paper describes: the direct term, a check of few steps, roulette by lengths, one
    /// walk per connection.
    pub fn paper() -> CausticOptions {
        CausticOptions {
            geometry_term: GeometryTerm::Direct,
            check: Check::Few,
            max_iterations: None,
            walk: WalkSettings::default(),
            seeds: 1,
            further: 1.0,
            roulette: Roulette::Lengths,
            aim: Some(0.0),
            light_subpaths: Some(1.0),
        }
    }
}

/// What lies between two ends.
pub enum Sight {
    /// Nothing.
    Clear,
    /// Something opaque, or a chain that cannot be walked.
    Blocked,
    /// Refracting surfaces, and perhaps opaque ones.
    Refracted(Box<Seen>),
}

/// The refracting surfaces on a straight segment.
#[derive(Default)]
pub struct Seen {
    seed: Seed,
    /// Medium of each segment.
    media: [MediumId; MAX_CHAIN + 1],
    /// Width of each crossing's distribution of microfacet normals; 0 where it is smooth.
    alphas: [f32; MAX_CHAIN],
}

impl Seen {
    /// Segments of a path through the chain: one more than it has vertices.
    pub(super) fn segments(&self) -> u32 {
        self.seed.crossings().len() as u32 + 1
    }

    /// The rough crossings, with the width of their distribution of normals.
    fn rough(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let rough = (0..).zip(self.alphas).filter(|(_, alpha)| *alpha > 0.0);
        rough.map(|(i, alpha)| (i, f64::from(alpha)))
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
    /// What stands for it in the weights, see [`GeometryTerm`].
    pub weight_inverse_jacobian: f64,
    /// `n_a² kappa / n_b²`, the étendue ratio over the cosines, or what stands for it in the weights.
    pub weight_etendue: f64,
    /// Shading-normal factor of the étendue identity.
    pub kappa: f64,
    /// `(n_a / n_b)²`: scales radiance from `b` to `a`.
    pub index_ratio: f64,
    /// Fresnel, tint and absorption of the whole chain.
    pub transmittance: Rgb,
    /// Probability that a subpath scatters along the chain, toward the light and toward the camera, see
    /// [`super::vertex::EdgeRecord::chain_probability`].
    pub probability: [f64; 2],
    /// Reciprocal of the probability with which the start that led here was tried.
    pub attempt: f32,
}

impl CausticEdge {
    /// Whether its directions at both ends are these, within an angle in radians.
    #[inline]
    fn leaves_like(&self, first: Vec3, last: Vec3, angle: f32) -> bool {
        self.first.distance(first) < angle && self.last.distance(last) < angle
    }

    /// `n_a² kappa cos_a / (n_b² cos_b)`: the reverse Jacobian over the forward one, in the weights.
    #[inline]
    pub fn etendue_ratio(&self, cos_a: f64, cos_b: f64) -> f64 {
        self.weight_etendue * cos_a / cos_b
    }
}

/// Numbers about walks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkCount {
    /// Connections tried through glass.
    pub connections: u64,
    /// Attempts that roulette spared, whether there was glass in the way or not.
    pub spared: u64,
    /// Connections that found a chain.
    pub connected: u64,
    /// The chains that they found.
    pub chains: u64,
    /// Sampled chains that were checked.
    pub checks: u64,
    /// Of these, those that a connection would have found.
    pub confirmed: u64,
    /// Newton steps of all walks, halved ones included.
    pub iterations: u64,
    /// Walks by their steps: class `k` has those of `2^k` to `2^(k+1) - 1`, the first also none. Walks that
    /// converged, and those that did not.
    pub steps: [[u64; STEP_CLASSES]; 2],
    /// Nanoseconds spent on connecting and on checking: one walk in sixteen is timed.
    pub nanoseconds: [u64; 2],
    /// Walks whose chain was blocked.
    pub occluded: u64,
    /// Walks without convergence, or to a wrong root, by reason: see [`Rejection`].
    pub rejected: [u64; REASONS.len()],
}

/// Classes of [`WalkCount::steps`].
pub const STEP_CLASSES: usize = 8;

/// One walk of so many is timed.
const TIMED: u64 = 16;

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
    /// All walks.
    pub fn total(&self) -> u64 {
        self.steps.as_flattened().iter().sum()
    }

    fn count_steps(&mut self, iterations: u32, converged: bool) {
        self.iterations += u64::from(iterations);
        let class = iterations.max(1).ilog2() as usize;
        self.steps[usize::from(!converged)][class.min(STEP_CLASSES - 1)] += 1;
    }
}

impl std::ops::AddAssign for WalkCount {
    fn add_assign(&mut self, o: WalkCount) {
        self.connections += o.connections;
        self.spared += o.spared;
        self.connected += o.connected;
        self.chains += o.chains;
        self.checks += o.checks;
        self.confirmed += o.confirmed;
        self.iterations += o.iterations;
        self.occluded += o.occluded;
        for (n, more) in self.steps.as_flattened_mut().iter_mut().zip(o.steps.as_flattened()) {
            *n += more;
        }
        for (n, more) in self.nanoseconds.iter_mut().zip(o.nanoseconds) {
            *n += more;
        }
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
    /// The segment, if it meets a box around glass; without one there is no chain on it.
    #[inline]
    pub(super) fn toward_glass(&self, a: &Endpoint, b: &Endpoint) -> Option<Ray> {
        segment(a, b).filter(|ray| self.refractors.iter().any(|r| meets_box(ray, r.low, r.high)))
    }

    /// What lies on the segment `ray` from `a` to `b`: the visibility test and, where refracting surfaces
    /// block it, the seed of a walk.
    pub(super) fn sight(&mut self, mut ray: Ray, a: &Endpoint, b: &Endpoint) -> Sight {
        let world = self.world;
        let origin = a.position().as_dvec3();
        let direction = ray.direction.as_dvec3();
        let onward = |at: &SurfacePoint| match b {
            Endpoint::Surface(b) => Ray::between(at, b),
            Endpoint::Point(p) => Ray::to_point(at, *p),
            Endpoint::Infinite(d) => Ray::leaving(at, *d),
        };
        let mut seen: Option<Box<Seen>> = None;
        let mut opaque = 0;
        while opaque <= MOST_OPAQUE {
            self.rays.shadow += 1;
            let Some(hit) = world.intersector.closest(&ray) else {
                return match seen {
                    Some(seen) => Sight::Refracted(seen),
                    None if opaque == 0 => Sight::Clear,
                    None => Sight::Blocked,
                };
            };
            let shape = &world.shapes[hit.shape as usize];
            let at = SurfacePoint { shape: hit.shape, ..shape.surface(&ray, &hit) };
            let bsdf = self.bsdf(hit.shape);
            let (Some(boundary), Some(refraction)) = (world.boundary(hit.shape), bsdf.walked_refraction()) else {
                opaque += 1;
                ray = onward(&at);
                continue;
            };
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
            let seen = seen.get_or_insert_with(Box::default);
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
            seen.alphas[crossed - 1] = refraction.alpha;
            // Onward to the same end.
            ray = onward(&at);
        }
        Sight::Blocked
    }

    /// The walk to `b`: patient where nothing else finds the path.
    fn walk_settings(&self, b: &Endpoint) -> WalkSettings {
        // A camera's path samples chains that end there, whatever the walk finds.
        let others = matches!(b, Endpoint::Surface(_)) || !self.world.requirements.delta_lights;
        let walk = self.options.walk;
        let most = if others { walk.max_iterations.min(HURRIED) } else { walk.max_iterations };
        WalkSettings { max_iterations: self.options.max_iterations.unwrap_or(most), ..walk }
    }

    /// One chain of `S(a, b)`: the unobstructed chain from `a` (camera side) to `b` (light side) to which the
    /// walk leads from the straight segment or from `start`, or nothing.
    fn solve(
        &mut self,
        a: &Endpoint,
        b: &Endpoint,
        seen: &Seen,
        start: Option<DVec3>,
        settings: &WalkSettings,
    ) -> Option<CausticEdge> {
        let world = self.world;
        let origin = a.position().as_dvec3();
        let refractors = Refractors { world, origin, rays: Cell::new(0) };
        let end = end_from(origin, b);
        let source = match a {
            Endpoint::Surface(at) => Some(Source { interface: at.shape, primitive: at.primitive }),
            _ => None,
        };
        let chain = walk(&refractors, source, end, &seen.seed, start, settings);
        self.rays.walk += refractors.rays.get();
        let chain = match chain {
            Ok(chain) => {
                self.walks.count_steps(chain.iterations, true);
                chain
            }
            Err(rejected) => {
                self.walks.count_steps(rejected.iterations, false);
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
        let (n_a, n_b) = chain.end_indices();
        let index_ratio = (n_a / n_b).powi(2);
        let (weight_inverse_jacobian, weight_etendue) = match self.options.geometry_term {
            GeometryTerm::Exact => (chain.inverse_jacobian, index_ratio * chain.kappa),
            GeometryTerm::Direct => (direct_inverse_jacobian(a, b), 1.0),
        };
        let mut edge = CausticEdge {
            len: crossings.len(),
            shapes: [0; MAX_CHAIN],
            first: chain.first.as_vec3(),
            last: chain.last.as_vec3(),
            inverse_jacobian: chain.inverse_jacobian,
            weight_inverse_jacobian,
            weight_etendue,
            kappa: chain.kappa,
            index_ratio,
            transmittance: Rgb::splat(chain.transmittance as f32),
            probability: chain.density,
            attempt: 1.0,
        };
        for (i, crossing) in crossings.iter().enumerate() {
            let refraction = self.bsdf(crossing.interface).walked_refraction()?;
            edge.shapes[i] = crossing.interface;
            edge.transmittance *= refraction.albedo;
            edge.probability = edge.probability.map(|p| p * f64::from(refraction.probability));
        }
        if world.requirements.absorption {
            for (length, medium) in chain.lengths().iter().zip(seen.media) {
                edge.transmittance *= world.transmittance(medium, *length as f32);
            }
        }
        Some(edge)
    }

    /// First directions of the walks after the one from the straight segment.
    fn starts(&self, a: &Endpoint, b: &Endpoint, seen: &Seen) -> impl Iterator<Item = DVec3> + use<> {
        let curved = seen.seed.crossings().iter().zip(seen.seed.vertices()).find_map(|(crossing, vertex)| {
            let i = self.refractors.binary_search_by_key(&crossing.interface, |r| r.shape).ok()?;
            let refractor = &self.refractors[i];
            refractor.curved.then_some((refractor, vertex.p))
        });
        let (directions, count) = curved.map_or(([DVec3::Z; MAX_STARTS], 0), |(refractor, near)| {
            let origin = a.position().as_dvec3();
            let (low, high) = (refractor.low.as_dvec3(), refractor.high.as_dvec3());
            let radius = (high - low).element_sum() / 6.0;
            let starts = starts(end_from(origin, b), near, (low + high) * 0.5 - origin, radius);
            (starts, self.options.seeds.saturating_sub(1) as usize)
        });
        directions.into_iter().take(count)
    }

    /// `S(a, b)`, by which a connection joins two ends: fills [`Tracer::chains`] with different chains. At
    /// rough surfaces they refract at microfacets that are drawn here.
    pub(super) fn connect_chains(&mut self, a: &Endpoint, b: &Endpoint, seen: &mut Seen) {
        self.walks.connections += 1;
        for (i, alpha) in seen.rough() {
            let u = self.roulette.next_2d().as_dvec2();
            seen.seed.tilt(i, Tilt::sample(seen.seed.vertices()[i].ns, alpha, u));
        }
        let seen = &*seen;
        let start = self.walks.connections.is_multiple_of(TIMED).then(Instant::now);
        self.chains.clear();
        let settings = self.walk_settings(b);
        let straight = self.solve(a, b, seen, None, &settings);
        self.chains.extend(straight);
        let further = self.options.further;
        if self.options.seeds > 1 && (further >= 1.0 || self.roulette.next_1d() < further) {
            for from in self.starts(a, b, seen) {
                let Some(edge) = self.solve(a, b, seen, Some(from), &settings) else { continue };
                if !self.chains.iter().any(|known| known.leaves_like(edge.first, edge.last, SAME_CHAIN)) {
                    self.chains.push(CausticEdge { attempt: 1.0 / further.min(1.0), ..edge });
                }
            }
        }
        self.walks.nanoseconds[0] += start.map_or(0, |s| TIMED * s.elapsed().as_nanos() as u64);
        self.walks.connected += u64::from(!self.chains.is_empty());
        self.walks.chains += self.chains.len() as u64;
    }

    /// Whether a connection of `a` and `b` would have found a chain that was sampled: through `shapes`,
    /// at the normals of surface and microfacet where that is rough, leaving `a` along `first` and `b` along `last`.
    pub(super) fn confirm(
        &mut self,
        a: &Endpoint,
        b: &Endpoint,
        shapes: &[u32],
        microfacets: &[[Vec3; 2]],
        first: Vec3,
        last: Vec3,
    ) -> Option<CausticEdge> {
        let ray = self.toward_glass(a, b)?;
        let Sight::Refracted(mut seen) = self.sight(ray, a, b) else { return None };
        if !seen.seed.crossings().iter().map(|c| c.interface).eq(shapes.iter().copied()) {
            return None;
        }
        for (i, alpha) in seen.rough() {
            let [n, h] = microfacets[i].map(|v| v.as_dvec3());
            seen.seed.tilt(i, Tilt::of(seen.seed.vertices()[i].ns, n, h, alpha));
        }
        self.walks.checks += 1;
        let walk = self.walk_settings(b);
        let (settings, close) = match self.options.check {
            Check::Few => {
                let settings = WalkSettings { max_iterations: FEW, tolerance: CLOSE_ENOUGH, ..walk };
                (settings, CLOSE_ENOUGH as f32)
            }
            _ => (walk, SAME_CHAIN),
        };
        let start = self.walks.checks.is_multiple_of(TIMED).then(Instant::now);
        let found = std::iter::once(None).chain(self.starts(a, b, &seen).map(Some)).find_map(|from| {
            let edge = self.solve(a, b, &seen, from, &settings)?;
            edge.leaves_like(first, last, close).then_some(edge)
        });
        self.walks.nanoseconds[1] += start.map_or(0, |s| TIMED * s.elapsed().as_nanos() as u64);
        self.walks.confirmed += u64::from(found.is_some());
        found
    }
}

/// The light side's end for a walk from `origin`.
fn end_from(origin: DVec3, b: &Endpoint) -> End {
    match b {
        Endpoint::Infinite(d) => End::Direction(d.as_dvec3()),
        _ => End::Point(b.position().as_dvec3() - origin),
    }
}

/// `1/J` between ends that see each other, in the convention of
/// [`crate::manifold::Chain::inverse_jacobian`].
pub(super) fn direct_inverse_jacobian(a: &Endpoint, b: &Endpoint) -> f64 {
    match (a, b) {
        (Endpoint::Infinite(_), _) | (_, Endpoint::Infinite(_)) => 1.0,
        _ => a.position().as_dvec3().distance_squared(b.position().as_dvec3()),
    }
}
