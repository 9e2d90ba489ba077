//! Caustic connections (Speierer et al. 2018, §3, Algorithm 1): where the segment between two
//! connectable vertices crosses refracting surfaces, a manifold walk from that segment finds the path
//! through them. Opaque surfaces on the segment do not matter, only those on the path; in the paper they
//! do.
//!
//! `S(a, b)` is one pure function of the ordered pair, camera side first: the chain to which the walk from the
//! straight segment leads or, where that finds none, the first one from two other starts. Connections use it; and when
//! a subpath has sampled a chain, the same walks decide whether it is that one, and so whether the technique counts in
//! the weights (§3.3.1's check, run to convergence: fewer iterations are biased). The paper has the first walk alone.
//! What the walks miss is left to the other techniques, and so to their noise.
//!
//! Between a delta light and a pinhole that are both behind glass there are no others. To such lights a connection also
//! searches, now and then, from a random direction. A chain that is found so, and is not `S(a, b)`, counts with the
//! reciprocal of the probability of finding it, estimated without bias by the number of walks until it is found again
//! (Zeltner, Georgiev and Jakob 2020, §4.2). The weights need a function of the path alone: they presume a probability
//! (`presumed`), and a sampled chain needs no search but one walk, which must stay where it is. Whatever they presume,
//! they sum to one; the worse the guess, the more noise.

use super::Tracer;
use super::interfaces::{Refractors, meets_box};
use super::roulette::Roulette;
use crate::camera::Endpoint;
use crate::geometry::{Ray, Shape, SurfacePoint};
use crate::manifold::{
    Crossing, End, MAX_CHAIN, OTHER_STARTS, Rejection, Seed, Source, Tilt, WalkSettings, search, starts, walk,
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
const MOST_OPAQUE: u32 = 8;

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

/// Most steps of a walk from another start: those that arrive are quick. Error of the caustics, times time: with 24
/// 0 to 4 % more (water, eye, eye_small, figure4b), with 8 instead 8 % more on water, 0 to 2 % less on the others.
const ANOTHER: u32 = 12;

/// Largest [`CausticOptions::seeds`].
pub const MOST_SEEDS: u32 = 1 + OTHER_STARTS as u32;

/// Share that is aimed at glass, where any is. The error of caustics at equal time is about the same from 0.3 to 0.75.
pub const AIM: f32 = 0.5;

/// Largest share that may be aimed: what goes elsewhere would be all noise.
pub const LARGEST_AIM: f32 = 0.95;

/// Largest [`CausticOptions::light_subpaths`]: far beyond what pays.
pub const MOST_LIGHT_SUBPATHS: f32 = 64.0;

/// Smallest: far below what pays.
pub const LEAST_LIGHT_SUBPATHS: f32 = 1e-3;

/// Probability of a search to a light that cannot be hit.
pub const SEARCH: f32 = 0.25;

/// Most walks of a search. Until a chain is found again takes as many on average as there are chains to find, however
/// hard these are to find; this is far beyond.
const MOST_WALKS: u32 = 1 << 16;

/// Smallest share of the usual probability that is presumed of a search.
const LEAST_PRESUMED: f64 = 1e-3;

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
    /// Walks from one pair of ends at most, until one finds a chain: 1 for that from the straight segment, up to
    /// [`MOST_SEEDS`]. By default all to lights that cannot be hit, since nothing else may find that chain, and for
    /// manifold next-event estimation; elsewhere where a few samples before the render forecast that it pays.
    pub seeds: Option<u32>,
    /// Probability with which a connection through curved glass searches for one more chain, with [`Check::Exact`] only.
    /// By default [`SEARCH`] to lights that cannot be hit, else 0; never for manifold next-event estimation.
    pub search: Option<f32>,
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
            seeds: None,
            search: None,
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
            seeds: Some(1),
            search: Some(0.0),
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
    /// Whether it was found from another start than the straight segment.
    pub retried: bool,
    /// Reciprocal of the probability with which a connection finds it, or an estimate of that without bias.
    pub attempt: f32,
    /// What stands for that probability in the weights: 1 unless a search found it.
    pub presumed: f64,
}

impl CausticEdge {
    /// Whether both are the same chain.
    #[inline]
    fn is(&self, other: &CausticEdge) -> bool {
        self.leaves_like(other.first, other.last, SAME_CHAIN)
    }

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
    /// Pairs of ends for which other starts were tried, too.
    pub retried: u64,
    /// Of these, those for which they led to a chain.
    pub rescued: u64,
    /// Connections that searched for one more chain.
    pub searches: u64,
    /// Searches that found one.
    pub discovered: u64,
    /// Walks of searches, which are among all.
    pub search_walks: u64,
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
        self.retried += o.retried;
        self.rescued += o.rescued;
        self.searches += o.searches;
        self.discovered += o.discovered;
        self.search_walks += o.search_walks;
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

    /// The unobstructed chain from `a` (camera side) to `b` (light side) to which the walk leads from the straight
    /// segment or from `start`, or why the walk failed, if it did.
    fn solve(
        &mut self,
        a: &Endpoint,
        b: &Endpoint,
        seen: &Seen,
        start: Option<DVec3>,
        settings: &WalkSettings,
    ) -> Result<CausticEdge, Option<Rejection>> {
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
                return Err(Some(rejected.reason));
            }
        };
        // Every segment must be free.
        let crossings = chain.crossings();
        let mut from = *a;
        let vertices = crossings.iter().zip(chain.vertices());
        let stops =
            vertices.map(|(crossing, vertex)| Endpoint::Surface(refractors.surface_point(crossing.interface, vertex)));
        for to in stops.chain(std::iter::once(*b)) {
            if !segment(&from, &to).is_some_and(|ray| self.visible(&ray)) {
                self.walks.occluded += 1;
                return Err(None);
            }
            from = to;
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
            retried: false,
            attempt: 1.0,
            presumed: 1.0,
        };
        for (i, crossing) in crossings.iter().enumerate() {
            let refraction = self.bsdf(crossing.interface).walked_refraction().ok_or(None)?;
            edge.shapes[i] = crossing.interface;
            edge.transmittance *= refraction.albedo;
            edge.probability = edge.probability.map(|p| p * f64::from(refraction.probability));
        }
        if world.requirements.absorption {
            for (length, medium) in chain.lengths().iter().zip(seen.media) {
                edge.transmittance *= world.transmittance(medium, *length as f32);
            }
        }
        Ok(edge)
    }

    /// Walks from a pair of ends at most.
    fn seeds(&self, b: &Endpoint) -> u32 {
        let by_default = match b {
            Endpoint::Point(_) | Endpoint::Infinite(_) if self.world.requirements.delta_lights => MOST_SEEDS,
            _ => self.seeds,
        };
        self.options.seeds.unwrap_or(by_default)
    }

    /// `S(a, b)`, if there is one.
    fn chain(&mut self, a: &Endpoint, b: &Endpoint, seen: &Seen, settings: &WalkSettings) -> Option<CausticEdge> {
        let reason = match self.solve(a, b, seen, None, settings) {
            Ok(edge) => return Some(edge),
            Err(reason) => reason,
        };
        // Other failures are seldom rescued. By one start in a random direction a chain was found for 29 % of those on the
        // wrong side and 19 % of those without convergence, but 3 % of those with something in the way (water), and 1 %
        // of those past an interface (demo).
        let others = self.seeds(b).saturating_sub(1) as usize;
        if others == 0 || !matches!(reason, Some(Rejection::WrongSide | Rejection::IterationCap)) {
            return None;
        }
        let starts = starts(&seen.seed, end_from(a.position().as_dvec3(), b))?;
        let settings = WalkSettings { max_iterations: settings.max_iterations.min(ANOTHER), ..*settings };
        let before = self.walk_work();
        let found =
            starts.into_iter().take(others).find_map(|start| self.solve(a, b, seen, Some(start), &settings).ok());
        self.retry_work += self.walk_work() - before;
        self.walks.retried += 1;
        self.walks.rescued += u64::from(found.is_some());
        found.map(|edge| CausticEdge { retried: true, ..edge })
    }

    /// Probability with which a connection of these ends searches for one more chain.
    fn search_probability(&self, b: &Endpoint, seen: &Seen) -> f32 {
        let by_default = match b {
            Endpoint::Point(_) | Endpoint::Infinite(_) if self.world.requirements.delta_lights => SEARCH,
            _ => 0.0,
        };
        let probability = self.options.search.unwrap_or(by_default);
        let curved = |shape| {
            let found = self.refractors.binary_search_by_key(&shape, |r| r.shape);
            found.is_ok_and(|i| self.refractors[i].curved)
        };
        let searches = probability > 0.0
            && self.options.check == Check::Exact
            && seen.seed.crossings().iter().any(|crossing| curved(crossing.interface));
        if searches { probability } else { 0.0 }
    }

    /// A chain that is not `known`, if a search finds one, and how many walks it takes to find that again.
    fn search(
        &mut self,
        a: &Endpoint,
        b: &Endpoint,
        seen: &Seen,
        known: Option<&CausticEdge>,
        settings: &WalkSettings,
    ) -> Option<(CausticEdge, u32)> {
        let straight = || match end_from(a.position().as_dvec3(), b) {
            End::Point(b) => b.normalize_or(DVec3::Z),
            End::Direction(d) => d,
        };
        let axis = known.map_or_else(straight, |edge| edge.first.as_dvec3().normalize());
        let before = self.walks.total();
        let mut look = || {
            let start = search(axis, self.roulette.next_2d().as_dvec2());
            self.solve(a, b, seen, Some(start), settings).ok()
        };
        let found = look().filter(|edge| known.is_none_or(|known| !known.is(edge))).map(|edge| {
            let again = (1..MOST_WALKS).find(|_| look().is_some_and(|other| other.is(&edge)));
            (edge, again.unwrap_or(MOST_WALKS))
        });
        self.walks.searches += 1;
        self.walks.discovered += u64::from(found.is_some());
        self.walks.search_walks += self.walks.total() - before;
        found
    }

    /// What a connection joins two ends by: `S(a, b)`, and what a search finds beside. At rough surfaces they refract at
    /// microfacets that are drawn here.
    pub(super) fn connect_chains(&mut self, a: &Endpoint, b: &Endpoint, seen: &mut Seen) -> [Option<CausticEdge>; 2] {
        self.walks.connections += 1;
        for (i, alpha) in seen.rough() {
            let u = self.roulette.next_2d().as_dvec2();
            seen.seed.tilt(i, Tilt::sample(seen.seed.vertices()[i].ns, alpha, u));
        }
        let start = self.walks.connections.is_multiple_of(TIMED).then(Instant::now);
        let settings = self.walk_settings(b);
        let known = self.chain(a, b, seen, &settings);
        let probability = self.search_probability(b, seen);
        let searches = probability > 0.0 && self.roulette.next_1d() < probability;
        let found = if searches { self.search(a, b, seen, known.as_ref(), &settings) } else { None };
        let other = found.map(|(edge, walks)| CausticEdge {
            attempt: walks as f32 / probability,
            presumed: presumed(probability, a, b, edge.inverse_jacobian),
            ..edge
        });
        self.walks.nanoseconds[0] += start.map_or(0, |s| TIMED * s.elapsed().as_nanos() as u64);
        self.walks.connected += u64::from(known.is_some() || other.is_some());
        [known, other]
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
        let like = |edge: &CausticEdge| edge.leaves_like(first, last, close);
        let known = self.chain(a, b, &seen, &settings);
        let probability = self.search_probability(b, &seen);
        let found = known.filter(like).or_else(|| {
            // A search might find it if a walk that starts there stays there.
            let start = (probability > 0.0).then(|| first.as_dvec3().normalize())?;
            let edge = self.solve(a, b, &seen, Some(start), &settings).ok().filter(like)?;
            Some(CausticEdge { presumed: presumed(probability, a, b, edge.inverse_jacobian), ..edge })
        });
        self.walks.nanoseconds[1] += start.map_or(0, |s| TIMED * s.elapsed().as_nanos() as u64);
        self.walks.confirmed += u64::from(found.is_some());
        found
    }
}

/// The probability of finding a chain by searches that are made with `probability`, as the weights presume it: the more a
/// chain spreads the light, compared with the straight line, the smaller the bump that does it, and the fewer the starts
/// that lead there.
fn presumed(probability: f32, a: &Endpoint, b: &Endpoint, inverse_jacobian: f64) -> f64 {
    let spread = inverse_jacobian.abs() / direct_inverse_jacobian(a, b);
    f64::from(probability) * (1.0 / spread).clamp(LEAST_PRESUMED, 1.0)
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
