//! Images on surfaces, held to what can be had without them.

mod common;

use caustica::math::Rgb;
use caustica::render::Integrator;
use caustica::scene::description::*;
use caustica::scene::{CommitOptions, World};
use common::{Builder, image, run, settings};
use glam::{Affine2, DAffine3, DVec3, Vec2, Vec3};

/// Four colours, of which the last is black.
const COLORS: [Rgb; 4] = [Rgb::new(0.9, 0.1, 0.2), Rgb::new(0.2, 0.8, 0.1), Rgb::new(0.1, 0.3, 0.9), Rgb::ZERO];

/// Four tiles of 1 m, two by two, `of` a material for a number; one mesh for each, or for all.
fn tiles(tiled: bool, of: impl Fn(&mut Builder, Option<usize>) -> usize) -> World {
    let mut b = Builder::default();
    let low = Vec3::new(-1.0, 0.0, -1.0);
    if tiled {
        for i in 0..4 {
            let material = of(&mut b, Some(i));
            let corner = low + Vec3::new((i % 2) as f32, 0.0, (i / 2) as f32);
            b.quad(corner, Vec3::Z, Vec3::X, material);
        }
    } else {
        let material = of(&mut b, None);
        b.quad(low, Vec3::Z * 2.0, Vec3::X * 2.0, material);
        b.unwrap(|p| [0.5 + 0.5 * p.x, 0.5 + 0.5 * p.z]);
    }
    let white = b.diffuse(0.5);
    b.sphere(DVec3::new(0.0, 1.0, 0.0), 0.25, white);
    b.0.environment = Rgb::splat(0.3).into();
    b.perspective([0.0, 3.0, 1.0], [0.0, 0.0, 0.0], 0.8);
    b.commit()
}

fn nearest(texels: &[Rgb]) -> Option<TextureMap> {
    image(texels).map(|map| TextureMap { filter: Filter::Nearest, ..map })
}

/// An image of as many texels as there are tiles is as good as tiles: in the light they give too. `exact`: with the same random
/// numbers, but for rounding.
fn as_good_as_tiles(what: &str, exact: bool, of: impl Fn(&mut Builder, Option<usize>) -> usize) {
    let picture = |tiled| {
        let world = tiles(tiled, &of);
        let output = run(&world, &settings(Integrator::Path, 32, 256, 1));
        output.image.pixels
    };
    let (tiled, textured) = (picture(true), picture(false));
    let mean = |pixels: &[Rgb]| pixels.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / pixels.len() as f64;
    let (a, b) = (mean(&tiled), mean(&textured));
    println!("{what}: {a} and {b}");
    let (mean, one) = if exact { (1e-5, 1e-4) } else { (0.01, 0.25) };
    assert!((a / b - 1.0).abs().max_element() < mean, "{what}: {a} and {b}");
    let near = |(a, b): (&Rgb, &Rgb)| (*a - *b).abs().max_element() < one * (0.2 + a.max_element());
    let like = tiled.iter().zip(&textured).filter(|&pair| near(pair)).count();
    // A path at the edge of a tile may go another way.
    assert!(like > 1000, "{what}: {like} of 1024 pixels are alike");
}

#[test]
fn colors() {
    as_good_as_tiles("diffuse", true, |b, tile| {
        let factor = Rgb::new(0.9, 1.0, 0.8);
        let color = tile.map_or(factor, |i| factor * COLORS[i]);
        let material = b.material(Scattering::Diffuse { reflectance: color });
        b.0.materials[material].textures.color = if tile.is_none() { nearest(&COLORS) } else { None };
        material
    });
    as_good_as_tiles("metal", true, |b, tile| {
        let reflectance = tile.map_or(Rgb::ONE, |i| COLORS[i]);
        let material = b.material(Scattering::Conductor { reflectance, roughness: 0.3 });
        b.0.materials[material].textures.color = if tile.is_none() { nearest(&COLORS) } else { None };
        material
    });
}

#[test]
fn roughness_and_metal() {
    let texels =
        [Rgb::new(0.3, 1.0, 0.0), Rgb::new(0.9, 0.5, 1.0), Rgb::new(0.1, 0.25, 0.5), Rgb::new(0.0, 0.75, 0.25)];
    as_good_as_tiles("metallic-roughness", true, |b, tile| {
        let texel = tile.map_or(Rgb::ONE, |i| texels[i]);
        let material = b.material(Scattering::MetallicRoughness(MetallicRoughness {
            base_color: Rgb::new(0.8, 0.6, 0.3),
            metallic: 0.9 * texel.z,
            roughness: 0.8 * texel.y,
            ..MetallicRoughness::default()
        }));
        b.0.materials[material].textures.metallic_roughness = if tile.is_none() { nearest(&texels) } else { None };
        material
    });
}

#[test]
fn emission() {
    as_good_as_tiles("lamp", false, |b, tile| {
        let emission = tile.map_or(Rgb::splat(2.0), |i| 2.0 * COLORS[i]);
        let material = b.emitter(Scattering::Diffuse { reflectance: Rgb::splat(0.3) }, emission);
        b.0.materials[material].textures.emission = if tile.is_none() { nearest(&COLORS) } else { None };
        material
    });
}

/// One texel of very many glows, and none of the points that tell the lamp's power see it: it is a light for all that.
#[test]
fn a_lamp_is_not_lost_for_its_darkness() {
    let mut texels = vec![Rgb::ZERO; 1024 * 1024];
    texels[700 * 1024 + 301] = Rgb::ONE;
    let mut b = Builder::default();
    let lamp = b.lamp(1.0);
    b.quad(Vec3::ZERO, Vec3::Z, Vec3::X, lamp);
    b.unwrap(|p| [p.x, p.z]);
    b.0.materials[lamp].textures.emission = nearest(&texels);
    assert_eq!(b.commit().lights.len(), 1);
    b.0.materials[lamp].textures.emission = image(&[Rgb::ZERO]);
    assert_eq!(b.commit().lights.len(), 0);
}

/// Where an image is placed: turned, scaled and shifted texture coordinates, on a mirrored instance.
#[test]
fn transforms() {
    let mut b = Builder::default();
    let lamp = b.emitter(Scattering::Diffuse { reflectance: Rgb::ZERO }, Rgb::ONE);
    b.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, lamp);
    b.unwrap(|p| [p.x, p.z]);
    b.0.instances[0].transform = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let map = nearest(&[0.1, 0.2, 0.3, 0.4].map(Rgb::splat)).expect("a map");
    // A quarter turn and a shift: (x, z) is at (-z, x) of the image, 0 in its middle.
    let transform =
        Affine2::from_scale_angle_translation(Vec2::splat(0.5), std::f32::consts::FRAC_PI_2, Vec2::splat(0.5));
    b.0.materials[lamp].textures.emission = Some(TextureMap { transform, ..map });
    b.0.camera_above();
    let pixels = run(&b.commit(), &settings(Integrator::Path, 2, 4, 1)).image.pixels;
    // From the top left: x < 0 and z < 0, and so on; x of the mesh is the other way round. (x, z) = (0.5, -0.5) is at
    // (0.75, 0.75).
    assert_eq!(pixels.iter().map(|p| p.x).collect::<Vec<_>>(), [0.4, 0.2, 0.3, 0.1]);
}

/// A normal map of one colour is as good as the normals of vertices that lean like it, wherever the image lies on the mesh.
#[test]
fn normals() {
    // 0.6 to the right in the image, 0.48 down, 0.64 out.
    let texel = Rgb::new(0.8, 0.26, 0.82);
    for (name, turned, mirrored) in [("as it is", 0.0, false), ("turned", 1.0f32, false), ("mirrored", 0.5, true)] {
        // The image's directions over the floor, of which x is right and z down.
        let (sin, cos) = turned.sin_cos();
        let (right, down) = (Vec3::new(cos, 0.0, sin), Vec3::new(-sin, 0.0, cos) * if mirrored { -1.0 } else { 1.0 });
        let leaning = right * 0.6 + down * 0.48 + Vec3::Y * 0.64;
        let picture = |mapped: bool, integrator| {
            let mut b = Builder::default();
            let floor = b.diffuse(0.8);
            b.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, floor);
            b.unwrap(|p| [3.0 * p.dot(right), 5.0 * p.dot(down)]);
            let mesh = std::sync::Arc::make_mut(&mut b.0.meshes[0]);
            if mapped {
                let map = image(&[(texel - 0.5) / Vec3::new(2.0, 2.0, 1.0) + 0.5]).expect("a map");
                b.0.materials[floor].textures.normal = Some(NormalMap { map, scale: 2.0 });
            } else {
                mesh.normals = vec![leaning.to_array(); 4];
            }
            let ball = b.diffuse(0.8);
            b.sphere(DVec3::new(0.3, 0.5, 0.2), 0.3, ball);
            let lamp = b.lamp(4.0);
            b.quad(Vec3::new(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, lamp);
            b.perspective([0.0, 2.0, 2.0], [0.0, 0.0, 0.0], 0.8);
            run(&b.commit(), &settings(integrator, 24, 64, 3)).image.pixels
        };
        for integrator in [Integrator::Path, Integrator::Bdpt] {
            let (mapped, leaning) = (picture(true, integrator), picture(false, integrator));
            let off = mapped
                .iter()
                .zip(&leaning)
                .filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3 * (0.1 + a.x))
                .count();
            assert!(off <= 6, "{name}, {integrator:?}: {off} of 576 pixels differ");
        }
    }
}

trait Above {
    fn camera_above(&mut self);
}

impl Above for Description {
    /// Looks down on x to the right and z downward.
    fn camera_above(&mut self) {
        let matrix = glam::DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
        let transform = DAffine3::from_mat3_translation(matrix, DVec3::Y);
        self.cameras.push(Camera::new("", transform, Projection::Orthographic { ymag: 1.0 }));
    }
}

fn floor(color: Option<TextureMap>) -> Builder {
    let mut b = Builder::default();
    let material = b.diffuse(0.8);
    b.0.materials[material].textures.color = color;
    b.quad(Vec3::ZERO, Vec3::Z, Vec3::X, material);
    b.unwrap(|p| [p.x, p.z]);
    b.0.environment = Rgb::ONE.into();
    b
}

#[test]
fn what_is_wrong_is_named() {
    let error = |b: &Builder| match World::commit(&b.0, CommitOptions::default()) {
        Ok(_) => panic!("committed"),
        Err(error) => error.to_string(),
    };
    let b = floor(image(&[Rgb::splat(1.5)]));
    assert!(
        error(&b).contains(
            "material 0 'material 0': textures.color is (0.8, 0.8, 0.8) times an image of up to (1.5, 1.5, 1.5)"
        ),
        "{}",
        error(&b)
    );
    let mut b = floor(image(&[Rgb::ONE]));
    b.unwrap(|p| [p.x, f32::NAN]);
    assert!(error(&b).contains("texture_coordinates[0].v is NaN"), "{}", error(&b));
    std::sync::Arc::make_mut(&mut b.0.meshes[0]).texture_coordinates.pop();
    assert!(error(&b).contains("texture_coordinates.len() is 3"), "{}", error(&b));
    let mut b = floor(None);
    b.0.materials[0].textures.metallic_roughness = image(&[Rgb::ONE]);
    assert!(error(&b).contains("textures.metallic_roughness is given; the metallic-roughness model"), "{}", error(&b));
    let mut b = floor(None);
    b.0.materials[0].scattering = Scattering::Dielectric {
        inside: Medium::new(1.5, Rgb::ZERO),
        outside: Medium::VACUUM,
        roughness: 0.0,
        tint: Rgb::ONE,
    };
    b.0.materials[0].textures.normal = image(&[Rgb::ONE]).map(|map| NormalMap { map, scale: 1.0 });
    assert!(error(&b).contains("textures.normal is given; a surface that does not refract"), "{}", error(&b));
    let mut map = image(&[Rgb::ONE]);
    map.as_mut().expect("a map").transform.translation.x = f32::INFINITY;
    assert!(error(&floor(map)).contains("textures.color.transform is"));
}

#[test]
fn without_coordinates_a_texture_is_left_out_with_a_warning() {
    let mut b = floor(image(&[Rgb::splat(0.25)]));
    std::sync::Arc::make_mut(&mut b.0.meshes[0]).texture_coordinates.clear();
    let warnings = b.commit().warnings;
    let expected = "instance 0 'instance 0': it has no texture coordinates: the textures of its material 'material 0' are left out";
    assert_eq!(warnings.iter().map(ToString::to_string).collect::<Vec<_>>(), [expected]);
    // An image of a lamp may be black all over.
    let mut b = floor(None);
    (b.0.materials[0].emission, b.0.environment) = (Rgb::ONE, Rgb::ZERO.into());
    assert!(!b.commit().lights.is_empty());
    b.0.materials[0].textures.emission = image(&[Rgb::splat(0.25)]);
    assert!(!b.commit().lights.is_empty());
    std::sync::Arc::make_mut(&mut b.0.meshes[0]).texture_coordinates.clear();
    let world = b.commit();
    assert!(world.lights.is_empty() && world.warnings[0].text.ends_with("left out, and its light with them"));
}

/// What a texture or its place changes is another scene, but the same shapes.
#[test]
fn fingerprints() {
    let hash = |b: &Builder| b.commit().hash();
    let mut b = floor(image(&[Rgb::splat(0.25)]));
    let mut hashes = vec![
        hash(&b),
        hash(&floor(None)),
        hash(&floor(image(&[Rgb::splat(0.5)]))),
        hash(&floor(nearest(&[Rgb::splat(0.25)]))),
    ];
    b.unwrap(|p| [p.x, 2.0 * p.z]);
    hashes.push(hash(&b));
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), 5);
    let (plain, other) = (floor(None).commit(), floor(image(&[Rgb::ONE])));
    let after = World::commit_after(Some(&plain), &other.0, CommitOptions::default()).expect("a valid scene");
    assert!(std::sync::Arc::ptr_eq(&plain.shapes, &after.shapes));
}
