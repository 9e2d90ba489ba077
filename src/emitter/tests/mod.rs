//! Scenes and independent geometry for the tests of lights.

mod aimed;
mod densities;
mod environment;
mod radiometry;
mod sampling;

use super::*;
use crate::geometry::{Mesh, Sphere};
use crate::math::{Sampler, Stream};
use crate::scene::description::{Environment, Scattering, Textures};

pub(super) struct Scene {
    pub(super) shapes: Vec<Shape>,
    pub(super) lights: Lights,
}

fn material(emission: Rgb, emission_two_sided: bool) -> Material {
    Material {
        name: String::new(),
        scattering: Scattering::Diffuse { reflectance: Rgb::ZERO },
        textures: Textures::default(),
        emission,
        emission_two_sided,
        walked_roughness: 0.0,
    }
}

pub(super) const CENTER: Vec3 = Vec3::new(0.5, -0.25, 1.0);
pub(super) const RADIUS: f32 = 4.0;

/// Lights, with [`CENTER`] and [`RADIUS`] as the bounds of the scene.
pub(super) fn scene(
    shapes: Vec<(Shape, Rgb, bool)>,
    lights: &[LightKind],
    environment: impl Into<Environment>,
) -> Scene {
    let materials: Vec<_> = shapes.iter().map(|&(_, emission, two_sided)| material(emission, two_sided)).collect();
    let shapes: Vec<_> = shapes.into_iter().map(|(shape, ..)| shape).collect();
    let lights = Lights::new(
        &shapes,
        &materials.iter().map(|m| (m, None)).collect::<Vec<_>>(),
        lights,
        &environment.into(),
        CENTER,
        RADIUS,
    );
    Scene { shapes, lights }
}

/// The parallelogram `corner + x a + y b`, normal along `a × b`, of triangles of unequal area, one of
/// them degenerate.
pub(super) fn parallelogram(corner: Vec3, a: Vec3, b: Vec3) -> Shape {
    let positions = vec![corner, corner + a, corner + a + b, corner + b, corner + 0.25 * a];
    let triangles = vec![[0, 4, 3], [0, 0, 2], [4, 1, 2], [4, 2, 3]];
    Shape::Mesh(Mesh { positions, normals: vec![], triangles }.into())
}

/// The horizontal rectangle of half-sides `x` and `z` about `center` that shines down.
pub(super) fn ceiling(center: Vec3, x: f32, z: f32) -> Shape {
    parallelogram(center - Vec3::new(x, 0.0, z), Vec3::X * 2.0 * x, Vec3::Z * 2.0 * z)
}

pub(super) fn ball(center: Vec3, radius: f32) -> Shape {
    Shape::Sphere(Sphere { center, radius })
}

pub(super) fn random(seed: u64) -> Sampler {
    Sampler::new(seed, 0, 0, Stream::Light)
}

impl Scene {
    pub(super) fn direct(&self, receiver: Vec3, random: &mut Sampler) -> Option<DirectSample> {
        self.lights.sample_direct(&self.shapes, receiver, random.next_1d(), random.next_2d())
    }

    pub(super) fn emission(&self, random: &mut Sampler) -> Option<EmissionSample> {
        let (u_light, u_position, u_direction) = (random.next_1d(), random.next_2d(), random.next_2d());
        self.lights.sample_emission(&self.shapes, u_light, u_position, u_direction, random.next_1d())
    }

    /// The light vertices that the half-line from `from` meets, in f64 and by no code of the renderer's:
    /// planes of parallelograms, and both sides of spheres.
    pub(super) fn crossings(&self, from: Vec3, direction: DVec3) -> Vec<SurfacePoint> {
        let mut found = Vec::new();
        for (i, shape) in self.shapes.iter().enumerate() {
            let o = from.as_dvec3();
            match shape {
                Shape::Mesh(mesh) => {
                    let corner = mesh.positions[0].as_dvec3();
                    let a = mesh.positions[1].as_dvec3() - corner;
                    let b = mesh.positions[3].as_dvec3() - corner;
                    let n = a.cross(b);
                    let t = (corner - o).dot(n) / direction.dot(n);
                    let q = o + direction * t - corner;
                    let (x, y) = (q.cross(b).dot(n) / n.length_squared(), a.cross(q).dot(n) / n.length_squared());
                    if t > 0.0 && (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y) {
                        let (p, ng) = ((q + corner).as_vec3(), n.normalize().as_vec3());
                        found.push(SurfacePoint { p, ng, ns: ng, shape: i as u32, ..mesh.surface(0, 0.0, 0.0) });
                    }
                }
                Shape::Sphere(s) => {
                    let c = o - s.center.as_dvec3();
                    let half = c.dot(direction);
                    let discriminant = half * half - (c.length_squared() - f64::from(s.radius).powi(2));
                    for sign in [-1.0, 1.0] {
                        let t = -half + sign * discriminant.sqrt();
                        if t > 0.0 {
                            let n = (c + direction * t).normalize();
                            found.push(SurfacePoint { shape: i as u32, ..s.at(n) });
                        }
                    }
                }
            }
        }
        found
    }
}

/// Mean and its standard error of `n` values.
pub(super) fn mean(n: usize, mut value: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let x = value();
        sum += x;
        squares += x * x;
    }
    let (n, m) = (n as f64, sum / n as f64);
    (m, ((squares / n - m * m).max(0.0) / n).sqrt())
}

/// One light of every kind, all within [`RADIUS`] of [`CENTER`].
pub(super) fn one_of_each() -> Vec<(&'static str, Scene)> {
    use glam::DVec3;
    let rgb = Rgb::new(3.0, 2.0, 1.0);
    let tilted = || parallelogram(Vec3::new(-1.0, 2.0, 0.0), Vec3::new(2.0, 0.3, 0.0), Vec3::new(0.2, 0.4, 1.5));
    let shape = |shape, two_sided| scene(vec![(shape, rgb, two_sided)], &[], Rgb::ZERO);
    let kind = |kind| scene(vec![], &[kind], Rgb::ZERO);
    let position = DVec3::new(0.3, 2.0, 0.5);
    let direction = DVec3::new(0.4, -3.0, 0.2);
    vec![
        ("one-sided mesh", shape(tilted(), false)),
        ("two-sided mesh", shape(tilted(), true)),
        ("one-sided sphere", shape(ball(Vec3::new(0.2, 1.8, 0.4), 0.7), false)),
        ("two-sided sphere", shape(ball(Vec3::new(0.2, 1.8, 0.4), 0.7), true)),
        ("point", kind(LightKind::Point { position, intensity: rgb })),
        ("spot", kind(LightKind::Spot { position, direction, intensity: rgb, inner: 0.4, outer: 0.9 })),
        ("directional", kind(LightKind::Directional { direction, irradiance: rgb })),
        ("environment", scene(vec![], &[], rgb)),
        ("environment image", scene(vec![], &[], environment::turned(environment::sky(), rgb))),
    ]
}

/// All of them in one scene.
pub(super) fn mixture() -> Scene {
    let mut shapes = Vec::new();
    let mut kinds = Vec::new();
    for (_, s) in one_of_each() {
        for (i, shape) in s.shapes.iter().enumerate() {
            let two_sided = s.lights.of_shape(i as u32).is_some_and(|l| match &s.lights.lights[l as usize] {
                Light::Mesh(m) => m.emission.two_sided,
                Light::Sphere(b) => b.emission.two_sided,
                _ => false,
            });
            // Apart from each other, so that directions tell them apart.
            let away = Vec3::new(3.0 * shapes.len() as f32 - 4.0, 0.0, 0.5);
            let moved = match shape {
                Shape::Mesh(m) => {
                    let positions = m.positions.iter().map(|&p| p + away).collect();
                    Shape::Mesh(Mesh { positions, ..Mesh::clone(m) }.into())
                }
                Shape::Sphere(b) => ball(b.center + away, b.radius),
            };
            shapes.push((moved, Rgb::new(1.0, 2.0, 4.0), two_sided));
        }
    }
    let intensity = Rgb::new(9.0, 5.0, 2.0);
    kinds.push(LightKind::Point { position: DVec3::new(-1.0, 1.0, 2.0), intensity });
    kinds.push(LightKind::Directional { direction: DVec3::new(0.0, -1.0, 0.3), irradiance: Rgb::splat(0.5) });
    scene(shapes, &kinds, Rgb::new(0.1, 0.2, 0.3))
}
