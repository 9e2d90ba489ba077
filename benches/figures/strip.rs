//! Pictures side by side, all at the exposure that suits the reference.

use crate::measure::Reference;
use caustica::render::Image;
use glam::Vec3;

/// Largest side of a picture, in pixels.
const LARGEST: u32 = 256;

/// Between pictures, in pixels.
const GAP: u32 = 4;

/// Pictures in a row.
const ROW: usize = 4;

/// What is as bright as 99 % of the reference's pixels or brighter is shown at least so bright, linear.
const BRIGHT: f32 = 0.9;

/// The images, the reference and the region, in rows on white.
pub(crate) fn strip(images: &[&Image], reference: &Reference) -> Image {
    let mut brightness: Vec<f32> = reference.image.pixels.iter().map(|p| p.max_element()).collect();
    brightness.sort_unstable_by(f32::total_cmp);
    let bright = brightness[(brightness.len() - 1) * 99 / 100];
    let scale = if bright > 0.0 { BRIGHT / bright } else { 1.0 };
    let region = reference.region.iter().map(|r| Vec3::splat(if *r { 0.5 / scale } else { 0.0 })).collect();
    let region = Image { pixels: region, ..reference.image.clone() };
    let all = images.iter().copied().chain([&reference.image, &region]);
    let tiles: Vec<Image> = all.map(shrunk).collect();

    let (w, h) = (tiles[0].width, tiles[0].height);
    let (columns, rows) = (tiles.len().min(ROW) as u32, tiles.len().div_ceil(ROW) as u32);
    let (width, height) = (columns * (w + GAP) - GAP, rows * (h + GAP) - GAP);
    let mut pixels = vec![Vec3::ONE; (width * height) as usize];
    for (i, tile) in tiles.iter().enumerate() {
        let (x, y) = ((i % ROW) as u32 * (w + GAP), (i / ROW) as u32 * (h + GAP));
        for (row, line) in tile.pixels.chunks_exact(w as usize).enumerate() {
            let start = ((y + row as u32) * width + x) as usize;
            for (to, from) in pixels[start..].iter_mut().zip(line) {
                *to = *from * scale;
            }
        }
    }
    Image::new(width, height, pixels)
}

/// Means over squares of pixels, as few as fit.
fn shrunk(image: &Image) -> Image {
    let n = image.width.max(image.height).div_ceil(LARGEST).max(1);
    let (width, height) = (image.width / n, image.height / n);
    let at = |x: u32, y: u32| image.pixels[(y * image.width + x) as usize];
    let mean = |x: u32, y: u32| {
        let sum: Vec3 =
            (0..n).flat_map(|dy| (0..n).map(move |dx| (dx, dy))).map(|(dx, dy)| at(x * n + dx, y * n + dy)).sum();
        sum / (n * n) as f32
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect();
    Image::new(width, height, pixels)
}
