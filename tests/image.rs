//! Image files against closed values, against each other, and against oiiotool.

use caustica::io::image::{ImageError, ImageIo, Metadata, WriteOptions, check_writable, read, read_environment, write};
use caustica::math::Rgb;
use caustica::render::Image;
use half::f16;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

const FORMATS: &[&str] = if cfg!(feature = "oiio") { &["exr", "png", "tif", "jpg", "hdr"] } else { &["exr"] };
const HALF: WriteOptions = WriteOptions { image_io: ImageIo::Auto, exposure: 0.0, half: true };
const FLOAT: WriteOptions = WriteOptions { half: false, ..HALF };

/// Uneven size; values over five orders of magnitude that no format but 32-bit float holds exactly.
fn picture() -> Image {
    let value = |i: u32| (f64::from(i.wrapping_mul(2_654_435_761)) / 4_294_967_296.0 * 17.0 - 10.0).exp2() as f32;
    let pixels = (0..37 * 23).map(|i| Rgb::new(value(3 * i), value(3 * i + 1), value(3 * i + 2))).collect();
    Image::new(37, 23, pixels)
}

fn row(pixels: &[Rgb]) -> Image {
    Image::new(pixels.len() as u32, 1, pixels.to_vec())
}

fn metadata() -> Metadata {
    let mut metadata = Metadata::new();
    metadata.set("samples", 64u32).set("seed", u64::MAX).set("settings", "integrator=bdpt scene='Glühbirne.glb'");
    metadata.set("scene-hash", "0123abcd").set("backend", "embree").set("noise", 0.125f32);
    metadata
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn as_half(image: &Image) -> Image {
    let round = |x: f32| f16::from_f32(x).to_f32();
    Image::new(image.width, image.height, image.pixels.iter().map(|p| p.map(round)).collect())
}

/// Runs this test binary again for one test alone, through a shell that first runs `prepare`; the
/// child finds `directory` in its environment.
fn child(test: &str, prepare: &str, directory: &Path) -> Output {
    Command::new("bash")
        .args(["-c", &format!("{prepare}\nexec \"$0\" \"$@\"")])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env("CAUSTICA_TEST_CHILD", directory)
        .output()
        .unwrap()
}

fn child_directory() -> Option<PathBuf> {
    std::env::var_os("CAUSTICA_TEST_CHILD").map(PathBuf::from)
}

fn assert_passed(child: &Output) {
    let text = String::from_utf8_lossy(&child.stdout);
    assert!(child.status.success() && text.contains("1 passed"), "{text}\n{}", String::from_utf8_lossy(&child.stderr));
}

#[test]
fn exr_keeps_alpha() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("a.exr");
    let image = Image { alpha: (0..37 * 23).map(|i| (i % 5) as f32 / 4.0).collect(), ..picture() };
    for (options, expected) in [(HALF, as_half(&image)), (FLOAT, picture())] {
        write(&path, &image, &metadata(), &options).unwrap();
        let found = exr::prelude::read_first_rgba_layer_from_file(
            &path,
            |size, _| vec![[0.0f32; 4]; size.area()],
            |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * 37 + at.x()] = [r, g, b, a],
        );
        let found = found.unwrap().layer_data.channel_data.pixels;
        for (i, [r, g, b, a]) in found.into_iter().enumerate() {
            assert_eq!((Rgb::new(r, g, b), a), (expected.pixels[i], image.alpha[i]));
        }
        assert_eq!(read(&path).unwrap(), expected);
    }
    let by_oiio = WriteOptions { image_io: ImageIo::Oiio, ..FLOAT };
    let error = write(&path, &image, &metadata(), &by_oiio).unwrap_err().to_string();
    assert!(error.contains("its alpha is written by the built-in writer alone"), "{error}");
    let short = Image { alpha: vec![1.0], ..picture() };
    assert!(write(&path, &short, &metadata(), &FLOAT).is_err());
    // The others show what is over black.
    for format in FORMATS.iter().skip(1) {
        let paths = ["a", "b"].map(|name| directory.path().join(name).with_extension(format));
        for (path, image) in paths.iter().zip([&image, &picture()]) {
            write(path, image, &Metadata::new(), &FLOAT).unwrap();
        }
        assert_eq!(read(&paths[0]).unwrap(), read(&paths[1]).unwrap());
    }
}

#[test]
fn exr_float_is_exact_and_half_is_rounded_once() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("a.exr");
    let image = picture();
    assert_eq!(write(&path, &image, &metadata(), &FLOAT).unwrap(), Default::default());
    assert_eq!(read(&path).unwrap(), image);
    write(&path, &image, &metadata(), &HALF).unwrap();
    assert_eq!(read(&path).unwrap(), as_half(&image));
    assert_eq!(names(directory.path()), ["a.exr"]);
}

#[test]
fn equal_images_are_equal_files() {
    let directory = TempDir::new().unwrap();
    let mut files = Vec::new();
    for i in 0..8 {
        let path = directory.path().join(format!("{i}.exr"));
        write(&path, &picture(), &metadata(), &HALF).unwrap();
        files.push(fs::read(path).unwrap());
    }
    assert!(files.iter().all(|file| *file == files[0]));
}

#[test]
fn a_new_file_has_the_mode_that_the_umask_leaves() {
    let directory = TempDir::new().unwrap();
    let (ours, plain) = (directory.path().join("a.exr"), directory.path().join("b"));
    write(&ours, &picture(), &Metadata::new(), &HALF).unwrap();
    fs::write(&plain, "").unwrap();
    let mode = |path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&plain));
}

#[test]
fn a_file_that_is_replaced_keeps_its_mode() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("a.exr");
    fs::write(&path, "old").unwrap();
    for mode in [0o600, 0o640] {
        fs::set_permissions(&path, PermissionsExt::from_mode(mode)).unwrap();
        write(&path, &picture(), &Metadata::new(), &HALF).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
    }
}

#[test]
fn a_link_stays_and_its_target_is_replaced() {
    let directory = TempDir::new().unwrap();
    let (target, link) = (directory.path().join("target.exr"), directory.path().join("link.exr"));
    fs::write(&target, "old").unwrap();
    std::os::unix::fs::symlink("target.exr", &link).unwrap();
    write(&link, &picture(), &Metadata::new(), &FLOAT).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(read(&target).unwrap(), picture());
}

#[test]
fn values_that_a_format_cannot_hold_are_counted() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("a.exr");
    let odd =
        row(&[Rgb::new(f32::NAN, 1.0, 1.0), Rgb::new(1.0, f32::INFINITY, 1.0), Rgb::new(1e6, 2.0, -1e6), Rgb::ONE]);
    let written = write(&path, &odd, &Metadata::new(), &HALF).unwrap();
    assert_eq!((written.non_finite, written.clamped), (2, 1));
    assert_eq!(read(&path).unwrap(), row(&[Rgb::ZERO, Rgb::ZERO, Rgb::new(65504.0, 2.0, -65504.0), Rgb::ONE]));
    let written = write(&path, &odd, &Metadata::new(), &FLOAT).unwrap();
    assert_eq!((written.non_finite, written.clamped), (2, 0));
    assert_eq!(read(&path).unwrap(), row(&[Rgb::ZERO, Rgb::ZERO, Rgb::new(1e6, 2.0, -1e6), Rgb::ONE]));
}

#[test]
fn what_half_floats_hold_with_too_few_digits_is_told() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("a.exr");
    let too_dim = |pixels: &[f32], options| {
        let image = row(&pixels.iter().map(|x| Rgb::splat(*x)).collect::<Vec<_>>());
        write(&path, &image, &metadata(), options).unwrap().too_dim
    };
    assert!(too_dim(&[0.0, 1e-6, 1e-6, 1.0], &HALF));
    assert!(!too_dim(&[0.0, 1e-6, 1.0, 1.0], &HALF));
    assert!(!too_dim(&[1e-6, 1e-6, 1.0], &FLOAT));
    assert!(!too_dim(&[0.0, 0.0], &HALF));
}

#[test]
fn what_cannot_be_written_is_refused_before_and_at_writing() {
    let directory = TempDir::new().unwrap();
    let at = |name: &str| directory.path().join(name);
    fs::create_dir(at("directory.exr")).unwrap();
    fs::write(at("protected.exr"), "old").unwrap();
    fs::set_permissions(at("protected.exr"), PermissionsExt::from_mode(0o444)).unwrap();
    fs::write(at("file"), "").unwrap();
    std::os::unix::fs::symlink("/dev/full", at("device.exr")).unwrap();
    let before = names(directory.path());
    let cases = [
        (at("a.webm"), "unknown image format '.webm'"),
        (at("a"), "no extension"),
        (at("missing/a.exr"), "there is no directory"),
        (at("file/a.exr"), "Not a directory"),
        (at("directory.exr"), "not a regular file"),
        (at("device.exr"), "not a regular file"),
        (at("protected.exr"), "write-protected"),
        // Nobody, the superuser included, makes files there.
        (PathBuf::from("/proc/a.exr"), "cannot write"),
    ];
    for (path, reason) in &cases {
        let checked = check_writable(path, &HALF).unwrap_err().to_string();
        let tried = write(path, &picture(), &Metadata::new(), &HALF).unwrap_err().to_string();
        for error in [checked, tried] {
            assert!(error.starts_with(&*path.to_string_lossy()) && error.contains(reason), "{error}");
        }
    }
    let broken = Image { width: 4, ..picture() };
    for image in [Image::default(), broken] {
        let error = write(&at("a.exr"), &image, &Metadata::new(), &HALF).unwrap_err();
        assert!(matches!(error, ImageError::Unsupported { .. }), "{error}");
    }
    let error = check_writable(&at("a.exr"), &WriteOptions { exposure: f32::NAN, ..HALF }).unwrap_err().to_string();
    assert!(error.contains("exposure is NaN"), "{error}");
    let mut cut = Metadata::new();
    cut.set("settings", "a\0b");
    assert!(write(&at("a.exr"), &picture(), &cut, &HALF).is_err());
    check_writable(&at("a.exr"), &HALF).unwrap();
    assert_eq!(names(directory.path()), before);
    assert_eq!(fs::read(at("protected.exr")).unwrap(), b"old");
}

/// A file size limit of 1 KiB stands for the full disk: the write fails half-way, whoever runs it.
#[test]
fn a_full_disk_leaves_the_old_file_and_nothing_else() {
    if let Some(directory) = child_directory() {
        for format in FORMATS {
            let path = directory.join(format!("a.{format}"));
            fs::write(&path, "old").unwrap();
            let image = Image::new(37 * 2, 23 * 2, picture().pixels.repeat(4));
            let error = write(&path, &image, &Metadata::new(), &FLOAT).unwrap_err();
            assert!(matches!(error, ImageError::Io { .. }), "{error}");
            assert_eq!(fs::read(&path).unwrap(), b"old");
        }
        return;
    }
    let directory = TempDir::new().unwrap();
    // Without the signal, write() returns EFBIG.
    let limit = "trap '' XFSZ; ulimit -f 1 || exit 1";
    assert_passed(&child("a_full_disk_leaves_the_old_file_and_nothing_else", limit, directory.path()));
    let mut expected: Vec<_> = FORMATS.iter().map(|format| format!("a.{format}")).collect();
    expected.sort();
    assert_eq!(names(directory.path()), expected);
}

#[test]
fn exr_files_need_no_openimageio() {
    if let Some(directory) = child_directory() {
        let path = directory.join("a.exr");
        check_writable(&path, &HALF).unwrap();
        write(&path, &picture(), &metadata(), &HALF).unwrap();
        read(&path).unwrap();
        let maps = fs::read_to_string("/proc/self/maps").unwrap();
        assert!(!maps.contains("OpenImageIO") && !maps.contains("caustica_oiio"), "{maps}");
        return;
    }
    let directory = TempDir::new().unwrap();
    assert_passed(&child("exr_files_need_no_openimageio", "", directory.path()));
}

/// Cuts and changes it. Decoders of JPEG and HDR fill up what is missing at the end, others must tell.
fn read_damaged(path: &Path, tells: bool) {
    let whole = fs::read(path).unwrap();
    for i in 0..40 {
        fs::write(path, &whole[..whole.len() * i / 40]).unwrap();
        assert!(read(path).is_err() || !tells, "{} cut to {i}/40 was read", path.display());
    }
    let mut random = 0x9e37_79b9_7f4a_7c15u64;
    for _ in 0..100 {
        let mut file = whole.clone();
        for _ in 0..3 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Half of the changes in the first 500 bytes, where the headers are.
            let range = if random >> 63 == 0 { file.len() } else { file.len().min(500) };
            file[(random >> 20) as usize % range] = (random >> 8) as u8;
        }
        fs::write(path, &file).unwrap();
        if let Ok(read) = read(path) {
            assert_eq!(read.pixels.len() as u64, u64::from(read.width) * u64::from(read.height));
        }
    }
}

/// Every truncation of a small file, and changed bytes all over it: an error or an image, no panic,
/// and no memory beyond what the file can be about.
#[test]
fn damaged_files_are_errors() {
    let directory = TempDir::new().unwrap();
    let image = Image::new(19, 21, picture().pixels[..19 * 21].to_vec());
    for format in FORMATS {
        let path = directory.path().join(format!("a.{format}"));
        write(&path, &image, &metadata(), &HALF).unwrap();
        read_damaged(&path, matches!(*format, "exr" | "png" | "tif"));
    }
    let error = read(&directory.path().join("missing.exr")).unwrap_err();
    assert!(matches!(error, ImageError::Io { .. }), "{error}");
}

/// Long and empty texts: OpenImageIO's IPTC writer ends the process at an empty description, its JPEG
/// writer at one of more than 64 KiB.
#[test]
fn any_length_of_metadata_can_be_written() {
    let directory = TempDir::new().unwrap();
    for format in FORMATS {
        let path = directory.path().join(format!("a.{format}"));
        for length in [0, 1, 255, 70_000] {
            let mut metadata = Metadata::new();
            metadata.set("settings", "x".repeat(length));
            for metadata in [metadata, Metadata::new()] {
                write(&path, &picture(), &metadata, &HALF).unwrap();
                assert_eq!(read(&path).unwrap().width, 37);
            }
        }
    }
}

/// A header that claims 2^30 x 2^30 pixels must not take the memory for them.
#[test]
fn absurd_sizes_are_errors() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("a.exr");
    write(&path, &picture(), &Metadata::new(), &HALF).unwrap();
    let whole = fs::read(&path).unwrap();
    let window = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = whole.windows(window.len()).position(|w| w == window).unwrap() + window.len() + 8;
    for (width, height) in [(1i32 << 30, 1i32 << 30), (1 << 30, 22), (36, 1 << 30), (i32::MAX, i32::MAX), (-5, -5)] {
        let mut file = whole.clone();
        file[at..at + 4].copy_from_slice(&width.to_le_bytes());
        file[at + 4..at + 8].copy_from_slice(&height.to_le_bytes());
        fs::write(&path, file).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, ImageError::Codec { .. }), "{error}");
    }
}

#[cfg(not(feature = "oiio"))]
#[test]
fn other_formats_name_the_missing_feature() {
    let directory = TempDir::new().unwrap();
    let exr = directory.path().join("a.exr");
    let png = directory.path().join("a.png");
    fs::write(&png, "").unwrap();
    let by_oiio = WriteOptions { image_io: ImageIo::Oiio, ..HALF };
    for error in [
        check_writable(&png, &HALF).unwrap_err(),
        write(&png, &picture(), &Metadata::new(), &HALF).unwrap_err(),
        check_writable(&exr, &by_oiio).unwrap_err(),
        read(&png).unwrap_err(),
    ] {
        assert!(matches!(error, ImageError::Module { .. }) && error.to_string().contains("feature 'oiio'"), "{error}");
    }
    check_writable(&exr, &HALF).unwrap();
}

#[cfg(feature = "oiio")]
mod openimageio {
    use super::*;
    use caustica::render::Region;
    use exr::meta::MetaData;

    const BY_OIIO: WriteOptions = WriteOptions { image_io: ImageIo::Oiio, ..HALF };

    /// Largest difference of a channel, relative to the largest channel of the pixel.
    fn relative_difference(a: &Image, b: &Image) -> f32 {
        assert_eq!((a.width, a.height, a.pixels.len()), (b.width, b.height, b.pixels.len()));
        let pairs = a.pixels.iter().zip(&b.pixels);
        pairs.map(|(a, b)| (*a - *b).abs().max_element() / b.max_element()).fold(0.0, f32::max)
    }

    /// What oiiotool prints.
    fn oiiotool(arguments: &[&str], file: &Path, rest: &[&str]) -> (bool, String) {
        let output = Command::new("oiiotool").args(arguments).arg(file).args(rest).output();
        let output = output.expect("oiiotool does not start: scripts/setup.sh installs it (openimageio-tools)");
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        (output.status.success(), text.into_owned())
    }

    #[test]
    fn exr_by_oiio_is_exr_by_exr() {
        let directory = TempDir::new().unwrap();
        let (ours, theirs) = (directory.path().join("exr.exr"), directory.path().join("oiio.exr"));
        for half in [true, false] {
            write(&ours, &picture(), &metadata(), &WriteOptions { half, ..HALF }).unwrap();
            write(&theirs, &picture(), &metadata(), &WriteOptions { half, ..BY_OIIO }).unwrap();
            assert_eq!(read(&ours).unwrap(), read(&theirs).unwrap());

            let header = |path: &PathBuf| MetaData::read_from_file(path, true).unwrap().headers[0].clone();
            let (a, b) = (header(&ours), header(&theirs));
            assert_eq!(a.channels, b.channels);
            assert_eq!((a.compression, a.blocks, a.line_order), (b.compression, b.blocks, b.line_order));
            assert_eq!(a.data_window(), b.data_window());
            let (s, t) = (&a.shared_attributes, &b.shared_attributes);
            assert_eq!((s.display_window, s.pixel_aspect), (t.display_window, t.pixel_aspect));
            assert!(s.chromaticities.is_some() && s.chromaticities == t.chromaticities);
            let (o, p) = (&a.own_attributes, &b.own_attributes);
            assert!(o.software_name.is_some() && o.software_name == p.software_name, "{:?}", p);
            assert_eq!(
                (o.screen_window_center, o.screen_window_width),
                (p.screen_window_center, p.screen_window_width)
            );
            assert_eq!(o.other.len(), 7);
            for (name, value) in &o.other {
                assert_eq!(p.other.get(name), Some(value), "{name}");
            }

            // And by a reader that is neither of the two crates: OpenImageIO over OpenEXR.
            let (equal, text) = oiiotool(&[], &ours, &[theirs.to_str().unwrap(), "--diff"]);
            assert!(equal && text.contains("PASS"), "{text}");
        }
    }

    #[test]
    fn oiiotool_reads_the_metadata() {
        let directory = TempDir::new().unwrap();
        let path = directory.path().join("a.exr");
        write(&path, &picture(), &metadata(), &HALF).unwrap();
        let (_, text) = oiiotool(&["--info", "-v"], &path, &[]);
        for line in [
            "37 x   23, 3 channel, half openexr",
            "channel list: R, G, B",
            "caustica:samples: 64",
            "caustica:seed: \"18446744073709551615\"",
            "caustica:settings: \"integrator=bdpt scene='Glühbirne.glb'\"",
            "caustica:scene-hash: \"0123abcd\"",
            "caustica:backend: \"embree\"",
            "caustica:noise: 0.125",
            concat!("caustica:version: \"", env!("CARGO_PKG_VERSION"), "\""),
            concat!("oftware: \"caustica ", env!("CARGO_PKG_VERSION"), "\""),
            "chromaticities: 0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329",
            "compression: \"zip\"",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
        for format in ["png", "tif", "jpg"] {
            let path = directory.path().join(format!("a.{format}"));
            write(&path, &picture(), &metadata(), &HALF).unwrap();
            let (_, text) = oiiotool(&["--info", "-v"], &path, &[]);
            for part in ["Software: \"caustica ", "seed: 18446744073709551615"] {
                assert!(text.contains(part), "{part} is not in\n{text}");
            }
        }
    }

    /// A region lies at its place in the frame, in formats that have windows, and is read alone.
    #[test]
    fn a_region_keeps_its_place_in_files() {
        let directory = TempDir::new().unwrap();
        let region = Region { x: 100, y: 7, width: 37, height: 23 };
        let mut metadata = Metadata::new();
        metadata.set_window(region, 640, 30);
        let oiio = WriteOptions { image_io: ImageIo::Oiio, ..FLOAT };
        for (name, options) in
            [("a.exr", &FLOAT), ("b.exr", &oiio), ("c.tif", &FLOAT), ("d.png", &FLOAT), ("e.jpg", &FLOAT)]
        {
            let path = directory.path().join(name);
            write(&path, &picture(), &metadata, options).unwrap();
            let (_, text) = oiiotool(&["--info", "-v"], &path, &[]);
            let placed = text.contains("origin: x=100, y=7") && text.contains("full/display size: 640 x 30");
            assert_eq!(placed, name.ends_with("exr") || name.ends_with("tif"), "{name}: {text}");
            let image = read(&path).unwrap();
            assert_eq!((image.width, image.height), (37, 23), "{name}");
            assert!(!name.ends_with("exr") || image == picture(), "{name}");
        }
        metadata.set_window(Region { x: 604, ..region }, 640, 30);
        let error = write(&directory.path().join("f.exr"), &picture(), &metadata, &FLOAT).unwrap_err().to_string();
        assert!(error.contains("37x23+604+7 of 640x30"), "{error}");
        // EXR has signed windows.
        metadata.set_window(Region { x: 1 << 31, ..region }, u32::MAX, 30);
        let error = write(&directory.path().join("f.exr"), &picture(), &metadata, &FLOAT).unwrap_err().to_string();
        assert!(error.contains("37x23+2147483648+7 of 4294967295x30"), "{error}");
    }

    /// 255 * (1.055 x^(1/2.4) - 0.055): 0.5 -> 187.52, 0.18 -> 117.65, 0.25 -> 136.96; 255 * 12.92 * 0.001 = 3.29.
    #[test]
    fn png_holds_srgb_codes() {
        let directory = TempDir::new().unwrap();
        let path = directory.path().join("a.png");
        let image =
            row(&[Rgb::splat(0.5), Rgb::new(0.0, 1.0, 8.0), Rgb::new(0.18, 0.25, 0.001), Rgb::new(f32::NAN, 1.0, 1.0)]);
        let codes = |options: &WriteOptions| {
            let written = write(&path, &image, &Metadata::new(), options).unwrap();
            assert_eq!((written.non_finite, written.clamped), (1, 0));
            let (_, text) = oiiotool(&["--dumpdata"], &path, &[]);
            let pixel =
                |line: &str| line.split_once("): ").map(|(_, v)| v.split(" (").next().unwrap().trim().to_owned());
            text.lines().filter_map(pixel).collect::<Vec<_>>()
        };
        assert_eq!(codes(&HALF), ["188 188 188", "0 255 255", "118 137 3", "0 0 0"]);
        // One stop down: 0.25 -> 137, 0.5 -> 188, 4 -> 255, 0.09 -> 84.9, 0.125 -> 99.1, 0.0005 -> 1.6.
        assert_eq!(codes(&WriteOptions { exposure: -1.0, ..HALF }), ["137 137 137", "0 188 255", "85 99 2", "0 0 0"]);
        assert_eq!(
            codes(&WriteOptions { exposure: 200.0, ..HALF }),
            ["255 255 255", "0 255 255", "255 255 255", "0 0 0"]
        );
    }

    #[test]
    fn every_format_comes_back() {
        let directory = TempDir::new().unwrap();
        let at = |name: &str| directory.path().join(name);
        let image = picture();
        // Exposure is for 8 bits alone.
        let exposed = WriteOptions { exposure: 3.0, ..FLOAT };
        for name in ["a.TIF", "a.tiff", "a.exr"] {
            write(&at(name), &image, &metadata(), &exposed).unwrap();
            assert_eq!(read(&at(name)).unwrap(), image, "{name}");
        }
        // RGBE: eight bits for the largest channel, at least half of them used.
        write(&at("a.hdr"), &image, &metadata(), &exposed).unwrap();
        let difference = relative_difference(&read(&at("a.hdr")).unwrap(), &image);
        assert!(difference <= 1.0 / 128.0 && difference > 0.0, "{difference}");
        // Rounded, not cut: as much above as below.
        let light = row(&(0..4096).map(|i| Rgb::splat(1.0 + i as f32 / 4096.0)).collect::<Vec<_>>());
        write(&at("a.hdr"), &light, &metadata(), &exposed).unwrap();
        let mean = |image: &Image| image.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / 4096.0;
        assert!((mean(&read(&at("a.hdr")).unwrap()) - mean(&light)).abs() < 2e-4);
        let written =
            write(&at("a.hdr"), &row(&[Rgb::new(-1.0, 0.5, 1.0), Rgb::splat(f32::MAX)]), &metadata(), &HALF).unwrap();
        assert_eq!(written.clamped, 2);
        let back = read(&at("a.hdr")).unwrap();
        assert_eq!(back.pixels[0], Rgb::new(0.0, 0.5, 1.0));
        assert!(back.pixels[1].min_element() > 1.6e38, "{:?}", back.pixels[1]);

        // A ramp of all codes: PNG holds each exactly, JPEG nearly, as it is smooth and grey.
        let decode = |code: u32| ((f64::from(code) / 255.0 + 0.055) / 1.055).powf(2.4) as f32;
        let ramp = row(&(11..256).map(|code| Rgb::splat(decode(code))).collect::<Vec<_>>());
        write(&at("a.png"), &ramp, &metadata(), &HALF).unwrap();
        assert!(relative_difference(&read(&at("a.png")).unwrap(), &ramp) < 1e-6);
        for name in ["a.jpg", "a.jpeg"] {
            write(&at(name), &ramp, &metadata(), &HALF).unwrap();
            // Two codes of 255, at the steepest place of the transfer (2.27).
            let back = read(&at(name)).unwrap();
            let worst = back.pixels.iter().zip(&ramp.pixels).map(|(a, b)| (*a - *b).abs().max_element());
            assert!(worst.fold(0.0, f32::max) < 2.0 * 2.28 / 255.0);
        }
    }

    /// The JPEG writer ends the process there.
    #[test]
    fn jpeg_has_a_largest_size() {
        let directory = TempDir::new().unwrap();
        let path = directory.path().join("a.jpg");
        write(&path, &row(&vec![Rgb::ONE; 65_500]), &Metadata::new(), &HALF).unwrap();
        let error = write(&path, &row(&vec![Rgb::ONE; 65_501]), &Metadata::new(), &HALF).unwrap_err();
        assert!(error.to_string().contains("65501x1 is too large for JPEG"), "{error}");
        assert_eq!(read(&path).unwrap().width, 65_500);
    }

    #[test]
    fn grey_alpha_and_other_layouts_are_read() {
        let directory = TempDir::new().unwrap();
        let at = |name: &str| directory.path().join(name);
        let make = |arguments: &[&str], file: &Path| {
            let (made, text) = oiiotool(arguments, file, &[]);
            assert!(made, "{text}");
        };
        let grey = ["--pattern", "constant:color=0.5", "8x4", "1", "--chnames", "Y", "-d", "float", "-o"];
        make(&grey, &at("grey.exr"));
        assert_eq!(read(&at("grey.exr")).unwrap().pixels, vec![Rgb::splat(0.5); 32]);
        // Tiles, unsigned integers, more channels in an order of their own, an offset data window.
        let odd = [
            "--pattern",
            "constant:color=1,2,3,4,5",
            "40x33",
            "5",
            "--chnames",
            "Z,B,A,R,G",
            "--origin",
            "+3-5",
            "--tile",
            "16",
            "16",
            "-d",
            "float",
            "--compression",
            "piz",
            "-o",
        ];
        make(&odd, &at("odd.exr"));
        let image = read(&at("odd.exr")).unwrap();
        assert_eq!((image.width, image.height), (40, 33));
        assert_eq!(image.pixels, vec![Rgb::new(4.0, 5.0, 2.0); 40 * 33]);
        // Alpha of 0 must not blacken the colour.
        make(
            &[
                "--pattern",
                "constant:color=1,1,1,0",
                "4x4",
                "4",
                "--attrib:type=int",
                "oiio:UnassociatedAlpha",
                "1",
                "-d",
                "uint8",
                "-o",
            ],
            &at("a.png"),
        );
        assert_eq!(read(&at("a.png")).unwrap().pixels, vec![Rgb::ONE; 16]);
        // 16-bit integers are sRGB too: 0.735357 is the code of 0.5.
        make(&["--pattern", "constant:color=0.735357", "4x4", "1", "-d", "uint16", "-o"], &at("b.png"));
        assert!(read(&at("b.png")).unwrap().pixels.iter().all(|p| (*p - Rgb::splat(0.5)).abs().max_element() < 2e-5));
        for compression in ["none", "rle", "zips", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"] {
            let noise = ["--pattern", "noise:type=uniform:min=0:max=2", "40x33", "4", "--compression", compression];
            make(&[&noise[..], &["-d", "half", "-o"]].concat(), &at("d.exr"));
            // The same, as OpenImageIO decodes it.
            let (made, text) =
                oiiotool(&[], &at("d.exr"), &["--compression", "zip", "-o", at("e.exr").to_str().unwrap()]);
            assert!(made, "{text}");
            let (d, e) = (read(&at("d.exr")).unwrap(), read(&at("e.exr")).unwrap());
            assert!(d == e && d.pixels.iter().any(|p| *p != d.pixels[0]), "{compression}");
            if ["b44", "dwaa"].contains(&compression) {
                read_damaged(&at("d.exr"), false);
            }
        }
        // Grey, with more than OpenImageIO tells apart.
        for (channels, is_read) in [("Y,A", true), ("Y,A,Z", false)] {
            let n = channels.split(',').count().to_string();
            let constant = ["--pattern", "constant:color=0.5,1,7", "40x33", &n, "--chnames", channels];
            make(&[&constant[..], &["--compression", "dwaa", "-d", "half", "-o"]].concat(), &at("f.exr"));
            // DWA keeps three digits.
            let grey = |p: &Rgb| (*p - Rgb::splat(0.5)).abs().max_element() < 1e-3;
            let error = read(&at("f.exr")).map(|image| assert!(image.pixels.iter().all(grey))).err();
            assert_eq!(error.is_none(), is_read, "{error:?}");
            assert!(error.is_none_or(|error| error.to_string().contains("--compression zip")));
        }
        make(&["--pattern", "constant:color=1", "4x4", "1", "--chnames", "depth", "-o"], &at("c.exr"));
        assert!(matches!(read(&at("c.exr")), Err(ImageError::Unsupported { .. })));
    }

    /// Design decision D4: the library does not depend on OpenImageIO, nor does it export the module's functions.
    #[test]
    fn the_library_does_not_link_openimageio() {
        let dependencies = std::env::current_exe().unwrap().parent().unwrap().to_owned();
        let library = dependencies.join("libcaustica.so");
        for arguments in [["-d", "-W"], ["--dyn-syms", "-W"]] {
            let output = Command::new("readelf").args(arguments).arg(&library).output().unwrap();
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(output.status.success() && text.contains("libc.so.6") || text.contains("@GLIBC"), "{text}");
            assert!(!text.contains("OpenImageIO") && !text.contains("caustica_oiio"), "{text}");
        }
    }
}

/// A cropped map would be stretched over the sphere, a cube map read as something else.
#[test]
fn an_environment_is_all_of_a_latitude_longitude_map() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sky.exr");
    let read = |position: (i32, i32), display: (usize, usize), kind: Option<attribute::EnvironmentMap>| {
        let mut layer = LayerAttributes::named("");
        (layer.layer_position, layer.environment_map) = (position.into(), kind);
        let pixels = SpecificChannels::rgb(|at: Vec2<usize>| (at.x() as f32, 1.0f32, 2.0f32));
        let mut image = Image::from_layer(Layer::new((4, 2), layer, Encoding::UNCOMPRESSED, pixels));
        image.attributes.display_window = IntegerBounds::from_dimensions(display);
        image.write().to_file(&path).expect("an EXR file");
        read_environment(&path).map(|map| map.size()).map_err(|error| error.to_string())
    };
    assert_eq!(read((0, 0), (4, 2), None), Ok((4, 2)));
    assert_eq!(read((0, 0), (4, 2), Some(attribute::EnvironmentMap::LatitudeLongitude)), Ok((4, 2)));
    for (position, display) in [((0, 0), (4, 4)), ((0, 2), (4, 4)), ((1, 0), (4, 2))] {
        assert!(read(position, display, None).expect_err("refused").contains("a part of its display window"));
    }
    assert!(read((0, 0), (4, 2), Some(attribute::EnvironmentMap::Cube)).expect_err("refused").contains("cube map"));
}
