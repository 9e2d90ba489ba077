//! The C interface from outside: the header against the library, and C hosts, compiled here and run
//! against the shared library that `cargo test` has built.

mod capi_header;

use capi_header::Header;
use caustica::capi;
use caustica::io::gltf;
use caustica::math::Rgb;
use caustica::render::{self, Cancel, Settings};
use caustica::scene::{CommitOptions, World, description::*};
use glam::{DAffine3, DMat3, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Cargo puts the shared library beside the test programs.
fn library() -> PathBuf {
    let here = std::env::current_exe().unwrap();
    let path = here.parent().unwrap().join("libcaustica.so");
    assert!(path.exists(), "{} is not there", path.display());
    path
}

fn header() -> Header {
    Header::parse(&std::fs::read_to_string(root().join("include/caustica.h")).unwrap())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const C11: [&str; 6] = ["-x", "c", "-std=c11", "-Wall", "-Wextra", "-Wpedantic"];
const CPP17: [&str; 6] = ["-x", "c++", "-std=c++17", "-Wall", "-Wextra", "-Wpedantic"];

fn compiler(language: &[&str]) -> Command {
    let (variable, default) = if language == C11 { ("CC", "cc") } else { ("CXX", "c++") };
    let mut command = Command::new(std::env::var(variable).unwrap_or_else(|_| default.to_owned()));
    command.args(language).arg("-Werror").arg("-I").arg(root().join("include"));
    command
}

fn must(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{command:?}: {}\n{out}\n{err}", output.status);
    output
}

/// A directory with the library under its soname, and hosts.
struct Hosts {
    dir: tempfile::TempDir,
}

impl Hosts {
    fn new() -> Hosts {
        let dir = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(library(), dir.path().join("libcaustica.so")).unwrap();
        std::os::unix::fs::symlink(library(), dir.path().join("libcaustica.so.0")).unwrap();
        Hosts { dir }
    }

    fn build(&self, source: &Path, name: &str, flags: &[&str]) -> PathBuf {
        let program = self.dir.path().join(name);
        let mut command = compiler(&C11);
        command.args(flags).arg(source).args(["-x", "none", "-o"]).arg(&program);
        must(command.arg("-L").arg(self.dir.path()).args(["-lcaustica", "-lm", "-pthread"]));
        program
    }

    /// What the host prints; on stderr, nothing.
    fn run(&self, program: &Path, arguments: &[&str]) -> String {
        let mut command = Command::new(program);
        let output = must(command.args(arguments).env("LD_LIBRARY_PATH", self.dir.path()).current_dir(self.dir.path()));
        assert_eq!(text(&output.stderr), "", "{} wrote to stderr", program.display());
        text(&output.stdout)
    }

    fn build_and_run(&self, name: &str, flags: &[&str]) -> String {
        let source = root().join(format!("tests/c/{name}.c"));
        self.run(&self.build(&source, name, flags), &[])
    }
}

#[cfg(feature = "oiio")]
#[test]
fn the_settings_of_a_host_that_uses_openimageio_are_its_own() {
    let hosts = Hosts::new();
    let program = hosts.dir.path().join("oiio_host");
    let flags = text(&must(Command::new("pkg-config").args(["--cflags", "--libs", "OpenImageIO"])).stdout);
    let mut command = compiler(&["-x", "c++", "-std=c++17", "-Wall"]);
    command.arg(root().join("tests/c/oiio_host.cpp")).args(["-x", "none", "-o"]).arg(&program);
    must(command.arg("-L").arg(hosts.dir.path()).arg("-lcaustica").args(flags.split_whitespace()));
    assert_eq!(hosts.run(&program, &[]), "threads 7, exr_threads 3\n");
}

#[test]
fn the_header_compiles_alone_and_twice_as_c_and_as_cpp() {
    let dir = tempfile::tempdir().unwrap();
    let source = dir.path().join("header.c");
    for includes in [1, 2] {
        let text = "#include \"caustica.h\"\n".repeat(includes) + "extern caustica_device* device;\n";
        std::fs::write(&source, text).unwrap();
        for language in [&C11, &CPP17] {
            must(compiler(language).arg("-fsyntax-only").arg(&source));
        }
    }
}

#[test]
fn the_library_exports_what_the_header_declares() {
    let listed = must(Command::new("nm").args(["-D", "--defined-only"]).arg(library()));
    let exported: BTreeSet<String> =
        text(&listed.stdout).lines().filter_map(|line| line.split_whitespace().nth(2).map(str::to_owned)).collect();
    assert_eq!(exported, header().functions);
}

#[test]
fn the_guard_makes_every_exported_function() {
    let mut found = Vec::new();
    let mut directories = vec![root().join("src")];
    while let Some(directory) = directories.pop() {
        for entry in std::fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                directories.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let count = text.matches("no_mangle").count() + text.matches("export_name").count();
                found.extend(std::iter::repeat_n(path, count));
            }
        }
    }
    assert_eq!(found, [root().join("src/capi/guard.rs")]);
}

#[test]
fn every_function_is_called_wrongly() {
    let calls = std::fs::read_to_string(root().join("tests/c/wrong_calls.c")).unwrap();
    for function in header().functions {
        assert!(calls.contains(&format!("{function}(")), "{function}");
    }
}

/// Sizes and offsets of the Rust side, named as in C.
macro_rules! layouts {
    ($($c:ident = $rust:ty { $($field:ident),+ })+) => {{
        let mut all = BTreeMap::new();
        $(
            all.insert(stringify!($c).to_owned(), size_of::<$rust>() as i128);
            $(all.insert(
                concat!(stringify!($c), ".", stringify!($field)).to_owned(),
                std::mem::offset_of!($rust, $field) as i128,
            );)+
        )+
        all
    }};
}

/// Constants of the Rust side, named as in C.
macro_rules! constants {
    ($all:ident, $($module:ident { $($name:ident),+ })+) => {
        $($($all.insert(concat!("CAUSTICA_", stringify!($name)).to_owned(), capi::$module::$name as i128);)+)+
    };
}

#[test]
fn both_sides_agree_on_layouts_and_constants() {
    let mut rust = layouts! {
        caustica_detail = capi::error::Detail {
            struct_size, code, object_kind, reserved, object_id, index, object_name, parameter, text
        }
        caustica_device_options = capi::device::DeviceOptions {
            struct_size, version, num_threads, backend, message, user
        }
        caustica_mesh_desc = capi::mesh::MeshDesc {
            struct_size, reserved, name, positions, position_stride, normals, normal_stride, vertex_count, indices,
            index_count, texture_coordinates, texture_coordinate_stride
        }
        caustica_texture_desc = capi::texture::TextureDesc {
            struct_size, format, name, width, height, texels, texel_stride, path, wrap_u, wrap_v, filter, reserved
        }
        caustica_material_desc = capi::material::MaterialDesc {
            struct_size, model, name, color, roughness, ior, ior_outside, absorption, absorption_outside, metallic,
            specular, specular_color, transmission, solid, emission, emission_two_sided, walked_roughness,
            color_texture, metallic_roughness_texture, emission_texture, normal_texture, normal_scale, reserved,
            texture_transform, abbe_number, abbe_number_outside
        }
        caustica_environment_desc = capi::environment::EnvironmentDesc {
            struct_size, width, height, radiance, pixels, pixel_stride, path, transform
        }
        caustica_commit_report = capi::scene::CommitReport {
            struct_size, warning_count, triangle_count, scene_hash, seconds, center, radius
        }
        caustica_light_desc = capi::light::LightDesc {
            struct_size, kind, name, position, direction, inner_angle, outer_angle, intensity, reserved
        }
        caustica_camera_desc = capi::camera::CameraDesc {
            struct_size, projection, name, transform, yfov, ymag, lens_radius, focus_distance, shift
        }
        caustica_progress = capi::render::Progress {
            struct_size, state, fraction, samples, rays, elapsed_seconds, noise, reserved, render
        }
        caustica_render_desc = capi::request::RenderDesc {
            struct_size, integrator, scene, camera, width, height, samples, max_depth, seed, time_limit_seconds,
            num_threads, caustics_only, progress, user, caustic_options, noise_limit, first_sample,
            region, features, clamp, transparent, reserved, camera_desc, done
        }
        caustica_region = capi::request::Region { x, y, width, height }
        caustica_caustic_options = capi::options::CausticOptions {
            struct_size, geometry_term, check, roulette, roulette_threshold, seeds, search, aim, light_subpaths,
            walk_iterations, walk_tolerance
        }
        caustica_statistics = capi::pixels::Statistics {
            struct_size, width, height, samples, camera_rays, camera_path_rays, light_path_rays, shadow_rays,
            walk_rays, connection_walks, connected_walks, check_walks, confirmed_walks, walk_iterations,
            spared_walks, forecast_variance, forecast_work, non_finite, first_non_finite_pixel,
            first_non_finite_sample, commit_seconds, render_seconds, scene_bytes, film_bytes, threads, noise,
            clamped, caustics, aimed, aim_forecast_variance, aim_forecast_work, light_subpaths,
            seeds, search, seeds_forecast_variance, seeds_forecast_work, search_forecast_variance,
            search_forecast_work, backend
        }
        caustica_pixels = capi::pixels::Pixels { struct_size, format, data, size, row_stride, samples, image, reserved }
    };
    constants! { rust,
        error {
            OK, TIMEOUT, CANCELLED, ERROR_INVALID_ARGUMENT, ERROR_INVALID_HANDLE, ERROR_WRONG_STATE, ERROR_UNSUPPORTED,
            ERROR_OUT_OF_MEMORY, ERROR_IO, ERROR_INCOMPATIBLE_VERSION, ERROR_INTERNAL, ERROR_BUSY, ERROR_LIMIT,
            ERROR_BACKEND, NO_INDEX, OBJECT_NONE, OBJECT_DEVICE, OBJECT_MESH, OBJECT_MATERIAL, OBJECT_SCENE,
            OBJECT_INSTANCE, OBJECT_LIGHT, OBJECT_CAMERA, OBJECT_RENDER, OBJECT_TEXTURE
        }
        texture {
            TEXELS_SRGB8, TEXELS_LINEAR8, TEXELS_FLOAT, WRAP_REPEAT, WRAP_MIRROR, WRAP_CLAMP, FILTER_LINEAR, FILTER_NEAREST
        }
        device {
            BACKEND_DEFAULT, BACKEND_EMBREE, BACKEND_OBVHS, SEVERITY_INFO, SEVERITY_WARNING, SEVERITY_ERROR
        }
        material {
            MATERIAL_DIFFUSE, MATERIAL_DIELECTRIC, MATERIAL_THIN_DIELECTRIC, MATERIAL_CONDUCTOR,
            MATERIAL_METALLIC_ROUGHNESS
        }
        scene { BUILD_STATIC, BUILD_EDITABLE }
        light { LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL }
        camera { CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC }
        request {
            INTEGRATOR_DEFAULT, INTEGRATOR_PATH, INTEGRATOR_BDPT, INTEGRATOR_MNEE, INTEGRATOR_BDPT_PLAIN,
            INTEGRATOR_LIGHT
        }
        render { STATE_RUNNING, STATE_DONE, STATE_CANCELLED, STATE_FAILED }
        options {
            GEOMETRY_TERM_EXACT, GEOMETRY_TERM_DIRECT, CHECK_EXACT, CHECK_FEW, CHECK_OFF, ROULETTE_CONTRIBUTION,
            ROULETTE_LENGTHS, ROULETTE_OFF
        }
        pixels { FORMAT_RGB_F32, FORMAT_RGBA_F32, IMAGE_RADIANCE, IMAGE_ALBEDO, IMAGE_NORMAL, IMAGE_DEPTH }
        info { VERSION }
    }
    for part in ["MAJOR", "MINOR", "PATCH"] {
        let value = match part {
            "MAJOR" => env!("CARGO_PKG_VERSION_MAJOR"),
            "MINOR" => env!("CARGO_PKG_VERSION_MINOR"),
            _ => env!("CARGO_PKG_VERSION_PATCH"),
        };
        rust.insert(format!("CAUSTICA_VERSION_{part}"), value.parse().unwrap());
    }

    // The C side, by a program that names all that the header holds.
    let header = header();
    let mut source = String::from("#include \"caustica.h\"\n#include <stdio.h>\nint main(void) {\n");
    for (name, fields) in &header.structs {
        source += &format!("printf(\"{name} %zu\\n\", sizeof({name}));\n");
        for field in fields {
            source += &format!("printf(\"{name}.{field} %zu\\n\", offsetof({name}, {field}));\n");
        }
    }
    for name in &header.constants {
        let (conversion, cast) = if name == "CAUSTICA_NO_INDEX" { ("llu", "") } else { ("lld", "(long long)") };
        let cast = if cast.is_empty() { "(unsigned long long)" } else { cast };
        source += &format!("printf(\"{name} %{conversion}\\n\", {cast}{name});\n");
    }
    source += "return 0;\n}\n";
    let hosts = Hosts::new();
    let file = hosts.dir.path().join("layout.c");
    std::fs::write(&file, source).unwrap();
    let printed = hosts.run(&hosts.build(&file, "layout", &[]), &[]);
    let c: BTreeMap<String, i128> = printed
        .lines()
        .map(|line| line.split_once(' ').map(|(name, value)| (name.to_owned(), value.parse().unwrap())).unwrap())
        .collect();
    assert_eq!(c, rust);
}

#[test]
fn wrong_calls_give_codes() {
    assert_eq!(Hosts::new().build_and_run("wrong_calls", &[]), "ok\n");
}

#[test]
fn a_host_can_rely_on_the_rules_whatever_its_compiler_flags() {
    let hosts = Hosts::new();
    let plain = hosts.build_and_run("host", &[]);
    assert!(plain.starts_with("ok "), "{plain}");
    // The same bits from a host that was linked with -ffast-math.
    assert_eq!(hosts.build_and_run("host", &["-O2", "-ffast-math"]), plain);
}

/// The mean luminance that `minimal.c` prints, of a description rendered without the C interface.
fn mean_luminance(description: &Description) -> f64 {
    let world = World::commit(description, CommitOptions::default()).unwrap();
    let settings = Settings { width: 128, height: 96, samples: 16, seed: 7, ..Settings::default() };
    let output = render::render(&world, &settings, &Cancel::default(), &|_| {}).unwrap();
    let sum: f64 =
        output.image.pixels.iter().map(|p| 0.2126 * p.x as f64 + 0.7152 * p.y as f64 + 0.0722 * p.z as f64).sum();
    sum / (96.0 * 128.0)
}

/// The scene of `minimal.c`.
fn minimal_scene() -> Description {
    let diffuse = |reflectance: f32, emission: f32| Material {
        name: String::new(),
        scattering: Scattering::Diffuse { reflectance: Rgb::splat(reflectance) },
        textures: Textures::default(),
        emission: Rgb::splat(emission),
        emission_two_sided: false,
        walked_roughness: WALKED_ROUGHNESS,
    };
    let glass = Scattering::Dielectric {
        inside: Medium::new(1.5, Rgb::ZERO),
        outside: Medium::VACUUM,
        roughness: 0.0,
        tint: Rgb::ONE,
    };
    let place = |material, geometry, x, y, z| Instance {
        name: String::new(),
        geometry,
        material,
        transform: DAffine3::from_translation(DVec3::new(x, y, z)),
    };
    Description {
        meshes: vec![Arc::new(MeshDescription {
            positions: vec![[-2.0, 0.0, -2.0], [-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..MeshDescription::default()
        })],
        materials: vec![diffuse(0.6, 0.0), Material { scattering: glass, ..diffuse(0.0, 0.0) }, diffuse(0.0, 200.0)],
        instances: vec![
            place(0, Geometry::Mesh(0), 0.0, 0.0, 0.0),
            place(1, Geometry::Sphere { radius: 0.5 }, 0.0, 0.6, 0.0),
            place(2, Geometry::Sphere { radius: 0.1 }, 1.0, 3.0, 0.0),
        ],
        cameras: vec![Camera::new(
            "",
            // Looks down by the angle whose cosine is 0.8.
            DAffine3 {
                matrix3: DMat3::from_cols(DVec3::X, DVec3::new(0.0, 0.8, -0.6), DVec3::new(0.0, 0.6, 0.8)),
                translation: DVec3::new(0.0, 3.0, 4.0),
            },
            Projection::Perspective { yfov: 0.7 },
        )],
        ..Description::default()
    }
}

#[test]
fn the_minimal_program_renders_what_the_library_renders_from_rust() {
    let hosts = Hosts::new();
    let program = hosts.build(&root().join("tests/c/minimal.c"), "minimal", &[]);
    let demo = root().join("scenes/demo.glb");
    let demo_arguments = ["demo.exr", demo.to_str().unwrap()];
    let loaded = gltf::load(&demo).unwrap().description;
    for (arguments, description) in [(&["own.exr"][..], minimal_scene()), (&demo_arguments[..], loaded)] {
        let printed = hosts.run(&program, arguments);
        let mean: f64 = printed.trim().strip_prefix("mean luminance ").unwrap().parse().unwrap();
        let expected = mean_luminance(&description);
        // The pixels are the same bits; nine digits are printed, and the weights of the mean are
        // double on this side and the other.
        assert!(expected > 0.01, "{expected}");
        assert!((mean / expected - 1.0).abs() < 1e-8, "{mean} instead of {expected}");
        assert!(hosts.dir.path().join(arguments[0]).metadata().unwrap().len() > 10_000);
    }
}
