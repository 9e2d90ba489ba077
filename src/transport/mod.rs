//! Light transport: subpaths, the techniques that join them, their weights.

pub mod aim;
pub mod caustic;
pub mod connect;
mod edge;
pub mod experience;
mod interfaces;
pub mod limits;
pub mod options;
pub mod ray_count;
pub mod roulette;
mod search;
mod sight;
pub mod subpath;
pub mod tracer;
pub mod vertex;
pub mod walk_count;
pub mod weight;

pub use subpath::EmitterHit;
pub use tracer::Tracer;
pub use vertex::{LightVertex, Vertex};
