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
    /// Luminance of the odd passes, whose difference to the even ones tells the noise.
    odd: Vec<f32>,
}

impl Film {
    /// A black film.
    pub fn new(width: u32, height: u32) -> Result<Film, RenderError> {
        let n = width as usize * height as usize;
        let out_of_memory = |_| RenderError::OutOfMemory { width, height };
        let mut film = Film { width, height, passes: 0, camera: Vec::new(), light: Vec::new(), odd: Vec::new() };
        film.camera.try_reserve_exact(n).map_err(out_of_memory)?;
        film.light.try_reserve_exact(n).map_err(out_of_memory)?;
        film.odd.try_reserve_exact(n).map_err(out_of_memory)?;
        film.camera.resize(n, DVec3::ZERO);
        film.light.resize(n, DVec3::ZERO);
        film.odd.resize(n, 0.0);
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
        if self.passes % 2 == 1 {
            self.odd[pixel as usize] += luminance(value);
        }
    }

    /// Adds to the light image.
    #[inline]
    pub fn add_light(&mut self, pixel: u32, value: Rgb) {
        self.light[pixel as usize] += value.as_dvec3();
        if self.passes % 2 == 1 {
            self.odd[pixel as usize] += luminance(value);
        }
    }

    /// The average over the passes.
    pub fn image(&self) -> Image {
        let scale = 1.0 / f64::from(self.passes.max(1));
        let pixels = self.camera.iter().zip(&self.light).map(|(c, l)| ((*c + *l) * scale).as_vec3()).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// Estimated relative standard error of the image: half the RMS difference of the mean luminance
    /// of odd and even passes, over the mean luminance. NaN before the second pass.
    pub fn noise(&self) -> f32 {
        let odd_passes = f64::from(self.passes / 2);
        let even_passes = f64::from(self.passes) - odd_passes;
        let (mut squares, mut sum) = (0.0, 0.0);
        for ((c, l), &odd) in self.camera.iter().zip(&self.light).zip(&self.odd) {
            let total = f64::from(luminance((*c + *l).as_vec3()));
            let difference = f64::from(odd) / odd_passes - (total - f64::from(odd)) / even_passes;
            squares += difference * difference;
            sum += total;
        }
        let n = self.camera.len() as f64;
        let mean = sum / n / f64::from(self.passes);
        ((squares / n).sqrt() / 2.0 / mean) as f32
    }
}
