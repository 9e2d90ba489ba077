//! Lights at finite places, chosen for a receiver by flux over squared distance, in a binary tree over their boxes
//! (Conty Estevez and Kulla 2018). Without their bounds of orientation: a connection through glass leaves a light in
//! another direction than the straight line's.

use glam::Vec3;

/// A light as the tree sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) light: u32,
    /// Positive.
    pub(super) flux: f64,
    /// Corners of its box.
    pub(super) low: Vec3,
    pub(super) high: Vec3,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Of the box of its lights.
    center: Vec3,
    /// Half of the box's diagonal.
    radius: f32,
    /// Of all its lights.
    flux: f64,
    parent: u32,
    below: Below,
}

#[derive(Clone, Copy, Debug)]
enum Below {
    Light(u32),
    /// The first of two nodes.
    Pair(u32),
}

/// Two or more lights.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// The root first.
    nodes: Vec<Node>,
    /// The leaf of each light; of one that is not in the tree, the root.
    leaves: Vec<u32>,
}

/// Squared distance below which all lights are as near; its inverse and the sum of two such are finite.
const LEAST_SQUARE: f64 = 1e-300;

impl Tree {
    /// Over some of `lights` lights.
    pub(super) fn new(mut places: Vec<Place>, lights: usize) -> Tree {
        let mut nodes = Vec::with_capacity(2 * places.len() - 1);
        let mut leaves = vec![0; lights];
        nodes.push(node(&places, 0));
        // Node, and its lights as a range of places.
        let mut open = vec![(0, 0..places.len())];
        while let Some((i, range)) = open.pop() {
            let here = &mut places[range.clone()];
            if let [place] = here {
                nodes[i].below = Below::Light(place.light);
                leaves[place.light as usize] = i as u32;
                continue;
            }
            // Halves keep the depth at the logarithm of the number.
            let (low, high) = bounds(here.iter().map(|p| (middle(p), middle(p))));
            let axis = (high - low).max_position();
            let half = here.len() / 2;
            here.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
            let first = nodes.len();
            nodes[i].below = Below::Pair(first as u32);
            nodes.push(node(&here[..half], i));
            nodes.push(node(&here[half..], i));
            open.push((first, range.start..range.start + half));
            open.push((first + 1, range.start + half..range.end));
        }
        Tree { nodes, leaves }
    }

    /// A light for a uniform number in `[0, 1)`.
    #[inline]
    pub(super) fn sample(&self, receiver: Vec3, mut u: f64) -> u32 {
        let mut below = self.nodes[0].below;
        loop {
            let first = match below {
                Below::Light(light) => return light,
                Below::Pair(first) => first,
            };
            let share = self.share(first, receiver);
            let right = u >= share;
            u = if right { (u - share) / (1.0 - share) } else { u / share };
            below = self.nodes[first as usize + usize::from(right)].below;
        }
    }

    /// The probability of a light; `None` if it is not in the tree.
    #[inline]
    pub(super) fn probability(&self, receiver: Vec3, light: u32) -> Option<f64> {
        let mut i = self.leaves[light as usize];
        if i == 0 {
            return None;
        }
        let mut probability = 1.0;
        while i != 0 {
            let parent = self.nodes[i as usize].parent;
            let Below::Pair(first) = self.nodes[parent as usize].below else { break };
            let share = self.share(first, receiver);
            probability *= if i == first { share } else { 1.0 - share };
            i = parent;
        }
        Some(probability)
    }

    /// Probability of the first node of a pair.
    #[inline]
    fn share(&self, first: u32, receiver: Vec3) -> f64 {
        let importance = |node: &Node| {
            let square = node.center.as_dvec3().distance_squared(receiver.as_dvec3());
            node.flux / square.max(f64::from(node.radius).powi(2)).max(LEAST_SQUARE)
        };
        let (a, b) = (importance(&self.nodes[first as usize]), importance(&self.nodes[first as usize + 1]));
        // Both may be too small for a number.
        if a + b > 0.0 { a / (a + b) } else { 0.5 }
    }
}

fn middle(place: &Place) -> Vec3 {
    0.5 * place.low + 0.5 * place.high
}

fn bounds(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> (Vec3, Vec3) {
    boxes.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (l, h)| (low.min(l), high.max(h)))
}

/// One over these lights, whose `below` is not known yet.
fn node(places: &[Place], parent: usize) -> Node {
    let (low, high) = bounds(places.iter().map(|p| (p.low, p.high)));
    let half = 0.5 * high - 0.5 * low;
    Node {
        center: low + half,
        radius: half.as_dvec3().length() as f32,
        flux: places.iter().map(|p| p.flux).sum(),
        parent: parent as u32,
        below: Below::Pair(0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Sampler, Stream};

    fn point(light: u32, flux: f64, at: Vec3) -> Place {
        Place { light, flux, low: at, high: at }
    }

    /// What it claims to choose is what it chooses, and by the inverse square of the distance.
    #[test]
    fn two_lights() {
        let tree = Tree::new(vec![point(0, 1.0, Vec3::ZERO), point(2, 0.5, Vec3::X)], 3);
        assert_eq!(tree.probability(Vec3::ZERO, 1), None);
        let near_second = Vec3::new(0.75, 0.0, 0.0);
        // 1/0.75² and 0.5/0.25².
        let expected = (1.0 / 0.5625) / (1.0 / 0.5625 + 8.0);
        assert!((tree.probability(near_second, 0).unwrap() - expected).abs() < 1e-12);
        assert!((tree.probability(near_second, 2).unwrap() - (1.0 - expected)).abs() < 1e-12);
        assert_eq!(tree.sample(near_second, expected - 1e-9), 0);
        assert_eq!(tree.sample(near_second, expected + 1e-9), 2);
    }

    #[test]
    fn lights_are_chosen_as_often_as_claimed() {
        let mut random = Sampler::new(1, 0, 0, Stream::Light);
        let mut place = || Vec3::new(random.next_1d(), random.next_1d(), random.next_1d());
        for n in [2, 3, 7, 50] {
            let places: Vec<_> = (0..n)
                .map(|light| {
                    let (low, size) = (place(), 0.1 * place());
                    Place { light, flux: f64::from(place().x) + 0.01, low, high: low + size }
                })
                .collect();
            let tree = Tree::new(places, n as usize);
            for receiver in [place(), 10.0 * place()] {
                let mut chosen = vec![0u32; n as usize];
                let steps = 1 << 16;
                for step in 0..steps {
                    let u = (f64::from(step) + 0.5) / f64::from(steps);
                    chosen[tree.sample(receiver, u) as usize] += 1;
                }
                for (light, times) in (0..).zip(chosen) {
                    let claimed = tree.probability(receiver, light).unwrap();
                    let found = f64::from(times) / f64::from(steps);
                    assert!((claimed - found).abs() < 2.0 / f64::from(steps), "{light} of {n}: {claimed}, {found}");
                }
            }
        }
    }

    /// Lights at one place, a receiver on a light, fluxes and distances at the ends of their range.
    #[test]
    fn extremes() {
        for (places, receiver) in [
            (vec![point(0, 1.0, Vec3::ONE), point(1, 1.0, Vec3::ONE), point(2, 1.0, Vec3::ONE)], Vec3::ONE),
            (vec![point(0, 1e-300, Vec3::ZERO), point(1, 1e-300, Vec3::X)], Vec3::splat(1e30)),
            (vec![point(0, 1e300, Vec3::ZERO), point(1, 1e-300, Vec3::X)], Vec3::X),
            (vec![point(0, 1.0, Vec3::splat(-1e38)), point(1, 1.0, Vec3::splat(1e38))], Vec3::ZERO),
        ] {
            let n = places.len();
            let tree = Tree::new(places, n);
            let sum: f64 = (0..n as u32).map(|light| tree.probability(receiver, light).unwrap()).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{sum}");
            for u in [0.0, 0.5, 1.0 - f64::EPSILON] {
                assert!(tree.probability(receiver, tree.sample(receiver, u)) > Some(0.0));
            }
        }
    }
}
