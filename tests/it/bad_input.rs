//! Bad input gets one clear line that says what and where, and exit code 2.

use glam::Vec3;
use ovtigre_tests::{
    glb::{Glb, glb},
    program::run,
    room::room,
    scenes::{lambert, quad},
};
use serde_json::{Value, json};
use std::{fs, path::Path};

/// Asserts that `render` and `check` refuse a file with one line that has all of `words`.
fn refused(file: &Path, words: &[&str]) {
    let path = file.to_str().unwrap();
    for arguments in [vec!["render", path, "--size", "8x8", "--samples", "4"], vec!["check", path]] {
        let output = run(&arguments);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
        let errors: Vec<&str> = text.lines().filter(|l| l.starts_with("error: ")).collect();
        assert_eq!((errors.len(), text.lines().count()), (1, 1), "not one line: {text}");
        for word in words {
            assert!(errors[0].contains(word), "'{word}' is not in: {text}");
        }
    }
}

/// Of the header below, as PNG wants it.
const CRC: [u8; 4] = 0xa852_0bc8_u32.to_be_bytes();

/// A valid document of one quad, changed by hand.
fn changed(change: impl FnOnce(&mut serde_json::Map<String, Value>)) -> Vec<u8> {
    let mut scene = Glb::new();
    let material = scene.material(lambert(0.5, 1.0));
    let (positions, triangles) = quad([Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y]);
    let mesh = scene.mesh(&positions, &triangles, material);
    scene.place(mesh);
    change(scene.document());
    scene.finish()
}

#[test]
fn every_kind_of_bad_scene_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    refused(&folder.path().join("nowhere.glb"), &["nowhere.glb"]);
    refused(&write("empty.glb", b""), &["empty.glb"]);
    let whole = room();
    refused(&write("cut.glb", &whole[..whole.len() / 2]), &["cut.glb"]);
    refused(&write("json.gltf", b"{\"asset\": {\"version\": \"2.0\"},\n  oops}"), &["json.gltf", ":2:"]);
    let index = changed(|d| d["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(77));
    refused(&write("index.glb", &index), &["index.glb", "/meshes/0/primitives/0/attributes/POSITION"]);
    let required = changed(|d| {
        d.insert("extensionsRequired".to_owned(), json!(["ACME_unheard_of"]));
        d.insert("extensionsUsed".to_owned(), json!(["ACME_unheard_of"]));
    });
    refused(&write("required.glb", &required), &["ACME_unheard_of", "/extensionsRequired/0"]);

    let mut nan = Glb::new();
    let material = nan.material(lambert(0.5, 1.0));
    let mesh = nan.mesh(&[Vec3::ZERO, Vec3::new(f32::NAN, 0.0, 0.0), Vec3::Y], &[[0, 1, 2]], material);
    nan.place(mesh);
    refused(&write("nan.glb", &nan.finish()), &["nan.glb", "/meshes/0/primitives/0/attributes/POSITION"]);
}

#[test]
fn what_a_scene_refers_to_stays_in_its_folder_and_in_bounds() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("inner")).unwrap();
    fs::write(folder.path().join("secret.bin"), [0; 64]).unwrap();
    let outside =
        json!({"asset": {"version": "2.0"}, "buffers": [{"uri": "../secret.bin", "byteLength": 64}]});
    let path = folder.path().join("inner/outside.gltf");
    fs::write(&path, outside.to_string()).unwrap();
    refused(&path, &["../secret.bin", "/buffers/0"]);

    // A picture whose header says 100,000 × 100,000.
    let mut header = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    for n in [100_000_u32, 100_000] {
        header.extend(n.to_be_bytes());
    }
    header.extend([8, 6, 0, 0, 0]);
    header.extend(CRC);
    header.extend(b"\0\0\0\x10IDAT");
    header.extend([0; 20]);
    let mut scene = Glb::new();
    let texture = scene.texture(&header, json!({}));
    let mut material = lambert(0.5, 1.0);
    material["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": texture});
    let material = scene.material(material);
    let (positions, triangles) = quad([Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y]);
    let uvs = [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0];
    let mesh = scene.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &uvs, 2)]);
    scene.place(mesh);
    let path = folder.path().join("bomb.glb");
    fs::write(&path, scene.finish()).unwrap();
    refused(&path, &["bomb.glb", "/images/0"]);
    let no_document = folder.path().join("binary.glb");
    fs::write(&no_document, glb(b"[]", &[])).unwrap();
    refused(&no_document, &["binary.glb"]);
}
