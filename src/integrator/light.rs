//! Light tracing (Arvo 1986; Dutré et al. 1993): every vertex of a light subpath is connected to the
//! camera. The rival of caustic connections where the camera sees a caustic directly; what it sees
//! through glass or in a mirror stays black.

use super::bdpt::View;
use super::{Contribution, Observer, Sample};
use crate::math::{Rgb, Sampler, Stream};
use crate::transport::Tracer;

/// One light subpath, and one camera ray for the lights that it meets at once.
pub fn sample<O: Observer>(
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
    let longest = std::mem::replace(&mut tracer.max_depth, 1);
    let raster = view.raster(seed, pixel, index);
    let mut camera_numbers = stream(Stream::Camera);
    let camera = view.camera.sample(&mut camera_numbers);
    tracer.trace_camera(&camera, view.medium, raster, &mut camera_numbers);
    tracer.max_depth = longest;
    out.radiance = Rgb::ZERO;
    for hit in &tracer.emitter_hits {
        out.radiance += hit.value;
        observer.observe(&Contribution::of_hit(hit, pixel, &[]));
    }
    tracer.trace_light(&mut stream(Stream::Light));
    for j in 0..tracer.light_vertices.len() {
        tracer.to_camera(&camera, j);
        let Some(start) = &tracer.light_start else { continue };
        for joined in &tracer.joined {
            let target = view.pixel(joined.raster);
            let kept = out.splat(target, joined.value);
            let path = Contribution::of_joined(
                joined,
                (tracer.light_vertices[j].segments + 1, 1),
                target,
                &[],
                &tracer.light_vertices[..=j],
                start,
            );
            observer.observe(&Contribution { weight: 1.0, ..path }.limited(kept));
        }
    }
}
