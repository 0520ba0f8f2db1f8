//! What extensions say, in pictures.

use glam::Vec3;
use ovtigre_core::settings::{Method, Settings};
use ovtigre_tests::{
    glb::Glb,
    picture::{in_environment, rendered, settings},
    scenes::{flipped, mirror, quad},
    stage::room,
};
use serde_json::{Value, json};

fn unlit(colour: [f32; 3]) -> Value {
    let [r, g, b] = colour;
    json!({"pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0]}, "extensions": {"KHR_materials_unlit": {}}})
}

/// A square of side 2 that faces +z.
fn card(z: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |x: f32, y: f32| Vec3::new(x, y, z);
    quad([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)])
}

const COLOUR: [f32; 3] = [0.25, 0.5, 1.0];

const METHODS: [Method; 4] = [Method::Path, Method::Light, Method::Bidirectional, Method::Photon];

fn pixel(glb: &[u8], settings: &Settings, at: usize) -> [f32; 3] {
    rendered(glb, settings, 4).picture().planes[0][at]
}

#[test]
fn all_methods_show_what_is_unlit_as_it_is() {
    let glb = room(10.0, |glb| {
        let (positions, triangles) = card(0.4);
        glb.body(
            unlit(COLOUR),
            (positions.iter().map(|p| *p * Vec3::new(0.3, 0.3, 1.0)).collect(), triangles),
        )
    });
    let size = settings(8, 8, 2);
    for method in METHODS.into_iter().chain([Method::Radiosity]) {
        let seen = pixel(&glb, &Settings { method, ..size.clone() }, 8 * 3 + 4);
        assert_eq!(seen, COLOUR, "{method:?}");
    }
}

/// Beside a mirror at 45°, and behind a pane of clear glass.
#[test]
fn mirrors_and_panes_show_what_is_unlit() {
    let mut glb = Glb::new();
    let at = Vec3::new;
    glb.body(mirror(), quad([at(-1., -1., 1.), at(1., -1., -1.), at(1., 1., -1.), at(-1., 1., 1.)]));
    glb.body(unlit(COLOUR), quad([at(5., -9., 9.), at(5., -9., -9.), at(5., 9., -9.), at(5., 9., 9.)]));
    glb.orthographic(at(0.0, 0.0, 5.0), Vec3::ZERO, 1.0, 1.0);
    let glb = glb.finish();
    let dark = in_environment(settings(2, 2, 2), 0.0);
    for method in METHODS {
        let seen = pixel(&glb, &Settings { method, ..dark.clone() }, 0);
        assert!((0..3).all(|c| (seen[c] - COLOUR[c]).abs() < 1e-5), "{method:?}: {seen:?}");
    }
    let mut glb = Glb::new();
    glb.body(unlit(COLOUR), card(-1.0));
    let pane = json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.0}}});
    glb.body(pane, card(1.0));
    glb.orthographic(at(0.0, 0.0, 5.0), Vec3::ZERO, 1.0, 1.0);
    let glb = glb.finish();
    // A sheet of index 1.5 lets (1 − R) / (1 + R) pass, R = 0.04.
    let truth = f64::from(COLOUR[1]) * 0.96 / 1.04;
    for method in METHODS {
        let picture = rendered(&glb, &Settings { method, ..dark.clone() }, 256).picture();
        let seen = picture.planes[0].iter().map(|p| f64::from(p[1])).sum::<f64>() / 4.0;
        // Reflected or not, with probability 0.077: 2048 samples know the mean to 0.6 %.
        assert!((seen / truth - 1.0).abs() < 0.024, "{method:?}: {seen}, not {truth}");
    }
}

#[test]
fn what_is_unlit_casts_no_light_and_blocks_it() {
    let with = |material: Value| {
        room(10.0, |glb| {
            let (positions, triangles) = card(0.4);
            glb.body(material, (positions.iter().map(|p| *p * Vec3::new(0.3, 0.3, 1.0)).collect(), triangles))
        })
    };
    let black = json!({"pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}}});
    let size = settings(16, 16, 2);
    let shown = rendered(&with(unlit(COLOUR)), &size, 8).picture();
    let dark = rendered(&with(black), &size, 8).picture();
    let mut covered = 0;
    for (shown, dark) in shown.planes[0].iter().zip(&dark.planes[0]) {
        if *dark == [0.0; 3] {
            covered += 1;
            assert_eq!(*shown, COLOUR);
        } else if shown != dark {
            // At its edge: light of what is behind, and its own.
            assert!(
                (0..3).all(|c| shown[c] >= dark[c] && shown[c] <= dark[c] + COLOUR[c]),
                "{shown:?} {dark:?}"
            );
        }
    }
    assert!(covered > 4, "{covered}");
}

#[test]
fn back_to_back_each_side_shows_its_own_colour() {
    let other = [1.0, 0.0, 0.5];
    for (eye, expected) in [(5.0, COLOUR), (-5.0, other)] {
        let mut glb = Glb::new();
        glb.body(unlit(COLOUR), card(0.3));
        glb.body(unlit(other), flipped(card(0.3)));
        glb.perspective(Vec3::new(0.3, 0.2, eye), Vec3::ZERO, 10.0);
        let glb = glb.finish();
        for (i, seen) in
            rendered(&glb, &in_environment(settings(4, 4, 2), 0.0), 16).picture().planes[0].iter().enumerate()
        {
            assert_eq!(*seen, expected, "pixel {i} from {eye}");
        }
    }
    // Alone, its back shows the same.
    let mut glb = Glb::new();
    glb.body(unlit(COLOUR), card(0.0));
    glb.perspective(Vec3::new(0.0, 0.0, -5.0), Vec3::ZERO, 10.0);
    assert_eq!(pixel(&glb.finish(), &settings(2, 2, 2), 0), COLOUR);
}
