//! What this library is.

use super::error::*;
use super::guard;
use super::pointer::{Out, TextOut};
use std::ffi::{CStr, c_char};

/// `CAUSTICA_VERSION`: major in the upper 10 bits, minor in the next 10, patch in the last 12.
pub const VERSION: u32 = number(env!("CARGO_PKG_VERSION_MAJOR")) << 22
    | number(env!("CARGO_PKG_VERSION_MINOR")) << 12
    | number(env!("CARGO_PKG_VERSION_PATCH"));

const fn number(digits: &str) -> u32 {
    let (digits, mut value, mut i) = (digits.as_bytes(), 0, 0);
    while i < digits.len() {
        value = value * 10 + (digits[i] - b'0') as u32;
        i += 1;
    }
    value
}

guard::export! {
    /// Version of the library.
    value fn caustica_version() -> u32 = version, or VERSION;
}

guard::export! {
    /// What a code means, as a static string.
    value fn caustica_result_text(result: i32) -> *const c_char = result_text, or std::ptr::null();
}

guard::export! {
    /// How the library was built.
    free fn caustica_build_info(text: TextOut, capacity: u64, length: Out<u64>) = build_info;
}

fn version() -> u32 {
    VERSION
}

fn result_text(result: i32) -> *const c_char {
    let text: &'static CStr = match result {
        OK => c"success",
        TIMEOUT => c"not finished within the time given",
        CANCELLED => c"cancelled",
        ERROR_INVALID_ARGUMENT => c"invalid argument",
        ERROR_INVALID_HANDLE => c"invalid handle",
        ERROR_WRONG_STATE => c"wrong state",
        ERROR_UNSUPPORTED => c"unsupported",
        ERROR_OUT_OF_MEMORY => c"out of memory",
        ERROR_IO => c"input or output failed",
        ERROR_INCOMPATIBLE_VERSION => c"incompatible version",
        ERROR_INTERNAL => c"internal error",
        ERROR_BUSY => c"busy",
        ERROR_LIMIT => c"limit exceeded",
        ERROR_BACKEND => c"the ray tracer failed",
        _ => c"unknown result",
    };
    text.as_ptr()
}

fn build_info(text: TextOut, capacity: u64, length: Out<u64>) -> Result<i32, Failure> {
    let info = format!(
        "caustica {}; {}; backends:{} obvhs; {}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        if cfg!(feature = "embree") { " embree" } else { "" },
        if cfg!(debug_assertions) { "debug" } else { "release" },
    );
    // SAFETY: the header asks for `capacity` writable bytes behind `text`, or null.
    unsafe { text.write(&info, capacity) };
    length.write(info.len() as u64);
    Ok(OK)
}
