//! Bidirectional path tracing (Veach 1997, ch. 10): one light subpath for each camera subpath, or
//! another mean number; all techniques s >= 0, t >= 1, weighted by the balance heuristic.

use super::{Contribution, Feature, Observer, Sample};
use crate::camera::{Camera, Region};
use crate::math::{Rgb, Sampler, Stream, pixel_position};
use crate::scene::media::MediumId;
use crate::transport::{LightVertex, Tracer};
use glam::Vec2;

/// The camera of a render, with what is fixed for all samples.
#[derive(Clone, Debug)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Medium around it, if that is one: a lens, or the film of a parallel projection, may lie in several.
    pub medium: Option<MediumId>,
    /// Columns of the frame.
    pub columns: u32,
    /// What of the frame is rendered. Pixels are numbered in it, row by row.
    pub region: Region,
}

impl View {
    /// Column and row of the frame where a pixel is.
    #[inline]
    pub fn place(&self, pixel: u32) -> [u32; 2] {
        let Region { x, y, width, .. } = self.region;
        [x + pixel % width, y + pixel / width]
    }

    /// The pixel's number in the frame, by which its random numbers are chosen: they are the same in each region.
    #[inline]
    pub fn number(&self, pixel: u32) -> u32 {
        let [x, y] = self.place(pixel);
        y * self.columns + x
    }

    /// Raster position of a sample in the frame: uniform in its pixel.
    #[inline]
    pub fn raster(&self, seed: u64, pixel: u32, sample: u32) -> Vec2 {
        let corner = self.place(pixel).map(|place| place as f32);
        Vec2::from(corner) + pixel_position(seed, self.number(pixel), sample)
    }

    /// The pixel that a raster position on the film falls on.
    #[inline]
    pub fn pixel(&self, raster: Vec2) -> u32 {
        let Region { x, y, width, .. } = self.region;
        (raster.y as u32 - y) * width + raster.x as u32 - x
    }
}

/// One sample: `out.radiance` is set, splats are appended.
pub fn sample<O: Observer>(
    tracer: &mut Tracer,
    view: &View,
    seed: u64,
    pixel: u32,
    index: u32,
    out: &mut Sample,
    observer: &mut O,
) {
    from_camera(tracer, view, seed, pixel, index, out, observer);
    from_lights(tracer, view, seed, pixel, index, out, observer);
}

/// The part of a sample that needs no light subpath (s <= 1): sets `out.radiance`.
pub(crate) fn from_camera<O: Observer>(
    tracer: &mut Tracer,
    view: &View,
    seed: u64,
    pixel: u32,
    index: u32,
    out: &mut Sample,
    observer: &mut O,
) {
    let number = view.number(pixel);
    tracer.begin(seed, number, index);
    let stream = |kind| Sampler::new(seed, number, index, kind);
    let mut camera_numbers = stream(Stream::Camera);
    let camera = view.camera.sample(&mut camera_numbers);
    let raster = view.raster(seed, pixel, index);
    tracer.trace_camera(&camera, view.medium, raster, &mut camera_numbers);
    out.covered = tracer.camera_hit.is_some();
    // What escaped has no other path.
    let left_out = out.transparent && !out.covered;
    if let Some(feature) = &mut out.feature {
        *feature = if left_out { Feature::default() } else { Feature::of(tracer, &camera) };
    }
    let mut connect_numbers = stream(Stream::Connect);
    tracer.caustic_numbers = stream(Stream::Caustic);

    out.radiance = Rgb::ZERO;
    let hits = if left_out { &[][..] } else { &tracer.emitter_hits };
    for hit in hits {
        let kept = out.add(hit.value * hit.weight as f32, hit.scattered);
        let before = &tracer.camera_vertices[..hit.vertices];
        observer.observe(&Contribution::of_hit(hit, pixel, before).limited(kept));
    }
    for i in 0..tracer.camera_vertices.len() {
        let segments = tracer.camera_vertices[i].segments;
        if segments + 1 > tracer.max_depth {
            break;
        }
        // Without lights there is nothing to draw, and `sample_direct` says so at once.
        let Some(light) = tracer.next_event(i, &mut connect_numbers) else { continue };
        for joined in &tracer.joined {
            let kept = out.add(joined.weighted, true);
            let start = LightVertex { densities: joined.densities.unwrap_or(light.densities), ..light };
            let (technique, camera) = ((1, segments + 1), &tracer.camera_vertices[..=i]);
            observer.observe(&Contribution::of_joined(joined, technique, pixel, camera, &[], &start).limited(kept));
        }
    }
}

/// The rest of it, after the first part: light subpaths, joined with the camera subpath (s, t >= 2) and with the camera (t = 1).
pub(crate) fn from_lights<O: Observer>(
    tracer: &mut Tracer,
    view: &View,
    seed: u64,
    pixel: u32,
    index: u32,
    out: &mut Sample,
    observer: &mut O,
) {
    tracer.light_vertices.clear();
    // That of the camera subpath.
    let camera = view.camera.sample(&mut Sampler::new(seed, view.number(pixel), index, Stream::Camera));
    let mut light_numbers = Sampler::new(seed, view.number(pixel), index, Stream::Light);
    // The number on average: the whole part of it, and one more as often as the rest says.
    let number = (tracer.light_subpaths + f64::from(light_numbers.next_1d())) as u32;
    for _ in 0..number {
        tracer.trace_light(&mut light_numbers);
        let Some(start) = tracer.light_start else { continue };
        for i in 0..tracer.camera_vertices.len() {
            let segments = tracer.camera_vertices[i].segments;
            for j in 0..tracer.light_vertices.len() {
                let light_segments = tracer.light_vertices[j].segments;
                if segments + light_segments + 1 > tracer.max_depth {
                    break;
                }
                tracer.connect(i, j);
                for joined in &tracer.joined {
                    let kept = out.add(joined.weighted, true);
                    let technique = (light_segments + 1, segments + 1);
                    let (camera, light) = (&tracer.camera_vertices[..=i], &tracer.light_vertices[..=j]);
                    observer.observe(
                        &Contribution::of_joined(joined, technique, pixel, camera, light, &start).limited(kept),
                    );
                }
            }
        }
        for j in 0..tracer.light_vertices.len() {
            tracer.to_camera(&camera, j);
            for joined in &tracer.joined {
                let target = view.pixel(joined.raster);
                let kept = out.splat(target, joined.weighted);
                let (technique, light) = ((tracer.light_vertices[j].segments + 1, 1), &tracer.light_vertices[..=j]);
                observer.observe(&Contribution::of_joined(joined, technique, target, &[], light, &start).limited(kept));
            }
        }
    }
}
