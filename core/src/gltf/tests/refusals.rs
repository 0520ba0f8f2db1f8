//! Every kind of broken scene is refused with one line that says where.

use super::builder::{Builder, F32, TRIANGLE, U16, bytes, png};
use crate::gltf::bundle::Bundle;
use crate::gltf::limits::Limits;
use crate::gltf::load::load;
use crate::trace::moment::Moment;
use serde_json::{Value, json};

/// Refused after `change`, with all of `says` in one line.
fn refused(says: &[&str], change: impl FnOnce(&mut Builder)) {
    let mut builder = Builder::triangle(&[], json!({"material": 0}));
    builder.push("materials", json!({}));
    builder.load();
    change(&mut builder);
    let error = builder.refusal();
    assert!(says.iter().all(|part| error.contains(part)) && !error.contains('\n'), "{error}");
}

fn text_error(text: &str) -> String {
    load(&Bundle::open(text.as_bytes()).unwrap().named("a.gltf"), &Limits::default()).unwrap_err().to_string()
}

#[test]
fn bad_json_is_placed_by_line_and_column() {
    assert!(text_error("{\n  \"asset\": }").starts_with("a.gltf:2:12: not valid JSON"));
    assert!(text_error(r#"{"asset": {"version": "2.0"}, "x": 1e999}"#).contains("not valid JSON"));
    assert!(text_error(&format!("{{\"x\": {}", "[".repeat(200_000))).contains("not valid JSON"));
}

#[test]
fn other_versions_and_required_extensions_are_named() {
    assert!(text_error(r#"{"asset": {"version": "1.0"}}"#).contains("glTF 1.0 is not supported"));
    assert!(
        text_error(r#"{"asset": {"version": "2.1", "minVersion": "2.1"}}"#).contains("2.1 is not supported")
    );
    assert!(text_error("{}").contains("\"asset\" is missing"));
    refused(&["/extensionsRequired/0", "EXT_QuantumRendering"], |b| {
        b.json["extensionsRequired"] = json!(["EXT_QuantumRendering"]);
    });
    let mut used = Builder::triangle(&[], json!({}));
    used.json["extensionsUsed"] = json!(["EXT_QuantumRendering"]);
    assert!(used.load().warnings.iter().any(|p| p.detail.contains("EXT_QuantumRendering")));
}

#[test]
fn dangling_references_are_named() {
    for (pointer, value) in [
        ("/nodes/0/mesh", json!(9)),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9)),
        ("/meshes/0/primitives/0/material", json!(4_294_967_296_u64)),
        ("/accessors/0/bufferView", json!(9)),
        ("/bufferViews/0/buffer", json!(9)),
        ("/nodes/0/mesh", json!(-1)),
        ("/nodes/0/mesh", json!("0")),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(0.5)),
    ] {
        refused(&[pointer], |b| *b.json.pointer_mut(pointer).unwrap() = value);
    }
    refused(&["/meshes/0/primitives/0/indices"], |b| {
        b.json["meshes"][0]["primitives"][0]["indices"] = json!(7);
    });
}

#[test]
fn accessors_beyond_their_bytes_are_named() {
    for (pointer, value, says) in [
        ("/accessors/0/count", json!(2_147_483_647_u64), "/accessors/0"),
        ("/accessors/0/count", json!(u64::MAX), "/accessors/0"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "/bufferViews/0"),
        ("/bufferViews/0/byteLength", json!(1 << 30), "/bufferViews/0"),
        ("/accessors/0/componentType", json!(5124), "5124"),
        ("/accessors/0/type", json!("VEC5"), "VEC5"),
        ("/accessors/0/type", json!("VEC2"), "/attributes/POSITION"),
    ] {
        refused(&[says], |b| *b.json.pointer_mut(pointer).unwrap() = value);
    }
    refused(&["/accessors/0", "elements"], |b| b.json["accessors"][0]["byteOffset"] = json!(u64::MAX));
    refused(&["/bufferViews/0", "byteStride"], |b| b.json["bufferViews"][0]["byteStride"] = json!(0));
    refused(&["stride of 4"], |b| b.json["bufferViews"][0]["byteStride"] = json!(4));
    refused(&["/buffers/0", "there are only"], |b| b.json["buffers"] = json!([{"byteLength": 1 << 20}]));
    refused(&["has no data"], |b| {
        b.json["buffers"] = json!([{"byteLength": 36}, {"byteLength": 36}]);
        b.json["bufferViews"][0]["buffer"] = json!(1);
    });
    refused(&["/accessors/0", "without a buffer"], |b| {
        b.json["accessors"][0] = json!({"componentType": F32, "type": "VEC3", "count": 100_000_000});
    });
}

#[test]
fn broken_sparse_accessors_are_named() {
    for (count, component, index, says) in
        [(4, U16, 0, "4 elements of only 3"), (1, F32, 0, "component type 5126"), (1, U16, 3, "not below")]
    {
        refused(&["/accessors/0/sparse", says], |b| {
            let indices = b.view(&[index, 0, index, 0, index, 0, index, 0], None);
            let values = b.view(&bytes(&[0.0; 12]), None);
            b.json["accessors"][0]["sparse"] = json!({"count": count,
                "indices": {"bufferView": indices, "componentType": component}, "values": {"bufferView": values}});
        });
    }
}

#[test]
fn indices_beyond_the_vertices_are_named() {
    refused(&["/meshes/0/primitives/0/indices", "element 2 is 3", "only 3 vertices"], |b| {
        let indices = b.accessor(&[0, 1, 3], 5121, "SCALAR", 3);
        b.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    });
    refused(&["/meshes/0/primitives/0/indices", "unsigned"], |b| {
        let indices = b.floats("SCALAR", &[0.0, 1.0, 2.0]);
        b.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    });
}

#[test]
fn numbers_that_are_none_are_named() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        refused(&["/meshes/0/primitives/0/attributes/POSITION", "vertex 1"], |b| {
            let mut numbers = TRIANGLE;
            numbers[4] = bad;
            b.binary[..36].copy_from_slice(&bytes(&numbers));
        });
    }
    refused(&["/nodes/0", "range of numbers"], |b| {
        b.json["nodes"][0]["scale"] = json!([1e300, 1e300, 1e300]);
    });
    refused(&["/meshes/0/primitives/0/attributes/COLOR_0", "vertex 0"], |b| {
        b.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
            json!(b.floats("VEC3", &[f32::NAN; 9]));
    });
}

#[test]
fn attributes_of_another_length_are_named() {
    refused(&["/attributes/NORMAL", "2 elements", "POSITION has 3"], |b| {
        b.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(b.floats("VEC3", &[0.0; 6]));
    });
}

#[test]
fn materials_beyond_their_ranges_are_named() {
    let cases: [(&str, Value); 8] = [
        ("emissiveFactor", json!({"emissiveFactor": [-1, 0, 0]})),
        ("emissiveFactor", json!({"emissiveFactor": [0, 0]})),
        ("alphaMode", json!({"alphaMode": "WAT"})),
        (
            "emissiveStrength",
            json!({"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -1}}}),
        ),
        ("\"ior\" is 0.5", json!({"extensions": {"KHR_materials_ior": {"ior": 0.5}}})),
        ("pbrMetallicRoughness", json!({"pbrMetallicRoughness": [1]})),
        ("metallicFactor", json!({"pbrMetallicRoughness": {"metallicFactor": false}})),
        ("refers to 3 of textures", json!({"normalTexture": {"index": 3}})),
    ];
    for (says, material) in cases {
        refused(&["/materials/0", says], |b| b.json["materials"][0] = material);
    }
}

#[test]
fn cameras_and_lights_beyond_their_ranges_are_named() {
    for (says, camera) in [
        ("yfov", json!({"type": "perspective", "perspective": {"yfov": 0}})),
        ("yfov", json!({"type": "perspective", "perspective": {"yfov": 3.2}})),
        ("aspectRatio", json!({"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": -1}})),
        ("xmag", json!({"type": "orthographic", "orthographic": {"xmag": 0, "ymag": 1}})),
        ("type", json!({"perspective": {"yfov": 1}})),
    ] {
        refused(&["/cameras/0", says], |b| {
            b.push("cameras", camera);
            b.push("nodes", json!({"camera": 0}));
        });
    }
    for (says, light) in [
        ("intensity", json!({"type": "point", "intensity": -1})),
        ("type", json!({"type": "laser"})),
        ("angles", json!({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}})),
    ] {
        refused(&["/extensions/KHR_lights_punctual/lights/0", says], |b| {
            b.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
            b.push("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
        });
    }
}

fn with_picture(b: &mut Builder, picture: &[u8]) {
    let uv = b.floats("VEC2", &[0.0; 6]);
    b.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    let view = b.view(picture, None);
    b.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    b.push("textures", json!({"source": 0}));
    b.json["materials"][0] = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
}

#[test]
fn broken_and_huge_pictures_are_named() {
    refused(&["/images/0", "neither PNG"], |b| with_picture(b, b"hello"));
    let mut noise = vec![[0_u8; 4]; 4096];
    noise.iter_mut().enumerate().for_each(|(i, p)| *p = (i as u32).wrapping_mul(2_654_435_761).to_le_bytes());
    let whole = png(64, 64, &noise);
    refused(&["/images/0", "decoded"], |b| with_picture(b, &whole[..whole.len() / 2]));
    // A header that says 100,000 × 100,000; its checksum is right.
    let mut huge = whole.clone();
    huge[16..20].copy_from_slice(&100_000_u32.to_be_bytes());
    huge[20..24].copy_from_slice(&100_000_u32.to_be_bytes());
    let sum = crc(&huge[12..29]);
    huge[29..33].copy_from_slice(&sum.to_be_bytes());
    refused(&["/images/0", "100000×100000"], |b| with_picture(b, &huge));
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 },
        )
    })
}

#[test]
fn limits_are_named_with_what_was_found() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.push("nodes", json!({"mesh": 0}));
    let bundle = Bundle::open(builder.glb()).unwrap();
    let base = Limits::default();
    for (limits, says) in [
        (Limits { triangles: 0, ..base.clone() }, "1 triangles are more than the limit of 0"),
        (Limits { instances: 1, ..base.clone() }, "2 instances"),
        (Limits { document_values: 5, ..base.clone() }, "JSON values"),
        (Limits { document_bytes: 5, ..base.clone() }, "bytes of JSON"),
        (Limits { buffer_bytes: 5, ..base.clone() }, "bytes of buffers"),
    ] {
        let error = load(&bundle, &limits).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// Flipping any byte of a scene with everything in it may change it or have it refused, never panic.
#[test]
fn no_flipped_byte_panics() {
    let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let mut builder = Builder::triangle(&[("TEXCOORD_0", "VEC2", &uvs)], json!({"material": 0}));
    let view = builder.view(&png(1, 1, &[[9, 9, 9, 9]]), None);
    builder.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    builder.push("textures", json!({"source": 0}));
    builder.push("materials", json!({"normalTexture": {"index": 0}, "emissiveFactor": [1, 1, 1], "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"rotation": 1}}}}}));
    builder.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}));
    builder.push("nodes", json!({"camera": 0, "mesh": 0, "rotation": [0, 0, 0, 1], "scale": [1, 2, 3]}));
    let glb = builder.glb();
    for at in 0..glb.len() {
        for flip in [1, 0x80, 0xFF] {
            let mut broken = glb.clone();
            broken[at] ^= flip;
            if let Ok(bundle) = Bundle::open(broken)
                && let Ok(loaded) = load(&bundle, &Limits::default())
            {
                for instance in 0..loaded.scene.instances.len() as u32 {
                    let interaction =
                        loaded.scene.interaction(instance, 0, glam::Vec2::splat(0.3), Moment::STILL);
                    assert!(interaction.position.is_finite() && interaction.surface().base_color.is_finite());
                    assert!(interaction.shading.z.dot(interaction.ng) > 0.0, "{at} {flip}");
                }
            }
        }
    }
}
