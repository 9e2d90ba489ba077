//! Cameras: the two ways through the film are inverse to each other, and the density is right.

use super::*;
use crate::math::{Sampler, Stream, chi_square, warp};
use description::Projection::{Orthographic, Perspective};
use glam::{DAffine3, DQuat};
use std::f64::consts::PI;

const WIDTH: u32 = 160;
const HEIGHT: u32 = 90;

fn camera(projection: description::Projection, transform: DAffine3) -> Camera {
    let description = description::Camera::new("", transform, projection);
    Camera::new(&description, WIDTH, HEIGHT, Region::all(WIDTH, HEIGHT))
}

/// Of each kind: plain, with its film moved, behind a point of a lens.
fn of_each_kind() -> Vec<Camera> {
    let mut random = Sampler::new(6, 0, 0, Stream::Camera);
    let perspective = description::Camera::new("", pose(), Perspective { yfov: 1.2 });
    let parallel = description::Camera::new("", pose(), Orthographic { ymag: 2.5 });
    let shift = DVec2::new(0.3, -0.2);
    let lens = Some(Lens { radius: 0.2, focus: 3.0 });
    let described = [
        perspective.clone(),
        description::Camera { shift, ..perspective.clone() },
        description::Camera { shift, lens, ..perspective },
        parallel.clone(),
        description::Camera { shift, ..parallel },
    ];
    let all = Region::all(WIDTH, HEIGHT);
    described.iter().map(|d| Camera::new(d, WIDTH, HEIGHT, all).sample(&mut random).into_owned()).collect()
}

/// Rotated, moved and unevenly scaled.
fn pose() -> DAffine3 {
    let rotation = DQuat::from_euler(glam::EulerRot::YXZ, 0.7, -0.4, 0.2);
    DAffine3::from_scale_rotation_translation(DVec3::new(2.0, 0.5, 3.0), rotation, DVec3::new(1.0, 2.0, -3.0))
}

fn random() -> Sampler {
    Sampler::new(5, 0, 0, Stream::Camera)
}

#[test]
fn a_plain_camera_looks_along_minus_z_with_y_up() {
    let c = camera(Perspective { yfov: 0.8 }, DAffine3::IDENTITY);
    let tan = 0.4f32.tan();
    let close = |raster: Vec2, expected: Vec3| {
        let (origin, direction) = c.generate(raster);
        assert_eq!(origin, Vec3::ZERO);
        assert!((direction - expected.normalize()).length() < 1e-6, "{raster}: {direction}");
    };
    let aspect = 16.0 / 9.0;
    close(Vec2::new(80.0, 45.0), Vec3::NEG_Z);
    close(Vec2::ZERO, Vec3::new(-tan * aspect, tan, -1.0));
    close(Vec2::new(160.0, 90.0), Vec3::new(tan * aspect, -tan, -1.0));

    let c = camera(Orthographic { ymag: 1.5 }, DAffine3::from_translation(DVec3::new(0.0, 0.0, 7.0)));
    let (origin, direction) = c.generate(Vec2::ZERO);
    assert!((origin - Vec3::new(-1.5 * aspect, 1.5, 7.0)).length() < 1e-6);
    assert_eq!(direction, Vec3::NEG_Z);
}

#[test]
fn a_region_is_a_smaller_film() {
    let region = Region { x: 40, y: 10, width: 32, height: 45 };
    for projection in [Perspective { yfov: 1.0 }, Orthographic { ymag: 1.5 }] {
        let description = description::Camera::new("", pose(), projection);
        let (whole, part) = (camera(projection, pose()), Camera::new(&description, WIDTH, HEIGHT, region));
        let share = region.pixels() as f64 / f64::from(WIDTH * HEIGHT);
        let mut random = random();
        let mut seen = 0;
        for _ in 0..20_000 {
            let raster = random.next_2d() * Vec2::new(WIDTH as f32, HEIGHT as f32);
            let (origin, direction) = whole.generate(raster);
            assert_eq!((origin, direction), part.generate(raster));
            let p = origin + direction * 3.0;
            let (of_whole, of_part) = (whole.connect(p), part.connect(p));
            let Some(found) = of_part else {
                let at = of_whole.map_or(raster, |found| found.raster);
                assert_eq!(region.number(at.x as u32, at.y as u32), None, "{at}");
                continue;
            };
            seen += 1;
            let expected = of_whole.expect("what a part sees, the whole sees");
            assert!((found.density * share / expected.density - 1.0).abs() < 1e-12);
            assert_eq!(CameraConnection { density: expected.density, ..found }, expected);
            assert!(region.number(found.raster.x as u32, found.raster.y as u32).is_some(), "{found:?}");
        }
        assert!((f64::from(seen) / 20_000.0 - share).abs() < 0.02, "{seen}");
    }
}

#[test]
fn a_direction_is_seen_where_it_left_at_any_distance_from_the_origin() {
    let mut random = random();
    for x in [0.0, 1e4, 1e8] {
        let c = camera(Perspective { yfov: 0.01 }, DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)) * pose());
        for _ in 0..1000 {
            let raster = random.next_2d() * Vec2::new(159.9, 89.9) + 0.05;
            let seen = c.raster_of(c.generate(raster).1).unwrap_or_else(|| panic!("{raster} is not seen"));
            assert!((seen - raster).length() < 0.02, "{raster}: {seen}");
        }
        assert_eq!(c.raster_of(-c.generate(Vec2::new(80.0, 45.0)).1), None);
    }
}

#[test]
fn a_ray_through_the_film_is_seen_where_it_left() {
    for c in of_each_kind() {
        let mut random = random();
        for _ in 0..20_000 {
            let raster = random.next_2d() * Vec2::new(159.99, 89.99) + 0.005;
            let distance = 10f32.powf(6.0 * random.next_1d() - 2.0);
            let (origin, direction) = c.generate(raster);
            assert!((direction.length() - 1.0).abs() < 1e-6);
            let p = origin + direction * distance;
            // Rounding of p, seen from its distance, in pixels.
            let tolerance = 4e-5 * (1.0 + p.abs().max_element() / distance.min(5.0)) * 2.0;
            let Some(seen) = c.connect(p) else { panic!("{raster} at {distance} is not seen") };
            assert!((seen.raster - raster).length() < tolerance.max(1e-3), "{raster} at {distance}: {seen:?}");
            let angular = 1e-6 * (1.0 + 5.0 / distance);
            assert!((seen.wi + direction).length() < angular, "{seen:?}, {direction}");
            assert!((seen.target - origin).length() < 1e-6 * (5.0 + p.abs().max_element()), "{seen:?}, {origin}");
            let density = c.density(direction, distance);
            assert!((seen.density / density - 1.0).abs() < f64::from(10.0 * angular), "{seen:?}, {density}");
        }
    }
}

#[test]
fn the_density_of_a_connection_is_that_of_its_ray() {
    for c in of_each_kind() {
        let mut random = random();
        let mut seen = 0;
        for _ in 0..1000 {
            let p = Vec3::new(1.0, 2.0, -3.0) + warp::sphere(random.next_2d()) * 5.0;
            if let Some(s) = c.connect(p) {
                let distance = s.target.as_dvec3().distance(p.as_dvec3()) as f32;
                let relative = s.density / c.density(-s.wi, distance) - 1.0;
                assert!(relative.abs() < 1e-6);
                seen += 1;
            }
        }
        assert!(seen > 50);
    }
}

#[test]
fn points_beside_and_behind_are_not_seen() {
    for projection in [Perspective { yfov: 1.0 }, Orthographic { ymag: 0.5 }] {
        let c = camera(projection, DAffine3::IDENTITY);
        assert!(c.connect(Vec3::new(0.0, 0.0, -1.0)).is_some());
        assert!(c.connect(Vec3::new(0.0, 0.0, 1.0)).is_none());
        assert!(c.connect(Vec3::new(0.0, 0.6, -1.0)).is_none());
        assert!(c.connect(Vec3::new(-1.1, 0.0, -1.0)).is_none());
        assert!(c.connect(Vec3::ZERO).is_none());
    }
}

#[test]
fn primary_rays_follow_their_density() {
    // Film positions are uniform. Two tests, together wrong by chance with 1 %.
    let film = |random: &mut Sampler| random.next_2d() * Vec2::new(WIDTH as f32, HEIGHT as f32);
    let mut random = random();
    let c = camera(Perspective { yfov: 1.7 }, pose());
    let Endpoint::Point(origin) = c.endpoint() else { panic!("a pinhole is a point") };
    let sample = || Some(c.generate(film(&mut random)).1);
    // The density per area at unit distance is the one per solid angle.
    let density = |w: Vec3| if c.connect(origin + w).is_some() { c.density(w, 1.0) } else { 0.0 };
    let fit = chi_square::sphere(100_000, [24, 24], sample, density);
    assert!((fit.integral - 1.0).abs() < 1e-4, "{fit:?}");
    fit.assert_accepted("pinhole", 2);

    let c = camera(Orthographic { ymag: 2.5 }, pose());
    let Endpoint::Infinite(back) = c.endpoint() else { panic!("parallel projection ends at infinity") };
    let (center, _) = c.generate(Vec2::new(80.0, 45.0));
    let x = back.any_orthonormal_vector();
    let y = back.cross(x);
    let sample = || {
        let (o, d) = c.generate(film(&mut random));
        assert!((d + back).length() < 1e-6);
        assert!((o - center).dot(back).abs() < 1e-5, "rays start on the plane of the camera");
        Some([f64::from((o - center).dot(x)), f64::from((o - center).dot(y))])
    };
    let density = |a: f64, b: f64| {
        let p = center + x * a as f32 + y * b as f32 - back;
        if c.connect(p).is_some() { c.density(-back, 1.0) } else { 0.0 }
    };
    let fit = chi_square::rectangle(-6.0..6.0, -6.0..6.0, 100_000, [24, 24], sample, density);
    assert!((fit.integral - 1.0).abs() < 1e-3, "{fit:?}");
    fit.assert_accepted("parallel", 2);
}

#[test]
fn importance_over_a_patch_is_its_share_of_the_film() {
    // A small patch facing the pinhole: the integral of the density is the share of the film it covers.
    let c = camera(Perspective { yfov: 1.0 }, DAffine3::IDENTITY);
    let film_area = (2.0 * 0.5f64.tan()).powi(2) * 16.0 / 9.0;
    for p in [Vec3::new(0.0, 0.0, -2.0), Vec3::new(1.0, 0.5, -1.6), Vec3::new(-0.6, 0.4, -1.0)] {
        let s = c.connect(p).unwrap();
        // A unit of perpendicular area at p covers 1 / (depth² cos) of the plane at unit distance,
        // by way of a plane parallel to the film.
        let depth = f64::from(-p.z);
        let cos = depth / p.as_dvec3().length();
        let expected = 1.0 / (cos * depth * depth * film_area);
        assert!((s.density / expected - 1.0).abs() < 1e-5, "{p}: {}, expected {expected}", s.density);
    }
    assert!((PI * c.density(Vec3::NEG_Z, 1.0) - PI / film_area).abs() < 1e-5);
}

#[test]
fn a_lens_is_sharp_at_its_focus_alone() {
    let (yfov, lens) = (0.9f64, Lens { radius: 0.25, focus: 4.0 });
    let plain = description::Camera::new("", pose(), Perspective { yfov });
    let description = description::Camera { lens: Some(lens), ..plain.clone() };
    let c = Camera::new(&description, WIDTH, HEIGHT, Region::all(WIDTH, HEIGHT));
    let pinhole = camera(Perspective { yfov }, pose());
    assert!(!c.is_point() && pinhole.is_point());
    let mut random = random();
    // Pixels per unit of the film at unit distance.
    let scale = 0.5 * f64::from(HEIGHT) / (0.5 * yfov).tan();
    for depth in [1.5, lens.focus, 40.0] {
        let raster = Vec2::new(50.0, 60.0);
        let (origin, direction) = pinhole.generate(raster);
        let p = origin + direction * (depth as f32 / pinhole.depth(origin + direction));
        let (mut sum, mut squares, mut largest) = (DVec2::ZERO, 0.0, 0f64);
        const N: u32 = 20_000;
        for _ in 0..N {
            let opened = c.sample(&mut random);
            let seen = opened.connect(p).expect("within the film");
            // What the lens adds to the camera lies in its plane.
            assert!(pinhole.depth(seen.target).abs() < 1e-6 && seen.target.distance(origin) < 0.2501);
            let offset = (seen.raster - raster).as_dvec2() / scale;
            sum += offset;
            squares += offset.length_squared();
            largest = largest.max(offset.length());
        }
        // Of a disc of uniform density: the circle of confusion.
        let radius = lens.radius * (1.0 / lens.focus - 1.0 / depth).abs();
        let n = f64::from(N);
        assert!(largest < radius + 1e-5 && largest > 0.99 * radius - 1e-5, "{depth}: {largest}, {radius}");
        assert!((sum / n).length() < 5.0 * radius / n.sqrt() + 1e-6, "{depth}: {sum}");
        // The squared distance from the middle is uniform in [0, radius²]: standard error radius² / sqrt(12 n).
        assert!((squares / n - 0.5 * radius * radius).abs() < 5.0 * radius * radius / (12.0 * n).sqrt() + 1e-9);
    }
}

#[test]
fn a_film_that_is_moved_sees_what_lies_there() {
    let c = |shift| {
        let plain = description::Camera::new("", DAffine3::IDENTITY, Perspective { yfov: 0.8 });
        Camera::new(&description::Camera { shift, ..plain }, WIDTH, HEIGHT, Region::all(WIDTH, HEIGHT))
    };
    let (tan, aspect) = (0.4f32.tan(), 16.0 / 9.0);
    // By half a height up: the horizon is the picture's lower edge. By half a width to the right: its left edge.
    for (shift, raster) in
        [(DVec2::new(0.0, 0.5), Vec2::new(80.0, 90.0)), (DVec2::new(8.0 / 9.0, 0.0), Vec2::new(0.0, 45.0))]
    {
        let c = c(shift);
        let (_, direction) = c.generate(raster);
        assert!((direction - Vec3::NEG_Z).length() < 1e-6, "{shift}: {direction}");
        let (_, direction) = c.generate(Vec2::new(80.0, 45.0));
        let middle = Vec3::new(shift.x as f32 * 2.0 * tan, shift.y as f32 * 2.0 * tan, -1.0).normalize();
        assert!((direction - middle).length() < 1e-6, "{shift}: {direction}");
    }
    assert!(c(DVec2::new(0.5, 0.0)).connect(Vec3::new(-0.5 * tan * aspect, 0.0, -1.0)).is_none());
}
