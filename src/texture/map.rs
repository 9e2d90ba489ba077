//! A texture as a surface uses it.

use super::Texture;
use crate::math::Rgb;
use glam::{Affine2, DVec2, Vec2};
use std::sync::Arc;

/// What is beyond the edges of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image again, every other one reversed.
    Mirror,
    /// The texels of the edge.
    Clamp,
}

/// What is between the centres of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Linear in both directions. Samples of a pixel average the rest: there are no smaller copies of the image.
    #[default]
    Linear,
    /// The nearest texel.
    Nearest,
}

/// A texture, and how texture coordinates find its texels.
#[derive(Clone, Debug)]
pub struct TextureMap {
    /// The image.
    pub texture: Arc<Texture>,
    /// From texture coordinates to the image: (0, 0) is its upper left corner, (1, 1) its lower right one.
    pub transform: Affine2,
    /// To the right and left, and below and above.
    pub wrap: [Wrap; 2],
    /// Between texels.
    pub filter: Filter,
}

impl TextureMap {
    /// The image as it is, repeated.
    pub fn new(texture: Arc<Texture>) -> TextureMap {
        TextureMap { texture, transform: Affine2::IDENTITY, wrap: [Wrap::Repeat; 2], filter: Filter::Linear }
    }

    /// The image at texture coordinates.
    #[inline]
    pub fn at(&self, coordinates: Vec2) -> Rgb {
        let at = self.transform.transform_point2(coordinates).as_dvec2();
        // Coordinates beyond all floats are none.
        let at = if at.is_finite() { at } else { DVec2::ZERO };
        let (width, height) = self.texture.size();
        let [columns, rows] = self.wrap;
        let (x, y) = (at.x * width as f64, at.y * height as f64);
        if self.filter == Filter::Nearest {
            return self.texture.texel(columns.index(x.floor(), width), rows.index(y.floor(), height));
        }
        // Centres of texels are at halves.
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (s, t) = ((x - left) as f32, (y - top) as f32);
        let [left, right] = [left, left + 1.0].map(|i| columns.index(i, width));
        let [top, bottom] = [top, top + 1.0].map(|i| rows.index(i, height));
        let row = |y| self.texture.texel(left, y).lerp(self.texture.texel(right, y), s);
        row(top).lerp(row(bottom), t)
    }
}

impl Wrap {
    /// The texel that stands at a whole number, of `n`.
    #[inline]
    fn index(self, i: f64, n: usize) -> usize {
        let last = n as f64 - 1.0;
        let i = match self {
            Wrap::Repeat => modulo(i, n as f64),
            Wrap::Mirror => {
                let i = modulo(i, 2.0 * n as f64);
                i.min(2.0 * last + 1.0 - i)
            }
            Wrap::Clamp => i,
        };
        i.clamp(0.0, last) as usize
    }
}

/// Exact up to 2^53, in fewer steps than `rem_euclid`; beyond, something near.
#[inline]
fn modulo(i: f64, n: f64) -> f64 {
    i - n * (i / n).floor()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::Encoding;

    /// Two by two texels of 0, 1, 2 and 3 in red.
    fn map(wrap: Wrap, filter: Filter) -> TextureMap {
        let texels = [0.0, 1.0, 2.0, 3.0].map(|x| Rgb::new(x, 0.0, 0.0)).to_vec();
        let texture = Arc::new(Texture::of_floats(2, 2, texels).unwrap());
        TextureMap { wrap: [wrap; 2], filter, ..TextureMap::new(texture) }
    }

    fn red(map: &TextureMap, u: f32, v: f32) -> f32 {
        map.at(Vec2::new(u, v)).x
    }

    #[test]
    fn rows_run_from_the_top_and_columns_from_the_left() {
        for filter in [Filter::Linear, Filter::Nearest] {
            let map = map(Wrap::Clamp, filter);
            for (i, (u, v)) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)].into_iter().enumerate() {
                assert_eq!(red(&map, u, v), i as f32, "{filter:?}");
            }
        }
        let linear = map(Wrap::Clamp, Filter::Linear);
        assert_eq!(red(&linear, 0.5, 0.5), 1.5);
        assert_eq!(red(&linear, 0.375, 0.25), 0.25);
        assert_eq!(red(&map(Wrap::Clamp, Filter::Nearest), 0.375, 0.49), 0.0);
    }

    #[test]
    fn beyond_the_edges() {
        for (wrap, left, right) in [(Wrap::Repeat, 1.0, 0.0), (Wrap::Mirror, 0.0, 1.0), (Wrap::Clamp, 0.0, 1.0)] {
            for filter in [Filter::Linear, Filter::Nearest] {
                let map = map(wrap, filter);
                assert_eq!(red(&map, -0.25, 0.25), left, "{wrap:?} {filter:?}");
                assert_eq!(red(&map, 1.25, 0.25), right, "{wrap:?} {filter:?}");
            }
        }
        // A whole period on, and at the seam.
        assert_eq!(red(&map(Wrap::Repeat, Filter::Linear), 0.0, 0.25), 0.5);
        assert_eq!(red(&map(Wrap::Mirror, Filter::Linear), 0.0, 0.25), 0.0);
        assert_eq!(red(&map(Wrap::Mirror, Filter::Nearest), 2.25, 0.25), 0.0);
        assert_eq!(red(&map(Wrap::Mirror, Filter::Nearest), 1.75, 0.25), 0.0);
    }

    /// Far out, where neighbouring floats are whole images apart, and beyond all floats.
    #[test]
    fn extreme_coordinates_stay_in_the_image() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [Filter::Linear, Filter::Nearest] {
                let mut map = map(wrap, filter);
                map.transform = Affine2::from_scale(Vec2::splat(1e30));
                for u in [1e-38, 1e-20, 1.0, -1.0, 1e8, -1e8, 1e30, f32::MAX] {
                    let value = red(&map, u, -u);
                    assert!((0.0..=3.0).contains(&value), "{wrap:?} {filter:?} {u}: {value}");
                }
            }
        }
    }

    #[test]
    fn bytes_are_decoded_before_they_are_mixed() {
        let bytes = |encoding| Arc::new(Texture::of_bytes(2, 1, vec![[0; 3], [255; 3]], encoding).unwrap());
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            assert_eq!(red(&TextureMap::new(bytes(encoding)), 0.5, 0.5), 0.5);
        }
        let grey = |encoding| TextureMap::new(Arc::new(Texture::of_bytes(1, 1, vec![[118; 3]], encoding).unwrap()));
        assert!((red(&grey(Encoding::Srgb), 0.1, 0.9) - 0.181_16).abs() < 1e-5);
        assert!((red(&grey(Encoding::Linear), 0.1, 0.9) - 118.0 / 255.0).abs() < 1e-7);
    }
}
