//! A few samples before the first pass: what attempted caustic connections bring, which roulette on them
//! needs to know, whether they pay at all, and whether it pays to aim light subpaths at glass.
//!
//! What a technique saves can be read off its weights. A path of value `f` that all techniques together
//! sample with density `p`, of which one has the share `w`, adds `f²/p` to the second moment of the balance
//! heuristic. If that technique sampled it `r` times as often, it would add `f²/(p (1 - w + r w))`; without
//! caustic connections `r = 0`, without aim it is the ratio of the densities of what the light subpath drew. So
//! the sum of `(f/p)² (1 - r) / (1 - w + r w)` over the samples of those techniques estimates by how much leaving
//! them out raises the second moment, without ever rendering that way. (`w` is that of the one technique that
//! made the path, which errs on the side of leaving out; rough glass that is walked through would be
//! evaluated instead, which the estimate does not know.)
//!
//! Caustics alone are looked at: they are what all this is for, and a small part of most pictures' variance.

use super::job::{self, Cancel, Caustics, Forecast, Integrator, Settings};
use crate::integrator::bdpt::{self, View};
use crate::integrator::{Contribution, Observer, Sample};
use crate::scene::World;
use crate::transport::aim::{self, Aimed, CLASSES, departures};
use crate::transport::caustic::AIM;
use crate::transport::experience::Experience;
use crate::transport::roulette::{self, Roulette};

/// Samples, in groups. The median of their means counts, and the ten of them that forecast least: a few rare paths must
/// not decide. Connections are then made on demo, where they pay, with eight of eight seeds, and on lumpy, where they
/// do not, with none; with eight groups, not always on demo, with twelve, sometimes on lumpy. They take a tenth of a
/// second at most on the scenes here; with aim to decide on they are drawn twice, and again if there will be any.
const GROUPS: u32 = 16;
const TYPICAL: usize = 10;
const GROUP: u32 = 256;

/// Caustic connections pay if they save more of the caustics' variance than they add to the work. Measured (variance
/// saved over work added; error of the caustics at equal time, without them over with): figure4a 0.02, 0.5; lumpy 0.01,
/// 0.5; water_glass 0.9, 0.7; demo 1.1 to 7, 1.2 to 1.4; frosted 2.4 to 4, 3.4; eye 7 to 13, 3.8; the others far above.
const CONNECTIONS_WORTH: f64 = 1.0;

/// Aim pays from a place if it saves so many times what it adds: light that is aimed from one place has the less to gain
/// from aim at the next, and aim makes the rest of the picture slower. Measured, of all places together: window 0.1, 1.0;
/// eye 0, 0.9; figure4b 0.5, 0.9; frosted 1.7, 0.7; eye_small 3, 0.9; demo 5.5, 1.0; lumpy 7, 1.7; figure4a 16, 2.8;
/// glass_sphere 20, 1.5; pane_sphere 40, 2.2; water_glass above 100, 4.
const AIM_WORTH: f64 = 4.0;

/// Largest `1/(1 - w)`: a path that nothing else finds counts a million times.
const MOST: f64 = 1e6;

/// What the samples tell the tracers of their render.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    /// The aim of light subpaths at glass, if there is any.
    pub(super) aim: Option<Aimed>,
    /// For roulette on caustic connections; none if nothing asks for it.
    pub(super) experience: Experience,
    /// Whether caustic connections are made.
    pub(super) connects: bool,
    /// What that was decided on, if it was.
    pub(super) forecast: Option<Forecast>,
    /// What aiming was decided on, if it was.
    pub(super) aim_forecast: Option<Forecast>,
}

/// Second moments of caustics, and what there is to see.
struct Moments {
    /// Sum of all contributions but those of lights that the camera sees, perhaps through glass: they have no noise,
    /// however bright, and no say in what is too much of it.
    light: f32,
    all: f64,
    /// By how much more without caustic connections.
    unconnected: f64,
    /// By how much more without any aim.
    unaimed: f64,
    /// By how much more without that of one class of places.
    unaimed_from: Vec<f64>,
}

impl Moments {
    fn new() -> Moments {
        Moments { light: 0.0, all: 0.0, unconnected: 0.0, unaimed: 0.0, unaimed_from: vec![0.0; CLASSES] }
    }
}

impl Observer for Moments {
    fn observe(&mut self, c: &Contribution) {
        let most = c.weighted.max_element();
        if most.is_finite() && !(c.camera.is_empty() && c.light.is_empty()) {
            self.light += most;
        }
        let added = f64::from(most).powi(2);
        if !c.is_caustic() || !added.is_finite() {
            return;
        }
        let more = |ratio: f64| added * (1.0 - ratio) / (1.0 - c.weight * (1.0 - ratio)).max(1.0 / MOST);
        self.all += added;
        self.unconnected += if c.chain.is_some() { more(0.0) } else { 0.0 };
        self.unaimed += c.light.last().map_or(0.0, |vertex| more(vertex.plain));
        for (class, plain) in departures(c.start, c.light) {
            self.unaimed_from[class] += more(plain);
        }
    }
}

/// Pixel of a sample: multiples of the golden ratio, so that each group goes over the whole picture, and,
/// unlike equal steps, over all columns whatever the width.
fn place(sample: u32, pixels: u64) -> u32 {
    ((u64::from(sample.wrapping_mul(0x9e37_79b9)) * pixels) >> 32) as u32
}

/// Samples of a render.
struct Samples {
    /// Of each group.
    moments: Vec<Moments>,
    /// In units of a ray: of all, and of the walks that roulette leaves.
    work: [f64; 2],
    /// How often light subpaths went from each class of places where aim sends them more often.
    aimed: Vec<u64>,
    experience: Experience,
}

impl Samples {
    /// Draws them, if nobody cancels.
    fn draw(world: &World, view: &View, settings: &Settings, pilot: &Pilot, cancel: &Cancel) -> Option<Samples> {
        let threshold = threshold(settings);
        let mut tracer = job::tracer(world, view, settings, pilot);
        tracer.trials = threshold.map(|_| Vec::new());
        let pixels = u64::from(settings.width) * u64::from(settings.height);
        let mut sample = Sample::default();
        let mut aimed = vec![0; CLASSES];
        let (mut means, mut moments) = (Vec::new(), Vec::new());
        for group in 0..GROUPS {
            let mut of_group = Moments::new();
            for i in 0..GROUP {
                if cancel.is_cancelled() {
                    return None;
                }
                sample.splats.clear();
                let pixel = place(group * GROUP + i, pixels);
                // Passes count up from 0 and never get there.
                let pass = u32::MAX - group;
                bdpt::sample(&mut tracer, view, settings.seed, pixel, pass, &mut sample, &mut of_group);
                for (class, plain) in tracer.light_start.iter().flat_map(|s| departures(s, &tracer.light_vertices)) {
                    aimed[class] += u64::from(plain < 1.0);
                }
            }
            means.push(of_group.light / GROUP as f32);
            moments.push(of_group);
        }
        means.sort_unstable_by(f32::total_cmp);
        let certain = threshold.unwrap_or(0.0) * means[means.len() / 2];
        let trials = tracer.trials.take().unwrap_or_default();
        let experience = if certain > 0.0 { Experience::new(&trials, certain) } else { Experience::default() };
        let walks = tracer.walk_work() - roulette::spared(&trials, &experience);
        let rays = (tracer.rays.total() - tracer.rays.walk) as f64;
        Some(Samples { moments, work: [rays + walks, walks], aimed, experience })
    }

    /// By how much a second moment is more, relative to what it is, in the groups where that is least.
    fn saved(&self, more: impl Fn(&Moments) -> f64) -> f64 {
        let mut groups: Vec<[f64; 2]> = self.moments.iter().map(|m| [more(m), m.all]).collect();
        groups.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let [more, all] = groups[..TYPICAL].iter().fold([0.0; 2], |sum, g| [sum[0] + g[0], sum[1] + g[1]]);
        more / all.max(f64::MIN_POSITIVE)
    }

    /// By class of places, whether aim pays from there, if all of it adds so much to the work.
    fn worth_aiming(&self, added: f64) -> Vec<bool> {
        let all = self.aimed.iter().sum::<u64>().max(1) as f64;
        let pays = |class: usize| {
            let its = added.max(0.0) * self.aimed[class] as f64 / all;
            self.saved(|m| m.unaimed_from[class]) > AIM_WORTH * its
        };
        (0..CLASSES).map(pays).collect()
    }
}

fn forecast(saved: f64, added: f64) -> Forecast {
    Forecast { variance: (1.0 + saved) as f32, work: (1.0 + added) as f32 }
}

/// The multiple of the mean radiance by which roulette goes, if it does.
fn threshold(settings: &Settings) -> Option<f32> {
    match settings.caustic_options.roulette {
        Roulette::Contribution(threshold) => Some(threshold),
        Roulette::Off | Roulette::Lengths => None,
    }
}

/// Draws the samples, if anything depends on them: a function of scene, view, seed and settings.
pub(super) fn look(world: &World, view: &View, settings: &Settings, cancel: &Cancel) -> Pilot {
    let connects = job::connects_through_glass(world, settings);
    let bidirectional = settings.integrator == Integrator::Bdpt;
    // Where a light cannot be hit, the connections may find what nothing else does.
    let decides = bidirectional
        && connects
        && settings.caustics == Caustics::Auto
        && !settings.per_technique
        && !settings.caustics_only
        && !world.requirements.delta_lights;
    let aims = world.requirements.caustics && (bidirectional || settings.integrator == Integrator::Light);
    let share = settings.caustic_options.aim.filter(|_| aims);
    let decides_aim = bidirectional && connects && settings.caustic_options.aim.is_none();
    let plain = Pilot { aim: None, experience: Experience::default(), connects, forecast: None, aim_forecast: None };
    let share = if decides_aim { AIM } else { share.unwrap_or(0.0) };
    let targets = if share > 0.0 { aim::glass(world) } else { Default::default() };
    let aiming =
        |share: &dyn Fn(usize) -> f32| Pilot { aim: Some(Aimed::new(world, &targets, share)), ..plain.clone() };
    let mut pilot = if share > 0.0 { aiming(&|_| share) } else { plain.clone() };
    if !connects || !(decides || decides_aim || threshold(settings).is_some()) {
        return pilot;
    }
    let draw = |pilot: &Pilot| Samples::draw(world, view, settings, pilot, cancel);
    let Some(mut samples) = draw(&pilot) else { return pilot };
    if decides_aim {
        let Some(others) = draw(&plain) else { return pilot };
        let added = |s: &Samples| s.work[0] / others.work[0] - 1.0;
        let worth = samples.worth_aiming(added(&samples));
        if worth.contains(&true) {
            pilot = aiming(&|class| if worth[class] { share } else { 0.0 });
            let Some(chosen) = draw(&pilot) else { return pilot };
            samples = chosen;
            pilot.aim_forecast = Some(forecast(samples.saved(|m| m.unaimed), added(&samples)));
        } else {
            let of_all = forecast(samples.saved(|m| m.unaimed), added(&samples));
            (pilot, samples) = (Pilot { aim_forecast: Some(of_all), ..plain }, others);
        }
    }
    if decides {
        let [all, walks] = samples.work;
        let (saved, added) = (samples.saved(|m| m.unconnected), walks / (all - walks).max(1.0));
        pilot.connects = saved > CONNECTIONS_WORTH * added;
        pilot.forecast = Some(forecast(saved, added));
    }
    pilot.experience = samples.experience;
    pilot
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
