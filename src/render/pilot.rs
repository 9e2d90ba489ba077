//! A few samples before the first pass: what attempted caustic connections bring, which roulette on them
//! needs to know, whether they pay at all, whether it pays to walk from other starts or to search for further
//! chains, whether it pays to aim light subpaths at glass, and how many of them there should be. How the samples tell is
//! in [`super::moments`].
//!
//! Caustics alone are looked at for all but the last: they are what all this is for, and a small part of most pictures'
//! variance. Fewer light subpaths must not cost the rest of the picture either.

use super::moments::{self, Moments, NUMBERS, Paths};
use super::{Cancel, Caustics, Forecast, Integrator, RenderError, Settings, samples};
use crate::integrator::Sample;
use crate::integrator::bdpt::{self, View};
use crate::pool;
use crate::scene::World;
use crate::transport::Tracer;
use crate::transport::aim::{self, Aimed, CLASSES, departures};
use crate::transport::experience::{Experience, Trial};
use crate::transport::options::{AIM, Check, GeometryTerm, LAMP_SEARCH, MOST_SEEDS};
use crate::transport::roulette::{self, Roulette};
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Samples, in groups. The median of their means counts, and, but of connections, the ten of them that forecast least: a
/// few rare paths must not decide. With aim to decide on they are drawn twice, and again if there will be any, and once
/// more for searches and for fewer light subpaths: 0.1 to 1 seconds of one thread, together, on the scenes here (EPYC,
/// Zen 3). Threads draw whole groups.
const GROUPS: u32 = 16;
const TYPICAL: usize = 10;
const GROUP: u32 = 256;

/// Caustic connections pay if they save so many times as much of the caustics' variance as they add to the work; of all
/// groups, since a small caustic is in a few of them. Measured (variance saved over work added with twelve seeds; error of
/// the caustics at equal time, without them over with): figure4a 0.1 to 0.2, 0.5; water_glass 0.4 to 0.6, 0.7; lumpy 0.0 to
/// 0.7, 0.5; sky 0.6 to 10, above 1 with eleven of the seeds, 3.1, and with a sun of half a degree 2.2 to 20 (four seeds),
/// 6.7; demo 1.5 to 4.2, 1.2 to 1.4; frosted 2.5 to 5.6, 3.4; eye 10 to 11 (four), 3.8; the others 4 to 17.
const CONNECTIONS_WORTH: f64 = 1.0;

/// Unless they save so many times that or more, or as much less, so many times as many samples decide, which takes 0.1
/// seconds of one thread more on sky, demo and frosted. With as many as for all else, connections were left out of sky with
/// five of twelve seeds. Eight times as many are no better: two wrong decisions on sky, two on lumpy and one on demo.
/// What is clear was not tuned.
const CLEAR: f64 = 5.0;
const LONG: u32 = 4;

/// Most samples that are drawn, each of its own number.
pub(super) const PILOT_SAMPLES: u32 = LONG * GROUPS * GROUP;

/// Aim pays from a place if it saves so many times what it adds: light that is aimed from one place has the less to gain
/// from aim at the next, and aim makes the rest of the picture slower. Measured, of all places together (as above):
/// figure4b 0.3 to 0.8, 0.9; water 0.2 to 0.4, 0.9; frosted 0.4, 0.7; window 0.8, 1.0; eye_small 2, 0.9; demo 2.1 to 2.8,
/// 1.0; lumpy 2.8 to 3.8, 1.7; figure4a_small 4 to 9, 3; figure4a 10 to 13, 2.8; pane_sphere
/// 10 to 20, 2.2; water_glass above 100, 4. The errors were measured with an earlier forecast; 4 and 2.5 were tried, too.
/// demo is aimed with half of 24 seeds, glass_sphere with seven of eight, the other scenes here with all or none of six;
/// lumpy, where connections do not pay, is since their walks are no part of what aim adds (before, with four of five).
const AIM_WORTH: f64 = 3.0;

/// Other starts of walks pay if they save so many times what they add. Measured (variance saved over work added with
/// three seeds; error of the caustics at equal time, without over with): water 19 to 26, 1.8; water_small above 10^4, 1.0
/// where the worst pixels are left out, as they are in relMSE; eye, eye_small, demo and figure4b 0.0 to 0.7, 0.9 to 1.0.
const SEEDS_WORTH: f64 = 1.0;

/// Searches for one more chain pay if they save so many times what they add. They find few paths: all groups count but the
/// one that forecasts most, and they are drawn with a search for each connection; where they save more than they add, the
/// longer look decides. Measured (variance saved over work added with twelve seeds; error of the picture with 64 samples at
/// 128x128, eight seeds, without searches over with a tenth of them, of all pixels and without the worst thousandth):
/// water_small 3400 to 36 000; figure4c_small 430 to 3100, 6.1, 0.39, as hits of the lamp are a few pixels brighter than all
/// the rest; lumpy, whose connections do not pay, -3 to 170, 2.0, 0.59; water -12 to 8, 0.56, 1.34; demo -2 to 15, 1.2, 1.0;
/// with the shorter look, eight seeds: eye -1.7 to 0.3; figure4b_small 0.
const SEARCH_WORTH: f64 = 20.0;

/// Fewer light subpaths pay if work times second moments falls to this share, the geometric mean of caustics and other
/// light, and neither rises beyond the other number. Measured (forecast of caustics with six seeds; error at equal time
/// of caustics and of the rest, over those with one): a quarter on glass_sphere, aimed, 0.8, 0.4, 0.4; half of them on
/// frosted 0.93 to 1.01, 1.0, 0.8; window_small 1.03 to 1.04, 0.95, 0.85; figure4b 1.0 to 1.03, 1.0, 0.85; figure4b_small
/// 0.98 to 1.05, 1.03, 0.9; demo 1.04 to 1.15, 1.09, 0.85. (Errors of four seeds, some of which moved by a tenth from run
/// to run; with independent samples.)
const FEWER_WORTH: f64 = 0.95;
const MOST_WORSE: f64 = 1.02;

/// Who waits for the samples.
pub(super) struct Host<'a> {
    pub(super) cancel: &'a Cancel,
    /// Called now and then by all threads.
    pub(super) report: &'a (dyn Fn() + Sync),
}

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
    /// Light subpaths per sample.
    pub(super) light_subpaths: f64,
    /// Most walks from one pair of ends, other than to lights that cannot be hit.
    pub(super) seeds: u32,
    /// What that was decided on, if it was.
    pub(super) seeds_forecast: Option<Forecast>,
    /// Probability with which connections search for one more chain, other than to lights that cannot be hit.
    pub(super) search: f32,
    /// What that was decided on, if it was.
    pub(super) search_forecast: Option<Forecast>,
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
    /// For samples without light subpath, and for that.
    work: [Work; 2],
    /// The part of it that was done from other starts.
    retries: f64,
    /// The part of it that searches did.
    searches: f64,
    /// How often light subpaths went from each class of places where aim sends them more often.
    aimed: Vec<u64>,
    experience: Experience,
}

/// In units of a ray.
#[derive(Clone, Copy)]
struct Work {
    rays: f64,
    /// Walks that roulette leaves.
    walks: f64,
}

impl Work {
    fn all(&self) -> f64 {
        self.rays + self.walks
    }

    fn so_far(tracer: &Tracer) -> Work {
        Work { rays: (tracer.rays.total() - tracer.rays.walk) as f64, walks: tracer.walk_work() }
    }
}

/// What one group of samples tells.
struct Group<'v> {
    paths: Paths<'v>,
    work: [Work; 2],
    /// Of walks from other starts.
    retries: f64,
    /// Of searches.
    searches: f64,
    trials: [Vec<Trial>; 2],
    aimed: Vec<u64>,
}

impl<'v> Group<'v> {
    /// Draws its samples, if nobody cancels.
    fn draw(
        number: u32,
        tracer: &mut Tracer,
        view: &'v View,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Option<Group<'v>> {
        let pixels = view.region.pixels();
        let mut sample = Sample::default();
        let mut group = Group {
            paths: Paths::new(view, settings.caustics_only),
            work: [Work { rays: 0.0, walks: 0.0 }; 2],
            retries: -tracer.retry_work,
            searches: -tracer.search_work,
            trials: [Vec::new(), Vec::new()],
            aimed: vec![0; CLASSES],
        };
        for i in 0..GROUP {
            if cancel.is_cancelled() {
                return None;
            }
            sample.splats.clear();
            let pixel = place(number * GROUP + i, pixels);
            // Samples of renders are counted up from 0, and not so far.
            let (seed, pass, paths) = (settings.seed, u32::MAX - (number * GROUP + i), &mut group.paths);
            for part in [0, 1] {
                let before = Work::so_far(tracer);
                match part {
                    0 => bdpt::from_camera(tracer, view, seed, pixel, pass, &mut sample, paths),
                    _ => bdpt::from_lights(tracer, view, seed, pixel, pass, &mut sample, paths),
                }
                let after = Work::so_far(tracer);
                group.work[part].rays += after.rays - before.rays;
                group.work[part].walks += after.walks - before.walks;
                group.trials[part].extend(tracer.trials.iter_mut().flat_map(|t| t.drain(..)));
            }
            for (class, plain) in tracer.light_start.iter().flat_map(|s| departures(s, &tracer.light_vertices)) {
                group.aimed[class] += u64::from(plain < 1.0);
            }
        }
        group.retries += tracer.retry_work;
        group.searches += tracer.search_work;
        Some(group)
    }
}

impl Samples {
    /// Draws so many groups of them, from that one on, if nobody cancels. They do not depend on the number of threads.
    fn draw(
        world: &World,
        view: &View,
        settings: &Settings,
        pilot: &Pilot,
        host: &Host,
        numbers: Range<u32>,
    ) -> Result<Option<Samples>, RenderError> {
        // Roulette has learned from the first ones.
        let threshold = threshold(settings).filter(|_| numbers.start == 0);
        let groups: Vec<OnceLock<Group>> = numbers.clone().map(|_| OnceLock::new()).collect();
        let next = AtomicU32::new(numbers.start);
        let threads = pool::thread_count(settings.threads).min(groups.len());
        pool::broadcast(threads, |_| {
            let mut tracer = samples::tracer(world, view, settings, pilot);
            tracer.stop = Some(&host.cancel.0);
            tracer.trials = threshold.map(|_| Vec::new());
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let Some(slot) = groups.get((number - numbers.start) as usize) else { return };
                let Some(group) = Group::draw(number, &mut tracer, view, settings, host.cancel) else { return };
                // Each number is handed out once.
                let _ = slot.set(group);
                (host.report)();
            }
        })
        .map_err(|failed| RenderError::of_workers(threads, failed))?;
        let Some(groups) = groups.into_iter().map(OnceLock::into_inner).collect::<Option<Vec<Group>>>() else {
            return Ok(None);
        };

        let mut means: Vec<f32> = groups.iter().map(|g| g.paths.light / GROUP as f32).collect();
        means.sort_unstable_by(f32::total_cmp);
        let certain = threshold.unwrap_or(0.0) * means[means.len() / 2];
        let trials = |part: usize| groups.iter().flat_map(move |g| &g.trials[part]);
        let experience =
            if certain > 0.0 { Experience::new(trials(0).chain(trials(1)), certain) } else { Experience::default() };
        let mut work = [0, 1].map(|part| {
            let sum = |kind: fn(&Work) -> f64| groups.iter().map(|g| kind(&g.work[part])).sum();
            Work { rays: sum(|w| w.rays), walks: sum(|w| w.walks) }
        });
        let all: f64 = work.iter().map(|w| w.walks).sum();
        for (part, work) in work.iter_mut().enumerate() {
            work.walks -= roulette::spared(trials(part), &experience);
        }
        // Roulette spares them like the others.
        let left = work.iter().map(|w| w.walks).sum::<f64>() / all.max(1.0);
        let [retries, searches] =
            [|g: &Group| g.retries, |g: &Group| g.searches].map(|of| left * groups.iter().map(of).sum::<f64>());
        let aimed = (0..CLASSES).map(|class| groups.iter().map(|g| g.aimed[class]).sum()).collect();
        let moments = moments::relative(groups.iter().map(|g| &g.paths));
        Ok(Some(Samples { moments, work, retries, searches, aimed, experience }))
    }

    /// With so many light subpaths a sample, as a multiple of those drawn.
    fn work(&self, light_subpaths: f64) -> f64 {
        let [camera, light] = self.work.map(|w| w.all());
        camera + light_subpaths * light
    }

    /// By how much a second moment is more, relative to what it is, in the groups where that is least.
    fn saved(&self, more: impl Fn(&Moments) -> f64) -> f64 {
        saved_in(TYPICAL, &self.moments, more)
    }

    /// Work of all walks.
    fn walks(&self) -> f64 {
        self.work.iter().map(|w| w.walks).sum()
    }

    /// What caustic connections save of the caustics' variance, and what they add to the work.
    fn connections(&self) -> (f64, f64) {
        let walks = self.walks();
        (saved_by_connections(&[self]), walks / (self.work(1.0) - walks).max(1.0))
    }

    /// By class of places, whether aim pays from there, if all of it adds so much to the work, or takes it away.
    fn worth_aiming(&self, added: f64) -> Vec<bool> {
        let all = self.aimed.iter().sum::<u64>().max(1) as f64;
        let pays = |class: usize| {
            let its = added.max(0.0) * self.aimed[class] as f64 / all;
            self.saved(|m| m.unaimed_from.get(&class).copied().unwrap_or(0.0)) > AIM_WORTH * its
        };
        (0..CLASSES).map(pays).collect()
    }

    /// How many light subpaths per sample pay, and by how much: work times second moments, over those with one. Of the
    /// mean over the groups and the mean over all paths the one that forecasts more counts: a bright path that one
    /// technique alone finds must not decide.
    fn light_subpaths(&self) -> (f64, f64) {
        // Work times second moments of caustics and of other light, relative to those with one.
        let cost = |k: usize, kind: usize| {
            let groups = self.moments.iter().map(|m| m.by_number[kind]).filter(|m| m[0] > 0.0);
            let (ratios, [more, all], n) = groups.fold((0.0, [0.0; 2], 0), |(ratios, [more, all], n), m| {
                (ratios + m[k] / m[0], [more + m[k], all + m[0]], n + 1)
            });
            let most = f64::max(ratios / n as f64, more / all);
            (n >= TYPICAL).then(|| most * self.work(NUMBERS[k]) / self.work(1.0))
        };
        let mut best = (NUMBERS[0], 1.0f64);
        for (k, number) in NUMBERS.into_iter().enumerate().skip(1) {
            let Some(caustics) = cost(k, 0) else { break };
            let others = cost(k, 1).unwrap_or(caustics);
            let both = (caustics * others).sqrt();
            if caustics.max(others) < MOST_WORSE && both < best.1.min(FEWER_WORTH) {
                best = (number, both);
            }
        }
        best
    }
}

/// By how much a second moment is more, relative to what it is, in so many of the groups, where that is least.
fn saved_in<'m>(least: usize, moments: impl IntoIterator<Item = &'m Moments>, more: impl Fn(&Moments) -> f64) -> f64 {
    let mut groups: Vec<[f64; 2]> = moments.into_iter().map(|m| [more(m), m.all]).collect();
    groups.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let [more, all] = groups[..least].iter().fold([0.0; 2], |sum, g| [sum[0] + g[0], sum[1] + g[1]]);
    more / all.max(f64::MIN_POSITIVE)
}

/// In all groups but the one that forecasts most.
fn saved_by_searches(draws: &[&Samples]) -> f64 {
    let groups: usize = draws.iter().map(|draw| draw.moments.len()).sum();
    saved_in(groups - 1, draws.iter().flat_map(|draw| &draw.moments), |m| m.unsearched)
}

/// What caustic connections save, in all groups of these.
fn saved_by_connections(samples: &[&Samples]) -> f64 {
    let moments = samples.iter().flat_map(|s| &s.moments);
    let [more, all] = moments.fold([0.0; 2], |sum, m| [sum[0] + m.unconnected, sum[1] + m.all]);
    more / all.max(f64::MIN_POSITIVE)
}

fn forecast(saved: f64, added: f64) -> Forecast {
    Forecast { variance: (1.0 + saved) as f32, work: (1.0 + added) as f32 }
}

/// Of what they save and add.
fn connections_pay((saved, added): (f64, f64)) -> bool {
    saved > CONNECTIONS_WORTH * added
}

/// The multiple of the mean radiance by which roulette goes, if it does.
fn threshold(settings: &Settings) -> Option<f32> {
    match settings.caustic_options.roulette {
        Roulette::Contribution(threshold) => Some(threshold),
        Roulette::Off | Roulette::Lengths => None,
    }
}

/// Draws the samples, if anything depends on them: a function of scene, view, seed and settings.
pub(super) fn look(world: &World, view: &View, settings: &Settings, host: &Host) -> Result<Pilot, RenderError> {
    let connects = samples::connects_through_glass(world, settings);
    let bidirectional = settings.integrator == Integrator::Bdpt;
    // Where a light cannot be hit, the connections may find what nothing else does.
    let decides = bidirectional
        && connects
        && settings.caustics == Caustics::Auto
        && !settings.per_technique
        && !settings.caustics_only
        && !world.requirements.delta_lights;
    let light_subpaths = match settings.integrator {
        Integrator::Mnee => 0.0,
        Integrator::Bdpt => settings.caustic_options.light_subpaths.map_or(1.0, f64::from),
        Integrator::Light => 1.0,
        Integrator::Path => 0.0,
    };
    let decides_number =
        bidirectional && connects && settings.caustic_options.light_subpaths.is_none() && !settings.per_technique;
    // Through flat glass, walks find all but what other facets lead to, and that is left to hits of the lamp.
    let curved = world.walked_glass().bodies().iter().any(|r| r.curved);
    let decides_seeds = bidirectional && connects && settings.caustic_options.seeds.is_none() && curved;
    let options = &settings.caustic_options;
    // What connections to delta lights search for, nothing else finds: it says nothing of other lamps. With the direct
    // geometry term weighted contributions have no bound, and few say nothing.
    let decides_search = bidirectional
        && connects
        && options.search.is_none()
        && options.check == Check::Exact
        && options.geometry_term == GeometryTerm::Exact
        && curved
        && !world.requirements.delta_lights;
    let aims = world.requirements.caustics && (bidirectional || settings.integrator == Integrator::Light);
    let share = settings.caustic_options.aim.filter(|_| aims);
    let decides_aim = bidirectional && connects && settings.caustic_options.aim.is_none();
    let plain = Pilot {
        aim: None,
        experience: Experience::default(),
        connects,
        forecast: None,
        aim_forecast: None,
        light_subpaths,
        seeds: if curved { MOST_SEEDS } else { 1 },
        seeds_forecast: None,
        search: 0.0,
        search_forecast: None,
    };
    let share = if decides_aim { AIM } else { share.unwrap_or(0.0) };
    let targets = if share > 0.0 { aim::glass(world) } else { Default::default() };
    let aiming =
        |share: &dyn Fn(usize) -> f32| Pilot { aim: Some(Aimed::new(world, &targets, share)), ..plain.clone() };
    let mut pilot = if share > 0.0 { aiming(&|_| share) } else { plain.clone() };
    let decides_any = decides || decides_aim || decides_number || decides_seeds || decides_search;
    if !connects || !(decides_any || threshold(settings).is_some()) {
        return Ok(pilot);
    }
    let draw_groups = |pilot: &Pilot, numbers| Samples::draw(world, view, settings, pilot, host, numbers);
    let draw = |pilot: &Pilot| draw_groups(pilot, 0..GROUPS);
    let Some(mut samples) = draw(&pilot)? else { return Ok(pilot) };
    if decides_aim {
        let Some(others) = draw(&plain)? else { return Ok(pilot) };
        // Connections that pay neither with aim nor without will not be made: their walks are no part of its work.
        let unconnected = decides && [&samples, &others].iter().all(|s| !connections_pay(s.connections()));
        let work = |s: &Samples| s.work(1.0) - if unconnected { s.walks() } else { 0.0 };
        let added = |s: &Samples| work(s) / work(&others) - 1.0;
        // Where there will be connections for sure, with as many light subpaths as then pay.
        let cost = |s: &Samples| if decides_number && !decides { s.light_subpaths().1 } else { 1.0 } * work(s);
        let worth = samples.worth_aiming(cost(&samples) / cost(&others) - 1.0);
        if worth.contains(&true) {
            pilot = aiming(&|class| if worth[class] { share } else { 0.0 });
            let Some(chosen) = draw(&pilot)? else { return Ok(pilot) };
            samples = chosen;
            pilot.aim_forecast = Some(forecast(samples.saved(|m| m.unaimed), added(&samples)));
        } else {
            let of_all = forecast(samples.saved(|m| m.unaimed), added(&samples));
            (pilot, samples) = (Pilot { aim_forecast: Some(of_all), ..plain }, others);
        }
    }
    if decides {
        let (mut saved, added) = samples.connections();
        if saved > added * CONNECTIONS_WORTH / CLEAR && saved < added * CONNECTIONS_WORTH * CLEAR {
            let Some(more) = draw_groups(&pilot, GROUPS..LONG * GROUPS)? else { return Ok(pilot) };
            saved = saved_by_connections(&[&samples, &more]);
        }
        pilot.connects = connections_pay((saved, added));
        pilot.forecast = Some(forecast(saved, added));
    }
    if decides_seeds && pilot.connects {
        let (saved, added) = (samples.saved(|m| m.unretried), samples.retries / (samples.work(1.0) - samples.retries));
        pilot.seeds = if saved > SEEDS_WORTH * added { MOST_SEEDS } else { 1 };
        pilot.seeds_forecast = Some(forecast(saved, added));
    }
    if decides_search && pilot.connects {
        let searching = Pilot { search: 1.0, ..pilot.clone() };
        let Some(always) = draw(&searching)? else { return Ok(pilot) };
        let mut saved = saved_by_searches(&[&always]);
        let added = f64::from(LAMP_SEARCH) * always.searches / (always.work(1.0) - always.searches);
        if saved > added && saved < added * SEARCH_WORTH * CLEAR {
            let Some(more) = draw_groups(&searching, GROUPS..LONG * GROUPS)? else { return Ok(pilot) };
            saved = saved_by_searches(&[&always, &more]);
        }
        pilot.search = if saved > SEARCH_WORTH * added { LAMP_SEARCH } else { 0.0 };
        pilot.search_forecast = Some(forecast(saved, added));
    }
    // Without connections, light subpaths are all that finds caustics.
    if decides_number && pilot.connects {
        pilot.light_subpaths = samples.light_subpaths().0;
        // Of fewer light subpaths each counts more, and with it what roulette may expect of it.
        if pilot.light_subpaths < 1.0
            && let Some(fewer) = draw(&pilot)?
        {
            samples = fewer;
        }
    }
    pilot.experience = samples.experience;
    Ok(pilot)
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
