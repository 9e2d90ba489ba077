//! What traces a worker's samples: the scene as a sample sees it, and room for its subpaths.

use super::connect::Joined;
use super::experience::{Experience, Trial};
use super::options::CausticOptions;
use super::ray_count::RayCount;
use super::subpath::EmitterHit;
use super::vertex::{LightVertex, Vertex};
use super::walk_count::WalkCount;
use crate::emitter::Lights;
use crate::geometry::{Aim, Ray, SurfacePoint};
use crate::manifold::MAX_CHAIN;
use crate::math::{Rgb, Sampler, Stream, stratum};
use crate::scatter::{Bsdf, TransportMode};
use crate::scene::World;
use crate::scene::description::Medium;
use crate::scene::glass::Glass;
use crate::scene::media::MediumId;
use crate::scene::spectrum::Band;
use glam::Vec3;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
/// Traces subpaths; owns the arena of one worker, which is reused from sample to sample.
pub struct Tracer<'w> {
    /// The scene.
    pub world: &'w World,
    /// Longest full path, in segments.
    pub max_depth: u32,
    /// Medium that the current sample's camera subpath begins in.
    pub camera_medium: MediumId,
    /// The first surface that the camera subpath met.
    pub camera_hit: Option<Vec3>,
    /// Camera subpath of the current sample.
    pub camera_vertices: Vec<Vertex>,
    /// Light subpath of the current sample, without its first vertex.
    pub light_vertices: Vec<Vertex>,
    /// Its first vertex.
    pub light_start: Option<LightVertex>,
    /// Hits of the camera subpath with lights.
    pub emitter_hits: Vec<EmitterHit>,
    /// Rays so far.
    pub rays: RayCount,
    /// Manifold walks since a tile took the last ones.
    pub walks: WalkCount,
    /// Connections and checks through glass so far, of which some are timed.
    pub(super) begun: [u64; 2],
    /// Whether caustic connections are made: see [`Tracer::connect_through_glass`].
    pub(super) caustics: bool,
    /// All lights, as this tracer sees them: their emission may be aimed.
    pub lights: Arc<Lights>,
    /// Where light subpaths are sent from surfaces, and how often, by shape.
    pub aim: Option<Aim>,
    /// Compiled materials, as this tracer sees them.
    bsdfs: &'w [Bsdf],
    /// Media, in this sample.
    pub media: &'w [Medium],
    /// In light of what band this sample is, if it matters.
    band: Option<&'w Band>,
    /// Its materials.
    varied: &'w [Bsdf],
    /// Whether these are those of [`World::walked`].
    walked: bool,
    /// Materials made for the vertices of the camera subpath, and of the light subpath.
    pub(super) made: [Vec<Bsdf>; 2],
    /// What walks lead through.
    pub(super) glass: &'w Glass,
    /// Along the open edge's chain, where it crossed rough surfaces: the normals of the surface and of the
    /// microfacet, both to the front.
    pub(super) microfacets: [[Vec3; 2]; MAX_CHAIN],
    /// Whether the camera is connected through glass (t = 1).
    pub camera_caustics: bool,
    /// Mean number of light subpaths of a sample. Without any, next-event estimation and hits are the only
    /// techniques.
    pub light_subpaths: f64,
    /// What the last connection was: a path, or one for each chain.
    pub joined: Vec<Joined>,
    /// How caustic connections are made.
    pub options: CausticOptions,
    /// Most walks from one pair of ends, unless the options say it.
    pub seeds: u32,
    /// The part of [`Tracer::walk_work`] that was done from other starts.
    pub retry_work: f64,
    /// Probability with which a connection searches for one more chain, unless the options say it or the light cannot be
    /// hit.
    pub search: f32,
    /// The part of [`Tracer::walk_work`] that searches did, and the checks that know of them.
    pub search_work: f64,
    /// Set by whoever wants no more of it: a search, which can be long, then ends with a wrong number.
    pub stop: Option<&'w AtomicBool>,
    /// Random numbers of caustic connections, of the current sample: roulette, microfacets, searches.
    pub caustic_numbers: Sampler,
    /// What roulette goes by.
    pub experience: Experience,
    /// The connections that roulette tried so far, for those who want to learn from them.
    pub trials: Option<Vec<Trial>>,
}

impl<'w> Tracer<'w> {
    /// An idle tracer.
    pub fn new(world: &'w World, max_depth: u32) -> Tracer<'w> {
        let room = (max_depth.min(64) + 1) as usize;
        Tracer {
            world,
            max_depth,
            camera_medium: MediumId::default(),
            camera_hit: None,
            camera_vertices: Vec::with_capacity(room),
            light_vertices: Vec::with_capacity(room),
            light_start: None,
            emitter_hits: Vec::with_capacity(room),
            rays: RayCount::default(),
            walks: WalkCount::default(),
            begun: [0; 2],
            caustics: false,
            lights: world.lights.clone(),
            aim: None,
            bsdfs: &world.bsdfs,
            media: &world.media,
            band: None,
            varied: &[],
            walked: false,
            made: [Vec::new(), Vec::new()],
            glass: &world.glass,
            microfacets: [[Vec3::ZERO; 2]; MAX_CHAIN],
            camera_caustics: false,
            light_subpaths: 1.0,
            joined: Vec::new(),
            options: CausticOptions::default(),
            seeds: 1,
            retry_work: 0.0,
            search: 0.0,
            search_work: 0.0,
            stop: None,
            caustic_numbers: Sampler::new(0, 0, 0, Stream::Caustic),
            experience: Experience::default(),
            trials: None,
        }
    }

    /// Makes caustic connections, if the scene has glass for them.
    pub fn connect_through_glass(&mut self) {
        self.caustics = self.world.requirements.caustics;
        if let Some(walked) = &self.world.walked {
            (self.bsdfs, self.walked, self.glass) = (&walked.bsdfs, true, &walked.glass);
        }
    }

    /// Begins a sample: from here on the scene is seen in light of its band, if there is glass whose index varies.
    #[inline]
    pub fn begin(&mut self, seed: u64, pixel: u32, sample: u32) {
        if let Some(spectrum) = &self.world.spectrum {
            let band = stratum(seed, pixel, sample, spectrum.bands.len() as u32);
            self.see_in(&spectrum.bands[band as usize]);
        }
    }

    /// In light of that band.
    pub fn see_in(&mut self, band: &'w Band) {
        self.varied = band.walked.as_ref().filter(|_| self.walked).unwrap_or(&band.bsdfs);
        self.media = &band.media;
        self.band = Some(band);
    }

    /// Whether the index of a shape's glass varies.
    #[inline]
    pub(crate) fn disperses(&self, shape: u32) -> bool {
        self.varied(shape).is_some()
    }

    /// Which of a band's materials a shape has, if any.
    #[inline]
    fn varied(&self, shape: u32) -> Option<u32> {
        self.world.spectrum.as_ref()?.dispersive[self.world.shape_material[shape as usize] as usize]
    }

    /// The colour of a path that met such glass, or not: what is `dispersed` is light of one band.
    #[inline]
    pub fn color(&self, dispersed: bool) -> Rgb {
        self.band.filter(|_| dispersed).map_or(Rgb::ONE, |band| band.color)
    }

    /// The compiled material of a shape; of one with textures, its factors.
    #[inline]
    pub fn factors(&self, shape: u32) -> &'w Bsdf {
        match self.varied(shape).and_then(|i| self.varied.get(i as usize)) {
            Some(bsdf) => bsdf,
            None => &self.bsdfs[self.world.shape_material[shape as usize] as usize],
        }
    }

    /// The material at a point; with textures it is made at `place`.
    #[inline]
    pub fn bsdf<'a>(&self, at: &SurfacePoint, place: &'a mut Option<Bsdf>) -> &'a Bsdf
    where
        'w: 'a,
    {
        let wavelength = self.band.map(|band| band.wavelength);
        self.world.bsdf(self.factors(at.shape), at, self.walked, wavelength, place)
    }

    /// The material at a vertex of a subpath.
    #[inline]
    pub fn material(&self, vertex: &Vertex, mode: TransportMode) -> &Bsdf {
        match vertex.made {
            Some(index) => &self.made[mode as usize][index as usize],
            None => self.factors(vertex.at.shape),
        }
    }

    /// Whether the open segment is free of surfaces.
    #[inline]
    pub fn visible(&mut self, ray: &Ray) -> bool {
        self.rays.shadow += 1;
        !self.world.intersector.occluded(ray)
    }
}
