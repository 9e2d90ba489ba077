//! The film: camera-side sums and the light image, kept apart until they are averaged.

use super::{Image, Plane, RenderError};
use crate::integrator::Feature;
use crate::math::{Rgb, luminance};
use glam::{DVec3, Vec3};

/// Planes of features, and which of them is the depth.
pub(super) const FEATURES: usize = 3;
const DEPTH: usize = 2;

/// Sums over whole passes, one sample per pixel with its light subpaths in each.
#[derive(Default)]
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Passes in the sums.
    pub passes: u32,
    camera: Vec<DVec3>,
    light: Vec<DVec3>,
    /// Albedo, normal and depth, if asked for: sums, and room for their averages. Beside that of the depths stands their
    /// number.
    features: Option<[(Vec<DVec3>, Vec<Vec3>); FEATURES]>,
    /// Samples of each pixel that see a surface, if asked for; and room for their share.
    covered: Vec<u32>,
    room_of_alpha: Vec<f32>,
    /// Room for the image: when the render is over it must not be lacking. Not touched before, it takes addresses only.
    room: Vec<Vec3>,
    /// Sum of luminance when the number of passes was last a power of two, and that number: what has come since differs
    /// from it by the noise. No single passes, since those of the Sobol sequence complement each other.
    before: Vec<f32>,
    passes_before: u32,
    /// Estimated relative standard error of the image at some recent pass. NaN before the second one.
    pub noise: f32,
}

impl Film {
    /// A black film.
    pub fn new(width: u32, height: u32, features: bool, alpha: bool) -> Result<Film, RenderError> {
        let n = width as usize * height as usize;
        let out_of_memory = |_| RenderError::OutOfMemory { width, height };
        let mut film = Film {
            width,
            height,
            passes: 0,
            camera: Vec::new(),
            light: Vec::new(),
            features: features.then(Default::default),
            covered: Vec::new(),
            room_of_alpha: Vec::new(),
            room: Vec::new(),
            before: Vec::new(),
            passes_before: 0,
            noise: f32::NAN,
        };
        film.camera.try_reserve_exact(n).map_err(out_of_memory)?;
        film.light.try_reserve_exact(n).map_err(out_of_memory)?;
        film.before.try_reserve_exact(n).map_err(out_of_memory)?;
        film.room.try_reserve_exact(n).map_err(out_of_memory)?;
        if alpha {
            film.covered.try_reserve_exact(n).map_err(out_of_memory)?;
            film.room_of_alpha.try_reserve_exact(n).map_err(out_of_memory)?;
            film.covered.resize(n, 0);
        }
        film.camera.resize(n, DVec3::ZERO);
        film.light.resize(n, DVec3::ZERO);
        film.before.resize(n, 0.0);
        for (sums, room) in film.features.iter_mut().flatten() {
            sums.try_reserve_exact(n).map_err(out_of_memory)?;
            room.try_reserve_exact(n).map_err(out_of_memory)?;
            sums.resize(n, DVec3::ZERO);
        }
        Ok(film)
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let features = if self.features.is_some() { FEATURES * (size_of::<DVec3>() + size_of::<Vec3>()) } else { 0 };
        let alpha = self.covered.len() * (size_of::<u32>() + size_of::<f32>());
        (alpha + self.camera.len() * (2 * size_of::<DVec3>() + size_of::<f32>() + size_of::<Vec3>() + features)) as u64
    }

    /// Adds to the camera-side sum.
    #[inline]
    pub fn add_camera(&mut self, pixel: u32, value: Rgb) {
        self.camera[pixel as usize] += value.as_dvec3();
    }

    /// Adds what a sample sees, where that is asked for.
    pub fn add_feature(&mut self, pixel: u32, feature: &Feature) {
        if let Some([(albedo, _), (normal, _), (depths, _)]) = &mut self.features {
            if let Some(depth) = feature.depth {
                depths[pixel as usize] += DVec3::new(depth.into(), 1.0, 0.0);
            }
            albedo[pixel as usize] += feature.albedo.as_dvec3();
            normal[pixel as usize] += feature.normal.as_dvec3();
        }
    }

    /// Counts a sample that sees a surface.
    pub fn cover(&mut self, pixel: u32) {
        if let Some(count) = self.covered.get_mut(pixel as usize) {
            *count += 1;
        }
    }

    /// Adds to the light image.
    #[inline]
    pub fn add_light(&mut self, pixel: u32, value: Rgb) {
        self.light[pixel as usize] += value.as_dvec3();
    }

    /// Luminance of this, over that of the sums and this.
    pub fn share_of(&self, more: DVec3) -> f32 {
        let luminance = |c: DVec3| f64::from(luminance(c.as_vec3()));
        if more == DVec3::ZERO {
            return 0.0;
        }
        let kept: f64 = self.camera.iter().zip(&self.light).map(|(c, l)| luminance(*c + *l)).sum();
        let more = luminance(more);
        (more / (kept + more)) as f32
    }

    /// The average over the passes, in the room kept for it: once.
    pub fn last_image(&mut self) -> Image {
        let (pixels, alpha) = (std::mem::take(&mut self.room), std::mem::take(&mut self.room_of_alpha));
        self.image(pixels, alpha)
    }

    /// Those of albedo, normal and depth, likewise.
    pub fn last_features(&mut self) -> Option<[Image; FEATURES]> {
        let rooms = self.features.as_mut().map(|planes| planes.each_mut().map(|(_, room)| std::mem::take(room)));
        let [albedo, normal, depth] = rooms?;
        Some([self.feature_image(0, albedo)?, self.feature_image(1, normal)?, self.feature_image(DEPTH, depth)?])
    }

    /// The same, in between, of one that is asked for.
    pub fn copy(&self, plane: Plane) -> Result<Image, RenderError> {
        let Film { width, height, .. } = *self;
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(self.camera.len()).map_err(|_| RenderError::OutOfMemory { width, height })?;
        let feature = match plane {
            Plane::Radiance => {
                let mut alpha = Vec::new();
                let room = alpha.try_reserve_exact(self.covered.len());
                room.map_err(|_| RenderError::OutOfMemory { width, height })?;
                return Ok(self.image(pixels, alpha));
            }
            Plane::Albedo => self.feature_image(0, pixels),
            Plane::Normal => self.feature_image(1, pixels),
            Plane::Depth => self.feature_image(DEPTH, pixels),
        };
        let asked = || RenderError::setting("features", false, "true was expected, for albedo, normal and depth");
        feature.map_or_else(asked, Ok)
    }

    fn feature_image(&self, feature: usize, mut pixels: Vec<Vec3>) -> Option<Image> {
        let (sums, _) = &self.features.as_ref()?[feature];
        let scale = 1.0 / f64::from(self.passes.max(1));
        let depth = |sum: &DVec3| Vec3::splat((sum.x / sum.y.max(1.0)) as f32);
        match feature {
            DEPTH => pixels.extend(sums.iter().map(depth)),
            _ => pixels.extend(sums.iter().map(|sum| (*sum * scale).as_vec3())),
        }
        Some(Image::new(self.width, self.height, pixels))
    }

    fn image(&self, mut pixels: Vec<Vec3>, mut room: Vec<f32>) -> Image {
        let scale = 1.0 / f64::from(self.passes.max(1));
        pixels.extend(self.camera.iter().zip(&self.light).map(|(c, l)| ((*c + *l) * scale).as_vec3()));
        let alpha = self.covered.iter().map(|n| (f64::from(*n) * scale) as f32);
        room.extend(alpha);
        Image { alpha: room, ..Image::new(self.width, self.height, pixels) }
    }

    /// Ends a pass.
    pub fn finish_pass(&mut self) {
        self.passes += 1;
        let since = self.passes - self.passes_before;
        if self.passes.is_power_of_two() || self.passes.is_multiple_of(8) && since >= self.passes_before / 2 {
            self.noise = self.estimated_noise();
        }
        if self.passes.is_power_of_two() {
            self.passes_before = self.passes;
            for (before, (c, l)) in self.before.iter_mut().zip(self.camera.iter().zip(&self.light)) {
                *before = luminance((*c + *l).as_vec3());
            }
        }
    }

    /// From the RMS difference of the mean luminance before and since, of which there are enough: few that follow many
    /// differ as independent samples do. Too high where the error falls faster than theirs.
    fn estimated_noise(&self) -> f32 {
        let (passes, first) = (f64::from(self.passes), f64::from(self.passes_before));
        let since = passes - first;
        let (mut squares, mut sum) = (0.0, 0.0);
        for ((c, l), &before) in self.camera.iter().zip(&self.light).zip(&self.before) {
            let total = f64::from(luminance((*c + *l).as_vec3()));
            let difference = f64::from(before) / first - (total - f64::from(before)) / since;
            squares += difference * difference;
            sum += total;
        }
        let n = self.camera.len() as f64;
        // The variance of the difference is (1 / first + 1 / since) of a sample's, that of the image 1 / passes.
        let error = (squares / n * first * since).sqrt() / passes;
        (error / (sum / n / passes)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Sampler, Stream};

    /// Estimated noise over the true one of a picture of `f`, whose mean is `mean`, from `passes` passes.
    fn estimate_over_truth(passes: u32, mean: f64, f: impl Fn(&mut Sampler) -> f32) -> f64 {
        let mut film = Film::new(64, 64, false, false).expect("small");
        for pass in 0..passes {
            for pixel in 0..64 * 64 {
                film.add_camera(pixel, Rgb::splat(f(&mut Sampler::new(3, pixel, pass, Stream::Camera))));
            }
            film.finish_pass();
        }
        let noise = f64::from(film.noise);
        let image = film.last_image();
        let squares = image.pixels.iter().map(|p| (f64::from(luminance(*p)) - mean).powi(2)).sum::<f64>();
        noise / ((squares / image.pixels.len() as f64).sqrt() / mean)
    }

    #[test]
    fn the_noise_estimate_knows_that_samples_are_even() {
        for passes in [16, 48, 64, 72, 104, 1032] {
            // A step across eight dimensions, whose error falls little faster than with independent samples, and a
            // slope, whose error falls far faster: independent ones would have 50 times as much with 64 samples.
            let of_step = estimate_over_truth(passes, 0.5, |s| {
                let place: f32 = (0..8).map(|_| s.next_1d()).sum();
                if place < 4.0 { 0.0 } else { 1.0 }
            });
            let of_slope = estimate_over_truth(passes, 0.25, |s| s.next_1d() * s.next_1d());
            println!("{passes}: {of_step}, {of_slope}");
            assert!((0.95..1.2).contains(&of_step), "{passes}: {of_step}");
            // The estimate is that of 64 and 1024 passes, from which the next eight take away evenness.
            assert!((0.3..3.0).contains(&of_slope), "{passes}: {of_slope}");
        }
    }
}
