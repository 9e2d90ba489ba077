//! Finds Embree, binds its headers and compiles the shim.

use std::env;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Oldest usable Embree as `RTC_VERSION` counts: 4.3.0, the first with today's ray layout.
const EMBREE_MIN: u32 = 40300;

/// Binds the installed Embree's own headers (its ray structure depends on how it was built) and
/// compiles the shim that bounds the threads of a build.
pub(crate) fn embree() {
    println!("cargo:rerun-if-env-changed=EMBREE_DIR");
    println!("cargo:rerun-if-changed=src/intersect/embree/shim.cpp");
    let root = embree_root();
    let include = root.join("include");
    println!("cargo:rerun-if-changed={}", include.join("embree4/rtcore_config.h").display());

    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let bindings = bindgen::Builder::default()
        .header(include.join("embree4/rtcore.h").display().to_string())
        .clang_arg(format!("-I{}", include.display()))
        .allowlist_function("rtc.*")
        .allowlist_type("RTC.*")
        .allowlist_var("RTC_.*")
        .prepend_enum_name(false)
        .derive_default(true)
        .layout_tests(true);
    // bindgen panics where it finds no libclang; its own words stay on stderr.
    match catch_unwind(AssertUnwindSafe(|| bindings.generate())) {
        Ok(Ok(bindings)) => bindings
            .write_to_file(out.join("embree.rs"))
            .unwrap_or_else(|e| fail(&format!("cannot write Embree's bindings: {e}"))),
        Ok(Err(e)) => fail(&format!("bindgen could not read Embree's headers: {e}")),
        Err(_) => fail("bindgen could not run; most likely libclang is missing (Debian: libclang-dev)"),
    }

    cc::Build::new()
        .cpp(true)
        .std("c++17")
        .include(&include)
        .flag("-fvisibility=hidden")
        .file("src/intersect/embree/shim.cpp")
        .compile("caustica_embree");

    // A prefix of one's own has its libraries under lib or lib64; the system's are found anyway.
    if env::var_os("EMBREE_DIR").is_some() {
        for lib in ["lib", "lib64"].map(|l| root.join(l)).iter().filter(|l| l.is_dir()) {
            println!("cargo:rustc-link-search=native={}", lib.display());
        }
    }
    println!("cargo:rustc-link-lib=dylib=embree4");
    println!("cargo:rustc-link-lib=dylib=tbb");
}

/// The prefix of an Embree that is new enough: `EMBREE_DIR` if it is set, else a usual place.
fn embree_root() -> PathBuf {
    let places = match env::var_os("EMBREE_DIR") {
        Some(dir) => vec![PathBuf::from(dir)],
        None => vec![PathBuf::from("/usr"), PathBuf::from("/usr/local")],
    };
    let mut seen = String::new();
    for place in places {
        match embree_version(&place) {
            Some(v) if v >= EMBREE_MIN => return place,
            Some(v) => seen += &format!("  {}: Embree {}.{}, too old\n", place.display(), v / 10000, v / 100 % 100),
            None => seen += &format!("  {}: no include/embree4/rtcore_config.h\n", place.display()),
        }
    }
    fail(&format!("Embree >= 4.3 was not found:\n{seen}"))
}

fn embree_version(root: &Path) -> Option<u32> {
    let config = std::fs::read_to_string(root.join("include/embree4/rtcore_config.h")).ok()?;
    let line = config.lines().find_map(|l| l.strip_prefix("#define RTC_VERSION "))?;
    line.trim().parse().ok()
}

/// Ends the build with what went wrong and what to do next.
fn fail(what: &str) -> ! {
    eprintln!(
        "\n{}\n\nDo one of these:\n\
         \x20 scripts/setup.sh                           install what is missing (Debian 12 and 13)\n\
         \x20 EMBREE_DIR=/prefix cargo build             use an Embree elsewhere\n\
         \x20 cargo build --no-default-features --features oiio   build without Embree (obvhs traces the rays)\n\
         \x20 cargo build --no-default-features          build without any native library\n",
        what.trim_end()
    );
    std::process::exit(1);
}
