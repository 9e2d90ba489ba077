//! A few samples before the first pass, which tell roulette on caustic connections what a contribution
//! of mean size is.

use super::job::{self, Cancel, Settings};
use crate::integrator::Sample;
use crate::integrator::bdpt::{self, View};
use crate::scene::World;
use crate::transport::roulette::Roulette;

/// Samples, in groups whose median mean is taken: one bright path must not decide.
const GROUPS: u32 = 16;
const GROUP: u32 = 32;

/// Mean radiance of the picture, for the tracers of its render. A function of scene, view, seed and
/// integrator. 0 if cancelled, or if no roulette asks for it.
pub(super) fn brightness(world: &World, view: &View, settings: &Settings, cancel: &Cancel) -> f32 {
    if !job::connects_through_glass(world, settings)
        || !matches!(settings.caustic_options.roulette, Roulette::Contribution(_))
    {
        return 0.0;
    }
    let mut tracer = job::tracer(world, view, settings, 0.0);
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let mut sample = Sample::default();
    let mut means = Vec::with_capacity(GROUPS as usize);
    for group in 0..GROUPS {
        let mut sum = 0.0;
        for i in 0..GROUP {
            if cancel.is_cancelled() {
                return 0.0;
            }
            // Each group goes over the whole picture. Passes count up from 0 and never get there.
            let pixel = pixels * u64::from(i * GROUPS + group) / u64::from(GROUPS * GROUP);
            sample.splats.clear();
            bdpt::sample(&mut tracer, view, settings.seed, pixel as u32, u32::MAX - group, &mut sample, &mut ());
            let total = sample.splats.iter().fold(sample.radiance, |sum, splat| sum + splat.value);
            if total.is_finite() {
                sum += total.max_element();
            }
        }
        means.push(sum / GROUP as f32);
    }
    means.sort_unstable_by(f32::total_cmp);
    means[means.len() / 2]
}
