//! Finding and opening `libcaustica_oiio.so`, and its C ABI as `shim.cpp` defines it.
#![allow(unsafe_code)]

use super::super::Failure;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::ffi::{CStr, OsStr, c_char, c_void};
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;
use std::sync::OnceLock;

const NAME: &str = "libcaustica_oiio.so";
/// Of `shim.cpp`; grows with each change of a signature or a structure.
const INTERFACE: u32 = 3;

/// How samples are stored.
#[repr(i32)]
#[derive(Clone, Copy)]
pub(super) enum Sample {
    Byte = 0,
    Half = 1,
    Float = 2,
}

/// What an attribute holds.
#[repr(i32)]
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Text = 0,
    Int = 1,
    Floats = 2,
}

/// `Picture` of the shim.
#[repr(C)]
pub(super) struct CPicture {
    pub(super) width: i32,
    pub(super) height: i32,
    /// Where it is in the frame.
    pub(super) x: i32,
    pub(super) y: i32,
    pub(super) frame_width: i32,
    pub(super) frame_height: i32,
    pub(super) sample: Sample,
    pub(super) samples: *const c_void,
    /// Bytes.
    pub(super) size: usize,
}

/// `Attribute` of the shim.
#[repr(C)]
pub(super) struct CAttribute {
    pub(super) name: *const c_char,
    pub(super) data: *const c_void,
    pub(super) kind: Kind,
    pub(super) count: i32,
}

/// `Header` of the shim.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub(super) struct CHeader {
    pub(super) width: i32,
    pub(super) height: i32,
    /// 1 or 3.
    pub(super) channels: i32,
    /// Of an integer sample; 0 where samples are floats.
    pub(super) bits: i32,
}

type Sink = extern "C" fn(*mut c_void, *const u8, usize) -> i32;
type Buffer = extern "C" fn(*mut c_void, *const CHeader) -> *mut c_void;
type Interface = unsafe extern "C" fn(*mut *const c_char) -> u32;
type Encode = unsafe extern "C" fn(
    *const c_char,
    *const CPicture,
    *const CAttribute,
    usize,
    Sink,
    *mut c_void,
    *mut c_char,
    usize,
) -> i32;
type Decode = unsafe extern "C" fn(*const c_char, *const u8, usize, Buffer, *mut c_void, *mut c_char, usize) -> i32;

/// The open module. It stays open: OpenImageIO's threads would outlive its code.
pub(super) struct Module {
    pub(super) version: &'static str,
    pub(super) encode: Encode,
    pub(super) decode: Decode,
}

/// The module, opened at the first call. A failure is not remembered: the file may come later.
pub(super) fn get() -> Result<&'static Module, Failure> {
    static MODULE: OnceLock<Module> = OnceLock::new();
    match MODULE.get() {
        Some(module) => Ok(module),
        None => {
            let module = open_first(&candidates())?;
            Ok(MODULE.get_or_init(|| module))
        }
    }
}

/// Where the module may be: beside the file that holds this code (libcaustica.so, or the program it
/// is linked into), where an installation puts it, and where the build left it.
fn candidates() -> Vec<PathBuf> {
    let mut paths = Vec::new();
    let own = own_file();
    if let Some(directory) = own.as_deref().and_then(|file| file.parent()) {
        paths.push(directory.join(NAME));
        paths.push(directory.join("caustica").join(NAME));
        paths.push(directory.join("../lib/caustica").join(NAME));
    }
    // <profile>/build/<package>/out/<module>. Elsewhere than in that profile, code from there has no business here.
    let built = PathBuf::from(env!("CAUSTICA_OIIO_MODULE"));
    if let (Some(own), Some(profile)) = (own, built.ancestors().nth(4))
        && own.starts_with(profile)
    {
        paths.push(built);
    }
    paths
}

/// The file that the address of this function is mapped from: absolute and without links, which
/// `dladdr` does not promise for a program.
fn own_file() -> Option<PathBuf> {
    let here = own_file as fn() -> Option<PathBuf> as usize;
    // start-end permissions offset device inode   path
    let maps = std::fs::read("/proc/self/maps").ok()?;
    let covers = |line: &&[u8]| {
        let range = line.split(|&b| b == b' ').next().and_then(|field| std::str::from_utf8(field).ok());
        let bounds = range.and_then(|range| range.split_once('-'));
        let address = |hex: &str| usize::from_str_radix(hex, 16).ok();
        matches!(bounds.map(|(a, b)| (address(a), address(b))), Some((Some(a), Some(b))) if a <= here && here < b)
    };
    let line = maps.split(|&b| b == b'\n').find(covers)?;
    let path = &line[line.iter().position(|&b| b == b'/')?..];
    Some(PathBuf::from(OsStr::from_bytes(path)))
}

/// Opens the first that opens; else tells what is wrong with each.
fn open_first(paths: &[PathBuf]) -> Result<Module, Failure> {
    let mut tried = String::new();
    for path in paths {
        if !path.exists() {
            tried += &format!("\n  {}: no such file", path.display());
            continue;
        }
        match open(path) {
            Ok(module) => return Ok(module),
            Err(why) => tried += &format!("\n  {}: {why}", path.display()),
        }
    }
    Err(Failure::Module(format!("the module {NAME} does not open. Tried:{tried}")))
}

fn open(path: &PathBuf) -> Result<Module, String> {
    let text = |e: libloading::Error| e.to_string();
    // SAFETY: runs the initialisers of the module and of OpenImageIO's libraries; that these are
    // sound is what using OpenImageIO means. RTLD_LOCAL: their symbols stay out of the host's way.
    let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map_err(text)?;
    // SAFETY: the one symbol that has had this type in every version of the shim.
    let interface = unsafe { *library.get::<Interface>(b"caustica_oiio_interface\0").map_err(text)? };
    let mut version = std::ptr::null();
    // SAFETY: `version` takes one pointer.
    let found = unsafe { interface(&raw mut version) };
    if found != INTERFACE || version.is_null() {
        return Err(format!("made for another version of caustica (interface {found}, not {INTERFACE})"));
    }
    // SAFETY: a NUL-terminated literal of the shim, which is never closed (see below).
    let version = unsafe { CStr::from_ptr(version) }.to_str().unwrap_or("unknown");
    // SAFETY: with this interface number the symbols have these types.
    let (encode, decode) = unsafe {
        (
            *library.get::<Encode>(b"caustica_oiio_encode\0").map_err(text)?,
            *library.get::<Decode>(b"caustica_oiio_decode\0").map_err(text)?,
        )
    };
    // Never closed: the functions above stay valid.
    let _ = library.into_raw();
    Ok(Module { version, encode, decode })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_file_is_this_test() {
        assert_eq!(own_file(), std::env::current_exe().unwrap().canonicalize().ok());
    }

    #[test]
    fn a_module_that_does_not_open_is_an_error_that_names_every_place() {
        let directory = tempfile::tempdir().unwrap();
        let broken = directory.path().join(NAME);
        std::fs::write(&broken, "not a shared object").unwrap();
        let missing = directory.path().join("caustica").join(NAME);
        let error = open_first(&[missing.clone(), broken.clone()]).err().unwrap().to_string();
        assert!(error.contains(&format!("{}: no such file", missing.display())), "{error}");
        assert!(error.contains(&format!("{}: ", broken.display())), "{error}");
    }

    #[test]
    fn another_library_is_refused() {
        // A shared object that is certainly there, and no module of ours.
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let libc = maps.lines().find_map(|l| l.contains("libc.so").then(|| &l[l.find('/').unwrap()..])).unwrap();
        let error = open_first(&[PathBuf::from(libc)]).err().unwrap().to_string();
        assert!(error.contains("caustica_oiio_interface"), "{error}");
    }

    #[test]
    fn the_module_opens() {
        assert!(get().map_err(|e| e.to_string()).unwrap().version.starts_with(|c: char| c.is_ascii_digit()));
    }
}
