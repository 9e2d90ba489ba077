//! The C interface, declared in `include/caustica.h`: it checks, converts and forwards, and decides
//! nothing about rendering.
//!
//! The library is a guest in its host's process. It therefore prints nothing, never unwinds into the
//! host, leaves the floating-point state as it found it, and after a release no thread of it runs.
//! All exported functions are made by the macro in `guard`, which keeps these promises in one place.
//!
//! Process-wide state is limited to three things, each justified where it stands: the list of living
//! devices ([`device`]), the panic hook (`guard`), and each thread's last error ([`error`]).
#![allow(unsafe_code)]

#[cfg(not(panic = "unwind"))]
compile_error!("the C interface turns panics into error codes and needs panic = \"unwind\"");

pub mod camera;
pub mod device;
pub mod environment;
pub mod error;
mod guard;
pub mod handle;
pub mod info;
pub mod instance;
pub mod light;
pub mod load;
pub mod material;
pub mod mesh;
pub mod options;
pub mod pixels;
pub mod pointer;
pub mod render;
pub mod request;
pub mod scene;
pub mod texture;
pub mod write;
