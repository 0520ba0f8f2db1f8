//! Finite elements against closed forms and against paths.

use glam::Vec3;
use ovtigre_core::{
    film::{estimate::Picture, schedule::Schedule},
    math::colour::Rgb,
    method::radiosity::{Reconstruction, sample},
    radiosity::{
        element::Element,
        fineness::Fineness,
        form_factor::rows,
        hemisphere::{Sources, Surroundings},
        patch::{Patch, Patches},
        solution::Solution,
    },
    render::{batch::render, prepare::Prepared, progress::Progress},
    sampler::Sampler,
    scene::interaction::Side,
    settings::{CameraChoice, Method, Settings, Shadows},
    trace::ray::Ray,
};
use ovtigre_tests::{
    glb::Glb,
    picture::{in_environment, rendered, scene, settings},
    scenes::{add, cornell, flipped, floor, furnace, lambert, quad, sphere, two_rooms},
};
use rayon::prelude::*;
use serde_json::json;
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
/// makes of it, and the difference of the means; both relative to the reference's mean.
fn difference(picture: &[Rgb], reference: &Picture) -> (f64, f64) {
    let (mut squares, mut sum, mut whole) = (0.0, 0.0, 0.0);
    let errors = reference.error.as_ref().unwrap();
    for ((p, r), e) in picture.iter().zip(&reference.planes[0]).zip(errors) {
        for c in 0..3 {
            let off = f64::from(p[c]) - f64::from(r[c]);
            squares += off * off - f64::from(e[c]).powi(2);
            sum += off;
            whole += f64::from(r[c]);
        }
    }
    let count = 3.0 * picture.len() as f64;
    ((squares / count).max(0.0).sqrt() / (whole / count), sum / whole)
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
            [picture(Reconstruction::Interpolate, 2048).0, picture(Reconstruction::Gather, 256).1]
        });
        // In proportion to the size of the patches at least: halved twice.
        let [[coarse, _], [middle, _], [fine, mean]] = found;
        assert!(middle < coarse / 1.8 && fine < middle / 1.8 && fine < coarse / 4.0, "{name}: {found:?}");
        // Gathered pictures have noise of their own, so only their mean tells.
        assert!(mean.abs() < 0.015, "{name}: {found:?}");
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
