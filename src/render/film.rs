//! The film: camera-side sums and the light image, kept apart until they are averaged.

use super::{Image, job::RenderError};
use crate::math::{Rgb, luminance};
use glam::DVec3;

/// Sums over whole passes, one sample per pixel with its light subpaths in each.
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Passes in the sums.
    pub passes: u32,
    camera: Vec<DVec3>,
    light: Vec<DVec3>,
    /// Luminance of one half of the passes, whose difference to the others tells the noise.
    half: Vec<f32>,
}

impl Film {
    /// A black film.
    pub fn new(width: u32, height: u32) -> Result<Film, RenderError> {
        let n = width as usize * height as usize;
        let out_of_memory = |_| RenderError::OutOfMemory { width, height };
        let mut film = Film { width, height, passes: 0, camera: Vec::new(), light: Vec::new(), half: Vec::new() };
        film.camera.try_reserve_exact(n).map_err(out_of_memory)?;
        film.light.try_reserve_exact(n).map_err(out_of_memory)?;
        film.half.try_reserve_exact(n).map_err(out_of_memory)?;
        film.camera.resize(n, DVec3::ZERO);
        film.light.resize(n, DVec3::ZERO);
        film.half.resize(n, 0.0);
        Ok(film)
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        (self.camera.len() * (2 * size_of::<DVec3>() + size_of::<f32>())) as u64
    }

    /// Adds to the camera-side sum.
    #[inline]
    pub fn add_camera(&mut self, pixel: u32, value: Rgb) {
        self.camera[pixel as usize] += value.as_dvec3();
        if in_half(self.passes) {
            self.half[pixel as usize] += luminance(value);
        }
    }

    /// Adds to the light image.
    #[inline]
    pub fn add_light(&mut self, pixel: u32, value: Rgb) {
        self.light[pixel as usize] += value.as_dvec3();
        if in_half(self.passes) {
            self.half[pixel as usize] += luminance(value);
        }
    }

    /// The average over the passes.
    pub fn image(&self) -> Image {
        let scale = 1.0 / f64::from(self.passes.max(1));
        let pixels = self.camera.iter().zip(&self.light).map(|(c, l)| ((*c + *l) * scale).as_vec3()).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// Estimated relative standard error of the image: half the RMS difference of the mean luminance
    /// of two halves of the passes, over the mean luminance. NaN before the second pass. The halves together fill the
    /// space of paths more evenly than each alone, so where samples are even it is rather too high.
    pub fn noise(&self) -> f32 {
        // One of each pair.
        let in_it = f64::from(self.passes / 2 + u32::from(self.passes % 2 == 1 && in_half(self.passes - 1)));
        let others = f64::from(self.passes) - in_it;
        let (mut squares, mut sum) = (0.0, 0.0);
        for ((c, l), &half) in self.camera.iter().zip(&self.light).zip(&self.half) {
            let total = f64::from(luminance((*c + *l).as_vec3()));
            let difference = f64::from(half) / in_it - (total - f64::from(half)) / others;
            squares += difference * difference;
            sum += total;
        }
        let n = self.camera.len() as f64;
        let mean = sum / n / f64::from(self.passes);
        ((squares / n).sqrt() / 2.0 / mean) as f32
    }
}

/// Whether the number of a pass has an odd number of ones in binary (Thue-Morse). So each half of the points of a Sobol
/// sequence is nearly as even as as many successive ones; the odd points would all lie in one half of the space.
#[inline]
fn in_half(pass: u32) -> bool {
    pass.count_ones() % 2 == 1
}
