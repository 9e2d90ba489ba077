//! Finds Embree and OpenImageIO, binds and compiles. No other decision.

#[cfg(feature = "oiio")]
#[path = "build/oiio.rs"]
mod oiio;

fn main() {
    #[cfg(feature = "oiio")]
    oiio::openimageio();
}
