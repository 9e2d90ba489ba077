//! Handing out and folding in the work of a render. A pass is one sample of every pixel with its light
//! subpaths, cut into tiles; passes enter the film whole, tile by tile in their order, so that the sums
//! do not depend on who computed what and when.

use super::film::Film;
use super::{LEAST_PASSES, Output, Plane, RenderError, Settings, Statistics, Technique, TechniqueImages};
use crate::camera::Region;
use crate::integrator::{Feature, Sample, Splat};
use crate::math::Rgb;
use crate::render::Image;
use crate::transport::ray_count::RayCount;
use crate::transport::walk_count::WalkCount;
use glam::DVec3;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, TryReserveError};
use std::ops::Range;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Pixels of a tile: some milliseconds of work, far more than handing it out costs.
const TILE_PIXELS: u32 = 1024;

/// Passes that may wait for an earlier one's last tile, at least. Bounds memory.
const PASSES_AHEAD: u32 = 2;

/// What one path adds to the images of its technique.
#[derive(Clone, Copy, Debug)]
pub struct TechniqueSplat {
    /// Which.
    pub technique: Technique,
    /// Where.
    pub pixel: u32,
    /// With its weight.
    pub weighted: Rgb,
    /// Without.
    pub unweighted: Rgb,
    /// Whether the path is a caustic one.
    pub caustic: bool,
}

/// The unit of work: some pixels of one pass.
#[derive(Debug)]
pub struct Tile {
    /// Which sample of the pixels.
    pub pass: u32,
    /// Position in the pass.
    pub index: u32,
    /// Pixel numbers.
    pub pixels: Range<u32>,
    /// Radiance of each pixel.
    pub camera: Vec<Rgb>,
    /// What the samples see, if asked for.
    pub features: Option<Vec<Feature>>,
    /// Which of the samples see a surface, if asked for.
    pub covered: Option<Vec<bool>>,
    /// Light-image contributions.
    pub splats: Vec<Splat>,
    /// Contributions by technique. Empty unless asked for.
    pub techniques: Vec<TechniqueSplat>,
    /// Rays it took.
    pub rays: RayCount,
    /// Manifold walks it took.
    pub walks: WalkCount,
    /// What a limit took from its paths.
    pub cut: DVec3,
    /// Values dropped because they were not finite.
    pub non_finite: u64,
    /// Pixel of the first of them.
    pub first_non_finite: Option<u32>,
    /// Whether there was too little memory for some of it.
    pub out_of_memory: bool,
}

impl Tile {
    /// With room for its pixels.
    fn new(pass: u32, index: u32, pixels: Range<u32>, features: bool, alpha: bool) -> Result<Tile, TryReserveError> {
        let (mut camera, mut features, mut covered) = (Vec::new(), features.then(Vec::new), alpha.then(Vec::new));
        covered.as_mut().map_or(Ok(()), |covered| covered.try_reserve_exact(pixels.len()))?;
        camera.try_reserve_exact(pixels.len())?;
        features.as_mut().map_or(Ok(()), |features| features.try_reserve_exact(pixels.len()))?;
        Ok(Tile {
            pass,
            index,
            pixels,
            camera,
            features,
            covered,
            splats: Vec::new(),
            techniques: Vec::new(),
            rays: RayCount::default(),
            walks: WalkCount::default(),
            cut: DVec3::ZERO,
            non_finite: 0,
            first_non_finite: None,
            out_of_memory: false,
        })
    }

    /// Takes in the next pixel's sample; what is not finite is left out and counted.
    pub fn add(&mut self, pixel: u32, sample: &Sample) {
        let mut check = |value: Rgb| {
            if value.is_finite() {
                return Some(value);
            }
            self.non_finite += 1;
            self.first_non_finite.get_or_insert(pixel);
            None
        };
        let radiance = check(sample.radiance);
        if self.splats.try_reserve(sample.splats.len()).is_err() {
            self.out_of_memory = true;
            return;
        }
        self.splats.extend(sample.splats.iter().filter(|s| check(s.value).is_some()));
        self.camera.push(radiance.unwrap_or(Rgb::ZERO));
        if radiance.is_some() {
            self.cut += sample.cut.as_dvec3();
        }
        if let Some(covered) = &mut self.covered {
            covered.push(sample.covered);
        }
        if let Some(features) = &mut self.features {
            features.push(
                sample
                    .feature
                    .filter(|f| (f.albedo + f.normal + f.depth.unwrap_or(0.0)).is_finite())
                    .unwrap_or_default(),
            );
        }
    }
}

/// The state shared by the workers of one render.
pub struct Passes {
    pixels: u32,
    tiles_per_pass: u32,
    samples: u32,
    features: bool,
    alpha: bool,
    /// Passes begun beyond those in the film: of small pictures as many as have two tiles for each worker.
    ahead: u32,
    state: Mutex<State>,
    advanced: Condvar,
}

/// The tiles of a pass, and how many of them are there.
#[derive(Default)]
struct Waiting {
    tiles: Vec<Option<Tile>>,
    there: u32,
}

struct State {
    next: (u32, u32),
    /// Passes at and after this one are not begun.
    end: u32,
    finished_tiles: u64,
    /// Tiles of passes that are not in the film yet.
    waiting: BTreeMap<u32, Waiting>,
    film: Film,
    techniques: BTreeMap<Technique, [Vec<DVec3>; 3]>,
    out_of_memory: bool,
    rays: RayCount,
    walks: WalkCount,
    cut: DVec3,
    non_finite: u64,
    first_non_finite: Option<(u32, u32)>,
}

impl Passes {
    /// For a validated request and that many workers.
    pub fn new(settings: &Settings, workers: usize) -> Result<Passes, RenderError> {
        let Region { width, height, .. } = settings.region();
        let pixels = width * height;
        let tiles_per_pass = pixels.div_ceil(TILE_PIXELS);
        Ok(Passes {
            pixels,
            tiles_per_pass,
            ahead: (2 * workers as u32).div_ceil(tiles_per_pass).max(PASSES_AHEAD),
            samples: settings.samples,
            features: settings.features,
            alpha: settings.transparent,
            state: Mutex::new(State {
                next: (0, 0),
                end: settings.samples,
                finished_tiles: 0,
                waiting: BTreeMap::new(),
                film: Film::new(width, height, settings.features, settings.transparent)?,
                techniques: BTreeMap::new(),
                out_of_memory: false,
                rays: RayCount::default(),
                walks: WalkCount::default(),
                cut: DVec3::ZERO,
                non_finite: 0,
                first_non_finite: None,
            }),
            advanced: Condvar::new(),
        })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A worker that panicked ends the render with an error; until then the others may go on.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next tile, or `None` when there is no more to do. Waits while too many passes are unfinished.
    pub fn next_tile(&self, stop: &dyn Fn() -> bool) -> Option<Tile> {
        let mut state = self.lock();
        loop {
            let (pass, index) = state.next;
            if pass >= state.end || stop() {
                return None;
            }
            if pass < state.film.passes + self.ahead {
                state.next = if index + 1 == self.tiles_per_pass { (pass + 1, 0) } else { (pass, index + 1) };
                let first = index * TILE_PIXELS;
                let tile =
                    Tile::new(pass, index, first..(first + TILE_PIXELS).min(self.pixels), self.features, self.alpha);
                if tile.is_err() {
                    self.end_without_memory(&mut state);
                }
                return tile.ok();
            }
            // The time-out lets a waiting worker see a cancel.
            let wait = self.advanced.wait_timeout(state, Duration::from_millis(20));
            state = wait.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// For a worker to hold: if it panics, its tile will never come, and the others would wait for it.
    pub fn end_on_panic(&self) -> impl Drop + '_ {
        struct End<'a>(&'a Passes);
        impl Drop for End<'_> {
            fn drop(&mut self) {
                if std::thread::panicking() {
                    self.0.stop();
                }
            }
        }
        End(self)
    }

    fn end_without_memory(&self, state: &mut State) {
        state.out_of_memory = true;
        state.end = state.film.passes;
        self.advanced.notify_all();
    }

    /// Whether there was memory for all tiles and for the images of all techniques.
    pub fn check_memory(&self) -> Result<(), RenderError> {
        let state = self.lock();
        let Film { width, height, .. } = state.film;
        let techniques = state.techniques.len();
        if state.out_of_memory && techniques == 0 {
            return Err(RenderError::OutOfMemory { width, height });
        }
        if state.out_of_memory {
            return Err(RenderError::OutOfMemoryForTechniques { width, height, techniques });
        }
        Ok(())
    }

    /// Begins no further pass; unfinished ones are dropped.
    pub fn stop(&self) {
        let mut state = self.lock();
        state.end = state.film.passes;
        self.advanced.notify_all();
    }

    /// Takes a finished tile in, and every pass that it completes into the film.
    pub fn finish(&self, tile: Tile, start: Instant, time_limit: Option<Duration>, noise_limit: Option<f32>) {
        let mut guard = self.lock();
        let state = &mut *guard;
        state.finished_tiles += 1;
        let pass = state.waiting.entry(tile.pass).or_default();
        let (index, count) = (tile.index as usize, self.tiles_per_pass as usize);
        if tile.out_of_memory || pass.tiles.is_empty() && pass.tiles.try_reserve_exact(count).is_err() {
            return self.end_without_memory(state);
        }
        if pass.tiles.is_empty() {
            pass.tiles.resize_with(count, || None);
        }
        pass.tiles[index] = Some(tile);
        pass.there += 1;
        while state.film.passes < state.end
            && state.waiting.get(&state.film.passes).is_some_and(|pass| pass.there == self.tiles_per_pass)
        {
            let pass = state.film.passes;
            for tile in state.waiting.remove(&pass).into_iter().flat_map(|pass| pass.tiles).flatten() {
                if state.fold(tile, self.pixels).is_err() {
                    return self.end_without_memory(state);
                }
            }
            state.film.finish_pass();
            let Film { passes, noise, .. } = state.film;
            if time_limit.is_some_and(|limit| start.elapsed() >= limit)
                || noise_limit.is_some_and(|limit| passes >= LEAST_PASSES && noise <= limit)
            {
                state.end = passes;
            }
            self.advanced.notify_all();
        }
    }

    /// Share of the tiles that is done.
    pub fn fraction(&self) -> f32 {
        (self.lock().finished_tiles as f64 / (f64::from(self.samples) * f64::from(self.tiles_per_pass))) as f32
    }

    /// Passes in the film, and its noise.
    pub fn noise(&self) -> (u32, f32) {
        let state = self.lock();
        (state.film.passes, state.film.noise)
    }

    /// The average over the passes so far, if there are any, and their number.
    pub fn image(&self, plane: Plane) -> Result<Option<(Image, u32)>, RenderError> {
        let state = self.lock();
        let passes = state.film.passes;
        if passes > 0 { state.film.copy(plane).map(|image| Some((image, passes))) } else { Ok(None) }
    }

    /// The images and the counts, once. The film stays, for those who look at what there is until the output is there.
    pub fn take_output(&self) -> Output {
        let mut state = self.lock();
        let techniques = std::mem::take(&mut state.techniques);
        let (image, features) = (state.film.last_image(), state.film.last_features());
        let film = &state.film;
        let (passes, film_bytes) = (film.passes, film.bytes());
        let scale = 1.0 / f64::from(passes.max(1));
        let average =
            |sums: &[DVec3]| Image::new(film.width, film.height, sums.iter().map(|s| (*s * scale).as_vec3()).collect());
        let bytes_per_technique = 3 * u64::from(self.pixels) * size_of::<DVec3>() as u64;
        let film_bytes = film_bytes + techniques.len() as u64 * bytes_per_technique;
        // The sums of each go as its images come.
        let images = |[weighted, unweighted, caustic]: [Vec<DVec3>; 3]| TechniqueImages {
            weighted: average(&weighted),
            unweighted: average(&unweighted),
            caustic: average(&caustic),
        };
        let techniques = techniques.into_iter().map(|(technique, sums)| (technique, images(sums))).collect();
        let statistics = Statistics {
            samples: passes,
            camera_rays: state.rays.camera,
            camera_path_rays: state.rays.camera_path,
            light_path_rays: state.rays.light_path,
            shadow_rays: state.rays.shadow,
            walk_rays: state.rays.walk,
            walks: state.walks,
            clamped: state.film.share_of(state.cut),
            non_finite: state.non_finite,
            first_non_finite: state.first_non_finite,
            film_bytes,
            ..Statistics::default()
        };
        Output { image, features, techniques, statistics, cancelled: false }
    }
}

impl State {
    fn fold(&mut self, tile: Tile, pixels: u32) -> Result<(), TryReserveError> {
        for (pixel, &value) in tile.pixels.clone().zip(&tile.camera) {
            self.film.add_camera(pixel, value);
        }
        for (pixel, feature) in tile.pixels.clone().zip(tile.features.iter().flatten()) {
            self.film.add_feature(pixel, feature);
        }
        for (pixel, _) in tile.pixels.clone().zip(tile.covered.iter().flatten()).filter(|(_, covered)| **covered) {
            self.film.cover(pixel);
        }
        for splat in &tile.splats {
            self.film.add_light(splat.pixel, splat.value);
        }
        for splat in &tile.techniques {
            let sums = match self.techniques.entry(splat.technique) {
                Entry::Occupied(sums) => sums.into_mut(),
                Entry::Vacant(place) => {
                    let mut black = [const { Vec::new() }; 3];
                    for sums in &mut black {
                        sums.try_reserve_exact(pixels as usize)?;
                        sums.resize(pixels as usize, DVec3::ZERO);
                    }
                    place.insert(black)
                }
            };
            let caustic = if splat.caustic { splat.weighted } else { Rgb::ZERO };
            for (sum, value) in sums.iter_mut().zip([splat.weighted, splat.unweighted, caustic]) {
                sum[splat.pixel as usize] += value.as_dvec3();
            }
        }
        self.rays = self.rays + tile.rays;
        self.walks += tile.walks;
        self.cut += tile.cut;
        self.non_finite += tile.non_finite;
        if let (None, Some(pixel)) = (self.first_non_finite, tile.first_non_finite) {
            self.first_non_finite = Some((pixel, tile.pass));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pool::{Failed, broadcast};

    #[test]
    fn a_tile_without_memory_ends_the_render() {
        let settings = Settings { width: 64, height: 64, samples: 1000, ..Settings::default() };
        let passes = Passes::new(&settings, 2).expect("memory");
        let outcome = broadcast(2, |_| {
            while let Some(mut tile) = passes.next_tile(&|| false) {
                tile.out_of_memory = tile.pass == 3;
                passes.finish(tile, Instant::now(), None, None);
            }
        });
        assert_eq!(outcome, Ok(()));
        assert!(matches!(passes.check_memory(), Err(RenderError::OutOfMemory { width: 64, height: 64 })));
    }

    #[test]
    fn a_panic_of_one_worker_ends_the_others() {
        let settings = Settings { width: 64, height: 64, samples: 1000, ..Settings::default() };
        let passes = Passes::new(&settings, 2).expect("memory");
        let outcome = broadcast(2, |worker| {
            let _ends = passes.end_on_panic();
            while let Some(tile) = passes.next_tile(&|| false) {
                assert!(worker == 0 || tile.pass < 3, "as planned");
                // The other may not come to its tile before all is done.
                if tile.pass < 10 {
                    std::thread::sleep(Duration::from_millis(1));
                }
                passes.finish(tile, Instant::now(), None, None);
            }
        });
        assert_eq!(outcome, Err(Failed::Panic("as planned".to_owned())));
    }
}
