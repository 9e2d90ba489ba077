//! What leaving a technique out would cost, from paths of all techniques.
//!
//! It can be read off the weights. A path of value `f` that all techniques together sample with density `p`, of which
//! some have the share `w`, adds `f²/p` to the second moment of the balance heuristic. If these sampled it `r` times
//! as often, it would add `f²/(p (1 - w + r w))`; without caustic connections `r = 0`, without aim it is the ratio of
//! the densities of what the light subpath drew, with fewer light subpaths their number. So sums over the samples of
//! all techniques estimate second moments of renders that are never made (compare Grittmann et al. 2022). For
//! connections and aim, `w` is that of the one technique that made the path, which errs on the side of
//! leaving out; for the number of light subpaths it is that of all that need one. (Rough glass that is walked
//! through would be evaluated instead, which the estimate does not know.)
//!
//! Errors are seen relative to what is around them. So are these: over the square of the radiance in a block of the
//! picture, which the same samples estimate, so that a single bright path, whose block it has brightened,
//! counts no more than that block.

use crate::integrator::bdpt::View;
use crate::integrator::{Contribution, Observer};
use crate::transport::aim::{CLASSES, departures};
use std::ops::Range;

/// Numbers of light subpaths per sample that are chosen from. More than one brings nothing: with 2 and 4 the error of
/// caustics at equal time was 1.14 and 2.2 times that with one on figure4a, 0.9 and 1.1 on eye, 1.4 and 2.6 on
/// `eye_small`, 1.06 and 1.4 on water_glass, 1.04 and 1.2 on demo.
pub(super) const NUMBERS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Blocks along each side of the picture: sixteen of 4096 samples in each. Not tuned.
const BLOCKS: u32 = 16;

/// Share of the picture's mean radiance that is added to that around a path, as in the relMSE of docs/results.md.
const FLOOR: f64 = 0.1;

/// Largest `1/(1 - w)`: a path that nothing else finds counts a million times.
const MOST: f64 = 1e6;

/// Second moments.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// Of caustics.
    pub(super) all: f64,
    /// By how much more without caustic connections.
    pub(super) unconnected: f64,
    /// By how much more without any aim.
    pub(super) unaimed: f64,
    /// By how much more without that of one class of places.
    pub(super) unaimed_from: Vec<f64>,
    /// With so many light subpaths as [`NUMBERS`] says: of caustics, and of other light that was reflected on its way.
    pub(super) by_number: [[f64; NUMBERS.len()]; 2],
}

impl Moments {
    fn new() -> Moments {
        let by_number = [[0.0; NUMBERS.len()]; 2];
        Moments { all: 0.0, unconnected: 0.0, unaimed: 0.0, unaimed_from: vec![0.0; CLASSES], by_number }
    }
}

/// A path that a technique made.
struct Path {
    group: usize,
    block: usize,
    /// What it adds to the image.
    added: f64,
    weight: f64,
    camera_only: f64,
    caustic: bool,
    connected: bool,
    /// Density of its light subpath without aim, over that with it.
    plain: f64,
    /// The same of each step, with the class of its place.
    departures: Range<usize>,
}

/// Paths of groups of samples.
pub(super) struct Paths<'v> {
    view: &'v View,
    paths: Vec<Path>,
    departures: Vec<(usize, f64)>,
    /// Sum of what was added to each block, see [`Paths::light`].
    blocks: Vec<f64>,
    groups: usize,
    /// What was added in the newest group, but for lights that the camera sees, perhaps through glass: they have no
    /// noise, however bright, and no say in what is too much of it.
    pub(super) light: f32,
}

impl Paths<'_> {
    pub(super) fn new(view: &View) -> Paths<'_> {
        let blocks = vec![0.0; (BLOCKS * BLOCKS) as usize];
        Paths { view, paths: Vec::new(), departures: Vec::new(), blocks, groups: 0, light: 0.0 }
    }

    pub(super) fn begin_group(&mut self) {
        self.groups += 1;
        self.light = 0.0;
    }

    fn block(&self, pixel: u32) -> usize {
        let View { width, height, .. } = *self.view;
        let along = |i: u32, n: u32| (u64::from(i) * u64::from(BLOCKS) / u64::from(n)) as usize;
        along(pixel / width, height) * BLOCKS as usize + along(pixel % width, width)
    }

    /// Of each group.
    pub(super) fn moments(&self) -> Vec<Moments> {
        let floor = (FLOOR * self.blocks.iter().sum::<f64>() / self.blocks.len() as f64).powi(2);
        let mut groups = vec![Moments::new(); self.groups];
        for path in &self.paths {
            let m = &mut groups[path.group];
            let added = path.added * path.added / (self.blocks[path.block].powi(2) + floor);
            let divided = |added: f64, remaining: f64| added / remaining.max(1.0 / MOST);
            for (sum, number) in m.by_number[usize::from(!path.caustic)].iter_mut().zip(NUMBERS) {
                *sum += divided(added, path.camera_only + number * (1.0 - path.camera_only));
            }
            if !path.caustic {
                continue;
            }
            let more = |ratio: f64| divided(added * (1.0 - ratio), 1.0 - path.weight * (1.0 - ratio));
            m.all += added;
            m.unconnected += if path.connected { more(0.0) } else { 0.0 };
            m.unaimed += more(path.plain);
            for &(class, plain) in &self.departures[path.departures.clone()] {
                m.unaimed_from[class] += more(plain);
            }
        }
        groups
    }
}

impl Observer for Paths<'_> {
    fn observe(&mut self, c: &Contribution) {
        let added = c.weighted.max_element();
        if !(added > 0.0 && added.is_finite()) || (c.camera.is_empty() && c.light.is_empty()) {
            return;
        }
        let block = self.block(c.pixel);
        self.light += added;
        self.blocks[block] += f64::from(added);
        let (caustic, direct) = (c.is_caustic(), c.s + c.t <= 3);
        if direct && !caustic {
            return;
        }
        let before = self.departures.len();
        self.departures.extend(departures(c.start, c.light));
        self.paths.push(Path {
            group: self.groups - 1,
            block,
            added: added.into(),
            weight: c.weight,
            camera_only: c.camera_only,
            caustic,
            connected: c.chain.is_some(),
            plain: c.light.last().map_or(1.0, |vertex| vertex.plain),
            departures: before..self.departures.len(),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::scene::description;
    use glam::DAffine3;

    /// One path in each pixel of a group, one of them brighter; by two techniques in turn, as their weights are equal.
    fn moments(brightest: f64, caustic: bool) -> Moments {
        let camera = description::Camera {
            name: String::new(),
            transform: DAffine3::IDENTITY,
            projection: description::Projection::Perspective { yfov: 1.0 },
        };
        let (width, height) = (64, 48);
        let view = View { camera: Camera::new(&camera, width, height), medium: 0, width, height };
        let mut paths = Paths::new(&view);
        paths.begin_group();
        for pixel in 0..width * height {
            paths.paths.push(Path {
                group: 0,
                block: paths.block(pixel),
                added: if pixel == 777 { brightest } else { 1.0 },
                weight: 0.5,
                camera_only: 0.6,
                caustic,
                connected: pixel % 2 == 0,
                plain: if pixel % 2 == 0 { 0.25 } else { 1.0 },
                departures: 0..0,
            });
            let path = &paths.paths[pixel as usize];
            paths.blocks[path.block] += path.added;
        }
        paths.moments().remove(0)
    }

    #[test]
    fn a_bright_path_counts_no_more_than_its_block() {
        // Each of 256 blocks has 12 paths, so that each path adds 1/12² over 1 + FLOOR²; one alone adds at most 1.
        let (even, bright) = (moments(1.0, true).all, moments(1e6, true).all);
        assert!((even - 256.0 / 12.0 / (1.0 + FLOOR * FLOOR)).abs() < 1e-9, "{even}");
        assert!(bright < even, "{bright} instead of {even}");
    }

    #[test]
    fn what_is_left_out_adds_what_its_weight_says() {
        let m = moments(1.0, true);
        assert!((m.unconnected / m.all - 1.0).abs() < 1e-9, "half of the density: twice the moment");
        assert!((m.unaimed / m.all - (1.0 / 0.625 - 1.0)).abs() < 1e-9, "a quarter of a half of it");
        let [caustics, others] = m.by_number;
        assert!((caustics[3] / caustics[0] - 1.0 / (0.6 + 0.4 / 8.0)).abs() < 1e-9, "an eighth of 0.4 of it");
        assert_eq!(others, [0.0; 4]);
    }

    #[test]
    fn other_light_is_no_part_of_the_caustics() {
        let m = moments(1.0, false);
        assert_eq!((m.all, m.unconnected, m.unaimed), (0.0, 0.0, 0.0));
        assert_eq!(m.by_number[0], [0.0; 4]);
        assert_eq!(m.by_number[1], moments(1.0, true).by_number[0]);
    }
}
