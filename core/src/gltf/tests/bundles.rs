//! Archives, data URIs, and what they may not do.

use super::builder::{Builder, png};
use crate::gltf::bundle::{Bundle, references};
use crate::gltf::limits::Limits;
use crate::gltf::load::load;
use serde_json::json;
use std::io::Write;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

fn scene_with_files() -> (Vec<u8>, Vec<(String, Vec<u8>)>) {
    let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let mut builder = Builder::triangle(&[("TEXCOORD_0", "VEC2", &uvs)], json!({"material": 0}));
    builder.json["buffers"] = json!([{"uri": "da%20ta.bin", "byteLength": builder.binary.len()}]);
    builder.push("images", json!({"uri": "textures/../textures/red.png"}));
    builder.push("textures", json!({"source": 0}));
    builder.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let files = vec![
        ("textures/red.png".to_owned(), png(1, 1, &[[255, 0, 0, 255]])),
        ("da ta.bin".to_owned(), builder.binary.clone()),
    ];
    (builder.json.to_string().into_bytes(), files)
}

fn error_of(bytes: Vec<u8>) -> String {
    Bundle::open(bytes).and_then(|b| load(&b, &Limits::default())).expect_err("should be refused").to_string()
}

fn archive(files: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut writer = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, SimpleFileOptions::default().compression_method(method)).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

#[test]
fn a_packed_folder_loads_and_packs_the_same_again() {
    let (document, files) = scene_with_files();
    assert_eq!(references(&document).unwrap(), ["da ta.bin", "textures/red.png"]);
    let packed = Bundle::pack(("scene.gltf", &document), &files);
    let reversed: Vec<_> = files.iter().rev().cloned().collect();
    assert_eq!(packed, Bundle::pack(("scene.gltf", &document), &reversed));
    let loaded = load(&Bundle::open(packed).unwrap(), &Limits::default()).unwrap();
    assert_eq!((loaded.report.triangles, loaded.report.textures), (1, 1));
    // Compressed, and within a folder, it is the same scene.
    let list: Vec<(String, &[u8])> = [("a/scene.gltf".to_owned(), document.as_slice())]
        .into_iter()
        .chain(files.iter().map(|(n, b)| (format!("a/{n}"), b.as_slice())))
        .collect();
    let list: Vec<(&str, &[u8])> = list.iter().map(|(n, b)| (n.as_str(), *b)).collect();
    let deflated = Bundle::open(archive(&list, CompressionMethod::Deflated)).unwrap();
    assert_eq!(load(&deflated, &Limits::default()).unwrap().report, loaded.report);
}

#[test]
fn a_missing_file_is_named() {
    let (document, files) = scene_with_files();
    let error = error_of(Bundle::pack(("scene.gltf", &document), &files[..1]));
    assert!(error.contains("scene.gltf: /buffers/0/uri") && error.contains("da ta.bin"), "{error}");
    let error = error_of(Bundle::pack(("scene.gltf", &document), &files[1..]));
    assert!(error.contains("/images/0/uri") && error.contains("textures/red.png"), "{error}");
    // A document alone has no files beside it.
    assert!(error_of(document).contains("missing"));
}

#[test]
fn data_uris_and_containers_are_the_same_scene() {
    let builder = Builder::triangle(&[], json!({}));
    let embedded = load(&Bundle::open(builder.embedded()).unwrap(), &Limits::default()).unwrap();
    assert_eq!(embedded.scene.meshes[0].positions, builder.load().scene.meshes[0].positions);
}

#[test]
fn references_that_leave_the_folder_are_refused() {
    for uri in ["../secret.bin", "/etc/passwd", "file:///etc/passwd", "C:/x", "a/../../b", "%2e%2e/x"] {
        let document =
            json!({"asset": {"version": "2.0"}, "buffers": [{"uri": uri, "byteLength": 4}]}).to_string();
        let error = references(document.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("/buffers/0/uri") && error.contains("refused"), "{error}");
        assert!(error_of(Bundle::pack(("s.gltf", document.as_bytes()), &[])).contains("refused"));
    }
}

#[test]
fn archives_that_leave_their_folder_or_hide_their_scene_are_refused() {
    let (stored, scene) = (CompressionMethod::Stored, br#"{"asset": {"version": "2.0"}}"#.as_slice());
    for name in ["../evil.bin", "/etc/evil", "C:\\evil", "a/../../evil"] {
        let error = error_of(archive(&[("s.gltf", scene), (name, b"x")], stored));
        assert!(error.contains("refused"), "{name}: {error}");
    }
    assert!(error_of(archive(&[("readme.txt", b"x")], stored)).contains("neither a .gltf nor a .glb"));
    assert!(error_of(archive(&[("a.gltf", scene), ("b.gltf", scene)], stored)).contains("several scenes"));
    let whole = archive(&[("s.gltf", scene)], stored);
    for cut in 4..whole.len() {
        // No cut may panic; a cut within the directory may not be read either.
        let _ = Bundle::open(&whole[..cut]);
    }
}

#[test]
fn archive_bombs_are_refused_before_they_are_unpacked() {
    let zeros = vec![0_u8; 300 << 20];
    let bomb = archive(&[("s.gltf", b"{}"), ("zeros.bin", &zeros)], CompressionMethod::Deflated);
    assert!(bomb.len() < 1 << 20);
    assert!(error_of(bomb).contains("more than the limit"));
}

#[test]
fn what_is_no_scene_is_said_to_be_none() {
    for (bytes, says) in [
        (b"".as_slice(), "the file is empty"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n", "git-LFS pointer"),
        (b"<html>", "neither a .glb nor a .gltf nor a .zip"),
        (b"PK\x03\x04 not really", "the .zip is broken"),
        (b"glTF\x02\0\0\0\xff\0\0\0", "truncated"),
    ] {
        let error = error_of(bytes.to_vec());
        assert!(error.contains(says), "{error}");
    }
}
