//! The command line, run as a user runs it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell.glb");

fn caustica(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caustica")).args(args).output().expect("the program starts")
}

/// Runs, expects the exit code, returns standard output and standard error.
#[track_caller]
fn expect(code: i32, args: &[&str]) -> (String, String) {
    let output = caustica(args);
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    assert_eq!(output.status.code(), Some(code), "{args:?}\n{out}\n{err}");
    (out, err)
}

/// An empty folder of its own, removed at the end of the test.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("UTF-8").to_owned()
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<_> =
            fs::read_dir(self.0.path()).expect("a folder").map(|e| e.expect("an entry").path()).collect();
        files.sort();
        files
    }
}

/// A picture small enough for a test.
fn render(output: &str, more: &[&str]) -> (String, String) {
    let base = ["render", SCENE, "-o", output, "--size", "24x16", "--spp", "2", "--threads", "1"];
    expect(0, &[&base, more].concat())
}

/// The numbers in a line of `caustica compare`.
fn numbers(table: &str, name: &str) -> Vec<f64> {
    let line = table.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("no {name} in\n{table}"));
    line[name.len()..].split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn help_goes_to_standard_output() {
    let (out, err) = expect(0, &["--help"]);
    for command in ["render", "info", "compare", "backends"] {
        assert!(out.contains(command), "{out}");
    }
    assert_eq!(err, "");
    let (out, _) = expect(0, &["render", "--help"]);
    for option in ["--integrator", "--spp", "--time", "--max-depth", "--size", "--camera", "--backend", "--threads"] {
        assert!(out.contains(option), "{option} is not in\n{out}");
    }
    assert!(expect(0, &["--version"]).0.contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn wrong_usage_is_exit_code_2() {
    let wrong: [&[&str]; 11] = [
        &[],
        &["paint"],
        &["render", SCENE],
        &["render", SCENE, "-o", "a.exr", "--size", "640"],
        &["render", SCENE, "-o", "a.exr", "--size", "0x480"],
        &["render", SCENE, "-o", "a.exr", "--spp", "0"],
        &["render", SCENE, "-o", "a.exr", "--time", "-1"],
        &["render", SCENE, "-o", "a.exr", "--backend", "optix"],
        &["render", SCENE, "-o", "a.exr", "--exposure", "nan"],
        &["render", SCENE, "-o", "a.exr", "--integrator", "path", "--strategies", "d"],
        &["compare", "a.exr"],
    ];
    for args in wrong {
        let (out, err) = expect(2, args);
        assert!(out.is_empty() && !err.is_empty(), "{args:?}\n{out}\n{err}");
    }
    assert!(expect(2, wrong[3]).1.contains("640x480"), "the message shows what would do");
}

#[test]
fn a_missing_scene_is_named_and_leaves_nothing() {
    let folder = Folder::new();
    let (_, err) = expect(1, &["render", "no/such.glb", "-o", &folder.path("a.exr")]);
    assert!(err.contains("no/such.glb"), "{err}");
    assert_eq!(folder.files(), [] as [PathBuf; 0]);
    assert!(expect(1, &["info", "no/such.glb"]).1.contains("no/such.glb"));
}

#[test]
fn a_damaged_scene_is_named_and_leaves_nothing() {
    let folder = Folder::new();
    let scene = folder.path("cut.glb");
    let bytes = fs::read(SCENE).expect("the scene");
    fs::write(&scene, &bytes[..bytes.len() / 2]).expect("a file");
    let (_, err) = expect(1, &["render", &scene, "-o", &folder.path("a.exr")]);
    assert!(err.contains("cut.glb"), "{err}");
    assert_eq!(folder.files(), [PathBuf::from(&scene)]);
}

/// A render of this size would take hours: the refusal comes before it.
#[test]
fn an_output_that_cannot_be_written_is_refused_before_rendering() {
    let folder = Folder::new();
    let long = ["--size", "4000x4000", "--spp", "100000"];
    for (name, said) in [("a.bmp", ".bmp"), ("a", "extension"), ("no/folder/a.exr", "no/folder")] {
        let output = folder.path(name);
        let (_, err) = expect(1, &[&["render", SCENE, "-o", &output], &long[..]].concat());
        assert!(err.contains(&output) && err.contains(said), "{err}");
        // Also where a good one comes first.
        expect(1, &[&["render", SCENE, "-o", &folder.path("a.exr"), "-o", &output], &long[..]].concat());
    }
    assert_eq!(folder.files(), [] as [PathBuf; 0]);
}

#[test]
fn an_unknown_camera_is_named_with_those_there_are() {
    let folder = Folder::new();
    let (_, err) = expect(1, &["render", SCENE, "-o", &folder.path("a.exr"), "--camera", "behind"]);
    assert!(err.contains("\"behind\"") && err.contains('0'), "{err}");
    assert_eq!(folder.files(), [] as [PathBuf; 0]);
}

#[test]
fn a_render_writes_what_was_asked_for_and_says_so() {
    let folder = Folder::new();
    let output = folder.path("a.exr");
    let (out, err) = render(&output, &["-o", &folder.path("b.exr"), "--float"]);
    assert_eq!(out, "");
    assert!(err.contains("2 samples per pixel") && err.contains(&format!("wrote {output}")), "{err}");
    // No bar and no control characters where nobody looks.
    assert!(!err.contains(['\r', '\u{1b}']), "{err:?}");
    let written = folder.files();
    assert_eq!(written, [PathBuf::from(&output), PathBuf::from(folder.path("b.exr"))]);
    assert_eq!(fs::read(&written[0]).expect("a file"), fs::read(&written[1]).expect("a file"));

    let (out, err) = render(&folder.path("c.exr"), &["--quiet"]);
    assert_eq!((out.as_str(), err.as_str()), ("", ""));
}

#[test]
fn the_picture_depends_on_the_seed_and_not_on_the_threads() {
    let folder = Folder::new();
    let [one, two, other] = ["one.exr", "two.exr", "other.exr"].map(|name| folder.path(name));
    render(&one, &["--float"]);
    let base = ["render", SCENE, "-o", &two, "--size", "24x16", "--spp", "2", "--threads", "2", "--float"];
    expect(0, &base);
    render(&other, &["--float", "--seed", "1"]);

    let (table, _) = expect(0, &["compare", &one, &two]);
    for name in ["bias", "luminance bias", "MSE", "relMSE "] {
        assert!(numbers(&table, name).iter().all(|&x| x == 0.0), "{table}");
    }
    assert!(numbers(&table, "mean").iter().all(|&x| x > 0.0), "{table}");
    let (table, _) = expect(0, &["compare", &one, &other]);
    assert!(numbers(&table, "MSE")[0] > 0.0, "{table}");
}

#[test]
fn a_time_limit_ends_a_render() {
    let folder = Folder::new();
    let start = std::time::Instant::now();
    let args = ["render", SCENE, "-o", &folder.path("a.exr"), "--size", "16x16", "--time", "0.2", "--threads", "1"];
    let (_, err) = expect(0, &args);
    assert!(start.elapsed().as_secs_f64() < 30.0);
    assert!(err.contains("samples per pixel"), "{err}");
}

#[test]
fn compare_writes_the_difference_and_refuses_other_sizes() {
    let folder = Folder::new();
    let [a, b, wide, diff] = ["a.exr", "b.exr", "wide.exr", "diff.exr"].map(|name| folder.path(name));
    render(&a, &[]);
    render(&b, &["--integrator", "path"]);
    expect(0, &["compare", &a, &b, "--diff", &diff]);
    assert!(Path::new(&diff).exists());

    expect(0, &["render", SCENE, "-o", &wide, "--size", "32x16", "--spp", "1", "--threads", "1"]);
    let (_, err) = expect(1, &["compare", &a, &wide]);
    assert!(err.contains("24x16") && err.contains("32x16") && err.contains("wide.exr"), "{err}");
    assert!(expect(1, &["compare", &a, "none.exr"]).1.contains("none.exr"));
}

#[test]
fn each_technique_becomes_two_images() {
    let folder = Folder::new();
    let strategies = folder.path("techniques");
    render(&folder.path("a.exr"), &["--strategies", &strategies, "--max-depth", "3"]);
    // With s + t - 1 <= 3 segments: direct view of light, next event, one of each of the others.
    for name in ["s00_t02", "s00_t03", "s01_t02", "s02_t02", "s02_t01"] {
        for suffix in ["", "_unweighted"] {
            let file = Path::new(&strategies).join(format!("{name}{suffix}.exr"));
            assert!(file.exists(), "{}", file.display());
        }
    }
    assert!(!Path::new(&strategies).join("s03_t02.exr").exists());
}

#[test]
fn info_counts_what_is_in_the_scene() {
    let (out, err) = expect(0, &["info", SCENE]);
    assert_eq!(err, "");
    for what in ["meshes", "instances", "triangles", "bounds", "materials", "emitters", "lights", "cameras", "warnings"]
    {
        assert!(out.contains(what), "{what} is not in\n{out}");
    }
}

#[cfg(feature = "embree")]
#[test]
fn backends_agree() {
    let args = ["backends", SCENE, "--rays", "20000", "--size", "16x16", "--spp", "2", "--threads", "1"];
    let (out, _) = expect(0, &args);
    assert!(out.contains("20000 rays"), "{out}");
    let differ = numbers(&out, "  hit against miss")[0] + numbers(&out, "  another primitive")[0];
    assert!(differ <= 2.0, "{out}");
}

#[cfg(not(feature = "embree"))]
#[test]
fn a_backend_that_is_not_built_in_is_named() {
    let folder = Folder::new();
    let (_, err) = expect(1, &["render", SCENE, "-o", &folder.path("a.exr"), "--backend", "embree"]);
    assert!(err.contains("embree"), "{err}");
}

#[cfg(feature = "oiio")]
#[test]
fn exposure_brightens_a_png() {
    let folder = Folder::new();
    let [dark, bright] = ["dark.png", "bright.png"].map(|name| folder.path(name));
    render(&dark, &["--exposure", "-3"]);
    render(&bright, &["--exposure", "0"]);
    let (table, _) = expect(0, &["compare", &bright, &dark]);
    let (bright, dark) = (numbers(&table, "mean"), numbers(&table, "reference mean"));
    // Bright pixels are clipped, so the ratio of the means lies below 8.
    assert!(bright.iter().zip(&dark).all(|(b, d)| *b > 2.0 * d && *d > 0.0), "{table}");
}
