//! The command line, run as a user runs it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell.glb");
const GLASS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/glass_sphere.glb");

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
    numbers_of(&line[name.len()..])
}

fn numbers_of(line: &str) -> Vec<f64> {
    let words = line.split(|c: char| c.is_whitespace() || "(),".contains(c));
    words.filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn help_goes_to_standard_output() {
    let (out, err) = expect(0, &["--help"]);
    for command in ["render", "info", "compare", "pixel", "backends"] {
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
    let wrong: [&[&str]; 19] = [
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
        &["pixel", SCENE, "0", "0", "--integrator", "path"],
        &["render", SCENE, "-o", "a.exr", "--walk-iterations", "4097"],
        &["render", SCENE, "-o", "a.exr", "--integrator", "path", "--seeds", "2"],
        &["render", SCENE, "-o", "a.exr", "--integrator", "mnee", "--caustics", "off"],
        &["render", SCENE, "-o", "a.exr", "--caustics", "off", "--check", "exact"],
        &["render", SCENE, "-o", "a.exr", "--paper", "--roulette-threshold", "2"],
        &["pixel", SCENE, "0", "0", "--integrator", "mnee", "--aim", "0.5"],
        &["render", SCENE, "-o", "a.exr", "--environment-rotation", "inf"],
    ];
    for args in wrong {
        let (out, err) = expect(2, args);
        assert!(out.is_empty() && !err.is_empty(), "{args:?}\n{out}\n{err}");
    }
    assert!(expect(2, wrong[3]).1.contains("640x480"), "the message shows what would do");
    assert!(expect(2, wrong[13]).1.contains("--seeds has no effect with this integrator (--integrator path)"));
}

#[test]
fn settings_out_of_range_are_wrong_usage_too() {
    for (option, value, said) in [
        ("--threads", "5000", "at most 4096"),
        ("--size", "65537x1", "65537"),
        ("--light-subpaths", "65", "65"),
        ("--check", "few", "direct geometry term"),
    ] {
        let (_, err) = expect(2, &["render", GLASS, "-o", "a.exr", option, value]);
        assert!(err.contains(said), "{err}");
    }
    let (_, err) = expect(2, &["pixel", SCENE, "0", "0", "--first-sample", "4294967294", "--spp", "4"]);
    assert!(err.contains("first_sample is 4294967294"), "{err}");
    // The last 2^14 numbers are those of the samples before a render.
    expect(2, &["pixel", SCENE, "0", "0", "--first-sample", "4294950911", "--spp", "1"]);
    expect(0, &["pixel", SCENE, "0", "0", "--first-sample", "4294950910", "--spp", "1"]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_what_is_whole() {
    let folder = Folder::new();
    let output = folder.path("a.exr");
    let args = ["render", SCENE, "-o", &output, "--size", "16x16", "--time", "600", "--threads", "1"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_caustica")).args(args).spawn().expect("the program starts");
    std::thread::sleep(std::time::Duration::from_secs(2));
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill").success());
    assert_eq!(child.wait().expect("an end").code(), Some(130));
    assert_eq!(folder.files(), [PathBuf::from(&output)]);
}

#[cfg(feature = "oiio")]
#[test]
fn one_output_that_fails_does_not_cost_the_others() {
    let folder = Folder::new();
    let [wide, whole] = ["a.jpg", "b.exr"].map(|name| folder.path(name));
    let few = ["--size", "65501x1", "--spp", "1", "--integrator", "path", "--max-depth", "1"];
    let (_, err) = expect(1, &[&["render", SCENE, "-o", &wide, "-o", &whole], &few[..]].concat());
    assert!(err.contains("65501x1"), "{err}");
    assert_eq!(folder.files(), [PathBuf::from(&whole)]);
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
fn the_settings_of_the_paper_connect_where_the_default_does_not() {
    let folder = Folder::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/figure4a.glb");
    let walks = |more: &[&str]| {
        let base = ["render", scene, "-o", &folder.path("a.exr"), "--size", "16x16", "--spp", "1", "--threads", "1"];
        expect(0, &[&base, more].concat()).1.contains("manifold walks to connect")
    };
    assert_eq!([walks(&[]), walks(&["--paper"]), walks(&["--paper", "--caustics", "off"])], [false, true, false]);
}

#[test]
fn a_time_limit_ends_a_render() {
    let folder = Folder::new();
    // Without the limit it takes minutes.
    let args = ["render", SCENE, "-o", &folder.path("a.exr"), "--size", "16x16", "--threads", "1", "--time", "0.2"];
    let (_, err) = expect(0, &[&args[..], &["--spp", "50000"]].concat());
    assert!(err.contains("samples per pixel") && !err.contains("50000 samples"), "{err}");
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
    let (_, err) = render(&folder.path("a.exr"), &["--strategies", &strategies, "--max-depth", "3"]);
    // With s + t - 1 <= 3 segments: direct view of light, next event, one of each of the others.
    for name in ["s00_t02", "s00_t03", "s01_t02", "s02_t02", "s02_t01"] {
        for suffix in ["", "_unweighted"] {
            let file = Path::new(&strategies).join(format!("{name}{suffix}.exr"));
            assert!(file.exists(), "{}", file.display());
        }
    }
    assert!(!Path::new(&strategies).join("s03_t02.exr").exists());

    let table = err.split_once("caustica: strategy").unwrap_or_else(|| panic!("no table in\n{err}")).1;
    let shares: Vec<f64> = table
        .lines()
        .skip(1)
        .map(|line| numbers_of(line)[..].iter().rev().nth(1).copied().expect("two shares"))
        .collect();
    assert!((shares.iter().sum::<f64>() - 100.0).abs() < 0.05 * shares.len() as f64, "{table}");
    let large = table.lines().skip(1).filter(|line| !line.contains("more")).count();
    assert!(shares[..large].is_sorted_by(|a, b| a >= b), "{table}");
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

#[test]
fn an_image_of_the_sky_lights_any_scene() {
    let folder = Folder::new();
    let luminance = |more: &[&str]| {
        let path = folder.path("a.exr");
        render(&path, more);
        numbers(&expect(0, &["compare", &path, &path]).0, "mean")[0]
    };
    let (sky, alone) = (concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/sky.exr"), luminance(&[]));
    let lit = luminance(&["--environment", sky]);
    assert!(lit > alone);
    let dim = luminance(&["--environment", sky, "--environment-scale", "0.5"]);
    assert!(alone < dim && dim < lit, "{alone} {dim} {lit}");
    assert_ne!(lit, luminance(&["--environment", sky, "--environment-rotation", "-120"]));
    let missing = folder.path("none.exr");
    let (_, err) = expect(1, &["render", SCENE, "-o", &folder.path("b.exr"), "--environment", &missing]);
    assert!(err.contains(&missing), "{err}");
    let info = expect(0, &["info", concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/sky.glb")]).0;
    assert!(info.contains("times an image of 128x64"), "{info}");
}

/// A ball of glass without thickness in an environment and without a camera.
#[test]
fn files_that_lack_what_a_render_needs() {
    let folder = Folder::new();
    let (scene, image) = (folder.path("ball.gltf"), folder.path("a.exr"));
    let text = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0], "extras": {"caustica": {"environment": [1, 1, 1]}}}],
        "nodes": [{"mesh": 0, "extras": {"caustica": {"sphere": {"radius": 2}}}}],
        "meshes": [{"primitives": [{"attributes": {}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}]}"#;
    fs::write(&scene, text).expect("a file");
    let render = |more: &[&str]| {
        let base = ["render", &scene, "-o", &image, "--size", "8x8", "--spp", "1", "--threads", "1"];
        expect(0, &[&base, more].concat()).1
    };
    let seen = render(&[]);
    assert!(seen.contains("seen from") && seen.contains("transmits as a thin wall does"), "{seen}");
    let seen = render(&["--solid-glass", "--look-from", "0,-9,0", "--look-at", "0,1,0", "--fov", "30"]);
    assert!(
        !seen.contains("seen from") && !seen.contains("thin") && seen.contains("1 instance is made solid"),
        "{seen}"
    );
    expect(2, &["render", &scene, "-o", &image, "--look-from", "0,1,2", "--camera", "0"]);
    expect(2, &["render", &scene, "-o", &image, "--look-from", "0,1"]);
    expect(2, &["render", &scene, "-o", &image, "--lens-radius", "0.1"]);
    let (_, err) = expect(1, &["render", SCENE, "-o", &image, "--fov", "60"]);
    assert!(err.contains("--fov needs --look-from"), "{err}");
}

#[test]
fn light_tracing_has_no_alpha() {
    let (_, err) = expect(2, &["render", SCENE, "-o", "a.exr", "--transparent", "--integrator", "light"]);
    assert!(err.contains("--transparent needs"), "{err}");
    let (_, err) = expect(2, &["render", SCENE, "-o", "a.exr", "--transparent", "--image-io", "oiio"]);
    assert!(err.contains("keeps alpha"), "{err}");
}

/// Lights of a file are as bright as it is told; white pictures are told.
#[test]
fn lights_are_scaled() {
    let folder = Folder::new();
    let (one, many, png) = (folder.path("a.exr"), folder.path("b.exr"), folder.path("a.png"));
    let base = ["render", GLASS, "--size", "16x16", "--spp", "4", "--integrator", "path", "--float"];
    expect(0, &[&base[..], &["-o", &one]].concat());
    let outputs: &[&str] = if cfg!(feature = "oiio") { &["-o", &many, "-o", &png] } else { &["-o", &many] };
    let (_, err) = expect(0, &[&base[..], outputs, &["--light-scale", "1024"]].concat());
    let told = err.contains("% of the pixels are brighter than white; see --exposure");
    assert_eq!(told, cfg!(feature = "oiio"), "{err}");
    let table = expect(0, &["compare", &many, &one]).0;
    let [bright, dim] = ["mean", "reference mean"].map(|name| numbers(&table, name)[0]);
    assert!((bright / dim / 1024.0 - 1.0).abs() < 1e-3, "{table}");
}

#[test]
fn info_says_what_cannot_be_found() {
    let (out, _) = expect(0, &["info", GLASS]);
    assert!(out.contains("missing, not noise") && out.contains("never found"), "{out}");
    assert!(!expect(0, &["info", SCENE]).0.contains("cannot find"));
}

/// The three numbers after the last `word` of a line, in its next brackets.
fn rgb_after(line: &str, word: &str) -> [f64; 3] {
    let (_, rest) = line.rsplit_once(word).unwrap_or_else(|| panic!("no {word} in {line}"));
    numbers_of(rest)[..3].try_into().expect("three numbers")
}

#[test]
fn the_paths_of_a_pixel_add_up_to_its_value() {
    let folder = Folder::new();
    let output = folder.path("a.exr");
    let common = ["--size", "24x24", "--spp", "6", "--seed", "3", "--integrator", "mnee"];
    let common = [&common[..], &["--region", "20x18+3+5", "--first-sample", "2"]].concat();
    expect(0, &[&["render", GLASS, "-o", &output, "--float", "--threads", "1"], &common[..]].concat());
    let image = caustica::io::image::read(Path::new(&output)).expect("an image");
    let mut walked = false;
    for (x, y) in [(12, 12), (10, 14), (12, 20)] {
        let pixel = image.pixels[(y - 5) * 20 + x - 3].as_dvec3().to_array();
        let (x, y) = (x.to_string(), y.to_string());
        let (out, _) = expect(0, &[&["pixel", GLASS, &x, &y], &common[..]].concat());
        let line = out.lines().find(|line| line.starts_with("mean")).expect("a mean");
        let mean = rgb_after(line, "mean");
        let mut sum = [0.0; 3];
        for path in out.lines().filter(|line| line.contains("adds")) {
            sum.iter_mut().zip(rgb_after(path, "adds")).for_each(|(sum, x)| *sum += x / 6.0);
        }
        for c in 0..3 {
            assert!((mean[c] - pixel[c]).abs() <= 1e-5 * pixel[c], "{mean:?} is not {pixel:?}\n{out}");
            // Each path is printed with five digits.
            assert!((sum[c] - pixel[c]).abs() <= 1e-4 * pixel[c], "{sum:?} is not {pixel:?}\n{out}");
        }
        walked |= out.contains("(walked)");
    }
    assert!(walked, "no path was walked");
}

#[test]
fn the_brightest_paths_come_first() {
    let args = ["pixel", SCENE, "12", "10", "--size", "24x24", "--spp", "4", "--brightest", "5"];
    let (out, _) = expect(0, &args);
    let paths = out.lines().filter(|line| line.contains("adds"));
    let largest: Vec<f64> = paths.map(|line| rgb_after(line, "adds").into_iter().fold(0.0, f64::max)).collect();
    assert!(largest.len() == 5 && largest.is_sorted_by(|a, b| a >= b), "{out}");
}

#[test]
fn a_pixel_outside_the_picture_is_named_with_the_size() {
    let (out, err) = expect(2, &["pixel", SCENE, "24", "3", "--size", "24x16"]);
    assert!(out.is_empty() && err.contains("(24, 3)") && err.contains("24x16"), "{err}");
    let (_, err) = expect(2, &["pixel", SCENE, "2", "3", "--size", "24x16", "--region", "4x5+3+3"]);
    assert!(err.contains("(2, 3)") && err.contains("4x5 pixels, the first is (3, 3)"), "{err}");
    let (_, err) = expect(2, &["pixel", SCENE, "2", "3", "--size", "24x16", "--region", "4x5+21+3"]);
    assert!(err.contains("4x5+21+3") && err.contains("24x16"), "{err}");
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
