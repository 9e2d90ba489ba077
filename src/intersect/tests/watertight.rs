//! Closed meshes do not let rays through, not even rays aimed exactly at edges and vertices.

use super::*;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Aim {
    Vertex,
    Edge,
    Anywhere,
}

fn target(random: &mut Random, mesh: &Mesh, aim: Aim) -> Vec3 {
    let t = (random.unit() * mesh.triangles.len() as f32) as u32;
    let [a, b, c] = mesh.corners(t.min(mesh.triangles.len() as u32 - 1));
    let s = random.unit();
    match aim {
        Aim::Vertex => a,
        Aim::Edge if random.unit() < 0.5 => a + (b - a) * s,
        Aim::Edge => (b + c) * 0.5,
        Aim::Anywhere => a + (b - a) * s + (c - a) * (1.0 - s) * random.unit(),
    }
}

/// Of so many rays from inside and outside, those that `closest` or `occluded` let through.
fn leaks(backend: &dyn Intersector, mesh: &Mesh, radius: f32, center: Vec3, aim: Aim, rays: u32) -> u32 {
    let mut random = Random::new(21);
    let mut leaks = 0;
    for i in 0..rays {
        let to = target(&mut random, mesh, aim);
        let inside = center + random.cube() * radius * 0.5;
        let ray = if i % 4 == 0 {
            // Along an axis: components of exactly zero.
            let axis = [Vec3::X, Vec3::Y, Vec3::NEG_Z][(i / 4 % 3) as usize];
            half_line(to - axis * (to - inside).dot(axis), axis)
        } else if i % 4 == 1 {
            // From outside, well within the silhouette.
            let side = ((to - center) / radius + random.direction() * 0.7).normalize();
            let from = center + side * radius * random.magnitude(0.5, 3.0);
            half_line(from, to - from)
        } else {
            half_line(inside, (to - inside) * random.magnitude(-3.0, 3.0))
        };
        if i % 4 == 0 && ray.origin.distance(center) > 0.8 * radius {
            continue;
        }
        leaks += u32::from(backend.closest(&ray).is_none() || !backend.occluded(&ray));
    }
    leaks
}

/// Embree's edge functions are rounded independently of each other, so that at a vertex all of them may
/// come out on the wrong side: of rays aimed at exactly a vertex it loses about one in 4000 (4.3.3, at
/// either build quality). None is lost at edges, and none by obvhs. A path meets a vertex that closely
/// with probability 1e-12 or so; the bound here only keeps watch.
#[test]
fn closed_meshes_do_not_leak() {
    for radius in [1e-4, 1.0, 1e4] {
        for center in [Vec3::ZERO, Vec3::new(100.0, -50.0, 25.0), Vec3::new(1e4, 1e4, -1e4)] {
            if radius * 1e6 < center.length() {
                continue;
            }
            let mesh = icosphere(3, radius, center);
            for backend in backends(&[Shape::Mesh(mesh.clone().into())]) {
                for aim in [Aim::Vertex, Aim::Edge, Aim::Anywhere] {
                    let rays = 20_000;
                    let leaks = leaks(backend.as_ref(), &mesh, radius, center, aim, rays);
                    let allowed =
                        if aim == Aim::Vertex && backend.describe().starts_with("Embree") { rays / 1000 } else { 0 };
                    let name = backend.describe();
                    assert!(leaks <= allowed, "{name}, {aim:?}, radius {radius} at {center}: {leaks} of {rays}");
                }
            }
        }
    }
}
