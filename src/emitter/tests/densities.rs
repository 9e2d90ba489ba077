//! Densities that agree to the bit however they are asked for, and numbers at the ends of the range.

use super::*;

#[test]
fn all_techniques_get_the_same_bits() {
    let mut scenes = one_of_each();
    scenes.push(("mixture", mixture()));
    let mut aimed = mixture();
    let targets = Targets::new([(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5), 1.0)]);
    aimed.lights = aimed.lights.aimed(Aim::new(std::sync::Arc::new(targets), vec![0.4; 8]));
    scenes.push(("aimed", aimed));
    for (name, scene) in &scenes {
        let lights = &scene.lights;
        let mut random = random(1);
        let mut compared = 0;
        for _ in 0..3000 {
            let receiver = CENTER + (random.next_2d() - 0.5).extend(random.next_1d() - 0.5) * 3.0;
            if let Some(s) = scene.direct(receiver, &mut random) {
                assert_eq!(s.densities.direct, lights.direct_density(&scene.shapes, s.light, &s.at, receiver));
                match &s.at {
                    Endpoint::Surface(at) => {
                        assert_eq!(lights.of_shape(at.shape), Some(s.light));
                        let (_, hit) = lights.hit(&scene.shapes, s.light, at, -s.wi, receiver).unwrap();
                        assert_eq!(hit, s.densities, "{name}");
                    }
                    Endpoint::Infinite(to_light) if s.densities.hittable => {
                        assert_eq!(*to_light, s.wi);
                        assert_eq!(lights.escape(receiver, s.wi).unwrap().1, s.densities, "{name}");
                    }
                    Endpoint::Point(_) | Endpoint::Infinite(_) => assert!(!s.densities.hittable),
                }
                compared += 1;
            }
            if let Some(s) = scene.emission(&mut random) {
                let direct = lights.direct_density(&scene.shapes, s.light, &s.at, receiver);
                let expected = match &s.at {
                    Endpoint::Surface(at) => lights.hit(&scene.shapes, s.light, at, s.direction, receiver).unwrap().1,
                    Endpoint::Infinite(to_light) if s.densities.hittable => {
                        lights.escape(s.origin, *to_light).unwrap().1
                    }
                    Endpoint::Point(_) | Endpoint::Infinite(_) => LightDensities { direct, ..s.densities },
                };
                assert_eq!(expected, LightDensities { direct, ..s.densities }, "{name}");
                compared += 1;
            }
        }
        assert!(compared > 3000, "{name}: {compared}");
    }
}

#[test]
fn the_far_side_of_a_sphere_is_not_drawn() {
    let scene = scene(vec![(ball(Vec3::ZERO, 1.0), Rgb::ONE, true)], &[], Rgb::ZERO);
    let at = |n: Vec3| Endpoint::Surface(Sphere { center: Vec3::ZERO, radius: 1.0 }.at(n.as_dvec3()));
    let receiver = Vec3::new(0.0, 3.0, 0.0);
    assert!(scene.lights.direct_density(&scene.shapes, 0, &at(Vec3::Y), receiver) > 0.0);
    assert_eq!(scene.lights.direct_density(&scene.shapes, 0, &at(Vec3::NEG_Y), receiver), 0.0);
}

#[test]
fn what_emits_nothing_is_no_light() {
    let positions = vec![Vec3::ZERO, Vec3::X, 2.0 * Vec3::X];
    let flat = Shape::Mesh(Mesh { positions, normals: vec![], triangles: vec![[0, 1, 2]] }.into());
    let dark = LightKind::Point { position: DVec3::ZERO, intensity: Rgb::ZERO };
    let shapes = vec![(flat, Rgb::ONE, true), (ball(Vec3::ZERO, 1.0), Rgb::ZERO, false)];
    let scene = scene(shapes, &[dark], Rgb::ZERO);
    let mut random = random(2);
    assert!(scene.lights.is_empty() && !scene.lights.any_hittable());
    assert!(scene.lights.of_shape(0).is_none() && scene.lights.of_shape(1).is_none());
    assert!(scene.direct(Vec3::Y, &mut random).is_none());
    assert!(scene.emission(&mut random).is_none());
    assert!(scene.lights.escape(CENTER, Vec3::Y).is_none());
}

/// A million calls over lights and distances from 1e-6 to 1e6.
#[test]
fn numbers_stay_finite_at_all_scales() {
    let mut random = random(3);
    let scale = |random: &mut Sampler| 10f32.powf(12.0 * random.next_1d() - 6.0);
    let direction = |random: &mut Sampler| crate::math::warp::sphere(random.next_2d());
    let mut drawn = [0; 2];
    for k in 0..5000 {
        let (r, place) = (scale(&mut random), direction(&mut random) * scale(&mut random));
        let position = place.as_dvec3();
        let (intensity, two_sided) = (Rgb::new(1.0, 1e-3, 1e3), k % 2 == 0);
        let axis = direction(&mut random).as_dvec3();
        let scene = match k % 5 {
            0 | 1 => scene(vec![(ball(place, r), intensity, k % 5 == 0)], &[], Rgb::ZERO),
            2 => scene(vec![(ceiling(place, r, 0.1 * r), intensity, two_sided)], &[], Rgb::ZERO),
            3 => {
                let outer = f64::from(1e-3 + random.next_1d());
                scene(vec![], &[LightKind::Spot { position, direction: axis, intensity, inner: 0.0, outer }], intensity)
            }
            _ => {
                let point = LightKind::Point { position, intensity };
                let parallel = LightKind::Directional { direction: axis, irradiance: intensity };
                scene(vec![], &[point, parallel], Rgb::ZERO)
            }
        };
        for _ in 0..100 {
            // Receivers anywhere, and close to the light's surface.
            let h = if random.next_1d() < 0.5 { scale(&mut random) } else { r * (1.0 + 1e-4 * random.next_1d()) };
            let receiver = place + direction(&mut random) * h;
            if let Some(s) = scene.direct(receiver, &mut random) {
                assert!(s.incident.is_finite() && s.incident.min_element() >= 0.0, "{s:?}");
                assert!((s.wi.length() - 1.0).abs() < 1e-5, "{s:?}");
                let d = s.densities;
                assert!(d.direct > 0.0 && d.direct.is_finite() && d.position > 0.0 && d.position.is_finite(), "{s:?}");
                assert!(d.direction >= 0.0 && d.direction.is_finite(), "{s:?}");
                drawn[0] += 1;
            }
            if let Some(s) = scene.emission(&mut random) {
                assert!(s.beta.is_finite() && s.beta.min_element() >= 0.0 && s.origin.is_finite(), "{s:?}");
                assert!((s.direction.length() - 1.0).abs() < 1e-5, "{s:?}");
                let d = s.densities;
                assert!(d.position > 0.0 && d.direction > 0.0 && (d.position * d.direction).is_finite(), "{s:?}");
                drawn[1] += 1;
            }
        }
    }
    assert!(drawn.iter().all(|&n| n > 200_000), "{drawn:?}");
}
