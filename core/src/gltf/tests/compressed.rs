//! Geometry behind codecs.

use super::builder::{Builder, F32, TRIANGLE, U8, U16, U32, bytes};
use crate::gltf::bundle::Bundle;
use crate::gltf::limits::Limits;
use crate::gltf::load::load;
use crate::scene::mesh::Mesh;
use glam::{Vec2, Vec3, Vec4};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer,
};
use serde_json::json;

/// A unit square of two triangles with coordinates like its positions and red, green, blue and half transparent white
/// corners, counter-clockwise from the origin, as `draco-core` 2.3 encodes it: attributes 0, 1 and 2.
const SQUARE: &str = "445241434f02020101000000040202020000011fff0111ff0111ff011103ff0000000000010000010009030000000103\
    0902000100010202040102010000000000000000000000000000803f0000803f00000000000000000000803f000000000000803f00000000\
    0000000000000000000000000000803f0000803f000000000000803f0000803f00000000010101000903012001101301100300309029111000\
    d02f00000000ff000000";

fn square() -> Vec<u8> {
    let digits: Vec<u8> = SQUARE.bytes().collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect()
}

/// A scene of the square, compressed.
fn draco(data: &[u8]) -> Builder {
    let mut builder = Builder::new();
    builder.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    builder.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    let view = builder.view(data, None);
    let mut accessor = |component: u64, shape: &str, count: usize| {
        builder.push("accessors", json!({"componentType": component, "type": shape, "count": count}))
    };
    let (position, uv) = (accessor(F32, "VEC3", 4), accessor(F32, "VEC2", 4));
    let (colour, indices) = (accessor(U8, "VEC4", 4), accessor(U16, "SCALAR", 6));
    builder.json["accessors"][colour]["normalized"] = json!(true);
    let info = json!({"index": 0});
    builder.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": info}}));
    builder.push("textures", json!({"source": 0}));
    let picture = builder.view(&super::builder::png(1, 1, &[[255; 4]]), None);
    builder.push("images", json!({"bufferView": picture, "mimeType": "image/png"}));
    builder.primitive(&json!({
        "attributes": {"POSITION": position, "TEXCOORD_0": uv, "COLOR_0": colour},
        "indices": indices, "material": 0,
        "extensions": {"KHR_draco_mesh_compression": {
            "bufferView": view, "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}}}}));
    builder
}

fn area(mesh: &Mesh) -> f32 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    mesh.triangles.iter().map(area).sum()
}

#[test]
fn a_draco_mesh_is_the_mesh_that_was_compressed() {
    let loaded = draco(&square()).load();
    assert!(loaded.warnings.iter().all(|w| !w.pointer.contains("accessors")), "{:?}", loaded.warnings);
    let (mesh, scale) = (&loaded.scene.meshes[0], loaded.scene.normalisation.scale() as f32);
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (2, 4));
    assert!((area(mesh) - scale * scale).abs() < 1e-5 * scale * scale, "both triangles face +z");
    let centre = loaded.scene.normalisation.centre.as_vec3();
    for (v, position) in mesh.positions.iter().enumerate() {
        let position = *position / scale + centre;
        assert_eq!(position.truncate(), mesh.uvs[0][v]);
        let colour = match position.truncate() {
            Vec2::ZERO => Vec4::new(1.0, 0.0, 0.0, 1.0),
            Vec2::X => Vec4::new(0.0, 1.0, 0.0, 1.0),
            Vec2::ONE => Vec4::new(0.0, 0.0, 1.0, 1.0),
            _ => Vec4::new(1.0, 1.0, 1.0, 128.0 / 255.0),
        };
        assert_eq!(mesh.colours[v], colour);
    }
}

#[test]
fn accessors_take_what_draco_holds_in_their_own_types_and_counts() {
    let mut builder = draco(&square());
    builder.json["accessors"][2] = json!({"componentType": F32, "type": "VEC3", "count": 9});
    builder.json["accessors"][3]["componentType"] = json!(U32);
    let loaded = builder.load();
    assert_eq!(loaded.scene.meshes[0].triangles.len(), 2);
    let says = |pointer: &str| loaded.warnings.iter().any(|w| w.pointer == pointer && w.detail.contains("says 9"));
    assert!(says("/accessors/2/count"), "{:?}", loaded.warnings);
}

#[test]
fn broken_draco_is_refused_by_name() {
    let whole = square();
    let pointer = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    for length in 0..whole.len() {
        let error = draco(&[&whole[..length], &[0; 4]].concat()[..length.max(1)]).refusal();
        assert!(error.contains(pointer) && !error.contains('\n'), "{length}: {error}");
    }
    // Any byte may be wrong: a picture or an error, never a panic.
    for (i, flip) in (0..whole.len()).flat_map(|i| [1, 0x80, 0xff].map(|flip| (i, flip))) {
        let mut broken = whole.clone();
        broken[i] ^= flip;
        let _ = draco(&broken).try_load();
    }
    for (member, value) in [("bufferView", json!(77)), ("attributes", json!({"POSITION": 5}))] {
        let mut builder = draco(&whole);
        builder.json.pointer_mut(pointer).unwrap()[member] = value;
        assert!(builder.refusal().contains(pointer));
    }
    let mut strip = draco(&whole);
    strip.json["meshes"][0]["primitives"][0]["mode"] = json!(5);
    assert!(strip.refusal().contains("\"mode\" must be 4"));
}

/// Replaces a buffer view by its compressed form in a buffer of its own.
fn compress(builder: &mut Builder, view: usize, encoded: &[u8], (count, stride): (usize, usize), mode: &str) {
    let offset = builder.binary.len();
    builder.binary.extend_from_slice(encoded);
    let item = &mut builder.json["bufferViews"][view];
    *item = json!({"buffer": 1, "byteLength": count * stride,
        "extensions": {"EXT_meshopt_compression": {"buffer": 0, "byteOffset": offset,
            "byteLength": encoded.len(), "byteStride": stride, "count": count, "mode": mode}}});
    builder.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    builder.json["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    builder.json["buffers"] = json!([{"byteLength": builder.binary.len()}, {"byteLength": 1 << 20,
        "extensions": {"EXT_meshopt_compression": {"fallback": true}}}]);
}

fn meshopt() -> Builder {
    let mut builder = Builder::new();
    let (position, corners) = (builder.floats("VEC3", &TRIANGLE), [0_u32, 1, 2].map(u32::to_le_bytes).concat());
    let indices = builder.accessor(&corners, U32, "SCALAR", 3);
    builder.primitive(&json!({"attributes": {"POSITION": position}, "indices": indices}));
    let mut room = Workspace::default();
    let oldest = VertexEncoding { version: 0, ..VertexEncoding::DEFAULT };
    let vertices = encode_vertex_buffer(&bytes(&TRIANGLE), 3, 12, oldest, &mut room).unwrap();
    compress(&mut builder, 0, &vertices, (3, 12), "ATTRIBUTES");
    let triangles = encode_index_buffer(&[0, 1, 2], IndexEncoding::DEFAULT, &mut room).unwrap();
    compress(&mut builder, 1, &triangles, (3, 4), "TRIANGLES");
    builder
}

#[test]
fn a_meshopt_view_is_the_view_that_was_compressed() {
    let loaded = meshopt().load();
    let scale = loaded.scene.normalisation.scale() as f32;
    assert!((area(&loaded.scene.meshes[0]) - 0.5 * scale * scale).abs() < 1e-5 * scale * scale);
    let mut filtered = meshopt();
    filtered.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["filter"] = json!("EXPONENTIAL");
    // Positions become mantissas and exponents: other numbers, but numbers.
    assert!(filtered.try_load().is_ok_and(|other| other.scene.meshes.is_empty()
        || other.scene.meshes[0].positions.iter().all(|p: &Vec3| p.is_finite())));
}

#[test]
fn broken_meshopt_is_refused_by_name() {
    let pointer = "/bufferViews/0/extensions/EXT_meshopt_compression";
    for (member, value) in [
        ("buffer", json!(7)),
        ("byteLength", json!(1 << 40)),
        ("byteLength", json!(3)),
        ("byteStride", json!(13)),
        ("count", json!(0)),
        ("count", json!(u64::MAX)),
        ("mode", json!("POINTS")),
        ("filter", json!("COLOR")),
        ("filter", json!("OCTAHEDRAL")),
    ] {
        let mut builder = meshopt();
        builder.json.pointer_mut(pointer).unwrap()[member] = value.clone();
        let error = builder.refusal();
        assert!(error.contains(pointer) && !error.contains('\n'), "{member} {value}: {error}");
    }
    // A bomb: a terabyte from a handful of bytes.
    let mut bomb = meshopt();
    bomb.json["bufferViews"][0]["byteLength"] = json!(12_u64 << 40);
    bomb.json.pointer_mut(pointer).unwrap()["count"] = json!(1_u64 << 40);
    assert!(bomb.refusal().contains("bytes of buffers"));
    let glb = meshopt();
    for (i, flip) in (0..glb.binary.len()).flat_map(|i| [1, 0x80, 0xff].map(|flip| (i, flip))) {
        let mut broken = meshopt();
        broken.binary[i] ^= flip;
        let _ = load(&Bundle::open(broken.glb()).unwrap(), &Limits::default());
    }
}
