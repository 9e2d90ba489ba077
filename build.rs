//! Finds the native libraries, binds and compiles what touches them, names the shared library. No
//! other decision.

#[cfg(feature = "embree")]
#[path = "build/embree.rs"]
mod embree;
#[cfg(feature = "oiio")]
#[path = "build/oiio.rs"]
mod oiio;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=build");
    cdylib();
    #[cfg(feature = "embree")]
    embree::embree();
    #[cfg(feature = "oiio")]
    oiio::openimageio();
}

/// The name hosts link against, and no unloading: std's thread-locals outlive a `dlclose`.
fn cdylib() {
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libcaustica.so.0");
        println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
