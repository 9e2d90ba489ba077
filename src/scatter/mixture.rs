//! A sum of lobes, each drawn with a constant probability.
//!
//! Constant probabilities cost some noise against ones that follow the angle, and buy what the
//! weights of bidirectional transport need: the choice of a lobe is as likely from either direction.

use super::lobe::{Lobe, LobeSample};
use super::{BsdfSample, Evaluation, Microfacet, Refraction, TransportMode, side};
use crate::geometry::SurfacePoint;
use crate::math::{Frame, Rgb};
use glam::{Vec2, Vec3};

/// Metal, coat, base, transmission.
const MAX_LOBES: usize = 4;

#[derive(Clone, Copy, Debug)]
struct Entry {
    lobe: Lobe,
    /// Share of the material, which scales the lobe's value.
    share: f32,
    /// Probability that the lobe is drawn.
    probability: f32,
}

/// At most four lobes.
#[derive(Clone, Debug, Default)]
pub(super) struct Mixture {
    entries: [Option<Entry>; MAX_LOBES],
    count: usize,
}

impl Mixture {
    /// A single lobe.
    pub(super) fn one(lobe: Lobe) -> Mixture {
        let mut mixture = Mixture::default();
        mixture.add(lobe, 1.0, 1.0);
        mixture.normalised()
    }

    /// Adds `share` of `lobe`, to be drawn in proportion to `share * importance`. A lobe without a
    /// share or a fifth lobe is left out.
    pub(super) fn add(&mut self, lobe: Lobe, share: f32, importance: f32) {
        let probability = share * importance;
        if probability > 0.0 && self.count < MAX_LOBES {
            self.entries[self.count] = Some(Entry { lobe, share, probability });
            self.count += 1;
        }
    }

    /// Makes the probabilities sum to one.
    pub(super) fn normalised(mut self) -> Mixture {
        let total: f32 = self.iter().map(|e| e.probability).sum();
        for entry in self.entries.iter_mut().flatten() {
            entry.probability /= total;
        }
        self
    }

    #[inline]
    fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.entries[..self.count].iter().flatten()
    }

    /// What walks find of the dielectric lobe.
    pub(super) fn refraction(&self) -> Option<Refraction> {
        self.iter().find_map(|e| {
            let (tint, alpha) = match &e.lobe {
                Lobe::SmoothDielectric(l) => (l.interface.tint, 0.0),
                Lobe::RoughDielectric(l) if l.walked => (l.interface.tint, l.ggx.alpha()),
                _ => return None,
            };
            Some(Refraction { albedo: tint * e.share, probability: e.probability, alpha })
        })
    }

    /// Makes walks lead through a rough dielectric lobe narrower than `alpha`; whether there is one.
    pub(super) fn walk_rough(&mut self, alpha: f32) -> bool {
        let mut any = false;
        for entry in self.entries.iter_mut().flatten() {
            if let Lobe::RoughDielectric(l) = &mut entry.lobe {
                l.walked = l.ggx.alpha() < alpha;
                any |= l.walked;
            }
        }
        any
    }

    /// See [`super::Bsdf::albedo`].
    pub(super) fn albedo(&self) -> Rgb {
        self.iter().map(|e| e.lobe.color() * e.share).sum::<Rgb>().min(Rgb::ONE)
    }

    /// The lobes, in the order they were added.
    pub(super) fn lobes(&self) -> impl Iterator<Item = &Lobe> {
        self.iter().map(|e| &e.lobe)
    }

    /// The lobe, if there is one only.
    pub(super) fn only(&self) -> Option<&Lobe> {
        self.lobes().next().filter(|_| self.count == 1)
    }

    /// The entry for a uniform number, and the number's position within it.
    #[inline]
    fn choose(&self, u: f32) -> Option<(&Entry, f32)> {
        let mut rest = u;
        for (i, entry) in self.iter().enumerate() {
            if rest < entry.probability || i + 1 == self.count {
                return Some((entry, (rest / entry.probability).clamp(0.0, 1.0 - f32::EPSILON)));
            }
            rest -= entry.probability;
        }
        None
    }

    pub(super) fn sample(
        &self,
        at: &SurfacePoint,
        wo: Vec3,
        mode: TransportMode,
        u_lobe: f32,
        u: Vec2,
    ) -> Option<BsdfSample> {
        let front = side(at, wo)? > 0.0;
        let frame = Frame::around(if front { at.ns } else { -at.ns });
        let (entry, u_branch) = self.choose(u_lobe)?;
        match entry.lobe.sample(frame.to_local(wo), front, mode, u_branch, u)? {
            LobeSample::Delta(d) => {
                let wi = frame.to_world(d.wi).normalize();
                // The world's directions decide on the side, not the local ones.
                let crossed = (side(at, wi)? > 0.0) != front;
                (crossed == d.transmitted).then_some(BsdfSample {
                    wi,
                    weight: d.weight * (entry.share / entry.probability),
                    pdf: entry.probability * d.probability,
                    connectable: false,
                    transmitted: d.transmitted,
                    microfacet: d.microfacet.map(|m| Microfacet { normal: frame.to_world(m.normal).normalize(), ..m }),
                })
            }
            LobeSample::Connectable(wi) => {
                // Evaluated on the direction that transport gets to see: what a connection along it
                // would find, to the last bit.
                let wi = frame.to_world(wi).normalize();
                let cos = side(at, wi)?;
                let e = self.evaluate(at, wo, wi, mode);
                (e.pdf > 0.0).then(|| BsdfSample {
                    wi,
                    weight: e.f * (cos.abs() / e.pdf),
                    pdf: e.pdf,
                    connectable: true,
                    transmitted: (cos > 0.0) != front,
                    microfacet: None,
                })
            }
        }
    }

    pub(super) fn evaluate(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3, mode: TransportMode) -> Evaluation {
        let mut sum = Evaluation::default();
        let (Some(cos_o), Some(_)) = (side(at, wo), side(at, wi)) else {
            return sum;
        };
        let front = cos_o > 0.0;
        let frame = Frame::around(if front { at.ns } else { -at.ns });
        let (wo, wi) = (frame.to_local(wo), frame.to_local(wi));
        for entry in self.iter() {
            let e = entry.lobe.evaluate(wo, wi, front, mode);
            sum.f += e.f * Rgb::splat(entry.share);
            sum.pdf += e.pdf * entry.probability;
            sum.pdf_reverse += e.pdf_reverse * entry.probability;
        }
        sum
    }
}
