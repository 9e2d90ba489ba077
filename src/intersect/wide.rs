//! A four-wide bounding volume hierarchy: built by obvhs as a binary tree (PLOC with reinsertion,
//! Meister and Bittner 2018), widened here and walked with a conservative box test.

use crate::geometry::Ray;
use crate::intersect::bounds::Bounds;
use crate::math::mix;
use glam::{Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::collections::TryReserveError;
use std::ops::ControlFlow;

/// Four children, side by side for one vector operation per plane. An absent child's box is empty.
#[derive(Clone)]
#[repr(C, align(64))]
struct Node {
    lo: [Vec4; 3],
    hi: [Vec4; 3],
    /// First primitive of a leaf, or index of an inner node.
    first: [u32; 4],
    /// Primitives of a leaf; 0 for an inner node.
    count: [u32; 4],
}

/// The tree. Empty for no primitives.
pub(crate) struct Wide {
    nodes: Vec<Node>,
}

/// Rounding of a plane's parameter `(plane - origin) / direction` in f32: three operations, each off by
/// half an ulp of it, as if the plane lay off by `1.5 * EPSILON` of its distance; the planes are moved
/// out by more than this, in units of the farthest plane's distance. That keeps boxes and rays without
/// extent in some direction from the edge of the comparison too.
const MARGIN: f32 = 2.0 * f32::EPSILON;

/// An inner node or leaf that waits, and where its box begins.
#[derive(Clone, Copy)]
struct Entry {
    t: f32,
    first: u32,
    count: u32,
}

/// Entries that fit without an allocation: three per level of a tree 42 deep.
const STACK: usize = 128;

impl Wide {
    /// The tree and the order in which its leaves number the primitives.
    pub(crate) fn build(boxes: &[Bounds]) -> Result<(Wide, Vec<u32>), TryReserveError> {
        if boxes.is_empty() {
            return Ok((Wide { nodes: Vec::new() }, Vec::new()));
        }
        let mut binary = binary(boxes)?;
        let mut order = std::mem::take(&mut binary.primitive_indices);
        order.truncate(boxes.len());
        let exact = refit(&binary, boxes, &order)?;
        let mut nodes: Vec<Node> = Vec::new();
        nodes.try_reserve(binary.nodes.len() / 2 + 1)?;
        // Every entry is a binary node to become the wide node of the same index.
        let mut open = vec![0u32];
        let mut next = 1;
        let mut at = 0;
        while at < open.len() {
            let children = widen(&binary, &exact, open[at]);
            let mut node = Node { lo: [Vec4::INFINITY; 3], hi: [Vec4::NEG_INFINITY; 3], first: [0; 4], count: [0; 4] };
            for (k, &child) in children.iter().enumerate() {
                let (b, n) = (exact[child as usize], &binary.nodes[child as usize]);
                for axis in 0..3 {
                    node.lo[axis][k] = b.lo[axis];
                    node.hi[axis][k] = b.hi[axis];
                }
                (node.first[k], node.count[k]) = if n.is_leaf() {
                    (n.first_index, n.prim_count)
                } else {
                    open.push(child);
                    next += 1;
                    (next - 1, 0)
                };
            }
            nodes.push(node);
            at += 1;
        }
        Ok((Wide { nodes }, order))
    }

    /// Bytes of the tree.
    pub(crate) fn memory(&self) -> u64 {
        (self.nodes.capacity() * size_of::<Node>()) as u64
    }

    /// Calls `test(primitive, t_max)` for every primitive whose box the segment may meet, boxes near the
    /// origin first; it returns the new end of the segment, or breaks off.
    #[inline]
    pub(crate) fn walk(&self, ray: &Ray, mut test: impl FnMut(u32, f32) -> ControlFlow<(), f32>) {
        if self.nodes.is_empty() {
            return;
        }
        // A component of 0 has a finite reciprocal here, so that 0 * inf cannot occur.
        let inverse = ray.direction.to_array().map(|d| (1.0 / d).clamp(-f32::MAX, f32::MAX));
        let origin = ray.origin.to_array();
        let mut t_max = ray.t_max;
        let mut stack = [Entry { t: 0.0, first: 0, count: 0 }; STACK];
        let mut height = 1;
        let mut spilled: Vec<Entry> = Vec::new();
        loop {
            let entry = if let Some(entry) = spilled.pop() {
                entry
            } else if height > 0 {
                height -= 1;
                stack[height]
            } else {
                return;
            };
            if entry.t > t_max {
                continue;
            }
            if entry.count > 0 {
                for i in entry.first..entry.first + entry.count {
                    match test(i, t_max) {
                        ControlFlow::Continue(t) => t_max = t,
                        ControlFlow::Break(()) => return,
                    }
                }
                continue;
            }
            let node = &self.nodes[entry.first as usize];
            let (mut met, n) = node.meet(&origin, &inverse, t_max);
            // Far boxes first onto the stack.
            met[..n].sort_unstable_by(|a, b| b.t.total_cmp(&a.t));
            for &e in &met[..n] {
                if height < STACK {
                    stack[height] = e;
                    height += 1;
                } else {
                    spilled.push(e);
                }
            }
        }
    }
}

impl Node {
    /// The children whose boxes, moved out by [`MARGIN`], the segment meets, and how many.
    #[inline]
    fn meet(&self, origin: &[f32; 3], inverse: &[f32; 3], t_max: f32) -> ([Entry; 4], usize) {
        let mut lo = [Vec4::ZERO; 3];
        let mut hi = [Vec4::ZERO; 3];
        let mut reach = Vec4::ZERO;
        for axis in 0..3 {
            lo[axis] = self.lo[axis] - origin[axis];
            hi[axis] = self.hi[axis] - origin[axis];
            reach = reach.max((-lo[axis]).max(hi[axis]));
        }
        let margin = reach * MARGIN;
        let (mut enter, mut leave) = (Vec4::ZERO, Vec4::splat(t_max));
        for axis in 0..3 {
            let (a, b) = (lo[axis] - margin, hi[axis] + margin);
            // By the sign, not by min and max: an empty box must stay empty.
            let (near, far) = if inverse[axis] < 0.0 { (b, a) } else { (a, b) };
            enter = enter.max(near * inverse[axis]);
            leave = leave.min(far * inverse[axis]);
        }
        let hit = enter.cmple(leave).bitmask();
        let mut met = [Entry { t: 0.0, first: 0, count: 0 }; 4];
        let mut n = 0;
        for k in 0..4 {
            if hit & (1 << k) != 0 {
                met[n] = Entry { t: enter[k], first: self.first[k], count: self.count[k] };
                n += 1;
            }
        }
        (met, n)
    }
}

/// obvhs's binary tree, over boxes brought into the unit cube so that its areas cannot overflow, and moved by a millionth
/// of it at random: equal boxes would be merged one by one, in quadratic time.
fn binary(boxes: &[Bounds]) -> Result<Bvh2, TryReserveError> {
    let all = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(*b));
    let (low, extent) = (all.lo.as_dvec3(), (all.hi.as_dvec3() - all.lo.as_dvec3()).max_element());
    let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
    let unit = |p: Vec3| ((p.as_dvec3() - low) * scale).as_vec3a();
    let mut scaled = Vec::new();
    scaled.try_reserve_exact(boxes.len())?;
    scaled.extend((0..).zip(boxes).map(|(i, b)| {
        let digits = mix(i);
        let moved = Vec3A::from([0, 21, 42].map(|shift| (digits >> shift & 0xfffff) as f32 * 1e-12));
        Aabb { min: unit(b.lo) + moved, max: unit(b.hi) + moved }
    }));
    let indices = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &scaled,
        indices,
        SortPrecision::U64,
        3,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, 0.05, None);
    Ok(tree)
}

/// The boxes of the binary nodes in the scene's own coordinates.
fn refit(tree: &Bvh2, boxes: &[Bounds], order: &[u32]) -> Result<Vec<Bounds>, TryReserveError> {
    let mut exact = Vec::new();
    exact.try_reserve_exact(tree.nodes.len())?;
    exact.resize(tree.nodes.len(), Bounds::EMPTY);
    // Parents before children, then the sums backwards: no recursion over the tree's depth.
    let mut top_down = vec![0u32];
    let mut at = 0;
    while at < top_down.len() {
        let node = &tree.nodes[top_down[at] as usize];
        if !node.is_leaf() {
            top_down.extend([node.first_index, node.first_index + 1]);
        }
        at += 1;
    }
    for &i in top_down.iter().rev() {
        let node = &tree.nodes[i as usize];
        let first = node.first_index as usize;
        exact[i as usize] = if node.is_leaf() {
            order[first..first + node.prim_count as usize]
                .iter()
                .fold(Bounds::EMPTY, |b, &p| b.union(boxes[p as usize]))
        } else {
            exact[first].union(exact[first + 1])
        };
    }
    Ok(exact)
}

/// Up to four descendants of a binary node that together hold what it holds: the largest are opened.
fn widen(tree: &Bvh2, exact: &[Bounds], root: u32) -> Vec<u32> {
    let node = &tree.nodes[root as usize];
    if node.is_leaf() {
        return vec![root];
    }
    let half_area = |i: u32| {
        let b = exact[i as usize];
        let e = b.hi.as_dvec3() - b.lo.as_dvec3();
        e.x * e.y + e.y * e.z + e.z * e.x
    };
    let mut children = vec![node.first_index, node.first_index + 1];
    while children.len() < 4 {
        let inner = (0..children.len()).filter(|&k| !tree.nodes[children[k] as usize].is_leaf());
        let Some(largest) = inner.max_by(|&a, &b| half_area(children[a]).total_cmp(&half_area(children[b]))) else {
            break;
        };
        let opened = tree.nodes[children[largest] as usize].first_index;
        children[largest] = opened;
        children.push(opened + 1);
    }
    children
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quadratic time would be minutes.
    #[test]
    fn tens_of_thousands_of_equal_boxes() {
        let boxes = vec![Bounds { lo: Vec3::ZERO, hi: Vec3::ONE }; 40_000];
        let (tree, order) = Wide::build(&boxes).unwrap();
        assert_eq!(order.len(), boxes.len());
        let mut met = 0;
        tree.walk(&Ray { origin: Vec3::splat(-1.0), direction: Vec3::ONE, t_max: 9.0 }, |_, t_max| {
            met += 1;
            ControlFlow::Continue(t_max)
        });
        assert_eq!(met, boxes.len());
    }
}
