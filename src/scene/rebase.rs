//! A scene far from its origin is moved there, in f64, before it becomes f32: at 10 km, f32 knows
//! positions to a millimetre only.

use super::description::{Description, LightKind};
use glam::DVec3;

/// A scene is moved if its centre is farther from the origin than this many times its radius. Nearer
/// scenes keep their coordinates: f32 loses three bits at most.
const FAR: f64 = 8.0;

/// The point to become the origin; zero where the scene may stay.
pub(super) fn origin(d: &Description) -> DVec3 {
    let Some((low, high)) = d.bounds() else { return DVec3::ZERO };
    let (center, radius) = (low * 0.5 + high * 0.5, (high - low).length() * 0.5);
    if !(center.length() > FAR * radius && center.is_finite()) {
        return DVec3::ZERO;
    }
    // On a grid of the scene's size, so that it stays where it is when an edit changes the box a little.
    let cell = radius.log2().ceil().exp2();
    let snapped = (center / cell).round() * cell;
    if cell > 0.0 && snapped.is_finite() { snapped } else { center }
}

/// The description with `origin` as its origin; its meshes are left out, since they do not change.
pub(super) fn moved(d: &Description, origin: DVec3) -> Description {
    let mut d = Description {
        meshes: Vec::new(),
        materials: d.materials.clone(),
        instances: d.instances.clone(),
        lights: d.lights.clone(),
        environment: d.environment.clone(),
        cameras: d.cameras.clone(),
    };
    for instance in &mut d.instances {
        instance.transform.translation -= origin;
    }
    for camera in &mut d.cameras {
        camera.transform.translation -= origin;
    }
    for light in &mut d.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position -= origin,
            LightKind::Directional { .. } => {}
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::scene::description::{Geometry, Instance, Light};
    use glam::DAffine3;

    fn sphere_at(center: DVec3) -> Description {
        let instance = Instance {
            name: String::new(),
            geometry: Geometry::Sphere { radius: 1.0 },
            material: 0,
            transform: DAffine3::from_translation(center),
        };
        let kind = LightKind::Point { position: center + DVec3::Y, intensity: Rgb::ONE };
        Description {
            instances: vec![instance],
            lights: vec![Light { name: String::new(), kind }],
            ..Description::default()
        }
    }

    #[test]
    fn only_a_far_scene_moves_and_all_of_it_does() {
        assert_eq!(origin(&sphere_at(DVec3::new(3.0, 0.0, 0.0))), DVec3::ZERO);
        let far = sphere_at(DVec3::new(1e6, -2e6, 3e6));
        let o = origin(&far);
        assert_eq!(o, DVec3::new(1e6, -2e6, 3e6));
        // It stays where the box changes a little.
        assert_eq!(origin(&sphere_at(DVec3::new(1e6 + 0.5, -2e6, 3e6 - 0.25))), o);
        let near = moved(&far, o);
        assert_eq!(near.instances[0].transform.translation, DVec3::ZERO);
        assert!(matches!(near.lights[0].kind, LightKind::Point { position, .. } if position == DVec3::Y));
    }
}
