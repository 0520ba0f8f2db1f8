//! Depth of field: how wide the picture of a small bright square is, and how much light is in it.

use glam::Vec3;
use ovtigre_core::settings::{Lens, Method, Settings, Strategy};
use ovtigre_tests::{
    glb::Glb,
    picture::{Rendered, rendered, settings},
    scenes::{lambert, quad},
};
use std::f64::consts::PI;

/// Pixels a side.
const SIDE: u32 = 32;
/// Angle of view in degrees.
const ANGLE: f32 = 30.0;
const RADIANCE: f64 = 50.0;
const FOCUS: f64 = 2.0;

/// A bright square of a side that faces the eye at a distance.
fn square(side: f64, distance: f64) -> Vec<u8> {
    let mut glb = Glb::new();
    let half = (side / 2.0) as f32;
    let at = |x: f32, y: f32| Vec3::new(x * half, y * half, -distance as f32);
    let corners = quad([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]);
    glb.body(lambert(0.0, RADIANCE as f32), corners);
    glb.perspective(Vec3::ZERO, Vec3::NEG_Z, ANGLE);
    glb.finish()
}

/// Side of a pixel in the plane in focus.
fn pixel() -> f64 {
    2.0 * FOCUS * f64::from(ANGLE / 2.0).to_radians().tan() / f64::from(SIDE)
}

/// Side of a square whose picture is three pixels wide, if it is at a distance. The picture's variance is then that of its
/// pixels but for 0.002: the error of sums over pixels falls with the spectrum at one cycle a pixel, where it has a zero.
fn side(distance: f64) -> f64 {
    3.0 * pixel() * distance / FOCUS
}

/// A pixel: how far its middle is from the picture's along both axes, in pixels, and its red with its error.
struct Pixel {
    at: [f64; 2],
    value: f64,
    error: f64,
}

fn pixels(rendered: &Rendered) -> Vec<Pixel> {
    let at = |i: u32| f64::from(i) + 0.5 - f64::from(SIDE) / 2.0;
    let picture = rendered.picture();
    let red = |plane: &[[f32; 3]], i: u32| f64::from(plane[i as usize][0]);
    let one = |i: u32| Pixel {
        at: [at(i % SIDE), at(i / SIDE)],
        value: red(&picture.planes[0], i),
        error: red(&picture.errors[0], i),
    };
    (0..SIDE * SIDE).map(one).collect()
}

/// Asserts that the picture of the square is a disk with the radius of the circle of confusion, c = a |d − F| / d in the
/// plane in focus, smeared over the square's own picture, and that its light is that of the square.
fn assert_blur(rendered: &Rendered, aperture: f64, distance: f64, power: f64, what: &str) {
    let image = side(distance) * FOCUS / distance / pixel();
    let confusion = aperture * (distance - FOCUS).abs() / distance / pixel();
    let pixels = pixels(rendered);
    let truth = RADIANCE * image * image;
    let light: f64 = pixels.iter().map(|p| p.value).sum();
    let error = rendered.mean().1 * f64::from(SIDE * SIDE);
    assert!(error <= power * truth, "{what}: the error {error} of {light} is too large to find a bias");
    assert!((light - truth).abs() <= 4.5 * error + 1e-5 * truth, "{what}: {light} ± {error}, not {truth}");
    // Along an axis a disk has the variance c²/4, a square or a pixel of side s has s²/12.
    let truth = confusion * confusion / 4.0 + (image * image + 1.0) / 12.0;
    for axis in 0..2 {
        let spread = pixels.iter().map(|p| p.value * p.at[axis].powi(2)).sum::<f64>() / light;
        let squares = pixels.iter().map(|p| (p.error * (p.at[axis].powi(2) - truth)).powi(2));
        let error = squares.sum::<f64>().sqrt() / light;
        assert!(error <= 0.01 * truth, "{what}: the error {error} of {spread} is too large to find a bias");
        let off = (spread - truth).abs();
        assert!(
            off <= 5.0 * error + 0.002,
            "{what}: variance {spread} ± {error} along axis {axis}, not {truth}"
        );
    }
    // From middle to corner, of the square's picture and a pixel.
    let smear = (image + 1.0) * 0.5_f64.sqrt();
    let flat = RADIANCE * image * image / (PI * confusion * confusion);
    for Pixel { at: [x, y], value, error } in pixels {
        let r = x.hypot(y);
        if r > confusion + smear {
            assert_eq!(value, 0.0, "{what}: light outside of the disk, at {x}, {y}");
        } else if r < confusion - smear {
            let off = (value - flat).abs();
            assert!(off <= 5.5 * error + 1e-5 * flat, "{what}: {value} ± {error} at {x}, {y}, not {flat}");
        }
    }
}

fn through(aperture: f64) -> Settings {
    let mut settings = settings(SIDE, SIDE, 16);
    settings.lens = Some(Lens { radius: aperture, focus_distance: FOCUS });
    settings
}

#[test]
fn what_is_out_of_focus_is_a_disk_and_keeps_its_light() {
    for distance in [1.2, 5.0] {
        for aperture in [0.1, 0.25] {
            let picture = rendered(&square(side(distance), distance), &through(aperture), 128);
            assert_blur(&picture, aperture, distance, 0.005, &format!("{distance} m, lens {aperture} m"));
        }
    }
}

#[test]
fn light_through_the_lens_is_blurred_alike() {
    let (distance, aperture) = (1.2, 0.25);
    let glb = square(side(distance), distance);
    let all = [(0, 2), (1, 1), (2, 0)].map(|(s, t)| Strategy { s, t }).to_vec();
    let cases = [
        ("light", Method::Light, Vec::new(), 64),
        ("bidirectional", Method::Bidirectional, Vec::new(), 32),
        ("every technique", Method::Bidirectional, all, 32),
        ("light that meets the lens", Method::Bidirectional, vec![Strategy { s: 2, t: 0 }], 64),
    ];
    for (what, method, strategies, samples) in cases {
        let settings = Settings { method, strategies, ..through(aperture) };
        assert_blur(&rendered(&glb, &settings, samples), aperture, distance, 0.005, what);
    }
}
