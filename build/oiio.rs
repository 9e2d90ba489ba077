//! Compiles the OpenImageIO module: one C++ file, a shared object of its own.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

const SHIM: &str = "src/io/image/oiio/shim.cpp";
const MODULE: &str = "libcaustica_oiio.so";
const NEXT: &str = "Run scripts/setup.sh, which installs what the build needs, or build with \
                    --no-default-features: then EXR is the only image format.";

/// Compiles the shim into `OUT_DIR`, tells the crate where it is, and puts a copy beside the
/// artifacts, where the library and the program look first.
pub(crate) fn openimageio() {
    println!("cargo:rerun-if-changed={SHIM}");
    println!("cargo:rerun-if-env-changed=PKG_CONFIG_PATH");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let module = out.join(MODULE);

    let mut compile = cc::Build::new().cpp(true).pic(true).cargo_metadata(false).get_compiler().to_command();
    compile.args(["-std=c++17", "-O2", "-Wall", "-Wextra", "-fPIC", "-fvisibility=hidden", "-shared"]);
    compile.args(["-Wl,--no-undefined", "-Wl,-z,nodelete"]).arg(format!("-Wl,-soname,{MODULE}"));
    compile.arg(SHIM).arg("-o").arg(&module).args(flags());
    let made = compile.output().unwrap_or_else(|e| stop(&format!("the C++ compiler does not start: {e}.")));
    if !made.status.success() {
        stop(&format!("{SHIM} does not compile:\n{}", String::from_utf8_lossy(&made.stderr)));
    }
    println!("cargo:rustc-env=CAUSTICA_OIIO_MODULE={}", module.display());

    // OUT_DIR is <profile>/build/<package>/out.
    if let Some(profile) = out.ancestors().nth(3) {
        copy(&module, &profile.join(MODULE));
    }
}

/// What pkg-config says of OpenImageIO.
fn flags() -> Vec<String> {
    let asked = Command::new("pkg-config").args(["--cflags", "--libs", "OpenImageIO"]).output();
    let asked = asked.unwrap_or_else(|e| stop(&format!("pkg-config does not start: {e}.")));
    if !asked.status.success() {
        stop(&format!("OpenImageIO is not installed.\n{}", String::from_utf8_lossy(&asked.stderr)));
    }
    String::from_utf8_lossy(&asked.stdout).split_whitespace().map(str::to_owned).collect()
}

/// By a rename: a process may have the old file mapped.
fn copy(from: &Path, to: &Path) {
    let part = to.with_extension(format!("so.{}", std::process::id()));
    if let Err(e) = fs::copy(from, &part).and_then(|_| fs::rename(&part, to)) {
        stop(&format!("cannot write {}: {e}.", to.display()));
    }
}

fn stop(why: &str) -> ! {
    eprintln!("\nerror: {why}\n{NEXT}\n");
    std::process::exit(1);
}
