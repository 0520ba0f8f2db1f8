//! All methods agree.

use glam::Vec3;
use ovtigre_core::film::size::Size;
use ovtigre_core::settings::{Layer, Lens, Method, Settings, Shows, Shutter};
use ovtigre_tests::{
    glb::Glb,
    picture::{Parts, in_environment, rendered, settings},
    scenes::{cuboid, glass, lambert, quad, sphere},
    stage::{metal, plastic, room, room_in_parallel, smooth_sphere},
    textures::{UVS, png},
};
use serde_json::{Value, json};

fn by(method: Method, settings: &Settings) -> Settings {
    Settings { method, ..settings.clone() }
}

/// Samples a pixel and replicate by each method; 0 where it is not asked.
#[derive(Clone, Copy)]
struct Samples {
    path: u32,
    both: u32,
    light: u32,
    /// Passes.
    photon: u32,
}

/// What photons show at radius zero, extrapolated from four radii: of a picture of `side` pixels a side, of half as many
/// (twice the radius), and each with half the area of gathering. What edges and corners take away is in proportion to the
/// radius and its square, what flat surfaces smear to its square: both are taken out, replicate by replicate, so that the
/// spread of what remains is the error of the result.
fn photons(glb: &[u8], settings: &Settings, side: u32, passes: u32, what: &str) -> Parts {
    let mut settings = by(Method::Photon, settings);
    settings.layers.push(Layer { name: "narrow".to_owned(), shows: Shows::Narrow });
    let [fine, coarse] = [side, side / 2].map(|side| {
        settings.size = Size { width: side, height: side };
        let picture = rendered(glb, &settings, passes);
        assert_eq!(picture.invalid(), 0, "{what}: samples were dropped");
        eprintln!("   {side}: {:?} {:?}", picture.mean_of(0), picture.mean_of(1));
        // What is in proportion to the radius is not in this.
        let linear = |[wide, narrow]: [f64; 2]| wide + (narrow - wide) / (1.0 - 0.5_f64.sqrt());
        Parts::combined([&picture.parts(0), &picture.parts(1)], linear)
    });
    Parts::combined([&fine, &coarse], |[fine, coarse]| fine + (fine - coarse) / 3.0)
}

/// Asserts that light from the eye, from the light, from both and by photons is the same, in all of the picture and in its
/// blocks of 16×16 pixels.
fn agree(glb: &[u8], settings: &Settings, samples: Samples, power: f64, what: &str) {
    let t = std::time::Instant::now();
    let path = rendered(glb, &by(Method::Path, settings), samples.path);
    eprintln!("{what}: path {:?} {:?}", path.mean(), t.elapsed());
    for (method, samples) in [(Method::Bidirectional, samples.both), (Method::Light, samples.light)] {
        if samples > 0 && std::env::var("SIDE").is_err() {
            let t = std::time::Instant::now();
            let other = rendered(glb, &by(method, settings), samples);
            eprintln!("{what}: {method:?} {:?} {:?}", other.mean(), t.elapsed());
            path.assert_same(&other, power, &format!("{what}: path and {method:?}"));
        }
    }
    if std::env::var("SIDE").is_ok() {
        let side: u32 = std::env::var("SIDE").unwrap().parse().unwrap();
        let passes: u32 = std::env::var("PASSES").unwrap().parse().unwrap();
        let cpu = || std::fs::read_to_string("/proc/self/stat").unwrap().split(' ').nth(13).unwrap().parse::<u64>().unwrap();
        let t = cpu();
        let photons = photons(glb, settings, side, passes, what);
        eprintln!("{what}: photon {:?} cpu {}", photons.whole(), cpu() - t);
        path.parts(0).assert_same(&photons, power, &format!("{what}: path and photons"));
    } else if samples.photon > 0 {
        let t = std::time::Instant::now();
        let photons = photons(glb, settings, 256, samples.photon, what);
        eprintln!("{what}: photon {:?} {:?}", photons.whole(), t.elapsed());
        path.parts(0).assert_same(&photons, power, &format!("{what}: path and photons"));
    }
}

#[test]
fn a_diffuse_room() {
    let glb = room(10.0, |glb| {
        glb.body(lambert(0.8, 0.0), cuboid(Vec3::new(-0.5, -1.0, -0.5), Vec3::new(0.2, 0.1, 0.2)))
    });
    agree(&glb, &settings(64, 64, 16), Samples { path: 2, both: 1, light: 1, photon: 1 }, 0.003, "diffuse");
}

#[test]
fn smooth_normals_gloss_and_metal() {
    let glb = room(10.0, |glb| {
        smooth_sphere(glb, plastic(0.3), Vec3::new(-0.4, -0.5, 0.0), 0.45);
        smooth_sphere(glb, metal(0.4), Vec3::new(0.5, -0.4, 0.2), 0.4);
        smooth_sphere(glb, lambert(0.8, 0.0), Vec3::new(0.1, 0.4, -0.3), 0.3);
    });
    agree(
        &glb,
        &settings(64, 64, 16),
        Samples { path: 2, both: 2, light: 8, photon: 1 },
        0.003,
        "smooth normals",
    );
}

#[test]
fn rough_and_smooth_glass() {
    let rough = |roughness: f32| {
        let mut material = glass(1.5);
        material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
        material
    };
    let glb = room(10.0, |glb| smooth_sphere(glb, rough(0.5), Vec3::new(0.0, -0.3, 0.0), 0.6));
    agree(
        &glb,
        &settings(64, 64, 16),
        Samples { path: 8, both: 2, light: 16, photon: 1 },
        0.003,
        "rough glass",
    );
    let glb = room(10.0, |glb| smooth_sphere(glb, rough(0.0), Vec3::new(0.0, -0.3, 0.0), 0.6));
    agree(
        &glb,
        &settings(64, 64, 16),
        Samples { path: 16, both: 4, light: 0, photon: 1 },
        0.003,
        "smooth glass",
    );
}

#[test]
fn coated_plastic_and_mixtures() {
    let glb = room(10.0, |glb| {
        glb.body(plastic(0.0), cuboid(Vec3::new(-0.8, -1.0, -0.5), Vec3::new(-0.1, 0.0, 0.3)));
        let mut mixed = plastic(0.3);
        mixed["pbrMetallicRoughness"]["metallicFactor"] = json!(0.4);
        mixed["extensions"] = json!({"KHR_materials_transmission": {"transmissionFactor": 0.5}});
        glb.body(mixed, cuboid(Vec3::new(0.2, -1.0, -0.3), Vec3::new(0.7, 0.0, 0.4)));
    });
    agree(&glb, &settings(64, 64, 16), Samples { path: 2, both: 1, light: 0, photon: 1 }, 0.003, "coated");
}

#[test]
fn lights_of_every_kind() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let down = json!({"translation": [0.2, 0.8, 0.1], "rotation": [-half, 0.0, 0.0, half]});
    let point = room(0.0, |glb| glb.light(json!({"type": "point", "intensity": 2.0}), down.clone()));
    agree(&point, &settings(64, 64, 16), Samples { path: 2, both: 1, light: 2, photon: 1 }, 0.003, "point");
    let spot =
        json!({"type": "spot", "intensity": 4.0, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.8}});
    let spot = room(0.0, |glb| glb.light(spot, down.clone()));
    agree(&spot, &settings(64, 64, 16), Samples { path: 1, both: 1, light: 4, photon: 1 }, 0.003, "spot");
    let along = json!({"rotation": [-0.3, 0.2, 0.0, 0.93]});
    let sun = room(0.0, |glb| glb.light(json!({"type": "directional", "intensity": 3.0}), along));
    agree(&sun, &settings(64, 64, 16), Samples { path: 1, both: 1, light: 4, photon: 1 }, 0.003, "sun");
    let sky = in_environment(settings(64, 64, 16), 1.0);
    agree(&room(0.0, |_| ()), &sky, Samples { path: 2, both: 4, light: 32, photon: 1 }, 0.003, "sky");
    let both = room(4.0, |glb| {
        glb.light(json!({"type": "point", "intensity": 1.0}), json!({"translation": [-0.5, 0.0, 0.2]}))
    });
    agree(&both, &sky, Samples { path: 2, both: 2, light: 8, photon: 1 }, 0.003, "sky, lamp and point");
}

/// A quad whose material has a texture of 4×4 texels in the given place.
fn textured(glb: &mut Glb, mut material: Value, texels: &[[u8; 4]; 16], place: &str, corners: [Vec3; 4]) {
    let texture = glb.texture(&png(4, texels), json!({}));
    material[place] = json!({"index": texture});
    let material = glb.material(material);
    let (positions, triangles) = quad(corners);
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &UVS, 2)]);
    glb.place(mesh);
}

#[test]
fn normal_maps_and_textured_lamps() {
    let at = Vec3::new;
    let bumps = std::array::from_fn(|i| [96 + 16 * (i as u8 % 5), 88 + 20 * (i as u8 % 4), 215, 255]);
    let glow = std::array::from_fn(|i| [if i % 3 == 0 { 255 } else { 60 }, 40 + 12 * i as u8, 90, 255]);
    let glb = room(2.0, |glb| {
        let raised = [at(-0.9, -0.9, 0.9), at(0.5, -0.9, 0.9), at(0.5, -0.8, -0.6), at(-0.9, -0.8, -0.6)];
        textured(glb, plastic(0.4), &bumps, "normalTexture", raised);
        let lamp = [at(0.6, -0.6, -0.9), at(0.95, -0.6, -0.6), at(0.95, 0.4, -0.6), at(0.6, 0.4, -0.9)];
        textured(glb, lambert(0.2, 6.0), &glow, "emissiveTexture", lamp);
    });
    agree(
        &glb,
        &settings(64, 64, 16),
        Samples { path: 4, both: 2, light: 16, photon: 1 },
        0.003,
        "normal maps and textured lamps",
    );
}

#[test]
fn things_that_move() {
    let glb = room(10.0, |glb| {
        let ball = glb.body(plastic(0.4), sphere(Vec3::new(0.0, -0.4, 0.1), 0.35, 8));
        glb.animate(ball, "translation", "LINEAR", &[0.0, 1.0], &[-0.4, 0.0, 0.0, 0.4, 0.2, 0.0]);
        let lamp = glb.light(json!({"type": "point", "intensity": 0.5}), json!({}));
        glb.animate(lamp, "translation", "LINEAR", &[0.0, 1.0], &[0.7, 0.3, 0.3, 0.7, -0.5, 0.3]);
    });
    let mut open = settings(64, 64, 16);
    open.shutter = Shutter { open: 0.0, close: 1.0 };
    agree(&glb, &open, Samples { path: 4, both: 2, light: 8, photon: 1 }, 0.003, "moving things");
}

fn block(glb: &mut Glb) -> usize {
    glb.body(plastic(0.4), cuboid(Vec3::new(-0.4, -1.0, -0.4), Vec3::new(0.4, -0.2, 0.4)))
}

#[test]
fn a_lens() {
    let mut with_lens = settings(64, 64, 16);
    with_lens.lens = Some(Lens { radius: 0.2, focus_distance: 3.0 });
    agree(&room(10.0, block), &with_lens, Samples { path: 4, both: 1, light: 2, photon: 1 }, 0.003, "lens");
}

#[test]
fn parallel_rays() {
    let glb = room_in_parallel(10.0, block);
    agree(
        &glb,
        &settings(64, 64, 16),
        Samples { path: 2, both: 1, light: 4, photon: 1 },
        0.003,
        "parallel rays",
    );
    let glb = room_in_parallel(0.0, |glb| {
        block(glb);
        glb.light(
            json!({"type": "directional", "intensity": 3.0}),
            json!({"rotation": [-0.3, 0.2, 0.0, 0.93]}),
        )
    });
    let mut settings = in_environment(settings(64, 64, 16), 0.5);
    agree(
        &glb,
        &settings,
        Samples { path: 2, both: 2, light: 0, photon: 1 },
        0.003,
        "parallel rays, sun and sky",
    );
    // All rays that see the sky itself are parallel: none of its light goes there but by a probability of zero.
    settings.paths = "L(D|S)+E".to_owned();
    agree(
        &glb,
        &settings,
        Samples { path: 2, both: 2, light: 16, photon: 1 },
        0.003,
        "parallel rays, lit by sun and sky",
    );
}

#[test]
fn photons_tell_their_bias() {
    // What photons miss around edges shrinks with their radius; half the area of gathering tells how much is missing.
    let contents = cuboid(Vec3::new(-0.5, -1.0, -0.5), Vec3::new(0.2, 0.1, 0.2));
    let glb = room(10.0, |glb| glb.body(lambert(0.8, 0.0), contents));
    let settings = settings(64, 64, 16);
    let (path, _) = rendered(&glb, &settings, 16).mean();
    let mut photon = by(Method::Photon, &settings);
    photon.layers.push(Layer { name: "narrow".to_owned(), shows: Shows::Narrow });
    let picture = rendered(&glb, &photon, 8);
    let ((wide, error), (narrow, _)) = (picture.mean(), picture.mean_of(1));
    // What is missing around edges is in proportion to the radius.
    let extrapolated = wide + (narrow - wide) / (1.0 - 0.5_f64.sqrt());
    assert!(path - wide > 4.5 * error, "{path} {wide}: there is no bias to tell");
    assert!((path - extrapolated).abs() < 0.5 * (path - wide), "{path}: {wide}, {narrow}, {extrapolated}");
}
