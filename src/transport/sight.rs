//! What the straight segment between two vertices meets: Algorithm 1's visibility test (Speierer et al. 2018, §3) and,
//! where refracting surfaces block it, the seed of a walk through them. Opaque surfaces on the segment do not
//! matter, only those on the path; in the paper they do.

use super::Tracer;
use crate::camera::Endpoint;
use crate::geometry::{Ray, Shape, SurfacePoint};
use crate::manifold::{Crossing, MAX_CHAIN, Seed};
use crate::scene::media::MediumId;
use glam::DVec3;

/// Opaque surfaces that the straight segment may cross: light that glass bends passes beside them, as the
/// light that reaches an iris from the side does, for which the straight line runs through the sclera.
/// Without this those paths are left to techniques that seldom find them (eye_small: 115 times the error).
const MOST_OPAQUE: u32 = 8;

/// What lies between two ends.
pub(super) enum Sight {
    /// Nothing.
    Clear,
    /// Something opaque, or a chain that cannot be walked.
    Blocked,
    /// Refracting surfaces, and perhaps opaque ones.
    Refracted(Box<Seen>),
}

/// The refracting surfaces on a straight segment.
#[derive(Default)]
pub(super) struct Seen {
    pub(super) seed: Seed,
    /// Medium of each segment.
    pub(super) media: [MediumId; MAX_CHAIN + 1],
    /// Width of each crossing's distribution of microfacet normals; 0 where it is smooth.
    alphas: [f32; MAX_CHAIN],
}

impl Seen {
    /// Segments of a path through the chain: one more than it has vertices.
    pub(super) fn segments(&self) -> u32 {
        self.seed.crossings().len() as u32 + 1
    }

    /// The rough crossings, with the width of their distribution of normals.
    pub(super) fn rough(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let rough = (0..).zip(self.alphas).filter(|(_, alpha)| *alpha > 0.0);
        rough.map(|(i, alpha)| (i, f64::from(alpha)))
    }
}

/// The open segment between two ends; neither is its own occluder.
pub(super) fn segment(a: &Endpoint, b: &Endpoint) -> Option<Ray> {
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
    /// The segment, if there may be glass on it.
    #[inline]
    pub(super) fn toward_glass(&self, a: &Endpoint, b: &Endpoint) -> Option<Ray> {
        segment(a, b).filter(|ray| self.glass.on(ray))
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
            let bsdf = self.factors(hit.shape);
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
            let index = |m: MediumId| f64::from(self.media[m as usize].ior);
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
}
