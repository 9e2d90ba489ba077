//! A light-emitting mesh with an image on it: a screen, a window, the glow of coals. Its points are drawn evenly by area, so
//! that densities do not know of the image.

use crate::geometry::{Mesh, SurfacePoint};
use crate::math::Rgb;
use crate::scene::description::{MeshDescription, TextureMap};
use glam::{DVec3, Vec2};
use std::sync::Arc;

/// What emission is multiplied by.
#[derive(Clone, Debug)]
pub(super) struct Glow {
    pub(super) map: TextureMap,
    /// Has texture coordinates.
    pub(super) mesh: Arc<MeshDescription>,
    /// Points that its mean is of.
    pub(super) points: u32,
}

/// Points that the mean is of: within some percent, and the choice among lights needs no more. Of very many lamps all
/// together, in a second or so: fewer. Not tuned.
const POINTS: u32 = 4096;
const ALL_POINTS: u32 = 1 << 22;
const LEAST_POINTS: u32 = 16;

/// Points of each of so many lamps.
pub(super) fn points(lamps: usize) -> u32 {
    (ALL_POINTS / (lamps.max(1) as u32)).clamp(LEAST_POINTS, POINTS)
}

impl Glow {
    /// At a point of the `placed` mesh.
    #[inline]
    pub(super) fn at(&self, placed: &Mesh, at: &SurfacePoint) -> Rgb {
        self.map.at(placed.interpolate(at, &self.mesh.texture_coordinates))
    }

    /// Mean of it over so many points that `sample` draws. Not 0, unless the image is black: what chance missed must not be out of
    /// all choice.
    pub(super) fn mean(&self, sample: impl Fn(Vec2) -> SurfacePoint, placed: &Mesh) -> DVec3 {
        /// Roberts 2018, "The unreasonable effectiveness of quasirandom sequences": 1/g and 1/g² with g³ = g + 1.
        const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        let sum: DVec3 = (0..self.points)
            .map(|i| {
                let u = STEP.map(|step| ((f64::from(i) * step + 0.5).fract() as f32).min(1.0 - f32::EPSILON));
                self.at(placed, &sample(Vec2::from(u))).as_dvec3()
            })
            .sum();
        let least = self.map.texture.largest().as_dvec3() / f64::from(self.points);
        (sum / f64::from(self.points)).max(least)
    }
}
