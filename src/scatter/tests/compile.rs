//! Which lobes a description compiles to.

use super::*;

fn compiled(m: MetallicRoughness) -> Bsdf {
    Bsdf::new(&Scattering::MetallicRoughness(m))
}

/// The lobes' text form: two materials with the same text are the same.
fn lobes(bsdf: &Bsdf) -> String {
    format!("{:?}", bsdf.mixture)
}

#[test]
fn degenerate_gltf_materials_are_the_plain_ones() {
    let g = gltf();
    let tint = g.base_color;
    let same = |m, s| assert_eq!(lobes(&compiled(m)), lobes(&Bsdf::new(&s)));
    same(MetallicRoughness { specular: 0.0, ..g }, Scattering::Diffuse { reflectance: tint });
    same(MetallicRoughness { metallic: 1.0, ..g }, Scattering::Conductor { reflectance: tint, roughness: 0.5 });
    same(
        MetallicRoughness { metallic: 1.0, transmission: 1.0, roughness: 0.0, ..g },
        Scattering::Conductor { reflectance: tint, roughness: 0.0 },
    );
    for roughness in [0.0, 0.5] {
        same(
            MetallicRoughness { transmission: 1.0, solid: true, roughness, ..g },
            Scattering::Dielectric { inside: medium(1.5), outside: Medium::VACUUM, roughness, tint },
        );
        same(
            MetallicRoughness { transmission: 1.0, roughness, ..g },
            Scattering::ThinDielectric { ior: 1.5, roughness, tint },
        );
    }
    assert!(compiled(MetallicRoughness { specular: 0.0, ..g }).is_diffuse());
    assert_eq!(compiled(MetallicRoughness { metallic: 0.5, transmission: 0.5, ..g }).mixture.lobes().count(), 4);
}

#[test]
fn properties_follow_the_lobes() {
    let absorption = Rgb::new(1.0, 2.0, 3.0);
    let solid = MetallicRoughness { transmission: 0.5, solid: true, absorption, ..gltf() };
    let smooth = MetallicRoughness { roughness: 0.0, ..solid };
    let table = [
        // connectable, has_delta, has_delta_refraction, refracts
        (Bsdf::new(&Scattering::Diffuse { reflectance: Rgb::ONE }), [true, false, false, false]),
        (Bsdf::new(&Scattering::Diffuse { reflectance: Rgb::ZERO }), [false, false, false, false]),
        (Bsdf::new(&glass(1.5, 0.0)), [false, true, true, true]),
        (Bsdf::new(&glass(1.5, 0.3)), [true, false, false, true]),
        (compiled(solid), [true, false, false, true]),
        (compiled(smooth), [true, true, true, true]),
        (compiled(MetallicRoughness { solid: false, ..smooth }), [true, true, false, false]),
        (compiled(MetallicRoughness { metallic: 1.0, ..smooth }), [false, true, false, false]),
    ];
    for (i, (b, expected)) in table.iter().enumerate() {
        let found = [b.connectable(), b.has_delta(), b.walked_refraction().is_some(), b.media().is_some()];
        assert_eq!(found, *expected, "row {i}");
    }
    assert_eq!(compiled(solid).media(), Some((Medium::new(1.5, absorption), Medium::VACUUM)));
}

#[test]
fn black_surfaces_continue_nowhere() {
    let at = flat();
    let black = Bsdf::new(&Scattering::Diffuse { reflectance: Rgb::ZERO });
    let wo = direction(&at, 0.5, 0.0);
    assert!(black.sample(&at, wo, TransportMode::Radiance, 0.5, Vec2::splat(0.5)).is_none());
    assert_eq!(black.evaluate(&at, wo, wo, TransportMode::Radiance), Evaluation::default());
}

#[test]
fn too_narrow_lobes_are_smooth() {
    // alpha = roughness^2; the refraction's width shrinks with the indices' difference, too.
    assert!(Bsdf::new(&glass(1.5, 0.031)).has_delta() && !Bsdf::new(&glass(1.5, 0.033)).has_delta());
    assert!(Bsdf::new(&glass(1.001, 0.2)).has_delta() && !Bsdf::new(&glass(1.01, 0.2)).has_delta());
    assert!(Bsdf::new(&glass(1.0, 1.0)).has_delta());
}
