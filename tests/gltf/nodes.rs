//! Nodes, spheres, lights, cameras.

use crate::builder::{Builder, assert_warns};
use caustica::io::gltf::load_slice;
use caustica::io::image::{Metadata, WriteOptions, write};
use caustica::math::Rgb;
use caustica::render::Image;
use caustica::scene::description::{Camera, Description, Environment, Geometry, Lens, LightKind, Projection};
use glam::{DVec2, DVec3, Vec3};
use serde_json::{Value, json};
use std::f64::consts::FRAC_1_SQRT_2;

/// A turn of 90 degrees about y, which takes x to -z, as single precision has it.
fn quarter_turn() -> Value {
    json!([0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2])
}

fn close(a: DVec3, b: [f64; 3]) -> bool {
    (a - DVec3::from(b)).abs().max_element() < 1e-6
}

fn scene(builder: &Builder) -> Description {
    builder.load().unwrap().description
}

/// Nodes 0 -> 1 -> 2, the last of which is the triangle.
fn chain(nodes: [Value; 3]) -> Builder {
    let mut builder = Builder::triangle();
    let [mut a, mut b, mut c] = nodes;
    a["children"] = json!([1]);
    b["children"] = json!([2]);
    c["mesh"] = json!(0);
    builder.json["nodes"] = json!([a, b, c]);
    builder
}

#[test]
fn transforms_nest() {
    let move_x = json!({"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 10,0,0,1]});
    let turn = json!({"rotation": quarter_turn()});
    let builder = chain([move_x, turn, json!({"translation": [0, 2, 0], "scale": [3, 4, 5]})]);
    let transform = scene(&builder).instances[0].transform;
    // (1, 1, 1) is scaled to (3, 4, 5), moved to (3, 6, 5), turned to (5, 6, -3), moved to (15, 6, -3).
    assert!(close(transform.transform_point3(DVec3::ONE), [15.0, 6.0, -3.0]));
    assert!(close(transform.transform_point3(DVec3::ZERO), [10.0, 2.0, 0.0]));
}

#[test]
fn matrices_are_by_columns() {
    // Columns (0,2,0), (0,0,3), (4,0,0), (5,6,7).
    let mut builder = Builder::triangle();
    builder.json["nodes"][0]["matrix"] = json!([0, 2, 0, 0, 0, 0, 3, 0, 4, 0, 0, 0, 5, 6, 7, 1]);
    let transform = scene(&builder).instances[0].transform;
    assert!(close(transform.transform_point3(DVec3::new(1.0, 10.0, 100.0)), [405.0, 8.0, 37.0]));
}

#[test]
fn mirrors_pass_as_they_are() {
    let mut builder = Builder::triangle();
    builder.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let found = scene(&builder);
    assert!(found.instances[0].transform.matrix3.determinant() < 0.0);
    assert_eq!(found.meshes[0].triangles, [[0, 1, 2]]);
}

#[test]
fn rotations_do_not_scale() {
    let mut builder = Builder::triangle();
    builder.json["nodes"][0]["rotation"] = json!([0, 0.71, 0, 0.71]);
    let m = scene(&builder).instances[0].transform.matrix3;
    assert!((m.determinant() - 1.0).abs() < 1e-14);
}

#[test]
fn nodes_come_in_the_order_of_the_file() {
    let mut builder = Builder::triangle();
    builder.json["nodes"] = json!([
        {"name": "a", "mesh": 0, "children": [2, 3]}, {"name": "d", "mesh": 0},
        {"name": "b", "mesh": 0}, {"name": "c", "mesh": 0}, {"name": "not in the scene", "mesh": 0},
    ]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1]);
    let names: Vec<_> = scene(&builder).instances.iter().map(|i| i.name.clone()).collect();
    assert_eq!(names, ["a", "b", "c", "d"]);
}

#[test]
fn the_scene_that_the_file_names_is_taken() {
    let mut builder = Builder::triangle();
    builder.json["nodes"] = json!([{"name": "a", "mesh": 0}, {"name": "b", "mesh": 0}]);
    builder.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}]);
    builder.json["scene"] = json!(1);
    assert_eq!(scene(&builder).instances[0].name, "b");
    builder.json.as_object_mut().unwrap().remove("scene");
    let loaded = builder.load().unwrap();
    assert_eq!(loaded.description.instances[0].name, "a");
    assert_warns(&loaded, &["no default scene", "scene 0"]);
    builder.json["scenes"] = json!([]);
    assert!(builder.error().ends_with("it has no scene"), "{}", builder.error());
}

#[test]
fn nodes_must_form_trees() {
    let parent = "parent is not the only one; nodes must form trees without cycles";
    let plain = || [json!({"name": "a"}), json!({}), json!({})];
    let mut own_child = chain(plain());
    own_child.json["nodes"][0]["children"] = json!([0]);
    assert_eq!(own_child.error(), format!("node 0 'a': {parent}"));
    let mut cycle = chain(plain());
    cycle.json["nodes"][2]["children"] = json!([0]);
    assert_eq!(cycle.error(), format!("node 0 'a': {parent}"));
    let mut shared = chain(plain());
    shared.json["nodes"][0]["children"] = json!([1, 2]);
    assert_eq!(shared.error(), format!("node 2: {parent}"));
    let mut twice = chain(plain());
    twice.json["scenes"][0]["nodes"] = json!([0, 0]);
    assert_eq!(twice.error(), format!("node 0 'a': {parent}"));
    let mut missing = chain(plain());
    missing.json["nodes"][1]["children"] = json!([2, 3]);
    assert_eq!(missing.error(), "node 1: children[1] is 3; the file has 3 of kind node");
}

/// A line of nodes, the last of which is the triangle.
fn line(length: usize) -> Builder {
    let mut builder = Builder::triangle();
    let nodes: Vec<Value> = (1..length).map(|child| json!({"children": [child]})).collect();
    builder.json["nodes"] = nodes.into();
    builder.push("nodes", json!({"mesh": 0}));
    builder
}

#[test]
fn hierarchies_are_bounded_in_depth_not_by_the_stack() {
    assert_eq!(scene(&line(1025)).instances.len(), 1);
    assert_eq!(line(1026).error(), "node 1025: depth is 1025; at most 1024 nodes below a root");
    assert!(line(200_000).error().contains("at most 1024"));
}

#[test]
fn nothing_is_as_small_as_zero() {
    let loaded = chain([json!({"scale": [0, 0, 0]}), json!({}), json!({})]).load().unwrap();
    assert_eq!(loaded.description.instances.len(), 0);
    assert_warns(&loaded, &["node 2", "hidden"]);
    let mut builder = Builder::new();
    builder.light(json!({"type": "point"}), json!({"scale": [0, 0, 0]}));
    let loaded = builder.load().unwrap();
    assert_eq!(loaded.description.lights.len(), 0);
    assert_warns(&loaded, &["node 0", "hidden"]);
}

#[test]
fn what_a_transform_flattens_is_left_out() {
    let flat = |nodes| {
        let loaded = chain(nodes).load().unwrap();
        assert_eq!(loaded.description.instances.len(), 0);
        assert_warns(&loaded, &["node 2", "flattened by its scale, it is left out"]);
    };
    flat([json!({}), json!({}), json!({"scale": [1, 0, 1]})]);
    // A flat one, turned: no entry is zero.
    flat([
        json!({"rotation": [0.1, 0.2, 0.3, 0.9]}),
        json!({"scale": [1, 0, 1]}),
        json!({"rotation": [0.5, 0.1, 0.7, 0.5]}),
    ]);
    let large = json!({"scale": [1e38, 1e38, 1e38]});
    let error = chain([large.clone(), large.clone(), large.clone()]).error();
    assert!(error.starts_with("node 2: transform to world is "), "{error}");
    assert!(error.ends_with("expected a finite one"), "{error}");
    // Small is not singular, and a node that carries nothing may hide behind zero.
    let small = chain([json!({"scale": [1e-20, 1e-20, 1e-20]}), json!({"scale": [1e-9, 1, 1]}), json!({})]);
    assert_eq!(scene(&small).instances.len(), 1);
    let mut empty = Builder::triangle();
    empty.root(json!({"scale": [0, 0, 0]}));
    assert_eq!(scene(&empty).instances.len(), 1);
}

#[test]
fn malformed_transforms_are_errors() {
    for (field, value, expected) in [
        ("translation", json!([0, 1e39, 0]), "translation[1] is inf; expected a finite number"),
        ("scale", json!([1, 1, -1e39]), "scale[2] is -inf; expected a finite number"),
        ("rotation", json!([0, 0, 0, 1e39]), "rotation[3] is inf; expected a finite number"),
        ("rotation", json!([0, 0, 0, 0]), "rotation is zero; expected a unit quaternion"),
        (
            "matrix",
            json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1e39, 0, 0, 1]),
            "matrix[12] is inf; expected a finite number",
        ),
        (
            "matrix",
            json!([1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            "matrix, last row is [0.5, 0.0, 0.0, 1.0]; expected [0, 0, 0, 1]",
        ),
    ] {
        let mut builder = Builder::triangle();
        builder.json["nodes"][0]["name"] = json!("n");
        builder.json["nodes"][0][field] = value;
        assert_eq!(builder.error(), format!("node 0 'n': {expected}"));
    }
    let mut builder = Builder::triangle();
    builder.json["nodes"][0]["mesh"] = json!(5);
    assert_eq!(builder.error(), "node 0: mesh is 5; the file has 1 of kind mesh");
    let mut builder = Builder::triangle();
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(2);
    assert_eq!(builder.error(), "mesh 0: primitives[0].material is 2; the file has 0 of kind material");
}

#[test]
fn a_node_may_be_a_sphere() {
    let mut builder = Builder::triangle();
    builder.push("materials", json!({"name": "glass"}));
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder.json["nodes"][0] = json!({"name": "ball", "mesh": 0, "translation": [1, 2, 3],
        "extras": {"caustica": {"sphere": {"radius": 0.1}}}});
    let found = scene(&builder);
    assert!(found.meshes.is_empty(), "the preview is not needed");
    let instance = &found.instances[0];
    assert!(matches!(instance.geometry, Geometry::Sphere { radius: 0.1 }));
    assert_eq!((instance.name.as_str(), instance.material), ("ball", 0));
    assert!(close(instance.transform.translation, [1.0, 2.0, 3.0]));

    let mut error = |extras: Value| {
        builder.json["nodes"][0]["extras"] = json!({"caustica": {"sphere": extras}});
        builder.error()
    };
    let head = "node 0 'ball': extras.caustica.sphere";
    assert_eq!(error(json!(2)), format!("{head} is 2; expected {{\"radius\": number}}"));
    assert_eq!(error(json!({"radius": 0})), format!("{head}.radius is 0; expected a positive number"));
    assert_eq!(error(json!({"radius": -1.5})), format!("{head}.radius is -1.5; expected a positive number"));
    assert_eq!(error(json!({"radius": "r"})), format!("{head}.radius is \"r\"; expected a number"));
    builder.json["nodes"][0] = json!({"extras": {"caustica": {"sphere": {"radius": 1}}}});
    assert_eq!(builder.error(), "node 0: mesh is missing; extras.caustica.sphere takes its material from there");
}

#[test]
fn a_scene_may_have_an_environment() {
    let mut builder = Builder::triangle();
    assert_eq!(scene(&builder).environment.radiance, Rgb::ZERO);
    builder.json["scenes"][0]["extras"] = json!({"caustica": {"environment": [0.5, 1, 2]}});
    assert_eq!(scene(&builder).environment.radiance, Rgb::new(0.5, 1.0, 2.0));
    assert!(scene(&builder).environment.image.is_none());
    builder.json["scenes"][0]["extras"] = json!({"caustica": {"environment": 1}});
    assert_eq!(builder.error(), "scene 0: extras.caustica.environment is 1; expected a list of 3 numbers");
    builder.json["scenes"][0]["extras"] = json!({"caustica": {"enviroment": [1, 1, 1]}});
    assert_warns(&builder.load().unwrap(), &["scene 0", "extras.caustica.enviroment is unknown"]);
}

#[test]
fn a_scene_may_have_an_image_of_its_environment() {
    let folder = tempfile::tempdir().unwrap();
    let image = Image::new(3, 2, vec![Rgb::new(0.5, 1.0, 2.0); 6]);
    write(&folder.path().join("a sky.exr"), &image, &Metadata::default(), &WriteOptions::default()).unwrap();
    let load = |extras: Value| {
        let mut builder = Builder::triangle();
        builder.json["scenes"][0]["extras"] = json!({ "caustica": extras });
        load_slice(&builder.glb(), Some(folder.path()))
    };
    let loaded = load(json!({"environment_image": "a%20sky.exr", "environment_rotation": 90})).unwrap();
    assert!(loaded.warnings.is_empty());
    let Environment { radiance, image, rotation } = loaded.description.environment;
    let image = image.unwrap();
    assert_eq!((radiance, image.size()), (Rgb::ONE, (3, 2)));
    assert!((image.radiance(Vec3::Y) - Rgb::new(0.5, 1.0, 2.0)).abs().max_element() < 1e-6);
    assert!((rotation * DVec3::Z - DVec3::X).length() < 1e-12);
    let loaded = load(json!({"environment_image": "a%20sky.exr", "environment": [2, 3, 4]})).unwrap();
    assert_eq!(loaded.description.environment.radiance, Rgb::new(2.0, 3.0, 4.0));

    let error = |extras: Value| load(extras).err().unwrap().to_string();
    let head = "scene 0: extras.caustica.environment_image is ";
    assert_eq!(error(json!({"environment_image": 1})), format!("{head}1; expected a text"));
    assert_eq!(
        error(json!({"environment_image": "../sky.exr"})),
        format!("{head}'../sky.exr'; expected a path inside the scene's folder: copy the file there")
    );
    let missing = error(json!({"environment_image": "none.exr"}));
    assert!(missing.starts_with("scene 0: extras.caustica.environment_image: "), "{missing}");
    assert!(missing.contains("none.exr: cannot read"), "{missing}");
    assert!(error(json!({"environment_image": "sky.xyz"})).contains("unknown image format"));
    let east = json!({"environment_image": "a%20sky.exr", "environment_rotation": "east"});
    assert!(error(east).contains("expected a number"));
    let alone = load(json!({"environment_rotation": 30})).unwrap();
    assert_warns(&alone, &["scene 0", "extras.caustica.environment_rotation is unknown"]);
    let mut builder = Builder::triangle();
    builder.json["scenes"][0]["extras"] = json!({"caustica": {"environment_image": "a.exr"}});
    assert!(load_slice(&builder.glb(), None).err().unwrap().to_string().contains("beside a scene in memory"));
}

/// The kind of a light at a node that is moved to (1, 2, 3), turned so that -z becomes -x, and
/// scaled.
fn light(light: Value) -> LightKind {
    let mut builder = Builder::new();
    let node = json!({"name": "lamp", "translation": [1, 2, 3], "rotation": quarter_turn(), "scale": [5, 5, 5]});
    builder.light(light, node);
    let found = scene(&builder);
    assert_eq!(found.lights.len(), 1);
    assert_eq!(found.lights[0].name, "lamp");
    found.lights[0].kind
}

#[test]
fn lights_keep_their_numbers() {
    // Candela count as W/sr and lux as W/m2, per channel.
    let LightKind::Point { position, intensity } =
        light(json!({"type": "point", "intensity": 8, "color": [1, 0.5, 0.25]}))
    else {
        panic!("expected a point light");
    };
    assert!(close(position, [1.0, 2.0, 3.0]));
    assert_eq!(intensity, Rgb::new(8.0, 4.0, 2.0));

    let LightKind::Directional { direction, irradiance } =
        light(json!({"type": "directional", "intensity": 3, "color": [0, 1, 0]}))
    else {
        panic!("expected a directional light");
    };
    assert!(close(direction, [-1.0, 0.0, 0.0]));
    assert_eq!(irradiance, Rgb::new(0.0, 3.0, 0.0));

    let spot = json!({"type": "spot", "intensity": 2, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}});
    let LightKind::Spot { position, direction, intensity, inner, outer } = light(spot) else {
        panic!("expected a spot light");
    };
    assert!(close(position, [1.0, 2.0, 3.0]) && close(direction, [-1.0, 0.0, 0.0]));
    assert_eq!((intensity, inner, outer), (Rgb::splat(2.0), 0.25, 0.5));

    // Defaults: white, intensity 1, cones of 0 and pi/4.
    let LightKind::Spot { intensity, inner, outer, .. } = light(json!({"type": "spot", "spot": {}})) else {
        panic!("expected a spot light");
    };
    assert_eq!((intensity, inner), (Rgb::ONE, 0.0));
    assert!((outer - std::f64::consts::FRAC_PI_4).abs() < 1e-7);
}

#[test]
fn malformed_lights_are_errors() {
    let with = |light: Value| {
        let mut builder = Builder::new();
        builder.light(light, json!({}));
        builder
    };
    for (light, expected) in [
        (json!({"type": "moon", "name": "l"}), "light 0 'l': type is \"moon\"; expected point, spot or directional"),
        (json!({"type": "spot"}), "light 0: spot is missing; a light of type spot needs it"),
        (json!({"type": "point", "intensity": 1e39}), "light 0: intensity is inf; expected a finite number"),
        (json!({"type": "point", "color": [1, 1, 1e39]}), "light 0: color[2] is inf; expected a finite number"),
        (
            json!({"type": "point", "color": [1e20, 1, 1], "intensity": 1e20}),
            "light 0: color * intensity[0] is inf; expected a finite number",
        ),
        (
            json!({"type": "spot", "spot": {"outerConeAngle": 1e39}}),
            "light 0: spot.outerConeAngle is inf; expected a finite number",
        ),
    ] {
        assert_eq!(with(light).error(), expected);
    }
    let mut builder = with(json!({"type": "point"}));
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(1);
    assert_eq!(builder.error(), "node 0: KHR_lights_punctual.light is 1; the file has 1 of kind light");
    builder.json.as_object_mut().unwrap().remove("extensions");
    assert_eq!(builder.error(), "node 0: KHR_lights_punctual.light is 1; the file has 0 of kind light");

    let loaded = with(json!({"type": "point", "range": 4, "name": "l"})).load().unwrap();
    assert_warns(&loaded, &["light 0 'l': range 4 is ignored"]);
    assert_eq!(loaded.description.lights[0].name, "l", "a node without a name takes its light's");
}

/// The shape of the picture is a wish, and may be missing.
#[test]
fn cameras_tell_the_shape_of_their_picture() {
    let mut builder = Builder::new();
    let lens = |aspect: Value| json!({"yfov": 0.5, "znear": 0.1, "aspectRatio": aspect});
    for aspect in [json!(2), json!(null), json!(-1)] {
        let camera = builder.push("cameras", json!({"type": "perspective", "perspective": lens(aspect)}));
        builder.root(json!({"camera": camera}));
    }
    let wide = json!({"xmag": 3, "ymag": 2, "znear": 0, "zfar": 10});
    let camera = builder.push("cameras", json!({"type": "orthographic", "orthographic": wide}));
    builder.root(json!({"camera": camera}));
    assert_eq!(builder.load().unwrap().aspects, [Some(2.0), None, None, Some(1.5)]);
}

fn camera(camera: Value) -> Camera {
    let mut builder = Builder::new();
    builder.push("cameras", camera);
    builder.root(json!({"camera": 0, "translation": [0, 1, 5]}));
    scene(&builder).cameras[0].clone()
}

fn camera_error(camera: Value) -> String {
    let mut builder = Builder::new();
    builder.push("cameras", camera);
    builder.root(json!({"camera": 0}));
    builder.error()
}

#[test]
fn cameras_with_lenses() {
    let with = |extras: Value| json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}, "extras": {"caustica": extras}});
    let found = camera(with(json!({"lens_radius": 0.01, "focus_distance": 2.5, "shift": [0.25, -0.5]})));
    assert_eq!((found.lens, found.shift), (Some(Lens { radius: 0.01, focus: 2.5 }), DVec2::new(0.25, -0.5)));
    let found = camera(with(json!({"lens_radius": 0, "focus_distance": 2.5})));
    assert_eq!((found.lens, found.shift), (None, DVec2::ZERO));
    assert_eq!(
        camera_error(with(json!({"lens_radius": 0.01}))),
        "camera 0: extras.caustica.focus_distance is missing; lens_radius needs it"
    );
    assert_eq!(
        camera_error(with(json!({"shift": [1]}))),
        "camera 0: extras.caustica.shift is [1]; expected a list of 2 numbers"
    );
}

#[test]
fn cameras_of_both_kinds() {
    let found = camera(json!({"name": "main", "type": "perspective",
        "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}}));
    assert_eq!((found.name.as_str(), found.projection), ("main", Projection::Perspective { yfov: 0.5 }));
    assert!(close(found.transform.translation, [0.0, 1.0, 5.0]));
    let found = camera(json!({"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 10}}));
    assert_eq!((found.name.as_str(), found.projection), ("node 0", Projection::Orthographic { ymag: 2.0 }));

    let error = camera_error;
    let lens = json!({"yfov": 1e39, "znear": 1});
    assert_eq!(
        error(json!({"type": "perspective", "perspective": lens})),
        "camera 0: perspective.yfov is inf; expected a finite number"
    );
    // The crate's reader unwraps here.
    assert_eq!(
        error(json!({"type": "orthographic", "perspective": lens})),
        "camera 0: orthographic is missing; the camera's type needs it"
    );
    assert_eq!(
        error(json!({"type": "fisheye", "perspective": lens})),
        "camera 0: type is \"fisheye\"; expected perspective or orthographic"
    );
}
