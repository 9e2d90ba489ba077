//! Caustic connections (Speierer et al. 2018, §3, Algorithm 1): where the segment between two
//! connectable vertices crosses refracting surfaces (`sight.rs`), a manifold walk from that segment finds the path
//! through them.
//!
//! `S(a, b)` is one pure function of the ordered pair, camera side first: the chain to which the walk from the
//! straight segment leads or, where that finds none, the first one from two other starts. Connections use it; and when
//! a subpath has sampled a chain, the same walks decide whether it is that one, and so whether the technique counts in
//! the weights (§3.3.1's check, run to convergence: fewer iterations are biased). The paper has the first walk alone.
//! What the walks miss is left to the other techniques, and so to their noise, or to `search.rs`.

use super::Tracer;
use super::interfaces::Refractors;
use super::options::{Check, FEW, GeometryTerm, HURRIED, MOST_SEEDS};
use super::search::presumed;
use super::sight::{Seen, Sight, segment};
use super::walk_count::REASONS;
use crate::camera::Endpoint;
use crate::manifold::{End, MAX_CHAIN, Rejection, Source, Tilt, WalkSettings, starts, walk};
use crate::math::Rgb;
use glam::{DVec3, Vec3};
use std::cell::Cell;
use std::time::Instant;

/// Largest difference of the directions at an end, in radians, for two chains to be the same. Two
/// solutions this close lie within the square of it of a fold, where there is no energy to speak of.
const SAME_CHAIN: f32 = 1e-4;

/// Error of a sampled chain's vertices, over the coordinates of its ends: roundings to f32, which count many times near a
/// caustic. With 2e-6 one chain in some thousand was missed 512 m from the origin; more costs a walk now and then.
const ROUNDING: f64 = 6.4e-5;

/// Largest angle that is laid on rounding, and so what a walk from the sampled chain may cost: beyond, it is one more path
/// by its looks, and within the walk decides. With 0.1 a few chains at a contact were still missed (see above).
const MOST_ROUNDED: f32 = 0.2;

/// "Close enough" for [`Check::Few`]: largest deviation from Snell's law, and from the sampled
/// directions, in radians.
const CLOSE_ENOUGH: f64 = 0.02;

/// Most steps of a walk from another start: those that arrive are quick. Error of the caustics, times time: with 24
/// 0 to 4 % more (water, eye, eye_small, figure4b), with 8 instead 8 % more on water, 0 to 2 % less on the others.
const ANOTHER: u32 = 12;

/// One walk of so many is timed.
const TIMED: u64 = 16;

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
    /// The interface next to that end.
    pub exit: Vec3,
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
    /// How far a sampled chain's directions at the ends may be off, in radians.
    pub rounding: f32,
    /// Whether all of its interfaces are smooth.
    pub smooth: bool,
    /// Whether it was found from another start than the straight segment.
    pub retried: bool,
    /// Whether a search found it.
    pub searched: bool,
    /// Reciprocal of the probability with which a connection finds it, or an estimate of that without bias.
    pub attempt: f32,
    /// What stands for that probability in the weights: 1 unless a search found it.
    pub presumed: f64,
}

impl CausticEdge {
    /// Whether both walks found the same chain.
    #[inline]
    pub(super) fn is(&self, other: &CausticEdge) -> bool {
        self.leaves_like(other.first, other.last, SAME_CHAIN)
    }

    /// Whether its directions at both ends are these, within an angle in radians.
    #[inline]
    fn leaves_like(&self, first: Vec3, last: Vec3, angle: f32) -> bool {
        self.first.distance(first) < angle && self.last.distance(last) < angle
    }

    /// See [`super::vertex::EdgeRecord::sure`].
    #[inline]
    pub fn sure(&self) -> bool {
        self.smooth && self.presumed == 1.0
    }

    /// `n_a² kappa cos_a / (n_b² cos_b)`: the reverse Jacobian over the forward one, in the weights.
    #[inline]
    pub fn etendue_ratio(&self, cos_a: f64, cos_b: f64) -> f64 {
        self.weight_etendue * cos_a / cos_b
    }
}

impl Tracer<'_> {
    /// The walk to `b`: patient where nothing else finds the path.
    fn walk_settings(&self, b: &Endpoint) -> WalkSettings {
        // A camera's path samples chains that end there, whatever the walk finds.
        let walk = self.options.walk;
        let most = if self.lights.is_delta(b) { walk.max_iterations } else { walk.max_iterations.min(HURRIED) };
        WalkSettings { max_iterations: self.options.max_iterations.unwrap_or(most), ..walk }
    }

    /// The unobstructed chain from `a` (camera side) to `b` (light side) to which the walk leads from the straight
    /// segment or from `start`, or why the walk failed, if it did.
    pub(super) fn solve(
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
        let (mut from, mut exit) = (*a, a.position());
        let vertices = crossings.iter().zip(chain.vertices());
        let stops = vertices.map(|(crossing, vertex)| refractors.surface_point(crossing.interface, vertex));
        let (mut transmittance, mut probability) = (Rgb::splat(chain.transmittance as f32), chain.density);
        for crossed in stops.map(Some).chain(std::iter::once(None)) {
            let to = crossed.map_or(*b, Endpoint::Surface);
            if !segment(&from, &to).is_some_and(|ray| self.visible(&ray)) {
                self.walks.occluded += 1;
                return Err(None);
            }
            if let Some(at) = &crossed {
                let refraction = self.bsdf(at, &mut None).walked_refraction().ok_or(None)?;
                transmittance *= refraction.albedo;
                probability = probability.map(|p| p * f64::from(refraction.probability));
            }
            (exit, from) = (from.position(), to);
        }
        let reach = a.position().abs().max(b.position().abs()).max_element();
        let lengths = chain.lengths();
        let shortest = lengths[0].min(lengths[lengths.len() - 1]);
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
            exit,
            inverse_jacobian: chain.inverse_jacobian,
            weight_inverse_jacobian,
            weight_etendue,
            kappa: chain.kappa,
            index_ratio,
            transmittance,
            probability,
            rounding: ((ROUNDING * f64::from(reach) / shortest) as f32).min(MOST_ROUNDED),
            smooth: seen.rough().next().is_none(),
            retried: false,
            searched: false,
            attempt: 1.0,
            presumed: 1.0,
        };
        for (i, crossing) in crossings.iter().enumerate() {
            edge.shapes[i] = crossing.interface;
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
        let by_default = || if self.lights.is_delta(b) { MOST_SEEDS } else { self.seeds };
        self.options.seeds.unwrap_or_else(by_default)
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

    /// What a connection joins two ends by: `S(a, b)`, and what a search finds beside. At rough surfaces they refract at
    /// microfacets that are drawn here.
    pub(super) fn connect_chains(&mut self, a: &Endpoint, b: &Endpoint, seen: &mut Seen) -> [Option<CausticEdge>; 2] {
        self.walks.connections += 1;
        for (i, alpha) in seen.rough() {
            let u = self.caustic_numbers.next_2d().as_dvec2();
            seen.seed.tilt(i, Tilt::sample(seen.seed.vertices()[i].ns, alpha, u));
        }
        let start = self.start_clock(0);
        let settings = self.walk_settings(b);
        let known = self.chain(a, b, seen, &settings);
        let probability = self.search_probability(b, seen);
        let searches = probability > 0.0 && self.caustic_numbers.next_1d() < probability;
        let found = if searches { self.search(a, b, seen, known.as_ref(), &settings) } else { None };
        let other = found.map(|(edge, walks)| CausticEdge {
            attempt: walks as f32 / probability,
            presumed: presumed(probability.into(), self.share_of_facet(seen), a, b, edge.inverse_jacobian),
            searched: true,
            ..edge
        });
        self.walks.nanoseconds[0] += start.map_or(0, |s| TIMED * s.elapsed().as_nanos() as u64);
        self.walks.connected += u64::from(known.is_some() || other.is_some());
        [known, other]
    }

    /// Now, once in [`TIMED`] connections (0) or checks (1), the first included.
    fn start_clock(&mut self, kind: usize) -> Option<Instant> {
        let timed = self.begun[kind].is_multiple_of(TIMED);
        self.begun[kind] += 1;
        timed.then(Instant::now)
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
        let start = self.start_clock(1);
        let like = |edge: &CausticEdge| edge.leaves_like(first, last, close);
        let known = self.chain(a, b, &seen, &settings);
        let probability = self.search_probability(b, &seen);
        let along = first.as_dvec3().normalize();
        let found = known
            .filter(|known| {
                // Where rounding hides which of several it is, a walk that starts there tells.
                let rounded = self.options.check == Check::Exact && known.leaves_like(first, last, known.rounding);
                let mut exact = || self.solve(a, b, &seen, Some(along), &settings).ok();
                like(known) || (rounded && exact().is_some_and(|edge| edge.is(known)))
            })
            .or_else(|| {
                // A search might find it if a walk that starts there stays there.
                if probability == 0.0 {
                    return None;
                }
                let before = self.walk_work();
                let edge = self.solve(a, b, &seen, Some(along), &settings).ok();
                self.search_work += self.walk_work() - before;
                let edge = edge.filter(|edge| edge.leaves_like(first, last, close.max(edge.rounding)))?;
                let share = self.share_of_facet(&seen);
                Some(CausticEdge { presumed: presumed(probability.into(), share, a, b, edge.inverse_jacobian), ..edge })
            });
        self.walks.nanoseconds[1] += start.map_or(0, |s| TIMED * s.elapsed().as_nanos() as u64);
        self.walks.confirmed += u64::from(found.is_some());
        found
    }
}

/// The light side's end for a walk from `origin`.
pub(super) fn end_from(origin: DVec3, b: &Endpoint) -> End {
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
