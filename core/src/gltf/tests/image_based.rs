//! Light from infinitely far that a file has.

use super::builder::{Builder, png};
use crate::scene::environment::Environment;
use glam::Vec3;
use serde_json::{Value, json};

/// Sides of a cube, in the order of the extension: their directions, and what is in each pixel of the pictures.
const SIDES: [(Vec3, [u8; 4]); 6] = [
    (Vec3::X, [255, 0, 0, 255]),
    (Vec3::NEG_X, [0, 255, 0, 255]),
    (Vec3::Y, [0, 0, 255, 255]),
    (Vec3::NEG_Y, [255, 255, 0, 255]),
    (Vec3::Z, [0, 255, 255, 255]),
    // Twice white: the colour over alpha.
    (Vec3::NEG_Z, [255, 255, 255, 51]),
];

/// A triangle lit by pictures of `side` pixels.
fn lit(light: Value, side: u32, texel: impl Fn(usize, u32) -> [u8; 4]) -> Builder {
    let mut builder = Builder::triangle(&[], json!({}));
    let faces: Vec<usize> = (0..6)
        .map(|face| {
            let texels: Vec<_> = (0..side * side).map(|i| texel(face, i)).collect();
            let view = builder.view(&png(side, side, &texels), None);
            builder.push("images", json!({"bufferView": view, "mimeType": "image/png"}))
        })
        .collect();
    let mut light = light;
    light["specularImages"] = json!([faces]);
    light["specularImageSize"] = json!(side);
    light["irradianceCoefficients"] = json!(vec![[0.0; 3]; 9]);
    builder.json["extensions"] = json!({"EXT_lights_image_based": {"lights": [light]}});
    builder.json["extensionsUsed"] = json!(["EXT_lights_image_based"]);
    builder.json["scenes"] = json!([{"nodes": [0], "extensions": {"EXT_lights_image_based": {"light": 0}}}]);
    builder
}

fn environment(builder: &Builder) -> Environment {
    let loaded = builder.load();
    assert!(
        loaded.scene.is_lit() && loaded.warnings.iter().all(|w| w.pointer.is_empty()),
        "{:?}",
        loaded.warnings
    );
    loaded.scene.environment.as_deref().unwrap().clone()
}

#[test]
fn each_face_lights_from_its_direction() {
    let sky = environment(&lit(json!({"intensity": 2.0}), 16, |face, _| SIDES[face].1));
    for (direction, [r, g, b, a]) in SIDES {
        let off = (direction + Vec3::new(0.1, 0.2, 0.3)).normalize();
        let expected = Vec3::from([r, g, b].map(f32::from)) / 255.0 * 2.0 * 255.0 / f32::from(a);
        let got = sky.radiance(off);
        assert!((got - expected).length() < 1e-5, "{direction}: {got}, not {expected}");
    }
    assert!((sky.brightest() - 10.0).abs() < 1e-5, "{}", sky.brightest());
}

/// A picture tells right from left and up from down: its brightest quarter is where it is.
#[test]
fn faces_are_seen_from_the_middle() {
    // The upper right quarter of each face shines.
    let sky = |light: Value| {
        environment(&lit(light, 16, |_, i| if i % 16 >= 8 && i / 16 < 8 { [255; 4] } else { [0, 0, 0, 255] }))
    };
    let plain = sky(json!({}));
    // Directions to the middle of the face, to its right and up.
    let faces = [
        (Vec3::X, Vec3::Z, Vec3::Y),
        (Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y),
        (Vec3::Y, Vec3::NEG_X, Vec3::NEG_Z),
        (Vec3::NEG_Y, Vec3::NEG_X, Vec3::Z),
        (Vec3::Z, Vec3::NEG_X, Vec3::Y),
        (Vec3::NEG_Z, Vec3::X, Vec3::Y),
    ];
    for (middle, right, up) in faces {
        assert_eq!(middle.cross(up), right);
        for (x, y) in [(0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4)] {
            let expected = if x > 0.0 && y > 0.0 { 1.0 } else { 0.0 };
            let direction = (middle + right * x + up * y).normalize();
            assert_eq!(plain.radiance(direction), Vec3::splat(expected), "{middle} {x} {y}");
        }
    }
    // Turned by a quarter around +y, what was at −z is at −x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = sky(json!({"rotation": [0.0, half, 0.0, half]}));
    let was = (Vec3::NEG_Z + Vec3::X * 0.4 + Vec3::Y * 0.4).normalize();
    let is = (Vec3::NEG_X + Vec3::NEG_Z * 0.4 + Vec3::Y * 0.4).normalize();
    assert_eq!((plain.radiance(was), turned.radiance(is)), (Vec3::ONE, Vec3::ONE));
    assert_eq!(turned.radiance((Vec3::NEG_X + Vec3::Z * 0.4 + Vec3::Y * 0.4).normalize()), Vec3::ZERO);
}

#[test]
fn a_light_that_is_none_is_refused_where_it_stands() {
    let refused = |says: [&str; 2], change: fn(&mut Value)| {
        let mut builder = lit(json!({}), 1, |face, _| SIDES[face].1);
        change(&mut builder.json);
        let error = builder.try_load().unwrap_err().to_string();
        assert!(says.iter().all(|part| error.contains(part)), "{error}");
    };
    let light = "/extensions/EXT_lights_image_based/lights/0";
    refused(["/scenes/0/extensions/EXT_lights_image_based/light", "3"], |json| {
        json["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = json!(3);
    });
    refused([light, "6 faces"], |json| {
        json["extensions"]["EXT_lights_image_based"]["lights"][0]["specularImages"] = json!([[0, 1, 2]]);
    });
    refused([light, "refers to 77 of images"], |json| {
        json["extensions"]["EXT_lights_image_based"]["lights"][0]["specularImages"][0][4] = json!(77);
    });
    refused([light, "no rotation"], |json| {
        json["extensions"]["EXT_lights_image_based"]["lights"][0]["rotation"] = json!([0, 0, 0, 0]);
    });
    refused([light, "intensity"], |json| {
        json["extensions"]["EXT_lights_image_based"]["lights"][0]["intensity"] = json!(-1);
    });
}
