//! What every lobe must satisfy, held over one catalogue of materials.

mod compile;
mod delta;
mod energy;
mod robustness;
mod sampling;
mod symmetry;
mod walked;

use super::*;
use crate::math::{Sampler, Stream};
use crate::scene::description::MetallicRoughness;

const MODES: [TransportMode; 2] = [TransportMode::Radiance, TransportMode::Importance];

fn medium(ior: f32) -> Medium {
    Medium::new(ior, Rgb::ZERO)
}

fn glass(ior: f32, roughness: f32) -> Scattering {
    Scattering::Dielectric { inside: medium(ior), outside: Medium::VACUUM, roughness, tint: Rgb::ONE }
}

fn gltf() -> MetallicRoughness {
    MetallicRoughness {
        base_color: Rgb::new(0.8, 0.5, 0.3),
        metallic: 0.0,
        roughness: 0.5,
        ..MetallicRoughness::default()
    }
}

/// Materials with at least one connectable lobe.
fn catalogue() -> Vec<(&'static str, Scattering)> {
    let copper = Rgb::new(0.95, 0.64, 0.54);
    let g = gltf();
    let gltf = Scattering::MetallicRoughness;
    vec![
        ("diffuse", Scattering::Diffuse { reflectance: Rgb::new(0.2, 0.5, 0.9) }),
        ("copper 0.15", Scattering::Conductor { reflectance: copper, roughness: 0.15 }),
        ("copper 0.5", Scattering::Conductor { reflectance: copper, roughness: 0.5 }),
        ("copper 1", Scattering::Conductor { reflectance: copper, roughness: 1.0 }),
        ("glass 0.3", glass(1.5, 0.3)),
        ("glass 0.6", glass(1.5, 0.6)),
        ("glass 1", glass(1.5, 1.0)),
        (
            "bubble in water",
            Scattering::Dielectric {
                inside: Medium::VACUUM,
                outside: medium(1.33),
                roughness: 0.5,
                tint: Rgb::new(0.9, 0.5, 0.1),
            },
        ),
        ("thin 0.5", Scattering::ThinDielectric { ior: 1.5, roughness: 0.5, tint: Rgb::new(0.9, 0.5, 0.1) }),
        ("plastic", gltf(g)),
        ("smooth plastic", gltf(MetallicRoughness { roughness: 0.0, ..g })),
        ("half metal", gltf(MetallicRoughness { metallic: 0.5, ..g })),
        ("all four, solid", gltf(MetallicRoughness { metallic: 0.3, transmission: 0.4, solid: true, ..g })),
        ("all four, thin", gltf(MetallicRoughness { metallic: 0.3, transmission: 0.4, ..g })),
        (
            "half clear solid",
            gltf(MetallicRoughness { roughness: 0.0, transmission: 0.5, solid: true, specular: 0.0, ..g }),
        ),
    ]
}

/// A point whose shading normal is on no axis.
fn flat() -> SurfacePoint {
    let ns = Vec3::new(0.3, -0.5, 0.6).normalize();
    SurfacePoint { p: Vec3::ZERO, ng: ns, ns, offset: 0.0, offset_per_length: 0.0, shape: 0, primitive: 0 }
}

/// A point whose normals differ by `angle`.
fn bent(angle: f32) -> SurfacePoint {
    let at = flat();
    let f = Frame::around(at.ns);
    SurfacePoint { ng: (at.ns * angle.cos() + f.s * angle.sin()).normalize(), ..at }
}

/// A direction at `cos` to the shading normal, turned by `phi`.
fn direction(at: &SurfacePoint, cos: f32, phi: f32) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    Frame::around(at.ns).to_world(Vec3::new(sin * phi.cos(), sin * phi.sin(), cos))
}

/// From the front and from the back, steep and grazing.
const COSINES: [f32; 6] = [1.0, 0.7, 0.1, -0.05, -0.6, -0.95];

fn random(seed: u64) -> Sampler {
    Sampler::new(seed, 0, 0, Stream::Camera)
}
