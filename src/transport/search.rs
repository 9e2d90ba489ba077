//! Searches for a chain beside `S(a, b)`, from random directions (Zeltner, Georgiev and Jakob 2020, §4.2).
//!
//! Between a delta light and a pinhole that are both behind glass there are no others, and the smaller a lamp, the seldomer
//! it is hit along the chains that no walk finds. So a connection also searches, now and then, from a random direction:
//! always to delta lights, to others where that is forecast to pay (`crate::render::pilot`). A chain that is found so, and
//! is not `S(a, b)`, counts with the reciprocal of the probability of finding it, estimated without bias by the number of
//! walks until it is found again (ibid.). The weights need a function of the path alone: they presume a probability
//! (`presumed`), and a sampled chain needs no search but one walk, which must stay where it is. Whatever they presume,
//! they sum to one; the worse the guess, the more noise.

use super::Tracer;
use super::caustic::{CausticEdge, direct_inverse_jacobian, end_from};
use super::options::{Check, SEARCH};
use super::sight::Seen;
use crate::camera::Endpoint;
use crate::manifold::{End, WalkSettings, search};
use glam::DVec3;
use std::sync::atomic::Ordering;

/// Most walks of a search. Until a chain is found again takes as many on average as there are chains to find, however
/// hard these are to find; this is far beyond.
const MOST_WALKS: u32 = 1 << 16;

/// Smallest share of the usual probability that is presumed of a search.
const LEAST_PRESUMED: f64 = 1e-3;

impl Tracer<'_> {
    /// Probability with which a connection of these ends searches for one more chain.
    pub(super) fn search_probability(&self, b: &Endpoint, seen: &Seen) -> f32 {
        let delta = self.lights.is_delta(b);
        let probability = self.options.search.unwrap_or(if delta { SEARCH } else { self.search });
        // Through facets where nothing else finds the light, or on demand: panes, too, have their edges.
        let facets = delta || self.options.search.is_some();
        let several = |shape| self.glass.body(shape).is_some_and(|body| body.curved || (facets && body.facets > 0));
        let searches = probability > 0.0
            && self.options.check == Check::Exact
            && seen.seed.crossings().iter().any(|crossing| several(crossing.interface));
        if searches { probability } else { 0.0 }
    }

    /// Share of the starts of a search that is presumed to lead to one chain, for the facets that it crosses: as if each
    /// crossing were through any of its body's, by chance. Rather too small: what else finds a chain is then left to it,
    /// and a chain that nothing else finds has all the weight whatever is presumed.
    pub(super) fn share_of_facet(&self, seen: &Seen) -> f64 {
        let share = |shape| {
            let flat = self.glass.body(shape).filter(|body| !body.curved);
            1.0 / flat.map_or(1.0, |body| f64::from(body.facets.max(1)))
        };
        seen.seed.crossings().iter().map(|crossing| share(crossing.interface)).product()
    }

    /// A chain that is not `known`, if a search finds one, and how many walks it takes to find that again.
    pub(super) fn search(
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
        let before = (self.walks.total(), self.walk_work());
        let stop = self.stop;
        let stopped = || stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
        let mut look = || {
            let start = search(axis, self.caustic_numbers.next_2d().as_dvec2());
            self.solve(a, b, seen, Some(start), settings).ok()
        };
        let found = look().filter(|edge| known.is_none_or(|known| !known.is(edge))).map(|edge| {
            let again = (1..MOST_WALKS).find(|_| stopped() || look().is_some_and(|other| other.is(&edge)));
            (edge, again.unwrap_or(MOST_WALKS))
        });
        self.walks.searches += 1;
        self.walks.discovered += u64::from(found.is_some());
        self.walks.search_walks += self.walks.total() - before.0;
        self.search_work += self.walk_work() - before.1;
        found
    }
}

/// The probability of finding a chain by searches that are made with `probability`, as the weights presume it: the more a
/// chain spreads the light, compared with the straight line, the smaller the bump that does it, and the fewer the starts
/// that lead there. A facet spreads nothing: its `share` ([`Tracer::share_of_facet`]) says it.
pub(super) fn presumed(probability: f64, share: f64, a: &Endpoint, b: &Endpoint, inverse_jacobian: f64) -> f64 {
    let spread = inverse_jacobian.abs() / direct_inverse_jacobian(a, b);
    probability * share * (1.0 / spread).clamp(LEAST_PRESUMED, 1.0)
}
