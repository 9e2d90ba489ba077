//! Small scenes built in code, and statistics, for the integration tests.
#![allow(dead_code, unreachable_pub)]

pub mod oracle;
pub mod scenes;
pub mod stats;

use caustica::math::Rgb;
use caustica::render::{Cancel, Caustics, Integrator, Output, Settings, render};
use caustica::scene::description::*;
use caustica::scene::{CommitOptions, World};
use glam::{DAffine3, DVec3, Vec3};
use std::sync::Arc;

/// Collects a description.
#[derive(Default)]
pub(crate) struct Builder(pub Description);

impl Builder {
    pub(crate) fn material(&mut self, scattering: Scattering) -> usize {
        self.emitter(scattering, Rgb::ZERO)
    }

    pub(crate) fn diffuse(&mut self, albedo: f32) -> usize {
        self.material(Scattering::Diffuse { reflectance: Rgb::splat(albedo) })
    }

    pub(crate) fn glass(&mut self, ior: f32, roughness: f32) -> usize {
        self.material(Scattering::Dielectric {
            inside: Medium::new(ior, Rgb::ZERO),
            outside: Medium::VACUUM,
            roughness,
            tint: Rgb::ONE,
        })
    }

    /// Smooth glass that absorbs, per metre.
    pub(crate) fn absorbing(&mut self, ior: f32, absorption: Rgb) -> usize {
        self.material(Scattering::Dielectric {
            inside: Medium::new(ior, absorption),
            outside: Medium::VACUUM,
            roughness: 0.0,
            tint: Rgb::ONE,
        })
    }

    /// Rough glass that walks lead through.
    pub(crate) fn walked_glass(&mut self, ior: f32, roughness: f32) -> usize {
        let material = self.glass(ior, roughness);
        self.0.materials[material].walked_roughness = 1.0;
        material
    }

    pub(crate) fn emitter(&mut self, scattering: Scattering, emission: Rgb) -> usize {
        let name = format!("material {}", self.0.materials.len());
        self.0.materials.push(Material {
            name,
            scattering,
            textures: Textures::default(),
            emission,
            emission_two_sided: false,
            walked_roughness: WALKED_ROUGHNESS,
        });
        self.0.materials.len() - 1
    }

    pub(crate) fn lamp(&mut self, radiance: f32) -> usize {
        self.emitter(Scattering::Diffuse { reflectance: Rgb::ZERO }, Rgb::splat(radiance))
    }

    pub(crate) fn mesh(&mut self, mesh: MeshDescription, material: usize, transform: DAffine3) {
        self.0.meshes.push(mesh.into());
        let name = format!("instance {}", self.0.instances.len());
        let geometry = Geometry::Mesh(self.0.meshes.len() - 1);
        self.0.instances.push(Instance { name, geometry, material, transform });
    }

    /// A parallelogram from a corner and two edges; its front is on the side of `e1 x e2`.
    pub(crate) fn quad(&mut self, corner: Vec3, e1: Vec3, e2: Vec3, material: usize) {
        let positions = [corner, corner + e1, corner + e1 + e2, corner + e2].map(|p| p.to_array()).to_vec();
        let mesh = MeshDescription { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Default::default() };
        self.mesh(mesh, material, DAffine3::IDENTITY);
    }

    /// Gives the last mesh texture coordinates, by position.
    pub(crate) fn unwrap(&mut self, at: impl Fn(Vec3) -> [f32; 2]) {
        let mesh = Arc::make_mut(self.0.meshes.last_mut().expect("a mesh"));
        mesh.texture_coordinates = mesh.positions.iter().map(|&p| at(p.into())).collect();
    }

    /// An axis-aligned box; its front is outside, or inside where `inward`.
    pub(crate) fn cuboid(&mut self, low: Vec3, high: Vec3, inward: bool, material: usize) {
        let d = high - low;
        let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
        let faces = [(low, y, x), (low, z, y), (low, x, z), (low + z, x, y), (low + x, y, z), (low + y, z, x)];
        for (corner, e1, e2) in faces {
            if inward { self.quad(corner, e2, e1, material) } else { self.quad(corner, e1, e2, material) }
        }
    }

    pub(crate) fn sphere(&mut self, center: DVec3, radius: f64, material: usize) {
        let name = format!("sphere {}", self.0.instances.len());
        let transform = DAffine3::from_translation(center);
        self.0.instances.push(Instance { name, geometry: Geometry::Sphere { radius }, material, transform });
    }

    pub(crate) fn light(&mut self, kind: LightKind) {
        let name = format!("light {}", self.0.lights.len());
        self.0.lights.push(Light { name, kind });
    }

    pub(crate) fn camera(&mut self, from: DVec3, to: DVec3, projection: Projection) {
        let back = (from - to).normalize();
        let right = DVec3::Y.cross(back).normalize();
        let rotation = glam::DMat3::from_cols(right, back.cross(right), back);
        let transform = DAffine3::from_mat3_translation(rotation, from);
        self.0.cameras.push(Camera::new("camera", transform, projection));
    }

    pub(crate) fn perspective(&mut self, from: [f64; 3], to: [f64; 3], yfov: f64) {
        self.camera(from.into(), to.into(), Projection::Perspective { yfov });
    }

    pub(crate) fn commit(&self) -> World {
        World::commit(&self.0, CommitOptions::default()).expect("a valid scene")
    }
}

/// A square of `n` by `n` cells over `x` and `z` from -2 to 2, with the point and normal that `at` says.
pub(crate) fn grid(n: u32, at: impl Fn(f32, f32) -> (Vec3, Vec3)) -> MeshDescription {
    let along = |i: u32| 4.0 * i as f32 / n as f32 - 2.0;
    let places = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let points = places.map(|(i, j)| at(along(i), along(j)));
    let (positions, normals) = points.map(|(p, n)| (p.to_array(), n.normalize().to_array())).unzip();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let cell = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, d, c], [a, c, b]]
    };
    let triangles = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).flat_map(cell).collect();
    MeshDescription { name: "grid".to_owned(), positions, normals, texture_coordinates: Vec::new(), triangles }
}

/// A sphere of triangles with exact vertex normals, from a subdivided icosahedron.
pub(crate) fn icosphere(radius: f32, subdivisions: u32, smooth: bool) -> MeshDescription {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut p: Vec<Vec3> = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(|v| Vec3::from(v).normalize())
    .to_vec();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middle = std::collections::HashMap::new();
        let mut split = |p: &mut Vec<Vec3>, a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                p.push((p[a as usize] + p[b as usize]).normalize());
                p.len() as u32 - 1
            })
        };
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let (ab, bc, ca) = (split(&mut p, a, b), split(&mut p, b, c), split(&mut p, c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    MeshDescription {
        name: "icosphere".to_owned(),
        positions: p.iter().map(|v| (*v * radius).to_array()).collect(),
        normals: if smooth { p.iter().map(|v| v.to_array()).collect() } else { Vec::new() },
        texture_coordinates: Vec::new(),
        triangles,
    }
}

/// A square image of these texels.
pub(crate) fn image(texels: &[Rgb]) -> Option<TextureMap> {
    let side = texels.len().isqrt();
    Some(TextureMap::new(Texture::of_floats(side, side, texels.to_vec()).expect("an image").into()))
}

/// Settings for a small square image, without caustic connections: `caustic.rs` holds those to the plain
/// integrators, and these to everything else, at a tenth of the cost where glass is in sight.
pub(crate) fn settings(integrator: Integrator, side: u32, samples: u32, seed: u64) -> Settings {
    Settings {
        integrator,
        width: side,
        height: side,
        samples,
        seed,
        threads: 0,
        max_depth: 10,
        caustics: Caustics::Off,
        ..Settings::default()
    }
}

/// Renders, expecting success and no non-finite value.
pub(crate) fn run(world: &World, settings: &Settings) -> Output {
    let output = render(world, settings, &Cancel::default(), &|_| ()).expect("a render");
    assert_eq!(output.statistics.non_finite, 0, "non-finite: {:?}", output.statistics.first_non_finite);
    output
}
