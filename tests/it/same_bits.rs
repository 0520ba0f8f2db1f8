//! The same picture, bit for bit, however it is made.

use glam::Vec3;
use ovtigre_core::{
    film::{
        batch::{Batch, Block},
        schedule::Schedule,
        size::Region,
        sum::Sum,
    },
    radiosity::{fineness::Fineness, solution::Solution},
    render::{
        batch::{Kernel, render, render_by},
        prepare::{Prepared, open},
        progress::Progress,
    },
    settings::{Layer, Lens, Method, Settings, Shows, Strategy},
};
use ovtigre_tests::{
    glb::Glb,
    picture::{in_environment, rendered, scene, settings},
    scenes::{cuboid, floor, glass, lambert, sphere},
    textures::png,
};
use serde_json::{Value, json};
use std::sync::Arc;

/// A small scene with a bit of everything, all lengths times `scale`, then moved by `offset` along each axis.
fn everything(scale: f64, offset: f64) -> Vec<u8> {
    everything_of(scale, offset, |_, material| material)
}

/// The same with its materials changed.
fn everything_of(scale: f64, offset: f64, change: impl Fn(&mut Glb, Value) -> Value) -> Vec<u8> {
    let mut glb = Glb::new();
    let mut add = |material: Value, (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>)| {
        let material = change(&mut glb, material);
        let material = glb.material(material);
        let uvs = vec![0.5; 2 * positions.len()];
        let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &uvs, 2)]);
        glb.place(mesh);
    };
    add(lambert(0.6, 0.0), floor(-1.0, 10.0, 0.0, 0.0));
    add(glass(1.5), sphere(Vec3::new(-1.0, 0.0, 0.0), 0.8, 12));
    add(
        json!({"pbrMetallicRoughness": {"roughnessFactor": 0.3}}),
        cuboid(Vec3::new(0.3, -1.0, -0.5), Vec3::new(1.3, 0.2, 0.5)),
    );
    add(
        json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.2}}),
        sphere(Vec3::new(0.2, -0.6, 1.2), 0.4, 12),
    );
    add(lambert(0.0, 6.0), ovtigre_tests::scenes::flipped(floor(2.5, 1.0, 0.5, 0.5)));
    glb.perspective(Vec3::new(0.5, 1.0, 5.0), Vec3::new(0.0, -0.2, 0.0), 40.0);
    glb.finish_under(json!({"scale": [scale, scale, scale], "translation": [offset, offset, offset]}))
}

/// A scene ready to be rendered; radiosity by fewer patches and rays than a picture's.
fn solved(glb: &[u8], settings: &Settings) -> Prepared {
    if settings.method != Method::Radiosity {
        return scene(glb, settings);
    }
    let scene = open(glb, None, settings).unwrap();
    let fineness = Fineness { even: 256, most: 512, refinements: 1, rays: 32 };
    let solution = Solution::new(&scene, settings.shadows, None, fineness).unwrap();
    Prepared { scene, radiosity: Some(Arc::new(solution)) }
}

fn sum(glb: &[u8], settings: &Settings, batch: Batch, threads: usize) -> Sum {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| render(&solved(glb, settings), settings, batch, &Progress::new()).unwrap())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let glb = everything(1.0, 0.0);
    let settings = in_environment(settings(40, 30, 2), 0.2);
    let batch = Schedule::new(settings.size.frame(), 1, 2, 64).batch(0, 1, 0).unwrap();
    let one = sum(&glb, &settings, batch, 1);
    assert!(one.planes[0].iter().flatten().sum::<f32>() > 0.0);
    for threads in [2, 3, 8] {
        assert!(one == sum(&glb, &settings, batch, threads), "{threads} threads");
    }
}

/// The methods whose samples stay in their pixel, and those whose do not, each by itself and with layers.
fn methods() -> Vec<(String, Settings)> {
    let mut plain = in_environment(settings(24, 20, 2), 0.2);
    plain.lens = Some(Lens { radius: 0.1, focus_distance: 5.0 });
    let layers = |method: Method| {
        let paths = ["LDE", "L.{2}E", "L.*SE"].map(|paths| Shows::Paths(paths.to_owned()));
        let further = match method {
            Method::Bidirectional => vec![Shows::Strategy(Strategy { s: 2, t: 2 })],
            Method::Photon => vec![Shows::Narrow],
            _ => Vec::new(),
        };
        let all = paths.into_iter().chain(further).enumerate();
        all.map(|(i, shows)| Layer { name: format!("l{i}"), shows }).collect()
    };
    let each = [Method::Path, Method::Light, Method::Bidirectional, Method::Caustics, Method::Photon];
    let both = each.into_iter().flat_map(|method| {
        let alone = Settings { method, ..plain.clone() };
        let filtered = Settings { layers: layers(method), ..alone.clone() };
        [(format!("{method:?}"), alone), (format!("{method:?} with layers"), filtered)]
    });
    let mut radiosity = in_environment(settings(24, 20, 2), 0.2);
    (radiosity.method, radiosity.paths) = (Method::Radiosity, "LD*E".to_owned());
    both.chain([("Radiosity".to_owned(), radiosity)]).collect()
}

/// What is alike all over a surface is found once for all of its points, and what lights have in common once for all next
/// events. A white texture is no reason for other bits.
#[test]
fn white_textures_change_no_bit() {
    let white = |glb: &mut Glb, mut material: Value| {
        let texture = json!({"index": glb.texture(&png(1, &[[255; 4]]), json!({}))});
        for name in ["baseColorTexture", "metallicRoughnessTexture"] {
            material["pbrMetallicRoughness"][name] = texture.clone();
        }
        material["emissiveTexture"] = texture;
        material
    };
    let (plain, textured) = (everything(1.0, 0.0), everything_of(1.0, 0.0, white));
    for (name, settings) in methods() {
        let block = Block { index: 0, start: 0, count: 4 };
        let batch = Batch { region: settings.size.frame(), replicate: 0, block };
        assert!(sum(&plain, &settings, batch, 1) == sum(&textured, &settings, batch, 1), "{name}");
    }
}

#[test]
fn every_method_gives_the_same_bits_on_any_number_of_threads() {
    let glb = everything(1.0, 0.0);
    for (what, settings) in methods() {
        let block = Block { index: 0, start: 0, count: 32 };
        let batch = Batch { region: settings.size.frame(), replicate: 1, block };
        let one = sum(&glb, &settings, batch, 1);
        for (i, plane) in one.planes.iter().enumerate() {
            assert!(plane.iter().flatten().sum::<f32>() > 0.0, "{what}: plane {i} shows nothing");
        }
        for threads in [2, 3, 8] {
            assert!(one == sum(&glb, &settings, batch, threads), "{what}: {threads} threads");
        }
    }
}

/// Where the samples are cut decides where sums are rounded to the f32 of a batch, and nothing else.
#[test]
fn blocks_of_every_method_add_up_to_the_same_sum() {
    let glb = everything(1.0, 0.0);
    for (what, settings) in methods() {
        let scene = solved(&glb, &settings);
        let cut = |counts: &[u32]| {
            let mut sums =
                vec![vec![[0.0_f64; 3]; settings.size.frame().pixels()]; settings.planes() as usize];
            let (mut start, mut rays) = (0, 0);
            for (index, &count) in (0..).zip(counts) {
                let batch = Batch {
                    region: settings.size.frame(),
                    replicate: 0,
                    block: Block { index, start, count },
                };
                let sum = render(&scene, &settings, batch, &Progress::new()).unwrap();
                for (into, value) in
                    sums.iter_mut().flatten().flatten().zip(sum.planes.iter().flatten().flatten())
                {
                    *into += f64::from(*value);
                }
                (start, rays) = (start + count, rays + sum.rays);
            }
            (sums, rays)
        };
        let ((a, rays), (b, others)) = (cut(&[1, 1, 2, 4, 8, 4, 2]), cut(&[16, 4, 2]));
        assert_eq!(rays, others, "{what}");
        for (a, b) in a.iter().flatten().flatten().zip(b.iter().flatten().flatten()) {
            // Each batch rounds by half of 2⁻²³ at most.
            assert!((a - b).abs() <= 1.2e-7 * a.abs(), "{what}: {a} and {b}");
        }
    }
}

#[test]
fn a_pixel_does_not_know_the_region_it_is_rendered_in() {
    let glb = everything(1.0, 0.0);
    let settings = settings(24, 20, 1);
    let scene = scene(&glb, &settings);
    let frame = settings.size.frame();
    let block = Schedule::new(frame, 1, 1, 64).blocks()[0];
    let render = |region: Region| {
        render(&scene, &settings, Batch { region, replicate: 0, block }, &Progress::new()).unwrap()
    };
    let whole = render(frame);
    for region in frame.bands(24 * 7).into_iter().chain([Region { x: 5, y: 3, width: 11, height: 9 }]) {
        let part = render(region);
        for (i, pixel) in part.planes[0].iter().enumerate() {
            let (x, y) = (
                region.x as usize + i % region.width as usize,
                region.y as usize + i / region.width as usize,
            );
            assert_eq!(*pixel, whole.planes[0][y * 24 + x], "pixel {x},{y}");
        }
    }
}

#[test]
fn a_sample_does_not_know_the_block_it_is_rendered_in() {
    let glb = everything(1.0, 0.0);
    let settings = settings(8, 8, 1);
    let scene = scene(&glb, &settings);
    let one = |start: u32| {
        let block = ovtigre_core::film::batch::Block { index: 0, start, count: 1 };
        let batch = Batch { region: settings.size.frame(), replicate: 0, block };
        render(&scene, &settings, batch, &Progress::new()).unwrap().planes.remove(0)
    };
    let block = ovtigre_core::film::batch::Block { index: 0, start: 16, count: 16 };
    let batch = Batch { region: settings.size.frame(), replicate: 0, block };
    let whole = render(&scene, &settings, batch, &Progress::new()).unwrap();
    let singles: Vec<_> = (16..32).map(one).collect();
    for pixel in 0..64 {
        for c in 0..3 {
            let sum: f64 = singles.iter().map(|plane| f64::from(plane[pixel][c])).sum();
            assert_eq!(whole.planes[0][pixel][c], sum as f32);
        }
    }
}

#[test]
fn scaling_by_a_power_of_two_changes_no_bit() {
    let settings = settings(16, 12, 2);
    let plain = rendered(&everything(1.0, 0.0), &settings, 16).picture();
    for exponent in [-20, 20] {
        let scaled = rendered(&everything(2.0_f64.powi(exponent), 0.0), &settings, 16).picture();
        assert!(plain.planes == scaled.planes, "scaled by 2^{exponent}");
    }
}

#[test]
fn scaling_and_moving_change_the_picture_no_more_than_its_error() {
    let settings = settings(16, 12, 16);
    let plain = rendered(&everything(1.0, 0.0), &settings, 32);
    let (mean, error) = plain.mean();
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e5), (1e-6, 1e-1)] {
        let other = rendered(&everything(scale, offset), &settings, 32);
        let (other_mean, other_error) = other.mean();
        let tolerance = 4.5 * error.hypot(other_error);
        assert!((mean - other_mean).abs() < tolerance, "{scale} {offset}: {mean} {other_mean} ± {tolerance}");
        assert_eq!(other.invalid(), 0);
    }
}

#[test]
fn the_scene_that_comes_along_is_the_one_its_code_makes() {
    let file = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/room.glb")).unwrap();
    assert!(file == ovtigre_tests::room::room(), "run: cargo run -p ovtigre-tests --bin make-scenes");
}

#[test]
fn what_is_compiled_for_less_gives_the_bits_of_the_general_kernel() {
    let glb = everything(1.0, 0.0);
    let all = [Method::Path, Method::Light, Method::Bidirectional, Method::Caustics, Method::Photon];
    for method in all {
        let settings = in_environment(Settings { method, ..settings(40, 30, 1) }, 0.2);
        let scene = scene(&glb, &settings);
        let block = Block { index: 2, start: 2, count: 2 };
        let batch = Batch { region: settings.size.frame(), replicate: 0, block };
        let by = |kernel| render_by(kernel, &scene, &settings, batch, &Progress::new()).unwrap();
        assert_eq!(by(Kernel::Fitting), by(Kernel::General), "{method:?}");
    }
}
