//! Materials.

use crate::builder::{Builder, assert_warns};
use caustica::math::Rgb;
use caustica::scene::description::{Material, Medium, MetallicRoughness, Scattering};
use serde_json::{Value, json};

/// A triangle of one material.
fn with(material: Value) -> Builder {
    let mut builder = Builder::triangle();
    builder.push("materials", material);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder
}

fn load(material: Value) -> Material {
    let scene = with(material).load().unwrap().description;
    assert_eq!(scene.instances[0].material, 0);
    scene.materials[0].clone()
}

fn model(material: Value) -> MetallicRoughness {
    match load(material).scattering {
        Scattering::MetallicRoughness(model) => model,
        other => panic!("{other:?}"),
    }
}

/// The values of the specification where a file says nothing.
const DEFAULT: MetallicRoughness = MetallicRoughness {
    abbe: 0.0,
    base_color: Rgb::ONE,
    metallic: 1.0,
    roughness: 1.0,
    ior: 1.5,
    specular: 1.0,
    specular_color: Rgb::ONE,
    transmission: 0.0,
    solid: false,
    absorption: Rgb::ZERO,
};

/// Clear glass in water, but for `extras`.
fn glass() -> Value {
    json!({
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.25, "baseColorFactor": [0.5, 0.75, 1, 1]},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_volume": {"thicknessFactor": 0.5},
            "KHR_materials_ior": {"ior": 1.75},
        },
    })
}

#[test]
fn defaults_are_those_of_the_specification() {
    assert_eq!(model(json!({})), DEFAULT);
    let scene = Builder::triangle().load().unwrap().description;
    let material = &scene.materials[scene.instances[0].material];
    assert_eq!(material.scattering, Scattering::MetallicRoughness(DEFAULT));
    assert_eq!((material.name.as_str(), material.emission), ("default", Rgb::ZERO));
    // An extension that is there, but empty, changes the index of refraction in no way.
    let empty = json!({"extensions": {"KHR_materials_ior": {}, "KHR_materials_specular": {},
        "KHR_materials_transmission": {}, "KHR_materials_volume": {}, "KHR_materials_emissive_strength": {}}});
    assert_eq!(model(empty), DEFAULT);
}

#[test]
fn dispersion_is_twenty_over_the_abbe_number() {
    let glass = |dispersion: Value| {
        let mut glass = glass();
        glass["extensions"]["KHR_materials_dispersion"] = dispersion;
        glass
    };
    assert_eq!(model(glass(json!({"dispersion": 0.5}))).abbe, 40.0);
    for none in [json!({}), json!({"dispersion": 0}), json!({"dispersion": 1e-300})] {
        assert_eq!(model(glass(none)).abbe, 0.0);
    }
    assert_eq!(model(glass(json!({"dispersion": 80}))).abbe, 1.0);
    let outer = |extras: Value| {
        let mut glass = glass(json!({"dispersion": 0.25}));
        glass["extras"] = json!({ "caustica": extras });
        with(glass)
    };
    let material = outer(json!({"exterior_ior": 1.33, "exterior_dispersion": 0.5})).load().unwrap().description;
    let Scattering::Dielectric { inside, outside, .. } = material.materials[0].scattering else { panic!() };
    assert_eq!((inside.abbe, outside.abbe), (80.0, 40.0));
    assert_eq!(
        outer(json!({"exterior_dispersion": 0.5})).error(),
        "material 0: extras.caustica.exterior_ior is missing; exterior_dispersion needs it"
    );
    let wrong = glass(json!({"dispersion": -1}));
    assert_eq!(with(wrong).error(), "material 0: dispersion is -1; expected a number, not below 0");
}

#[test]
fn factors_are_read() {
    let found = model(json!({
        "name": "all",
        "pbrMetallicRoughness": {"baseColorFactor": [0.125, 0.25, 0.5, 0.75], "metallicFactor": 0.375,
            "roughnessFactor": 0.625},
        "extensions": {
            "KHR_materials_ior": {"ior": 1.25},
            "KHR_materials_specular": {"specularFactor": 0.875, "specularColorFactor": [1, 0.5, 0.25]},
            "KHR_materials_transmission": {"transmissionFactor": 0.0625},
        },
    }));
    let expected = MetallicRoughness {
        base_color: Rgb::new(0.125, 0.25, 0.5),
        metallic: 0.375,
        roughness: 0.625,
        ior: 1.25,
        specular: 0.875,
        specular_color: Rgb::new(1.0, 0.5, 0.25),
        transmission: 0.0625,
        ..DEFAULT
    };
    assert_eq!(found, expected);
    assert_eq!(load(json!({"name": "all"})).name, "all");
    assert_eq!(load(json!({})).name, "material 0");
}

#[test]
fn a_volume_absorbs_by_its_colour_and_distance() {
    let volume = |volume: Value| {
        let mut material = glass();
        material["extensions"]["KHR_materials_volume"] = volume;
        model(material)
    };
    // White light becomes the attenuation colour after 2 m: exp(-a * 2) = color.
    let found = volume(json!({"thicknessFactor": 0.01, "attenuationColor": [0.5, 1, 0.25], "attenuationDistance": 2}));
    assert!(found.solid);
    for (a, color) in found.absorption.to_array().into_iter().zip([0.5f32, 1.0, 0.25]) {
        assert!(((-2.0 * a).exp() - color).abs() < 1e-6, "{a} for {color}");
        assert!(a.is_sign_positive());
    }
    // Without a distance, light is not attenuated; without thickness, there is no volume, unless it is made one.
    let found = volume(json!({"thicknessFactor": 0.01, "attenuationColor": [0.5, 1, 0.25]}));
    assert_eq!((found.solid, found.absorption), (true, Rgb::ZERO));
    let found = volume(json!({"attenuationColor": [0.5, 1, 0.25], "attenuationDistance": 2}));
    assert!(!found.solid && found.absorption.x > 0.0);
    // Black is opaque: finite, and nothing passes.
    let black =
        volume(json!({"thicknessFactor": 1, "attenuationColor": [0, 0, 0], "attenuationDistance": 1})).absorption;
    assert!(black.is_finite() && (-black.x * 1e-9).exp() < 1e-37, "a nanometre of it");
}

#[test]
fn emission_is_factor_times_strength() {
    let lamp = load(json!({
        "emissiveFactor": [1, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 12}},
    }));
    assert_eq!((lamp.emission, lamp.emission_two_sided), (Rgb::new(12.0, 6.0, 3.0), false));
    let lamp = load(json!({"emissiveFactor": [1, 0.5, 0.25], "doubleSided": true}));
    assert_eq!((lamp.emission, lamp.emission_two_sided), (Rgb::new(1.0, 0.5, 0.25), true));
}

#[test]
fn extras_name_the_medium_outside() {
    let mut material = glass();
    material["extensions"]["KHR_materials_volume"] =
        json!({"thicknessFactor": 0.5, "attenuationColor": [1, 1, 0.5], "attenuationDistance": 4});
    material["extras"] = json!({"caustica": {"exterior_ior": 1.25, "exterior_absorption": [0, 0.5, 2]}, "other": 1});
    let Scattering::Dielectric { inside, outside, roughness, tint } = load(material).scattering else {
        panic!("expected a dielectric");
    };
    assert_eq!(outside, Medium::new(1.25, Rgb::new(0.0, 0.5, 2.0)));
    assert_eq!(inside.ior, 1.75);
    assert!((inside.absorption - Rgb::new(0.0, 0.0, 2f32.ln() / 4.0)).abs().max_element() < 1e-7);
    assert_eq!((roughness, tint), (0.25, Rgb::new(0.5, 0.75, 1.0)));

    let mut material = glass();
    material["extras"] = json!({"caustica": {"exterior_ior": 1.25}});
    let Scattering::Dielectric { outside, .. } = load(material).scattering else {
        panic!("expected a dielectric");
    };
    assert_eq!(outside, Medium::new(1.25, Rgb::ZERO));

    // Without them, glass stays in the general model, and foreign extras are nobody's business.
    let mut material = glass();
    material["extras"] = json!(["caustica", {"ior": 3}]);
    assert!(matches!(load(material).scattering, Scattering::MetallicRoughness(_)));
}

#[test]
fn malformed_extras_are_errors_that_name_the_material() {
    let error = |extras: Value| {
        let mut material = glass();
        material["name"] = json!("pane");
        material["extras"] = json!({ "caustica": extras });
        with(material).error()
    };
    let head = "material 0 'pane': extras.caustica";
    assert_eq!(error(json!(3)), format!("{head} is 3; expected an object"));
    assert_eq!(error(json!({"exterior_ior": "x"})), format!("{head}.exterior_ior is \"x\"; expected a number"));
    let missing = format!("{head}.exterior_ior is missing; exterior_absorption needs it");
    assert_eq!(error(json!({"exterior_absorption": [0, 0, 0]})), missing);
    let triple = format!("{head}.exterior_absorption is [0,0]; expected a list of 3 numbers");
    assert_eq!(error(json!({"exterior_ior": 1.3, "exterior_absorption": [0, 0]})), triple);
    let infinite = format!("{head}.exterior_absorption[1] is inf; expected a finite number");
    assert_eq!(error(json!({"exterior_ior": 1.3, "exterior_absorption": [0, 1e39, 0]})), infinite);

    // The outside is that of a solid dielectric only.
    for (pointer, value, field) in [
        ("/extensions/KHR_materials_transmission/transmissionFactor", 0.5, "transmissionFactor is 0.5"),
        ("/pbrMetallicRoughness/metallicFactor", 0.5, "metallicFactor is 0.5"),
        ("/extensions/KHR_materials_volume/thicknessFactor", 0.0, "thicknessFactor is 0"),
    ] {
        let mut material = glass();
        material["extras"] = json!({"caustica": {"exterior_ior": 1.3}});
        *material.pointer_mut(pointer).unwrap() = json!(value);
        let error = with(material).error();
        assert!(error.starts_with(&format!("material 0: {field}; extras.caustica.exterior_ior needs")), "{error}");
    }

    let mut material = glass();
    material["extras"] = json!({"caustica": {"exteriorIor": 1.3}});
    assert_warns(&with(material).load().unwrap(), &["material 0", "extras.caustica.exteriorIor is unknown"]);
}

#[test]
fn other_textures_are_ignored_by_name() {
    let mut builder = with(json!({
        "name": "wood",
        "occlusionTexture": {"index": 0},
        "extensions": {
            "KHR_materials_transmission": {"transmissionTexture": {"index": 2}},
            "KHR_materials_volume": {"thicknessTexture": {"index": 9}},
            "KHR_materials_specular": {"specularTexture": {"index": 1}, "specularColorTexture": {"index": 1}},
        },
    }));
    builder.json["images"] =
        json!([{"uri": "planks.png"}, {"name": "mixed", "uri": "data:image/png;base64,AAAA"}, {"bufferView": 0}]);
    builder.json["textures"] = json!([{"source": 0}, {"source": 1}, {"source": 2}]);
    let loaded = builder.load().unwrap();
    for (slot, image) in [
        ("occlusionTexture", "image 0 (planks.png)"),
        ("transmissionTexture", "image 2"),
        ("thicknessTexture", "texture 9 (missing)"),
        ("specularTexture", "image 1 'mixed'"),
        ("specularColorTexture", "image 1 'mixed'"),
    ] {
        assert_warns(&loaded, &[&format!("material 0 'wood': {slot} is ignored: {image}")]);
    }
    assert_eq!(loaded.warnings.len(), 5);
    assert!(!loaded.warnings.concat().contains("base64"));
}

#[test]
fn transparency_is_told() {
    for (mode, name) in [("BLEND", "Blend"), ("MASK", "Mask")] {
        let loaded = with(json!({"alphaMode": mode})).load().unwrap();
        assert_warns(&loaded, &["material 0: alphaMode", name, "ignored"]);
    }
    let error = with(json!({"alphaMode": "DITHER"})).error();
    assert_eq!(error, "material 0: alphaMode is \"DITHER\"; expected OPAQUE, MASK or BLEND");
}

#[test]
fn extensions_that_are_ignored_are_told_with_their_users() {
    let coat = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1}});
    let mut builder = with(json!({"name": "a", "extensions": coat}));
    for name in ["b", "c", "d", "e"] {
        builder.push("materials", json!({"name": name, "extensions": coat}));
    }
    builder.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    builder.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {}}});
    let loaded = builder.load().unwrap();
    let of = |users: &str| format!("is not supported and ignored{users}");
    assert_warns(&loaded, &["'KHR_materials_variants'", &of("")]);
    let coated = of(" (by material 0 'a', material 1 'b', material 2 'c' and 2 more)");
    assert_warns(&loaded, &["'KHR_materials_clearcoat'", &coated]);
    assert_warns(&loaded, &["'EXT_mesh_gpu_instancing'", &of(" (by node 0)")]);
    assert_eq!(loaded.warnings.len(), 3);
}

/// What writes properties as texts can say what plain glTF cannot, too.
#[test]
fn extras_may_be_a_text() {
    let mut material = glass();
    material["extras"] = json!({"caustica": "{\"exterior_ior\": 1.3}"});
    assert!(matches!(load(material).scattering, Scattering::Dielectric { outside, .. } if outside.ior == 1.3));
    let mut material = glass();
    material["extras"] = json!({"caustica": "glass"});
    assert!(with(material).error().contains("extras.caustica is \"glass\"; expected an object"));
}

#[test]
fn what_writers_get_wrong_is_taken() {
    // Infinity is no JSON, and JavaScript writes null for it; what is not solid has no use for it.
    for volume in [
        json!({"thicknessFactor": 1, "attenuationDistance": null, "attenuationColor": [0.5, 1, 1]}),
        json!({"attenuationDistance": 0}),
    ] {
        let material = with(json!({"name": "m", "extensions": {"KHR_materials_volume": volume}})).load().unwrap();
        let Scattering::MetallicRoughness(model) = material.description.materials[0].scattering else { panic!() };
        assert!(model.absorption == Rgb::ZERO);
        assert_eq!(material.description.materials[0].name, "m");
    }
    let rounded =
        with(json!({"pbrMetallicRoughness": {"baseColorFactor": [1.0000001, 0.5, 1.001, 1]}})).load().unwrap();
    let Scattering::MetallicRoughness(model) = rounded.description.materials[0].scattering else { panic!() };
    assert_eq!(model.base_color, Rgb::new(1.0, 0.5, 1.001));
}

#[test]
fn what_transmission_leaves_out_is_told() {
    let loaded = with(json!({"extensions": {
        "KHR_materials_transmission": {"transmissionFactor": 0.5}, "KHR_materials_specular": {"specularFactor": 0}}}));
    assert_warns(&loaded.load().unwrap(), &["material 0", "specularFactor and specularColorFactor are ignored"]);
}

#[test]
fn numbers_without_bounds_are_errors() {
    // 1e39 is legal JSON, but infinite in single precision.
    let volume = |volume: Value| json!({"extensions": {"KHR_materials_volume": volume}});
    let cases = [
        (json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 1e39, 0, 1]}}), "baseColorFactor[1] is inf"),
        (json!({"pbrMetallicRoughness": {"metallicFactor": 1e39}}), "metallicFactor is inf"),
        (json!({"pbrMetallicRoughness": {"roughnessFactor": -1e39}}), "roughnessFactor is -inf"),
        (json!({"emissiveFactor": [0, 0, 1e39]}), "emissiveFactor[2] is inf"),
        (
            json!({"emissiveFactor": [1e20, 0, 0],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1e20}}}),
            "emissiveFactor * emissiveStrength[0] is inf",
        ),
        (json!({"extensions": {"KHR_materials_ior": {"ior": 1e39}}}), "ior is inf"),
        (json!({"extensions": {"KHR_materials_specular": {"specularFactor": 1e39}}}), "specularFactor is inf"),
        (
            json!({"extensions": {"KHR_materials_specular": {"specularColorFactor": [1e39, 0, 0]}}}),
            "specularColorFactor[0] is inf",
        ),
        (
            json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1e39}}}),
            "transmissionFactor is inf",
        ),
        (volume(json!({"thicknessFactor": 1e39})), "thicknessFactor is inf"),
        (volume(json!({"thicknessFactor": 1, "attenuationDistance": 0})), "attenuationDistance is 0"),
        (volume(json!({"thicknessFactor": 1, "attenuationDistance": -1})), "attenuationDistance is -1"),
        (volume(json!({"thicknessFactor": 1, "attenuationColor": [1, 1, 1.5]})), "attenuationColor[2] is 1.5"),
        (volume(json!({"thicknessFactor": 1, "attenuationColor": [-0.5, 1, 1]})), "attenuationColor[0] is -0.5"),
        (
            volume(json!({"thicknessFactor": 1, "attenuationColor": [0.5, 1, 1], "attenuationDistance": 1e-40})),
            "-ln(attenuationColor) / attenuationDistance[0] is inf",
        ),
    ];
    for (material, expected) in cases {
        let error = with(material).error();
        assert!(error.starts_with(&format!("material 0: {expected}; ")), "{error}");
    }
}
