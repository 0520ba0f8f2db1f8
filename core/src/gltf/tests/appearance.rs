//! Materials and textures.

use super::builder::{Builder, png};
use crate::bsdf::surface::Walls;
use crate::gltf::bundle::Bundle;
use crate::gltf::limits::Limits;
use crate::gltf::load::{Choice, Loaded, load_as};
use crate::scene::interaction::Side;
use crate::scene::material::Coverage;
use crate::trace::moment::Moment;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};

const UVS: [f32; 6] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];

/// A triangle of the material, both sets of coordinates, and textures 0 and 1 of two pixels beside each other:
/// black and (255, 128, 0, 128).
fn textured(material: Value) -> Builder {
    let other = UVS.map(|v| 1.0 - v);
    let mut builder = Builder::triangle(
        &[("TEXCOORD_0", "VEC2", &UVS), ("TEXCOORD_1", "VEC2", &other)],
        json!({"material": 0}),
    );
    builder.push("materials", material);
    let picture = png(2, 1, &[[0, 0, 0, 255], [255, 128, 0, 128]]);
    let view = builder.view(&picture, None);
    builder.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    builder.push("samplers", json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}));
    builder.push("textures", json!({"source": 0, "sampler": 0}));
    builder.push("textures", json!({"source": 0}));
    builder
}

fn base_color(loaded: &Loaded, u: f32, v: f32) -> Vec3 {
    loaded.scene.interaction(0, 0, Vec2::new(u, v), Moment::STILL).surface().base_color
}

#[test]
fn base_colour_is_decoded_from_srgb_and_other_channels_are_not() {
    let loaded = textured(json!({"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0},
        "metallicFactor": 0.5, "roughnessFactor": 0.5, "baseColorFactor": [1, 1, 0.5, 1]}}))
    .load();
    let surface = loaded.scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL).surface();
    assert!((surface.base_color - Vec3::new(1.0, 0.215_860_5, 0.0)).length() < 1e-6, "{surface:?}");
    assert!((surface.roughness - 0.5 * 128.0 / 255.0).abs() < 1e-6 && surface.metallic == 0.0);
    // One picture in memory, looked up in two ways.
    assert_eq!((loaded.report.textures, loaded.report.pixels), (2, 2));
}

#[test]
fn textures_choose_their_coordinates_and_transform_them() {
    let info = |info: Value| json!({"pbrMetallicRoughness": {"baseColorTexture": info}});
    let first = textured(info(json!({"index": 0}))).load();
    assert_eq!((base_color(&first, 0.25, 0.1).x, base_color(&first, 0.75, 0.1).x), (0.0, 1.0));
    let second = textured(info(json!({"index": 0, "texCoord": 1}))).load();
    assert_eq!((base_color(&second, 0.25, 0.1).x, base_color(&second, 0.75, 0.1).x), (1.0, 0.0));
    let moved = json!({"index": 0, "texCoord": 1,
        "extensions": {"KHR_texture_transform": {"texCoord": 0, "offset": [0.5, 0], "scale": [0.5, 1]}}});
    let moved = textured(info(moved)).load();
    assert_eq!((base_color(&moved, 0.05, 0.1).x, base_color(&moved, 0.9, 0.05).x), (1.0, 1.0));
    let missing = textured(info(json!({"index": 0, "texCoord": 5}))).load();
    assert!(missing.warnings.iter().any(|p| p.detail.contains("TEXCOORD_5")));
}

#[test]
fn samplers_choose_wrap_and_filter() {
    let scaled = |index: u64| {
        let info = json!({"index": index, "extensions": {"KHR_texture_transform": {"scale": [4, 1], "offset": [-2, 0]}}});
        textured(json!({"pbrMetallicRoughness": {"baseColorTexture": info}})).load()
    };
    // u runs from −2 to 2. Texture 0 is clamped and has hard edges; texture 1 repeats and mixes.
    let clamped = scaled(0);
    assert_eq!((base_color(&clamped, 0.1, 0.0).x, base_color(&clamped, 0.9, 0.0).x), (0.0, 1.0));
    let repeated = scaled(1);
    assert!((base_color(&repeated, 0.1875, 0.0).x - 1.0).abs() < 1e-4);
    assert!((base_color(&repeated, 0.125, 0.0).x - 0.5).abs() < 1e-4);
}

#[test]
fn masks_are_sharp_and_blends_are_not() {
    let build = |mode: &str| {
        textured(json!({"alphaMode": mode, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}))
            .load()
            .scene
    };
    let alpha = |mode: &str, u: f32| build(mode).alpha(0, 0, Vec2::new(u, 0.0));
    assert_eq!((alpha("OPAQUE", 0.1), alpha("OPAQUE", 0.9)), (1.0, 1.0));
    assert_eq!((alpha("MASK", 0.1), alpha("MASK", 0.9)), (1.0, 1.0));
    assert_eq!((alpha("BLEND", 0.1), alpha("BLEND", 0.9)), (1.0, 128.0 / 255.0));
    let cut = textured(json!({"alphaMode": "MASK", "alphaCutoff": 0.6,
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    assert!(cut.load().scene.alpha(0, 0, Vec2::new(0.9, 0.0)) < 1e-6);
}

#[test]
fn coverage_that_changes_nothing_is_left_out() {
    let plain = |material: Value| textured(material).load().scene.materials[0].coverage;
    assert_eq!(plain(json!({"alphaMode": "BLEND"})), Coverage::Opaque);
    assert_eq!(plain(json!({"alphaMode": "MASK"})), Coverage::Opaque);
    let faint = json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}});
    assert_eq!(plain(faint), Coverage::Blend);
}

#[test]
fn emission_is_factor_times_strength_on_the_sides_that_emit() {
    let material = |double: bool| {
        json!({"emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0}, "doubleSided": double,
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 10}}})
    };
    let single = textured(material(false)).load();
    assert_eq!(single.report.emissive_triangles, 1);
    let interaction = single.scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL);
    let expected = Vec3::new(10.0, 5.0 * 0.215_860_5, 0.0);
    assert!((interaction.emission(Side::Front) - expected).length() < 1e-5);
    assert_eq!(interaction.emission(Side::Back), Vec3::ZERO);
    assert_eq!((interaction.side(Vec3::Z), interaction.side(Vec3::NEG_Z)), (Side::Front, Side::Back));
    let double = textured(material(true)).load().scene;
    let back = double.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL).emission(Side::Back);
    assert!((back - expected).length() < 1e-5);
}

#[test]
fn extensions_of_the_dielectric_are_read() {
    let loaded = textured(json!({"extensions": {
        "KHR_materials_ior": {"ior": 1.33},
        "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": {"index": 0}, "specularColorFactor": [2, 1, 0]},
        "KHR_materials_transmission": {"transmissionFactor": 0.75},
        "KHR_materials_volume": {"thicknessFactor": 0.1, "attenuationColor": [0.5, 1, 0.25], "attenuationDistance": 2}
    }}))
    .load();
    let surface = loaded.scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL).surface();
    assert_eq!((surface.ior, surface.transmission, surface.walls), (1.33, 0.75, Walls::Solid));
    assert!((surface.specular - 0.5 * 128.0 / 255.0).abs() < 1e-6);
    assert_eq!(surface.specular_color, Vec3::new(2.0, 1.0, 0.0));
    // Half of the red is left after 2 m.
    let absorption = loaded.scene.materials[0].volume.unwrap().absorption;
    let distance = loaded.scene.normalisation.distance(2.0) as f32;
    let left = (absorption * -distance).to_array().map(libm::expf);
    assert!((Vec3::from(left) - Vec3::new(0.5, 1.0, 0.25)).length() < 1e-5, "{left:?}");
}

#[test]
fn solid_glass_without_thickness_is_pointed_out() {
    let mut builder = Builder::new();
    // A tetrahedron.
    let position = builder.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    let indices = builder.accessor(&[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], 5121, "SCALAR", 12);
    builder.primitive(&json!({"attributes": {"POSITION": position}, "indices": indices, "material": 0}));
    builder
        .push("materials", json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}));
    let loaded = builder.load();
    assert!(
        loaded.warnings.iter().any(|p| p.pointer == "/materials/0" && p.detail.contains("thicknessFactor"))
    );
    builder.json["materials"][0]["extensions"]["KHR_materials_volume"] = json!({"thicknessFactor": 1});
    assert!(!builder.load().warnings.iter().any(|p| p.detail.contains("thicknessFactor")));
}

/// The specular-glossiness model in terms of the core one: what reflects at normal incidence is its colour.
#[test]
fn specular_glossiness_becomes_a_coloured_dielectric() {
    let mut builder = textured(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": [0.2, 0.4, 0.8], "glossinessFactor": 0.5,
        "specularGlossinessTexture": {"index": 0}}}}));
    builder.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    let surface = builder.load().scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL).surface();
    assert_eq!((surface.metallic, surface.base_color), (0.0, Vec3::splat(0.5)));
    assert!((surface.roughness - (1.0 - 0.5 * 128.0 / 255.0)).abs() < 1e-6);
    let f0 = surface.specular_color * 0.04;
    assert!((f0 - Vec3::new(0.2, 0.4 * 0.215_860_5, 0.0)).length() < 1e-6, "{f0}");
}

/// A normal map whose pixel says (x, y, z) bends the normal to x along u and y against v.
#[test]
fn normal_maps_bend_along_the_layout_with_and_without_tangents() {
    for (scale, mirrored) in [(1.0, false), (0.5, false), (1.0, true)] {
        let mut builder = Builder::new();
        let position = builder.floats("VEC3", &super::builder::TRIANGLE);
        let normal = builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
        // v runs down the picture: y grows against it.
        let uvs = if mirrored { [0., 1., -1., 1., 0., 0.] } else { [0., 1., 1., 1., 0., 0.] };
        let uv = builder.floats("VEC2", &uvs);
        builder.primitive(
            &json!({"attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv}, "material": 0}),
        );
        let view = builder.view(&png(1, 1, &[[204, 166, 204, 255]]), None);
        builder.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        builder.push("textures", json!({"source": 0}));
        builder.push("materials", json!({"normalTexture": {"index": 0, "scale": scale}}));
        let computed = builder.load().scene;
        let side = if mirrored { -1.0 } else { 1.0 };
        let expected =
            Vec3::new(0.6 * scale as f32 * side, (166.0 / 127.5 - 1.0) * scale as f32, 0.6).normalize();
        let got = computed.interaction(0, 0, Vec2::splat(0.3), Moment::STILL).shading.z;
        assert!((got - expected).length() < 1e-5, "{got} {expected}");
        let tangent = builder.floats("VEC4", &[side, 0., 0., side].repeat(3));
        builder.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(tangent);
        let given = builder.load().scene.interaction(0, 0, Vec2::splat(0.3), Moment::STILL).shading.z;
        assert!((given - expected).length() < 1e-5, "{given} {expected}");
        // Mirrored in space, the bump is the mirror image.
        builder.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
        let image = builder.load().scene.interaction(0, 0, Vec2::splat(0.3), Moment::STILL).shading.z;
        assert!((image - expected * Vec3::new(-1.0, 1.0, 1.0)).length() < 1e-5, "{image}");
        builder.push("nodes", json!({"mesh": 0, "scale": [-1, 1, 1]}));
        let instance = builder.load().scene.interaction(1, 0, Vec2::splat(0.3), Moment::STILL).shading.z;
        assert!((instance - expected * Vec3::new(-1.0, 1.0, 1.0)).length() < 1e-5, "{instance}");
    }
}

#[test]
fn unused_textures_are_not_loaded() {
    let mut builder = textured(json!({"emissiveTexture": {"index": 0}, "occlusionTexture": {"index": 1}}));
    // Nothing emits, and occlusion is what the path tracer computes: a missing file does no harm.
    builder.json["images"] = json!([{"uri": "missing.png"}]);
    let loaded = builder.load();
    assert_eq!(loaded.report.textures, 0);
    assert!(loaded.warnings.iter().any(|p| p.pointer == "/images/0/uri" && p.detail.contains("missing")));
}

#[test]
fn unlit_materials_are_black_but_for_the_eye() {
    let loaded = textured(json!({"alphaMode": "BLEND", "emissiveFactor": [1, 1, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 0.5], "baseColorTexture": {"index": 0}},
        "extensions": {"KHR_materials_unlit": {}, "KHR_materials_transmission": {"transmissionFactor": 1}}}))
    .load();
    let at = loaded.scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL);
    assert!((at.shown().unwrap() - Vec3::new(0.5, 0.215_860_5, 0.0)).length() < 1e-6, "{:?}", at.shown());
    assert!((at.alpha() - 0.5 * 128.0 / 255.0).abs() < 1e-6);
    let surface = at.surface();
    assert_eq!((surface.base_color, surface.metallic), (Vec3::ZERO, 0.0));
    assert_eq!((surface.specular, surface.transmission), (0.0, 0.0));
    assert_eq!((at.emission(Side::Front), loaded.report.emissive_triangles), (Vec3::ZERO, 0));
    assert!(textured(json!({})).load().scene.interaction(0, 0, Vec2::ZERO, Moment::STILL).shown().is_none());
}

#[test]
fn layers_are_read_with_their_textures() {
    let loaded = textured(json!({"extensions": {
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 0},
            "clearcoatRoughnessFactor": 0.8, "clearcoatRoughnessTexture": {"index": 0},
            "clearcoatNormalTexture": {"index": 0}},
        "KHR_materials_sheen": {"sheenColorFactor": [1, 0.5, 1], "sheenColorTexture": {"index": 0},
            "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": {"index": 0}}}}))
    .load();
    let at = loaded.scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL);
    let layers = at.surface().layers.unwrap();
    let half = 128.0 / 255.0;
    assert_eq!(layers.coat, 0.5);
    assert!(
        (layers.coat_roughness - 0.8 * half).abs() < 1e-6
            && (layers.sheen_roughness - 0.5 * half).abs() < 1e-6
    );
    assert!((layers.sheen - Vec3::new(1.0, 0.5 * 0.215_860_5, 0.0)).length() < 1e-6, "{layers:?}");
    // Texel (1, 0.5, 0): the map points along the tangent and down, which the surface does not allow.
    assert_eq!(layers.coat_normal, Vec3::Z);
    assert!(
        textured(json!({"extensions": {"KHR_materials_clearcoat": {}, "KHR_materials_sheen": {}}}))
            .load()
            .scene
            .materials
            .iter()
            .all(|material| material.layers.is_none())
    );
}

#[test]
fn a_variant_is_chosen_by_name() {
    let mut builder = textured(json!({"name": "plain"}));
    builder.push("materials", json!({"name": "other"}));
    builder.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    builder.json["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "red"}, {"name": "blue"}, {"name": "bare"}]}});
    builder.json["meshes"][0]["primitives"][0]["extensions"] = json!({"KHR_materials_variants": {"mappings": [
        {"material": 1, "variants": [1]}, {"material": 0, "variants": [0]}]}});
    let bundle = Bundle::open(builder.glb()).unwrap();
    let load = |variant| load_as(&bundle, &Limits::default(), &Choice { variant, ..Choice::default() });
    for (variant, name) in
        [(None, "plain"), (Some("red"), "plain"), (Some("blue"), "other"), (Some("bare"), "plain")]
    {
        let loaded = load(variant).unwrap();
        assert_eq!(loaded.scene.material(0, 0).name, name);
        assert_eq!(loaded.report.variants, ["red", "blue", "bare"]);
        assert!(loaded.warnings.iter().all(|w| !w.detail.contains("variant")), "{:?}", loaded.warnings);
    }
    let error = load(Some("green")).unwrap_err().to_string();
    assert!(error.contains("\"green\"") && error.contains("\"blue\""), "{error}");
}

#[test]
fn brushed_and_filmed_surfaces_are_read_with_their_textures() {
    let load = |extensions: Value| textured(json!({"extensions": extensions})).load();
    let loaded = load(json!({
        "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": std::f64::consts::FRAC_PI_2,
            "anisotropyTexture": {"index": 0}},
        "KHR_materials_iridescence": {"iridescenceFactor": 0.8, "iridescenceTexture": {"index": 0},
            "iridescenceIor": 1.8, "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 600,
            "iridescenceThicknessTexture": {"index": 0}}}));
    let at = loaded.scene.interaction(0, 0, Vec2::new(0.75, 0.1), Moment::STILL);
    let finish = at.surface().layers.unwrap().finish;
    // Texel (1, 0.5, 0): no strength; along the tangent, turned by a quarter to the bitangent.
    let half = 128.0 / 255.0;
    assert_eq!((finish.strength, finish.film_ior, finish.film), (0.0, 1.8, 0.8));
    assert!((finish.film_thickness - (200.0 + 400.0 * half)).abs() < 1e-3, "{finish:?}");
    assert!((finish.along.x.abs(), finish.along.y.abs()).0 < 0.01, "{finish:?}");
    assert!(loaded.warnings.iter().all(|w| !w.detail.contains("extension")), "{:?}", loaded.warnings);
    let plain = load(json!({"KHR_materials_anisotropy": {"anisotropyStrength": 0.5},
        "KHR_materials_iridescence": {"iridescenceFactor": 1}}));
    let finish =
        plain.scene.interaction(0, 0, Vec2::splat(0.2), Moment::STILL).surface().layers.unwrap().finish;
    assert_eq!((finish.strength, finish.along, finish.film), (0.5, Vec2::X, 1.0));
    assert_eq!((finish.film_ior, finish.film_thickness), (1.3, 400.0));
    let none = load(json!({"KHR_materials_anisotropy": {}, "KHR_materials_iridescence": {}}));
    assert!(none.scene.materials.iter().all(|material| material.layers.is_none()));
}

/// The direction goes with the layout of the texture coordinates: over a mirrored one, and an instance mirrored in space, the
/// highlight is the mirror image.
#[test]
fn a_brushed_direction_is_in_the_space_of_the_tangents() {
    let rotation = 0.5_f64;
    for mirrored in [false, true] {
        let mut builder = Builder::new();
        let position = builder.floats("VEC3", &super::builder::TRIANGLE);
        let normal = builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
        let uvs = if mirrored { [0., 1., -1., 1., 0., 0.] } else { [0., 1., 1., 1., 0., 0.] };
        let uv = builder.floats("VEC2", &uvs);
        builder.primitive(
            &json!({"attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv}, "material": 0}),
        );
        builder.push(
            "materials",
            json!({"extensions": {
            "KHR_materials_anisotropy": {"anisotropyStrength": 1, "anisotropyRotation": rotation}}}),
        );
        builder.push("nodes", json!({"mesh": 0, "scale": [-1, 1, 1]}));
        let scene = builder.load().scene;
        let side = if mirrored { -1.0 } else { 1.0 };
        let expected = Vec3::new(libm::cos(rotation) as f32 * side, libm::sin(rotation) as f32, 0.0);
        for (instance, turn) in [(0, 1.0), (1, -1.0)] {
            let at = scene.interaction(instance, 0, Vec2::splat(0.3), Moment::STILL);
            let along = at.surface().layers.unwrap().finish.along;
            let got = at.shading.to_world(along.extend(0.0));
            let expected = expected * Vec3::new(turn, 1.0, 1.0);
            assert!((got - expected).length() < 1e-5, "{got} {expected}");
        }
    }
}

#[test]
fn what_a_finish_cannot_do_is_pointed_out() {
    let brushed = json!({"extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 1}}});
    let mut builder = Builder::triangle(&[], json!({"material": 0}));
    builder.push("materials", brushed.clone());
    let loaded = builder.load();
    assert!(
        loaded.warnings.iter().any(|w| w.pointer == "/meshes/0/primitives/0" && w.detail.contains("brushed"))
    );
    let at = loaded.scene.interaction(0, 0, Vec2::splat(0.2), Moment::STILL);
    assert_eq!(at.surface().layers.unwrap().finish.strength, 0.0);
    let mut glass = brushed;
    glass["pbrMetallicRoughness"] = json!({"metallicFactor": 0});
    glass["extensions"]["KHR_materials_transmission"] = json!({"transmissionFactor": 1});
    let warned = textured(glass).load().warnings;
    let pointer = "/materials/0/extensions/KHR_materials_anisotropy";
    assert!(warned.iter().any(|w| w.pointer == pointer && w.detail.contains("glass")), "{warned:?}");
    for (extension, key, value, part) in [
        ("KHR_materials_anisotropy", "anisotropyStrength", json!("much"), "anisotropyStrength"),
        ("KHR_materials_iridescence", "iridescenceIor", json!(0.5), "iridescenceIor"),
        (
            "KHR_materials_iridescence",
            "iridescenceThicknessMaximum",
            json!(-1),
            "iridescenceThicknessMaximum",
        ),
    ] {
        let mut members = json!({"iridescenceFactor": 1});
        members[key] = value;
        let refused = textured(json!({"extensions": {extension: members}})).refusal();
        assert!(refused.contains(part) && refused.contains("/materials/0/extensions/"), "{refused}");
    }
}
