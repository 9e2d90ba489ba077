//! Lobes without a finite BSDF: branches, their probabilities and their directions.

use super::*;

/// Both branches of a single smooth lobe: reflection, then transmission.
fn branches(bsdf: &Bsdf, at: &SurfacePoint, wo: Vec3, mode: TransportMode) -> [Option<BsdfSample>; 2] {
    let first = bsdf.sample(at, wo, mode, 0.0, Vec2::ZERO);
    let second = bsdf.sample(at, wo, mode, 1.0 - f32::EPSILON, Vec2::ZERO);
    [first.filter(|s| !s.transmitted), second.filter(|s| s.transmitted)]
}

#[test]
fn branches_of_smooth_glass_share_the_energy() {
    let at = flat();
    let bsdf = Bsdf::new(&glass(1.5, 0.0));
    for cos in [1.0f32, 0.8, 0.3, 0.01, -0.01, -0.5, -0.76, -1.0] {
        let wo = direction(&at, cos, 0.7);
        let (n_1, n_2) = if cos > 0.0 { (1.0, 1.5) } else { (1.5f32, 1.0) };
        let f = fresnel::dielectric(n_1, n_2, cos.abs());
        for mode in MODES {
            let [reflected, refracted] = branches(&bsdf, &at, wo, mode);
            let reflected = reflected.unwrap();
            assert!((reflected.pdf - f).abs() < 1e-4 && reflected.weight == Rgb::ONE);
            assert!((reflected.wi + wo - at.ns * (2.0 * wo.dot(at.ns))).length() < 1e-6);
            assert_eq!(refracted.is_none(), f == 1.0);
            let Some(refracted) = refracted else { continue };
            assert!((reflected.pdf + refracted.pdf - 1.0).abs() < 1e-6);
            // Radiance is compressed into the denser medium's narrower cone.
            let scale = if mode == TransportMode::Radiance { (n_1 / n_2).powi(2) } else { 1.0 };
            assert!((refracted.weight - Rgb::splat(scale)).length() < 1e-6);
            assert!((wo.cross(at.ns) * n_1 + refracted.wi.cross(at.ns) * n_2).length() < 1e-6);
        }
    }
}

#[test]
fn branches_are_as_likely_the_other_way() {
    let at = flat();
    let bsdf = Bsdf::new(&Scattering::Dielectric {
        inside: medium(1.5),
        outside: medium(1.33),
        roughness: 0.0,
        tint: Rgb::new(0.9, 0.1, 0.5),
    });
    let mut r = random(1);
    for _ in 0..20_000 {
        let wo = warp::sphere(r.next_2d());
        let Some(s) = bsdf.sample(&at, wo, TransportMode::Radiance, r.next_1d(), Vec2::ZERO) else { continue };
        let back = branches(&bsdf, &at, s.wi, TransportMode::Importance)[s.transmitted as usize].unwrap();
        // F is a function of the cosine on the thinner side, where a direction holds fewer digits than it
        // has at grazing angles, and fewer still if Snell's law has to infer it from the denser side.
        let cos = wo.dot(at.ns);
        let thin = if cos > 0.0 { cos } else { fresnel::refraction_cosine(1.5, 1.33, -cos).unwrap_or(1.0) };
        assert!((back.wi - wo).length() < 2e-6 / thin.max(1e-3), "{wo} {}", back.wi);
        assert!((back.pdf - s.pdf).abs() < 2e-6 / thin.max(1e-3), "{thin}: {} {}", s.pdf, back.pdf);
    }
}

/// Frequencies of the branches, within 4 standard errors.
#[test]
fn branches_come_as_often_as_they_say() {
    let at = flat();
    let smooth = MetallicRoughness { roughness: 0.0, transmission: 0.5, solid: true, ..gltf() };
    let mut r = random(2);
    for (bsdf, kinds) in [
        (Bsdf::new(&glass(1.5, 0.0)), 2),
        (Bsdf::new(&Scattering::ThinDielectric { ior: 1.5, roughness: 0.0, tint: Rgb::ONE }), 2),
        (Bsdf::new(&Scattering::MetallicRoughness(smooth)), 3),
    ] {
        let wo = direction(&at, 0.3, 0.2);
        let n = 40_000;
        let mut counts: Vec<(f32, u32)> = Vec::new();
        for _ in 0..n {
            let s = bsdf.sample(&at, wo, TransportMode::Radiance, r.next_1d(), r.next_2d()).unwrap();
            if s.connectable {
                continue;
            }
            match counts.iter_mut().find(|(pdf, _)| *pdf == s.pdf) {
                Some((_, count)) => *count += 1,
                None => counts.push((s.pdf, 1)),
            }
        }
        assert_eq!(counts.len(), kinds);
        for (pdf, count) in counts {
            let error = (count as f32 / n as f32 - pdf) / (pdf * (1.0 - pdf) / n as f32).sqrt();
            assert!(error.abs() < 4.0, "{pdf}: {count}");
        }
    }
}

/// In a mixture a branch carries its lobe's share of the material, whatever its chance to be drawn.
#[test]
fn branches_in_mixtures_carry_their_share() {
    let at = flat();
    let m = MetallicRoughness { roughness: 0.0, metallic: 0.2, transmission: 0.5, solid: true, ..gltf() };
    let bsdf = Bsdf::new(&Scattering::MetallicRoughness(m));
    let wo = direction(&at, 1.0, 0.0);
    let mut branches: Vec<BsdfSample> = Vec::new();
    for k in 0..1000 {
        let s = bsdf.sample(&at, wo, TransportMode::Importance, (k as f32 + 0.5) / 1000.0, Vec2::splat(0.4)).unwrap();
        if !s.connectable && !branches.iter().any(|b| b.pdf == s.pdf) {
            branches.push(s);
        }
    }
    // In the order of the lobes at normal incidence: metal, coat, and glass in two branches.
    let expected = [m.base_color * 0.2, Rgb::splat(0.4 * 0.04), Rgb::splat(0.4 * 0.04), m.base_color * (0.4 * 0.96)];
    assert_eq!(branches.len(), 4);
    for (b, e) in branches.iter().zip(expected) {
        assert!((b.weight * b.pdf - e).length() < 1e-6, "{b:?} {e}");
    }
}

#[test]
fn a_thin_sheet_passes_light_straight_on() {
    let at = flat();
    let tint = Rgb::new(0.9, 0.5, 0.1);
    let bsdf = Bsdf::new(&Scattering::ThinDielectric { ior: 1.5, roughness: 0.0, tint });
    for cos in [1.0, 0.4, -0.4, -1.0] {
        let wo = direction(&at, cos, 3.0);
        for mode in MODES {
            let [reflected, passed] = branches(&bsdf, &at, wo, mode).map(Option::unwrap);
            assert!((passed.wi + wo).length() < 1e-6 && (passed.weight - tint).length() < 1e-6);
            assert!((reflected.pdf + passed.pdf - 1.0).abs() < 1e-6);
            // Two faces that reflect 4 % each: 0.08/1.04 at normal incidence.
            let normal = cos.abs() == 1.0;
            assert!(!normal || (reflected.pdf - 0.08 / 1.04).abs() < 1e-6);
        }
    }
}

#[test]
fn a_mirror_reflects_by_schlick() {
    let at = flat();
    let reflectance = Rgb::new(0.9, 0.6, 0.2);
    let bsdf = Bsdf::new(&Scattering::Conductor { reflectance, roughness: 0.0 });
    let s = bsdf.sample(&at, direction(&at, -0.5, 0.0), TransportMode::Importance, 0.9, Vec2::ZERO).unwrap();
    assert!(s.pdf == 1.0 && !s.connectable && !s.transmitted);
    assert!((s.weight - (reflectance + (Rgb::ONE - reflectance) / 32.0)).length() < 1e-6);
}
