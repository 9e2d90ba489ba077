//! References, caustic regions, and what an integrator reaches in them.

use caustica::io::gltf;
use caustica::render::{Cancel, Caustics, Image, Integrator, Output, Settings, render, samples_by_limits};
use caustica::scene::{CommitOptions, World};
use caustica::transport::options::CausticOptions;
use glam::DVec3;
use std::path::Path;
use std::time::Duration;

/// A way to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) integrator: Integrator,
    pub(crate) caustics: Caustics,
    pub(crate) options: CausticOptions,
}

impl Method {
    pub(crate) fn new(name: &'static str, integrator: Integrator, caustics: Caustics) -> Method {
        Method { name, integrator, caustics, options: CausticOptions::default() }
    }

    /// All that the results compare.
    pub(crate) fn all() -> Vec<Method> {
        vec![
            Method::new("path", Integrator::Path, Caustics::Off),
            Method::new("light", Integrator::Light, Caustics::Off),
            Method::new("bdpt", Integrator::Bdpt, Caustics::Off),
            Method::new("mnee", Integrator::Mnee, Caustics::On),
            Method { options: CausticOptions::paper(), ..Method::new("paper", Integrator::Bdpt, Caustics::On) },
            Method::new("ours", Integrator::Bdpt, Caustics::Auto),
        ]
    }
}

/// How long.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Budget {
    Samples(u32),
    Seconds(f64),
}

/// A scene with what is fixed for all its renders.
pub(crate) struct Subject {
    pub(crate) world: World,
    pub(crate) side: u32,
    pub(crate) threads: usize,
    pub(crate) max_depth: u32,
}

impl Subject {
    pub(crate) fn open(scene: &Path, side: u32, threads: usize) -> Subject {
        let loaded = gltf::load(scene).unwrap_or_else(|e| panic!("{}: {e}", scene.display()));
        let world = World::commit(&loaded.description, CommitOptions::default()).expect("a valid scene");
        Subject { world, side, threads, max_depth: Settings::default().max_depth }
    }

    pub(crate) fn render(&self, method: &Method, budget: Budget, seed: u64, caustics_only: bool) -> Output {
        let (samples, time_limit) = match budget {
            Budget::Samples(n) => (n, None),
            Budget::Seconds(s) => (samples_by_limits(true, false, 0), Some(Duration::from_secs_f64(s))),
        };
        let settings = Settings {
            integrator: method.integrator,
            caustics: method.caustics,
            caustic_options: method.options,
            width: self.side,
            height: self.side,
            samples,
            time_limit,
            max_depth: self.max_depth,
            seed,
            threads: self.threads,
            caustics_only,
            ..Settings::default()
        };
        render(&self.world, &settings, &Cancel::default(), &|_| {}).expect("valid settings")
    }
}

/// The truth about a scene.
pub(crate) struct Reference {
    /// The mean of two independent renders.
    pub(crate) image: Image,
    halves: [Image; 2],
    /// Pixels where caustic paths carry over a fifth of the radiance.
    pub(crate) region: Vec<bool>,
    /// Mean square of the relative error of `image`, inside and outside the region.
    pub(crate) noise: [f64; 2],
    /// Relative error of the mean inside the region, as far as two halves tell.
    pub(crate) drift: f64,
}

/// Share of the radiance from which on a pixel belongs to the caustic region.
pub(crate) const CAUSTIC_SHARE: f32 = 0.2;

impl Reference {
    /// From two renders of two fifths of the time each, and one of caustics alone. Connections through glass are
    /// made whether they pay or not: they find what the others may miss.
    pub(crate) fn new(subject: &Subject, seconds: f64) -> Reference {
        let method = Method::new("reference", Integrator::Bdpt, Caustics::On);
        let half = |seed| subject.render(&method, Budget::Seconds(seconds * 0.4), seed, false).image;
        let halves = [half(0x5eed_0001), half(0x5eed_0002)];
        let caustic = subject.render(&method, Budget::Seconds(seconds * 0.2), 0x5eed_0003, true).image;
        let pixels = halves[0].pixels.iter().zip(&halves[1].pixels).map(|(a, b)| (*a + *b) * 0.5).collect();
        let image = Image { pixels, ..halves[0].clone() };
        // What decides over the region is averaged over its neighbourhood, or noise would fray it.
        let (caustic, whole) = (blurred(&caustic), blurred(&image));
        let sum = |c: &glam::Vec3| c.element_sum();
        let region: Vec<bool> =
            caustic.iter().zip(&whole).map(|(c, w)| sum(c) > CAUSTIC_SHARE * sum(w) && sum(c) > 0.0).collect();
        let mut reference = Reference { image, halves, region, noise: [0.0; 2], drift: 0.0 };
        let [a, b] = &reference.halves;
        // The halves differ by twice the variance of each, that is, four times that of their mean.
        reference.noise = reference.trimmed(|k| (a.pixels[k] - b.pixels[k]).as_dvec3().powf(2.0) / 4.0);
        reference.drift = 0.5 * (reference.inside(a) / reference.inside(b) - 1.0).abs();
        reference
    }

    /// Trimmed relMSE inside and outside the region. The squared difference from the truth is estimated by the
    /// product of the differences from the two halves, whose noise, being independent, has no part in it on average.
    pub(crate) fn errors(&self, image: &Image) -> [f64; 2] {
        let difference = |k: usize, half: &Image| (image.pixels[k] - half.pixels[k]).as_dvec3();
        self.trimmed(|k| difference(k, &self.halves[0]) * difference(k, &self.halves[1]))
    }

    /// Mean of a square per pixel, relative to the squared reference + 0.01 m², `m` the reference's mean, without the
    /// largest 0.1 %, inside and outside the region; NaN where there are no pixels.
    fn trimmed(&self, square: impl Fn(usize) -> DVec3) -> [f64; 2] {
        let pixels = &self.image.pixels;
        let mean = pixels.iter().map(|p| p.as_dvec3().element_sum()).sum::<f64>() / (3.0 * pixels.len() as f64);
        let epsilon = 0.01 * mean * mean;
        [true, false].map(|inside| {
            let of_part = (0..pixels.len()).filter(|k| self.region[*k] == inside);
            let relative = |k: usize| {
                let reference = pixels[k].as_dvec3();
                (square(k) / (reference * reference + epsilon)).element_sum() / 3.0
            };
            let mut errors: Vec<f64> = of_part.map(relative).collect();
            errors.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
            let kept = errors.len() - errors.len() / 1000;
            errors[..kept].iter().sum::<f64>() / kept as f64
        })
    }

    /// Share of the pixels in the region.
    pub(crate) fn coverage(&self) -> f64 {
        self.region.iter().filter(|r| **r).count() as f64 / self.region.len() as f64
    }

    /// Whether there is a region; without one the whole picture stands for it.
    pub(crate) fn has_region(&self) -> bool {
        self.region.contains(&true)
    }

    /// Relative difference of the means inside the region.
    pub(crate) fn bias(&self, image: &Image) -> f64 {
        self.inside(image) / self.inside(&self.image) - 1.0
    }

    /// Sum inside the region.
    fn inside(&self, image: &Image) -> f64 {
        let whole = !self.has_region();
        let inside = image.pixels.iter().zip(&self.region).filter(|(_, r)| whole || **r);
        inside.map(|(p, _)| p.as_dvec3().element_sum()).sum()
    }
}

/// Means over 5 x 5 pixels.
fn blurred(image: &Image) -> Vec<glam::Vec3> {
    let (w, h) = (image.width as i64, image.height as i64);
    let at = |x: i64, y: i64| image.pixels[(y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize];
    let mean = |x: i64, y: i64| {
        (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))).map(|(dx, dy)| at(x + dx, y + dy)).sum::<glam::Vec3>()
    };
    (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
}

/// The mean of independent values, with its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) mean: f64,
    pub(crate) error: f64,
}

impl Estimate {
    pub(crate) fn of(values: &[f64]) -> Estimate {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        Estimate { mean, error: (squares / (n * (n - 1.0))).sqrt() }
    }
}

/// In percent.
impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:+.2} ± {:.2} %", 100.0 * self.mean, 100.0 * self.error)
    }
}
