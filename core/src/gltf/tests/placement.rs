//! Nodes, instances, normalisation, cameras and lights.

use super::builder::{Builder, TRIANGLE};
use crate::scene::camera::Projection;
use crate::scene::data::SceneData;
use crate::scene::instance::Placement;
use crate::scene::punctual::PunctualKind;
use crate::trace::moment::Moment;
use glam::{DVec3, Vec2, Vec3};
use serde_json::json;

#[test]
fn a_mesh_at_one_place_is_gathered_and_at_several_instanced() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.json["nodes"][0]["name"] = json!("first");
    let second = builder.floats("VEC3", &TRIANGLE);
    let node = builder.primitive(&json!({"attributes": {"POSITION": second}}));
    builder.json["nodes"][node]["name"] = json!("second");
    let gathered = builder.load().scene;
    assert_eq!((gathered.meshes.len(), gathered.instances.len()), (1, 1));
    assert!(matches!(gathered.instances[0].placement, Placement::World));
    assert_eq!((gathered.node_name(0, 0), gathered.node_name(0, 1)), ("first", "second"));

    builder.push("nodes", json!({"mesh": 0, "name": "third", "translation": [5, 0, 0], "scale": [2, 3, 4]}));
    let loaded = builder.load();
    let scene = loaded.scene;
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 3));
    assert_eq!((loaded.report.triangles, loaded.report.placed_triangles, loaded.report.instances), (2, 3, 3));
    let third = (0..3).find(|&i| scene.node_name(i, 0) == "third").unwrap();
    let corners = scene.corners(third, 0, Moment::STILL).map(|p| scene.normalisation.restore(p));
    for (corner, expected) in corners.iter().zip([[5.0, 0.0, 0.0], [7.0, 0.0, 0.0], [5.0, 3.0, 0.0]]) {
        assert!((*corner - DVec3::from(expected)).length() < 1e-5, "{corners:?}");
    }
}

/// Front normals and bitangent signs of a mirrored triangle, gathered or as an instance.
#[test]
fn mirroring_keeps_the_front_where_the_file_has_it() {
    for instanced in [false, true] {
        let normals = [0.6, 0.0, 0.8, 0.6, 0.0, 0.8, 0.6, 0.0, 0.8];
        let mut builder = Builder::triangle(&[("NORMAL", "VEC3", &normals)], json!({}));
        builder.json["nodes"][0]["scale"] = json!([-1, 2, 1]);
        if instanced {
            builder.push("nodes", json!({"mesh": 0, "translation": [9, 9, 9]}));
        }
        let scene = builder.load().scene;
        let interaction = scene.interaction(0, 0, Vec2::splat(0.25), Moment::STILL);
        assert_eq!(interaction.ng, Vec3::Z, "{instanced}");
        assert!((interaction.shading.z - Vec3::new(-0.6, 0.0, 0.8)).length() < 1e-6, "{instanced}");
        let [a, b, c] = scene.corners(0, 0, Moment::STILL);
        assert!((b - a).cross(c - a).z > 0.0, "{instanced}");
    }
}

#[test]
fn uneven_scale_bends_normals_as_the_surface_bends() {
    for instanced in [false, true] {
        // A slope of 45° stretched to double its height: its normal is (−2, 1) / √5.
        let mut builder = Builder::new();
        let position = builder.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 1.0, 0.0]);
        let s = 0.5_f32.sqrt();
        let normal = builder.floats("VEC3", &[-s, s, 0.0, -s, s, 0.0, -s, s, 0.0]);
        let node = builder.primitive(&json!({"attributes": {"POSITION": position, "NORMAL": normal}}));
        builder.json["nodes"][node]["scale"] = json!([1, 2, 1]);
        if instanced {
            builder.push("nodes", json!({"mesh": 0}));
        }
        let scene = builder.load().scene;
        let interaction = scene.interaction(0, 0, Vec2::splat(0.25), Moment::STILL);
        let expected = Vec3::new(-2.0, 1.0, 0.0).normalize();
        let ng = interaction.ng * interaction.ng.dot(expected).signum();
        assert!((ng - expected).length() < 1e-6);
        assert!((interaction.shading.z.dot(expected).abs() - 1.0).abs() < 1e-6, "{instanced}");
    }
}

/// Everything whose bits must not depend on a power-of-two scale of the file.
fn bits(scene: &SceneData) -> Vec<u32> {
    let mut bits = Vec::new();
    for mesh in &scene.meshes {
        bits.extend(mesh.positions.iter().flat_map(glam::Vec3::to_array).map(f32::to_bits));
        bits.extend(mesh.normals.iter().flat_map(glam::Vec3::to_array).map(f32::to_bits));
    }
    for instance in &scene.instances {
        bits.extend(instance.placement.to_world().to_cols_array().map(f32::to_bits));
        bits.extend(instance.placement.normal(Vec3::new(0.1, 0.2, 0.3)).to_array().map(f32::to_bits));
    }
    for camera in &scene.cameras {
        let Projection::Orthographic { half_width, .. } = camera.projection else { continue };
        bits.push(half_width.to_bits());
        bits.extend(camera.position.to_array().map(f32::to_bits));
        bits.extend(camera.up.to_array().map(f32::to_bits));
    }
    bits
}

#[test]
fn a_power_of_two_changes_no_bit() {
    let build = |exponent: i32| {
        let s = libm::ldexp(1.0, exponent);
        let mut builder = Builder::new();
        let positions: Vec<f32> = (0..90).map(|i| (i as f32 * 0.7131).sin_like() * s as f32).collect();
        let position = builder.floats("VEC3", &positions);
        let normals: Vec<f32> = (0..90).map(|i| (i as f32 * 0.319).sin_like()).collect();
        let normal = builder.floats("VEC3", &normals);
        builder.push(
            "meshes",
            json!({"primitives": [{"attributes": {"POSITION": position, "NORMAL": normal}}]}),
        );
        let more: Vec<f32> = positions.iter().map(|p| p * 3.25).collect();
        let position = builder.floats("VEC3", &more);
        builder.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}));
        builder.push(
            "cameras",
            json!({"type": "orthographic",
            "orthographic": {"xmag": 3.0 * s, "ymag": 2.0 * s, "znear": 0.0, "zfar": 1.0}}),
        );
        let turn = [0.1, 0.2, 0.3, 0.927_361_849_549_570_4];
        builder.push("nodes", json!({"mesh": 0, "translation": [0.7 * s, 0.1 * s, 3.3 * s], "rotation": turn, "scale": [1, 2, 0.5]}));
        builder.push("nodes", json!({"mesh": 0, "translation": [-7.1 * s, 0.0, 0.3 * s], "rotation": turn}));
        builder
            .push("nodes", json!({"mesh": 1, "translation": [11.3 * s, 5.0 * s, 0.1 * s], "rotation": turn}));
        builder.push(
            "nodes",
            json!({"camera": 0, "translation": [1.9 * s, 0.3 * s, 9.0 * s], "rotation": turn}),
        );
        builder.load().scene
    };
    let base = build(0);
    assert_eq!((base.meshes.len(), base.instances.len()), (2, 3));
    for exponent in [-40, -20, -1, 1, 20, 40] {
        let scaled = build(exponent);
        assert_eq!(scaled.normalisation.exponent, base.normalisation.exponent - exponent);
        assert!(bits(&scaled) == bits(&base), "2^{exponent}");
    }
}

/// Numbers without a pattern, from exact arithmetic only.
trait SinLike {
    fn sin_like(self) -> f32;
}

impl SinLike for f32 {
    fn sin_like(self) -> f32 {
        (self * 12.9898 + 0.25).fract() * 2.0 - 1.0
    }
}

#[test]
fn far_from_the_origin_nothing_is_lost() {
    let build = |offset: f64| {
        let mut builder = Builder::triangle(&[], json!({}));
        builder.json["nodes"][0]["translation"] = json!([offset, 0, -offset]);
        builder.load().scene
    };
    // Offsets and sizes are dyadic, so that double precision holds them exactly.
    assert_eq!(build(0.0).meshes[0].positions, build(1_048_576.0).meshes[0].positions);
}

#[test]
fn cameras_follow_their_nodes() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1, "aspectRatio": 1.5}}),
    );
    let s = 0.5_f64.sqrt();
    builder.push("nodes", json!({"camera": 0, "name": "eye", "translation": [0, 0, 8], "rotation": [0, s, 0, s], "scale": [3, 3, 3]}));
    builder.push("nodes", json!({"camera": 0, "scale": [0, 0, 0]}));
    let loaded = builder.load();
    assert_eq!(loaded.scene.cameras.len(), 1);
    let camera = &loaded.scene.cameras[0];
    assert_eq!((camera.name.as_str(), camera.aspect()), ("eye", Some(1.5)));
    assert!((camera.backward - Vec3::X).length() < 1e-6 && (camera.right + Vec3::Z).length() < 1e-6);
    let restored = loaded.scene.normalisation.restore(camera.position);
    assert!((restored - DVec3::new(0.0, 0.0, 8.0)).length() < 1e-5);
    assert!(loaded.warnings.iter().any(|p| p.pointer == "/nodes/2"));
}

#[test]
fn lights_keep_their_irradiance() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    builder.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 8, "color": [1, 0.5, 0]},
        {"type": "spot", "intensity": 2, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 3, "name": "sun"}
    ]}});
    for light in 0..3 {
        builder.push(
            "nodes",
            json!({"translation": [0, 0, 2], "scale": [0.5, 0.5, 0.5],
            "extensions": {"KHR_lights_punctual": {"light": light}}}),
        );
    }
    let scene = builder.load().scene;
    let PunctualKind::Point { position, intensity } = scene.punctual[0].kind else { panic!() };
    // 8 W/sr at 2 m is 2 W/m², whatever the unit of length.
    let origin = scene.normalisation.point(DVec3::ZERO);
    let irradiance = intensity / (position - origin).length_squared();
    assert!((irradiance - Vec3::new(2.0, 1.0, 0.0)).length() < 1e-5, "{irradiance}");
    let PunctualKind::Spot { direction, inner_cos, outer_cos, .. } = scene.punctual[1].kind else { panic!() };
    assert_eq!(direction, Vec3::NEG_Z);
    assert!((inner_cos - 0.968_912_4).abs() < 1e-6 && (outer_cos - 0.877_582_55).abs() < 1e-6);
    assert_eq!(scene.punctual[2].name, "sun");
    assert_eq!(
        scene.punctual[2].kind,
        PunctualKind::Directional { direction: Vec3::NEG_Z, irradiance: Vec3::splat(3.0) }
    );
}

#[test]
fn a_flattened_node_leaves_nothing_but_a_warning() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.json["nodes"][0]["scale"] = json!([0, 0, 0]);
    builder.push("nodes", json!({"mesh": 0}));
    let loaded = builder.load();
    assert_eq!((loaded.report.placed_triangles, loaded.report.dropped.instances), (1, 1));
    assert!(loaded.warnings.iter().any(|p| p.pointer == "/nodes/0"));
}

#[test]
fn errors_of_points_bound_what_moving_them_rounds() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.push("nodes", json!({"mesh": 0, "translation": [1000.1, -77.7, 3.3], "rotation": [0.1, 0.2, 0.3, 0.9], "scale": [1.1, 0.3, 2.7]}));
    let scene = builder.load().scene;
    for instance in 0..2 {
        let corners = scene.corners(instance, 0, Moment::STILL).map(Vec3::as_dvec3);
        for (u, v) in [(0.1, 0.2), (0.9, 0.05), (0.0, 0.0), (0.333, 0.334)] {
            let interaction = scene.interaction(instance, 0, Vec2::new(u, v), Moment::STILL);
            let (u, v) = (f64::from(u), f64::from(v));
            let exact = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
            let off = (interaction.position.as_dvec3() - exact).abs();
            // The corners were moved with an error of their own, of the same size.
            assert!(
                off.max_element() < f64::from(interaction.error()) * 2.0,
                "{off} {}",
                interaction.error()
            );
            assert!(interaction.error() < 0.1);
        }
    }
}

#[test]
fn a_mesh_stands_where_its_node_is_instanced() {
    let mut builder = Builder::triangle(&[], json!({}));
    let quarter = std::f32::consts::FRAC_1_SQRT_2;
    let translation = builder.floats("VEC3", &[0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 20.0, 0.0]);
    let rotation =
        builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, quarter, quarter, 0.0, 0.0, 0.0, 0.0]);
    let scale = builder.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 3.0, 1.0]);
    builder.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}));
    builder.json["nodes"][0] = json!({"mesh": 0, "camera": 0, "translation": [1.0, 0.0, 0.0],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes":
            {"TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale}}}});
    let loaded = builder.load();
    assert_eq!((loaded.report.instances, loaded.report.triangles, loaded.report.cameras), (3, 1, 1));
    let corners =
        |i| loaded.scene.corners(i, 0, Moment::STILL).map(|p| loaded.scene.normalisation.restore(p));
    for (i, expected) in [
        [[1.0, 0.0], [2.0, 0.0], [1.0, 1.0]],
        // A quarter turn, twice as large: x becomes y, y becomes −x.
        [[11.0, 0.0], [11.0, 2.0], [9.0, 0.0]],
        [[1.0, 20.0], [2.0, 20.0], [1.0, 23.0]],
    ]
    .into_iter()
    .enumerate()
    {
        for (corner, [x, y]) in corners(i as u32).into_iter().zip(expected) {
            assert!((corner - DVec3::new(x, y, 0.0)).length() < 1e-5, "{i}: {corner}");
        }
    }
    builder.json["accessors"][scale]["count"] = json!(2);
    assert!(builder.refusal().contains("as many instances"));
    builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({});
    assert!(builder.refusal().contains("how many instances"));
}
