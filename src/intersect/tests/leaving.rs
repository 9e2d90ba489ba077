//! Rays that leave a surface never find the point they left; segments between two surface points are
//! not blocked by their own ends.

use super::*;
use crate::geometry::{Sphere, SurfacePoint};

/// A triangle of about unit size: of any shape, a needle with a short base, or flat with three long edges.
fn unit_triangle(random: &mut Random) -> [Vec3; 3] {
    let along = random.direction();
    let across = random.direction();
    match (random.unit() * 3.0) as u32 {
        0 => [random.cube(), random.cube(), random.cube()],
        1 => [Vec3::ZERO, along, along + across * random.magnitude(-6.0, 0.0)],
        _ => [Vec3::ZERO, along, along * random.between(0.2, 0.8) + across * random.magnitude(-6.0, 0.0)],
    }
}

/// Triangles well apart, of about `size`, around `offset`.
fn scattered(random: &mut Random, size: f32, offset: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    while mesh.triangles.len() < 48 {
        let place = random.cube() * 40.0;
        let corners = unit_triangle(random).map(|p| (p + place) * size + offset);
        let n = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([n, n + 1, n + 2]);
        // Rounding to the grid of f32 may leave no area; the scene's validation drops such triangles.
        let longest = corners[0].distance(corners[1]).max(corners[1].distance(corners[2]));
        if mesh.area(mesh.triangles.len() as u32 - 1) < 1e-8 * longest * longest {
            mesh.triangles.pop();
            mesh.positions.truncate(n as usize);
        }
    }
    mesh
}

/// A direction on a random side, one time in two close to grazing.
fn any_direction(random: &mut Random, ng: Vec3) -> Vec3 {
    let d = random.direction();
    if random.unit() < 0.5 {
        return d;
    }
    let flat = d - ng * d.dot(ng);
    flat + ng * random.magnitude(-7.0, 0.0) * if random.unit() < 0.5 { -1.0 } else { 1.0 }
}

fn scenes(seed: u64) -> impl Iterator<Item = (f32, Vec3, Mesh)> {
    (-6..=6).flat_map(move |e| {
        let size = 10f32.powi(e);
        [0.0, 1e4, 1e6].into_iter().filter(move |o| size > o * 3e-6).map(move |o| {
            let mut random = Random::new(seed + (e + 6) as u64);
            let offset = Vec3::new(1.0, -0.7, 0.4) * o;
            (size, offset, scattered(&mut random, size, offset))
        })
    })
}

#[test]
fn rays_never_find_the_triangle_they_leave() {
    let mut random = Random::new(11);
    let (mut left, mut found) = (0, Vec::new());
    for (size, offset, mesh) in scenes(100) {
        let shapes = [Shape::Mesh(mesh.into())];
        let Shape::Mesh(mesh) = &shapes[0] else { unreachable!() };
        for backend in backends(&shapes) {
            for triangle in 0..mesh.triangles.len() as u32 {
                for _ in 0..4 {
                    let (u, v) = random.barycentric();
                    let target = mesh.surface(triangle, u, v);
                    let origin = target.p + random.direction() * size * random.magnitude(-1.0, 3.0);
                    let ray = half_line(origin, target.p - origin);
                    // From the sampled point, as emitters do, and from the hit of a ray.
                    let hit = backend.closest(&ray).map(|h| shapes[0].surface(&ray, &h));
                    for from in [Some(target), hit].into_iter().flatten() {
                        for _ in 0..8 {
                            let d = any_direction(&mut random, from.ng);
                            left += 1;
                            if backend.closest(&Ray::leaving(&from, d)).is_some_and(|h| h.primitive == from.primitive) {
                                found.push(format!("{}: size {size}, offset {offset}", backend.describe()));
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(left > 50_000 && found.is_empty(), "{} of {left}, {:?}", found.len(), found.first());
}

#[test]
fn segments_between_triangles_are_not_blocked_by_their_ends() {
    let mut random = Random::new(12);
    let (mut tested, mut blocked) = (0, Vec::new());
    for (size, _, mesh) in scenes(200) {
        let count = mesh.triangles.len() as u32;
        let shapes = [Shape::Mesh(mesh.into())];
        let Shape::Mesh(mesh) = &shapes[0] else { unreachable!() };
        for backend in backends(&shapes) {
            for _ in 0..1000 {
                let mut pick = || {
                    let (u, v) = random.barycentric();
                    mesh.surface(((random.unit() * count as f32) as u32).min(count - 1), u, v)
                };
                let (from, to) = (pick(), pick());
                if from.primitive == to.primitive {
                    continue;
                }
                tested += 1;
                let hit = backend.closest(&Ray::between(&from, &to));
                if hit.is_some_and(|h| h.primitive == from.primitive || h.primitive == to.primitive) {
                    blocked.push(format!("{}: size {size}, {from:?} {to:?} {hit:?}", backend.describe()));
                }
            }
        }
    }
    assert!(tested > 20_000 && blocked.is_empty(), "{} of {tested}, {:?}", blocked.len(), blocked.first());
}

fn spheres() -> Vec<Sphere> {
    let mut random = Random::new(13);
    let mut spheres = Vec::new();
    for e in -6..=6 {
        for o in [0.0, 1e4, 1e6] {
            let radius = random.between(1.0, 3.0) * 10f32.powi(e);
            if radius > o * 3e-6 {
                spheres.push(Sphere { center: random.direction() * o, radius });
            }
        }
    }
    spheres
}

/// A point on the sphere, as a sample and as the hit of a ray.
fn points(random: &mut Random, sphere: &Sphere, backend: &dyn Intersector) -> Vec<SurfacePoint> {
    let sampled = sphere.at(random.direction().as_dvec3());
    let origin = sphere.center + random.direction() * sphere.radius * random.magnitude(-2.0, 4.0);
    let ray = half_line(origin, (sampled.p - origin) * random.magnitude(-3.0, 3.0));
    let hit = backend.closest(&ray).map(|h| sphere.surface(&ray, h.t));
    [Some(sampled), hit].into_iter().flatten().collect()
}

#[test]
fn rays_leave_spheres_outward_and_cross_them_inward() {
    let mut random = Random::new(14);
    for sphere in spheres() {
        for backend in backends(&[Shape::Sphere(sphere)]) {
            for _ in 0..500 {
                for from in points(&mut random, &sphere, backend.as_ref()) {
                    let d = any_direction(&mut random, from.ng);
                    let ray = Ray::leaving(&from, d);
                    let hit = backend.closest(&ray);
                    let name = backend.describe();
                    if d.dot(from.ng) >= 0.0 {
                        assert!(hit.is_none(), "{name}: {sphere:?} found again by {ray:?}");
                        continue;
                    }
                    // Inward: one crossing, on the far side. A chord of length 2 r cos, but for the offset.
                    let hit = hit.unwrap_or_else(|| panic!("{name}: {sphere:?} leaks {ray:?}"));
                    let cos = -d.normalize().dot(from.ng);
                    let chord = hit.t * d.length();
                    let slack = 4.0 * (from.offset * sphere.radius).sqrt();
                    assert!((chord - 2.0 * sphere.radius * cos).abs() < slack, "{name}: {chord} {sphere:?} {ray:?}");
                    let far = sphere.surface(&ray, hit.t);
                    assert!(far.ng.dot(d) > 0.0, "{name}");
                }
            }
        }
    }
}

#[test]
fn segments_between_spheres_are_not_blocked_by_their_ends() {
    let mut random = Random::new(15);
    for sphere in spheres() {
        let other = Sphere {
            center: sphere.center + random.direction() * sphere.radius * 30.0,
            radius: sphere.radius * random.magnitude(-3.0, 1.0),
        };
        for backend in backends(&[Shape::Sphere(sphere), Shape::Sphere(other)]) {
            for _ in 0..300 {
                // Points that face each other.
                let toward = (other.center - sphere.center).normalize();
                let n0 = (toward + random.direction()).as_dvec3().normalize();
                let n1 = (random.direction() - toward).as_dvec3().normalize();
                let (from, to) = (sphere.at(n0), other.at(n1));
                let d = (to.p - from.p).normalize();
                // Away from tangency, where the bulge of the surface itself decides.
                if d.dot(from.ng) > 1e-3 && -d.dot(to.ng) > 1e-3 {
                    let ray = Ray::between(&from, &to);
                    assert!(!backend.occluded(&ray), "{}: {sphere:?} {other:?} {ray:?}", backend.describe());
                }
            }
        }
    }
}
