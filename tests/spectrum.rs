//! Glass whose index varies over the spectrum.

mod common;

use caustica::math::Rgb;
use caustica::math::spectrum::{bands, index};
use caustica::render::{Caustics, Integrator, Settings};
use caustica::scene::World;
use caustica::scene::description::*;
use caustica::transport::roulette::Roulette;
use common::scenes::under_a_lamp;
use common::stats::mean_and_error;
use common::{Builder, run, settings};
use glam::{DVec3, Vec3};

fn dispersive(ior: f32, abbe: f32) -> Scattering {
    let inside = Medium { abbe, ..Medium::new(ior, Rgb::ZERO) };
    Scattering::Dielectric { inside, outside: Medium::VACUUM, roughness: 0.0, tint: Rgb::ONE }
}

/// A smooth ball and a rough one in the light of a lamp, or of a point.
fn balls(glass: impl Fn(f32) -> Scattering, point: bool) -> Builder {
    let mut b = under_a_lamp(1.5);
    if point {
        b.light(LightKind::Point { position: DVec3::new(0.4, 2.5, 0.3), intensity: Rgb::splat(3.0) });
    }
    for (x, roughness) in [(-0.5, 0.0), (0.5, 0.1)] {
        let material = b.material(glass(roughness));
        b.sphere(DVec3::new(x, 0.6, 0.0), 0.45, material);
    }
    b
}

/// In light of one band the scene is that of plain glass with the band's index, whatever the technique: all that is held
/// of plain glass is held of it.
#[test]
fn each_band_is_a_scene_of_plain_glass() {
    let at = |medium: Medium| {
        move |roughness| Scattering::Dielectric { inside: medium, outside: Medium::VACUUM, roughness, tint: Rgb::ONE }
    };
    for (band, point) in [(0, false), (40, true), (63, false)] {
        let mut world = balls(at(Medium { abbe: 25.0, ..Medium::new(1.6, Rgb::ZERO) }), point).commit();
        let spectrum = world.spectrum.as_mut().expect("glass that disperses");
        spectrum.bands = vec![spectrum.bands.swap_remove(band)];
        let wavelength = spectrum.bands[0].wavelength;
        let color = std::mem::replace(&mut spectrum.bands[0].color, Rgb::ONE);
        let plain = balls(at(Medium::new(index(1.6, 25.0, wavelength), Rgb::ZERO)), point).commit();
        for integrator in [Integrator::Path, Integrator::Light, Integrator::Mnee, Integrator::Bdpt] {
            let settings = Settings { caustics: Caustics::On, ..settings(integrator, 32, 8, 5) };
            let image = |world: &World| run(world, &settings).image;
            assert!(image(&world) == image(&plain), "{integrator:?}, band {band}");
        }
        // And of its colour: all caustics are of this glass.
        let mut settings = Settings { caustics_only: true, ..settings(Integrator::Bdpt, 32, 8, 5) };
        (settings.caustics, settings.caustic_options.roulette) = (Caustics::On, Roulette::Off);
        let white = run(&world, &settings).image;
        world.spectrum.as_mut().expect("as before").bands[0].color = color;
        for (colored, white) in run(&world, &settings).image.pixels.iter().zip(&white.pixels) {
            assert!((*colored - *white * color).abs().max_element() <= 1e-5 * white.max_element(), "{colored} {white}");
        }
    }
}

/// A lamp seen straight down through a wedge of 30 degrees, whose upper side is level: a ray that enters at `x` leaves the wedge
/// under `asin(n sin 30)` with the normal of its lower side, and so turned by `d`, that less 30 degrees. It meets the
/// ground, 2 m below the upper side, at `x + (2 - (x + 1) tan 30) tan d`, which is linear in `x`.
#[test]
fn a_wedge_takes_the_bands_apart() {
    const SIDE: u32 = 64;
    let (ior, abbe, angle, radiance) = (1.5f32, 20.0f32, 30f64.to_radians(), 3.0f64);
    let strip = [0.3f64, 0.45];
    let mut b = Builder::default();
    let lamp = b.lamp(radiance as f32);
    b.quad(Vec3::new(strip[0] as f32, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * (strip[1] - strip[0]) as f32, lamp);
    let glass = b.material(dispersive(ior, abbe));
    let low = 2.0 - 2.0 * angle.tan() as f32;
    let corners = [(-1.0, 2.0), (1.0, 2.0), (1.0, low)];
    let positions = [-4.0, 4.0].iter().flat_map(|&z| corners.map(|(x, y)| [x, y, z])).collect();
    let triangles = vec![[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]];
    let wedge = MeshDescription { positions, triangles, ..MeshDescription::default() };
    b.mesh(wedge, glass, glam::DAffine3::IDENTITY);
    let rotation = glam::DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
    let transform = glam::DAffine3::from_mat3_translation(rotation, DVec3::Y * 8.0);
    b.0.cameras.push(Camera::new("down", transform, Projection::Orthographic { ymag: 0.5 }));
    let world = b.commit();

    // Per channel: integral over x, and mean of x.
    let (mut integral, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    let bands = bands();
    for band in &bands {
        let n = f64::from(index(ior, abbe, band.wavelength));
        let out = (n * angle.sin()).asin();
        let turn = (out - angle).tan();
        let [a, b] = strip.map(|x| (x - (2.0 - angle.tan()) * turn) / (1.0 - angle.tan() * turn));
        assert!(a > -0.5 && b < 0.5, "{a} {b}");
        let level = ((n - 1.0) / (n + 1.0)).powi(2);
        let (ci, co) = (angle.cos(), out.cos());
        let slant = (((n * ci - co) / (n * ci + co)).powi(2) + ((n * co - ci) / (n * co + ci)).powi(2)) / 2.0;
        let seen = band.color.as_dvec3() / bands.len() as f64 * radiance * (1.0 - level) * (1.0 - slant);
        integral += seen * (b - a);
        moment += seen * (b * b - a * a) / 2.0;
    }
    for integrator in [Integrator::Path, Integrator::Bdpt] {
        let measured: Vec<[DVec3; 2]> = (0..12)
            .map(|seed| {
                let image = run(&world, &Settings { max_depth: 3, ..settings(integrator, SIDE, 128, seed) }).image;
                let (mut sum, mut first) = (DVec3::ZERO, DVec3::ZERO);
                for (i, p) in image.pixels.iter().enumerate() {
                    let x = (f64::from(i as u32 % SIDE) + 0.5) / f64::from(SIDE) - 0.5;
                    sum += p.as_dvec3() / f64::from(SIDE * SIDE);
                    first += p.as_dvec3() * x / f64::from(SIDE * SIDE);
                }
                [sum, first / sum]
            })
            .collect();
        for (i, known) in [integral, moment / integral].into_iter().enumerate() {
            for channel in 0..3 {
                let (mean, error) = mean_and_error(&measured.iter().map(|m| m[i][channel]).collect::<Vec<_>>());
                let known = known[channel];
                let what = format!("{integrator:?}, channel {channel}, {}", ["integral", "place"][i]);
                // 6.4 is Student's quantile for 11 degrees at 5e-5 over 12 comparisons and 2 sides; a pixel is 0.016 wide.
                assert!(
                    (mean - known).abs() < 6.4 * error + 2e-4 * known.abs(),
                    "{what}: {mean} +- {error}, not {known}"
                );
                assert!(error < [4e-3 * known.abs(), 3e-4][i], "{what}: known to {error}");
            }
        }
    }
    // Red is turned least: it comes from farther to the right.
    let place = moment / integral;
    assert!(place.x - place.y > 0.002 && place.y - place.z > 0.005, "{place}");
}

#[test]
fn plain_glass_has_no_bands() {
    assert!(
        balls(|roughness| Scattering::ThinDielectric { ior: 1.5, roughness, tint: Rgb::ONE }, false)
            .commit()
            .spectrum
            .is_none()
    );
    let abbe = 30.0;
    let opaque = Scattering::MetallicRoughness(MetallicRoughness { abbe, ..MetallicRoughness::default() });
    assert!(balls(|_| opaque, false).commit().spectrum.is_none());
}
