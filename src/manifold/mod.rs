//! Specular manifolds: the refracted path between two fixed ends, and how it spreads light.
//!
//! A chain of refractions `x_1 .. x_n` between an end `a` on the camera's side and an end `b` on the
//! light's side obeys Snell's law at each vertex: `2n` equations for `2n` unknowns. Newton's method
//! finds it from the straight segment (Jakob and Marschner 2012; Hanika, Droske and Fascione 2015), and
//! ray differentials (Igehy 1999) give the density with which it links the ends, the generalised
//! geometry term.
//!
//! Nothing here knows of paths or weights; surfaces come in through [`Interfaces`]. The walk is one
//! pure function of the ordered pair of ends: no random numbers, no state. Its result may decide
//! whether a strategy could have made a path, so any change of it changes that decision.
//!
//! **Frame.** All positions are in f64 relative to `a`, which is the origin; subtract it from the scene's
//! data before the first operation. Lengths are not rescaled: every formula is homogeneous in them and
//! every threshold relative, so that scaling the scene by a power of two scales the result exactly.
//!
//! **Using it.** A connection collects the crossings of the straight segment in a [`Seed`], walks, and tests
//! whether the segments of the [`Chain`] are free. A chain that was sampled instead goes vertex by vertex
//! through a [`RayDifferential`] and [`Passage`]s, then through the same walk, camera side first, to see
//! whether a connection would have found it. Triangles and spheres come from
//! [`crate::geometry::differential`]: a hit names the primitive, and the crossing is computed anew in f64.
//!
//! **Notation.** Directions of travel run from `a` to `b`. `n_i`, `n_o` are the absolute refractive
//! indices before and after a vertex. A segment is kept as direction and length rather than as the
//! difference of two positions, which would lose the direction across a thin shell.

pub mod geometry_term;
pub mod refraction;
pub mod rough;
pub mod seed;
pub mod walk;

mod constraint;
mod newton;

#[cfg(test)]
mod tests;

pub use geometry_term::RayDifferential;
pub use refraction::Passage;
pub use rough::Tilt;
pub use seed::{Crossing, OTHER_STARTS, Seed, search, starts};
pub use walk::{Chain, Rejected, Rejection, WalkSettings, walk};

use crate::geometry::Differential;
use glam::DVec3;

/// Most refractions in one chain.
pub const MAX_CHAIN: usize = 6;

/// A primitive on which a ray starts, and which it therefore does not meet again where it starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// The interface.
    pub interface: u32,
    /// The primitive within it.
    pub primitive: u32,
}

/// A ray of the walk, relative to `a`.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// Start.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Where it starts, if on an interface.
    pub source: Option<Source>,
    /// Primitive of the interface that the step before met, if there was one: near a solution it is met again as a rule.
    pub hint: Option<u32>,
}

/// The surfaces that refract, as the walk asks for them.
pub trait Interfaces {
    /// The first crossing, ahead of the ray's start, with one interface, a whole shape: the distance and
    /// the surface there, relative to `a`. Other shapes are ignored. A ray that starts on this interface
    /// skips its source triangle, or the near side of its source sphere. Where the ray meets the primitive
    /// of its hint, that crossing may be returned although another comes first: what lies in the way of the
    /// finished chain is tested anyhow.
    fn meet(&self, interface: u32, probe: &Probe) -> Option<(f64, Differential)>;
}

/// The light side's end of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// A point, relative to `a`: on a surface, or a point light.
    Point(DVec3),
    /// Infinitely far away: the unit direction from the scene toward the light.
    Direction(DVec3),
}
