//! The seed of a walk: what the straight segment between the ends crosses, and where else to start.

use super::walk::Rejection;
use super::{End, MAX_CHAIN, Tilt};
use crate::geometry::Differential;
use crate::geometry::differential::tangents;
use glam::DVec3;

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
    /// Of the rough interfaces.
    tilts: [Option<Tilt>; MAX_CHAIN],
}

impl Default for Seed {
    fn default() -> Self {
        Seed {
            len: 0,
            crossings: [Crossing::NONE; MAX_CHAIN],
            vertices: [Differential::FLAT; MAX_CHAIN],
            tilts: [None; MAX_CHAIN],
        }
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

    /// Sets the microfacet of crossing `i`, whose interface is rough.
    #[inline]
    pub fn tilt(&mut self, i: usize, tilt: Tilt) {
        self.tilts[i] = Some(tilt);
    }

    /// The microfacet of each crossing, if its interface is rough.
    #[inline]
    pub fn tilts(&self) -> &[Option<Tilt>] {
        &self.tilts[..self.len]
    }
}

/// Further starts of walks, see [`starts`].
pub const MAX_STARTS: usize = 5;

/// First directions for further walks through the crossings of a seed. Behind curved glass several paths
/// join the same two ends, three inside the caustic of a lens; the straight segment leads to one of them.
///
/// `near` is the crossing of the straight segment with the first curved interface, `center` and `radius`
/// are those of that interface; all relative to `a`. In the order of use. They lie in the plane of `a`,
/// `end` and the centre and to both sides of it: the roots of a ball or a centred lens lie in that plane or
/// come in a ring. Measured on sampled chains that the straight segment's walk misses, the first one finds
/// 34 to 63 % of them behind lenses, balls and hemispheres, the first three 57 to 83 %, all 73 to 89 %; of
/// those of a cornea 48, 80 and 91 %, of lumpy glass 16, 34 and 46 %, of a wavy water surface, whose
/// neighbours are what its shape has at hand, 14, 29 and 41 %.
pub fn starts(end: End, near: DVec3, center: DVec3, radius: f64) -> [DVec3; MAX_STARTS] {
    let (along, length) = match end {
        End::Point(b) => (b.normalize_or(DVec3::Z), b.length()),
        End::Direction(d) => (d, f64::INFINITY),
    };
    let across = |v: DVec3, axis: DVec3| (v - axis * v.dot(axis)).normalize_or(tangents(axis).0);
    // Around the centre, seen from `a`.
    let axis = center.normalize_or(along);
    let (u, v) = (across(along, axis) * radius, axis.cross(across(along, axis)) * radius);
    // Around the crossing, by no more than the room that there is.
    let room = radius.min(near.length()).min((length - near.length()).max(0.0));
    let w = across(center - near, along) * room;
    [center + u * 0.8, near + w * 0.4, center + (u - v) * 0.6, center + (u + v) * 0.6, near - w * 0.4]
        .map(|target| target.normalize_or(along))
}
