//! Choosing one of n things with given probabilities.

/// A discrete distribution, sampled by bisection of its cumulative sum (f64: the probabilities of a
/// million triangles still sum to one).
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    /// Cumulative probabilities; `cdf[0] = 0`, the last is 1.
    cdf: Vec<f64>,
    /// The sum of the weights before normalisation.
    total: f64,
}

impl Discrete {
    /// From non-negative finite weights, at least one of them positive; `None` otherwise.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Discrete> {
        let mut cdf = vec![0.0];
        let mut total = 0.0;
        for w in weights {
            if !(w >= 0.0 && w.is_finite()) {
                return None;
            }
            total += w;
            cdf.push(total);
        }
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        for c in &mut cdf {
            *c /= total;
        }
        Some(Discrete { cdf, total })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cdf.len().saturating_sub(1)
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sum of the weights given to [`Discrete::new`].
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Probability of entry `i`.
    #[inline]
    pub fn probability(&self, i: usize) -> f32 {
        (self.cdf[i + 1] - self.cdf[i]) as f32
    }

    /// An entry for a uniform number in `[0, 1)`; never one of probability 0.
    #[inline]
    pub fn sample(&self, u: f64) -> usize {
        if self.cdf.len() == 2 {
            return 0;
        }
        self.cdf[1..].partition_point(|&c| c <= u).min(self.len() - 1)
    }

    /// Like [`Discrete::sample`], returning also the number's position within the chosen entry,
    /// again uniform in `[0, 1)`, so that one random number serves two decisions.
    #[inline]
    pub fn sample_reuse(&self, u: f64) -> (usize, f32) {
        let i = self.sample(u);
        let width = self.cdf[i + 1] - self.cdf[i];
        let rest = if width > 0.0 { (u - self.cdf[i]) / width } else { 0.0 };
        (i, (rest as f32).clamp(0.0, 1.0 - f32::EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_follow_the_weights_and_empty_entries_are_never_drawn() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 0.0]).unwrap();
        let n = 4000;
        let mut counts = [0; 5];
        for k in 0..n {
            let (i, rest) = d.sample_reuse((f64::from(k) + 0.5) / f64::from(n));
            assert!((0.0..1.0).contains(&rest));
            counts[i] += 1;
        }
        assert_eq!(counts, [0, 1000, 0, 3000, 0]);
        assert_eq!(d.probability(3), 0.75);
        assert_eq!(d.sample(0.0), 1);
    }

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        assert!(Discrete::new([]).is_none());
        assert!(Discrete::new([0.0]).is_none());
        assert!(Discrete::new([1.0, -1.0]).is_none());
        assert!(Discrete::new([f64::NAN]).is_none());
    }
}
