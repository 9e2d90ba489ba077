//! The command line as typed.

use crate::view::View;
use crate::{Failure, scene};
use caustica::camera::Region;
use caustica::intersect::Backend;
use caustica::render::{Caustics, Integrator, Settings};
use caustica::scene::description::Camera;
use caustica::transport::options::{CausticOptions, Check, GeometryTerm, LARGEST_AIM, MOST_ITERATIONS, MOST_SEEDS};
use caustica::transport::roulette::Roulette;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Renders scenes with refractive caustics.
#[derive(Debug, Parser)]
#[command(name = "caustica", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene to image files
    Render(Render),
    /// Say what is in a scene
    Info(Info),
    /// Measure how an image differs from a reference
    Compare(Compare),
    /// Print the paths of one pixel of a render
    Pixel(Pixel),
    /// Hold the two ray tracers against each other: speed, hits, images
    Backends(Backends),
}

#[derive(Debug, Args)]
pub(crate) struct Render {
    /// glTF 2.0 file (.gltf or .glb)
    pub(crate) scene: PathBuf,
    /// Image file, its format by its extension (.exr, .png, .tif, .jpg, .hdr); may be repeated
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
    /// Estimator of the image
    #[arg(long, value_enum, default_value_t = IntegratorName::Bdpt)]
    pub(crate) integrator: IntegratorName,
    /// Samples per pixel; with --time or --noise and without --spp, as many as fit or are needed [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) spp: Option<u32>,
    /// Stop after the pass that is running at this time; the samples before the first pass, which decide on caustics, and
    /// that pass are drawn in any case
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub(crate) time: Option<f64>,
    /// Stop when the estimated noise, the relative standard error of the image, is no more than this, e.g. 0.01; after 16
    /// samples per pixel at least, without --spp after 65536 at most
    #[arg(long, value_name = "ERROR", value_parser = positive)]
    pub(crate) noise: Option<f64>,
    /// Worker threads; 0 for as many as the process may use
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,
    /// Multiplies 8-bit images by 2^STOPS; EXR and HDR keep radiance as it is
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) exposure: f32,
    /// What writes EXR: the built-in writer, or OpenImageIO as for all other formats
    #[arg(long, value_enum, default_value_t = ImageIoName::Auto)]
    pub(crate) image_io: ImageIoName,
    /// Write EXR in 32-bit instead of 16-bit floats
    #[arg(long)]
    pub(crate) float: bool,
    /// Also write three EXR per strategy (s light vertices, t camera vertices) into DIR: weighted, the caustic
    /// part of that, and unweighted
    #[arg(long, value_name = "DIR")]
    pub(crate) strategies: Option<PathBuf>,
    /// Most radiance that one path may add to a pixel, in its largest channel, unless the camera sees the light itself, by
    /// mirrors or through smooth glass: less noise for a bias, which is told; caustics that are brighter get too dim
    #[arg(long, value_name = "RADIANCE", value_parser = positive)]
    pub(crate) clamp: Option<f64>,
    /// Also write albedo.exr and normal.exr into DIR, for denoisers: colour and direction of what is seen, through smooth
    /// glass and by mirrors; and depth.exr, in metres along the view: of the first surface, also of glass
    #[arg(long, value_name = "DIR")]
    pub(crate) features: Option<PathBuf>,
    /// Leave out what the camera sees of the environment with nothing before it; EXR says by its channel A where. What glass
    /// and mirrors show of it stays
    #[arg(long)]
    pub(crate) transparent: bool,
    /// Leave out all light but caustics: what mirrors or smooth glass lead to the surface that the camera sees, and rough
    /// glass where it is crossed by walks (--walked-roughness)
    #[arg(long)]
    pub(crate) caustics_only: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(crate) quiet: bool,
    #[command(flatten)]
    pub(crate) picture: Picture,
}

/// What the samples of a picture depend on, beside the integrator.
#[derive(Debug, Args)]
pub(crate) struct Picture {
    /// Whether bdpt connects through glass by manifold walks; auto: where a few samples forecast that it pays, and
    /// always with delta lights, --strategies, --caustics-only and --paper
    #[arg(long, value_enum, value_name = "WHEN", default_value_t = Switch::Auto)]
    pub(crate) caustics: Switch,
    /// Longest path in segments; 1 is light seen directly
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) max_depth: u32,
    /// Image size in pixels [default: 512 high, as wide as the camera says, else 512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Render these pixels alone, at column X and row Y; an EXR or TIFF says where they are
    #[arg(long, value_name = "WxH+X+Y", value_parser = region)]
    pub(crate) region: Option<Region>,
    /// Number of the first sample: the average of samples 0 to 63 and 64 to 127 is the image of 0 to 127
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) first_sample: u32,
    /// Which of the scene's cameras [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) camera: Option<String>,
    #[command(flatten)]
    pub(crate) view: View,
    /// Makes thin walls of glass that close around an inside solid: for files whose writers left the thickness at 0
    #[arg(long)]
    pub(crate) solid_glass: bool,
    /// Multiplies point, spot and directional lights: 0.001464 (1/683) where the writer turned watts into lumens, as
    /// Blender does unless its lighting mode is Unitless
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive)]
    pub(crate) light_scale: f64,
    /// Ray tracer [default: embree where it is built in]
    #[arg(long, value_enum)]
    pub(crate) backend: Option<BackendName>,
    /// Selects the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) surroundings: Surroundings,
    #[command(flatten, next_help_heading = "How connections through glass are made")]
    pub(crate) connections: Connections,
}

/// Light from all around, in place of the scene's.
#[derive(Debug, Args)]
pub(crate) struct Surroundings {
    /// Image of what is infinitely far away, latitude by longitude, in place of the scene's: its top is +y, its middle +z,
    /// its left quarter +x
    #[arg(long, value_name = "FILE")]
    pub(crate) environment: Option<PathBuf>,
    /// Turns that image, or that of the scene, about +y, from +z to +x [default: 0, or as the scene says]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) environment_rotation: Option<f32>,
    /// Multiplies the light from all around
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = finite)]
    pub(crate) environment_scale: f32,
}

impl Picture {
    /// Ends the program as at any wrong usage if an option was given that this integrator does not look at.
    pub(crate) fn check_used(&self, integrator: IntegratorName) {
        let c = &self.connections;
        let connects = match integrator {
            IntegratorName::Path | IntegratorName::Light => false,
            IntegratorName::Mnee => true,
            IntegratorName::Bdpt => self.caustics != Switch::Off,
        };
        let by_contribution = match c.roulette {
            Some(by) => by == RouletteName::Contribution,
            None => !c.paper,
        };
        let bdpt = integrator == IntegratorName::Bdpt;
        let used = [
            ("--caustics on", self.caustics == Switch::On, connects),
            ("--caustics off", self.caustics == Switch::Off, integrator != IntegratorName::Mnee),
            ("--paper", c.paper, connects || bdpt),
            ("--geometry-term", c.geometry_term.is_some(), connects),
            ("--check", c.check.is_some(), connects),
            ("--roulette", c.roulette.is_some(), connects),
            ("--roulette-threshold", c.roulette_threshold.is_some(), connects && by_contribution),
            ("--seeds", c.seeds.is_some(), connects),
            ("--search", c.search.is_some(), connects),
            ("--walked-roughness", c.walked_roughness.is_some(), connects),
            ("--aim", c.aim.is_some(), bdpt || integrator == IntegratorName::Light),
            ("--light-subpaths", c.light_subpaths.is_some(), bdpt),
            ("--walk-iterations", c.walk_iterations.is_some(), connects),
            ("--walk-tolerance", c.walk_tolerance.is_some(), connects),
        ];
        if let Some((option, ..)) = used.iter().find(|(_, given, used)| *given && !used) {
            let why = if bdpt { "with these settings" } else { "with this integrator" };
            let name = integrator.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
            let conflict = format!("{option} has no effect {why} (--integrator {name})");
            Cli::command().error(ErrorKind::ArgumentConflict, conflict).exit();
        }
    }

    pub(crate) fn backend(&self) -> Backend {
        self.backend.map_or_else(Backend::default, Into::into)
    }

    /// Size of the image, of whose shape a camera says what it was meant for.
    pub(crate) fn size(&self, aspect: Option<f64>) -> (u32, u32) {
        let Settings { width, height, .. } = Settings::default();
        let wide = aspect.map_or(width, |aspect| (f64::from(height) * aspect).round().clamp(1.0, 65536.0) as u32);
        self.size.unwrap_or((wide, height))
    }

    /// The settings that these say, for cameras that were meant for pictures of these shapes; the others are the library's.
    pub(crate) fn settings(&self, cameras: &[Camera], aspects: &[Option<f64>]) -> Result<Settings, Failure> {
        // The last of them if it was put there.
        let camera = if self.view.look_from.is_some() {
            cameras.len() - 1
        } else {
            scene::camera(cameras, self.camera.as_deref())?
        };
        if self.view.lens().is_some() && cameras[camera].lens.is_none() {
            return Err(
                format!("--lens-radius needs a perspective camera, which '{}' is not", cameras[camera].name).into()
            );
        }
        let (width, height) = self.size(aspects.get(camera).copied().flatten());
        Ok(Settings {
            width,
            height,
            region: self.region,
            first_sample: self.first_sample,
            camera,
            max_depth: self.max_depth,
            seed: self.seed,
            caustics: match self.caustics {
                Switch::Auto if !self.connections.paper => Caustics::Auto,
                Switch::Auto | Switch::On => Caustics::On,
                Switch::Off => Caustics::Off,
            },
            caustic_options: self.connections.options(),
            ..Settings::default()
        })
    }
}

#[derive(Debug, Args)]
pub(crate) struct Pixel {
    /// glTF 2.0 file (.gltf or .glb)
    pub(crate) scene: PathBuf,
    /// Column, from 0
    pub(crate) x: u32,
    /// Row, from 0 at the top
    pub(crate) y: u32,
    /// Estimator of the image
    #[arg(long, default_value = "bdpt", value_parser = with_strategies())]
    pub(crate) integrator: IntegratorName,
    /// Samples to show
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) spp: u32,
    /// Print only the N paths of all samples that add most
    #[arg(long, value_name = "N")]
    pub(crate) brightest: Option<usize>,
    #[command(flatten)]
    pub(crate) picture: Picture,
}

/// The defaults are the library's.
#[derive(Debug, Args)]
pub(crate) struct Connections {
    /// The settings of the paper: connections always, direct geometry term, check of few steps (biased), roulette by
    /// lengths, one walk, no search, no aim, one light subpath a sample
    #[arg(long)]
    pub(crate) paper: bool,
    /// Geometry term of chains in the weights [default: exact]
    #[arg(long, value_enum, value_name = "TERM")]
    pub(crate) geometry_term: Option<GeometryTermName>,
    /// How a sampled chain is recognised as one that a connection finds [default: exact]
    #[arg(long, value_enum, value_name = "HOW")]
    pub(crate) check: Option<CheckName>,
    /// Which connections are tried [default: contribution]
    #[arg(long, value_enum, value_name = "BY")]
    pub(crate) roulette: Option<RouletteName>,
    /// Contribution, in multiples of the mean radiance, from which on a connection is always tried; of --roulette
    /// contribution alone [default: 0.5]
    #[arg(long, value_name = "X", value_parser = positive)]
    pub(crate) roulette_threshold: Option<f64>,
    /// Walks from one pair of ends at most, until one finds a path: from the straight line, then from other starts
    /// [default: 3 to lights that cannot be hit, through curved glass for mnee, and for bdpt where a few samples forecast
    /// that it pays; else 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SEEDS)))]
    pub(crate) seeds: Option<u32>,
    /// Probability with which a connection through curved or faceted glass searches for one more path, from a random
    /// direction
    /// [default: for bdpt 0.25 to lights that cannot be hit, 0.1 where it is forecast to pay, else 0]
    #[arg(long, value_name = "P", value_parser = unit)]
    pub(crate) search: Option<f32>,
    /// Refraction of a lower roughness is crossed by walks, at microfacets drawn beforehand, instead of being
    /// evaluated, unless there are delta lights; 0: smooth refraction alone [default: the material's own]
    #[arg(long, value_name = "R", value_parser = unit)]
    pub(crate) walked_roughness: Option<f32>,
    /// Share of what light subpaths draw at lights and surfaces that is aimed at glass, for bdpt and light; 0: none
    /// [default: for bdpt with --caustics auto or on, 0.5 where a few samples forecast that it pays]
    #[arg(long, value_name = "P", value_parser = share)]
    pub(crate) aim: Option<f32>,
    /// Light subpaths per sample of bdpt, from 0.001 to 64; with fewer than 1 some samples have none [default: 1, or where
    /// connections are made as few as a few samples forecast to pay]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub(crate) light_subpaths: Option<f64>,
    /// Most steps of a walk [default: 64 to lights that cannot be hit, else 24]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_ITERATIONS)))]
    pub(crate) walk_iterations: Option<u32>,
    /// Largest deviation from Snell's law at the end of a walk, radians, 1e-13 to 1e-5 [default: 1e-8]
    #[arg(long, value_name = "ANGLE", value_parser = positive)]
    pub(crate) walk_tolerance: Option<f64>,
}

impl Connections {
    fn options(&self) -> CausticOptions {
        let mut options = if self.paper { CausticOptions::paper() } else { CausticOptions::default() };
        match self.geometry_term {
            Some(GeometryTermName::Exact) => options.geometry_term = GeometryTerm::Exact,
            Some(GeometryTermName::Direct) => options.geometry_term = GeometryTerm::Direct,
            None => {}
        }
        match self.check {
            Some(CheckName::Exact) => options.check = Check::Exact,
            Some(CheckName::Few) => options.check = Check::Few,
            Some(CheckName::Off) => options.check = Check::Off,
            None => {}
        }
        match self.roulette {
            Some(RouletteName::Off) => options.roulette = Roulette::Off,
            Some(RouletteName::Lengths) => options.roulette = Roulette::Lengths,
            Some(RouletteName::Contribution) => options.roulette = CausticOptions::default().roulette,
            None => {}
        }
        if let (Roulette::Contribution(threshold), Some(x)) = (&mut options.roulette, self.roulette_threshold) {
            *threshold = x as f32;
        }
        options.seeds = self.seeds.or(options.seeds);
        options.search = self.search.or(options.search);
        options.aim = self.aim.or(options.aim);
        options.light_subpaths = self.light_subpaths.map(|n| n as f32).or(options.light_subpaths);
        options.max_iterations = self.walk_iterations;
        if let Some(angle) = self.walk_tolerance {
            options.walk.tolerance = angle;
        }
        options
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum GeometryTermName {
    /// Generalised: weights fall where light gathers
    Exact,
    /// As if nothing were between the ends, as in the paper
    Direct,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CheckName {
    /// By the connection's own walk
    Exact,
    /// By its first three steps, as in the paper; biased, needs --geometry-term direct
    Few,
    /// Not at all; biased, needs --geometry-term direct
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum RouletteName {
    /// All
    Off,
    /// By the lengths of both subpaths, as in the paper
    Lengths,
    /// By what the straight line would contribute
    Contribution,
}

#[derive(Debug, Args)]
pub(crate) struct Info {
    /// glTF 2.0 file (.gltf or .glb)
    pub(crate) scene: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The image to judge
    pub(crate) image: PathBuf,
    /// What it should be
    pub(crate) reference: PathBuf,
    /// Write a picture of the relative difference in luminance: red where the image is brighter than the reference,
    /// blue where it is darker, cut at 1
    #[arg(long, value_name = "FILE")]
    pub(crate) diff: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Backends {
    /// glTF 2.0 file (.gltf or .glb)
    pub(crate) scene: PathBuf,
    /// Rays that both trace
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) rays: u64,
    /// Samples per pixel of the images
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) spp: u32,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "256x256", value_parser = size)]
    pub(crate) size: (u32, u32),
    /// Worker threads; 0 for as many as the process may use
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,
    /// Selects rays and random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum IntegratorName {
    /// Path tracing with next-event estimation
    Path,
    /// Light tracing: no more than the camera sees without glass or mirrors in between
    Light,
    /// Path tracing with manifold next-event estimation: light through glass, from lamps only
    Mnee,
    /// Bidirectional path tracing, with connections through glass as --caustics says
    Bdpt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Switch {
    Auto,
    On,
    Off,
}

impl From<IntegratorName> for Integrator {
    fn from(name: IntegratorName) -> Integrator {
        match name {
            IntegratorName::Path => Integrator::Path,
            IntegratorName::Light => Integrator::Light,
            IntegratorName::Mnee => Integrator::Mnee,
            IntegratorName::Bdpt => Integrator::Bdpt,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendName {
    /// Embree 4
    Embree,
    /// obvhs, in pure Rust
    Obvhs,
}

impl From<BackendName> for Backend {
    fn from(name: BackendName) -> Backend {
        match name {
            BackendName::Embree => Backend::Embree,
            BackendName::Obvhs => Backend::Obvhs,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ImageIoName {
    /// EXR by the built-in writer, everything else by OpenImageIO
    Auto,
    /// Everything by OpenImageIO
    Oiio,
}

/// The integrators that tell the strategies (s, t) of their paths.
fn with_strategies() -> impl TypedValueParser<Value = IntegratorName> {
    let all = IntegratorName::value_variants().iter().filter(|name| **name != IntegratorName::Path);
    let names: Vec<_> = all.filter_map(ValueEnum::to_possible_value).collect();
    PossibleValuesParser::new(names).try_map(|name| IntegratorName::from_str(&name, false))
}

/// `640x480`.
fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', 'X']).ok_or("expected WIDTHxHEIGHT, as in 640x480")?;
    let side = |what: &str, digits: &str| match digits.parse::<u32>() {
        Ok(0) => Err(format!("the {what} is 0")),
        Ok(n) => Ok(n),
        Err(_) => Err(format!("the {what} '{digits}' is not a whole number")),
    };
    Ok((side("width", width)?, side("height", height)?))
}

fn region(text: &str) -> Result<Region, String> {
    let parts: Vec<&str> = text.split('+').collect();
    let [pixels, x, y] = parts[..] else { return Err("expected WIDTHxHEIGHT+X+Y, as in 64x48+100+20".into()) };
    let (width, height) = size(pixels)?;
    let start = |digits: &str| digits.parse().map_err(|_| format!("'{digits}' is not a whole number"));
    Ok(Region { x: start(x)?, y: start(y)?, width, height })
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        // Ten years: what a Duration and an Instant surely hold.
        Ok(s) if s > 0.0 && s < 3.2e8 => Ok(s),
        _ => Err("expected a positive number of seconds".into()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite()).ok_or_else(|| "expected a positive number".into())
}

fn unit(text: &str) -> Result<f32, String> {
    text.parse::<f32>().ok().filter(|x| (0.0..=1.0).contains(x)).ok_or_else(|| "expected 0 to 1".into())
}

fn share(text: &str) -> Result<f32, String> {
    let share = text.parse::<f32>().ok().filter(|x| (0.0..=LARGEST_AIM).contains(x));
    share.ok_or_else(|| format!("expected 0 to {LARGEST_AIM}"))
}

fn finite(text: &str) -> Result<f32, String> {
    text.parse::<f32>().ok().filter(|x| x.is_finite()).ok_or_else(|| "expected a finite number".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn sizes() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for wrong in ["640", "x", "0x4", "4x0", "-4x4", "4x4x4", "4.5x4", "99999999999x4"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn regions() {
        assert_eq!(region("64x48+100+0"), Ok(Region { x: 100, y: 0, width: 64, height: 48 }));
        for wrong in ["64x48", "64x48+1", "64x48+1+2+3", "64x0+1+2", "64x48+-1+2", "64x48-1-2", "+1+2", ""] {
            assert!(region(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times() {
        assert_eq!(seconds("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "inf", "soon"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
