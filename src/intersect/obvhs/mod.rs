//! The pure Rust backend. The crate obvhs builds the hierarchy; the walk and the primitive tests are
//! ours, because its own node tests are not conservative (an absolute lower bound of 1e-4 on `t`,
//! no rounding margin) and direct transport cannot forgive a missed wall.

mod triangle;

use super::{BackendError, Bounds, Hit, Intersector, Wide};
use crate::geometry::{Ray, Shape, Sphere};
use glam::Vec3;
use std::ops::ControlFlow;
use triangle::Query;

/// A primitive where the leaves find it: corners copied, in leaf order.
enum Primitive {
    Triangle { corners: [Vec3; 3], shape: u32, index: u32 },
    Sphere { sphere: Sphere, shape: u32 },
}

/// Ray queries in pure Rust. Triangles and spheres are tested in f64, so that a hit is right but for
/// its last rounding: the oracle for other backends.
pub struct Obvhs {
    tree: Wide,
    primitives: Vec<Primitive>,
}

impl Obvhs {
    /// Builds, on the calling thread alone: obvhs would share the work by rayon's global pool only.
    pub fn build(shapes: &[Shape], _threads: usize) -> Result<Obvhs, BackendError> {
        let count = super::check(shapes)?;
        let no_memory = || format!("no memory for {count} primitives");
        let refuse = |_| BackendError::OutOfMemory { backend: "obvhs", message: no_memory() };
        let (mut unordered, mut boxes) = (Vec::new(), Vec::new());
        unordered.try_reserve_exact(count).map_err(refuse)?;
        boxes.try_reserve_exact(count).map_err(refuse)?;
        for (shape, s) in shapes.iter().enumerate() {
            let shape = shape as u32;
            match s {
                Shape::Mesh(mesh) => {
                    for index in 0..mesh.triangles.len() as u32 {
                        let corners = mesh.corners(index);
                        boxes.push(Bounds::of_triangle(corners));
                        unordered.push(Some(Primitive::Triangle { corners, shape, index }));
                    }
                }
                Shape::Sphere(sphere) => {
                    boxes.push(Bounds::of_sphere(sphere));
                    unordered.push(Some(Primitive::Sphere { sphere: *sphere, shape }));
                }
            }
        }
        let (tree, order) = Wide::build(&boxes).map_err(refuse)?;
        let mut primitives = Vec::new();
        primitives.try_reserve_exact(count).map_err(refuse)?;
        primitives.extend(order.iter().filter_map(|&i| unordered[i as usize].take()));
        Ok(Obvhs { tree, primitives })
    }
}

impl Intersector for Obvhs {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let query = Query::new(ray);
        let mut nearest: Option<Hit> = None;
        self.tree.walk(ray, |i, t_max| {
            let found = match &self.primitives[i as usize] {
                Primitive::Triangle { corners, shape, index } => {
                    query.triangle(corners, t_max).map(|(t, u, v)| Hit { t, u, v, shape: *shape, primitive: *index })
                }
                Primitive::Sphere { sphere, shape } => sphere.intersect(&Ray { t_max, ..*ray }).map(|t| Hit {
                    t,
                    u: 0.0,
                    v: 0.0,
                    shape: *shape,
                    primitive: 0,
                }),
            };
            if let Some(hit) = found {
                // Of several at the same distance the first by index, whatever the tree's order.
                if nearest.is_none_or(|n| (hit.t, hit.shape, hit.primitive) < (n.t, n.shape, n.primitive)) {
                    nearest = Some(hit);
                }
                return ControlFlow::Continue(hit.t.min(t_max));
            }
            ControlFlow::Continue(t_max)
        });
        nearest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let query = Query::new(ray);
        let mut any = false;
        self.tree.walk(ray, |i, t_max| {
            any = match &self.primitives[i as usize] {
                Primitive::Triangle { corners, .. } => query.triangle(corners, t_max).is_some(),
                Primitive::Sphere { sphere, .. } => sphere.intersect(ray).is_some(),
            };
            if any { ControlFlow::Break(()) } else { ControlFlow::Continue(t_max) }
        });
        any
    }

    fn describe(&self) -> String {
        "obvhs 0.4 (pure Rust)".into()
    }

    fn memory(&self) -> u64 {
        self.tree.memory() + (self.primitives.capacity() * size_of::<Primitive>()) as u64
    }
}
