//! How caustic connections are made and weighed, and the limits of what may be asked.

use super::roulette::Roulette;
use crate::manifold::{OTHER_STARTS, WalkSettings};

/// Largest [`WalkSettings::tolerance`] of a render: an angle a tenth as large as what tells chains apart.
/// Beyond, the check fails to recognise what connections find, and light is counted twice (at 1e-3 radians
/// 18 % of Figure 4a's caustics).
pub const LARGEST_TOLERANCE: f64 = 1e-5;

/// Smallest: rounding keeps walks from much less, and what never converges finds nothing. With it walks find as many
/// chains as with 1e-8 (water 94 %, eye 50 %, glass_sphere 100 % of the connections), in 0.6 to 0.8 steps more.
pub const LEAST_TOLERANCE: f64 = 1e-13;

/// Largest [`CausticOptions::max_iterations`]: a render can be cancelled between walks, not within one, and so many
/// steps of 1.5 microseconds take 6 ms. Hardly a walk that arrives takes 64.
pub const MOST_ITERATIONS: u32 = 4096;

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

/// Most steps of a walk between ends that other techniques join, too. Of the walks that arrive 1 to 5 %
/// need more, and hopeless ones run to the end: with 24 instead of 64 the error at equal time falls by 1 %
/// (water_glass) to 30 % (lumpy).
pub const HURRIED: u32 = 24;

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

/// Probability of a search to other lights where searches pay. The error at equal time with a quarter, over that with so
/// many, without the worst thousandth of the pixels and with these: 1.06, 1.10 (water_small), 1.15, 0.98 (figure4c_small).
pub const LAMP_SEARCH: f32 = 0.1;

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
    /// [`MOST_SEEDS`]. By default all to lights that cannot be hit, since nothing else may find that chain, and through
    /// curved glass for manifold next-event estimation; elsewhere where a few samples before the render forecast that it pays.
    pub seeds: Option<u32>,
    /// Probability with which a connection through curved or faceted glass searches for one more chain, with
    /// [`Check::Exact`] only.
    /// By default [`SEARCH`] to lights that cannot be hit and, where there is none, [`LAMP_SEARCH`] wherever a few samples
    /// before the render forecast that it pays; never for manifold next-event estimation.
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
