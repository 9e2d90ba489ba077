//! Rays aimed exactly at the edges and vertices of a closed mesh never pass through it.

use super::*;

/// A point on a random vertex or edge, sometimes inside a face.
fn target(random: &mut Random, mesh: &Mesh) -> Vec3 {
    let t = (random.unit() * mesh.triangles.len() as f32) as u32;
    let [a, b, c] = mesh.corners(t.min(mesh.triangles.len() as u32 - 1));
    let s = random.unit();
    match (random.unit() * 5.0) as u32 {
        0 => a,
        1 => a + (b - a) * s,
        2 => b + (a - b) * 0.5,
        3 => c + (b - c) * s,
        _ => (a + b + c) / 3.0,
    }
}

/// Leaks per backend among rays from inside, and misses among rays from outside.
fn leaks(radius: f32, center: Vec3, rays: u32) -> Vec<(String, u32, u32)> {
    let mesh = icosphere(3, radius, center);
    let shapes = [Shape::Mesh(mesh.clone())];
    let mut result = Vec::new();
    for backend in backends(&shapes) {
        let mut random = Random::new(21);
        let (mut out, mut past) = (0, 0);
        for i in 0..rays {
            let to = target(&mut random, &mesh);
            let inside = center + random.cube() * radius * 0.5;
            // One time in four along an axis: components of exactly zero.
            let ray = if i % 4 == 0 {
                let axis = [Vec3::X, Vec3::Y, Vec3::NEG_Z][(i / 4 % 3) as usize];
                half_line(to - axis * (to - inside).dot(axis), axis)
            } else {
                half_line(inside, (to - inside) * random.magnitude(-3.0, 3.0))
            };
            if i % 4 != 0 || (ray.origin - center).length() < 0.8 * radius {
                out += u32::from(backend.closest(&ray).is_none() || !backend.occluded(&ray));
            }
            // From far outside toward a point well inside the silhouette.
            let from = center + random.direction() * radius * random.magnitude(0.5, 3.0);
            let side = (to - center).normalize().dot((from - center).normalize());
            if side > 0.3 {
                past += u32::from(backend.closest(&half_line(from, to - from)).is_none());
            }
        }
        result.push((backend.describe(), out, past));
    }
    result
}

#[test]
fn closed_meshes_do_not_leak() {
    for radius in [1e-4, 1.0, 1e4] {
        for center in [Vec3::ZERO, Vec3::new(100.0, -50.0, 25.0), Vec3::new(1e4, 1e4, -1e4)] {
            if radius * 1e6 < center.length() {
                continue;
            }
            for (name, out, past) in leaks(radius, center, 40_000) {
                assert_eq!((out, past), (0, 0), "{name}, radius {radius} at {center}");
            }
        }
    }
}
