//! The seed of a walk: what the straight segment between the ends crosses.

use super::MAX_CHAIN;
use super::walk::Rejection;
use crate::geometry::Differential;

/// One crossing of the straight segment with a refracting interface. Number, order, interfaces and
/// media of the crossings stay as they are during the walk; the positions are initial values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The interface: a whole shape, not a triangle.
    pub interface: u32,
    /// From the front of the surface to its back.
    pub inward: bool,
    /// Refractive index before.
    pub n_i: f64,
    /// Refractive index after.
    pub n_o: f64,
}

impl Crossing {
    pub(super) const NONE: Crossing = Crossing { interface: 0, inward: true, n_i: 1.0, n_o: 1.0 };
}

/// The crossings in their order from `a` to `b`, with the surface at each, relative to `a`.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    len: usize,
    crossings: [Crossing; MAX_CHAIN],
    vertices: [Differential; MAX_CHAIN],
}

impl Default for Seed {
    fn default() -> Self {
        Seed { len: 0, crossings: [Crossing::NONE; MAX_CHAIN], vertices: [Differential::FLAT; MAX_CHAIN] }
    }
}

impl Seed {
    /// Appends the next crossing on the way from `a` to `b`. Refused where the chain is full or where the
    /// medium before is not the one that the last crossing led into.
    #[inline]
    pub fn push(&mut self, crossing: Crossing, at: &Differential) -> Result<(), Rejection> {
        if self.len == MAX_CHAIN {
            return Err(Rejection::TooLong);
        }
        if self.crossings().last().is_some_and(|last| last.n_o != crossing.n_i) {
            return Err(Rejection::Media);
        }
        self.crossings[self.len] = crossing;
        self.vertices[self.len] = *at;
        self.len += 1;
        Ok(())
    }

    /// The crossings.
    #[inline]
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings[..self.len]
    }

    /// The surface at each crossing.
    #[inline]
    pub fn vertices(&self) -> &[Differential] {
        &self.vertices[..self.len]
    }
}
