//! Photons agree with paths from both ends, where their radius goes to zero.

use ovtigre_core::{
    film::size::Size,
    settings::{Layer, Method, Settings, Shows},
};
use ovtigre_tests::{
    matrix::{self, Case},
    picture::{Parts, rendered},
};

/// Pixels a side. The radius of gathering is two pixels as wide as they are where they cover the scene: less
/// than what these scenes have between surfaces that face the same way, even with half as many pixels.
const SIDE: u32 = 144;

/// What photons show at radius zero, extrapolated from four radii: those of pictures with `SIDE` pixels a side and with half
/// as many, and of half the area of gathering in each. What edges and corners take away is in proportion to the radius and
/// its square, what curved surfaces and smearing do is to its square: both are taken out, replicate by replicate, so that
/// the spread of what remains is the error of the result.
fn without_radius(Case { what, glb, settings }: &Case, passes: u32) -> Parts {
    let at = |side: u32| {
        let mut settings = Settings { method: Method::Photon, ..settings.clone() };
        settings.size = Size { width: side, height: side };
        settings.layers.push(Layer { name: "narrow".to_owned(), shows: Shows::Narrow });
        let picture = rendered(glb, &settings, passes);
        assert_eq!(picture.invalid(), 0, "{what}: samples were dropped");
        let linear = |[wide, narrow]: [f64; 2]| wide + (narrow - wide) / (1.0 - 0.5_f64.sqrt());
        Parts::combined([&picture.parts(0), &picture.parts(1)], linear)
    };
    Parts::combined([&at(SIDE), &at(SIDE / 2)], |[fine, coarse]| fine + (fine - coarse) / 3.0)
}

/// Asserts that photons show what paths from both ends do, with so many samples a pixel and replicate of one and passes
/// of the other, at an error of 0.3 % at most.
fn agree(case: &Case, samples: u32, passes: u32) {
    let settings = Settings { method: Method::Bidirectional, ..case.settings.clone() };
    let both = rendered(&case.glb, &settings, samples);
    let p = without_radius(case, passes);
    both.parts(0).assert_same(&p, 0.003, &format!("{}: bidirectional and photons", case.what));
}

#[test]
fn in_a_diffuse_room() {
    agree(&matrix::diffuse(), 1, 2);
}

#[test]
fn on_smooth_normals_gloss_and_metal() {
    agree(&matrix::smooth_normals(), 1, 2);
}

#[test]
fn on_rough_glass() {
    agree(&matrix::ball_of_glass(0.8), 4, 3);
}

#[test]
fn around_smooth_glass() {
    agree(&matrix::ball_of_glass(0.0), 3, 3);
}

#[test]
fn on_coated_plastic_and_mixtures() {
    agree(&matrix::coated(), 1, 2);
}

#[test]
fn on_coats_sheen_and_leaves() {
    agree(&matrix::coats_cloth_and_leaves(), 2, 2);
}

#[test]
fn from_a_point() {
    agree(&matrix::point(), 1, 2);
}

#[test]
fn from_a_spot() {
    agree(&matrix::spot(), 1, 2);
}

#[test]
fn from_a_sun() {
    agree(&matrix::sunny(), 1, 2);
}

#[test]
fn from_a_sky() {
    agree(&matrix::sky(), 8, 4);
}

#[test]
fn from_many_lights() {
    agree(&matrix::many_lights(), 2, 2);
}

#[test]
fn on_normal_maps_from_textured_lamps() {
    agree(&matrix::maps(), 2, 2);
}

#[test]
fn of_one_moment_each_pass() {
    agree(&matrix::moving(), 2, 2);
}

#[test]
fn through_a_lens() {
    agree(&matrix::lens(), 1, 2);
}

#[test]
fn by_parallel_rays() {
    agree(&matrix::parallel(), 1, 2);
}

#[test]
fn by_parallel_rays_under_a_sky() {
    agree(&matrix::parallel_under_sky(), 2, 2);
}

#[test]
fn tell_their_bias() {
    // What photons miss around edges shrinks with their radius; half the area of gathering tells how much is missing.
    let Case { glb, settings, .. } = matrix::diffuse();
    let (path, _) = rendered(&glb, &settings, 16).mean();
    let mut photon = Settings { method: Method::Photon, ..settings.clone() };
    photon.layers.push(Layer { name: "narrow".to_owned(), shows: Shows::Narrow });
    let picture = rendered(&glb, &photon, 8);
    let ((wide, error), (narrow, _)) = (picture.mean(), picture.mean_of(1));
    // What is missing around edges is in proportion to the radius.
    let extrapolated = wide + (narrow - wide) / (1.0 - 0.5_f64.sqrt());
    assert!(path - wide > 4.5 * error, "{path} {wide}: there is no bias to tell");
    assert!((path - extrapolated).abs() < 0.5 * (path - wide), "{path}: {wide}, {narrow}, {extrapolated}");
}
