//! Caustica renders refractive caustics, direct and indirect.

pub mod camera;
pub mod capi;
pub mod emitter;
pub mod geometry;
pub mod integrator;
pub mod intersect;
pub mod io;
pub mod manifold;
pub mod math;
pub mod pool;
pub mod render;
pub mod scatter;
pub mod scene;
mod text;
pub mod texture;
pub mod transport;
