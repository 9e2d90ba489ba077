//! Pearson's chi-square test of a sampler against the density it claims, for unit tests.
//!
//! The domain is cut into cells. Expected counts are the claimed density integrated over each cell in
//! f64; samples that the sampler refuses, or that fall outside the domain, form one further cell, which
//! expects the share that the density leaves over. Cells that expect fewer than [`POOL_BELOW`] are
//! pooled. A suite of `tests` such tests fails by chance with probability [`SIGNIFICANCE`] at most: each
//! is held at the level of [`sidak`] (Šidák 1967). Seeds are fixed, so a verdict does not change from
//! run to run.

use glam::Vec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;
use std::ops::Range;

/// Probability that a suite of correct samplers is rejected, before the seed is fixed.
pub(crate) const SIGNIFICANCE: f64 = 0.01;

/// Cells that expect fewer samples than this are counted together.
const POOL_BELOW: f64 = 5.0;

/// The level of one test among `tests`, so that together they have [`SIGNIFICANCE`].
pub(crate) fn sidak(tests: usize) -> f64 {
    1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / tests as f64)
}

/// What a test found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit {
    /// Probability of a deviation at least this large if the density is right.
    pub(crate) p: f64,
    /// Integral of the density over the domain.
    pub(crate) integral: f64,
    /// Pearson's statistic and its degrees of freedom.
    pub(crate) statistic: f64,
    pub(crate) freedom: usize,
}

impl Fit {
    /// Panics if the deviation is significant for one of `tests` tests, or the density exceeds a
    /// probability by more than the error of its integration.
    #[track_caller]
    pub(crate) fn assert_accepted(&self, name: &str, tests: usize) {
        assert!(self.integral < 1.0 + 2e-3, "{name}: the density integrates to {}", self.integral);
        let Fit { p, statistic, freedom, .. } = self;
        let level = sidak(tests);
        assert!(*p >= level, "{name}: statistic {statistic:.1}, {freedom} degrees of freedom, {p:.2e} < {level:.2e}");
    }
}

/// Tests directions against a density per unit solid angle. `cells` counts rows in the polar angle and
/// columns in azimuth.
pub(crate) fn sphere(
    samples: usize,
    cells: [usize; 2],
    mut sample: impl FnMut() -> Option<Vec3>,
    density: impl Fn(Vec3) -> f64,
) -> Fit {
    rectangle(
        0.0..PI,
        -PI..PI,
        samples,
        cells,
        || sample().map(|w| [polar_angle(w), (w.y as f64).atan2(w.x as f64)]),
        |theta, phi| density(spherical(theta, phi)) * theta.sin(),
    )
}

/// Integral over the sphere of a function of the direction.
pub(crate) fn integrate_sphere(f: impl Fn(Vec3) -> f64) -> f64 {
    const CELLS: usize = 24;
    let size = [PI / CELLS as f64, 2.0 * PI / CELLS as f64];
    let integrand = |theta: f64, phi: f64| f(spherical(theta, phi)) * theta.sin();
    (0..CELLS * CELLS)
        .map(|k| [(k / CELLS) as f64 * size[0], (k % CELLS) as f64 * size[1]])
        .map(|corner| integrate(&integrand, corner, size, 3e-6))
        .sum()
}

fn spherical(theta: f64, phi: f64) -> Vec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
    Vec3::new((sin * cos_phi) as f32, (sin * sin_phi) as f32, cos as f32)
}

/// With all its digits at the poles, where the cosine has lost them.
fn polar_angle(w: Vec3) -> f64 {
    (w.x as f64).hypot(w.y as f64).atan2(w.z as f64)
}

/// Tests points of a rectangle against a density per unit of its area.
pub(crate) fn rectangle(
    x: Range<f64>,
    y: Range<f64>,
    samples: usize,
    cells: [usize; 2],
    mut sample: impl FnMut() -> Option<[f64; 2]>,
    density: impl Fn(f64, f64) -> f64,
) -> Fit {
    let [nx, ny] = cells;
    let (dx, dy) = ((x.end - x.start) / nx as f64, (y.end - y.start) / ny as f64);
    let mut observed = vec![0.0; nx * ny + 1];
    for _ in 0..samples {
        let cell = sample().and_then(|[px, py]| {
            let (i, j) = ((px - x.start) / dx, (py - y.start) / dy);
            // The far edge belongs to the last cell; rounding may overstep it slightly.
            let inside = i > -1e-4 && j > -1e-4 && i < nx as f64 + 1e-4 && j < ny as f64 + 1e-4;
            inside.then(|| (i.max(0.0) as usize).min(nx - 1) * ny + (j.max(0.0) as usize).min(ny - 1))
        });
        observed[cell.unwrap_or(nx * ny)] += 1.0;
    }
    // An error of this much probability moves a cell by a tenth of a count.
    let tolerance = 0.1 / samples as f64;
    let mut expected = Vec::with_capacity(nx * ny + 1);
    for i in 0..nx {
        for j in 0..ny {
            let corner = [x.start + i as f64 * dx, y.start + j as f64 * dy];
            expected.push(integrate(&density, corner, [dx, dy], tolerance));
        }
    }
    let integral: f64 = expected.iter().sum();
    expected.push((1.0 - integral).max(0.0));
    for e in &mut expected {
        *e *= samples as f64;
    }
    let (statistic, freedom, p) = pearson(&observed, &expected);
    Fit { p, integral, statistic, freedom }
}

/// Statistic, degrees of freedom and p-value of counts against expected counts with the same total.
pub(crate) fn pearson(observed: &[f64], expected: &[f64]) -> (f64, usize, f64) {
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut pooled_observed, mut pooled_expected) = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        if e < POOL_BELOW {
            pooled_observed += o;
            pooled_expected += e;
        } else {
            statistic += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    if pooled_expected >= POOL_BELOW {
        statistic += (pooled_observed - pooled_expected).powi(2) / pooled_expected;
        cells += 1;
    } else if pooled_observed > pooled_expected + 10.0 * POOL_BELOW.sqrt() {
        // Samples where hardly any may be: too few expected for the statistic, but ten deviations out.
        return (f64::INFINITY, cells, 0.0);
    }
    let freedom = cells.saturating_sub(1);
    let p = match ChiSquared::new(freedom as f64) {
        Ok(distribution) => distribution.sf(statistic),
        // One cell holds everything: its count is the total.
        Err(_) => 1.0,
    };
    (statistic, freedom, p)
}

/// Nodes and weights of the Gauss-Legendre rule of order 4 on `[0, 1]`.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

fn gauss(density: &impl Fn(f64, f64) -> f64, [x, y]: [f64; 2], [dx, dy]: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for (u, wu) in GAUSS {
        for (v, wv) in GAUSS {
            sum += wu * wv * density(x + u * dx, y + v * dy);
        }
    }
    sum * dx * dy
}

/// Integral of a density over a rectangle, halved in both axes at least once, so that narrow peaks are
/// met, and where the rule disagrees with itself.
pub(crate) fn integrate(density: &impl Fn(f64, f64) -> f64, corner: [f64; 2], size: [f64; 2], tolerance: f64) -> f64 {
    const DEPTH: u32 = 8;
    fn refine(
        density: &impl Fn(f64, f64) -> f64,
        [x, y]: [f64; 2],
        size: [f64; 2],
        whole: f64,
        tolerance: f64,
        depth: u32,
    ) -> f64 {
        let half = [size[0] / 2.0, size[1] / 2.0];
        let corners = [[x, y], [x + half[0], y], [x, y + half[1]], [x + half[0], y + half[1]]];
        let parts = corners.map(|c| gauss(density, c, half));
        let sum: f64 = parts.iter().sum();
        if depth == 0 || depth < DEPTH && (sum - whole).abs() <= tolerance {
            return sum;
        }
        (0..4).map(|k| refine(density, corners[k], half, parts[k], tolerance / 2.0, depth - 1)).sum()
    }
    refine(density, corner, size, gauss(density, corner, size), tolerance, DEPTH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Sampler, Stream, warp};

    fn cosine(seed: u64, density: impl Fn(Vec3) -> f64) -> Fit {
        let mut random = Sampler::new(seed, 0, 0, Stream::Camera);
        sphere(100_000, [16, 16], || Some(warp::cosine_hemisphere(random.next_2d())), density)
    }

    #[test]
    fn the_true_density_is_accepted() {
        let fit = cosine(1, |w| warp::cosine_hemisphere_pdf_w(w.z) as f64);
        assert!((fit.integral - 1.0).abs() < 1e-6, "{fit:?}");
        fit.assert_accepted("cosine", 1);
    }

    #[test]
    fn the_p_value_is_uniform() {
        // Kolmogorov-Smirnov at 1 % for 100 values: 1.63 / sqrt(100).
        let mut p: Vec<f64> =
            (0..100).map(|s| cosine(100 + s, |w| warp::cosine_hemisphere_pdf_w(w.z) as f64).p).collect();
        p.sort_by(f64::total_cmp);
        let worst = p.iter().enumerate().map(|(i, p)| (p - (i as f64 + 0.5) / 100.0).abs()).fold(0.0, f64::max);
        assert!(worst < 0.163, "{worst}");
    }

    #[test]
    fn densities_that_are_slightly_wrong_are_rejected() {
        // A missing cosine, a tilt by a tenth, and a density that claims less than all.
        assert!(cosine(2, |w| if w.z > 0.0 { 0.5 / PI } else { 0.0 }).p < 1e-10);
        assert!(cosine(3, |w| warp::cosine_hemisphere_pdf_w(w.z) as f64 * (1.0 + 0.1 * w.x as f64)).p < 1e-4);
        assert!(cosine(4, |w| warp::cosine_hemisphere_pdf_w(w.z) as f64 * 0.99).p < 1e-10);
    }
}
