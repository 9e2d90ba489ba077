//! Light-emitting meshes.

use super::glow::Glow;
use super::surface::SurfaceEmission;
use crate::geometry::{Mesh, SurfacePoint};
use crate::math::{Discrete, warp};
use glam::{DVec3, Vec2};
use std::sync::Arc;

/// A mesh, sampled uniformly by area for emission and for next-event estimation alike.
#[derive(Clone, Debug)]
pub(super) struct MeshLight {
    pub(super) shape: u32,
    pub(super) emission: SurfaceEmission,
    /// What the emission is multiplied by.
    pub(super) glow: Option<Arc<Glow>>,
    /// Mean of that over the area, of what a fixed set of points sees.
    mean: DVec3,
    /// Chooses a triangle by its area; one without area has probability 0.
    triangles: Discrete,
}

impl MeshLight {
    /// `None` if the mesh has no area.
    pub(super) fn new(
        shape: u32,
        mesh: &Mesh,
        emission: SurfaceEmission,
        glow: Option<Arc<Glow>>,
    ) -> Option<MeshLight> {
        let areas = (0..mesh.triangles.len() as u32).map(|t| {
            let [a, b, c] = mesh.corners(t).map(|p| p.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        });
        let mut light = MeshLight { shape, emission, glow, mean: DVec3::ONE, triangles: Discrete::new(areas)? };
        if let Some(glow) = &light.glow {
            light.mean = glow.mean(|u| light.sample_point(mesh, u), mesh);
        }
        Some(light)
    }

    /// W/(m² sr).
    pub(super) fn mean_radiance(&self) -> DVec3 {
        self.emission.radiance.as_dvec3() * self.mean
    }

    /// Square metres, one side.
    #[inline]
    pub(super) fn area(&self) -> f64 {
        self.triangles.total()
    }

    /// A point with density `1/area`.
    #[inline]
    pub(super) fn sample_point(&self, mesh: &Mesh, u: Vec2) -> SurfacePoint {
        let (triangle, rest) = self.choose(u);
        let b = warp::triangle(Vec2::new(rest, u.y));
        SurfacePoint { shape: self.shape, ..mesh.surface(triangle as u32, b.x, b.y) }
    }

    /// A triangle, and what is left of `u.x`. The digits of `u.y` follow those of `u.x`, 23 bits of which choose among
    /// millions of triangles too coarsely; where they matter, a triangle is too small for its points to.
    #[inline]
    fn choose(&self, u: Vec2) -> (usize, f32) {
        self.triangles.sample_reuse(f64::from(u.x) + f64::from(u.y) / f64::from(1 << 23))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rgb, Sampler, Stream};

    /// Of so many triangles that a number in f32 chooses each of them in one or in two of its steps, each is chosen as
    /// often as any other.
    #[test]
    fn each_of_millions_of_triangles_is_chosen_as_often() {
        let n = 3 << 21;
        let emission = SurfaceEmission { radiance: Rgb::ONE, two_sided: false };
        let triangles = Discrete::new((0..n).map(|_| 1.0)).expect("weights");
        let lamp = MeshLight { shape: 0, emission, glow: None, mean: DVec3::ONE, triangles };
        let steps = |t: usize| ((t as u64 + 1) << 23) / n as u64 - ((t as u64) << 23) / n as u64;
        let draws = 200_000;
        let in_two = (0..draws).filter(|&i| {
            let u = Sampler::new(1, i, 0, Stream::Light).next_2d();
            steps(lamp.choose(u).0) == 2
        });
        let share = in_two.count() as f64 / f64::from(draws);
        // A standard error of 0.001; by `u.x` alone it would be a half.
        assert!((share - 1.0 / 3.0).abs() < 0.006, "{share}");
    }
}
