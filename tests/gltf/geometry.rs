//! Vertices and triangles.

use crate::builder::{Builder, CORNERS, assert_warns, bytes_of};
use caustica::scene::description::{Geometry, MeshDescription};
use serde_json::{Value, json};

/// Five vertices, told apart by x.
const ROW: [[f32; 3]; 5] = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, 0.0, 0.0]];

fn only_mesh(builder: &Builder) -> MeshDescription {
    let loaded = builder.load().unwrap();
    assert_eq!(loaded.description.meshes.len(), 1);
    (*loaded.description.meshes[0]).clone()
}

/// Five vertices in a row, with a mode and indices.
fn row(mode: u32, indices: Option<(u32, &[u32])>) -> Builder {
    let mut builder = Builder::new();
    let positions = builder.vectors(&ROW);
    let mut primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
    if let Some((component, values)) = indices {
        primitive["indices"] = builder.indices(component, values).into();
    }
    builder.mesh(json!([primitive]));
    builder.root(json!({"mesh": 0}));
    builder
}

#[test]
fn a_triangle_without_indices_or_normals() {
    let loaded = Builder::triangle().load().unwrap();
    let mesh = &loaded.description.meshes[0];
    assert_eq!(mesh.positions, CORNERS);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(mesh.normals.is_empty());
    assert_eq!(loaded.warnings, [""; 0]);
}

#[test]
fn indices_of_every_legal_type() {
    for component in [5121, 5123, 5125] {
        let mesh = only_mesh(&row(4, Some((component, &[0, 1, 2, 4, 3, 2]))));
        assert_eq!(mesh.triangles, [[0, 1, 2], [4, 3, 2]], "componentType {component}");
        assert_eq!(mesh.positions, ROW);
    }
    // All bytes of the wider types count.
    for (component, index) in [(5123, 0x0103), (5125, 0x0001_0003)] {
        let error = row(4, Some((component, &[0, 1, index]))).error();
        assert_eq!(error, format!("accessor 1: [2] is {index}; its primitive has 5 vertices"));
    }
    // Signed and floating indices are not legal.
    let mut builder = row(4, Some((5123, &[0, 1, 2])));
    builder.json["accessors"][1]["componentType"] = json!(5122);
    assert_eq!(builder.error(), "accessor 1: componentType 5122 for indices is not supported");
}

#[test]
fn strips_and_fans_keep_the_front_side() {
    // The order of the specification, 3.7.2.1: (v0 v1 v2), (v1 v3 v2), (v2 v3 v4).
    assert_eq!(only_mesh(&row(5, None)).triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(only_mesh(&row(6, None)).triangles, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    let indices: &[u32] = &[4, 3, 2, 1, 0];
    assert_eq!(only_mesh(&row(5, Some((5121, indices)))).triangles, [[4, 3, 2], [3, 1, 2], [2, 1, 0]]);
    assert_eq!(only_mesh(&row(6, Some((5121, indices)))).triangles, [[3, 2, 4], [2, 1, 4], [1, 0, 4]]);
}

#[test]
fn a_strip_that_begins_anew_has_no_degenerate_triangles() {
    // 0 1 2 and 2 3 4, joined by repeated corners.
    let mesh = only_mesh(&row(5, Some((5123, &[0, 1, 2, 2, 2, 3, 4]))));
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 3, 4]]);
}

#[test]
fn other_modes_are_skipped_with_a_warning() {
    for (mode, name) in [(0, "Points"), (1, "Lines"), (2, "LineLoop"), (3, "LineStrip")] {
        let mut builder = row(mode, None);
        builder.json["meshes"][0]["name"] = json!("wire");
        let loaded = builder.load().unwrap();
        assert!(loaded.description.meshes.is_empty() && loaded.description.instances.is_empty());
        assert_warns(&loaded, &["mesh 0 'wire'", "primitives[0].mode", name]);
    }
    assert_eq!(row(7, None).error(), "mesh 0: primitives[0].mode is 7; expected 0 to 6");
}

#[test]
fn leftover_vertices_are_told() {
    let loaded = row(4, None).load().unwrap();
    assert_eq!(loaded.description.meshes[0].triangles, [[0, 1, 2]]);
    assert_warns(&loaded, &["mesh 0", "primitives[0] has 5 vertices, the last 2 are left out"]);
    let loaded = row(5, Some((5121, &[0, 1]))).load().unwrap();
    assert_warns(&loaded, &["mesh 0", "primitives[0] has no triangle"]);
}

#[test]
fn interleaved_attributes_are_read_at_their_stride() {
    let mut builder = Builder::new();
    let normals = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
    let mut bytes = vec![0xaa; 8];
    for (corner, normal) in CORNERS.iter().zip(&normals) {
        bytes.extend(bytes_of(&[*corner, *normal]));
        bytes.extend([0xaa; 4]);
    }
    // The last element ends where the view ends: what would follow it is not there.
    bytes.truncate(bytes.len() - 4);
    let view = builder.view(&bytes);
    builder.json["bufferViews"][view]["byteStride"] = json!(28);
    let mut accessor = |offset| {
        let whole =
            json!({"bufferView": view, "byteOffset": offset, "componentType": 5126, "type": "VEC3", "count": 3});
        builder.push("accessors", whole)
    };
    let (positions, directions) = (accessor(8), accessor(20));
    builder.mesh(json!([{"attributes": {"POSITION": positions, "NORMAL": directions}}]));
    builder.root(json!({"mesh": 0}));
    let mesh = only_mesh(&builder);
    assert_eq!(mesh.positions, CORNERS);
    assert_eq!(mesh.normals, normals);

    let mut short = builder.clone();
    short.json["accessors"][1]["byteOffset"] = json!(21);
    assert_eq!(
        short.error(),
        "accessor 1: byteOffset, count is 21, 3; 88 bytes of its bufferView cannot hold 12 bytes each 28"
    );
    let mut narrow = builder.clone();
    narrow.json["bufferViews"][0]["byteStride"] = json!(8);
    assert_eq!(narrow.error(), "accessor 0: byteStride of its bufferView is 8; an element has 12 bytes");
}

/// `KHR_mesh_quantization`: integers as they are, or as fractions of the largest one.
#[test]
fn vertices_in_integers() {
    let signed = |values: &[i16], size: usize| -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()[..size].to_vec()).collect()
    };
    // Type, normalized, bytes of a number, and what -7, -128 and 100 are, or 0, 249 and 100.
    let cases: [(u32, bool, usize, [f32; 3]); 8] = [
        (5120, false, 1, [-7.0, -128.0, 100.0]),
        (5120, true, 1, [-7.0 / 127.0, -1.0, 100.0 / 127.0]),
        (5121, false, 1, [249.0, 128.0, 100.0]),
        (5121, true, 1, [249.0 / 255.0, 128.0 / 255.0, 100.0 / 255.0]),
        (5122, false, 2, [-7.0, -128.0, 100.0]),
        (5122, true, 2, [-7.0 / 32767.0, -128.0 / 32767.0, 100.0 / 32767.0]),
        (5123, false, 2, [65529.0, 65408.0, 100.0]),
        (5123, true, 2, [65529.0 / 65535.0, 65408.0 / 65535.0, 100.0 / 65535.0]),
    ];
    for (component, normalized, size, [a, b, c]) in cases {
        let mut builder = Builder::new();
        // Each vertex begins at a multiple of 4 bytes.
        let mut bytes = Vec::new();
        for corner in [[-7, -128, 100], [100, 100, 100], [100, -7, -7]] {
            bytes.extend(signed(&corner, size));
            bytes.resize(bytes.len().next_multiple_of(4), 0xaa);
        }
        let view = builder.view(&bytes);
        builder.json["bufferViews"][view]["byteStride"] = json!((3 * size).next_multiple_of(4));
        let whole = json!({"bufferView": view, "componentType": component, "normalized": normalized, "type": "VEC3", "count": 3});
        let mut accessor = || builder.push("accessors", whole.clone());
        let mut attributes = json!({"POSITION": accessor()});
        if component == 5120 || component == 5122 {
            attributes["NORMAL"] = accessor().into();
        }
        builder.mesh(json!([{"attributes": attributes}]));
        builder.root(json!({"mesh": 0}));
        let error = builder.error();
        assert!(error.contains(&format!("componentType {component}")), "{error}");

        builder.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let mesh = only_mesh(&builder);
        let expected = [[a, b, c], [c; 3], [c, a, a]];
        assert_eq!(mesh.positions, expected, "{component} {normalized}");
        let normals = if component == 5120 || component == 5122 { &expected[..] } else { &[] };
        assert_eq!(mesh.normals, normals, "{component} {normalized}");
    }
}

/// A sparse accessor that moves vertices 1 and 3 of a row of 5; its base may be left out.
fn sparse(with_base: bool, component: u32, indices: &[u32]) -> Builder {
    let mut builder = Builder::new();
    let positions = builder.vectors(&ROW);
    let helper = builder.indices(component, indices);
    let indices_view = builder.json["accessors"][helper]["bufferView"].clone();
    let values = builder.view(&bytes_of(&[[0.0, 7.0, 0.0], [0.0, 9.0, 0.0]]));
    let accessor = &mut builder.json["accessors"][positions];
    accessor["sparse"] = json!({
        "count": 2,
        "indices": {"bufferView": indices_view, "componentType": component},
        "values": {"bufferView": values},
    });
    if !with_base {
        accessor.as_object_mut().unwrap().remove("bufferView");
    }
    builder.mesh(json!([{"attributes": {"POSITION": positions}, "mode": 5}]));
    builder.root(json!({"mesh": 0}));
    builder
}

#[test]
fn sparse_accessors_replace_elements() {
    for component in [5121, 5123, 5125] {
        let mut moved = ROW;
        moved[1] = [0.0, 7.0, 0.0];
        moved[3] = [0.0, 9.0, 0.0];
        assert_eq!(only_mesh(&sparse(true, component, &[1, 3])).positions, moved);
        let mut zeros = [[0.0; 3]; 5];
        zeros[1] = moved[1];
        zeros[3] = moved[3];
        assert_eq!(only_mesh(&sparse(false, component, &[1, 3])).positions, zeros);
    }
}

#[test]
fn sparse_indices_must_increase_within_the_accessor() {
    let expected = "expected more than the one before and less than 5";
    for (indices, at) in [([3, 1], 1), ([1, 1], 1), ([1, 5], 1), ([200, 201], 0)] {
        let error = sparse(true, 5121, &indices).error();
        assert_eq!(error, format!("accessor 0: sparse.indices[{at}] is {}; {expected}", indices[at]));
    }
    let mut builder = sparse(true, 5121, &[1, 3]);
    builder.json["accessors"][0]["sparse"]["count"] = json!(6);
    assert_eq!(builder.error(), "accessor 0: sparse.count is 6; expected 1 to 5");
    builder.json["accessors"][0]["sparse"]["count"] = json!(3);
    assert!(builder.error().starts_with("accessor 0: sparse.indices.byteOffset, sparse.indices.count is 0, 3;"));
    let mut builder = sparse(true, 5121, &[1, 3]);
    builder.json["accessors"][0]["sparse"]["indices"]["componentType"] = json!(5126);
    assert_eq!(builder.error(), "accessor 0: sparse.indices.componentType is 5126; expected 5121, 5123 or 5125");
}

#[test]
fn a_shared_vertex_buffer_is_cut_to_what_a_primitive_uses() {
    let mut builder = row(4, Some((5121, &[4, 1, 3])));
    let normals = builder.vectors(&ROW.map(|[x, _, _]| [0.0, 1.0, x]));
    builder.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    let mesh = only_mesh(&builder);
    assert_eq!(mesh.positions, [ROW[1], ROW[3], ROW[4]]);
    assert_eq!(mesh.normals, [[0.0, 1.0, 1.0], [0.0, 1.0, 3.0], [0.0, 1.0, 4.0]]);
    assert_eq!(mesh.triangles, [[2, 0, 1]]);
}

#[test]
fn vertices_of_no_triangle_are_left_out() {
    // As many corners as vertices: one of them stands for none.
    let mesh = only_mesh(&row(4, Some((5121, &[0, 1, 3, 0, 3, 4]))));
    assert_eq!(mesh.positions, [ROW[0], ROW[1], ROW[3], ROW[4]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn normals_without_direction_are_those_of_the_faces_around() {
    let mut builder = Builder::triangle();
    let normals = builder.vectors(&[[0.0, 1.0, 0.0], [0.0; 3], [f32::NAN, 0.0, 0.0]]);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    let loaded = builder.load().unwrap();
    assert_eq!(loaded.description.meshes[0].normals, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
    assert_warns(&loaded, &["mesh 0", "primitives[0].attributes.NORMAL", "2 of length 0"]);
}

#[test]
fn meshes_over_the_same_accessors_are_one() {
    let mut builder = Builder::triangle();
    let primitives = builder.json["meshes"][0]["primitives"].clone();
    builder.push("materials", json!({}));
    let other = builder.mesh(primitives);
    builder.json["meshes"][other]["primitives"][0]["material"] = json!(0);
    builder.root(json!({"mesh": other}));
    let description = builder.load().unwrap().description;
    assert_eq!((description.meshes.len(), description.instances.len()), (1, 2));
    assert_ne!(description.instances[0].material, description.instances[1].material);
}

#[test]
fn each_primitive_is_a_mesh_that_nodes_share() {
    let mut builder = Builder::new();
    let (a, b) = (builder.vectors(&CORNERS), builder.vectors(&ROW[..3]));
    builder.push("materials", json!({"name": "red"}));
    let primitives = json!([{"attributes": {"POSITION": a}}, {"attributes": {"POSITION": b}, "material": 0}]);
    builder.mesh(primitives);
    builder.json["meshes"][0]["name"] = json!("pair");
    builder.root(json!({"mesh": 0, "name": "left"}));
    builder.root(json!({"mesh": 0}));
    let scene = builder.load().unwrap().description;
    let names: Vec<_> = scene.meshes.iter().map(|mesh| mesh.name.as_str()).collect();
    assert_eq!(names, ["pair[0]", "pair[1]"]);
    assert_eq!(scene.meshes[1].positions, ROW[..3]);
    let found: Vec<_> = scene
        .instances
        .iter()
        .map(|i| match i.geometry {
            Geometry::Mesh(mesh) => (i.name.as_str(), mesh, scene.materials[i.material].name.as_str()),
            Geometry::Sphere { .. } => panic!("no sphere here"),
        })
        .collect();
    let expected = [("left", 0, "default"), ("left", 1, "red"), ("node 1", 0, "default"), ("node 1", 1, "red")];
    assert_eq!(found, expected);
    assert_eq!(scene.materials.len(), 2);
}

#[test]
fn attributes_that_are_not_rendered_are_told_by_name() {
    let mut builder = Builder::triangle();
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["COLOR_0"] = json!(0);
    primitive["attributes"]["TEXCOORD_0"] = json!(0);
    primitive["targets"] = json!([{"POSITION": 0}]);
    builder.json["meshes"][0]["name"] = json!("face");
    let loaded = builder.load().unwrap();
    assert_warns(&loaded, &["mesh 0 'face'", "primitives[0].attributes.COLOR_0"]);
    assert_warns(&loaded, &["mesh 0 'face'", "primitives[0].targets", "morph targets"]);
    assert_eq!(loaded.warnings.len(), 2, "texture coordinates alone change nothing");

    let mut builder = Builder::triangle();
    builder.json["meshes"][0]["primitives"][0]["attributes"] = json!({"NORMAL": 0});
    assert_warns(&builder.load().unwrap(), &["mesh 0", "primitives[0] has no POSITION"]);
}

#[test]
fn a_primitive_without_vertices_is_skipped() {
    let mut builder = Builder::triangle();
    builder.json["accessors"][0]["count"] = json!(0);
    let loaded = builder.load().unwrap();
    assert!(loaded.description.instances.is_empty());
    assert_warns(&loaded, &["mesh 0", "primitives[0] has no triangle and is skipped"]);
}

#[test]
fn wrong_arrays_are_errors_that_name_them() {
    let change = |pointer: &str, value: Value| {
        let mut builder = Builder::triangle();
        builder.json["accessors"][0]["name"] = json!("corners");
        *builder.json.pointer_mut(pointer).unwrap() = value;
        builder.error()
    };
    let cases = [
        (
            "/accessors/0/count",
            json!(4),
            "accessor 0 'corners': byteOffset, count is 0, 4; 36 bytes of its bufferView \
            cannot hold 12 bytes each 12",
        ),
        (
            "/accessors/0/count",
            json!(u64::MAX),
            "accessor 0 'corners': count is 18446744073709551615; expected 1 to \
            4294967295",
        ),
        (
            "/accessors/0/type",
            json!("VEC2"),
            "accessor 0 'corners': type is \"VEC2\"; \
            primitives[0].attributes.POSITION needs Vec3",
        ),
        (
            "/accessors/0/type",
            json!("VEC9"),
            "accessor 0 'corners': type is \"VEC9\"; \
            primitives[0].attributes.POSITION needs Vec3",
        ),
        ("/accessors/0/componentType", json!(99), "accessor 0 'corners': componentType is 99; expected 5120 to 5126"),
        (
            "/accessors/0/componentType",
            json!(5123),
            "accessor 0 'corners': componentType 5123 for \
            primitives[0].attributes.POSITION is not supported",
        ),
        (
            "/accessors/0/bufferView",
            json!(7),
            "accessor 0 'corners': bufferView is 7; the file has 1 of kind bufferView",
        ),
        ("/bufferViews/0/buffer", json!(1), "bufferView 0: buffer is 1; the file has 1 of kind buffer"),
        (
            "/bufferViews/0/byteLength",
            json!(37),
            "bufferView 0: byteOffset + byteLength is 0 + 37; its buffer has 36 \
            bytes",
        ),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            "bufferView 0: byteOffset + byteLength is 18446744073709551615 \
            + 36; its buffer has 36 bytes",
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(3),
            "mesh 0: primitives[0].attributes.POSITION is 3; the \
            file has 1 of kind accessor",
        ),
    ];
    for (pointer, value, expected) in cases {
        assert_eq!(change(pointer, value), expected);
    }
    let mut builder = Builder::triangle();
    let normals = builder.vectors(&ROW);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    assert_eq!(builder.error(), "accessor 1: count is 5; its POSITION has 3");
}

#[test]
fn not_a_number_passes_to_the_commit() {
    let mut builder = Builder::triangle();
    builder.bin[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(only_mesh(&builder).positions[0][0].is_nan());
}
