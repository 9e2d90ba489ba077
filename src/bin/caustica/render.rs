//! `caustica render`.

use crate::args::{Cli, ImageIoName, Render};
use crate::console::{self, Console};
use crate::progress::{self, Meter};
use crate::scene::Opened;
use crate::{Failure, INTERRUPTED, scene, units, walks};
use caustica::io::image::{self, ImageIo, Metadata, WriteOptions};
use caustica::math::luminance;
use caustica::render::{
    self, Cancel, Forecast, Image, Integrator, Output, Region, Settings, Statistics, Technique, TechniqueImages,
    samples_by_limits,
};
use caustica::scene::CommitOptions;
use clap::CommandFactory;
use clap::error::ErrorKind;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

const FEATURE_FILES: [&str; 3] = ["albedo.exr", "normal.exr", "depth.exr"];

pub(crate) fn run(args: &Render) -> Result<(), Failure> {
    let integrator = Integrator::from(args.integrator);
    if args.strategies.is_some() && integrator == Integrator::Path {
        let conflict = "--strategies needs --integrator bdpt, mnee or light: a path tracer has no (s, t)";
        Cli::command().error(ErrorKind::ArgumentConflict, conflict).exit();
    }
    if args.features.is_some() && integrator == Integrator::Light {
        let conflict = "--features needs --integrator bdpt, mnee or path: light tracing sees nothing from the camera";
        Cli::command().error(ErrorKind::ArgumentConflict, conflict).exit();
    }
    if args.transparent && integrator == Integrator::Light {
        let conflict =
            "--transparent needs --integrator bdpt, mnee or path: light tracing sees nothing from the camera";
        Cli::command().error(ErrorKind::ArgumentConflict, conflict).exit();
    }
    if args.transparent && args.image_io == ImageIoName::Oiio {
        let conflict = "--transparent needs --image-io auto: the built-in writer alone keeps alpha";
        Cli::command().error(ErrorKind::ArgumentConflict, conflict).exit();
    }
    args.picture.check_used(args.integrator);
    let console = Console { quiet: args.quiet };
    // What cannot be written is found out before hours of rendering.
    for path in &args.output {
        image::check_writable(path, &options(args))?;
    }

    let is_exr = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if args.transparent && !args.output.iter().any(is_exr) {
        console.warn("--transparent: EXR alone keeps alpha; other formats have the picture over black");
    }
    let commit = CommitOptions { backend: args.picture.backend(), threads: args.threads, ..CommitOptions::default() };
    let Opened { description, aspects, world } = scene::open(&args.scene, commit, Some(&args.picture), console)?;
    let settings = Settings {
        integrator,
        samples: samples(args),
        time_limit: args.time.map(Duration::from_secs_f64),
        noise_limit: args.noise.map(|noise| noise as f32),
        threads: args.threads,
        clamp: args.clamp.map(|most| most as f32),
        features: args.features.is_some(),
        transparent: args.transparent,
        per_technique: args.strategies.is_some(),
        caustics_only: args.caustics_only,
        ..args.picture.settings(&description.cameras, &aspects)?
    };
    let first_strategy = technique_file((0, 2), "");
    for (dir, file) in [(&args.strategies, first_strategy.as_str()), (&args.features, FEATURE_FILES[0])] {
        let Some(dir) = dir else { continue };
        std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
        image::check_writable(&dir.join(file), &float_options())?;
    }

    let meter = Meter::new(args.quiet);
    let cancel = until_interrupted()?;
    let output = render::render(&world, &settings, &cancel, &|progress| meter.report(progress))?;
    let noise = meter.finish().and_then(|last| progress::noise(last.noise));
    if output.cancelled && output.statistics.samples == 0 {
        return Err(Interrupted { samples: 0 }.into());
    }
    report(&output, settings.region(), noise, console);

    // What one file refuses must not cost the others.
    let metadata =
        Metadata::of_render(&settings, &description.cameras[settings.camera].name, world.hash(), &output.statistics);
    let written = args.output.iter().map(|path| write(path, &output.image, &metadata, &options(args), console));
    let mut failed: Vec<Failure> = written.collect::<Vec<_>>().into_iter().filter_map(Result::err).collect();
    if let Some(dir) = &args.strategies {
        failed.extend(write_strategies(dir, &output.techniques, &metadata, console).err());
    }
    if let (Some(dir), Some(features)) = (&args.features, &output.features) {
        let files = features.iter().zip(FEATURE_FILES);
        failed.extend(
            files.filter_map(|(image, file)| write(&dir.join(file), image, &metadata, &float_options(), console).err()),
        );
    }
    if failed.is_empty() && output.cancelled {
        return Err(Interrupted { samples: output.statistics.samples }.into());
    }
    let last = failed.pop();
    failed.iter().for_each(|failure| console::error(failure.as_ref()));
    last.map_or(Ok(()), Err)
}

/// The user ended the render early; what was whole is written.
#[derive(Debug)]
pub(crate) struct Interrupted {
    samples: u32,
}

impl std::error::Error for Interrupted {}

impl std::fmt::Display for Interrupted {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.samples {
            0 => write!(f, "interrupted before the first sample of each pixel: nothing is written"),
            n => write!(f, "interrupted: what is written has {}", units::count(n as usize, "sample", "samples")),
        }
    }
}

/// Cancels at the first interrupt (Ctrl-C); the second ends the process.
fn until_interrupted() -> Result<Arc<Cancel>, Failure> {
    let cancel = Arc::new(Cancel::default());
    let shared = cancel.clone();
    ctrlc::set_handler(move || {
        if shared.is_cancelled() {
            std::process::exit(INTERRUPTED.into());
        }
        shared.cancel();
    })?;
    Ok(cancel)
}

fn write_strategies(
    dir: &Path,
    techniques: &BTreeMap<Technique, TechniqueImages>,
    metadata: &Metadata,
    console: Console,
) -> Result<(), Failure> {
    for (&technique, images) in techniques {
        let parts = [(&images.weighted, ""), (&images.caustic, "_caustic"), (&images.unweighted, "_unweighted")];
        for (image, suffix) in parts {
            image::write(&dir.join(technique_file(technique, suffix)), image, metadata, &float_options())?;
        }
    }
    console.note(&format!("wrote {} images of strategies to {}", 3 * techniques.len(), dir.display()));
    for line in shares(techniques) {
        console.note(&line);
    }
    Ok(())
}

/// Without a number, a time limit alone decides.
fn samples(args: &Render) -> u32 {
    let limits = || samples_by_limits(args.time.is_some(), args.noise.is_some(), args.picture.first_sample);
    args.spp.unwrap_or_else(limits)
}

fn options(args: &Render) -> WriteOptions {
    let image_io = match args.image_io {
        ImageIoName::Auto => ImageIo::Auto,
        ImageIoName::Oiio => ImageIo::Oiio,
    };
    WriteOptions { image_io, exposure: args.exposure, half: !args.float }
}

/// A single technique can be brighter than what half floats hold, and features are for programs.
fn float_options() -> WriteOptions {
    WriteOptions { half: false, ..WriteOptions::default() }
}

fn technique_file((s, t): Technique, suffix: &str) -> String {
    format!("s{s:02}_t{t:02}{suffix}.exr")
}

fn report(output: &Output, region: Region, noise: Option<String>, console: Console) {
    let s = &output.statistics;
    let rate = progress::spaced(units::si(s.rays() as f64 / s.render_seconds.max(1e-9)));
    let mut line = format!(
        "{} per pixel in {}: {rate}rays/s on {}, {}",
        units::count(s.samples as usize, "sample", "samples"),
        units::time(s.render_seconds),
        units::count(s.threads as usize, "thread", "threads"),
        s.backend
    );
    if let Some(noise) = noise {
        line += &format!(", {noise}");
    }
    console.note(&line);
    console.note(&format!(
        "scene {} built in {}, film {}",
        units::bytes(s.scene_bytes),
        units::time(s.commit_seconds),
        units::bytes(s.film_bytes)
    ));
    walks(s, console);
    if s.clamped > 0.0 {
        console.note(&format!("clamped: {:.2} % of the light is left out", 100.0 * s.clamped));
    }
    if s.non_finite > 0 {
        let at = s.first_non_finite.map_or(String::new(), |(p, n)| {
            let (x, y) = (region.x + p % region.width, region.y + p / region.width);
            format!("; the first in pixel ({x}, {y}), sample {n}")
        });
        let what = units::count(s.non_finite as usize, "sample was", "samples were");
        console.warn(&format!("{what} NaN or infinite and left out{at}"));
    }
}

fn walks(s: &Statistics, console: Console) {
    let walks = s.walks;
    let decision = |what: &str, made: bool, forecast: Option<Forecast>| {
        let Some(Forecast { variance, work }) = forecast else { return };
        let made = if made { "yes" } else { "no" };
        console.note(&format!(
            "{what}: {made}; forecast {variance:.2} times the caustics' variance without, {work:.2} times the work with"
        ));
    };
    decision("light subpaths aimed at glass", s.aimed, s.aim_forecast);
    decision("connections through glass", s.caustics, s.forecast);
    decision("walks from other starts", s.seeds > 1, s.seeds_forecast);
    decision("searches for one more chain", s.search > 0.0, s.search_forecast);
    if s.light_subpaths < 1.0 && s.light_path_rays > 0 {
        console.note(&format!("light subpaths: {} a sample", s.light_subpaths));
    }
    if walks.total() == 0 {
        return;
    }
    for line in walks::lines(&walks, s.walk_rays) {
        console.note(&line);
    }
    // Of all threads' time.
    let share = |ns: u64| ns as f64 * 1e-7 / (s.render_seconds * f64::from(s.threads)).max(1e-9);
    console.note(&format!(
        "walks took {:.0} % of the time to connect, {:.0} % to check; {:.2} microseconds an iteration",
        share(walks.nanoseconds[0]),
        share(walks.nanoseconds[1]),
        walks.nanoseconds.iter().sum::<u64>() as f64 * 1e-3 / walks.iterations.max(1) as f64
    ));
}

/// Below this share in percent of both columns, strategies are summed up.
const SMALL_SHARE: f64 = 0.1;

/// What each strategy adds to the picture and to its caustics, in percent of the luminance.
fn shares(techniques: &BTreeMap<Technique, TechniqueImages>) -> Vec<String> {
    let energy = |image: &Image| image.pixels.iter().map(|&p| f64::from(luminance(p))).sum::<f64>();
    let energies: Vec<_> =
        techniques.iter().map(|(&technique, i)| (technique, [energy(&i.weighted), energy(&i.caustic)])).collect();
    let total = energies.iter().fold([0.0; 2], |sum, (_, e)| [sum[0] + e[0], sum[1] + e[1]]);
    let percent = |e: [f64; 2]| [0, 1].map(|i| if total[i] > 0.0 { 100.0 * e[i] / total[i] } else { 0.0 });
    let shares = energies.into_iter().map(|(technique, e)| (technique, percent(e)));
    let (mut large, small): (Vec<_>, Vec<_>) = shares.partition(|(_, p)| p[0].max(p[1]) >= SMALL_SHARE);
    large.sort_by(|a, b| b.1[0].total_cmp(&a.1[0]));

    let line = |name: &str, [all, caustics]: [f64; 2]| format!("{name:<12} {all:>9.1} % {caustics:>9.1} %");
    let mut lines = vec![format!("{:<12} {:>11} {:>11}", "strategy", "all light", "caustics")];
    lines.extend(large.iter().map(|((s, t), p)| line(&format!("s {s:>2}  t {t:>2}"), *p)));
    if !small.is_empty() {
        let rest = small.iter().fold([0.0; 2], |sum, (_, p)| [sum[0] + p[0], sum[1] + p[1]]);
        lines.push(line(&format!("{} more", small.len()), rest));
    }
    lines
}

fn write(
    path: &Path,
    image: &Image,
    metadata: &Metadata,
    options: &WriteOptions,
    console: Console,
) -> Result<(), Failure> {
    let written = image::write(path, image, metadata, options)?;
    if written.non_finite > 0 {
        let what = units::count(written.non_finite as usize, "pixel was", "pixels were");
        console.warn(&format!("{}: {what} NaN or infinite, now black", path.display()));
    }
    if written.clamped > 0 {
        let what = units::count(written.clamped as usize, "pixel was", "pixels were");
        console.warn(&format!("{}: {what} cut to the range of the format; see --float", path.display()));
    }
    // Lamps in the picture are no mistake. A quarter: not tuned.
    let pixels = image.pixels.len() as u64;
    if written.white > pixels / 4 {
        let share = 100 * written.white / pixels;
        console.warn(&format!("{}: {share} % of the pixels are brighter than white; see --exposure", path.display()));
    }
    if written.too_dim {
        console.warn(&format!("{}: most pixels are too dim for the format's digits; see --float", path.display()));
    }
    console.note(&format!("wrote {}", path.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Command;
    use clap::Parser;

    fn parsed(extra: &[&str]) -> Render {
        let line = ["caustica", "render", "a.glb", "-o", "a.exr"];
        match Cli::parse_from(line.iter().chain(extra)).command {
            Command::Render(args) => args,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn defaults_are_those_of_the_library() {
        let (args, library) = (parsed(&[]), Settings::default());
        assert_eq!(Integrator::from(args.integrator), library.integrator);
        assert_eq!(args.picture.size(None), (library.width, library.height));
        assert_eq!(samples(&args), library.samples);
        assert_eq!(args.picture.max_depth, library.max_depth);
        assert_eq!((args.picture.seed, args.threads), (library.seed, library.threads));
        assert_eq!(options(&args), WriteOptions::default());
    }

    #[test]
    fn a_time_limit_alone_sets_no_number_of_samples() {
        assert!(samples(&parsed(&["--time", "2"])) > u32::MAX / 2);
        assert_eq!(samples(&parsed(&["--time", "2", "--spp", "8"])), 8);
        assert_eq!(samples(&parsed(&["--noise", "0.01"])), 65536);
        assert_eq!(samples(&parsed(&["--noise", "0.01", "--spp", "8"])), 8);
    }
}
