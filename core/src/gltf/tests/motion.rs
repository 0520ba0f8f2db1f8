//! Animations, skins and morph targets, still and through a shutter.

use super::builder::{Builder, TRIANGLE, U8};
use crate::gltf::bundle::Bundle;
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use crate::gltf::load::{Choice, Loaded, load_as};
use crate::scene::data::SceneData;
use crate::scene::punctual::PunctualKind;
use crate::trace::moment::Moment;
use glam::{DVec3, Vec2, Vec3};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};

impl Builder {
    /// Adds an animation with one channel.
    fn animate(&mut self, node: usize, path: &str, interpolation: &str, times: &[f32], values: &[f32]) {
        let shape = match path {
            "rotation" => "VEC4",
            "weights" => "SCALAR",
            _ => "VEC3",
        };
        let (input, output) = (self.floats("SCALAR", times), self.floats(shape, values));
        self.push("animations", animation(node, path, interpolation, input, output));
    }

    fn try_load_while(&self, times: [f64; 2]) -> Result<Loaded, LoadError> {
        load_as(&Bundle::open(self.glb())?, &Limits::default(), &Choice { times, ..Choice::default() })
    }

    fn scene_at(&self, time: f64) -> SceneData {
        self.scene_while([time; 2])
    }

    fn scene_while(&self, times: [f64; 2]) -> SceneData {
        self.try_load_while(times).unwrap().scene
    }
}

fn animation(node: usize, path: &str, interpolation: &str, input: usize, output: usize) -> Value {
    json!({"samplers": [{"input": input, "output": output, "interpolation": interpolation}],
        "channels": [{"sampler": 0, "target": {"node": node, "path": path}}]})
}

/// Corners of the first triangle of an instance in metres.
fn corners(scene: &SceneData, instance: u32, moment: Moment) -> [DVec3; 3] {
    scene.corners(instance, 0, moment).map(|p| scene.normalisation.restore(p))
}

fn first_corner(builder: &Builder, time: f64) -> DVec3 {
    corners(&builder.scene_at(time), 0, Moment::STILL)[0]
}

fn assert_near(found: DVec3, expected: [f64; 3], what: impl std::fmt::Display) {
    assert!((found - DVec3::from(expected)).length() < 2e-6, "{what}: {found} instead of {expected:?}");
}

#[test]
fn translations_are_interpolated_as_the_specification_says() {
    let cubic = [9.0, 9.0, 9.0, 0.0, 5.0, 0.0, 1.0, 0.0, 0.0, -2.0, 0.0, 0.0, 4.0, 5.0, 0.0, 9.0, 9.0, 9.0];
    let plain = [0.0, 5.0, 0.0, 4.0, 5.0, 0.0];
    for (interpolation, values, expected) in [
        ("STEP", &plain[..], [(0.0, 0.0), (1.0, 0.0), (2.99, 0.0), (3.0, 4.0), (9.0, 4.0)]),
        ("LINEAR", &plain[..], [(0.0, 0.0), (1.0, 0.0), (1.5, 1.0), (3.0, 4.0), (9.0, 4.0)]),
        // Halfway: 0/2 + 4/2 + 2 s · (1 − (−2)) / 8.
        ("CUBICSPLINE", &cubic[..], [(0.0, 0.0), (1.0, 0.0), (2.0, 2.75), (3.0, 4.0), (9.0, 4.0)]),
    ] {
        let mut builder = Builder::triangle(&[], json!({}));
        builder.animate(0, "translation", interpolation, &[1.0, 3.0], values);
        for (time, x) in expected {
            assert_near(first_corner(&builder, time), [x, 5.0, 0.0], format!("{interpolation} at {time}"));
        }
    }
}

#[test]
fn rotations_go_the_shorter_way_at_constant_speed() {
    // 270° as its exporter may write it, which is −90°; and 120°, along which a chord would not be even.
    for (angle, share, expected) in [(1.5 * PI, 1.0 / 3.0, -FRAC_PI_6), (2.0 * PI / 3.0, 0.25, FRAC_PI_6)] {
        let (sin, cos) = libm::sincos(angle / 2.0);
        let mut builder = Builder::triangle(&[], json!({}));
        let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, sin as f32, cos as f32];
        builder.animate(0, "rotation", "LINEAR", &[0.0, 1.0], &turn);
        let scene = builder.scene_at(share);
        let (sin, cos) = libm::sincos(expected);
        assert_near(corners(&scene, 0, Moment::STILL)[1], [cos, sin, 0.0], angle);
    }
}

#[test]
fn normalised_integers_and_parents_count_and_other_properties_stay() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.json["nodes"][0]["scale"] = json!([2, 2, 2]);
    let parent = builder.push("nodes", json!({"children": [0], "translation": [0, 0, 7]}));
    // A right angle around z in normalised bytes; key frames of one node from two animations.
    let output = builder.accessor(&[0, 0, 90, 90], 5120, "VEC4", 1);
    builder.json["accessors"][output]["normalized"] = json!(true);
    let input = builder.floats("SCALAR", &[0.5]);
    builder.push("animations", animation(parent, "rotation", "LINEAR", input, output));
    builder.animate(0, "translation", "LINEAR", &[0.0], &[1.0, 0.0, 0.0]);
    let scene = builder.scene_at(0.25);
    let [a, b, _] = corners(&scene, 0, Moment::STILL);
    assert_near(a, [0.0, 1.0, 7.0], "first");
    assert_near(b, [0.0, 3.0, 7.0], "second");
}

#[test]
fn of_two_channels_for_the_same_the_later_counts() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.animate(0, "translation", "LINEAR", &[0.0], &[1.0, 0.0, 0.0]);
    builder.animate(0, "translation", "LINEAR", &[0.0], &[2.0, 0.0, 0.0]);
    let loaded = builder.load();
    assert_near(corners(&loaded.scene, 0, Moment::STILL)[0], [2.0, 0.0, 0.0], "later");
    assert!(loaded.warnings.iter().any(|p| p.pointer == "/animations/1/channels/0"));
}

fn morphing() -> Builder {
    let mut builder = Builder::new();
    let base = builder.floats("VEC3", &TRIANGLE);
    let up = builder.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let aside = builder.floats("VEC3", &[2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    builder.push(
        "meshes",
        json!({"weights": [0.5, 0.0], "primitives": [{"attributes": {"POSITION": base},
            "targets": [{"POSITION": up}, {"POSITION": aside}]}]}),
    );
    builder.push("nodes", json!({"mesh": 0}));
    builder
}

#[test]
fn morph_weights_come_from_the_mesh_the_node_or_the_animation() {
    let mut builder = morphing();
    assert_near(first_corner(&builder, 0.0), [0.0, 0.0, 0.5], "mesh");
    builder.json["nodes"][0]["weights"] = json!([0.0, 0.25]);
    assert_near(first_corner(&builder, 0.0), [0.5, 0.0, 0.0], "node");
    builder.animate(0, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 1.0, -1.0]);
    assert_near(first_corner(&builder, 0.25), [-0.5, 0.0, 0.25], "animation");
    let scene = builder.scene_while([0.0, 1.0]);
    let middle = corners(&scene, 0, scene.knots.moment(0.75))[0];
    assert_near(middle, [-1.5, 0.0, 0.75], "through the shutter");
}

/// A strip of width 1 along y from 0 to 2. What is below hangs on the first joint, what is above on the second, at
/// y = 1; the middle hangs on both. The second joint turns by a right angle around z in a second.
fn strip() -> Builder {
    let mut builder = Builder::new();
    let positions =
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0, 2.0, 0.0];
    let position = builder.floats("VEC3", &positions);
    let joints: Vec<u8> = [0, 1, 0, 0].repeat(6);
    let joints = builder.accessor(&joints, U8, "VEC4", 6);
    let weights: Vec<f32> = [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]
        .iter()
        .flat_map(|w| [*w, *w])
        .flat_map(|[a, b]| [a, b, 0.0, 0.0])
        .collect();
    let weights = builder.floats("VEC4", &weights);
    let indices: Vec<u8> = vec![0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5];
    let indices = builder.accessor(&indices, U8, "SCALAR", 12);
    let node = builder.primitive(&json!({"attributes":
        {"POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights}, "indices": indices}));
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let mut down = identity;
    down[13] = -1.0;
    let binds = builder.accessor(&super::builder::bytes(&[identity, down].concat()), 5126, "MAT4", 2);
    builder.push("skins", json!({"joints": [1, 2], "inverseBindMatrices": binds}));
    builder.json["nodes"][node]["skin"] = json!(0);
    // A skin's mesh does not go by its own node.
    builder.json["nodes"][node]["translation"] = json!([100, 0, 0]);
    builder.push("nodes", json!({"children": [2]}));
    builder.push("nodes", json!({"translation": [0, 1, 0]}));
    let half = libm::sqrtf(0.5);
    builder.animate(2, "rotation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half]);
    builder
}

#[test]
fn a_bent_strip_has_its_vertices_where_its_joints_take_them() {
    let at = |scene: &SceneData, vertex: usize, moment| {
        let mesh = &scene.meshes[0];
        let (triangle, corner) = (0..4)
            .flat_map(|t| (0..3).map(move |c| (t, c)))
            .find(|&(t, c)| mesh.triangles[t as usize][c] as usize == vertex)
            .unwrap();
        scene.normalisation.restore(mesh.corners(triangle, moment)[corner])
    };
    let scene = builder_scene_at_one();
    for (vertex, expected) in [
        (0, [0.0, 0.0, 0.0]),
        (1, [1.0, 0.0, 0.0]),
        // The mean of (1, 1) and of what the turn makes of it, (0, 2).
        (2, [0.0, 1.0, 0.0]),
        (3, [0.5, 1.5, 0.0]),
        (4, [-1.0, 1.0, 0.0]),
        (5, [-1.0, 2.0, 0.0]),
    ] {
        assert_near(at(&scene, vertex, Moment::STILL), expected, vertex);
    }
    let through = strip().scene_while([0.0, 1.0]);
    assert!(through.knots.count() > 4, "a right angle is not straight: {} knots", through.knots.count());
    for step in 0..40 {
        let share = step as f32 / 40.0;
        let found = at(&through, 4, through.knots.moment(share));
        let (sin, cos) = libm::sincos(f64::from(share) * FRAC_PI_2);
        // The eighth of a pixel that pieces may stray, of a radius of about √5 / 2.
        let off = (found - DVec3::new(-sin, 1.0 + cos, 0.0)).length();
        assert!(off < 1.2 / 4096.0, "{off} at {share}");
    }
}

fn builder_scene_at_one() -> SceneData {
    strip().scene_at(1.0)
}

/// A triangle that turns, goes and grows under a parent that turns; one that is morphed; the strip; a light and a camera.
fn everything() -> Builder {
    let mut builder = strip();
    let position = builder.floats("VEC3", &TRIANGLE);
    let node = builder.primitive(&json!({"attributes": {"POSITION": position}}));
    builder.animate(node, "translation", "LINEAR", &[0.2, 0.5, 2.0], &[0., 0., 0., 1., 0., 0., 1., 3., 0.]);
    builder.animate(node, "scale", "LINEAR", &[0.0, 1.0], &[1.0, 1.0, 1.0, 2.0, 1.0, 1.0]);
    let cubic = [0.0; 4].into_iter().chain([0., 0., 0., 1.]).chain([0., 0.3, 0., 0.]);
    let cubic: Vec<f32> =
        cubic.chain([0.0, 0.2, 0.0, 0.0]).chain([0., 0.2, 0., 1.0]).chain([0.0; 4]).collect();
    let parent = builder.push("nodes", json!({"children": [node], "translation": [0, 0, 2]}));
    builder.animate(parent, "rotation", "CUBICSPLINE", &[0.0, 1.0], &cubic);
    builder.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}));
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    builder.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot"}]}});
    let eye = builder.push(
        "nodes",
        json!({"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 9]}),
    );
    builder.animate(eye, "rotation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, 1.0]);
    builder
}

/// At every share of the shutter's time, what is between knots is where a file read at that very time has it.
#[test]
fn straight_pieces_stay_close_to_the_motion() {
    let builder = everything();
    let loaded = builder.try_load_while([0.0, 1.0]).unwrap();
    assert!(!loaded.warnings.iter().any(|p| p.pointer == "/animations"), "{:?}", loaded.warnings);
    let scene = loaded.scene;
    assert_eq!(scene.instances.len(), 2);
    let instance = |scene: &SceneData, strip: bool| {
        (0..2).find(|&i| (scene.meshes[scene.instances[i].mesh.index()].triangles.len() == 4) == strip)
    };
    let radius = scene.normalisation.metres(f64::from(scene.bounds.radius() as f32));
    let tolerance = 1.5 * radius / 4096.0;
    for step in 0..60 {
        let share = step as f32 / 60.0;
        let moment = scene.knots.moment(share);
        let exact = builder.scene_at(f64::from(share));
        let truth: Vec<DVec3> = (0..exact.instances.len() as u32)
            .flat_map(|i| {
                let mesh = &exact.meshes[exact.instances[i as usize].mesh.index()];
                (0..mesh.triangles.len() as u32)
                    .flat_map(|t| exact.corners(i, t, Moment::STILL))
                    .collect::<Vec<_>>()
            })
            .map(|p| exact.normalisation.restore(p))
            .collect();
        for strip in [false, true] {
            let i = instance(&scene, strip).unwrap() as u32;
            for t in 0..if strip { 4 } else { 1 } {
                for corner in scene.corners(i, t, moment) {
                    let there = scene.normalisation.restore(corner);
                    let off = truth.iter().map(|p| (*p - there).length()).fold(f64::INFINITY, f64::min);
                    assert!(off < tolerance, "{off} at {share}");
                    assert!((corner.as_dvec3().cmpge(scene.bounds.lower - 0.1)).all());
                    assert!((corner.as_dvec3().cmple(scene.bounds.upper + 0.1)).all());
                }
            }
        }
        let (stand, truth) = (scene.cameras[0].stand_at(moment), exact.cameras[0].stand());
        assert!((stand.axes[2] - truth.axes[2]).length() < 2.0 / 4096.0);
        assert!((stand.axes[0].length() - 1.0).abs() < 1e-6 && stand.axes[0].dot(stand.axes[2]).abs() < 1e-3);
        let PunctualKind::Spot { direction, .. } = scene.punctual[0].at(moment) else { panic!() };
        assert!((direction + truth.axes[2]).length() < 2.0 / 4096.0);
    }
}

#[test]
fn what_goes_straight_takes_one_piece_and_a_jump_two_knots_at_once() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.animate(0, "translation", "LINEAR", &[0.0, 4.0], &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    let scene = builder.scene_while([1.0, 3.0]);
    assert_eq!(scene.knots.count(), 2);
    for share in [0.0, 0.25, 0.999] {
        let found = corners(&scene, 0, scene.knots.moment(share))[0];
        assert_near(found, [1.0 + 2.0 * f64::from(share), 0.0, 0.0], share);
    }
    let mut builder = Builder::triangle(&[], json!({}));
    builder.animate(0, "translation", "STEP", &[0.0, 1.0], &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    let scene = builder.scene_while([0.5, 2.5]);
    assert_eq!(scene.knots.count(), 4);
    for (share, x) in [(0.0, 0.0), (0.249, 0.0), (0.25, 4.0), (0.9, 4.0)] {
        assert_near(corners(&scene, 0, scene.knots.moment(share))[0], [x, 0.0, 0.0], share);
    }
}

#[test]
fn what_does_not_move_while_the_shutter_is_open_has_no_knots() {
    let builder = everything();
    for times in [[0.3, 0.3], [2.0, 3.0]] {
        let scene = builder.scene_while(times);
        assert!(scene.knots.is_still(), "{times:?}");
        assert!((0..scene.instances.len()).all(|i| !scene.moves(i as u32)));
        assert!(scene.cameras[0].knots.is_empty() && scene.punctual[0].knots.is_empty());
    }
}

#[test]
fn of_several_places_of_a_mesh_those_that_rest_stay_instances() {
    let mut builder = Builder::triangle(&[], json!({}));
    let moves = builder.push("nodes", json!({"mesh": 0}));
    builder.animate(moves, "translation", "LINEAR", &[0.0, 1.0], &[3.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    let scene = builder.scene_while([0.0, 1.0]);
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    assert_eq!([scene.moves(0), scene.moves(1)], [false, true]);
    let half = scene.knots.moment(0.5);
    assert_near(corners(&scene, 0, half)[0], [0.0; 3], "rests");
    assert_near(corners(&scene, 1, half)[0], [3.5, 0.0, 0.0], "moves");
}

#[test]
fn what_shrinks_to_nothing_or_turns_inside_out_is_kept() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.animate(0, "scale", "LINEAR", &[0.0, 1.0], &[1.0, 1.0, 1.0, -1.0, 0.0, 1.0]);
    let scene = builder.scene_while([0.0, 1.0]);
    assert_near(corners(&scene, 0, scene.knots.moment(0.25))[1], [0.5, 0.0, 0.0], "halfway to nothing");
    let interaction = scene.interaction(0, 0, Vec2::splat(0.3), scene.knots.moment(0.25));
    assert_eq!(interaction.ng, Vec3::Z);
}

#[test]
fn normals_turn_with_what_moves() {
    let normals = [0.6, 0.0, 0.8, 0.6, 0.0, 0.8, 0.6, 0.0, 0.8];
    let mut builder = Builder::triangle(&[("NORMAL", "VEC3", &normals)], json!({}));
    let half = libm::sqrtf(0.5);
    builder.animate(0, "rotation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, half, 0.0, 0.0, half]);
    let scene = builder.scene_while([0.0, 1.0]);
    for step in 0..20 {
        let share = step as f32 / 20.0;
        let at = scene.interaction(0, 0, Vec2::splat(0.3), scene.knots.moment(share));
        let (sin, cos) = libm::sincosf(share * std::f32::consts::FRAC_PI_2);
        assert!((at.ng - Vec3::new(0.0, -sin, cos)).length() < 0.02, "{}", at.ng);
        assert!((at.shading.z - Vec3::new(0.6, -0.8 * sin, 0.8 * cos)).length() < 0.02);
        assert!((at.ng.length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn broken_animations_are_named() {
    type Breaks = fn(&mut Builder);
    let cases: [(Breaks, &str, &str); 12] = [
        (
            |b| b.animate(0, "scale", "LINEAR", &[1.0, 1.0], &[1.0; 6]),
            "/animations/0/samplers/0/input",
            "not later",
        ),
        (
            |b| b.animate(0, "scale", "LINEAR", &[f32::NAN], &[1.0; 3]),
            "/animations/0/samplers/0/input",
            "finite",
        ),
        (|b| b.animate(0, "scale", "LINEAR", &[], &[]), "/animations/0/samplers/0/input", "no key frames"),
        (
            |b| b.animate(0, "scale", "LINEAR", &[0.0, 1.0], &[1.0; 3]),
            "/animations/0/samplers/0/output",
            "need 2",
        ),
        (|b| b.animate(0, "scale", "CUBICSPLINE", &[0.0, 1.0], &[1.0; 6]), "samplers/0/output", "need 6"),
        (|b| b.animate(0, "scale", "LINEAR", &[0.0], &[1.0, f32::NAN, 1.0]), "samplers/0/output", "finite"),
        (|b| b.animate(0, "rotation", "LINEAR", &[0.0], &[0.0; 4]), "samplers/0/output", "without length"),
        (|b| b.animate(0, "scale", "SPLINE", &[0.0], &[1.0; 3]), "/animations/0/samplers/0", "CUBICSPLINE"),
        (
            |b| b.animate(7, "scale", "LINEAR", &[0.0], &[1.0; 3]),
            "/animations/0/channels/0/target/node",
            "only 1",
        ),
        (
            |b| {
                let input = b.floats("VEC3", &[0.0; 3]);
                b.push("animations", animation(0, "scale", "LINEAR", input, input));
            },
            "samplers/0/input",
            "scalar floats",
        ),
        (
            |b| {
                let input = b.floats("SCALAR", &[0.0]);
                b.push("animations", animation(0, "scale", "LINEAR", input, input));
            },
            "samplers/0/output",
            "3 floats",
        ),
        (
            |b| {
                let input = b.floats("SCALAR", &[0.0]);
                b.push("animations", animation(0, "scale", "LINEAR", input, 99));
            },
            "samplers/0/output",
            "refers to 99",
        ),
    ];
    for (breaks, pointer, says) in cases {
        let mut builder = Builder::triangle(&[], json!({}));
        breaks(&mut builder);
        let error = builder.refusal();
        assert!(error.contains(pointer) && error.contains(says), "{error}");
    }
}

#[test]
fn channels_that_drive_nothing_known_are_told_of() {
    let mut builder = Builder::triangle(&[], json!({}));
    builder.animate(0, "weights", "LINEAR", &[0.0], &[1.0]);
    builder.animate(0, "pointer", "LINEAR", &[0.0], &[1.0; 3]);
    builder.animate(0, "scale", "LINEAR", &[0.0], &[1.0; 3]);
    builder.json["animations"][2]["channels"][0]["target"] = json!({"path": "scale"});
    builder.push("nodes", json!({"matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1], "mesh": 0}));
    builder.animate(1, "translation", "LINEAR", &[0.0], &[5.0, 0.0, 0.0]);
    let loaded = builder.load();
    for pointer in ["/animations/0/channels/0/target", "/animations/1/channels/0/target/path"] {
        assert!(loaded.warnings.iter().any(|p| p.pointer == pointer), "{pointer}");
    }
    for animation in [2, 3] {
        let pointer = format!("/animations/{animation}/channels/0/target");
        assert!(loaded.warnings.iter().any(|p| p.pointer == pointer), "{pointer}");
    }
    assert_near(corners(&loaded.scene, 1, Moment::STILL)[1], [7.0, 0.0, 0.0], "taken apart");
}

#[test]
fn a_joint_that_is_not_there_is_named() {
    let mut builder = strip();
    builder.json["skins"][0]["joints"] = json!([1]);
    assert!(builder.refusal().contains("hangs on joint 1"));
    let mut builder = strip();
    builder.json["scenes"] = json!([{"nodes": [0]}]);
    let error = builder.refusal();
    assert!(error.contains("/skins/0/joints/0") && error.contains("not part of the scene"), "{error}");
}

#[test]
fn morph_targets_beyond_the_limit_are_named() {
    let limits = Limits { morphed_vertices: 2, ..Limits::default() };
    let error = load_as(&Bundle::open(morphing().glb()).unwrap(), &limits, &Choice::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("/meshes/0/primitives/0: 3 vertices of morph targets"), "{error}");
}

#[test]
fn a_motion_too_wild_to_follow_is_told_of() {
    let mut builder = Builder::triangle(&[], json!({}));
    let times: Vec<f32> = (0..400).map(|i| i as f32).collect();
    let values: Vec<f32> = (0..400).flat_map(|i| [(i % 2) as f32, 0.0, 0.0]).collect();
    builder.animate(0, "translation", "LINEAR", &times, &values);
    let loaded = builder.try_load_while([0.0, 399.0]).unwrap();
    assert!(loaded.scene.knots.count() <= 65);
    assert!(loaded.warnings.iter().any(|p| p.detail.contains("straight pieces and strays")));
}
