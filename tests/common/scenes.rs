//! Scenes that put one part of transport after another to work. All fit into a few metres and have
//! no surfaces that touch at an angle: there an unweighted connection has no finite variance.

use super::{Builder, icosphere, image};
use caustica::math::Rgb;
use caustica::scene::description::*;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::sync::Arc;

const FROM: [f64; 3] = [0.375, 1.75, 4.25];
const TO: [f64; 3] = [0.0, 0.7, 0.0];
const YFOV: f64 = 0.62;

/// Floor and, apart from it, a wall; both plain.
pub fn stage(b: &mut Builder) {
    let (floor, wall) = (b.diffuse(0.6), b.diffuse(0.4));
    b.quad(Vec3::new(-1.75, 0.0, -1.5), Vec3::Z * 3.0, Vec3::X * 3.5, floor);
    b.quad(Vec3::new(-1.5, 0.25, -2.0), Vec3::X * 3.0, Vec3::Y * 1.5, wall);
}

/// Two lamps above, unequal in size, power and colour, the second turned; they also reflect.
pub fn lamps(b: &mut Builder) {
    let reflecting = Scattering::Diffuse { reflectance: Rgb::splat(0.25) };
    let large = b.emitter(reflecting, Rgb::splat(2.0));
    b.quad(Vec3::new(-1.25, 2.5, -1.0), Vec3::X * 2.25, Vec3::Z * 2.0, large);
    let small = b.emitter(reflecting, Rgb::new(3.0, 2.0, 1.5));
    b.quad(Vec3::new(1.25, 1.75, -0.25), Vec3::new(0.75, 0.5, 0.0), Vec3::Z * 1.0, small);
}

/// One lamp so wide that paths which end by chance on it make little noise.
fn wide_lamp(b: &mut Builder) {
    let lamp = b.emitter(Scattering::Diffuse { reflectance: Rgb::splat(0.25) }, Rgb::splat(1.0));
    b.quad(Vec3::new(-2.5, 2.5, -2.0), Vec3::X * 5.0, Vec3::Z * 4.5, lamp);
}

fn view(b: &mut Builder) {
    b.perspective(FROM, TO, YFOV);
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// A scene of the stage, lamps and what the caller adds.
fn lit(lamps: impl Fn(&mut Builder), objects: impl Fn(&mut Builder)) -> Builder {
    let mut b = Builder::default();
    stage(&mut b);
    objects(&mut b);
    lamps(&mut b);
    view(&mut b);
    b
}

fn plain_objects(b: &mut Builder) {
    let ball = b.diffuse(0.8);
    b.sphere(DVec3::new(-0.5, 0.875, 0.0), 0.5, ball);
    let panel = b.diffuse(0.5);
    b.quad(Vec3::new(0.5, 0.25, -0.5), Vec3::new(0.75, 0.0, 0.5), Vec3::Y * 0.75, panel);
}

/// Lambertian surfaces only.
pub fn diffuse() -> Builder {
    lit(lamps, plain_objects)
}

/// The same with rough metal, and with the glTF model's coat over a diffuse base.
pub fn glossy() -> Builder {
    lit(lamps, |b| {
        let metal = b.material(Scattering::Conductor { reflectance: Rgb::new(0.9, 0.7, 0.5), roughness: 0.6 });
        b.sphere(DVec3::new(-0.5, 0.875, 0.0), 0.5, metal);
        let coated = b.material(Scattering::MetallicRoughness(MetallicRoughness {
            base_color: Rgb::new(0.3, 0.5, 0.8),
            metallic: 0.25,
            roughness: 0.5,
            ..MetallicRoughness::default()
        }));
        b.quad(Vec3::new(0.5, 0.25, -0.5), Vec3::new(0.75, 0.0, 0.5), Vec3::Y * 0.75, coated);
    })
}

/// Shading normals: a coarse diffuse ball with the normals of a sphere, a glossy one, and a flat floor
/// whose normals lean to the lamp on the right, so that Veach's factors are far from 1 and alike
/// for most light that the floor throws at the balls.
pub fn smooth_normals() -> Builder {
    let mut b = Builder::default();
    let floor = b.diffuse(0.9);
    let positions = vec![[-1.75, 0.0, -1.5], [-1.75, 0.0, 1.5], [1.75, 0.0, 1.5], [1.75, 0.0, -1.5]];
    let normals = vec![[0.5, 1.0, 0.1], [0.5, 1.0, -0.1], [0.4, 1.0, -0.1], [0.4, 1.0, 0.1]];
    let name = "leaning floor".to_owned();
    let mesh = MeshDescription {
        name,
        positions,
        normals,
        texture_coordinates: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    b.mesh(mesh, floor, DAffine3::IDENTITY);
    let (ball, metal) =
        (b.diffuse(0.8), b.material(Scattering::Conductor { reflectance: Rgb::splat(0.8), roughness: 0.7 }));
    b.mesh(icosphere(0.5, 1, true), ball, at(-0.7, 0.8, 0.0));
    b.mesh(icosphere(0.45, 1, true), metal, at(0.6, 0.75, 0.1));
    let lamp = b.emitter(Scattering::Diffuse { reflectance: Rgb::splat(0.25) }, Rgb::splat(2.0));
    b.quad(Vec3::new(1.0, 2.5, -1.0), Vec3::new(1.25, -1.5, 0.0), Vec3::Z * 2.0, lamp);
    view(&mut b);
    b
}

/// A wall that is lit only through a slab of smooth glass, by another wall, which hides the lamp from
/// it. One face of the slab has leaning normals: every path bears their factor across its chain.
pub fn leaning_slab() -> Builder {
    let mut b = Builder::default();
    let (receiver, sender) = (b.diffuse(0.7), b.diffuse(0.8));
    b.quad(Vec3::new(1.25, -1.0, -1.0), Vec3::Z * 2.0, Vec3::Y * 2.0, receiver);
    b.quad(Vec3::new(-1.25, -1.0, -1.0), Vec3::Y * 2.0, Vec3::Z * 2.0, sender);
    let glass = b.glass(1.5, 0.0);
    let (low, high) = (Vec3::new(-0.1, -1.25, -1.25), Vec3::new(0.1, 1.25, 1.25));
    let (x, y, z) = (Vec3::X * 0.2, Vec3::Y * 2.5, Vec3::Z * 2.5);
    for (corner, e1, e2) in [(low, y, x), (low, x, z), (low + z, x, y), (low, z, y), (low + y, z, x)] {
        b.quad(corner, e1, e2, glass);
    }
    let corner = low + x;
    let positions = [corner, corner + y, corner + y + z, high - y].map(|p| p.to_array()).to_vec();
    let name = "leaning face".to_owned();
    let normals = vec![[1.0, 0.6, 0.0]; 4];
    b.mesh(
        MeshDescription {
            name,
            positions,
            normals,
            texture_coordinates: Vec::new(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        },
        glass,
        DAffine3::IDENTITY,
    );
    let lamp = b.lamp(4.0);
    b.quad(Vec3::new(-1.0, 1.5, -0.75), Vec3::new(0.75, -0.5, 0.0), Vec3::Z * 1.5, lamp);
    b.perspective([0.35, 0.0, 0.0], [1.0, 0.0, 0.0], 1.4);
    b
}

/// Rough glass, clear and absorbing, and a diffuse ball inside the absorbing one.
pub fn rough_glass() -> Builder {
    lit(wide_lamp, |b| {
        let clear = b.glass(1.5, 0.8);
        b.sphere(DVec3::new(-0.6, 0.75, 0.0), 0.5, clear);
        let absorbing = b.material(Scattering::Dielectric {
            inside: Medium::new(1.3, Rgb::new(0.3, 0.9, 1.5)),
            outside: Medium::VACUUM,
            roughness: 0.9,
            tint: Rgb::ONE,
        });
        b.sphere(DVec3::new(0.7, 0.75, 0.2), 0.5, absorbing);
        let core = b.diffuse(0.8);
        b.sphere(DVec3::new(0.7, 0.75, 0.2), 0.2, core);
    })
}

/// Smooth glass: a sphere, and a mesh of a sphere with smooth normals.
pub fn smooth_glass() -> Builder {
    lit(wide_lamp, |b| {
        let glass = b.glass(1.5, 0.0);
        b.sphere(DVec3::new(-0.6, 0.75, 0.0), 0.5, glass);
        b.mesh(icosphere(0.5, 2, true), glass, at(0.7, 0.75, 0.2));
    })
}

/// A ball of rough absorbing glass before a lamp: most light passes two rough boundaries, so that the
/// techniques that meet between them count.
pub fn lamp_behind_rough_glass() -> Builder {
    let mut b = Builder::default();
    let (floor, lamp) = (b.diffuse(0.5), b.emitter(Scattering::Diffuse { reflectance: Rgb::splat(0.25) }, Rgb::ONE));
    b.quad(Vec3::new(-1.75, -0.5, -1.0), Vec3::Z * 3.0, Vec3::X * 3.5, floor);
    b.quad(Vec3::new(-2.0, -0.25, -1.75), Vec3::X * 4.0, Vec3::Y * 2.5, lamp);
    let glass = b.material(Scattering::Dielectric {
        inside: Medium::new(1.5, Rgb::new(0.1, 0.3, 0.5)),
        outside: Medium::VACUUM,
        roughness: 0.8,
        tint: Rgb::ONE,
    });
    b.sphere(DVec3::new(0.0, 0.75, 0.0), 0.9, glass);
    view(&mut b);
    b
}

/// Smooth absorbing glass with diffuse balls in it: two that see each other within the same glass, where
/// light and camera subpaths that came through its boundary meet.
pub fn absorbing_glass() -> Builder {
    lit(wide_lamp, |b| {
        let glass = b.material(Scattering::Dielectric {
            inside: Medium::new(1.5, Rgb::new(0.5, 1.0, 2.0)),
            outside: Medium::VACUUM,
            roughness: 0.0,
            tint: Rgb::new(1.0, 0.9, 0.8),
        });
        b.sphere(DVec3::new(0.6, 0.8, 0.2), 0.7, glass);
        b.cuboid(Vec3::new(-1.0, 0.25, -0.25), Vec3::new(-0.25, 0.875, 0.25), false, glass);
        let core = b.diffuse(0.8);
        b.sphere(DVec3::new(0.35, 0.8, 0.3), 0.2, core);
        b.sphere(DVec3::new(0.85, 0.8, 0.2), 0.2, core);
    })
}

/// Camera, lamps and all in one absorbing medium, whose end nothing reaches.
pub fn murky() -> Builder {
    let mut b = diffuse();
    let boundary = b.absorbing(1.33, Rgb::new(0.3, 0.4, 0.5));
    b.sphere(DVec3::ZERO, 100.0, boundary);
    b
}

/// A point, a spot and a distant light over diffuse and glossy surfaces.
pub fn delta_lights() -> Builder {
    let mut b = Builder::default();
    stage(&mut b);
    let ball = b.diffuse(0.8);
    b.sphere(DVec3::new(-0.5, 0.875, 0.0), 0.5, ball);
    let metal = b.material(Scattering::Conductor { reflectance: Rgb::splat(0.8), roughness: 0.6 });
    b.sphere(DVec3::new(0.7, 0.75, 0.2), 0.45, metal);
    b.light(LightKind::Point { position: DVec3::new(1.0, 2.2, 1.5), intensity: Rgb::new(4.0, 3.0, 2.0) });
    b.light(LightKind::Spot {
        position: DVec3::new(-1.5, 2.5, 1.0),
        direction: DVec3::new(0.5, -1.0, -0.4),
        intensity: Rgb::splat(4.0),
        inner: 0.3,
        outer: 0.9,
    });
    b.light(LightKind::Directional { direction: DVec3::new(0.4, -1.0, -0.6), irradiance: Rgb::new(0.6, 0.8, 1.0) });
    view(&mut b);
    b
}

/// An environment and a lamp, over diffuse, glossy and rough-glass objects.
pub fn environment() -> Builder {
    let mut b = Builder::default();
    stage(&mut b);
    let glass = b.glass(1.5, 0.6);
    b.sphere(DVec3::new(-0.6, 0.75, 0.0), 0.5, glass);
    let metal = b.material(Scattering::Conductor { reflectance: Rgb::splat(0.8), roughness: 0.5 });
    b.mesh(icosphere(0.5, 2, true), metal, at(0.7, 0.75, 0.2));
    let lamp = b.lamp(3.0);
    b.quad(Vec3::new(-0.5, 2.5, -0.5), Vec3::X, Vec3::Z, lamp);
    b.0.environment = Rgb::new(0.3, 0.5, 0.8).into();
    view(&mut b);
    b
}

/// A sky whose sun is a few pixels of its image, turned.
pub fn sky() -> Environment {
    let pixel = |i: usize| match (i % 16, i / 16) {
        (5, 1) => Rgb::new(30.0, 27.0, 20.0),
        (x, y) if y < 4 => Rgb::new(0.2, 0.3, 0.2 + 0.04 * x as f32),
        _ => Rgb::new(0.1, 0.08, 0.0),
    };
    let image = EnvironmentMap::new(16, 8, (0..16 * 8).map(pixel).collect()).expect("an image");
    Environment { radiance: Rgb::splat(0.8), image: Some(Arc::new(image)), rotation: DMat3::from_rotation_y(0.5) }
}

/// Colours, roughness and metal, a lamp: all by images.
pub fn textures(b: &mut Builder) {
    let colors =
        image(&[Rgb::new(1.0, 0.1, 0.1), Rgb::new(0.0, 0.0, 0.0), Rgb::new(0.2, 0.9, 0.3), Rgb::new(0.3, 0.4, 1.0)]);
    let roughness_and_metal =
        image(&[Rgb::new(0.0, 1.0, 0.0), Rgb::new(0.0, 0.6, 1.0), Rgb::new(0.0, 0.9, 1.0), Rgb::new(0.0, 0.0, 0.2)]);
    let floor = b.diffuse(0.9);
    b.0.materials[floor].textures.color = colors.clone();
    b.quad(Vec3::new(-1.75, 0.0, -1.5), Vec3::Z * 3.0, Vec3::X * 3.5, floor);
    b.unwrap(|p| [p.x * 0.8, p.z]);
    let shiny = b.material(Scattering::MetallicRoughness(MetallicRoughness {
        base_color: Rgb::new(0.9, 0.7, 0.5),
        metallic: 0.8,
        roughness: 0.6,
        ..MetallicRoughness::default()
    }));
    b.0.materials[shiny].textures =
        Textures { color: colors.clone(), metallic_roughness: roughness_and_metal, ..Textures::default() };
    let bumps = image(&[0.0, 0.25, 0.5, 0.75].map(|turn: f32| {
        let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
        Rgb::new(0.5 + 0.2 * cos, 0.5 + 0.2 * sin, 0.95)
    }));
    b.0.materials[shiny].textures.normal = bumps.map(|map| NormalMap { map, scale: 0.8 });
    b.quad(Vec3::new(-1.5, 0.25, -2.0), Vec3::X * 3.0, Vec3::Y * 1.5, shiny);
    b.unwrap(|p| [p.x * 0.5, p.y]);
    let lamp = b.emitter(Scattering::Diffuse { reflectance: Rgb::splat(0.25) }, Rgb::splat(6.0));
    b.0.materials[lamp].textures.emission = colors;
    b.quad(Vec3::new(-1.25, 2.5, -1.0), Vec3::X * 2.25, Vec3::Z * 2.0, lamp);
    b.unwrap(|p| [p.x * 0.4, p.z * 0.5]);
}

/// That, and a plain ball.
pub fn textured() -> Builder {
    let mut b = Builder::default();
    textures(&mut b);
    let ball = b.diffuse(0.8);
    b.sphere(DVec3::new(-0.5, 0.875, 0.0), 0.5, ball);
    view(&mut b);
    b
}

/// Glass that an image colours: a block, and a frosted ball that walks lead through.
pub fn stained_glass(b: &mut Builder) {
    let colors =
        image(&[Rgb::new(1.0, 0.2, 0.1), Rgb::new(0.1, 0.2, 0.9), Rgb::new(0.2, 0.9, 0.3), Rgb::new(1.0, 1.0, 0.3)]);
    let (block, ball) = (b.glass(1.5, 0.0), b.walked_glass(1.4, 0.3));
    // Its share of glass, and so the probability of that, varies as well.
    let milky = b.material(Scattering::MetallicRoughness(MetallicRoughness {
        base_color: Rgb::splat(0.9),
        metallic: 0.0,
        roughness: 0.0,
        specular: 0.0,
        transmission: 0.6,
        solid: true,
        ..MetallicRoughness::default()
    }));
    for material in [block, ball, milky] {
        b.0.materials[material].textures.color = colors.clone();
    }
    b.cuboid(Vec3::new(-1.2, 1.1, -0.6), Vec3::new(0.4, 1.3, 0.8), false, block);
    for i in b.0.meshes.len() - 6..b.0.meshes.len() {
        let mesh = Arc::make_mut(&mut b.0.meshes[i]);
        mesh.texture_coordinates = mesh.positions.iter().map(|p| [p[0] * 0.7, p[2] * 0.9]).collect();
    }
    b.mesh(icosphere(0.35, 2, true), ball, at(0.9, 0.6, 0.3));
    b.unwrap(|p| [p.x, p.y]);
    b.mesh(icosphere(0.3, 2, true), milky, at(0.2, 0.5, 0.9));
    b.unwrap(|p| [p.x, p.y]);
}

/// Under that sky: smooth and rough glass, metal, and a lamp.
pub fn under_a_sky() -> Builder {
    let mut b = environment();
    let glass = b.glass(1.5, 0.0);
    b.sphere(DVec3::new(0.1, 0.5, 0.9), 0.3, glass);
    b.0.environment = sky();
    b
}

/// A lamp in the shape of a sphere, near enough that next-event estimation, which draws from the cone it
/// fills, and emission, which draws from its whole area, differ much; and a small one.
pub fn sphere_lights() -> Builder {
    let mut b = Builder::default();
    stage(&mut b);
    let ball = b.diffuse(0.8);
    b.sphere(DVec3::new(-0.5, 0.875, 0.0), 0.5, ball);
    let (large, small) = (b.lamp(1.0), b.lamp(6.0));
    b.sphere(DVec3::new(0.75, 1.0, 0.0), 0.6, large);
    b.sphere(DVec3::new(-1.25, 1.75, 0.75), 0.2, small);
    view(&mut b);
    b
}

/// The camera in the middle of a glass ball, next to a diffuse ball in the same glass.
pub fn camera_in_glass() -> Builder {
    let mut b = lit(wide_lamp, plain_objects);
    let glass = b.absorbing(1.4, Rgb::new(0.1, 0.2, 0.3));
    b.sphere(DVec3::from(FROM), 0.75, glass);
    let near = b.diffuse(0.7);
    b.sphere(DVec3::new(0.2, 1.55, 3.8), 0.1, near);
    b
}

/// Camera, floor and balls in one block of glass, under a lamp outside. Light subpaths enter the glass
/// as power and meet camera subpaths that carry radiance: the squared index counts at every junction.
pub fn aquarium() -> Builder {
    let mut b = Builder::default();
    let glass = b.absorbing(1.5, Rgb::new(0.05, 0.1, 0.15));
    b.cuboid(Vec3::new(-1.5, -0.25, -1.5), Vec3::new(1.5, 1.75, 1.75), false, glass);
    let (floor, ball, other) = (b.diffuse(0.6), b.diffuse(0.8), b.diffuse(0.5));
    b.quad(Vec3::new(-1.25, 0.0, -1.25), Vec3::Z * 2.5, Vec3::X * 2.5, floor);
    b.sphere(DVec3::new(-0.4, 0.55, -0.2), 0.4, ball);
    b.sphere(DVec3::new(0.5, 0.5, 0.1), 0.3, other);
    let lamp = b.lamp(2.0);
    b.quad(Vec3::new(-2.0, 2.25, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, lamp);
    b.perspective([0.1, 1.1, 1.6], [0.0, 0.4, 0.0], 0.9);
    b
}

/// A lamp in the shape of a sphere in a glass ball, and a diffuse ball that shares the glass.
pub fn light_in_glass() -> Builder {
    let mut b = Builder::default();
    stage(&mut b);
    let glass = b.absorbing(1.5, Rgb::new(0.2, 0.4, 0.6));
    b.sphere(DVec3::new(0.0, 1.1, 0.0), 0.8, glass);
    let lamp = b.lamp(2.0);
    b.sphere(DVec3::new(0.2, 1.1, 0.0), 0.4, lamp);
    let near = b.diffuse(0.7);
    b.sphere(DVec3::new(-0.5, 1.1, 0.1), 0.15, near);
    view(&mut b);
    b
}

/// A lamp of one mesh, half within absorbing glass and half above it.
pub fn light_across_a_boundary() -> Builder {
    let mut b = Builder::default();
    stage(&mut b);
    let glass = b.absorbing(1.5, Rgb::new(0.5, 1.0, 2.0));
    b.cuboid(Vec3::new(-1.0, 0.3, -0.6), Vec3::new(1.0, 1.1, 0.6), false, glass);
    let lamp = b.lamp(2.0);
    b.cuboid(Vec3::new(-0.3, 0.7, -0.2), Vec3::new(0.3, 1.7, 0.2), false, lamp);
    let near = b.diffuse(0.7);
    b.sphere(DVec3::new(-0.65, 0.7, 0.1), 0.2, near);
    view(&mut b);
    b
}

/// Parallel projection of diffuse and glossy surfaces and rough glass; absorbing glass around a part of the film and
/// a ball before it.
pub fn orthographic() -> Builder {
    let mut b = rough_glass();
    let murky = b.absorbing(1.2, Rgb::new(0.5, 1.0, 2.0));
    let film = DVec3::from(FROM).as_vec3();
    b.cuboid(film + Vec3::new(0.25, -2.0, -0.75), film + Vec3::new(2.0, 2.0, 0.75), false, murky);
    let near = b.diffuse(0.8);
    b.sphere(DVec3::from(FROM) + DVec3::new(0.8, -0.3, -0.45), 0.25, near);
    b.0.cameras.clear();
    b.camera(FROM.into(), TO.into(), Projection::Orthographic { ymag: 1.4 });
    b
}

/// A floor under a lamp, seen from the front; without walls.
pub fn under_a_lamp(lamp_size: f32) -> Builder {
    let mut b = Builder::default();
    let white = b.diffuse(0.6);
    b.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, white);
    let lamp = b.lamp(4.0);
    let s = lamp_size;
    b.quad(Vec3::new(-s / 2.0, 3.0, -s / 2.0), Vec3::X * s, Vec3::Z * s, lamp);
    b.perspective([0.0, 1.8, 3.0], [0.0, 0.3, 0.0], 0.7);
    b
}
