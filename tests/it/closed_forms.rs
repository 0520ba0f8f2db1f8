//! Scenes whose light has a closed form.

use glam::{DVec3, Vec3};
use ovtigre_tests::{
    glb::Glb,
    irradiance,
    picture::{in_environment, rendered, settings},
    scenes::{body_alone, cuboid, flipped, furnace, glass, lambert, mirror, over_floor, quad, sphere},
    textures::{UVS, png},
};
use serde_json::json;
use std::f64::consts::PI;

#[test]
fn a_closed_room_has_the_radiance_of_its_neumann_series() {
    for (reflectance, samples) in [(0.2, 16), (0.5, 64), (0.9, 128), (0.99, 256)] {
        let picture = rendered(&furnace(reflectance, 1.5), &settings(8, 8, 16), samples);
        let truth = 1.5 / (1.0 - f64::from(reflectance));
        picture.assert_mean(truth, 0.003, &format!("reflectance {reflectance}"));
    }
}

#[test]
fn bodies_that_lose_nothing_cannot_be_seen_in_a_uniform_environment() {
    let bodies = [
        ("white Lambert", lambert(1.0, 0.0)),
        ("mirror", mirror()),
        ("glass", glass(1.5)),
        ("dense glass", glass(2.4)),
    ];
    for (name, material) in bodies {
        let glb = body_alone(material, sphere(Vec3::ZERO, 1.0, 24));
        let picture = rendered(&glb, &in_environment(settings(16, 16, 16), 0.7), 16);
        picture.assert_mean(0.7, 0.002, name);
    }
}

#[test]
fn a_rectangle_lights_a_floor_as_lambert_says() {
    let rectangle = |x: f32, y: f32, z: f32, half: f32| {
        let corner = |dx: f32, dz: f32| Vec3::new(x + dx * half, y, z + dz * half);
        [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
    };
    // A wall that stands on the floor, its lower edge at a distance from the point that is seen.
    let wall = |distance: f32, height: f32| {
        let at = |x: f32, y: f32| Vec3::new(x, y, -distance);
        [at(-1.0, 0.0), at(1.0, 0.0), at(1.0, height), at(-1.0, height)]
    };
    let cases = [
        ("near", rectangle(0.2, 0.1, 0.1, 1.0)),
        ("far", rectangle(3.0, 400.0, -5.0, 1.0)),
        ("small", rectangle(0.4, 1.0, 0.0, 0.01)),
        ("grazing", rectangle(500.0, 5.0, 0.0, 2.0)),
        ("touching", wall(1e-3, 1.0)),
        ("standing beside", wall(1.0, 2.0)),
    ];
    for (name, corners) in cases {
        let glb = over_floor(0.5, |glb| {
            let light = glb.material(lambert(0.0, 3.0));
            let (positions, triangles) = quad(corners);
            let mesh = glb.mesh(&positions, &triangles, light);
            glb.place(mesh);
        });
        let truth = 3.0 * 0.5 / PI * irradiance::of_polygon(&corners.map(Vec3::as_dvec3));
        rendered(&glb, &settings(4, 4, 16), 256).assert_mean(truth, 0.002, name);
    }
}

#[test]
fn lights_without_extent_follow_their_laws() {
    let (h, r) = (2.0_f64, 1.5_f64);
    let point = over_floor(0.5, |glb| {
        glb.light(json!({"type": "point", "intensity": 7.0}), json!({"translation": [r, h, 0.0]}));
    });
    let truth = 0.5 / PI * 7.0 * h / (h * h + r * r).powf(1.5);
    rendered(&point, &settings(4, 4, 16), 16).assert_mean(truth, 1e-4, "point");

    // Straight down with a half-angle so that the point seen is in the ramp between the two cones.
    let (inner, outer) = (0.3_f64, 0.9_f64);
    let spot = over_floor(0.5, |glb| {
        let cone = json!({"innerConeAngle": inner, "outerConeAngle": outer});
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let node = json!({"translation": [r, h, 0.0], "rotation": [-half, 0.0, 0.0, half]});
        glb.light(json!({"type": "spot", "intensity": 7.0, "spot": cone}), node);
    });
    let cos = h / (h * h + r * r).sqrt();
    let ramp = ((cos - outer.cos()) / (inner.cos() - outer.cos())).powi(2);
    rendered(&spot, &settings(4, 4, 16), 16).assert_mean(truth * ramp, 1e-4, "spot");

    let sun = over_floor(0.5, |glb| {
        // −z turned by 60° about x: the light comes from 30° above the horizon.
        let angle = PI / 6.0;
        let node = json!({"rotation": [-(angle / 2.0).sin(), 0.0, 0.0, (angle / 2.0).cos()]});
        glb.light(json!({"type": "directional", "intensity": 4.0}), node);
    });
    rendered(&sun, &settings(4, 4, 16), 16).assert_mean(0.5 / PI * 4.0 * 0.5, 1e-4, "sun");
}

#[test]
fn a_glass_plate_passes_what_fresnel_says() {
    for degrees in [0.0_f64, 45.0, 60.0, 80.0] {
        let mut glb = Glb::new();
        let clear = glb.material(glass(1.5));
        let light = glb.material(lambert(0.0, 2.0));
        let (positions, triangles) = cuboid(Vec3::new(-50.0, -0.05, -50.0), Vec3::new(50.0, 0.05, 50.0));
        let plate = glb.mesh(&positions, &triangles, clear);
        glb.place(plate);
        let (positions, triangles) = cuboid(Vec3::new(-100.0, -101.0, -100.0), Vec3::new(100.0, -1.0, 100.0));
        let below = glb.mesh(&positions, &triangles, light);
        glb.place(below);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let eye = DVec3::new(sin, cos, 0.0).as_vec3() * 2.0;
        glb.orthographic(eye, Vec3::ZERO, 0.01, 0.01);
        let reflected = irradiance::fresnel(1.5, cos);
        let truth = 2.0 * (1.0 - reflected) / (1.0 + reflected);
        rendered(&glb.finish(), &settings(8, 8, 16), 256).assert_mean(truth, 0.002, &format!("{degrees}°"));
    }
}

#[test]
fn a_texture_is_where_it_should_be_and_decoded_as_srgb() {
    let mut glb = Glb::new();
    let levels = [[255, 0, 0, 255], [0, 255, 0, 255], [188, 188, 188, 255], [0, 0, 255, 255]];
    let texture = glb.texture(&png(2, &levels), json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33071}));
    let mut material = lambert(0.0, 1.0);
    material["emissiveTexture"] = json!({"index": texture});
    let material = glb.material(material);
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let (positions, triangles) =
        quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &UVS, 2)]);
    glb.place(mesh);
    glb.orthographic(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 2.0, 2.0);
    let picture = rendered(&glb.finish(), &settings(2, 2, 2), 1).picture();
    let grey = 0.502_886_5; // sRGB 188
    let expected = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [grey; 3], [0.0, 0.0, 1.0]];
    for (got, expected) in picture.planes[0].iter().zip(expected) {
        for c in 0..3 {
            assert!((got[c] - expected[c]).abs() < 1e-6, "{:?}", picture.planes[0]);
        }
    }
}

#[test]
fn alpha_lets_light_pass_to_the_eye_and_to_the_floor() {
    // A floor under a sheet whose left half is cut out and whose right half covers 40 %; a sun straight above.
    let sheet = |mode: &str| {
        over_floor(0.5, |glb| {
            let texture =
                glb.texture(&png(2, &[[255, 255, 255, 0], [255, 255, 255, 102]]), json!({"magFilter": 9728}));
            let mut material = lambert(0.0, 0.0);
            material["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.0, 0.0, 0.0, 1.0]);
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": texture});
            material["alphaMode"] = json!(mode);
            if mode == "MASK" {
                material["alphaCutoff"] = json!(0.3);
            }
            let material = glb.material(material);
            let corner = |x: f32, z: f32| Vec3::new(x, 0.005, z);
            let (positions, triangles) =
                quad([corner(-5.0, 5.0), corner(5.0, 5.0), corner(5.0, -5.0), corner(-5.0, -5.0)]);
            let shift = if mode == "MASK" { -1.0 } else { 1.0 };
            let positions: Vec<Vec3> = positions.iter().map(|p| *p + Vec3::X * shift * 2.0).collect();
            let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &UVS, 2)]);
            glb.place(mesh);
            let half = std::f64::consts::FRAC_1_SQRT_2;
            glb.light(
                json!({"type": "directional", "intensity": 2.0}),
                json!({"rotation": [-half, 0.0, 0.0, half]}),
            );
        })
    };
    let lit = 0.5 / PI * 2.0;
    // The mask's covered half, at x > −2, is above the origin: nothing is seen but its black.
    let (mean, _) = rendered(&sheet("MASK"), &settings(4, 4, 16), 16).mean();
    assert_eq!(mean, 0.0);
    // The blended sheet's open half, at x < 2, is above the origin: all is seen.
    rendered(&sheet("BLEND"), &settings(4, 4, 16), 16).assert_mean(lit, 1e-4, "open half");
    let covered = over_floor(0.5, |glb| {
        let mut material = lambert(0.0, 0.0);
        material["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.0, 0.0, 0.0, 0.4]);
        material["alphaMode"] = json!("BLEND");
        let material = glb.material(material);
        let (positions, triangles) = flipped(ovtigre_tests::scenes::floor(0.005, 10.0, 0.0, 0.0));
        let mesh = glb.mesh(&positions, &triangles, material);
        glb.place(mesh);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        glb.light(
            json!({"type": "directional", "intensity": 2.0}),
            json!({"rotation": [-half, 0.0, 0.0, half]}),
        );
    });
    // 60 % of the light comes down, 60 % of that is seen, though the sheet's diagonal lies right above the point that is
    // seen: a ray on it meets one of the triangles.
    rendered(&covered, &settings(8, 8, 16), 256).assert_mean(0.36 * lit, 0.003, "covered to 40 %");
}

#[test]
fn light_that_glass_has_trapped_ends_and_what_escapes_is_brighter_by_the_index_squared() {
    // From within a clear cube, a direction whose every component is below the cosine of the critical angle is
    // totally reflected for ever; any other leaves in the end, with all of its light: every sample of it is the same,
    // so its tolerance is that for rounding.
    for (target, truth) in [(Vec3::ONE, 0.0), (Vec3::new(1.0, 0.1, 0.05), 1.5 * 1.5)] {
        let mut glb = Glb::new();
        let clear = glb.material(glass(1.5));
        let (positions, triangles) = cuboid(Vec3::splat(-1.0), Vec3::ONE);
        let cube = glb.mesh(&positions, &triangles, clear);
        glb.place(cube);
        glb.perspective(Vec3::new(0.1, 0.0, -0.1), target, 10.0);
        let picture = rendered(&glb.finish(), &in_environment(settings(8, 8, 16), 1.0), 16);
        if truth > 0.0 {
            picture.assert_mean(truth, 1e-7, "what escapes");
        } else {
            let (mean, _) = picture.mean();
            assert_eq!(mean, 0.0, "what is trapped");
        }
    }
}
