//! The command line as typed.

use caustica::intersect::Backend;
use caustica::render::job::Integrator;
use clap::{Args, Parser, Subcommand, ValueEnum};
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
    /// Whether bdpt connects through glass by manifold walks
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub(crate) caustics: Switch,
    /// Samples per pixel; with --time and without --spp, as many as fit [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) spp: Option<u32>,
    /// Stop after the pass that is running at this time
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub(crate) time: Option<f64>,
    /// Longest path in segments; 1 is light seen directly
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) max_depth: u32,
    /// Image size in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub(crate) size: (u32, u32),
    /// Which of the scene's cameras [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) camera: Option<String>,
    /// Ray tracer [default: embree where it is built in]
    #[arg(long, value_enum)]
    pub(crate) backend: Option<BackendName>,
    /// Worker threads; 0 for as many as the process may use
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,
    /// Selects the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Multiplies 8-bit images by 2^STOPS; EXR and HDR keep radiance as it is
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) exposure: f32,
    /// What writes EXR: the built-in writer, or OpenImageIO as for all other formats
    #[arg(long, value_enum, default_value_t = ImageIoName::Auto)]
    pub(crate) image_io: ImageIoName,
    /// Write EXR in 32-bit instead of 16-bit floats
    #[arg(long)]
    pub(crate) float: bool,
    /// Also write one EXR per technique (s light vertices, t camera vertices), weighted and not, into DIR
    #[arg(long, value_name = "DIR")]
    pub(crate) techniques: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(crate) quiet: bool,
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
    /// Write the absolute difference per channel as an image
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
    /// Path tracing with manifold next-event estimation: light through glass, from lamps only
    Mnee,
    /// Bidirectional path tracing, with connections through glass unless --caustics off
    Bdpt,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Switch {
    On,
    Off,
}

impl From<IntegratorName> for Integrator {
    fn from(name: IntegratorName) -> Integrator {
        match name {
            IntegratorName::Path => Integrator::Path,
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

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        // Ten years: what a Duration and an Instant surely hold.
        Ok(s) if s > 0.0 && s < 3.2e8 => Ok(s),
        _ => Err("expected a positive number of seconds".into()),
    }
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
    fn times() {
        assert_eq!(seconds("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "inf", "soon"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
