//! Finite elements against closed forms and against paths.

use glam::Vec3;
use ovtigre_core::{
    bake::{
        appearance::Appearance,
        baked::{Form, bake},
    },
    film::{estimate::Picture, exr::read_layers, schedule::Schedule},
    math::colour::Rgb,
    method::{
        camera::camera_ray,
        radiosity::{Reconstruction, sample},
    },
    radiosity::{
        element::Element,
        fineness::Fineness,
        form_factor::rows,
        hemisphere::{Sources, Surroundings},
        patch::{Patch, Patches},
        solution::Solution,
    },
    render::{
        batch::render,
        prepare::{Prepared, open},
        progress::Progress,
    },
    sampler::Sampler,
    scene::{Scene, interaction::Side, view::Views},
    settings::{CameraChoice, Method, Settings, Shadows},
    trace::moment::Moment,
    trace::ray::Ray,
};
use ovtigre_tests::{
    glb::Glb,
    picture::{in_environment, rendered, scene, settings},
    program::run,
    scenes::{
        add, body_alone, cornell, cuboid, flipped, floor, furnace, lambert, over_floor, quad, sphere,
        two_rooms,
    },
};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::{f64::consts::PI, sync::Arc};

/// The picture of a solution: mean over some samples of each pixel.
fn shown(
    prepared: &Prepared,
    solution: &Solution,
    settings: &Settings,
    how: Reconstruction,
    n: u32,
) -> Vec<Rgb> {
    let width = settings.size.width;
    (0..settings.size.pixels() as u32)
        .into_par_iter()
        .map(|i| {
            let pixel = [i % width, i / width];
            let one = |k| {
                let sampler = Sampler::new(1, 0, pixel, k);
                sample(&prepared.scene, solution, settings, how, pixel, &sampler, &mut 0).as_dvec3()
            };
            ((0..n).map(one).sum::<glam::DVec3>() / f64::from(n)).as_vec3()
        })
        .collect()
}

/// The form factor from all front elements of the first instance's triangles `from` to those of `to`.
fn form_factor(
    glb: &[u8],
    from: std::ops::Range<u32>,
    to: std::ops::Range<u32>,
    patches: usize,
    rays: u32,
) -> f64 {
    let settings = Settings { camera: CameraChoice::Framed, ..settings(4, 4, 1) };
    let prepared = scene(glb, &settings);
    let scene = &prepared.scene;
    let patches = Patches::even(&scene.data, patches);
    let surroundings = Surroundings { scene, patches: &patches, sources: Sources::Met, shadows: Shadows::On };
    let (mut sum, mut whole) = (0.0, 0.0);
    for (e, row) in rows(&surroundings, rays).iter().enumerate().step_by(2) {
        let patch = &patches.all()[e / 2];
        if from.contains(&patch.triangle) {
            let links = row.links.iter().filter(|link| {
                let sender = &patches.all()[link.from.patch().index()];
                to.contains(&sender.triangle) && link.from.index().is_multiple_of(2)
            });
            sum += patch.area() * links.map(|link| f64::from(link.share)).sum::<f64>();
            whole += patch.area();
        }
    }
    sum / whole
}

#[test]
fn form_factors_of_squares_are_those_of_the_closed_forms() {
    let at = Vec3::new;
    let parallel = |distance: f32| {
        let mut glb = Glb::new();
        add(&mut glb, "below", lambert(0.5, 0.0), floor(0.0, 1.0, 0.0, 0.0));
        add(&mut glb, "above", lambert(0.5, 0.0), flipped(floor(distance, 1.0, 0.0, 0.0)));
        glb.finish()
    };
    // Parallel squares at a distance c, X = 1 / c, and (Howell C-14) two that touch along an edge at right angles.
    let facing = |x: f64| {
        let root = (1.0 + x * x).sqrt();
        let logarithm = 0.5 * (root.powi(4) / (1.0 + 2.0 * x * x)).ln();
        2.0 / (PI * x * x) * (logarithm + 2.0 * x * root * (x / root).atan() - 2.0 * x * x.atan())
    };
    assert!((facing(1.0) - 0.199_825).abs() < 1e-6);
    let mut corner = Glb::new();
    add(
        &mut corner,
        "floor",
        lambert(0.5, 0.0),
        quad([at(0.0, 0.0, 0.0), at(0.0, 0.0, 1.0), at(1.0, 0.0, 1.0), at(1.0, 0.0, 0.0)]),
    );
    add(
        &mut corner,
        "wall",
        lambert(0.5, 0.0),
        quad([at(0.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, 1.0, 1.0), at(0.0, 0.0, 1.0)]),
    );
    let cases = [
        ("at 1", parallel(1.0), facing(1.0)),
        ("at 0.1", parallel(0.1), facing(10.0)),
        ("at 5", parallel(5.0), facing(0.2)),
        ("touching", corner.finish(), 0.200_044),
    ];
    for (name, glb, truth) in cases {
        for (patches, rays) in [(4, 4096), (256, 256)] {
            for [from, to] in [[0..2, 2..4], [2..4, 0..2]] {
                let found = form_factor(&glb, from, to, patches, rays);
                // A share of that many independent rays; stratified ones are nearer.
                let n = f64::from(rays) * patches as f64 / 2.0;
                let tolerance = 4.0 * (truth * (1.0 - truth) / n).sqrt();
                assert!((found - truth).abs() < tolerance, "{name}, {patches} patches: {found}, not {truth}");
            }
        }
    }
}

#[test]
fn rows_of_a_closed_room_add_up_to_one() {
    let prepared = scene(&furnace(0.5, 0.0), &settings(4, 4, 1));
    let scene = &prepared.scene;
    let patches = Patches::even(&scene.data, 300);
    let surroundings = Surroundings { scene, patches: &patches, sources: Sources::Met, shadows: Shadows::On };
    for (e, row) in rows(&surroundings, 64).iter().enumerate() {
        let sum: f32 = row.links.iter().map(|link| link.share).sum();
        // Fronts look inwards; nothing is outside.
        assert_eq!(sum, if e.is_multiple_of(2) { 1.0 } else { 0.0 });
        let own = row.links.iter().filter(|link| link.from.patch().index() == e / 2).count();
        assert_eq!(own, 0, "a flat patch does not see itself");
    }
}

#[test]
fn a_closed_room_that_shines_everywhere_is_exact() {
    for reflectance in [0.0, 0.5, 0.9, 0.99] {
        let glb = furnace(reflectance, 1.0);
        let mut settings = settings(6, 6, 1);
        settings.method = Method::Radiosity;
        let prepared = scene(&glb, &settings);
        let truth = 1.0 / (1.0 - f64::from(reflectance));
        let solution = Solution::new(&prepared.scene, Shadows::On, None, Fineness::even(300, 64)).unwrap();
        for e in (0..2 * solution.patches().all().len() as u32).step_by(2) {
            let found = f64::from(solution.mean_arriving(Element(e)).x);
            assert!((found / truth - 1.0).abs() < 3e-6, "{reflectance}: {found} is not {truth}");
        }
        // The part of the light that is added at every step is smaller by the reflectance.
        let residuals = &solution.report().residuals;
        let total = |n: i32| (1.0 - f64::from(reflectance).powi(n + 1)) / (1.0 - f64::from(reflectance));
        for (n, residual) in residuals.iter().enumerate().filter(|_| reflectance > 0.0) {
            let expected = f64::from(reflectance).powi(n as i32 + 1) / total(n as i32 + 1);
            assert!((residual / expected - 1.0).abs() < 1e-6, "{reflectance}, {n}: {residual} {expected}");
        }
        let batch = Schedule::new(settings.size.frame(), 1, 1, 4).batch(0, 0, 0).unwrap();
        let samples = f64::from(batch.block.count);
        let sum = render(&prepared, &settings, batch, &Progress::new()).unwrap();
        for pixel in sum.planes[0].iter().flatten() {
            let found = f64::from(*pixel) / samples;
            assert!((found / truth - 1.0).abs() < 4e-6, "{reflectance}: a pixel is {found}, not {truth}");
        }
    }
}

#[test]
fn bounces_cut_the_series() {
    let glb = furnace(0.5, 1.0);
    for bounces in [0, 1, 2, 3, 6] {
        let mut settings = settings(4, 4, 1);
        settings.method = Method::Radiosity;
        settings.bounces = Some(bounces);
        let prepared = scene(&glb, &settings);
        let batch = Schedule::new(settings.size.frame(), 1, 1, 1).batch(0, 0, 0).unwrap();
        let samples = f64::from(batch.block.count);
        let truth = 2.0 - 0.5_f64.powi(bounces as i32);
        let sum = render(&prepared, &settings, batch, &Progress::new()).unwrap();
        for pixel in sum.planes[0].iter().flatten() {
            assert!(
                (f64::from(*pixel) / samples / truth - 1.0).abs() < 2e-6,
                "{bounces}: {pixel} is not {truth}"
            );
        }
    }
}

#[test]
fn a_convex_body_reflects_the_sky_alone_also_in_a_mirror_image_of_it() {
    let mut glb = Glb::new();
    let material = glb.material(lambert(0.25, 0.0));
    let (positions, triangles) = sphere(Vec3::ZERO, 1.0, 8);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.node(json!({"mesh": mesh, "translation": [0.0, 0.0, -50.0]}));
    glb.node(json!({"mesh": mesh, "scale": [-1.0, 1.0, 1.0]}));
    glb.perspective(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 10.0);
    let settings = in_environment(settings(6, 6, 1), 2.0);
    let prepared = scene(&glb.finish(), &settings);
    assert_eq!(prepared.scene.data.instances.len(), 2);
    // The other body is seen, but at a distance of 50 radii: by less than one in a thousand.
    let solution = Solution::new(&prepared.scene, Shadows::On, None, Fineness::even(1, 1024)).unwrap();
    for pixel in shown(&prepared, &solution, &settings, Reconstruction::Interpolate, 4) {
        assert!((pixel - 0.5).abs().max_element() < 2e-3, "{pixel}");
    }
}

#[test]
fn light_of_a_point_over_a_floor_is_that_of_the_cosine_law_and_the_error_falls_with_the_square_of_the_size() {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(1.0, 0.0), floor(0.0, 4.0, 0.0, 0.0));
    glb.light(json!({"type": "point", "intensity": 10.0}), json!({"translation": [0.25, 1.0, -0.25]}));
    glb.perspective(Vec3::new(0.0, 5.0, 0.1), Vec3::ZERO, 40.0);
    let prepared = scene(&glb.finish(), &settings(4, 4, 1));
    let normalisation = prepared.scene.data.normalisation;
    let errors = [128, 512, 2048, 8192].map(|patches| {
        let fineness = Fineness::even(patches, 256);
        let solution = Solution::new(&prepared.scene, Shadows::On, None, fineness).unwrap();
        assert_eq!(solution.patches().all().len(), patches);
        let (mut sum, mut count) = (0.0_f64, 0);
        for (x, z) in (0..400).map(|i| (f64::from(i % 20) / 10.0 - 0.95, f64::from(i / 20) / 10.0 - 0.95)) {
            let squared = 1.0 + (x - 0.25).powi(2) + (z + 0.25).powi(2);
            let truth = 10.0 / PI / (squared * squared.sqrt());
            let place = normalisation.point(glam::DVec3::new(x, 2.0, z));
            let ray = Ray::new(place, Vec3::NEG_Y);
            let hit = prepared.scene.closest(&ray, || 0).unwrap();
            let (patch, local) = solution.patches().at(hit.instance, hit.triangle, hit.barycentric);
            let found = solution.arriving(Element::new(patch, Side::Front), local).x;
            sum += (f64::from(found) - truth).powi(2);
            count += 1;
        }
        (sum / f64::from(count)).sqrt() / (10.0 / PI)
    });
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0] / 3.0), "{errors:?}");
    assert!(errors[3] < errors[2] / 3.6, "{errors:?}");
}

/// Root mean square over pixels and channels of the difference to a reference, without what the reference's own noise
/// makes of it; the difference of the means, and the noise of the reference's. All relative to the reference's mean.
fn difference(picture: &[Rgb], reference: &Picture) -> [f64; 3] {
    let (mut squares, mut sum, mut whole, mut noise) = (0.0, 0.0, 0.0, 0.0);
    let errors = &reference.errors[0];
    for ((p, r), e) in picture.iter().zip(&reference.planes[0]).zip(errors) {
        for c in 0..3 {
            let off = f64::from(p[c]) - f64::from(r[c]);
            squares += off * off - f64::from(e[c]).powi(2);
            // Channels of a pixel come from the same paths.
            noise += f64::from(e[c]).powi(2) * 3.0;
            sum += off;
            whole += f64::from(r[c]);
        }
    }
    let count = 3.0 * picture.len() as f64;
    [(squares / count).max(0.0).sqrt() / (whole / count), sum / whole, noise.sqrt() / whole]
}

#[test]
fn radiosity_is_path_in_diffuse_scenes_and_its_error_falls_with_the_size_of_patches() {
    let cases = [
        ("cornell", cornell(), [264, 1056, 4224], 1024),
        ("two rooms", two_rooms(), [284, 1124, 4496], 1024),
    ];
    for (name, glb, sizes, samples) in cases {
        let settings = settings(6, 6, 4);
        let prepared = scene(&glb, &settings);
        let reference = rendered(&glb, &settings, samples).picture();
        let found = sizes.map(|patches| {
            let fineness = Fineness::even(patches, 128);
            let solution = Solution::new(&prepared.scene, Shadows::On, None, fineness).unwrap();
            assert_eq!(solution.patches().all().len(), patches, "four times as many: half the size");
            // No surface reflects more than 0.7, so the light that is added falls by that at least.
            let residuals = &solution.report().residuals;
            assert!(residuals.windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{name}: {residuals:?}");
            let picture = |how, n| difference(&shown(&prepared, &solution, &settings, how, n), &reference);
            let [_, mean, noise] = picture(Reconstruction::Gather, 4096);
            [picture(Reconstruction::Interpolate, 2048)[0], mean, noise]
        });
        // In proportion to the size of the patches at least: halved twice.
        let [[coarse, ..], [middle, ..], [fine, mean, noise]] = found;
        assert!(middle < coarse / 1.8 && fine < middle / 1.8 && fine < coarse / 4.0, "{name}: {found:?}");
        // A gathered picture has noise of its own, no more than the reference: so the mean tells. Half of what patches of that
        // size make wrong in the picture without gathering is a wide bound for what they make wrong in its light.
        let tolerance = 0.5 * fine + 4.5 * std::f64::consts::SQRT_2 * noise;
        assert!(mean.abs() < tolerance, "{name}: {found:?}, {tolerance}");
    }
}

#[test]
fn particles_and_equations_find_the_same_light() {
    for (name, glb, environment) in [
        ("closed room", furnace(0.5, 1.0), 0.0),
        ("cornell", cornell(), 0.0),
        ("in the open", body_alone(lambert(0.5, 0.0), cuboid(Vec3::splat(-1.0), Vec3::ONE)), 1.0),
        (
            "point",
            over_floor(0.5, |glb| {
                glb.light(
                    json!({"type": "point", "intensity": 10.0}),
                    json!({"translation": [0.0, 3.0, 0.0]}),
                );
            }),
            0.0,
        ),
    ] {
        let plain = settings(4, 4, 1);
        let settings = if environment > 0.0 { in_environment(plain, environment) } else { plain };
        let prepared = scene(&glb, &settings);
        let fineness = Fineness::even(1000, 256);
        let elements = Solution::new(&prepared.scene, Shadows::On, Some(3), fineness).unwrap();
        let particles = Solution::by_particles(&prepared.scene, 1 << 19, Some(3), 1000).unwrap();
        // All that arrives, and the parts of it that a side of the whole takes.
        let sum = |solution: &Solution, of: &dyn Fn(Element) -> bool| -> f64 {
            let patches = solution.patches().all();
            let all = (0..2 * patches.len() as u32).map(Element).filter(|e| of(*e));
            all.map(|e| f64::from(solution.mean_arriving(e).y) * patches[e.patch().index()].area()).sum()
        };
        let whole = [sum(&elements, &|_| true), sum(&particles, &|_| true)];
        assert!((whole[1] / whole[0] - 1.0).abs() < 0.01, "{name}: {whole:?}");
        for i in 0..prepared.scene.data.meshes[0].triangles.len() as u32 {
            let here = |e: Element| elements.patches().all()[e.patch().index()].triangle == i;
            let part = [sum(&elements, &here), sum(&particles, &here)];
            assert!(
                (part[1] - part[0]).abs() < 0.01 * whole[0],
                "{name}, triangle {i}: {part:?} of {whole:?}"
            );
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_solution() {
    let glb = cornell();
    let mut settings = settings(12, 12, 1);
    settings.method = Method::Radiosity;
    let batch = Schedule::new(settings.size.frame(), 1, 1, 4).batch(0, 0, 0).unwrap();
    let prepared = scene(&glb, &settings);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let fineness = Fineness { even: 256, most: 512, refinements: 2, rays: 32 };
            let solution = Solution::new(&prepared.scene, Shadows::On, None, fineness).unwrap();
            let values: Vec<[u32; 3]> = (0..2 * solution.patches().all().len() as u32)
                .map(|e| solution.mean_arriving(Element(e)).to_array().map(f32::to_bits))
                .collect();
            let patched = Prepared { scene: prepared.scene.clone(), radiosity: Some(Arc::new(solution)) };
            (values, render(&patched, &settings, batch, &Progress::new()).unwrap())
        })
    };
    let one = with(1);
    for threads in [2, 3] {
        let other = with(threads);
        assert!(one == other, "{threads} threads");
    }
}

#[test]
fn patches_are_cut_where_light_varies() {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(0.5, 0.0), floor(0.0, 4.0, 0.0, 0.0));
    glb.light(json!({"type": "point", "intensity": 10.0}), json!({"translation": [1.0, 0.3, 1.0]}));
    glb.perspective(Vec3::new(0.0, 5.0, 0.1), Vec3::ZERO, 40.0);
    let prepared = scene(&glb.finish(), &settings(4, 4, 1));
    let fineness = Fineness { even: 32, most: 256, refinements: 3, rays: 64 };
    let solution = Solution::new(&prepared.scene, Shadows::On, None, fineness).unwrap();
    let patches = solution.patches().all();
    assert!(patches.len() > 128 && patches.len() <= 256, "{}", patches.len());
    let place = prepared.scene.data.normalisation.point(glam::DVec3::new(1.0, 0.0, 1.0));
    let near = |p: &Patch| (p.corners.iter().sum::<Vec3>() / 3.0).distance(place);
    let mut by_distance: Vec<&Patch> = patches.iter().collect();
    by_distance.sort_by(|a, b| near(a).total_cmp(&near(b)));
    let levels = |list: &[&Patch]| list.iter().map(|p| f64::from(p.level)).sum::<f64>() / list.len() as f64;
    let (nearest, farthest) = (levels(&by_distance[..20]), levels(&by_distance[patches.len() - 20..]));
    assert!(nearest >= farthest + 2.0, "{nearest} {farthest}");
}

/// What a viewer shows that takes base colours, those of vertices included, as light, and leaves out what faces away: the
/// points of the rays of [`shown`].
fn unlit(glb: &[u8], settings: &Settings, white: f32, n: u32) -> Vec<Rgb> {
    let Scene { mut data, environment, .. } = open(glb, None, settings).unwrap();
    let eye = data.cameras[0].position;
    for mesh in &mut data.meshes {
        let faces = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
            (b - a).cross(c - a).dot(eye.as_dvec3() - a) > 0.0
        };
        let kept = mesh.triangles.iter().zip(&mesh.materials).filter(|(triangle, _)| faces(triangle));
        (mesh.triangles, mesh.materials) = kept.map(|(triangle, material)| (*triangle, *material)).unzip();
    }
    let views = Views::new(&data.cameras[0], settings.size, None);
    let scene = Scene::new(data, environment, views).unwrap();
    let one = |pixel, k| {
        let ray = camera_ray(&scene, settings, pixel, &Sampler::new(1, 0, pixel, k), Moment::STILL);
        let hit = scene.closest(&ray, || 0)?;
        let at = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, Moment::STILL);
        Some(at.material.shown(&scene.data.textures, &at.at)? * white)
    };
    let pixels = (0..settings.size.height).flat_map(|y| (0..settings.size.width).map(move |x| [x, y]));
    pixels.map(|pixel| (0..n).filter_map(|k| one(pixel, k)).sum::<Rgb>() / n as f32).collect()
}

#[test]
fn a_baked_scene_shows_the_solution() {
    let settings = settings(24, 24, 1);
    let prepared = scene(&cornell(), &settings);
    let fineness = Fineness { even: 512, most: 1024, refinements: 1, rays: 64 };
    let solution = Solution::new(&prepared.scene, Shadows::On, None, fineness).unwrap();
    let truth = shown(&prepared, &solution, &settings, Reconstruction::Interpolate, 4);
    // Brighter than anything but for the lamp in the first, a step of 8 bits then being larger, not in the second.
    for (form, white, tolerance) in [(Form::VertexColours, 20.0, 2e-3), (Form::LightMap(1024), 2.5, 1.5e-2)] {
        let baked = bake(&prepared.scene.data, &solution, form, Some(white)).unwrap();
        let picture = unlit(&baked.glb, &settings, baked.white, 4);
        let (mut squares, mut count) = (0.0, 0);
        for (i, (found, truth)) in
            picture.iter().zip(&truth).enumerate().filter(|(_, (_, t))| t.max_element() < 2.0)
        {
            let off = (*found - *truth).abs().max_element();
            // Three steps of sRGB's eight bits at its steepest, and what texels do not resolve; edges are as they were.
            assert!(off < 0.06, "{form:?}: pixel {i} shows {found}, not {truth}");
            squares += f64::from(off * off);
            count += 1;
        }
        assert!(count > 500);
        let rms = (squares / f64::from(count)).sqrt();
        assert!(rms < tolerance, "{form:?}: {rms}");
        let text = serde_json::from_slice::<Value>(json_chunk(&baked.glb)).unwrap();
        assert_eq!(text["extensionsUsed"], json!(["KHR_materials_unlit"]));
        assert!(text.get("extensionsRequired").is_none());
        assert_eq!(text["asset"]["extras"]["ovtigre"]["white"], json!(baked.white));
        let names: Vec<&str> =
            text["nodes"].as_array().unwrap().iter().filter_map(|n| n["name"].as_str()).collect();
        for name in ["left", "low block", "lamp"] {
            assert!(names.contains(&name), "{names:?}");
        }
        assert_eq!(text["cameras"].as_array().unwrap().len(), 1);
        let map = baked.light_map.map(|map| read_layers(&map.exr()).unwrap());
        assert_eq!(map.is_some(), form != Form::VertexColours);
        assert!(
            map.is_none_or(|m| m.channels["R"].iter().fold(0.0_f32, |a, b| a.max(*b)) > 11.9),
            "the lamp"
        );
    }
}

/// The document in a binary glTF.
fn json_chunk(glb: &[u8]) -> &[u8] {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    &glb[20..20 + length]
}

#[test]
fn a_textured_floor_keeps_its_texture_when_baked() {
    let glb = ovtigre_tests::room::room();
    let settings = settings(24, 24, 1);
    let prepared = scene(&glb, &settings);
    let solution = Solution::new(&prepared.scene, Shadows::On, None, Fineness::even(1, 16)).unwrap();
    let baked = bake(&prepared.scene.data, &solution, Form::VertexColours, Some(5.0)).unwrap();
    let found = unlit(&baked.glb, &settings, baked.white, 1);
    let mut seen = 0;
    for (i, found) in found.iter().enumerate() {
        let pixel = [i as u32 % 24, i as u32 / 24];
        let ray = camera_ray(&prepared.scene, &settings, pixel, &Sampler::new(1, 0, pixel, 0), Moment::STILL);
        let Some(hit) = prepared.scene.closest(&ray, || 0) else { continue };
        if prepared.scene.data.node_name(hit.instance, hit.triangle) != "floor" {
            continue;
        }
        let (patch, local) = solution.patches().at(hit.instance, hit.triangle, hit.barycentric);
        let element = Element::new(patch, Side::Front);
        let truth = Appearance::at(&prepared.scene.data, &solution, element, local).radiance;
        // Its gloss varies by a texture, too, and with it what reaches the base: by some percent, seen at vertices only.
        let off = (*found / truth - 1.0).abs().max_element();
        assert!(off < 0.05, "pixel {i} shows {found}, not {truth}");
        seen += 1;
    }
    assert!(seen > 60, "{seen} points of the floor are seen");
}

#[test]
fn the_command_bakes_and_refuses_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("box.glb"), cornell()).unwrap();
    let (scene, out) = (at("box.glb"), at("out.glb"));
    let report = at("report.json");
    let done = run(["bake", &scene, "-o", &out, "--patches", "300", "--report", &report]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report: Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert_eq!(report["certified"], json!(false));
    assert_eq!(report["residuals"].as_array().unwrap().len(), report["iterations"]);
    assert!(open(std::fs::read(&out).unwrap(), None, &settings(4, 4, 1)).is_ok());
    let light = ["--method", "light", "--patches", "300", "--particles", "10000", "--as", "light-map"];
    let done = run(["bake", &scene, "-o", &out].into_iter().chain(light));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(open(std::fs::read(&out).unwrap(), None, &settings(4, 4, 1)).is_ok());
    std::fs::write(at("bad.glb"), b"hello").unwrap();
    let cases: [(&[&str], &str); 5] = [
        (&[&scene, "-o", &at("out.gltf")], "ends in .glb"),
        (&[&scene, "-o", &at("no/where/out.glb")], "no such folder"),
        (&[&at("bad.glb"), "-o", &out], "bad.glb"),
        (&[&scene, "-o", &out, "--patches", "9", "--as", "light-map", "--size", "100"], "power of two"),
        (&[&scene, "-o", &out, "--patches", "9", "--as", "light-map", "--size", "16"], "do not fit"),
    ];
    for (arguments, says) in cases {
        let output = run(["bake"].iter().chain(arguments));
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(errors.len() == 1 && errors[0].contains(says), "{arguments:?}: {text}");
    }
}

#[test]
fn a_farm_renders_by_radiosity() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("furnace.glb"), furnace(0.5, 1.0)).unwrap();
    let out = at("out.exr");
    let flags = ["--method", "radiosity", "--size", "8x8", "--samples", "16", "--workers", "1", "-o", &out];
    let done = run(["render", &at("furnace.glb")].iter().copied().chain(flags));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let picture = read_layers(&std::fs::read(out).unwrap()).unwrap();
    for value in &picture.channels["G"] {
        assert!((value - 2.0).abs() < 1e-5, "{value}");
    }
}
