//! What a scene has that renders cannot find.

use crate::manifold::MAX_CHAIN;
use crate::scene::World;

/// Light that no strategy, or none but the walks, can bring.
pub fn limits(world: &World) -> Vec<String> {
    let mut limits = Vec::new();
    if !world.requirements.delta_lights {
        return limits;
    }
    if world.requirements.caustics {
        limits.push(
            "delta lights (point, spot, directional) and smooth glass: a path that crosses glass on every leg from lamp to \
             eye is found by walks \
             alone, each through the surfaces on the straight line; the rest is missing, not noise"
                .to_owned(),
        );
    }
    if world.shape_material.iter().any(|&material| world.bsdfs[material as usize].has_delta()) {
        limits.push(format!(
            "delta lights (point, spot, directional) and smooth surfaces: a path that a mirror, an internal reflection, a \
             thin pane or more than \
             {MAX_CHAIN} surfaces interrupt on every leg is never found"
        ));
    }
    limits
}
