//! What must hold for every backend.

mod agreement;
mod build;
mod leaving;
mod watertight;

use super::{Backend, Build, Intersector, build};
use crate::geometry::{Mesh, Ray, Shape};
use crate::math::{Sampler, Stream};
use glam::Vec3;

/// Every backend of this build, over the same shapes, the one that differs if it is editable so, too.
fn backends(shapes: &[Shape]) -> Vec<Box<dyn Intersector>> {
    let embree = [(Backend::Embree, Build::Static), (Backend::Embree, Build::Editable)];
    let all = embree.into_iter().filter(|_| cfg!(feature = "embree")).chain([(Backend::Obvhs, Build::Static)]);
    all.map(|(backend, kind)| build(backend, shapes, kind, 1).unwrap()).collect()
}

/// Reproducible random numbers for geometry.
struct Random(Sampler);

impl Random {
    fn new(seed: u64) -> Random {
        Random(Sampler::new(seed, 0, 0, Stream::Camera))
    }

    fn unit(&mut self) -> f32 {
        self.0.next_1d()
    }

    fn between(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.unit()
    }

    /// A power of ten with a uniform exponent.
    fn magnitude(&mut self, lo: f32, hi: f32) -> f32 {
        10f32.powf(self.between(lo, hi))
    }

    /// Uniform in the cube of half side 1.
    fn cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// Uniform on the sphere.
    fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            let l = v.length();
            if l > 0.01 && l <= 1.0 {
                return v / l;
            }
        }
    }

    /// Barycentrics, one time in eight on an edge or a vertex.
    fn barycentric(&mut self) -> (f32, f32) {
        let (mut u, mut v) = (self.unit(), self.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        match (self.unit() * 32.0) as u32 {
            0 => (u, 0.0),
            1 => (0.0, v),
            2 => (u, 1.0 - u),
            3 => [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)][(self.unit() * 3.0) as usize],
            _ => (u, v),
        }
    }
}

fn half_line(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY }
}

/// Triangles in a cube of half side 1, each within `size` of its place, all moved and then scaled.
fn soup(random: &mut Random, count: u32, size: f32, scale: f32, offset: Vec3) -> Mesh {
    let mut positions = Vec::new();
    for _ in 0..count {
        let place = random.cube();
        for _ in 0..3 {
            positions.push((place + random.cube() * size) * scale + offset);
        }
    }
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions, normals: vec![], triangles }
}

/// An icosahedron, each face divided into four `levels` times, on a sphere.
fn icosphere(levels: u32, radius: f32, center: Vec3) -> Mesh {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut positions: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        positions.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    // The faces are the triples of vertices at mutual distance 2.
    let close = |p: &[Vec3], i: usize, j: usize| (p[i].distance(p[j]) - 2.0).abs() < 1e-3;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if close(&positions, i, j) && close(&positions, j, k) && close(&positions, k, i) {
                    let [a, b, c] = [i, j, k].map(|i| positions[i]);
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    triangles.push(if outward { [i, j, k] } else { [i, k, j] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push(positions[a as usize] + positions[b as usize]);
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
        for p in &mut positions {
            *p = p.normalize();
        }
    }
    let positions = positions.iter().map(|p| p.normalize() * radius + center).collect();
    Mesh { positions, normals: vec![], triangles }
}

#[test]
fn the_icosphere_of_these_tests_is_closed() {
    let mesh = icosphere(2, 1.0, Vec3::ZERO);
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (320, 162));
    let edges: std::collections::HashSet<_> =
        mesh.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
}
