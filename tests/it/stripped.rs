//! What workers fetch is without what a job does not read, and renders the same bits.

use glam::Vec3;
use ovtigre_core::{
    film::batch::{Batch, Block},
    gltf::{bundle::Bundle, limits::Limits, load::Choice, strip::strip},
    render::{batch::render, progress::Progress},
    settings::{Settings, Shutter},
};
use ovtigre_tests::{
    glb::Glb,
    picture::{scene, settings},
    program::run,
    scenes::{add, cornell, floor, lambert, sphere},
    textures::{UVS, png},
};
use serde_json::{Value, json};
use std::fs;

/// A lamp over a textured floor, a ball that moves and morphs, and a lot that is in no scene or in another one.
fn crowded(unused_rings: u32) -> Vec<u8> {
    let mut glb = Glb::new();
    let unused = glb.material(lambert(0.3, 0.0));
    let (positions, triangles) = sphere(Vec3::ZERO, 1.0, unused_rings);
    glb.mesh(&positions, &triangles, unused);
    glb.texture(&png(16, &[[9; 4]; 256]), json!({}));
    let texels: Vec<[u8; 4]> = (0..64).map(|i| [40 + 3 * i, 250 - 2 * i, 90, 255]).collect();
    let shown = glb.texture(&png(8, &texels), json!({}));
    glb.texture(&png(16, &[[77; 4]; 256]), json!({}));
    let mut ground = lambert(0.0, 0.0);
    ground["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": shown}, "metallicFactor": 0.0, "baseColorFactor": [0.9, 0.8, 0.7, 1.0]});
    let ground = glb.material(ground);
    let (positions, triangles) = floor(0.0, 6.0, 0.0, 0.0);
    let normals = [0.0, 1.0, 0.0].repeat(4);
    // No material looks at the colours' second set, nor at tangents without a normal map.
    let tangents = [1.0, 0.0, 0.0, 1.0].repeat(4);
    let attributes: [(&str, &[f32], usize); 3] =
        [("TEXCOORD_0", &UVS, 2), ("NORMAL", &normals, 3), ("TANGENT", &tangents, 4)];
    let mesh = glb.mesh_with(&positions, &triangles, ground, &attributes);
    glb.place(mesh);
    add(&mut glb, "lamp", lambert(0.0, 9.0), ovtigre_tests::scenes::flipped(floor(3.0, 1.0, 0.2, 0.1)));
    let (positions, triangles) = sphere(Vec3::new(0.0, 0.7, 0.0), 0.5, 6);
    let moves: Vec<f32> = positions.iter().flat_map(|p| [0.2 * p.y, 0.1, 0.0]).collect();
    let ball = glb.body(lambert(0.5, 0.0), (positions, triangles));
    glb.morph(ball, &moves);
    glb.animate(ball, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    glb.animate(ball, "translation", "LINEAR", &[0.0, 1.0], &[0.1, 0.0, 0.0, 0.4, 0.123_456_79, 0.0]);
    glb.perspective(Vec3::new(0.3, 2.0, 4.0), Vec3::new(0.0, 0.4, 0.0), 45.0);
    glb.finish()
}

/// The JSON and the binary chunk of a container.
fn chunks(file: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&file[20..20 + length]).unwrap(), file[28 + length..].to_vec())
}

/// The same scene as an archive whose buffer and pictures are files.
fn archive(file: &[u8]) -> Vec<u8> {
    let (mut document, binary) = chunks(file);
    let mut files = Vec::new();
    for i in 0..document["images"].as_array().unwrap().len() {
        let view = document["images"][i]["bufferView"].as_u64().unwrap() as usize;
        let of = |key: &str| document["bufferViews"][view][key].as_u64().unwrap() as usize;
        let bytes = binary[of("byteOffset")..of("byteOffset") + of("byteLength")].to_vec();
        files.push((format!("{i}.png"), bytes));
        document["images"][i] = json!({"uri": format!("{i}.png")});
    }
    document["buffers"][0]["uri"] = json!("all.bin");
    files.push(("all.bin".to_owned(), binary));
    Bundle::pack(("scene.gltf", &serde_json::to_vec(&document).unwrap()), &files)
}

fn stripped(file: &[u8], settings: &Settings) -> Option<Vec<u8>> {
    let choice = Choice {
        times: [settings.shutter.open, settings.shutter.close],
        variant: settings.variant.as_deref(),
    };
    strip(file, &Limits::default(), &choice).unwrap()
}

/// Asserts that a scene has the same bits without what is not read, and returns the share of its bytes that is left.
fn assert_same_bits(file: &[u8], settings: &Settings, what: &str) -> f64 {
    let small = stripped(file, settings).unwrap_or_else(|| panic!("{what}: nothing is left out"));
    let batch =
        Batch { region: settings.size.frame(), replicate: 0, block: Block { index: 0, start: 0, count: 4 } };
    let sum = |file: &[u8]| render(&scene(file, settings), settings, batch, &Progress::new()).unwrap();
    let [whole, left] = [sum(file), sum(&small)];
    assert!(whole.planes[0].iter().flatten().any(|value| *value > 0.0), "{what}: there is nothing to see");
    assert_eq!(whole.hash(), left.hash(), "{what}");
    assert!(stripped(&small, settings).is_none(), "{what}: there is more to leave out the second time");
    small.len() as f64 / file.len() as f64
}

#[test]
fn scenes_without_what_is_not_read_have_the_same_bits() {
    let still = settings(24, 16, 1);
    let moving = Settings { shutter: Shutter { open: 0.25, close: 0.75 }, ..still.clone() };
    let file = crowded(40);
    for (file, what) in [(file.clone(), "a file"), (archive(&file), "an archive")] {
        let share = assert_same_bits(&file, &still, what);
        assert!(share < 0.1, "{what}: {share} is left");
        assert_same_bits(&file, &moving, &format!("{what}, moving"));
    }
    // Of the targets of morphs only those are read that have a weight then.
    let [still, moving] = [&still, &moving].map(|settings| stripped(&file, settings).unwrap());
    assert!(still.len() < moving.len());
}

#[test]
fn of_several_scenes_one_is_fetched() {
    let (mut document, binary) = chunks(&crowded(40));
    let all = document["scenes"][0]["nodes"].as_array().unwrap().len() as u64;
    document["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0, "translation": [0.0, 1.0, -1.0]}));
    let node = document["nodes"].as_array().unwrap().len() - 1;
    let mut nodes = document["scenes"][0]["nodes"].clone();
    nodes.as_array_mut().unwrap().push(json!(node));
    document["scenes"].as_array_mut().unwrap().push(json!({"nodes": nodes}));
    assert!(all > 3);
    let file = |document: &Value| ovtigre_tests::glb::glb(&serde_json::to_vec(document).unwrap(), &binary);
    assert!(assert_same_bits(&file(&document), &settings(24, 16, 1), "the first") < 0.1);
    document["scene"] = json!(1);
    assert!(stripped(&file(&document), &settings(24, 16, 1)).is_none(), "the second shows nearly all");
}

#[test]
fn what_is_read_whole_is_not_copied() {
    assert!(stripped(&cornell(), &settings(8, 8, 1)).is_none());
}

#[test]
fn workers_fetch_less_and_the_job_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // 1.5 MiB that nothing shows.
    for (name, rings) in [("much", 200), ("little", 4)] {
        fs::write(path(&format!("{name}.glb")), crowded(rings)).unwrap();
        let [scene, out, report] = ["glb", "exr", "json"].map(|end| path(&format!("{name}.{end}")));
        let output = run([
            "render",
            &scene,
            "-o",
            &out,
            "--size",
            "32x24",
            "--samples",
            "16",
            "--method",
            "path",
            "--workers",
            "1",
            "--report",
            &report,
        ]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let compared = run(["compare", &path("much.exr"), &path("little.exr"), "--tolerance", "0"]);
    assert!(compared.status.success(), "{}", String::from_utf8_lossy(&compared.stdout));
    let says = |name: &str| fs::read_to_string(path(name)).unwrap().contains("bytes of the scene's file");
    assert_eq!([says("much.json"), says("little.json")], [true, false]);
}
