//! A macro-edge under construction: the way of a subpath from one connectable vertex to the next, with
//! the chain between them and what the weights need to know of both ends (Speierer et al. 2018, §3.3).

use super::Tracer;
use super::caustic::direct_inverse_jacobian;
use super::options::{Check, GeometryTerm};
use super::subpath::Walk;
use super::vertex::EdgeRecord;
use super::weight::{MacroEdge, Partial};
use crate::camera::Endpoint;
use crate::manifold::MAX_CHAIN;
use crate::scatter::TransportMode;
use crate::scene::description::Medium;
use crate::scene::media::MediumId;
use glam::Vec3;

/// From where a macro-edge leaves.
pub(super) enum Departure {
    /// The camera. Its density is per perpendicular area at the next vertex.
    Camera,
    /// A light.
    Light,
    /// A connectable surface vertex: its index in the subpath, and the density of the direction as
    /// sampled, for the rare case that the rounded direction has none.
    Vertex { index: usize, sampled_density: f32 },
}

/// The macro-edge under construction.
pub(super) struct OpenEdge {
    pub(super) departure: Departure,
    /// Position of the old end; unused when it is at infinity.
    pub(super) origin: Vec3,
    /// Density of the departure: per solid angle, or per perpendicular area from the camera or from
    /// infinity.
    pub(super) forward: f64,
    pub(super) forward_is_area: bool,
    /// The old vertex's `e` or `g`.
    pub(super) remainder: f64,
    /// The part of that which needs no light subpath, of a light subpath's vertex.
    pub(super) camera_only: f64,
    /// Geometric cosine at the old end; 1 at a point or at infinity.
    pub(super) cos: f64,
    pub(super) at_infinity: bool,
    pub(super) medium: MediumId,
    pub(super) chain: u32,
    /// Of scattering along the chain, and against the walk.
    pub(super) probability: [f64; 2],
    pub(super) kappa: f64,
    pub(super) direction: Vec3,
    /// Shapes of the chain, as far as they fit.
    pub(super) shapes: [u32; MAX_CHAIN],
    /// Whether the chain has nothing but refractions.
    pub(super) refracted: bool,
}

impl OpenEdge {
    pub(super) fn new(departure: Departure, origin: Vec3, medium: MediumId) -> OpenEdge {
        OpenEdge {
            departure,
            origin,
            forward: 0.0,
            forward_is_area: false,
            remainder: 0.0,
            camera_only: 0.0,
            cos: 1.0,
            at_infinity: false,
            medium,
            chain: 0,
            probability: [1.0; 2],
            kappa: 1.0,
            direction: Vec3::ZERO,
            shapes: [0; MAX_CHAIN],
            refracted: true,
        }
    }

    /// Samples of next-event estimation across it, if it ends at a light: none from the camera, which has no vertex there.
    pub(super) fn next_events(&self) -> f64 {
        if matches!(self.departure, Departure::Camera) { 0.0 } else { 1.0 }
    }

    /// Densities of the closed edge: (forward area density, reverse geometry), and the record.
    /// `cos_end` is 1 and `end` infinite for the environment.
    fn densities(
        &self,
        media: &[Medium],
        term: GeometryTerm,
        mode: TransportMode,
        end: &EdgeEnd,
    ) -> (f64, f64, EdgeRecord) {
        let [along, against] = self.probability;
        let mut record = EdgeRecord {
            chain: self.chain,
            shapes: self.shapes,
            refracted: self.refracted,
            chain_probability: [along, against],
            etendue_ratio: 0.0,
            technique: 1.0,
            sure: self.chain == 0,
            departure: self.direction,
        };
        let forward = self.forward * along;
        if self.chain == 0 {
            let (to_end, to_start) = if end.at_infinity {
                (1.0, self.cos)
            } else {
                let d2 = end.distance_squared;
                let to_end = if self.forward_is_area { end.cos } else { end.cos / d2 };
                (to_end, if self.at_infinity { 1.0 } else { self.cos / d2 })
            };
            return (forward * to_end, to_start, record);
        }
        // Every technique but the one that spans the chain has either its forward or its reverse
        // density, and so the factor J = d omega_a / d A_b: it is left out of both, and the technique
        // across the chain counts 1/J instead. What remains is the étendue identity
        // n_b² cos_b J_ba = n_a² kappa cos_a J_ab.
        let index_squared = |m: MediumId| match term {
            GeometryTerm::Exact => (media[m as usize].ior as f64).powi(2),
            GeometryTerm::Direct => 1.0,
        };
        let (start, here) = (index_squared(self.medium), index_squared(end.medium));
        let kappa = match term {
            GeometryTerm::Exact => self.kappa,
            GeometryTerm::Direct => 1.0,
        };
        match mode {
            TransportMode::Radiance => {
                record.etendue_ratio = start * kappa * self.cos / (here * end.cos);
                (forward, record.etendue_ratio * against, record)
            }
            TransportMode::Importance => {
                record.etendue_ratio = here * kappa * end.cos / (start * self.cos);
                record.chain_probability = [against, along];
                (forward * record.etendue_ratio, against, record)
            }
        }
    }
}

/// The new end of a macro-edge.
pub(super) struct EdgeEnd {
    pub(super) distance_squared: f64,
    pub(super) cos: f64,
    pub(super) at_infinity: bool,
    pub(super) medium: MediumId,
}

impl Tracer<'_> {
    /// Completes the old end of an edge, now that the direction out of it is known; `distance_squared`
    /// is that to the new end, or `None` across a chain or to infinity.
    pub(super) fn leave(
        &self,
        edge: &mut OpenEdge,
        walk: &Walk,
        direction: Vec3,
        distance_squared: Option<f64>,
        receiver: Vec3,
    ) {
        edge.direction = direction;
        match edge.departure {
            Departure::Camera => {
                // At distance 1, the density per perpendicular area is that per solid angle. (Where a chain follows, only
                // the latter has a meaning, and only in an edge that is confirmed, which leaves once more.)
                if let Some(camera) = walk.camera {
                    edge.forward = camera.density(direction, distance_squared.map_or(1.0, f64::sqrt) as f32);
                }
            }
            Departure::Light => {
                let Some(start) = &self.light_start else { return };
                let ray = (direction, edge.origin);
                let densities = self.lights.densities(&self.world.shapes, start.light, &start.at, ray, receiver);
                // At grazing angles the rounded ends may put the receiver behind the light.
                let sampled = start.densities.direction;
                edge.forward = if densities.direction > 0.0 { densities.direction } else { sampled };
                if let Endpoint::Surface(at) = &start.at {
                    edge.cos = at.ng.dot(direction).abs() as f64;
                }
            }
            Departure::Vertex { index, sampled_density } => {
                let vertex = match walk.mode {
                    TransportMode::Radiance => &self.camera_vertices[index],
                    TransportMode::Importance => &self.light_vertices[index],
                };
                let value = self.evaluate(vertex, direction, walk.mode);
                edge.forward = if value.pdf > 0.0 { value.pdf } else { sampled_density } as f64;
                edge.remainder = vertex.partial.at(value.pdf_reverse as f64);
                edge.camera_only = vertex.camera_only.at(value.pdf_reverse as f64);
                edge.cos = vertex.cos_g(direction) as f64;
            }
        }
    }

    /// Closes an edge at `end`, a vertex or light that is reached against the direction `wo`. Where a
    /// connection would have found the edge's chain, the connection's version of it replaces the
    /// sampled one, and `wo` with it: both are the same path, but for the rounding of the walk's f32
    /// positions, and now to the last bit. `count` is the number of samples of the technique across the edge; a light's
    /// own next-event estimation always counts 1. Beside the vertex's partial, the part of it that needs no light
    /// subpath, which makes sense for light subpaths.
    pub(super) fn close(
        &mut self,
        edge: &mut OpenEdge,
        walk: &Walk,
        end: &mut EdgeEnd,
        at: &Endpoint,
        count: f64,
        wo: &mut Vec3,
    ) -> (Partial, Partial, EdgeRecord) {
        let (mut technique, mut sure) = if edge.chain == 0 { (1.0, true) } else { (0.0, false) };
        if edge.chain > 0 && count > 0.0 && self.caustics && edge.refracted && edge.chain as usize <= MAX_CHAIN {
            (technique, sure) = self.confirm_edge(edge, walk, end, at, wo);
        }
        let (forward, reverse_geometry, mut record) =
            edge.densities(self.media, self.options.geometry_term, walk.mode, end);
        (record.technique, record.sure) = (technique, sure);
        let (remainder, camera_only) = (edge.remainder, edge.camera_only);
        let (edge, camera_only) = match (&edge.departure, &self.light_start) {
            (Departure::Light, Some(start)) => {
                let lights = &self.lights;
                let direct = lights.direct_density(&self.world.shapes, start.light, &start.at, at.position());
                let (position, hittable) = (start.densities.position, start.densities.hittable);
                let first = MacroEdge::from_light(technique, forward, reverse_geometry, direct, position, hittable);
                (first, first)
            }
            _ => {
                let next = |technique, remainder| MacroEdge { technique, forward, reverse_geometry, remainder };
                (next(technique * count, remainder), next(0.0, camera_only))
            }
        };
        (edge.close(), camera_only.close(), record)
    }

    /// The end that an edge left; `None` where no connection from there is ever made through glass.
    fn start_of(&self, edge: &OpenEdge, mode: TransportMode) -> Option<Endpoint> {
        match &edge.departure {
            Departure::Camera if self.camera_caustics => Some(Endpoint::Point(edge.origin)),
            Departure::Camera => None,
            Departure::Light => self.light_start.as_ref().map(|l| l.at),
            Departure::Vertex { index, .. } => Some(Endpoint::Surface(match mode {
                TransportMode::Radiance => self.camera_vertices[*index].at,
                TransportMode::Importance => self.light_vertices[*index].at,
            })),
        }
    }

    /// The consistency check: `1/J` if `S(camera side, light side)` is the sampled chain, a share of it if a search
    /// might find it, else 0; and whether it is [`EdgeRecord::sure`].
    fn confirm_edge(
        &mut self,
        edge: &mut OpenEdge,
        walk: &Walk,
        end: &mut EdgeEnd,
        at: &Endpoint,
        wo: &mut Vec3,
    ) -> (f64, bool) {
        let mode = walk.mode;
        let Some(start) = self.start_of(edge, mode) else { return (0.0, false) };
        let cos_b = |edge: &OpenEdge, end: &EdgeEnd| match mode {
            TransportMode::Radiance => end.cos,
            TransportMode::Importance => edge.cos,
        };
        if self.options.check == Check::Off {
            let smooth = |shape: &u32| self.factors(*shape).walked_refraction().is_some_and(|r| r.alpha == 0.0);
            let sure = edge.shapes[..edge.chain as usize].iter().all(smooth);
            self.leave(edge, walk, edge.direction, None, at.position());
            return (direct_inverse_jacobian(&start, at) / cos_b(edge, end), sure);
        }
        // Copies: the chain may go on from here.
        let (mut shapes, mut microfacets) = (edge.shapes, self.microfacets);
        let (shapes, microfacets) = (&mut shapes[..edge.chain as usize], &mut microfacets[..edge.chain as usize]);
        let found = match mode {
            TransportMode::Radiance => self.confirm(&start, at, shapes, microfacets, edge.direction, *wo),
            TransportMode::Importance => {
                shapes.reverse();
                microfacets.reverse();
                self.confirm(at, &start, shapes, microfacets, *wo, edge.direction)
            }
        };
        let Some(found) = found else { return (0.0, false) };
        let exact = self.options.check == Check::Exact;
        let (departure, arrival) = match mode {
            _ if !exact => (edge.direction, *wo),
            TransportMode::Radiance => (found.first, found.last),
            TransportMode::Importance => (found.last, found.first),
        };
        self.leave(edge, walk, departure, None, at.position());
        if exact {
            if let Endpoint::Surface(at) = at {
                end.cos = f64::from(at.ng.dot(arrival).abs());
            }
            *wo = arrival;
            edge.kappa = found.kappa;
            let [toward_light, toward_camera] = found.probability;
            edge.probability = match mode {
                TransportMode::Radiance => [toward_light, toward_camera],
                TransportMode::Importance => [toward_camera, toward_light],
            };
        }
        (found.presumed * found.weight_inverse_jacobian / cos_b(edge, end), found.sure())
    }
}
