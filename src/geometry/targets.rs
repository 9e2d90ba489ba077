//! Directions toward glass: a few spheres around it, and the cones under which a place sees them; for parallel light, the
//! disks in which it meets them.

use super::BoundingDisk;
use crate::math::{Frame, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Spheres at most: each is looked at for every density. Not tuned.
const MOST: usize = 16;

/// Things of which it is asked whether they are inside another, which takes the square of their number. Not tuned.
const NESTED: usize = 256;

/// Longest side over shortest of a box that one sphere covers well enough. Not tuned.
const COMPACT: f64 = 1.5;

/// Squared sines of the half-angles of cones, and areas of disks over that of the scene's. Of narrower ones f32 loses more than one direction in 50 000 to rounding;
/// wider ones are nearly half of space, as for a place on the sphere.
const SMALLEST: f64 = 1e-6;
const LARGEST: f64 = 0.999;

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Target {
    center: DVec3,
    radius: f64,
}

/// A box, and the radius of a sphere about its middle that holds what is in it.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    radius: f64,
}

impl Bounds {
    fn new(low: DVec3, high: DVec3) -> Bounds {
        Bounds { low, high, radius: 0.5 * (high - low).length() }
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    fn within(&self, other: &Bounds) -> bool {
        self.low.cmpge(other.low).all() && self.high.cmple(other.high).all()
    }
}

/// Spheres around things.
#[derive(Clone, Debug, Default)]
pub struct Targets(Vec<Target>);

impl Targets {
    /// Around things given by the lower and upper corners of their boxes and the radii of spheres about the middles
    /// of these.
    pub fn new(things: impl IntoIterator<Item = (Vec3, Vec3, f32)>) -> Targets {
        let bounds = |(low, high, radius): (Vec3, Vec3, f32)| {
            let corners = Bounds::new(low.as_dvec3(), high.as_dvec3());
            Bounds { radius: corners.radius.min(f64::from(radius)), ..corners }
        };
        let all: Vec<Bounds> = things.into_iter().map(bounds).collect();
        // What is inside another box, like water in a glass, is aimed at with it; of equal boxes, the first is kept.
        // Of very many, it would take too long to find out.
        let outer_of = |(i, b): (usize, &Bounds)| {
            let holds = |(j, other): (usize, &Bounds)| j != i && b.within(other) && (j < i || !other.within(b));
            if all.len() > NESTED { None } else { all.iter().enumerate().position(holds) }
        };
        let mut outer = Vec::new();
        for (_, b) in all.iter().enumerate().filter(|&it| outer_of(it).is_none()) {
            let inner = all.iter().filter(|other| all.len() <= NESTED && other.within(b));
            let reach = |radius: f64, other: &Bounds| radius.max(b.middle().distance(other.middle()) + other.radius);
            outer.push(Bounds { radius: inner.fold(b.radius, reach).min(Bounds::new(b.low, b.high).radius), ..*b });
        }
        let mut targets = Vec::new();
        if !outer.is_empty() {
            cover(&outer, MOST, &mut targets);
        }
        Targets(targets)
    }

    /// Vectors from `from` to the centres of the spheres that are in reach, but not around it, with the squared
    /// sines of the half-angles of their cones.
    #[inline]
    fn seen(&self, from: DVec3, reach: &Reach) -> impl Iterator<Item = (DVec3, f64)> {
        self.0.iter().filter_map(move |t| {
            let to = t.center - from;
            let sin2 = t.radius * t.radius / to.length_squared();
            (sin2 < LARGEST && sin2 > SMALLEST && reach.has(to, t.radius)).then_some((to, sin2))
        })
    }

    /// Sum of the squared sines, by which one of the cones is chosen: 0 where nothing is in reach.
    #[inline]
    pub fn total(&self, from: Vec3, reach: &Reach) -> f64 {
        self.seen(from.as_dvec3(), reach).map(|(_, sin2)| sin2).sum()
    }

    /// A direction in one of the cones, which `u_cone` chooses; `None` where rounding puts it outside, where its density
    /// would be another.
    pub fn sample(&self, from: Vec3, reach: &Reach, total: f64, u_cone: f32, u: Vec2) -> Option<Vec3> {
        let mut left = f64::from(u_cone) * total;
        let mut chosen = None;
        for (to, sin2) in self.seen(from.as_dvec3(), reach) {
            chosen = Some((to, sin2));
            left -= sin2;
            if left < 0.0 {
                break;
            }
        }
        let (to, sin2) = chosen?;
        let local = warp::cone(u, one_minus_cos(sin2) as f32);
        let direction = Frame::around(to.normalize().as_vec3()).to_world(local).normalize();
        within(direction.as_dvec3().normalize(), to, sin2).then_some(direction)
    }

    /// Density of a unit direction per solid angle.
    #[inline]
    pub fn density(&self, from: Vec3, reach: &Reach, total: f64, direction: Vec3) -> f64 {
        let (from, direction) = (from.as_dvec3(), direction.as_dvec3().normalize());
        let mut sum = 0.0;
        for t in &self.0 {
            let to = t.center - from;
            // Most cones have not got it: their sines are left alone.
            let along = direction.dot(to);
            let (d2, r2) = (to.length_squared(), t.radius * t.radius);
            if along > 0.0 && along * along > 0.999_999 * (d2 - r2) {
                let sin2 = r2 / d2;
                if sin2 < LARGEST && sin2 > SMALLEST && within(direction, to, sin2) && reach.has(to, t.radius) {
                    sum += sin2 / (2.0 * PI * one_minus_cos(sin2));
                }
            }
        }
        sum / total
    }
}

/// For light from infinity, of any direction: it passes the scene's disk, and the disks of spheres.
impl Targets {
    /// Spheres that parallel light meets in a part of the scene's disk, neither nearly all of it nor so small that rounding
    /// tells.
    #[inline]
    fn met(&self, scene: &BoundingDisk) -> impl Iterator<Item = &Target> {
        let radius2 = scene.radius().powi(2);
        self.0.iter().filter(move |t| (SMALLEST..LARGEST).contains(&(t.radius * t.radius / radius2)))
    }

    /// Sum of the areas of the disks, by which one of them is chosen: 0 where there are none.
    #[inline]
    pub fn total_parallel(&self, scene: &BoundingDisk) -> f64 {
        self.met(scene).map(|t| PI * t.radius * t.radius).sum()
    }

    /// Where a ray along `direction`, unit, starts: on the scene's disk, before one of the spheres', which `u_disk` chooses;
    /// `None` where rounding puts it beside.
    pub fn sample_parallel(
        &self,
        scene: &BoundingDisk,
        direction: Vec3,
        total: f64,
        u_disk: f32,
        u: Vec2,
    ) -> Option<Vec3> {
        let mut left = f64::from(u_disk) * total;
        let mut chosen = None;
        for t in self.met(scene) {
            chosen = Some(t);
            left -= PI * t.radius * t.radius;
            if left < 0.0 {
                break;
            }
        }
        let t = chosen?;
        let across = Frame::around(direction).to_world(warp::disk(u).extend(0.0)).as_dvec3() * t.radius;
        let origin = scene.before(t.center + across, direction);
        meets(t, origin, direction).then_some(origin)
    }

    /// Density of a ray along `direction` through a place, per area perpendicular to it.
    #[inline]
    pub fn density_parallel(&self, scene: &BoundingDisk, direction: Vec3, total: f64, through: Vec3) -> f64 {
        self.met(scene).filter(|t| meets(t, through, direction)).count() as f64 / total
    }
}

/// Whether the line through a place along `direction`, unit, meets a sphere.
#[inline]
fn meets(t: &Target, through: Vec3, direction: Vec3) -> bool {
    let (to, d) = (t.center - through.as_dvec3(), direction.as_dvec3());
    // Of a direction in f32, whose length is 1 to within 1e-7.
    let across2 = to.length_squared() - to.dot(d).powi(2) / d.length_squared();
    across2 <= t.radius * t.radius
}

/// Whether a unit direction is in the cone around `to` with that squared sine of its half-angle.
#[inline]
fn within(direction: DVec3, to: DVec3, sin2: f64) -> bool {
    let along = direction.dot(to);
    along > 0.0 && along * along >= to.length_squared() * (1.0 - sin2)
}

/// What a place can light: a cone, which may be half of space or all of it.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    axis: DVec3,
    sin: f64,
    cos: f64,
}

impl Reach {
    /// Everything.
    pub const ALL: Reach = Reach { axis: DVec3::ZERO, sin: 1.0, cos: 0.0 };

    /// All above the plane with that normal.
    #[inline]
    pub fn above(normal: Vec3) -> Reach {
        Reach { axis: normal.as_dvec3(), ..Reach::ALL }
    }

    /// A cone around the unit vector `axis`, with the cosine of its half-angle, of at most 90 degrees.
    #[inline]
    pub fn cone(axis: DVec3, cos: f64) -> Reach {
        Reach { axis, sin: (1.0 - cos * cos).max(0.0).sqrt(), cos }
    }

    /// Whether a part of a sphere is in it, by the vector to the centre and the radius.
    #[inline]
    fn has(&self, to: DVec3, radius: f64) -> bool {
        let along = self.axis.dot(to);
        let across = if self.cos == 0.0 { 0.0 } else { (to.length_squared() - along * along).max(0.0).sqrt() };
        // Signed distance from the cone's surface.
        across * self.cos - along * self.sin < radius
    }
}

/// Of a cone, by the squared sine of its half-angle.
#[inline]
fn one_minus_cos(sin2: f64) -> f64 {
    sin2 / (1.0 + (1.0 - sin2).sqrt())
}

/// Covers boxes with at most `most` spheres: halves what is longest, until it is as high as long.
fn cover(boxes: &[Bounds], most: usize, targets: &mut Vec<Target>) {
    let low = boxes.iter().fold(DVec3::INFINITY, |low, b| low.min(b.low));
    let high = boxes.iter().fold(DVec3::NEG_INFINITY, |high, b| high.max(b.high));
    let extent = high - low;
    let axis = extent.max_position();
    let compact = boxes.len() == 1 && extent[axis] <= COMPACT * extent.min_element();
    if most < 2 || compact || !(extent[axis] > 0.0) {
        let radius = if boxes.len() == 1 { boxes[0].radius } else { 0.5 * extent.length() };
        targets.push(Target { center: 0.5 * (low + high), radius });
        return;
    }
    let middle = 0.5 * (low[axis] + high[axis]);
    let below = boxes.iter().filter(|b| b.low[axis] < middle).map(|b| {
        let mut high = b.high;
        high[axis] = high[axis].min(middle);
        if high == b.high { *b } else { Bounds::new(b.low, high) }
    });
    let above = boxes.iter().filter(|b| b.high[axis] > middle).map(|b| {
        let mut low = b.low;
        low[axis] = low[axis].max(middle);
        if low == b.low { *b } else { Bounds::new(low, b.high) }
    });
    for side in [below.collect::<Vec<_>>(), above.collect()] {
        if !side.is_empty() {
            cover(&side, most / 2, targets);
        }
    }
}

/// Targets, and how often light is sent toward them, by the number of the light or of the shape that it leaves.
#[derive(Clone, Debug)]
pub struct Aim {
    targets: Arc<Targets>,
    shares: Arc<[f32]>,
}

impl Aim {
    /// The shares, below 1, by number.
    pub fn new(targets: Arc<Targets>, shares: impl Into<Arc<[f32]>>) -> Aim {
        Aim { targets, shares: shares.into() }
    }

    /// The share of a light or shape.
    #[inline]
    pub fn share(&self, of: u32) -> f32 {
        self.shares.get(of as usize).copied().unwrap_or(0.0)
    }

    /// What is aimed at.
    #[inline]
    pub fn targets(&self) -> &Targets {
        &self.targets
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Sampler, Stream};

    fn random(seed: u64) -> Sampler {
        Sampler::new(seed, 0, 0, Stream::Light)
    }

    fn point(s: &mut Sampler, low: Vec3, high: Vec3) -> Vec3 {
        low + (high - low) * Vec3::new(s.next_1d(), s.next_1d(), s.next_1d())
    }

    /// A pane, a pebble in another's box, a rod, a thing as round as its radius says.
    fn things(scale: f32) -> Vec<(Vec3, Vec3, f32)> {
        let boxes = [
            (Vec3::new(-2.0, 1.0, -1.5), Vec3::new(2.0, 1.02, 1.5), 9.0),
            (Vec3::new(3.0, 0.0, 0.0), Vec3::new(4.0, 1.0, 1.0), 0.5),
            (Vec3::new(3.2, 0.2, 0.2), Vec3::new(3.8, 0.8, 0.8), 9.0),
            (Vec3::new(-3.0, -2.0, 0.0), Vec3::new(3.0, -1.9, 0.1), 9.0),
        ];
        boxes.map(|(low, high, radius)| (low * scale, high * scale, radius * scale)).to_vec()
    }

    #[test]
    fn few_spheres_cover_what_is_in_the_boxes() {
        let mut s = random(1);
        for scale in [1e-6, 1.0, 1e6] {
            let targets = Targets::new(things(scale));
            assert!(targets.0.len() <= MOST && targets.0.len() > 4, "{}", targets.0.len());
            for _ in 0..2000 {
                for (low, high, radius) in things(scale) {
                    let p = point(&mut s, low, high);
                    if p.distance(0.5 * (low + high)) > radius {
                        continue;
                    }
                    let covers = |t: &Target| p.as_dvec3().distance(t.center) < t.radius * (1.0 + 1e-6);
                    assert!(targets.0.iter().any(covers), "{p} of {low} to {high}");
                }
            }
        }
        let many = (0..1000).map(|i| (Vec3::splat(i as f32), Vec3::splat(i as f32 + 0.5), 9.0));
        assert!(Targets::new(many).0.len() <= MOST);
        assert!(Targets::new([]).0.is_empty());
    }

    #[test]
    fn one_sphere_stands_for_equal_boxes_and_what_is_in_them() {
        let cube = (Vec3::ZERO, Vec3::ONE, 0.6);
        let inner = (Vec3::splat(0.1), Vec3::splat(0.9), 0.4);
        assert_eq!(
            Targets::new([inner, cube, cube, inner]).0,
            [Target { center: DVec3::splat(0.5), radius: f64::from(0.6f32) }]
        );
    }

    /// The mean of `g/density` over drawn directions against the integral of `g` where there is density, at 4.5
    /// standard errors: by chance in one of 5000 runs of this test.
    #[test]
    fn directions_follow_their_density() {
        let g = |w: Vec3| f64::from((1.5 + w.x + w.y * w.z) * (1.0 + w.z).powi(2));
        let n = 40_000;
        for scale in [1e-6f32, 1.0, 1e6] {
            let targets = Targets::new(things(scale));
            let cone = Reach::cone(DVec3::new(0.6, 0.0, 0.8), 0.7);
            let reaches = [Reach::ALL, Reach::above(Vec3::new(0.0, 0.6, 0.8)), cone];
            let places = [Vec3::new(0.3, 3.0, 0.2), Vec3::new(0.1, 1.3, 0.2), Vec3::new(-9.0, 0.5, -20.0)];
            for (k, (reach, place)) in reaches.iter().flat_map(|s| places.map(|p| (s, p * scale))).enumerate() {
                let mut s = random(10 + k as u64);
                let total = targets.total(place, reach);
                if total == 0.0 {
                    continue;
                }
                let mut sums = [[0.0f64; 2]; 2];
                for _ in 0..n {
                    // Rounding puts a few directions outside of their cones, and these are lost.
                    let w = targets.sample(place, reach, total, s.next_1d(), s.next_2d());
                    let drawn = w.map_or(0.0, |w| {
                        let density = targets.density(place, reach, total, w);
                        assert!(density > 0.0, "{w} is in no cone");
                        g(w) / density
                    });
                    let w = warp::sphere(s.next_2d()).normalize();
                    let inside = targets.density(place, reach, total, w) > 0.0;
                    let uniform = if inside { g(w) * 4.0 * PI } else { 0.0 };
                    for (sum, x) in sums.iter_mut().zip([drawn, uniform]) {
                        *sum = [sum[0] + x, sum[1] + x * x];
                    }
                }
                let [drawn, uniform] = sums.map(|[sum, squares]| {
                    let mean = sum / f64::from(n);
                    (mean, (squares / f64::from(n) - mean * mean) / f64::from(n))
                });
                let z = (drawn.0 - uniform.0) / (drawn.1 + uniform.1).sqrt();
                assert!(z.abs() < 4.5, "scale {scale}, case {k}: {} against {}, z {z:.1}", drawn.0, uniform.0);
            }
        }
    }

    #[test]
    fn small_and_far_things_keep_their_directions() {
        const N: usize = 400_000;
        let mut s = random(5);
        for distance in [1e1f32, 1e2, 4e2] {
            let targets = Targets::new([(Vec3::splat(-0.5), Vec3::splat(0.5), 0.5)]);
            let from = Vec3::new(0.6, 0.0, 0.8) * distance;
            let total = targets.total(from, &Reach::ALL);
            let drawn = (0..N).filter(|_| {
                let w = targets.sample(from, &Reach::ALL, total, s.next_1d(), s.next_2d());
                w.inspect(|w| assert!(targets.density(from, &Reach::ALL, total, *w) > 0.0)).is_some()
            });
            let lost = N - drawn.count();
            assert!(lost < N / 10_000, "{lost} of {N} from {distance} m");
        }
    }

    #[test]
    fn from_inside_nothing_is_aimed_at() {
        let targets = Targets::new([(Vec3::splat(-1.0), Vec3::splat(1.0), 9.0)]);
        assert_eq!(targets.total(Vec3::splat(0.2), &Reach::ALL), 0.0);
        assert_eq!(targets.total(Vec3::Y * 5.0, &Reach::above(Vec3::Y)), 0.0);
        assert!(targets.total(Vec3::Y * 5.0, &Reach::above(Vec3::NEG_Y)) > 0.0);
    }
}
