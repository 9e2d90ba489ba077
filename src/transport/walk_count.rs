//! Counts of walks, for statistics.

use crate::manifold::Rejection;

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

    pub(super) fn count_steps(&mut self, iterations: u32, converged: bool) {
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
