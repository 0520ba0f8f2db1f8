//! Accessors of every kind, topologies, what is dropped.

use super::builder::{Builder, F32, I8, I16, TRIANGLE, U8, U16, U32, bytes};
use crate::scene::data::SceneData;
use crate::trace::moment::Moment;
use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::json;

/// Corners of the first instance's triangles, back in the file's space.
fn triangles(scene: &SceneData) -> Vec<[DVec3; 3]> {
    let count = scene.meshes[0].triangles.len() as u32;
    (0..count).map(|t| scene.corners(0, t, Moment::STILL).map(|p| scene.normalisation.restore(p))).collect()
}

fn near(a: &[DVec3; 3], b: &[[f64; 3]; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (*a - DVec3::from(*b)).length() < 1e-6)
}

#[test]
fn every_index_type_gives_the_same_triangle() {
    for (component, width) in [(U8, 1), (U16, 2), (U32, 4)] {
        let mut builder = Builder::new();
        let position = builder.floats("VEC3", &[&[9.0, 9.0, 9.0], TRIANGLE.as_slice()].concat());
        let indices: Vec<u8> = [1_u32, 2, 3].iter().flat_map(|i| i.to_le_bytes()[..width].to_vec()).collect();
        let indices = builder.accessor(&indices, component, "SCALAR", 3);
        builder.primitive(&json!({"attributes": {"POSITION": position}, "indices": indices}));
        let scene = builder.load().scene;
        assert_eq!(scene.meshes[0].positions.len(), 3, "a vertex that no triangle has is not kept");
        assert!(near(&triangles(&scene)[0], &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
    }
}

#[test]
fn every_component_type_is_read_plain_and_normalised() {
    // The same three corners at half the type's range, as quantised meshes have them.
    for (component, width, half, full) in
        [(I8, 1, 64.0, 127.0), (U8, 1, 128.0, 255.0), (I16, 2, 16384.0, 32767.0), (U16, 2, 32768.0, 65535.0)]
    {
        for normalised in [false, true] {
            let mut builder = Builder::new();
            let number = |v: f32| ((v * half) as i32).to_le_bytes()[..width].to_vec();
            let mut data = Vec::new();
            for corner in TRIANGLE.chunks(3) {
                let mut vertex: Vec<u8> = corner.iter().flat_map(|v| number(*v)).collect();
                vertex.resize(4 * width, 0);
                data.extend(vertex);
            }
            let view = builder.view(&data, Some(4 * width as u64));
            let position = builder.push(
                "accessors",
                json!({"bufferView": view, "componentType": component, "type": "VEC3", "count": 3, "normalized": normalised}),
            );
            builder.primitive(&json!({"attributes": {"POSITION": position}}));
            let size = if normalised { half / full } else { half };
            let got = triangles(&builder.load().scene)[0][1].x;
            assert!(
                (got - f64::from(size)).abs() < 1e-6 * f64::from(size),
                "{component} {normalised}: {got}"
            );
        }
    }
}

#[test]
fn interleaved_attributes_are_read_by_their_stride() {
    let mut builder = Builder::new();
    let mut data = Vec::new();
    for (i, corner) in TRIANGLE.chunks(3).enumerate() {
        data.extend(bytes(corner));
        data.extend(bytes(&[0.0, 0.6, 0.8]));
        data.extend(bytes(&[i as f32, -1.0]));
    }
    let view = builder.view(&data, Some(32));
    let mut at = |offset: u64, shape: &str| {
        builder.push(
            "accessors",
            json!({"bufferView": view, "byteOffset": offset, "componentType": F32, "type": shape, "count": 3}),
        )
    };
    let (position, normal) = (at(0, "VEC3"), at(12, "VEC3"));
    builder.primitive(&json!({"attributes": {"POSITION": position, "NORMAL": normal}}));
    let scene = builder.load().scene;
    assert!(near(&triangles(&scene)[0], &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
    assert!((scene.meshes[0].normals[2] - Vec3::new(0.0, 0.6, 0.8)).length() < 1e-6);
}

#[test]
fn sparse_accessors_replace_elements_with_and_without_a_base() {
    for base in [true, false] {
        let mut builder = Builder::new();
        let indices = builder.view(&[1, 0, 2, 0], None);
        let values = builder.view(&bytes(&[5.0, 0.0, 0.0, 0.0, 7.0, 0.0]), None);
        let mut accessor = json!({"componentType": F32, "type": "VEC3", "count": 3, "sparse": {
            "count": 2,
            "indices": {"bufferView": indices, "componentType": U16},
            "values": {"bufferView": values}
        }});
        if base {
            accessor["bufferView"] = json!(builder.view(&bytes(&TRIANGLE), None));
        }
        let position = builder.push("accessors", accessor);
        builder.primitive(&json!({"attributes": {"POSITION": position}}));
        assert!(near(
            &triangles(&builder.load().scene)[0],
            &[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 7.0, 0.0]]
        ));
    }
}

#[test]
fn strips_and_fans_become_triangles_facing_the_same_way() {
    // A square 0-1-3-2 as a strip, and around its first corner as a fan.
    let strip = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let fan = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    for (mode, positions) in [(5, strip), (6, fan)] {
        let mut builder = Builder::new();
        let position = builder.floats("VEC3", &positions);
        builder.primitive(&json!({"attributes": {"POSITION": position}, "mode": mode}));
        let scene = builder.load().scene;
        assert_eq!(scene.meshes[0].triangles.len(), 2);
        for triangle in 0..2 {
            assert_eq!(
                scene.interaction(0, triangle, Vec2::splat(0.3), Moment::STILL).ng,
                Vec3::Z,
                "mode {mode}"
            );
        }
    }
}

#[test]
fn points_and_lines_are_left_out_and_counted() {
    for mode in 0..4 {
        let loaded = Builder::triangle(&[], json!({"mode": mode})).load();
        assert_eq!(loaded.report.dropped.lines_and_points, 1);
        assert_eq!(loaded.report.triangles, 0);
        assert!(loaded.warnings.iter().any(|p| p.pointer == "/meshes/0/primitives/0"));
    }
}

#[test]
fn triangles_without_area_are_left_out_and_counted() {
    let mut builder = Builder::new();
    let position = builder.floats("VEC3", &[TRIANGLE.as_slice(), &[2.0, 0.0, 0.0]].concat());
    // A whole one, one with a corner twice, one whose corners lie on a line.
    let indices = builder.accessor(&[0, 1, 2, 0, 1, 1, 0, 1, 3], U8, "SCALAR", 9);
    builder.primitive(&json!({"attributes": {"POSITION": position}, "indices": indices}));
    let loaded = builder.load();
    assert_eq!((loaded.report.triangles, loaded.report.dropped.degenerate_triangles), (1, 2));
}

#[test]
fn slivers_keep_their_normal() {
    let mut builder = Builder::new();
    let position = builder.floats(
        "VEC3",
        &[1e6, 0.0, 0.0, 1e6 + 1.0, 0.0, 0.0, 1e6, 1e-30, 0.0, 2e6, 2e6, 2e6, 3e6, 2e6, 2e6, 2e6, 3e6, 2e6],
    );
    builder.primitive(&json!({"attributes": {"POSITION": position}}));
    let loaded = builder.load();
    for triangle in 0..loaded.report.triangles as u32 {
        assert!(
            (loaded.scene.interaction(0, triangle, Vec2::splat(0.3), Moment::STILL).ng - Vec3::Z).length()
                < 1e-6
        );
    }
}

#[test]
fn missing_normals_are_flat_and_zero_ones_too() {
    let flat = Builder::triangle(&[], json!({})).load().scene;
    assert!(flat.meshes[0].normals.is_empty());
    assert_eq!(flat.interaction(0, 0, Vec2::splat(0.2), Moment::STILL).shading.z, Vec3::Z);
    let zero = Builder::triangle(&[("NORMAL", "VEC3", &[0.0; 9])], json!({})).load();
    assert_eq!(zero.scene.interaction(0, 0, Vec2::splat(0.2), Moment::STILL).shading.z, Vec3::Z);
    assert!(zero.warnings.iter().any(|p| p.pointer.ends_with("/NORMAL")));
}

#[test]
fn normals_on_the_back_are_turned_to_the_front() {
    let normals = [0.6, 0.0, -0.8, 0.6, 0.0, -0.8, 0.6, 0.0, -0.8];
    let scene = Builder::triangle(&[("NORMAL", "VEC3", &normals)], json!({})).load().scene;
    let interaction = scene.interaction(0, 0, Vec2::splat(0.2), Moment::STILL);
    assert_eq!(interaction.ng, Vec3::Z);
    assert!((interaction.shading.z - Vec3::new(-0.6, 0.0, 0.8)).length() < 1e-6);
}

#[test]
fn colours_of_three_and_four_numbers_multiply_the_base_colour() {
    let rgb = Builder::triangle(&[("COLOR_0", "VEC3", &[0.5; 9])], json!({})).load().scene;
    assert_eq!(rgb.interaction(0, 0, Vec2::splat(0.2), Moment::STILL).surface().base_color, Vec3::splat(0.5));
    let rgba = Builder::triangle(&[("COLOR_0", "VEC4", &[0.25; 12])], json!({})).load().scene;
    assert_eq!(rgba.interaction(0, 0, Vec2::splat(0.2), Moment::STILL).at.colour, Vec4::splat(0.25));
    let white = Builder::triangle(&[("COLOR_0", "VEC4", &[1.0; 12])], json!({})).load().scene;
    assert!(white.meshes[0].colours.is_empty());
}

#[test]
fn what_no_material_needs_is_not_kept() {
    let attributes: [(&str, &str, &[f32]); 3] = [
        ("TEXCOORD_0", "VEC2", &[0.0; 6]),
        ("TEXCOORD_1", "VEC2", &[0.0; 6]),
        ("TANGENT", "VEC4", &[1.0; 12]),
    ];
    let mesh = &Builder::triangle(&attributes, json!({})).load().scene.meshes[0];
    assert!(mesh.uvs[0].is_empty() && mesh.uvs[1].is_empty() && mesh.tangents.is_empty());
}

#[test]
fn default_morph_weights_are_applied() {
    let mut builder = Builder::triangle(&[], json!({}));
    let moves = builder.floats("VEC3", &[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0]);
    builder.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": moves}, {}]);
    builder.json["meshes"][0]["weights"] = json!([0.5, 0.0]);
    assert!((triangles(&builder.load().scene)[0][0].z - 1.0).abs() < 1e-6);
    builder.json["nodes"][0]["weights"] = json!([1.0, 0.0]);
    assert!((triangles(&builder.load().scene)[0][0].z - 2.0).abs() < 1e-6);
}

#[test]
fn skins_stand_in_their_rest_pose() {
    let mut builder = Builder::triangle(
        &[("WEIGHTS_0", "VEC4", &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])],
        json!({}),
    );
    let joints = builder.accessor(&[0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0], U8, "VEC4", 3);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    builder.json["nodes"][0]["skin"] = json!(0);
    // The skinned node's own place does not count.
    builder.json["nodes"][0]["translation"] = json!([100, 100, 100]);
    builder.push("nodes", json!({"translation": [0, 0, 1]}));
    builder.push("nodes", json!({"translation": [0, 0, 3]}));
    builder.push("skins", json!({"joints": [1, 2]}));
    assert!(near(&triangles(&builder.load().scene)[0], &[[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 1.0]]));
}
