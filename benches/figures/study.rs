//! All that is measured on one scene.

use crate::measure::{Budget, Estimate, Method, Reference, Subject};
use crate::report::{Report, number};
use crate::{Options, SEED, Scene, plot, strip};
use caustica::render::{Forecast, Output, Statistics};
use caustica::transport::walk_count::REASONS;
use std::fmt::Write;

/// Shares of the budget of the shorter renders.
const SHARES: [f64; 4] = [1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0];

/// Independent renders of each technique without walks that checks a reference.
const CHECKS: u64 = 8;

/// Of [`Options::reference_seconds`], for each integrator that checks the reference.
const CHECK_SHARE: f64 = 0.25;

/// Microseconds of one sample of all methods together, on one thread, for the estimate alone.
const SAMPLE_MICROSECONDS: f64 = 70.0;

/// One method's row.
struct Row {
    method: Method,
    timed: Output,
    errors: [f64; 2],
    bias: f64,
    /// Of the equal-sample render.
    equal: [f64; 2],
    sample_seconds: f64,
}

/// Seconds of [`run`].
pub(crate) fn estimate(scene: &Scene, options: &Options) -> f64 {
    let methods = options.methods().len() as f64;
    let checks = if scene.checked { 2.0 * CHECK_SHARE } else { 0.0 };
    let samples = f64::from(options.samples) * f64::from(options.side).powi(2);
    scene.factor * options.reference_seconds * (1.0 + checks)
        + scene.factor * options.seconds * methods * (1.0 + SHARES.iter().sum::<f64>())
        + samples * SAMPLE_MICROSECONDS * 1e-6 / options.threads.max(1) as f64
}

/// Renders the scene in all ways, and writes its picture, its plot and its piece of the document.
pub(crate) fn run(scene: &Scene, options: &Options, report: &Report) {
    let subject = options.open(scene, options.side);
    let methods = options.methods();
    let ours = methods.len() - 1;
    let seconds = options.seconds * scene.factor;
    let reference = Reference::new(&subject, options.reference_seconds * scene.factor);
    eprintln!(
        "  region {:.1} %, noise of the reference {} / {}, of its mean {:.2} %",
        100.0 * reference.coverage(),
        number(reference.noise[0]),
        number(reference.noise[1]),
        100.0 * reference.drift
    );
    let checks = if scene.checked { check(scene, options, &subject, &reference) } else { Vec::new() };

    let mut curves = Vec::new();
    let rows: Vec<Row> = (methods.into_iter())
        .map(|method| {
            let mut points: Vec<(f64, [f64; 2])> = Vec::new();
            for (share, seed) in SHARES.into_iter().zip(SEED + 1..) {
                // Where a single pass takes longer, there is nothing new to see.
                if points.last().is_some_and(|(t, _)| *t > seconds * share) {
                    continue;
                }
                let short = subject.render(&method, Budget::Seconds(seconds * share), seed, false);
                points.push((short.statistics.render_seconds, reference.errors(&short.image)));
            }
            let timed = subject.render(&method, Budget::Seconds(seconds), SEED, false);
            let errors = reference.errors(&timed.image);
            points.push((timed.statistics.render_seconds, errors));
            curves.push((method.name, points));
            let equal = subject.render(&method, Budget::Samples(options.samples), SEED, false);
            eprintln!(
                "  {:6} {:6} spp  {} / {}",
                method.name,
                timed.statistics.samples,
                number(errors[0]),
                number(errors[1])
            );
            Row {
                method,
                errors,
                bias: reference.bias(&timed.image),
                timed,
                equal: reference.errors(&equal.image),
                sample_seconds: equal.statistics.render_seconds / f64::from(equal.statistics.samples),
            }
        })
        .collect();

    let images: Vec<_> = rows.iter().map(|row| &row.timed.image).collect();
    report.picture(scene.name, &strip::strip(&images, &reference));
    report.plot(scene.name, &plot::plot(&curves));
    let mut body = format!("{}\n\n", about(&reference, &checks, seconds, options));
    let order = rows.iter().map(|row| row.method.name).collect::<Vec<_>>().join(", ");
    _ = writeln!(body, "![{}](results/{}.jpg)\n", scene.name, scene.name);
    _ = writeln!(body, "In rows, from the left: {order}, the reference, the caustic region.\n");
    _ = writeln!(body, "![relMSE over time](results/{}.svg)\n", scene.name);
    table(&mut body, &rows);
    _ = writeln!(body, "\n{}", walks(&rows[ours].timed.statistics));
    report.scene(scene.name, &summary(scene, &reference, &checks, &rows), &body);
}

/// Difference of plain integrators' means in the region from the reference's.
fn check(scene: &Scene, options: &Options, subject: &Subject, reference: &Reference) -> Vec<(&'static str, Estimate)> {
    let seconds = options.reference_seconds * scene.factor * CHECK_SHARE / CHECKS as f64;
    let plain = Method::all().into_iter().filter(|m| ["bdpt", "path"].contains(&m.name));
    let checks = plain.map(|method| {
        let render = |k| subject.render(&method, Budget::Seconds(seconds), 0xc4ec_0000 + k, false).image;
        let differences: Vec<f64> = (0..CHECKS).map(|k| reference.bias(&render(k))).collect();
        (method.name, Estimate::of(&differences))
    });
    let checks: Vec<_> = checks.collect();
    eprintln!("  checked: {}", verdict(&checks));
    checks
}

fn verdict(checks: &[(&str, Estimate)]) -> String {
    checks.iter().map(|(name, difference)| format!("{name} {difference}")).collect::<Vec<_>>().join(", ")
}

fn about(reference: &Reference, checks: &[(&str, Estimate)], seconds: f64, options: &Options) -> String {
    let region = match reference.has_region() {
        true => format!("{:.1} % of the pixels", 100.0 * reference.coverage()),
        false => "none".to_owned(),
    };
    let checked = match checks {
        [] => "not checked by plain integrators".to_owned(),
        _ => format!("difference of {CHECKS} plain renders each from its mean: {}", verdict(checks)),
    };
    format!(
        "Caustic region: {region}. Noise of the reference (relMSE): {} inside, {} outside; of its mean about {:.2} %; \
         {checked}. Equal time: {seconds} s; equal samples: {}.",
        number(reference.noise[0]),
        number(reference.noise[1]),
        100.0 * reference.drift,
        options.samples
    )
}

fn table(body: &mut String, rows: &[Row]) {
    let plain = rows.iter().find(|row| row.method.name == "bdpt").expect("one of the methods").sample_seconds;
    *body += "| | time (s) | samples | inside | outside | bias | equal samples: inside | outside | inside/outside \
              | time per sample |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
    for row in rows {
        _ = writeln!(
            body,
            "| {} | {:.1} | {} | {} | {} | {:+.2} % | {} | {} | {} | {:.2} |",
            row.method.name,
            row.timed.statistics.render_seconds,
            row.timed.statistics.samples,
            number(row.errors[0]),
            number(row.errors[1]),
            100.0 * row.bias,
            number(row.equal[0]),
            number(row.equal[1]),
            number(row.equal[0] / row.equal[1]),
            row.sample_seconds / plain
        );
    }
}

/// The scene's row of the main table; see [`crate::report::COLUMNS`].
fn summary(scene: &Scene, reference: &Reference, checks: &[(&str, Estimate)], rows: &[Row]) -> String {
    let part = usize::from(!reference.has_region());
    // Error times time, and how much worse the region is.
    let numbers = |name: &str| {
        let row = rows.iter().find(|row| row.method.name == name).expect("one of the methods");
        (row.errors[part] * row.timed.statistics.render_seconds, row.equal[0] / row.equal[1])
    };
    let region = match reference.has_region() {
        true => format!("{:.0} %", 100.0 * reference.coverage()),
        false => "none".to_owned(),
    };
    let checked = if checks.is_empty() { "–".to_owned() } else { verdict(checks) };
    let errors = Method::all().into_iter().map(|method| {
        let row = rows.iter().find(|row| row.method.name == method.name);
        number(row.map_or(f64::NAN, |row| row.errors[part]))
    });
    let errors: Vec<String> = errors.collect();
    let (bdpt, mnee, ours) = (numbers("bdpt"), numbers("mnee"), numbers("ours"));
    format!(
        "| [{name}](#{name}) | {region} | {} | {checked} | {} | {} | {} | {} | {} |",
        number(reference.noise[part]),
        errors.join(" | "),
        number(bdpt.0 / ours.0),
        number(mnee.0 / ours.0),
        number(bdpt.1),
        number(ours.1),
        name = scene.name
    )
}

fn walks(s: &Statistics) -> String {
    let walks = s.walks;
    let decided = |what: &str, made: bool, forecast: Option<Forecast>| {
        forecast.map_or(String::new(), |f| {
            let made = if made { "yes" } else { "no" };
            format!(
                " {what}: {made}; forecast {:.2} times the caustics' variance without, {:.2} times the work with.",
                f.variance, f.work
            )
        })
    };
    let mut forecast = decided("Aimed", s.aimed, s.aim_forecast) + &decided("Connected", s.caustics, s.forecast);
    forecast += &decided("From other starts", s.seeds > 1, s.seeds_forecast);
    forecast += &decided("Searches", s.search > 0.0, s.search_forecast);
    if s.light_subpaths < 1.0 {
        forecast += &format!(" Light subpaths: {} a sample.", s.light_subpaths);
    }
    if walks.total() == 0 {
        return format!("Walks of ours: none.{forecast}");
    }
    let percent = |part: u64, whole: u64| 100.0 * part as f64 / whole.max(1) as f64;
    let nanoseconds = walks.nanoseconds.iter().sum::<u64>() as f64;
    let reasons = REASONS.iter().zip(walks.rejected).filter(|(_, n)| *n > 0);
    let mut without: Vec<String> =
        reasons.map(|(reason, n)| format!("{reason} {:.1} %", percent(n, walks.total()))).collect();
    if walks.occluded > 0 {
        without.push(format!("something in the way {:.1} %", percent(walks.occluded, walks.total())));
    }
    if without.is_empty() {
        without.push("none".to_owned());
    }
    format!(
        "Walks of ours: {} connections, {:.0} % found a chain; {} checks, {:.0} % confirmed; {:.1} iterations a walk; \
         {:.0} % of the time; {:.2} µs and {:.2} rays an iteration. Of all walks without a chain: {}.{forecast}",
        walks.connections,
        percent(walks.connected, walks.connections),
        walks.checks,
        percent(walks.confirmed, walks.checks),
        walks.iterations as f64 / walks.total() as f64,
        nanoseconds * 1e-7 / (s.render_seconds * f64::from(s.threads)),
        nanoseconds * 1e-3 / walks.iterations.max(1) as f64,
        s.walk_rays as f64 / walks.iterations.max(1) as f64,
        without.join(", ")
    )
}
