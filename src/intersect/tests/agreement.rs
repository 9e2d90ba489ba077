//! Embree and obvhs give the same hits but where rounding decides.
#![cfg(feature = "embree")]

use super::*;
use crate::geometry::Sphere;
use crate::intersect::{Comparison, compare};

const RAYS: u32 = 200_000;

fn both(shapes: &[Shape], kind: Build, scale: f32, offset: Vec3) -> Comparison {
    let mut random = Random::new(32);
    let rays: Vec<Ray> = (0..RAYS)
        .map(|i| {
            let origin = random.cube() * [0.9, 3.0, 100.0][i as usize % 3];
            let aim = if i % 2 == 0 { random.cube() } else { origin + random.direction() };
            Ray {
                origin: origin * scale + offset,
                direction: (aim - origin) * scale * random.magnitude(-2.0, 2.0),
                t_max: if i % 5 == 0 { random.unit() } else { f32::INFINITY },
            }
        })
        .collect();
    let embree = build(Backend::Embree, shapes, kind, 1).unwrap();
    let obvhs = build(Backend::Obvhs, shapes, Build::Static, 1).unwrap();
    compare(embree.as_ref(), obvhs.as_ref(), shapes, &rays)
}

/// Measured: 1 to 7 rays of 200 000, within 0.3 roundings of an edge.
fn judge(c: &Comparison, case: &str) {
    assert!(c.rays == RAYS as u64 && c.different() <= 20, "{case}: {c}");
    assert!(c.max_edge_roundings < 1.0, "{case}: {c}\n{:?}", c.worst.first());
    assert!(c.max_claimed_error < 1.0, "{case}: {c}");
    assert_eq!((c.occluded_differs, c.same + c.tied + c.different()), (0, c.rays), "{case}: {c}");
}

#[test]
fn the_same_hits_but_within_a_rounding_of_an_edge() {
    for (scale, offset) in [(1.0, 0.0), (1e-4, 0.0), (1e4, 0.0), (1.0, 1e4)] {
        let offset = Vec3::new(1.0, 1.0, -1.0) * offset;
        let mut random = Random::new(31);
        let mut shapes = vec![Shape::Mesh(soup(&mut random, 5000, 0.1, scale, offset).into())];
        for _ in 0..50 {
            let center = random.cube() * scale + offset;
            shapes.push(Shape::Sphere(Sphere { center, radius: random.between(0.01, 0.05) * scale }));
        }
        let closed = [Shape::Mesh(icosphere(4, 0.8 * scale, offset).into())];
        for kind in [Build::Static, Build::Editable] {
            let place = format!("times {scale}, moved by {offset}, {kind:?}");
            judge(&both(&shapes, kind, scale, offset), &format!("soup {place}"));
            judge(&both(&closed, kind, scale, offset), &format!("closed mesh {place}"));
        }
    }
}
