//! A few samples before the first pass: what attempted caustic connections bring, which roulette on them
//! needs to know, and whether they pay at all.
//!
//! What they would save can be read off their weights. A path of value `f` that all techniques together
//! sample with density `p`, of which caustic connections have the share `w`, adds `f²/p` to the second
//! moment of the balance heuristic; without them it would add `f²/(p (1 - w))`. So the sum of
//! `(f/p)² / (1 - w)` over the samples of caustic connections estimates by how much leaving them out raises
//! the second moment, without ever rendering that way. (With several chains in one path `w` is that of
//! one of them alone, which errs on the side of leaving out; rough glass that is
//! walked through would be evaluated instead, which the estimate does not know.)

use super::job::{self, Cancel, Caustics, Forecast, Integrator, Settings};
use crate::integrator::bdpt::{self, View};
use crate::integrator::{Contribution, Observer, Sample};
use crate::scene::World;
use crate::transport::experience::Experience;
use crate::transport::roulette::{self, Roulette};

/// Samples, in groups, of which the median mean is taken, and the forecast of all but those that forecast most:
/// a few rare paths must not decide. With these, walks are made on demo, where they pay, with twelve of twelve
/// seeds, and on lumpy, where they do not, with one; with groups of 64, on demo with a third. They take a tenth
/// of a second at most on the scenes here.
const GROUPS: u32 = 16;
const TYPICAL: usize = 12;
const GROUP: u32 = 256;

/// Work of a step of a walk over that of a ray with all that it brings, about (`make bench`).
const STEP: f64 = 2.0;

/// Caustic connections stay if the variance that they save is more than this share of the work that they
/// add. The variance is that of the whole picture, of which caustics are a part that matters more. Measured
/// (variance saved over work added; error of the caustics at equal time, plain over ours): figure4a 0.04, 0.6;
/// lumpy 0.1, 0.4; demo 0.1 to 2, 1.0; water_glass 0.5, 0.8; frosted 0.5, 3; eye 4, 4; the others are far above.
const WORTH: f64 = 0.35;

/// Largest `1/(1 - w)`: a path that nothing else finds counts a million times.
const MOST: f64 = 1e6;

/// What the samples tell the tracers of their render.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    /// For roulette on caustic connections; none if nothing asks for it.
    pub(super) experience: Experience,
    /// Whether caustic connections are made.
    pub(super) connects: bool,
    /// What that was decided on, if it was.
    pub(super) forecast: Option<Forecast>,
}

/// Second moments.
#[derive(Default)]
struct Moments {
    all: f64,
    /// By how much more without caustic connections.
    without: f64,
}

impl Observer for Moments {
    fn observe(&mut self, c: &Contribution) {
        let added = f64::from(c.weighted.max_element()).powi(2);
        // A light that the camera sees, perhaps through glass, has no noise, however bright.
        let seen = c.camera.is_empty() && c.light.is_empty();
        if seen || !added.is_finite() {
            return;
        }
        self.all += added;
        if c.chain.is_some() {
            self.without += added / (1.0 - c.weight).max(1.0 / MOST);
        }
    }
}

/// Pixel of a sample: multiples of the golden ratio, so that each group goes over the whole picture, and,
/// unlike equal steps, over all columns whatever the width.
fn place(sample: u32, pixels: u64) -> u32 {
    ((u64::from(sample.wrapping_mul(0x9e37_79b9)) * pixels) >> 32) as u32
}

/// Draws the samples, if anything depends on them: a function of scene, view, seed and settings.
pub(super) fn look(world: &World, view: &View, settings: &Settings, cancel: &Cancel) -> Pilot {
    let connects = job::connects_through_glass(world, settings);
    let idle = Pilot { experience: Experience::default(), connects, forecast: None };
    // Where a light cannot be hit, the connections may find what nothing else does.
    let decides = settings.caustics == Caustics::Auto
        && settings.integrator == Integrator::Bdpt
        && !settings.per_technique
        && !settings.caustics_only
        && !world.requirements.delta_lights;
    let threshold = match settings.caustic_options.roulette {
        Roulette::Contribution(threshold) => Some(threshold),
        Roulette::Off | Roulette::Lengths => None,
    };
    if !connects || !(decides || threshold.is_some()) {
        return idle;
    }
    let mut tracer = job::tracer(world, view, settings, &idle);
    tracer.trials = threshold.map(|_| Vec::new());
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let mut sample = Sample::default();
    let (mut means, mut groups) = (Vec::new(), Vec::new());
    for group in 0..GROUPS {
        let (mut sum, mut moments) = (0.0, Moments::default());
        for i in 0..GROUP {
            if cancel.is_cancelled() {
                return idle;
            }
            sample.splats.clear();
            let pixel = place(group * GROUP + i, pixels);
            // Passes count up from 0 and never get there.
            bdpt::sample(&mut tracer, view, settings.seed, pixel, u32::MAX - group, &mut sample, &mut moments);
            let total = sample.splats.iter().fold(sample.radiance, |sum, splat| sum + splat.value);
            if total.is_finite() {
                sum += total.max_element();
            }
        }
        means.push(sum / GROUP as f32);
        groups.push(moments);
    }
    means.sort_unstable_by(f32::total_cmp);
    let certain = threshold.unwrap_or(0.0) * means[means.len() / 2];
    let trials = tracer.trials.take().unwrap_or_default();
    let experience = if certain > 0.0 { Experience::new(&trials, certain) } else { Experience::default() };
    if !decides {
        return Pilot { experience, ..idle };
    }
    groups.sort_unstable_by(|a, b| a.without.total_cmp(&b.without));
    groups.truncate(TYPICAL);
    let sum = |moment: fn(&Moments) -> f64| groups.iter().map(moment).sum::<f64>();
    let saved = sum(|m| m.without) / sum(|m| m.all).max(f64::MIN_POSITIVE);
    let rays = tracer.rays.total() - tracer.rays.walk;
    let steps = tracer.walks.iterations as f64 - roulette::spared(&trials, &experience);
    let added = STEP * steps / rays.max(1) as f64;
    let connects = saved > WORTH * added;
    let forecast = Forecast { variance: (1.0 + saved) as f32, work: (1.0 + added) as f32 };
    Pilot { experience, connects, forecast: Some(forecast) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_go_over_all_of_a_picture_whatever_its_width() {
        for (width, height) in [(256u64, 256u64), (128, 128), (1920, 1080), (97, 211), (512, 1)] {
            let places: Vec<u64> = (0..GROUPS * GROUP).map(|i| place(i, width * height).into()).collect();
            for (axis, cells) in [(0, width.min(8)), (1, height.min(8))] {
                let cell = |p: &u64| if axis == 0 { p % width * cells / width } else { p / width * cells / height };
                for k in 0..cells {
                    let share = places.iter().filter(|p| cell(p) == k).count() as f64 / places.len() as f64;
                    let expected = 1.0 / cells as f64;
                    assert!((share / expected - 1.0).abs() < 0.5, "{width}x{height}, axis {axis}, {k}: {share}");
                }
            }
        }
    }
}
