//! An image of what is infinitely far away, and how its directions are drawn.
//!
//! Rows are latitudes from the pole +y (top) to -y, columns longitudes; the middle of the image is +z, its left
//! quarter +x, turned as OpenEXR's latitude-longitude maps are, but with the outermost pixels' centres half a pixel from
//! poles and seam. Between the centres it is linear in longitude and in the sine of the latitude, in which areas on the
//! sphere are even: so a direction's density can be proportional to the luminance there, but for rounding of probabilities.

use super::LUMINANCE;
use super::choose::STEPS;
use crate::math::{Fnv, Rgb};
use crate::texture::PixelsError;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::PI;
use std::fmt;

/// Why an image is none of what surrounds a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentMapError {
    /// It is no image.
    #[error(transparent)]
    Pixels(#[from] PixelsError),
    /// No memory for the table that directions are drawn by.
    #[error("{bytes} bytes could not be allocated")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: usize,
    },
}

/// The image and its table. Cells lie between the centres of four pixels, the first and the last row of them between a
/// pole and the pixels around it.
pub struct EnvironmentMap {
    width: usize,
    height: usize,
    pixels: Vec<Rgb>,
    largest: f32,
    /// Where rows of cells begin and end: the part of the sphere's area above, 0 to 1.
    edges: Vec<f64>,
    /// Cumulative probabilities of the rows of cells, from 0, in whole [`STEPS`], so that a cell is drawn as often as claimed.
    /// What has less than a step of a row's light, or of all light in its row, may have none, or a whole one: beside a strong
    /// sun that is most of its row, of which other techniques find the rest.
    rows: Vec<f32>,
    /// Of the cells of each row, `width + 1` numbers for each.
    columns: Vec<f32>,
    /// Integral over the sphere.
    total: DVec3,
    hash: u64,
}

impl fmt::Debug for EnvironmentMap {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "EnvironmentMap({}x{}, {:016x})", self.width, self.height, self.hash)
    }
}

/// A place within a cell.
struct Cell {
    row: usize,
    column: usize,
    /// From left to right and from top to bottom, 0 to 1.
    at: DVec2,
}

impl EnvironmentMap {
    /// From `width * height` pixels, row by row from the top, linear Rec. 709. What is below 0, as filters that sharpen leave
    /// it, is taken as 0.
    pub fn new(width: usize, height: usize, mut pixels: Vec<Rgb>) -> Result<EnvironmentMap, EnvironmentMapError> {
        PixelsError::check_size(width, height, pixels.len())?;
        let (mut largest, mut hash) = (0.0f32, Fnv::default());
        hash.bytes(&(width as u64).to_le_bytes());
        for (i, pixel) in pixels.iter_mut().enumerate() {
            if !pixel.is_finite() {
                let (value, expected) = (*pixel, "finite numbers");
                return Err(PixelsError::Pixel { x: i % width, y: i / width, value, expected }.into());
            }
            let value = pixel.max(Rgb::ZERO);
            *pixel = value;
            largest = largest.max(value.max_element());
            hash.triple(value.to_array().map(f32::to_bits));
        }
        let rows = height + 1;
        let mut columns = Vec::new();
        let out_of_memory = |_| EnvironmentMapError::OutOfMemory { bytes: rows * (width + 1) * size_of::<f32>() };
        columns.try_reserve_exact(rows * (width + 1)).map_err(out_of_memory)?;
        let mut map = EnvironmentMap {
            width,
            height,
            pixels,
            largest,
            edges: (0..=rows).map(|row| area_above(row, height)).collect(),
            rows: Vec::new(),
            columns,
            total: DVec3::ZERO,
            hash: hash.value(),
        };
        map.tabulate();
        Ok(map)
    }

    fn tabulate(&mut self) {
        let mut rows = Vec::with_capacity(self.height + 1);
        let mut cells = Vec::with_capacity(self.width);
        for row in 0..=self.height {
            cells.clear();
            let mut sum = DVec3::ZERO;
            for column in 0..self.width {
                let mean = self.corners(row, column).iter().map(|c| c.as_dvec3() * 0.25).sum::<DVec3>();
                cells.push(mean.dot(LUMINANCE));
                sum += mean;
            }
            // 4 pi, cut into rows and columns.
            let sum = sum * (4.0 * PI * (self.edges[row + 1] - self.edges[row]) / self.width as f64);
            rows.push(sum.dot(LUMINANCE));
            self.total += sum;
            self.columns.extend(cumulative(&cells));
        }
        self.rows = cumulative(&rows).collect();
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The largest number of any channel.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// Of the size and of all pixels.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Bytes of pixels and table.
    pub fn memory(&self) -> u64 {
        (size_of_val(&self.pixels[..]) + size_of_val(&self.columns[..])) as u64
    }

    /// Integral over all directions.
    pub(super) fn total(&self) -> DVec3 {
        self.total
    }

    /// What the image shows in a direction of unit length.
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        let cell = self.cell(direction);
        let [a, b, c, d] = self.corners(cell.row, cell.column);
        let at = cell.at.as_vec2();
        a.lerp(b, at.x).lerp(c.lerp(d, at.x), at.y)
    }

    /// Density of [`EnvironmentMap::sample`] per solid angle.
    #[inline]
    pub(super) fn density(&self, direction: Vec3) -> f64 {
        let Cell { row, column, at } = self.cell(direction);
        let columns = self.columns(row);
        let probability =
            f64::from(self.rows[row + 1] - self.rows[row]) * f64::from(columns[column + 1] - columns[column]);
        if !(probability > 0.0) {
            return 0.0;
        }
        let [a, b, c, d] = self.corners(row, column).map(luminance);
        let (here, mean) = (mix(mix(a, b, at.x), mix(c, d, at.x), at.y), 0.25 * (a + b + c + d));
        let solid_angle = 4.0 * PI * (self.edges[row + 1] - self.edges[row]) / self.width as f64;
        probability * here / (mean * solid_angle)
    }

    /// A direction, unit, with a density proportional to the luminance there; only of an image that is not black.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        let (row, v) = choose(&self.rows, u.y);
        let (column, u) = choose(self.columns(row), u.x);
        let [a, b, c, d] = self.corners(row, column).map(luminance);
        let y = linear(a + b, c + d, v);
        let x = linear(mix(a, c, y), mix(b, d, y), u);
        // Half of 1 - cos of the angle from +y is the area above, so sin is twice the root of its product with the rest.
        let above = mix(self.edges[row], self.edges[row + 1], y);
        let sin = 2.0 * (above * (1.0 - above)).max(0.0).sqrt();
        let longitude = PI - 2.0 * PI * (column as f64 + 0.5 + x) / self.width as f64;
        DVec3::new(sin * longitude.sin(), 1.0 - 2.0 * above, sin * longitude.cos()).as_vec3()
    }

    #[inline]
    fn cell(&self, direction: Vec3) -> Cell {
        let d = direction.as_dvec3();
        let around = d.x * d.x + d.z * d.z;
        let length2 = around + d.y * d.y;
        // The smaller part of the sphere first: near a pole, 1 - cos of an f32 direction would have no digits.
        let smaller = 0.5 * around / (length2 + d.y.abs() * length2.sqrt());
        let above = if d.y >= 0.0 { smaller } else { 1.0 - smaller };
        let angle = if d.y >= 0.0 { 2.0 * smaller.sqrt().asin() } else { PI - 2.0 * smaller.sqrt().asin() };
        let guess = (angle / PI * self.height as f64 + 0.5) as usize;
        let mut row = guess.min(self.height);
        // The table has the last word.
        if above < self.edges[row] {
            row = row.saturating_sub(1);
        } else if above > self.edges[row + 1] {
            row = (row + 1).min(self.height);
        }
        let (top, bottom) = (self.edges[row], self.edges[row + 1]);
        let y = ((above - top) / (bottom - top)).clamp(0.0, 1.0);

        let across = (0.5 - d.x.atan2(d.z) / (2.0 * PI)) * self.width as f64 - 0.5;
        let left = across.floor();
        let column = left.rem_euclid(self.width as f64) as usize % self.width;
        Cell { row, column, at: DVec2::new((across - left).clamp(0.0, 1.0), y) }
    }

    /// The pixels around a cell: top left, top right, bottom left, bottom right.
    #[inline]
    fn corners(&self, row: usize, column: usize) -> [Rgb; 4] {
        let top = row.saturating_sub(1) * self.width;
        let bottom = row.min(self.height - 1) * self.width;
        let right = if column + 1 == self.width { 0 } else { column + 1 };
        [top + column, top + right, bottom + column, bottom + right].map(|i| self.pixels[i])
    }

    #[inline]
    fn columns(&self, row: usize) -> &[f32] {
        &self.columns[row * (self.width + 1)..][..self.width + 1]
    }
}

/// The part of the sphere's area above the upper edge of a row of cells, of which all but the first and the last lie between
/// the centres of rows of pixels.
fn area_above(row: usize, height: usize) -> f64 {
    if row == 0 {
        0.0
    } else if row > height {
        1.0
    } else {
        (0.5 * PI * (row as f64 - 0.5) / height as f64).sin().powi(2)
    }
}

fn luminance(c: Rgb) -> f64 {
    c.as_dvec3().dot(LUMINANCE)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// Cumulative probabilities in whole steps, from 0 to 1; all 0 where all weights are.
fn cumulative(weights: &[f64]) -> impl Iterator<Item = f32> {
    let total: f64 = weights.iter().sum();
    let scale = if total > 0.0 { STEPS / total } else { 0.0 };
    let sums = weights.iter().scan(0.0, |sum, w| {
        *sum += w;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).map(move |sum| ((sum * scale).round() / STEPS) as f32)
}

/// The entry that a uniform number chooses, and the middle of the number's step within it, again in 0 to 1.
#[inline]
fn choose(cumulative: &[f32], u: f32) -> (usize, f64) {
    // Of numbers with one bit more, both belong to a step.
    let u = ((f64::from(u) * STEPS).floor() / STEPS) as f32;
    let i = cumulative[1..].partition_point(|&c| c <= u).min(cumulative.len() - 2);
    let width = f64::from(cumulative[i + 1] - cumulative[i]);
    let rest = (f64::from(u - cumulative[i]) + 0.5 / STEPS) / width;
    (i, rest.min(1.0))
}

/// A number in 0 to 1 with a density proportional to `a` at 0, `b` at 1 and linear between.
#[inline]
fn linear(a: f64, b: f64, u: f64) -> f64 {
    let root = (mix(a * a, b * b, u)).sqrt();
    if a + root > 0.0 { (u * (a + b) / (a + root)).min(1.0) } else { u }
}
