//! Small scenes that between them use much of what is read, as documents and their bytes: what hostile files are made of.

use crate::{
    glb::Glb,
    scenes::{cornell, quad, sphere},
    textures::png,
};
use glam::Vec3;
use serde_json::{Value, json};

/// A document and its binary chunk.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The document.
    pub json: Value,
    /// The binary chunk.
    pub binary: Vec<u8>,
}

/// All of them.
pub fn scenes() -> Vec<Piece> {
    let built = [cornell(), materials(), moving(), hanging(), many(), numbers()];
    built.iter().map(|glb| piece(glb)).chain([under_pictures()]).collect()
}

/// The two chunks of a binary glTF that [`crate::glb::glb`] wrote.
fn piece(glb: &[u8]) -> Piece {
    let length = |at: usize| u32::from_le_bytes([glb[at], glb[at + 1], glb[at + 2], glb[at + 3]]) as usize;
    let end = 20 + length(12);
    let json = serde_json::from_slice(&glb[20..end]).expect("a document");
    Piece { json, binary: glb[end + 8..].to_vec() }
}

fn framed(mut glb: Glb) -> Vec<u8> {
    glb.light(
        json!({"type": "spot", "intensity": 30.0, "color": [1, 0.9, 0.8], "range": 9.0, "spot": {"outerConeAngle": 0.6}}),
        json!({"translation": [0, 0, 4]}),
    );
    glb.light(json!({"type": "directional", "intensity": 2.0}), json!({"rotation": [0.1, 0.2, 0.0, 0.97]}));
    glb.perspective(Vec3::new(0.0, 0.5, 5.0), Vec3::ZERO, 40.0);
    glb.finish()
}

fn card(x: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |u: f32, v: f32| Vec3::new(x + u, v, 0.2 * u);
    quad([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)])
}

/// Every extension of materials, each with textures.
fn materials() -> Vec<u8> {
    let mut glb = Glb::new();
    let picture = png(2, &[[255, 128, 0, 128], [0, 30, 200, 255], [90, 90, 255, 255], [128, 128, 255, 0]]);
    let sampler = json!({"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33648});
    let t = json!({"index": glb.texture(&picture, sampler)});
    let moved = json!({"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform":
        {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 0.5], "texCoord": 0}}});
    let list = [
        json!({"name": "core", "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true,
            "pbrMetallicRoughness": {"baseColorTexture": t, "metallicRoughnessTexture": moved, "metallicFactor": 0.5},
            "normalTexture": {"index": 0, "scale": 0.7}, "emissiveFactor": [1, 1, 1], "emissiveTexture": t,
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}}}),
        json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.5, 0.5], "roughnessFactor": 0.3},
            "extensions": {
            "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": t, "clearcoatRoughnessFactor": 0.2,
                "clearcoatRoughnessTexture": t, "clearcoatNormalTexture": t},
            "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 0.5], "sheenColorTexture": t, "sheenRoughnessFactor": 0.4},
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.6, "anisotropyRotation": 1.1, "anisotropyTexture": t},
            "KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceIor": 1.4, "iridescenceTexture": t,
                "iridescenceThicknessMinimum": 100, "iridescenceThicknessMaximum": 500, "iridescenceThicknessTexture": t}}}),
        json!({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.2}, "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": t},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.5, 0.9, 0.9], "attenuationDistance": 0.7},
            "KHR_materials_ior": {"ior": 1.7}, "KHR_materials_dispersion": {"dispersion": 2}}}),
        json!({"pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": {
            "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": t, "specularColorFactor": [2, 1, 1],
                "specularColorTexture": t},
            "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": t,
                "diffuseTransmissionColorFactor": [1, 0.5, 0], "diffuseTransmissionColorTexture": t}}}),
        json!({"pbrMetallicRoughness": {"baseColorTexture": t}, "extensions": {"KHR_materials_unlit": {}}}),
        json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0.5, 0.5, 1],
            "specularFactor": [0.2, 0.4, 0.8], "glossinessFactor": 0.5, "specularGlossinessTexture": t}}}),
    ];
    let uv = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let normals = [0.0, 0.0, 1.0].repeat(4);
    let colours = [1.0, 0.5, 0.5, 1.0].repeat(4);
    let mut meshes = Vec::new();
    for (i, material) in list.into_iter().enumerate() {
        let material = glb.material(material);
        let (positions, triangles) = card(i as f32 - 3.0);
        let tangents = [1.0, 0.0, 0.0, 1.0].repeat(4);
        let attributes: [(&str, &[f32], usize); 5] = [
            ("NORMAL", &normals, 3),
            ("TEXCOORD_0", &uv, 2),
            ("TEXCOORD_1", &uv, 2),
            ("COLOR_0", &colours, 4),
            ("TANGENT", &tangents, 4),
        ];
        let with = if i % 2 == 0 { &attributes[..4] } else { &attributes[..] };
        meshes.push(glb.mesh_with(&positions, &triangles, material, with));
        glb.place(meshes[i]);
    }
    glb.document().insert(
        "extensions".to_owned(),
        json!({"KHR_materials_variants": {"variants": [{"name": "one"}, {"name": "two"}]}}),
    );
    glb.document()["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0, 1]}]}});
    framed(glb)
}

/// Nodes in nodes, animated in every way, and a morph target.
fn moving() -> Vec<u8> {
    let mut glb = Glb::new();
    let ball = glb.body(json!({"emissiveFactor": [1, 0.5, 0.2]}), sphere(Vec3::ZERO, 0.7, 6));
    let (positions, triangles) = card(1.0);
    let sheet = glb.body(json!({}), (positions, triangles));
    glb.morph(sheet, &[0.3; 12]);
    let parent = glb.carry(&[ball, sheet]);
    let times = [0.0, 0.5, 1.0];
    glb.animate(ball, "translation", "LINEAR", &times, &[0., 0., 0., 1., 0., 0., 1., 1., 0.]);
    let turns = [0., 0., 0., 1., 0., 0., 0.7, 0.7, 0., 0., 1., 0.];
    glb.animate(parent, "rotation", "LINEAR", &times, &turns);
    glb.animate(parent, "scale", "CUBICSPLINE", &times[..2], &[1.0; 18]);
    glb.animate(sheet, "weights", "STEP", &times, &[0.0, 1.0, 0.5]);
    framed(glb)
}

/// A skin of two joints.
fn hanging() -> Vec<u8> {
    let mut glb = Glb::new();
    let (positions, triangles) = card(0.0);
    let material = glb.material(json!({"pbrMetallicRoughness": {"metallicFactor": 0}}));
    let weights = [0.5, 0.5, 0.0, 0.0].repeat(4);
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("WEIGHTS_0", &weights, 4)]);
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let inverse = glb.floats(&identity.repeat(2), 4);
    let joints = glb.view(&[0, 1, 0, 0].repeat(4));
    let accessors = glb.document()["accessors"].as_array_mut().expect("a list");
    (accessors[inverse]["type"], accessors[inverse]["count"]) = (json!("MAT4"), json!(2));
    accessors.push(json!({"bufferView": joints, "componentType": 5121, "count": 4, "type": "VEC4"}));
    let joints = accessors.len() - 1;
    glb.document()["meshes"][mesh]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    let bones = [glb.node(json!({})), glb.node(json!({"translation": [0, 0.5, 0]}))];
    let root = glb.carry(&bones);
    glb.node(json!({"mesh": mesh, "skin": 0}));
    glb.document().insert(
        "skins".to_owned(),
        json!([{"joints": bones, "inverseBindMatrices": inverse, "skeleton": root}]),
    );
    glb.animate(bones[1], "rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 0., 0.7, 0.7]);
    framed(glb)
}

/// Light of six pictures around a ball.
fn under_pictures() -> Piece {
    let mut glb = Glb::new();
    glb.body(json!({}), sphere(Vec3::ZERO, 0.7, 6));
    let faces = [[255, 0, 0, 255], [0, 255, 0, 51], [90; 4], [255; 4], [1, 2, 3, 4], [0; 4]];
    let images = faces.map(|texel| glb.texture(&png(2, &[texel; 4]), json!({})));
    let light = json!({"intensity": 2.0, "rotation": [0, 0.6, 0, 0.8], "specularImages": [images],
        "specularImageSize": 2, "irradianceCoefficients": [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0],
        [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]});
    glb.document().insert("extensions".to_owned(), json!({"EXT_lights_image_based": {"lights": [light]}}));
    glb.perspective(Vec3::new(0.0, 0.5, 5.0), Vec3::ZERO, 40.0);
    let mut piece = piece(&glb.finish());
    piece.json["scenes"][0]["extensions"] = json!({"EXT_lights_image_based": {"light": 0}});
    piece
}

/// Instances, in the file and by extension.
fn many() -> Vec<u8> {
    let mut glb = Glb::new();
    let material = glb.material(json!({"pbrMetallicRoughness": {"roughnessFactor": 0.0}}));
    let (positions, triangles) = sphere(Vec3::ZERO, 0.3, 4);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.node(json!({"mesh": mesh, "scale": [-1, 1, 2]}));
    glb.node(json!({"mesh": mesh, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 0, 1]}));
    let places = glb.floats(&[-1., 0., 0., -1., 1., 0., 1., 0., 1.], 3);
    let turns = glb.floats(&[0., 0., 0., 1.].repeat(3), 4);
    glb.node(json!({"mesh": mesh, "extensions": {"EXT_mesh_gpu_instancing": {"attributes":
        {"TRANSLATION": places, "ROTATION": turns}}}}));
    framed(glb)
}

/// Accessors of other kinds: strided, normalised, sparse; strips and fans.
fn numbers() -> Vec<u8> {
    let mut glb = Glb::new();
    let corners: [i16; 16] = [-100, -100, 0, 0, 100, -100, 0, 0, 100, 100, 20, 0, -100, 100, 0, 0];
    let bytes: Vec<u8> = corners.iter().flat_map(|v| v.to_le_bytes()).collect();
    let places = glb.view(&bytes);
    let sparse = glb.view(&[1, 0, 0, 0]);
    let values = glb.view(&[50, 0, 50, 0, 50, 0]);
    let indices = glb.view(&[0, 1, 2, 3]);
    glb.document()["bufferViews"][places]["byteStride"] = json!(8);
    glb.document().insert(
        "accessors".to_owned(),
        json!([
            {"bufferView": places, "componentType": 5122, "count": 4, "type": "VEC3", "min": [-100, -100, 0], "max": [100, 100, 20],
             "sparse": {"count": 1, "indices": {"bufferView": sparse, "componentType": 5121},
                "values": {"bufferView": values}}},
            {"bufferView": indices, "componentType": 5121, "count": 4, "type": "SCALAR"},
            {"bufferView": indices, "componentType": 5121, "count": 3, "type": "SCALAR"}
        ]),
    );
    let primitive =
        |mode: u64, indices: u64| json!({"attributes": {"POSITION": 0}, "indices": indices, "mode": mode});
    glb.document().insert(
        "meshes".to_owned(),
        json!([{"primitives": [primitive(5, 1), primitive(6, 1)]}, {"primitives": [primitive(4, 2)]}]),
    );
    glb.document().insert("extensionsUsed".to_owned(), json!(["KHR_mesh_quantization"]));
    glb.document().insert("extensionsRequired".to_owned(), json!(["KHR_mesh_quantization"]));
    glb.node(json!({"mesh": 0, "scale": [0.01, 0.01, 0.01]}));
    glb.node(json!({"mesh": 1, "scale": [0.02, 0.01, 0.01], "translation": [0, 0, -1]}));
    framed(glb)
}
