//! What leaving a technique out would cost, from paths of all techniques.
//!
//! It can be read off the weights. A path of value `f` that all techniques together sample with density `p`, of which
//! some have the share `w`, adds `f²/p` to the second moment of the balance heuristic. If these sampled it `r` times
//! as often, it would add `f²/(p (1 - w + r w))`; without caustic connections `r = 0`, without aim it is the ratio of
//! the densities of what the light subpath drew. So sums over the samples of all techniques estimate second moments of
//! renders that are never made (compare Grittmann et al. 2022): the paths of the techniques in question alone suffice, as
//! `∫ w p f²/(p² (1 - w)) = ∫ f²/(p (1 - w)) - ∫ f²/p`. `w` is that of the one technique that made the path, which errs on
//! the side of leaving out. (Rough glass that is walked through would be evaluated instead, which the estimate does
//! not know.)
//!
//! With `r` times as many light subpaths, all techniques that need one have `r` times their density, in any weights: what
//! a path adds is divided by `1 - w + r w`, `w` the share of these techniques, and those that they made are so many fewer.
//!
//! What a search found after `n` attempts counts `n` times, and has its weight `w` by a presumed probability `c`: it is one
//! of `n c` that the weights know of. With `p_o` the density of all others, which alone add `f²/p_o`, and a share `q` of the
//! searches, whose paths are so much more seldom, count `1/q` times and weigh `v = q w / (q w + 1 - w)`, the others add
//! `f² (1 - v)²/p_o`. The difference, `f² v (2 - v)/p_o`, is saved, and what searches themselves add is lost, which is much
//! where many attempts are needed.
//!
//! All but the number of light subpaths is told for the balance heuristic. Where the weights are not its own, for direct
//! light in the light image ([`light_image`]), a path counts with what it would have weighed by it.
//!
//! Errors are seen relative to what is around them. So are these: over the square of the radiance in a block of the
//! picture, which the same samples estimate, so that a single bright path, whose block it has brightened,
//! counts no more than that block.

use crate::camera::Region;
use crate::integrator::bdpt::View;
use crate::integrator::{Contribution, Observer};
use crate::transport::aim::departures;
use crate::transport::options::LAMP_SEARCH;
use crate::transport::vertex::on_path;
use crate::transport::weight::light_image;
use std::collections::BTreeMap;

/// Numbers of light subpaths per sample that are chosen from. More than one seldom brings anything: with 2 and 4 the error
/// of caustics at equal time was 1.14 and 2.2 times that with one on figure4a, 0.9 and 1.1 on eye, 1.4 and 2.6 on
/// `eye_small`, 1.06 and 1.4 on water_glass, 1.04 and 1.2 on demo.
pub(super) const NUMBERS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Blocks along each side of the picture: sixteen of 4096 samples in each. Not tuned.
const BLOCKS: u32 = 16;

/// Share of the picture's mean radiance that is added to that around a path, as in the relMSE of docs/results.md.
const FLOOR: f64 = 0.1;

/// Largest `1/(1 - w)`: a path that nothing else finds counts a million times.
const MOST: f64 = 1e6;

/// Largest `1/(1 - w)` of a connection. A path that all others sample so much more seldom is missing from most pixels of a
/// picture, and what is missing is its value once, not squared: with a few hundred samples in a pixel, for the sixteen in a
/// block of these here, about so many times its share of the moment. More of them made rare paths decide (64: lumpy, where
/// connections do not pay), fewer leave too little between that scene and sky, where they do.
const MOST_SELDOM: f64 = 16.0;

/// Second moments.
#[derive(Clone, Debug, Default)]
pub(super) struct Moments {
    /// Of caustics.
    pub(super) all: f64,
    /// By how much more without caustic connections, of each path at most [`MOST_SELDOM`] times.
    pub(super) unconnected: f64,
    /// By how much more without the chains that only other starts than the straight segment lead to.
    pub(super) unretried: f64,
    /// By how much more, or less, without searches than with as many as [`LAMP_SEARCH`] says; drawn with all.
    pub(super) unsearched: f64,
    /// By how much more without any aim.
    pub(super) unaimed: f64,
    /// By how much more without that of one class of places.
    pub(super) unaimed_from: BTreeMap<usize, f64>,
    /// With so many light subpaths as [`NUMBERS`] says: of caustics, and of other light that was reflected on its way.
    pub(super) by_number: [[f64; NUMBERS.len()]; 2],
}

impl Moments {
    fn add(&mut self, path: &Path, departures: impl Iterator<Item = (usize, f64)>) {
        let by_number = match path.light {
            Light::Caustic => &mut self.by_number[0],
            Light::Reflected => &mut self.by_number[1],
            Light::Direct => return,
        };
        let divided = |added: f64, remaining: f64| added / remaining.max(1.0 / MOST);
        for (sum, number) in by_number.iter_mut().zip(NUMBERS) {
            let densities = path.camera_only + number * (1.0 - path.camera_only);
            let drawn = if path.by_light { number } else { 1.0 };
            *sum += drawn * (path.weighted / densities).powi(2);
        }
        let added = path.added * path.added;
        if path.light != Light::Caustic {
            return;
        }
        let more = |ratio: f64| divided(added * (1.0 - ratio), 1.0 - path.weight * (1.0 - ratio));
        self.all += added;
        self.unconnected += if path.connected { more(0.0).min(added * MOST_SELDOM) } else { 0.0 };
        self.unretried += if path.retried { more(0.0) } else { 0.0 };
        if let Some(attempts) = path.searched {
            let seldom = f64::from(LAMP_SEARCH);
            let weight = seldom / (seldom * path.weight + 1.0 - path.weight);
            let others = added / attempts * weight * (2.0 - weight * path.weight);
            self.unsearched += divided(others, 1.0 - path.weight) - added * weight * weight / seldom;
        }
        self.unaimed += more(path.plain);
        for (class, plain) in departures {
            *self.unaimed_from.entry(class).or_default() += more(plain);
        }
    }

    fn add_scaled(&mut self, other: &Moments, scale: f64) {
        self.all += other.all * scale;
        self.unconnected += other.unconnected * scale;
        self.unretried += other.unretried * scale;
        self.unsearched += other.unsearched * scale;
        self.unaimed += other.unaimed * scale;
        for (class, more) in &other.unaimed_from {
            *self.unaimed_from.entry(*class).or_default() += more * scale;
        }
        for (sum, more) in self.by_number.as_flattened_mut().iter_mut().zip(other.by_number.as_flattened()) {
            *sum += more * scale;
        }
    }
}

/// What a path brings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    Caustic,
    /// Other light that was reflected on its way.
    Reflected,
    /// Light from a lamp to what the camera sees: next to no noise.
    Direct,
}

/// A path that a technique made.
struct Path {
    /// What it adds to the image.
    weighted: f64,
    /// Weight of the techniques that need no light subpath, of which its own may be none.
    camera_only: f64,
    by_light: bool,
    /// What it would add by the balance heuristic, and its weight by that.
    added: f64,
    weight: f64,
    light: Light,
    connected: bool,
    /// Whether its chain was found from another start.
    retried: bool,
    /// If a search found its chain: the number of its attempts, times the probability that is presumed of it.
    searched: Option<f64>,
    /// Density of its light subpath without aim, over that with it.
    plain: f64,
}

/// Paths of a group of samples.
pub(super) struct Paths<'v> {
    view: &'v View,
    caustics_only: bool,
    /// Of each block: the sum of what was added to it, and its pixels.
    blocks: Vec<[f64; 2]>,
    /// Of each block, relative to nothing.
    moments: Vec<Moments>,
    /// What was added, but for lights that the camera sees, perhaps through glass: they have no
    /// noise, however bright, and no say in what is too much of it.
    pub(super) light: f32,
}

impl Paths<'_> {
    pub(super) fn new(view: &View, caustics_only: bool) -> Paths<'_> {
        let pixels = |n: u32| {
            let mut all = vec![0.0; BLOCKS.min(n) as usize];
            (0..n).for_each(|i| all[along(i, n)] += 1.0);
            all
        };
        let columns = pixels(view.region.width);
        let rows = pixels(view.region.height);
        let blocks: Vec<_> = rows.iter().flat_map(|rows| columns.iter().map(move |n| [0.0, rows * n])).collect();
        let moments = vec![Moments::default(); blocks.len()];
        Paths { view, caustics_only, blocks, moments, light: 0.0 }
    }

    fn block(&self, pixel: u32) -> usize {
        let Region { width, height, .. } = self.view.region;
        along(pixel / width, height) * BLOCKS.min(width) as usize + along(pixel % width, width)
    }

    fn add(&mut self, pixel: u32, path: &Path, departures: impl Iterator<Item = (usize, f64)>) {
        let block = self.block(pixel);
        self.blocks[block][0] += path.weighted;
        self.moments[block].add(path, departures);
    }
}

/// The moments of each group, relative to the radiance around, which all of them together tell: for groups of equal size,
/// whatever their number.
pub(super) fn relative<'g>(groups: impl Iterator<Item = &'g Paths<'g>> + Clone) -> Vec<Moments> {
    let Some(first) = groups.clone().next() else { return Vec::new() };
    let mut blocks = first.blocks.clone();
    for other in groups.clone().skip(1) {
        for (block, more) in blocks.iter_mut().zip(&other.blocks) {
            block[0] += more[0];
        }
    }
    let number = groups.clone().count() as f64;
    blocks.iter_mut().for_each(|block| block[0] /= number);
    let [light, pixels] = blocks.iter().fold([0.0; 2], |sum, b| [sum[0] + b[0], sum[1] + b[1]]);
    let group = |group: &Paths| {
        let mut all = Moments::default();
        for (m, [around, n]) in group.moments.iter().zip(&blocks) {
            // The square of the radiance around, in units of what a group's samples add up to in a block of usual size.
            let size = pixels / blocks.len() as f64;
            let square = (around / n * size).powi(2) + (FLOOR * light / pixels * size).powi(2);
            if square > 0.0 {
                all.add_scaled(m, 1.0 / square);
            }
        }
        all
    };
    groups.map(group).collect()
}

/// The factor of the light image in the weights of a path.
fn image(c: &Contribution) -> f64 {
    let hit = c.hit.map(|hit| hit.edge.sure);
    let last = hit.or(c.chain.filter(|_| c.s == 1).map(|chain| chain.sure()));
    let sure = last.or(c.light.last().map(|vertex| vertex.edge.sure)).unwrap_or(true);
    light_image(sure && on_path(c.camera).count() + on_path(c.light).count() == 1)
}

/// The weight by the balance heuristic over that which a path has from a technique. A path with a factor has but one
/// that needs a light subpath, the light image.
fn balanced(camera_only: f64, image: f64, in_image: bool) -> f64 {
    let densities = camera_only + (1.0 - camera_only) / image;
    1.0 / (densities * if in_image { image } else { 1.0 })
}

/// The block of row or column `i` of `n`.
fn along(i: u32, n: u32) -> usize {
    (u64::from(i) * u64::from(BLOCKS.min(n)) / u64::from(n)) as usize
}

impl Observer for Paths<'_> {
    fn observe(&mut self, c: &Contribution) {
        let added = c.weighted.max_element();
        if !(added > 0.0 && added.is_finite()) || (c.camera.is_empty() && c.light.is_empty()) {
            return;
        }
        self.light += added;
        let light = match () {
            () if c.is_caustic() => Light::Caustic,
            () if c.s + c.t <= 3 => Light::Direct,
            () => Light::Reflected,
        };
        if light == Light::Caustic || !self.caustics_only {
            let share = balanced(c.camera_only, image(c), c.t == 1);
            let path = Path {
                weighted: added.into(),
                camera_only: c.camera_only,
                by_light: c.s > 1,
                added: f64::from(added) * share,
                weight: c.weight * share,
                light,
                connected: c.chain.is_some(),
                retried: c.chain.is_some_and(|chain| chain.retried),
                searched: c.chain.filter(|chain| chain.searched).map(|c| f64::from(c.attempt) * c.presumed),
                plain: c.light.last().map_or(1.0, |vertex| vertex.plain),
            };
            self.add(c.pixel, &path, departures(c.start, c.light));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::scene::description;
    use glam::DAffine3;

    /// One path in each pixel of a group, one of them brighter; by two techniques in turn, as their weights are equal.
    fn moments(width: u32, height: u32, brightest: f64, light: Light) -> Moments {
        in_groups(1, width, height, brightest, light).remove(0)
    }

    /// Those of so many groups of the same.
    fn in_groups(number: usize, width: u32, height: u32, brightest: f64, light: Light) -> Vec<Moments> {
        let projection = description::Projection::Perspective { yfov: 1.0 };
        let camera = description::Camera::new("", DAffine3::IDENTITY, projection);
        let region = Region::all(width, height);
        let camera = Camera::new(&camera, width, height, region);
        let view = View { camera, medium: Some(0), columns: width, region };
        let mut paths = Paths::new(&view, false);
        for pixel in 0..width * height {
            let connected = pixel % 2 == 0;
            let path = Path {
                weighted: if pixel == 777 { brightest } else { 1.0 },
                camera_only: 0.6,
                by_light: connected,
                added: if pixel == 777 { brightest } else { 1.0 },
                weight: 0.5,
                light,
                connected,
                retried: pixel % 4 == 0,
                searched: (pixel % 8 == 0).then_some(3.0),
                plain: if connected { 0.25 } else { 1.0 },
            };
            paths.add(pixel, &path, std::iter::once((3, path.plain)));
        }
        relative(std::iter::repeat_n(&paths, number))
    }

    #[test]
    fn groups_weigh_the_same_whatever_their_number() {
        let one = moments(64, 64, 9.0, Light::Caustic);
        for group in in_groups(3, 64, 64, 9.0, Light::Caustic) {
            assert!((group.all / one.all - 1.0).abs() < 1e-12, "{} instead of {}", group.all, one.all);
        }
    }

    #[test]
    fn weights_are_brought_back_to_the_balance_heuristic() {
        let ([hit, next_event, splat], image) = ([0.3, 2.0, 5.0], 0.1);
        let (factored, balance) = (hit + next_event + image * splat, hit + next_event + splat);
        let camera_only = (hit + next_event) / factored;
        for (own, in_image) in [(hit, false), (next_event, false), (splat, true)] {
            let weight = own * if in_image { image } else { 1.0 } / factored;
            let share = balanced(camera_only, image, in_image);
            assert!((weight * share - own / balance).abs() < 1e-12);
        }
    }

    #[test]
    fn a_bright_path_counts_no_more_than_its_block() {
        // Each of 256 blocks has 12 paths, so that each path adds 1/12² over 1 + FLOOR²; one alone adds at most 1.
        let (even, bright) = (moments(64, 48, 1.0, Light::Caustic).all, moments(64, 48, 1e6, Light::Caustic).all);
        assert!((even - 256.0 / 12.0 / (1.0 + FLOOR * FLOOR)).abs() < 1e-9, "{even}");
        assert!(bright < even, "{bright} instead of {even}");
    }

    #[test]
    fn what_is_left_out_adds_what_its_weight_says() {
        let m = moments(64, 48, 1.0, Light::Caustic);
        assert!((m.unconnected / m.all - 1.0).abs() < 1e-9, "half of the density: twice the moment");
        assert!((m.unretried / m.all - 0.5).abs() < 1e-9, "of half of these");
        // An eighth of the paths, each found after three attempts, so by a third of the searches: of all, and of a share.
        let (attempts, presumed, others, share) = (3.0, 1.0, 1.0, f64::from(LAMP_SEARCH));
        let value = 1.0 / (attempts * 0.5); // which weighs a half
        let weight = share * presumed / (share * presumed + others);
        let by_others = |weight: f64| (value * (1.0 - weight)).powi(2) / others;
        let by_searches = (value * weight * attempts / share).powi(2) * share / attempts;
        let saved = (by_others(0.0) - by_others(weight) - by_searches) * attempts;
        assert!((m.unsearched / m.all - saved / 8.0).abs() < 1e-9, "{} and {saved}", m.unsearched / m.all);
        assert!((m.unaimed / m.all - (1.0 / 0.625 - 1.0)).abs() < 1e-9, "a quarter of a half of it");
        assert_eq!(m.unaimed_from, BTreeMap::from([(3, m.unaimed)]));
        let [caustics, others] = m.by_number;
        let fewer = (1.0 + 1.0 / 8.0) / 2.0 / f64::powi(0.6 + 0.4 / 8.0, 2);
        assert!((caustics[3] / caustics[0] - fewer).abs() < 1e-9, "an eighth of 0.4 of it, and of half of the paths");
        assert_eq!(others, [0.0; 4]);
    }

    #[test]
    fn other_light_is_no_part_of_the_caustics() {
        let m = moments(64, 48, 1.0, Light::Reflected);
        assert_eq!((m.all, m.unconnected, m.unaimed), (0.0, 0.0, 0.0));
        assert_eq!(m.by_number[0], [0.0; 4]);
        assert_eq!(m.by_number[1], moments(64, 48, 1.0, Light::Caustic).by_number[0]);
    }

    #[test]
    fn light_from_a_lamp_brightens_and_no_more() {
        assert_eq!(moments(64, 48, 1.0, Light::Direct).by_number, [[0.0; 4]; 2]);
    }

    #[test]
    fn blocks_of_any_size_have_the_radiance_of_their_pixels() {
        // An even picture: as many paths in a block of usual size as there are pixels in it.
        for (width, height) in [(1, 1), (3, 1), (17, 16), (100, 7), (1, 1000)] {
            let m = moments(width, height, 1.0, Light::Caustic);
            let blocks = f64::from(width.min(BLOCKS) * height.min(BLOCKS));
            let usual = f64::from(width * height) / blocks;
            let expected = f64::from(width * height) / (usual * usual * (1.0 + FLOOR * FLOOR));
            assert!((m.all / expected - 1.0).abs() < 1e-9, "{width}x{height}: {} instead of {expected}", m.all);
        }
    }
}
