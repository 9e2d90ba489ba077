//! Extreme materials and directions: every number stays a number.

use super::*;

fn extremes() -> Vec<Scattering> {
    let mut all: Vec<Scattering> = catalogue().into_iter().map(|(_, s)| s).collect();
    for roughness in [0.0, 0.032, 0.05, 0.2, 1.0] {
        for ior in [1.0, 1.0 + 1e-6, 1.001, 1.02, 1.5, 4.0, 1e3] {
            all.push(glass(ior, roughness));
            all.push(Scattering::ThinDielectric { ior, roughness, tint: Rgb::ONE });
            all.push(Scattering::MetallicRoughness(MetallicRoughness {
                ior,
                roughness,
                metallic: 0.2,
                transmission: 0.3,
                solid: ior > 1.4,
                ..gltf()
            }));
        }
        all.push(Scattering::Conductor { reflectance: Rgb::new(1.0, 0.5, 0.0), roughness });
    }
    all
}

/// A direction that is often on the horizon or on the normal, up to rounding.
fn tricky(r: &mut Sampler, at: &SurfacePoint) -> Vec3 {
    const SMALL: [f32; 6] = [0.0, 1e-30, 1e-9, 1e-7, 1e-5, 1e-3];
    let w = warp::sphere(r.next_2d());
    let kind = (r.next_1d() * 4.0) as u32;
    let small = SMALL[(r.next_1d() * 6.0) as usize] * (2.0 * r.next_1d() - 1.0).signum();
    match kind {
        0 => (w - at.ns * w.dot(at.ns)).normalize() + at.ns * small,
        1 => (at.ns.copysign(w) * 0.0 + at.ns * (1.0f32).copysign(w.x) + w * small).normalize(),
        _ => w,
    }
}

#[test]
fn numbers_stay_finite() {
    let mut r = random(1);
    let flat_z = SurfacePoint { ng: Vec3::Z, ns: Vec3::Z, ..flat() };
    let points = [flat(), flat_z, bent(0.1)];
    let materials = extremes();
    let compiled: Vec<Bsdf> = materials.iter().map(Bsdf::new).collect();
    for k in 0..1_000_000 {
        let bsdf = &compiled[k % compiled.len()];
        let at = &points[k / compiled.len() % 3];
        let mode = MODES[k & 1];
        let (wo, wi) = (tricky(&mut r, at), tricky(&mut r, at));
        let e = bsdf.evaluate(at, wo, wi, mode);
        let say = || format!("{:?} {wo:?} {wi:?}", materials[k % compiled.len()]);
        let valid = |x: f32| x.is_finite() && x >= 0.0;
        assert!(e.f.is_finite() && e.f.min_element() >= 0.0, "{} {e:?}", say());
        assert!(valid(e.pdf) && valid(e.pdf_reverse), "{} {e:?}", say());
        let edge = [0.0, 1.0 - f32::EPSILON];
        let u = if k % 5 == 0 { Vec2::new(edge[k / 5 % 2], edge[k / 10 % 2]) } else { r.next_2d() };
        let u_lobe = if k % 7 == 0 { edge[k / 7 % 2] } else { r.next_1d() };
        let Some(s) = bsdf.sample(at, wo, mode, u_lobe, u) else { continue };
        assert!((s.wi.length() - 1.0).abs() < 1e-5, "{} {s:?}", say());
        assert!(s.weight.is_finite() && s.weight.min_element() >= 0.0, "{} {s:?}", say());
        assert!(s.pdf.is_finite() && s.pdf > 0.0, "{} {s:?}", say());
    }
}
