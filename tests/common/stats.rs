//! Statistics of images: block means over independent runs.

use caustica::math::luminance;
use caustica::render::Image;

/// Mean and standard error of the mean of each block of an image, from independent runs.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    pub mean: Vec<f64>,
    pub error: Vec<f64>,
    /// The same of the whole image.
    pub total: (f64, f64),
}

/// Mean luminance of each `block` x `block` square.
pub(crate) fn block_means(image: &Image, block: u32) -> Vec<f64> {
    let (bw, bh) = (image.width / block, image.height / block);
    let mut sums = vec![0.0; (bw * bh) as usize];
    for y in 0..bh * block {
        for x in 0..bw * block {
            let value = luminance(image.pixels[(y * image.width + x) as usize]);
            sums[((y / block) * bw + x / block) as usize] += f64::from(value);
        }
    }
    sums.iter().map(|s| s / f64::from(block * block)).collect()
}

/// Mean and standard error over runs.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Over at least two runs with different seeds.
pub(crate) fn blocks(runs: &[Image], block: u32) -> Blocks {
    let per_run: Vec<Vec<f64>> = runs.iter().map(|r| block_means(r, block)).collect();
    let columns = (0..per_run[0].len()).map(|i| per_run.iter().map(|r| r[i]).collect::<Vec<_>>());
    let (mean, error) = columns.map(|c| mean_and_error(&c)).unzip();
    let totals: Vec<f64> = per_run.iter().map(|r| r.iter().sum::<f64>() / r.len() as f64).collect();
    Blocks { mean, error, total: mean_and_error(&totals) }
}

/// z-scores of the differences of two estimates.
pub(crate) fn z_scores(a: &Blocks, b: &Blocks) -> Vec<f64> {
    let z = |i: usize| {
        let error = a.error[i].hypot(b.error[i]);
        // Blocks that are exactly equal (black in both) say nothing.
        if error > 0.0 { (a.mean[i] - b.mean[i]) / error } else { 0.0 }
    };
    (0..a.mean.len()).map(z).collect()
}

/// What none of `n` z-scores is beyond with a probability of 0.999 (Bonferroni), if their errors are estimated with
/// `degrees` of freedom.
pub(crate) fn largest_z(n: usize, degrees: f64) -> f64 {
    let student = statrs::distribution::StudentsT::new(0.0, 1.0, degrees).expect("degrees of freedom");
    statrs::distribution::ContinuousCDF::inverse_cdf(&student, 1.0 - 0.5e-3 / n as f64)
}

/// Whether z-scores look like N(0, 1), at a family-wise level of about 1e-3: no score beyond [`largest_z`], mean
/// square within its own 4 sigma. Returns what is wrong.
pub(crate) fn check_normal(name: &str, z: &[f64], degrees: f64) -> Result<(), String> {
    let n = z.len() as f64;
    // Student's t: variance d/(d-2), and a heavier tail.
    let variance = degrees / (degrees - 2.0);
    let bound = largest_z(z.len(), degrees);
    let worst = z.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mean_square = z.iter().map(|v| v * v).sum::<f64>() / n;
    // Variance of t²: kurtosis of t is 3 + 6/(d-4).
    let spread = variance * ((2.0 + 6.0 / (degrees - 4.0)) / n).sqrt();
    let mean = z.iter().sum::<f64>() / n;
    if worst > bound {
        return Err(format!("{name}: |z| = {worst:.2} beyond {bound:.2}"));
    }
    if mean_square > variance + 4.0 * spread {
        return Err(format!("{name}: mean z² = {mean_square:.3}, expected {variance:.3} +- {spread:.3}"));
    }
    if mean.abs() > 4.0 * (variance / n).sqrt() {
        return Err(format!("{name}: mean z = {mean:.3} over {n} blocks"));
    }
    Ok(())
}
