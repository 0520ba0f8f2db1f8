//! All methods agree: in the whole picture and in its blocks of 16×16 pixels.

use ovtigre_core::settings::{Method, Settings};
use ovtigre_tests::{
    matrix::{self, Case},
    picture::rendered,
};

/// Samples a pixel and replicate; 0 where a method does not make all paths.
#[derive(Clone, Copy)]
struct Samples {
    /// And by `caustics`, which makes what it makes.
    path: u32,
    both: u32,
    light: u32,
}

/// Asserts that light from the eye, from the light and from both is the same, at an error of 0.3 % at most.
fn agree(Case { what, glb, settings }: &Case, samples: Samples) {
    let by = |method: Method| Settings { method, ..settings.clone() };
    let both = rendered(glb, &by(Method::Bidirectional), samples.both);
    let others =
        [(Method::Path, samples.path), (Method::Caustics, samples.path), (Method::Light, samples.light)];
    for (method, samples) in others {
        if samples > 0 {
            let other = rendered(glb, &by(method), samples);
            both.assert_same(&other, 0.003, &format!("{what}: bidirectional and {method:?}"));
        }
    }
}

#[test]
fn a_diffuse_room() {
    agree(&matrix::diffuse(), Samples { path: 4, both: 1, light: 1 });
}

#[test]
fn smooth_normals_gloss_and_metal() {
    agree(&matrix::smooth_normals(), Samples { path: 6, both: 1, light: 8 });
}

#[test]
fn rough_glass() {
    agree(&matrix::ball_of_glass(0.5), Samples { path: 8, both: 2, light: 16 });
}

#[test]
fn smooth_glass() {
    agree(&matrix::ball_of_glass(0.0), Samples { path: 16, both: 2, light: 0 });
}

#[test]
fn coats_cloth_and_leaves() {
    agree(&matrix::coats_cloth_and_leaves(), Samples { path: 6, both: 2, light: 8 });
}

#[test]
fn coated_plastic_and_mixtures() {
    agree(&matrix::coated(), Samples { path: 4, both: 1, light: 0 });
}

#[test]
fn a_point() {
    agree(&matrix::point(), Samples { path: 4, both: 1, light: 2 });
}

#[test]
fn a_spot() {
    agree(&matrix::spot(), Samples { path: 2, both: 1, light: 4 });
}

#[test]
fn a_sun() {
    agree(&matrix::sunny(), Samples { path: 2, both: 1, light: 4 });
}

#[test]
fn a_sky() {
    agree(&matrix::sky(), Samples { path: 8, both: 6, light: 32 });
}

#[test]
fn many_lights() {
    agree(&matrix::many_lights(), Samples { path: 6, both: 3, light: 8 });
}

#[test]
fn normal_maps_and_textured_lamps() {
    agree(&matrix::maps(), Samples { path: 4, both: 2, light: 16 });
}

#[test]
fn things_that_move() {
    agree(&matrix::moving(), Samples { path: 4, both: 2, light: 8 });
}

#[test]
fn a_lens() {
    agree(&matrix::lens(), Samples { path: 4, both: 1, light: 2 });
}

#[test]
fn parallel_rays() {
    agree(&matrix::parallel(), Samples { path: 2, both: 1, light: 4 });
}

#[test]
fn parallel_rays_under_a_sky() {
    let mut case = matrix::parallel_under_sky();
    agree(&case, Samples { path: 2, both: 2, light: 0 });
    // All rays that see the sky itself are parallel: none of its light goes there but by a probability of zero.
    case.settings.paths = "L(D|S)+E".to_owned();
    agree(&case, Samples { path: 2, both: 2, light: 16 });
}
