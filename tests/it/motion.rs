//! Motion through a shutter, where its picture has a closed form.

use glam::Vec3;
use ovtigre_core::settings::{Settings, Shutter};
use ovtigre_tests::{
    glb::Glb,
    picture::{Rendered, in_environment, rendered, settings},
    scenes::{cuboid, flipped, floor, furnace, lambert, mirror, over_floor, quad},
};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// The shutter is open for the first second.
fn open(mut settings: Settings) -> Settings {
    settings.shutter = Shutter { open: 0.0, close: 1.0 };
    settings
}

/// A node that goes straight from one place to another in a second.
fn going(glb: &mut Glb, node: usize, from: Vec3, to: Vec3) {
    glb.animate(node, "translation", "LINEAR", &[0.0, 1.0], &[from.to_array(), to.to_array()].concat());
}

fn add(glb: &mut Glb, material: Value, (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> usize {
    let material = glb.material(material);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.place(mesh)
}

/// An upright square of side 2 `half` in the plane z = 0, its front +z.
fn square(half: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner = |x: f32, y: f32| Vec3::new(x * half, y * half, 0.0);
    quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
}

/// Asserts that each pixel's red is what `truth` says of its column and row: within 5 standard errors, which are at most
/// `power`, and 1e-5 for rounding.
fn assert_pixels(rendered: &Rendered, power: f64, truth: impl Fn(u32, u32) -> f64, what: &str) {
    let picture = rendered.picture();
    let errors = &picture.errors[0];
    for (i, (mean, error)) in picture.planes[0].iter().zip(errors).enumerate() {
        let (x, y) = (i as u32 % picture.size.width, i as u32 / picture.size.width);
        let (mean, error, truth) = (f64::from(mean[0]), f64::from(error[0]), truth(x, y));
        assert!(error <= power, "{what}: the error {error} at {x}, {y} is too large to find a bias");
        let off = (mean - truth).abs();
        assert!(off <= 5.0 * error + 1e-5, "{what}: {mean} ± {error} at {x}, {y} instead of {truth}");
    }
    assert_eq!(rendered.invalid(), 0, "{what}: samples were dropped");
}

/// A glowing half plane x < e, whose edge e goes from −4 to 4 over a picture 16 pixels wide that shows −8 to 8: an x in
/// between is lit while e > x.
fn edge(deforms: bool) -> Vec<u8> {
    let mut glb = Glb::new();
    let node = add(&mut glb, lambert(0.0, 2.0), square(100.0));
    let (from, to) = (Vec3::new(-104.0, 0.0, 0.0), Vec3::new(-96.0, 0.0, 0.0));
    if deforms {
        let targets: Vec<f32> = [to - from; 4].iter().flat_map(Vec3::to_array).collect();
        glb.morph(node, &targets);
        glb.document()["nodes"][node]["translation"] = json!(from.to_array());
        glb.animate(node, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    } else {
        going(&mut glb, node, from, to);
    }
    glb.orthographic(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 16.0, 2.0);
    glb.finish()
}

#[test]
fn a_moving_edge_is_a_linear_ramp() {
    for deforms in [false, true] {
        let picture = rendered(&edge(deforms), &open(settings(16, 2, 16)), 256);
        let truth = |x: u32, _| 2.0 * ((12.0 - (f64::from(x) + 0.5)) / 8.0).clamp(0.0, 1.0);
        assert_pixels(&picture, 0.02, truth, if deforms { "morphed" } else { "moved" });
    }
}

#[test]
fn a_shutter_that_does_not_stay_open_sees_one_moment() {
    let mut settings = settings(16, 2, 16);
    settings.shutter = Shutter { open: 0.25, close: 0.25 };
    // The edge is at −2.
    let picture = rendered(&edge(false), &settings, 4);
    assert_pixels(&picture, 1e-6, |x, _| if x < 6 { 2.0 } else { 0.0 }, "still");
}

#[test]
fn a_jump_divides_the_time() {
    let mut glb = Glb::new();
    let node = add(&mut glb, lambert(0.0, 2.0), square(0.5));
    glb.animate(node, "translation", "STEP", &[0.0, 0.3], &[-1.5, 0.0, 0.0, 0.5, 0.0, 0.0]);
    glb.orthographic(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 4.0, 1.0);
    let picture = rendered(&glb.finish(), &open(settings(4, 1, 16)), 256);
    assert_pixels(&picture, 0.01, |x, _| [0.6, 0.0, 1.4, 0.0][x as usize], "jump");
}

#[test]
fn what_is_blurred_keeps_its_light() {
    // A bright square, turning and going: its picture's mean is its area.
    let mut glb = Glb::new();
    let node = add(&mut glb, lambert(0.0, 8.0), square(0.5));
    going(&mut glb, node, Vec3::new(-0.8, 0.3, 0.0), Vec3::new(0.7, -0.2, 0.0));
    let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.8, 0.6];
    glb.animate(node, "rotation", "LINEAR", &[0.0, 1.0], &turn);
    glb.orthographic(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 4.0, 4.0);
    // Pieces may stray by 1/4096 of the scene's radius of about 1.4, which is 5e-4 of the square's own. Over a piece the
    // mean of that is two thirds, and areas shrink twice as much as lengths: 6e-4.
    rendered(&glb.finish(), &open(settings(16, 16, 16)), 1024).assert_mean(8.0 / 16.0, 0.001, "blur");
}

/// A lamp, a floor, a mirror and a matt block, seen by a camera; the world moves, or the camera the other way.
fn carried(camera: bool) -> Vec<u8> {
    let mut glb = Glb::new();
    let by = Vec3::new(0.6, 0.2, 0.4);
    add(&mut glb, lambert(0.5, 0.0), floor(0.0, 6.0, 0.0, 0.0));
    add(&mut glb, mirror(), cuboid(Vec3::new(-1.2, 0.01, -1.0), Vec3::new(-0.4, 1.0, 0.0)));
    add(&mut glb, lambert(0.8, 0.0), cuboid(Vec3::new(0.3, 0.01, -0.5), Vec3::new(0.9, 0.6, 0.3)));
    add(&mut glb, lambert(0.0, 5.0), flipped(floor(2.5, 1.0, 0.0, 0.0)));
    if camera {
        glb.perspective(Vec3::new(0.5, 2.0, 6.0), Vec3::new(0.0, 0.5, 0.0), 30.0);
        let eye = glb.carry(&[4]);
        going(&mut glb, eye, Vec3::ZERO, -by);
    } else {
        let world = glb.carry(&[0, 1, 2, 3]);
        going(&mut glb, world, Vec3::ZERO, by);
        glb.perspective(Vec3::new(0.5, 2.0, 6.0), Vec3::new(0.0, 0.5, 0.0), 30.0);
    }
    glb.finish()
}

#[test]
fn a_moving_camera_sees_what_a_moving_world_shows() {
    let [world, camera] = [false, true].map(|c| rendered(&carried(c), &open(settings(12, 9, 16)), 64));
    let (world, camera) = (world.picture(), camera.picture());
    let errors = [&world, &camera].map(|p| p.errors[0].clone());
    let (mut off, mut light) = (0.0, 0.0);
    let pixels = world.planes[0].iter().zip(&camera.planes[0]).zip(errors[0].iter().zip(&errors[1]));
    for (i, ((a, b), (of_a, of_b))) in pixels.enumerate() {
        let (a, b) = (f64::from(a[0]), f64::from(b[0]));
        let error = f64::from(of_a[0]).hypot(f64::from(of_b[0]));
        // Errors are themselves estimates with 15 degrees of freedom, and close to the same random numbers were used.
        assert!((a - b).abs() <= 5.0 * error + 1e-4, "{a} and {b} ± {error} in pixel {i}");
        off += error;
        light += a;
    }
    assert!(off < 0.2 * light, "the errors are too large to see a difference: {off} of {light}");
}

#[test]
fn a_moving_point_light_gives_the_mean_of_its_irradiance() {
    let (from, to) = (Vec3::new(-1.0, 0.5, 0.3), Vec3::new(2.0, 1.5, 0.3));
    let glb = over_floor(0.5, |glb| {
        let node = glb.light(json!({"type": "point", "intensity": 3.0}), json!({}));
        going(glb, node, from, to);
    });
    // E = I cos θ / d², at the origin; midpoints of 4096 moments.
    let irradiance = |i: u32| {
        let p = from.as_dvec3().lerp(to.as_dvec3(), (f64::from(i) + 0.5) / 4096.0);
        3.0 * p.y / p.length().powi(3)
    };
    let truth = 0.5 / PI * (0..4096).map(irradiance).sum::<f64>() / 4096.0;
    rendered(&glb, &open(settings(4, 4, 16)), 256).assert_mean(truth, 0.002, "point");
}

#[test]
fn a_turning_spot_gives_the_share_of_time_it_shines() {
    // Straight above the origin, full within 30° of its axis and dark beyond 30.001°, turning from −90° to 90°: it
    // shines on the origin a third of the time.
    let glb = over_floor(0.5, |glb| {
        let inner = 30.0_f64.to_radians();
        let light = json!({"type": "spot", "intensity": 4.0,
            "spot": {"innerConeAngle": inner, "outerConeAngle": inner + 1e-5}});
        let node = glb.light(light, json!({"translation": [0, 2, 0]}));
        // Down is a quarter turn around −x; then from one side to the other around z.
        let s = 0.5_f32.sqrt();
        let at = |angle: f32| {
            let (sin, cos) = (0.5 * angle).sin_cos();
            [-s * cos, -s * sin, s * sin, s * cos]
        };
        let turns = [-90.0_f32, 0.0, 90.0].map(|degrees| at(degrees.to_radians()));
        glb.animate(node, "rotation", "LINEAR", &[0.0, 0.5, 1.0], turns.as_flattened());
    });
    let truth = 0.5 / PI * 4.0 / 4.0 / 3.0;
    rendered(&glb, &open(settings(4, 4, 16)), 256).assert_mean(truth, 0.005, "spot");
}

/// Lights that move and grow: next events and sampled directions see them at the same moment, so a white floor between
/// them and a closed room keep their light.
#[test]
fn a_closed_room_with_something_moving_has_the_radiance_of_its_neumann_series() {
    for reflectance in [0.3_f32, 0.8] {
        let mut glb = Glb::new();
        let room = add(&mut glb, lambert(reflectance, 1.5), flipped(cuboid(Vec3::splat(-1.0), Vec3::ONE)));
        let block = cuboid(Vec3::splat(-0.2), Vec3::splat(0.2));
        let moves = add(&mut glb, lambert(reflectance, 1.5), block.clone());
        going(&mut glb, moves, Vec3::new(-0.6, -0.5, -0.7), Vec3::new(0.5, 0.1, -0.6));
        let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8];
        glb.animate(moves, "rotation", "LINEAR", &[0.0, 1.0], &turn);
        let swells = add(&mut glb, lambert(reflectance, 1.5), block);
        let out: Vec<f32> =
            cuboid(Vec3::splat(-0.1), Vec3::splat(0.3)).0.iter().flat_map(Vec3::to_array).collect();
        glb.morph(swells, &out);
        glb.document()["nodes"][swells]["translation"] = json!([0.6, -0.6, -0.6]);
        glb.animate(swells, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
        glb.perspective(Vec3::new(0.3, -0.2, 0.9), Vec3::new(0.0, -0.2, -0.7), 70.0);
        assert_eq!(room, 0);
        let truth = 1.5 / (1.0 - f64::from(reflectance));
        let picture = rendered(&glb.finish(), &open(settings(8, 8, 16)), 128);
        picture.assert_mean(truth, 0.003, &format!("reflectance {reflectance}"));
    }
}

#[test]
fn a_white_body_that_moves_cannot_be_seen_in_a_uniform_environment() {
    let mut glb = Glb::new();
    let body = add(&mut glb, lambert(1.0, 0.0), ovtigre_tests::scenes::sphere(Vec3::ZERO, 1.0, 16));
    going(&mut glb, body, Vec3::new(-0.5, 0.0, 0.0), Vec3::new(0.5, 0.3, 0.0));
    glb.perspective(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 35.0);
    let picture = rendered(&glb.finish(), &open(in_environment(settings(16, 16, 16), 0.7)), 16);
    picture.assert_mean(0.7, 0.002, "moving");
}

/// A scene in which nothing moves does not know that the shutter was open: the same bits.
#[test]
fn a_still_scene_does_not_know_the_shutter() {
    let glb = furnace(0.5, 1.5);
    let still = rendered(&glb, &settings(8, 8, 2), 16).picture();
    let through = rendered(&glb, &open(settings(8, 8, 2)), 16).picture();
    assert_eq!(still.planes, through.planes);
}
