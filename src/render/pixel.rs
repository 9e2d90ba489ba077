//! Single samples of a render, for looking at their paths.

use super::pilot;
use super::{Cancel, Integrator, RenderError, Settings, samples, settings};
use crate::camera::{Camera, Region};
use crate::integrator::bdpt::View;
use crate::integrator::{Observer, Sample};
use crate::math::{Sampler, Stream};
use crate::scene::World;
use crate::transport::Tracer;
use crate::transport::walk_count::WalkCount;
use std::borrow::Cow;

/// Draws samples as [`super::render`] with the same settings draws them, bit for bit.
pub struct Probe<'w> {
    tracer: Tracer<'w>,
    view: View,
    settings: Settings,
}

impl<'w> Probe<'w> {
    /// For all integrators but the path tracer, which shows no paths.
    pub fn new(world: &'w World, settings: &Settings) -> Result<Probe<'w>, RenderError> {
        settings::validate(world, settings)?;
        if settings.integrator == Integrator::Path {
            return RenderError::setting("integrator", "path", "one of light, mnee and bdpt was expected");
        }
        let view = samples::view(world, settings);
        let host = pilot::Host { cancel: &Cancel::default(), report: &|| {} };
        let pilot = pilot::look(world, &view, settings, &host)?;
        let tracer = samples::tracer(world, &view, settings, &pilot);
        Ok(Probe { tracer, view, settings: settings.clone() })
    }

    /// One sample of the pixel in column `x` and row `y` of the frame; `observer` is shown its paths.
    pub fn trace<O: Observer>(&mut self, x: u32, y: u32, index: u32, observer: &mut O) -> Result<Sample, RenderError> {
        let region = self.view.region;
        let Some(pixel) = region.number(x, y) else {
            let Region { x: left, y: top, width, height } = region;
            let expected = format!("the picture has {width}x{height} pixels, the first is ({left}, {top})");
            return RenderError::setting("pixel", format!("({x}, {y})"), expected);
        };
        let mut sample = samples::empty(&self.settings);
        samples::estimate(&mut self.tracer, &self.view, &self.settings, pixel, index, &mut sample, observer);
        Ok(sample)
    }

    /// The camera of one sample of the pixel in column `x` and row `y` of the frame.
    pub fn camera(&self, x: u32, y: u32, index: u32) -> Cow<'_, Camera> {
        let number = self.view.region.number(x, y).map_or(0, |pixel| self.view.number(pixel));
        self.view.camera.sample(&mut Sampler::new(self.settings.seed, number, index, Stream::Camera))
    }

    /// What traces, with the materials as this render sees them: rough glass may be walked through.
    pub fn tracer(&self) -> &Tracer<'w> {
        &self.tracer
    }

    /// Manifold walks of the samples so far, and the rays that they took.
    pub fn walks(&self) -> (&WalkCount, u64) {
        (&self.tracer.walks, self.tracer.rays.walk)
    }
}
