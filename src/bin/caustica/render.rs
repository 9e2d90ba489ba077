//! `caustica render`.

use crate::args::{Cli, ImageIoName, Render, Switch};
use crate::console::Console;
use crate::progress::{self, Meter};
use crate::{Failure, scene, units};
use caustica::io::image::{self, ImageIo, Metadata, WriteOptions};
use caustica::render::Image;
use caustica::render::job::{self, Cancel, Integrator, Output, Settings, Statistics, Technique};
use caustica::scene::{CommitOptions, World};
use caustica::transport::caustic::REASONS;
use clap::CommandFactory;
use clap::error::ErrorKind;
use std::path::Path;
use std::time::Duration;

pub(crate) fn run(args: &Render) -> Result<(), Failure> {
    let integrator = Integrator::from(args.integrator);
    if args.strategies.is_some() && integrator == Integrator::Path {
        let conflict = "--strategies needs --integrator bdpt, mnee or light: a path tracer has no (s, t)";
        Cli::command().error(ErrorKind::ArgumentConflict, conflict).exit();
    }
    let console = Console { quiet: args.quiet };
    // What cannot be written is found out before hours of rendering.
    for path in &args.output {
        image::check_writable(path, &options(args))?;
    }

    let commit =
        CommitOptions { backend: args.backend.map_or_else(Default::default, Into::into), threads: args.threads };
    let (description, world) = scene::open(&args.scene, commit, console)?;
    let settings = Settings {
        integrator,
        width: args.size.0,
        height: args.size.1,
        camera: scene::camera(&description.cameras, args.camera.as_deref())?,
        samples: samples(args),
        time_limit: args.time.map(Duration::from_secs_f64),
        max_depth: args.max_depth,
        seed: args.seed,
        threads: args.threads,
        per_technique: args.strategies.is_some(),
        caustics: args.caustics == Switch::On,
        caustics_only: args.caustics_only,
        caustic_options: args.caustic_options(),
    };
    if let Some(dir) = &args.strategies {
        std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
        image::check_writable(&dir.join(technique_file((0, 2), "")), &technique_options())?;
    }

    let meter = Meter::new(args.quiet);
    let output = job::render(&world, &settings, &Cancel::default(), &|progress| meter.report(progress))?;
    let noise = meter.finish().and_then(|last| progress::noise(last.noise));
    report(&output, noise, console);

    let metadata = metadata(&settings, &output, &world, &description.cameras[settings.camera].name);
    for path in &args.output {
        write(path, &output.image, &metadata, &options(args), console)?;
    }
    if let Some(dir) = &args.strategies {
        for (&technique, images) in &output.techniques {
            let parts = [(&images.weighted, ""), (&images.caustic, "_caustic"), (&images.unweighted, "_unweighted")];
            for (image, suffix) in parts {
                image::write(&dir.join(technique_file(technique, suffix)), image, &metadata, &technique_options())?;
            }
        }
        let files = 3 * output.techniques.len();
        console.note(&format!("wrote {files} images of strategies to {}", dir.display()));
    }
    Ok(())
}

/// Without a number, a time limit alone decides.
fn samples(args: &Render) -> u32 {
    match (args.spp, args.time) {
        (Some(n), _) => n,
        (None, Some(_)) => u32::MAX,
        (None, None) => Settings::default().samples,
    }
}

fn options(args: &Render) -> WriteOptions {
    let image_io = match args.image_io {
        ImageIoName::Auto => ImageIo::Auto,
        ImageIoName::Oiio => ImageIo::Oiio,
    };
    WriteOptions { image_io, exposure: args.exposure, half: !args.float }
}

/// A single technique can be brighter than what half floats hold.
fn technique_options() -> WriteOptions {
    WriteOptions { half: false, ..WriteOptions::default() }
}

fn technique_file((s, t): Technique, suffix: &str) -> String {
    format!("s{s:02}_t{t:02}{suffix}.exr")
}

fn metadata(settings: &Settings, output: &Output, world: &World, camera: &str) -> Metadata {
    let mut metadata = Metadata::new();
    // A name may hold anything; the formats' texts do not take NUL.
    let settings_text = format!("{} camera={camera:?}", settings.describe());
    metadata
        .set("samples", output.statistics.samples)
        .set("seed", settings.seed)
        .set("settings", settings_text)
        .set("scene-hash", format!("{:016x}", world.hash()))
        .set("backend", output.statistics.backend.as_str());
    metadata
}

fn report(output: &Output, noise: Option<String>, console: Console) {
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
    if s.non_finite > 0 {
        let at = s.first_non_finite.map_or(String::new(), |(p, n)| format!("; the first in pixel {p}, sample {n}"));
        let what = units::count(s.non_finite as usize, "sample was", "samples were");
        console.warn(&format!("{what} NaN or infinite and left out{at}"));
    }
}

fn walks(s: &Statistics, console: Console) {
    let walks = s.walks;
    if walks.total() == 0 {
        return;
    }
    let percent = |part: u64, whole: u64| part as f64 / whole.max(1) as f64 * 100.0;
    // Of all threads' time.
    let share = |ns: u64| ns as f64 * 1e-7 / (s.render_seconds * f64::from(s.threads)).max(1e-9);
    console.note(&format!(
        "{} manifold walks to connect ({} spared), {:.0} % of them found a chain, {:.0} % of the time; {} to check \
         sampled chains, {:.0} % confirmed, {:.0} % of the time",
        walks.connections,
        walks.spared,
        percent(walks.connected, walks.connections),
        share(walks.nanoseconds[0]),
        walks.checks,
        percent(walks.confirmed, walks.checks),
        share(walks.nanoseconds[1]),
    ));
    let classes = |counts: &[u64]| {
        let used = counts.iter().rposition(|&n| n > 0).map_or(0, |last| last + 1);
        let class = |(k, n): (usize, &u64)| format!("{}+: {:.0} %", 1 << k, percent(*n, walks.total()));
        counts[..used].iter().enumerate().map(class).collect::<Vec<_>>().join(", ")
    };
    console.note(&format!(
        "{:.1} iterations a walk; converged after {}; given up after {}",
        walks.iterations as f64 / walks.total() as f64,
        classes(&walks.steps[0]),
        classes(&walks.steps[1])
    ));
    console.note(&format!(
        "{:.2} rays an iteration, {:.2} microseconds",
        s.walk_rays as f64 / walks.iterations.max(1) as f64,
        walks.nanoseconds.iter().sum::<u64>() as f64 * 1e-3 / walks.iterations.max(1) as f64
    ));
    let reasons = REASONS.iter().zip(walks.rejected).filter(|(_, n)| *n > 0);
    let mut rejected: Vec<String> =
        reasons.map(|(reason, n)| format!("{reason} {:.0} %", percent(n, walks.total()))).collect();
    if walks.occluded > 0 {
        rejected.push(format!("something in the way {:.0} %", percent(walks.occluded, walks.total())));
    }
    if !rejected.is_empty() {
        console.note(&format!("walks without a chain: {}", rejected.join(", ")));
    }
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
        assert_eq!(args.size, (library.width, library.height));
        assert_eq!(samples(&args), library.samples);
        assert_eq!(args.max_depth, library.max_depth);
        assert_eq!((args.seed, args.threads), (library.seed, library.threads));
        assert_eq!(options(&args), WriteOptions::default());
    }

    #[test]
    fn a_time_limit_alone_sets_no_number_of_samples() {
        assert_eq!(samples(&parsed(&["--time", "2"])), u32::MAX);
        assert_eq!(samples(&parsed(&["--time", "2", "--spp", "8"])), 8);
    }
}
