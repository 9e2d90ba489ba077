//! Reciprocity, the two transport modes, and the rule of sides.

use super::*;

/// `f` is symmetric for reflection; across a boundary `f/n^2` is, with the index on the side of `wo`
/// in radiance mode, and importance is radiance with the roles swapped.
#[test]
fn values_are_reciprocal() {
    let mut r = random(1);
    let at = flat();
    for (name, scattering) in catalogue() {
        let bsdf = Bsdf::new(&scattering);
        // Of the lobes that refract; the others are symmetric across the surface as they stand.
        let index = |w: Vec3| match bsdf.media() {
            Some((inside, outside)) => {
                if w.dot(at.ns) > 0.0 {
                    outside.ior
                } else {
                    inside.ior
                }
            }
            None => 1.0,
        };
        let mut compared = 0;
        for _ in 0..5000 {
            let (wo, wi) = (warp::sphere(r.next_2d()), warp::sphere(r.next_2d()));
            let radiance = bsdf.evaluate(&at, wo, wi, TransportMode::Radiance).f;
            let swapped = bsdf.evaluate(&at, wi, wo, TransportMode::Radiance).f;
            let importance = bsdf.evaluate(&at, wo, wi, TransportMode::Importance).f;
            let (n_o, n_i) = (index(wo), index(wi));
            let close = |a: Rgb, b: Rgb| (a - b).length() <= 1e-4 * a.length().max(b.length());
            assert!(close(radiance / (n_o * n_o), swapped / (n_i * n_i)), "{name}: {radiance} {swapped}");
            assert!(close(importance, swapped), "{name}: {importance} {swapped}");
            compared += (radiance != Rgb::ZERO) as usize;
        }
        assert!(compared > 500, "{name}: {compared}");
    }
}

/// Nothing passes where the geometric and the shading normal disagree on the side of a direction.
#[test]
fn conflicting_sides_scatter_nothing() {
    let mut r = random(2);
    let at = bent(0.8);
    let conflict = |w: Vec3| w.dot(at.ng) * w.dot(at.ns) <= 0.0;
    let mut materials = catalogue();
    materials.push(("smooth glass", glass(1.5, 0.0)));
    materials.push(("mirror", Scattering::Conductor { reflectance: Rgb::ONE, roughness: 0.0 }));
    for (name, scattering) in materials {
        let bsdf = Bsdf::new(&scattering);
        let (mut refused, mut sampled) = (0, 0);
        for _ in 0..5000 {
            let (wo, wi) = (warp::sphere(r.next_2d()), warp::sphere(r.next_2d()));
            let sample = bsdf.sample(&at, wo, TransportMode::Radiance, r.next_1d(), r.next_2d());
            if conflict(wo) || conflict(wi) {
                assert_eq!(bsdf.evaluate(&at, wo, wi, TransportMode::Radiance), Evaluation::default(), "{name}");
            }
            if let Some(s) = sample {
                assert!(!conflict(wo) && !conflict(s.wi), "{name}");
                sampled += 1;
            } else {
                refused += conflict(wo) as usize;
            }
        }
        assert!(refused > 500 && sampled > 1000, "{name}: {refused} {sampled}");
    }
}

/// Opaque materials scatter back to the side the light came from, whichever it is.
#[test]
fn opaque_materials_stay_on_their_side() {
    let at = flat();
    let (front, back) = (direction(&at, 0.5, 0.0), direction(&at, -0.5, 1.0));
    for name in ["diffuse", "copper 0.5", "plastic", "half metal"] {
        let (_, scattering) = catalogue().into_iter().find(|(n, _)| *n == name).unwrap();
        let bsdf = Bsdf::new(&scattering);
        assert_eq!(bsdf.evaluate(&at, front, back, TransportMode::Radiance), Evaluation::default());
        let inner = bsdf.evaluate(&at, back, direction(&at, -0.3, 2.0), TransportMode::Radiance);
        let outer = bsdf.evaluate(&at, -back, -direction(&at, -0.3, 2.0), TransportMode::Radiance);
        assert!(inner.f.x > 0.0 && (inner.f - outer.f).length() < 1e-5, "{name}");
    }
}
