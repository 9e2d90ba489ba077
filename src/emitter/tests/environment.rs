//! Images of what surrounds a scene: which pixel is where, and how directions are drawn.

use super::*;
use crate::math::chi_square::{integrate_sphere, sphere};
use glam::DMat3;
use std::sync::Arc;

fn map(width: usize, height: usize, pixels: Vec<Rgb>) -> EnvironmentMap {
    EnvironmentMap::new(width, height, pixels).unwrap()
}

/// Dim and uneven, with a sun of one pixel, a row of black and a black pole.
pub(super) fn sky() -> EnvironmentMap {
    let pixel = |i: usize| match (i % 8, i / 8) {
        (2, 1) => Rgb::new(40.0, 35.0, 20.0),
        (_, 2) | (_, 5) => Rgb::ZERO,
        (x, y) => Rgb::new(0.1 + 0.1 * x as f32, 0.5, 0.2 * y as f32),
    };
    map(8, 6, (0..48).map(pixel).collect())
}

pub(super) fn turned(map: EnvironmentMap, radiance: Rgb) -> Environment {
    let rotation = DMat3::from_rotation_y(2.0) * DMat3::from_rotation_x(0.7);
    Environment { radiance, image: Some(Arc::new(map)), rotation }
}

/// As OpenEXR defines its latitude-longitude maps: the longitude, 0 at +z and a quarter at +x, falls from the left to the
/// right, the latitude from the top to the bottom.
fn center(column: usize, row: usize, (width, height): (usize, usize)) -> Vec3 {
    let longitude = std::f32::consts::PI * (1.0 - (2 * column + 1) as f32 / width as f32);
    let latitude = std::f32::consts::PI * (0.5 - (row as f32 + 0.5) / height as f32);
    Vec3::new(latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos())
}

#[test]
fn the_centre_of_a_pixel_has_its_value() {
    for (width, height) in [(1, 1), (1, 2), (2, 1), (8, 6), (37, 11)] {
        let value = |i: usize| Rgb::new(1.0 + i as f32, 0.5 * i as f32, 3.0);
        let map = map(width, height, (0..width * height).map(value).collect());
        for i in 0..width * height {
            let seen = map.radiance(center(i % width, i / width, map.size()));
            assert!((seen - value(i)).abs().max_element() < 2e-3, "{width}x{height} {i}: {seen}");
        }
    }
    let map = map(4, 2, (0..8).map(|i| Rgb::splat(i as f32)).collect());
    let near = |d: Vec3, x: f32| assert!((map.radiance(d.normalize()).x - x).abs() < 1e-5, "{d}: {}", map.radiance(d));
    // A quarter from the left is +x, the middle +z; these lie on the edges between pixels.
    near(Vec3::new(1.0, 1.0, 0.0), 0.5);
    near(Vec3::new(0.0, 1.0, 1.0), 1.5);
    near(Vec3::new(-1.0, -1.0, 0.0), 6.5);
    // The seam: half of the first column, half of the last.
    near(Vec3::new(0.0, 1.0, -1.0), 1.5);
    // Half of each row at the horizon.
    near(Vec3::X, 2.5);
}

#[test]
fn what_is_shown_is_continuous() {
    let map = sky();
    let mut random = random(1);
    for i in 0..20_000 {
        let around = |u: glam::Vec2| crate::math::warp::sphere(u);
        // A tenth near the poles, where all columns meet.
        let d = match i % 20 {
            0 => (Vec3::Y + 1e-3 * around(random.next_2d())).normalize(),
            1 => (Vec3::NEG_Y + 1e-3 * around(random.next_2d())).normalize(),
            _ => around(random.next_2d()),
        };
        let near = (d + 1e-6 * around(random.next_2d())).normalize();
        let (a, b) = (map.radiance(d), map.radiance(near));
        // At the poles a step crosses columns; a pixel there has a thousandth of the radius at least.
        let steps = 1e-6 / (1.0 - d.y * d.y).max(1e-12).sqrt().min(1.0);
        assert!((a - b).abs().max_element() < 40.0 * (8.0 * steps + 1e-5), "{d} {near}: {a} {b}");
        assert!((map.density(d) - map.density(near)).abs() < 40.0 * (8.0 * f64::from(steps) + 1e-5));
    }
}

#[test]
fn directions_are_drawn_by_luminance() {
    for (k, map) in [sky(), map(1, 1, vec![Rgb::ONE]), map(1, 2, vec![Rgb::ONE, Rgb::ZERO])].iter().enumerate() {
        let mut random = random(70 + k as u64);
        let total = map.total().dot(LUMINANCE);
        let integral = integrate_sphere(|d| map.density(d));
        assert!((integral - 1.0).abs() < 1e-4, "{integral}");
        let integral = integrate_sphere(|d| map.radiance(d).as_dvec3().dot(LUMINANCE));
        assert!((integral / total - 1.0).abs() < 1e-4, "{integral} {total}");
        for _ in 0..10_000 {
            let d = map.sample(random.next_2d());
            assert!((d.length() - 1.0).abs() < 1e-6);
            let (density, seen) = (map.density(d), map.radiance(d).as_dvec3().dot(LUMINANCE));
            assert!((density * total / seen - 1.0).abs() < 1e-3, "{d}: {density} of {seen}");
        }
        sphere(100_000, [24, 24], || Some(map.sample(random.next_2d())), |d| map.density(d))
            .assert_accepted(&format!("map {k}"), 3);
    }
}

/// A sun of one pixel among 8 million: it is drawn, where it is, and as often as it shines.
#[test]
fn a_tiny_sun_is_found() {
    let (width, height) = (4096, 2048);
    let mut pixels = vec![Rgb::splat(0.5); width * height];
    let sun = (1000, 300);
    pixels[sun.1 * width + sun.0] = Rgb::splat(1e6);
    let map = map(width, height, pixels);
    let toward = center(sun.0, sun.1, (width, height));
    let share = 1.0 - 0.5 * 4.0 * std::f64::consts::PI / map.total().x;
    let mut random = random(5);
    let n = 20_000;
    let close = (0..n).filter(|_| map.sample(random.next_2d()).dot(toward) > 1.0 - 4e-6).count() as f64 / f64::from(n);
    assert!((close - share).abs() < 4.0 * (share * (1.0 - share) / f64::from(n)).sqrt(), "{close} {share}");
    let seen = map.radiance(toward);
    assert!(seen.x > 0.9e6 && map.density(toward) > 0.9 * 1e6 / map.total().x);
}

#[test]
fn extreme_images() {
    let mut random = random(6);
    for scale in [1e-38f32, 1e-30, 1.0, 1e30, 3e38] {
        let map = map(3, 2, [0.0, 1.0, 0.5, 0.25, 0.0, 1.0].map(|x| Rgb::splat(x * scale)).to_vec());
        for _ in 0..1000 {
            let d = map.sample(random.next_2d());
            let (density, seen) = (map.density(d), map.radiance(d));
            assert!(density > 0.0 && density.is_finite() && seen.is_finite(), "{scale}: {d} {density} {seen}");
        }
    }
    // Directions that rounding can make: the poles, the seam, and between two pixels.
    let map = sky();
    for d in [Vec3::Y, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::new(-0.0, 0.0, -1.0), Vec3::new(1e-20, 1.0, -1e-30)] {
        assert!(map.radiance(d).is_finite() && map.density(d).is_finite(), "{d}");
    }
}

#[test]
fn what_is_no_image_is_refused() {
    let error = |width, height, pixels| EnvironmentMap::new(width, height, pixels).err().unwrap().to_string();
    assert!(error(0, 1, vec![]).contains("0 x 1"));
    assert!(error(2, 2, vec![Rgb::ONE; 3]).contains("2 x 2 with 3 pixels"));
    assert!(error(1 << 17, 1, vec![Rgb::ONE; 1 << 17]).contains("131072 x 1"));
    let bad = vec![Rgb::ONE, Rgb::ONE, Rgb::ONE, Rgb::new(1.0, f32::NAN, 2.0)];
    assert!(error(2, 2, bad).contains("pixel (1, 1) is 1 NaN 2"));
    assert!(error(1, 1, vec![Rgb::splat(f32::INFINITY)]).contains("inf"));
    // Below zero is none.
    assert_eq!(map(1, 1, vec![Rgb::new(-0.1, 1.0, -3.0)]).radiance(Vec3::X), Rgb::new(0.0, 1.0, 0.0));
    // A black image is no light, and neither is one behind a filter that keeps all of it back.
    assert!(scene(vec![], &[], turned(map(1, 1, vec![Rgb::ZERO]), Rgb::ONE)).lights.is_empty());
    assert!(scene(vec![], &[], turned(map(1, 1, vec![Rgb::X]), Rgb::Y)).lights.is_empty());
}

#[test]
fn a_rotation_turns_what_is_seen() {
    let image = Arc::new(sky());
    let rotation = DMat3::from_rotation_y(0.5 * std::f64::consts::PI);
    let of = |rotation| Environment { radiance: Rgb::splat(2.0), image: Some(image.clone()), rotation };
    let (plain, turned) = (scene(vec![], &[], of(DMat3::IDENTITY)), scene(vec![], &[], of(rotation)));
    let m = rotation.as_mat3();
    assert!((m * Vec3::Z - Vec3::X).length() < 1e-6, "from +z to +x");
    for d in [Vec3::new(0.3, 0.5, 0.2), Vec3::new(-0.7, -0.1, 0.4)].map(Vec3::normalize) {
        let (a, b) =
            (plain.lights.escape(CENTER, d).unwrap(), turned.lights.escape(CENTER, (m * d).normalize()).unwrap());
        assert!((a.0 - b.0).abs().max_element() < 1e-4, "{a:?} {b:?}");
        assert!((a.0 - 2.0 * image.radiance(d)).abs().max_element() < 1e-6);
    }
}
