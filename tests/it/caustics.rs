//! Caustics with closed forms, on a Lambert floor that is looked at straight from above.

use glam::{DVec3, Vec3};
use ovtigre_core::settings::{Layer, Method, Settings, Shows};
use ovtigre_tests::{
    glb::Glb,
    irradiance,
    picture::{Rendered, rendered, settings},
    scenes::{cuboid, flipped, floor, glass, lambert, mirror, quad},
};
use serde_json::{Value, json};
use std::f64::consts::PI;

const REFLECTANCE: f32 = 0.5;
const INTENSITY: f64 = 3.0;
/// What metal mirrors reflect head on.
const F0: f64 = 0.8;

fn by(method: Method, paths: &str, settings: &Settings) -> Settings {
    Settings { method, paths: paths.to_owned(), ..settings.clone() }
}

fn layer(paths: &str) -> Layer {
    Layer { name: paths.to_owned(), shows: Shows::Paths(paths.to_owned()) }
}

/// A metal mirror that takes a part of the light.
fn silver() -> Value {
    let mut silver = mirror();
    silver["pbrMetallicRoughness"]["baseColorFactor"] = json!([F0, F0, F0, 1.0]);
    silver
}

fn point(glb: &mut Glb, at: DVec3) {
    glb.light(json!({"type": "point", "intensity": INTENSITY}), json!({"translation": at.to_array()}));
}

/// The part of a floor that is seen.
#[derive(Clone, Copy)]
struct Window {
    centre: DVec3,
    width: f64,
    height: f64,
}

impl Window {
    /// Parallel rays from `above` the floor.
    fn camera(self, glb: &mut Glb, above: f64) {
        let eye = (self.centre + DVec3::Y * above).as_vec3();
        glb.orthographic(eye, self.centre.as_vec3(), self.width as f32, self.height as f32);
    }

    /// Mean of the radiance of a floor with an irradiance over a pixel, one of `columns` × `rows`.
    fn radiance(self, [x, y]: [u32; 2], [columns, rows]: [u32; 2], irradiance: impl Fn(DVec3) -> f64) -> f64 {
        const STEPS: u32 = 64;
        let sum: f64 = (0..STEPS * STEPS)
            .map(|i| {
                let part = |pixel: u32, i: u32, count: u32| {
                    (f64::from(pixel) + (f64::from(i) + 0.5) / f64::from(STEPS)) / f64::from(count) - 0.5
                };
                let (u, v) = (part(x, i % STEPS, columns), part(y, i / STEPS, rows));
                irradiance(self.centre + DVec3::new(u * self.width, 0.0, v * self.height))
            })
            .sum();
        f64::from(REFLECTANCE) / PI * sum / f64::from(STEPS * STEPS)
    }

    /// Asserts that each pixel and their mean are what the floor's irradiance says: within 5 standard errors, which are at
    /// most `power` of the truth, for the mean and for a pixel.
    fn assert(
        self,
        rendered: &Rendered,
        plane: usize,
        power: [f64; 2],
        irradiance: impl Fn(DVec3) -> f64,
        what: &str,
    ) {
        let picture = rendered.picture();
        let size = [picture.size.width, picture.size.height];
        let truths: Vec<f64> = (0..size[0] * size[1])
            .map(|i| self.radiance([i % size[0], i / size[0]], size, &irradiance))
            .collect();
        let check = |mean: f64, error: f64, truth: f64, power: f64, which: &str| {
            assert!(
                error <= power * truth,
                "{what}, {which}: the error {error} of {mean} is too large to find a bias"
            );
            let off = (mean - truth).abs();
            assert!(off <= 5.0 * error + 1e-5 * truth, "{what}, {which}: {mean} ± {error}, not {truth}");
        };
        let (mean, error) = rendered.mean_of(plane);
        check(mean, error, truths.iter().sum::<f64>() / truths.len() as f64, power[0], "all of it");
        for (i, truth) in truths.into_iter().enumerate() {
            let [mean, error] = [&picture.planes, &picture.errors].map(|p| f64::from(p[plane][i][0]));
            check(mean, error, truth, power[1], &format!("pixel {i}"));
        }
        assert_eq!(rendered.invalid(), 0, "{what}: samples were dropped");
    }
}

/// The mirror's height.
const MIRROR: f64 = 1.5;

/// A floor under a mirror.
fn under_a_mirror(material: Value, window: Window, add: impl FnOnce(&mut Glb)) -> Vec<u8> {
    let mut glb = Glb::new();
    glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 6.0, 0.0, 0.0));
    glb.body(material, flipped(floor(MIRROR as f32, 6.0, 0.0, 0.0)));
    add(&mut glb);
    window.camera(&mut glb, 0.4);
    glb.finish()
}

/// The point that a mirror at a height shows.
fn mirrored(point: DVec3) -> DVec3 {
    point.with_y(2.0 * MIRROR - point.y)
}

#[test]
fn a_plane_mirror_shows_a_second_point_light() {
    let window = Window { centre: DVec3::new(0.6, 0.0, 0.3), width: 1.0, height: 1.0 };
    let light = DVec3::new(0.0, 1.0, 0.0);
    let glb = under_a_mirror(silver(), window, |glb| point(glb, light));
    let truth = |p: DVec3| {
        let towards = mirrored(light) - p;
        let reflected = irradiance::schlick(F0, towards.y / towards.length());
        INTENSITY * reflected * irradiance::of_point(towards)
    };
    let direct = |p: DVec3| INTENSITY * irradiance::of_point(light - p);
    let small = settings(4, 4, 16);
    for (method, samples) in [(Method::Light, 2048), (Method::Bidirectional, 1024), (Method::Caustics, 1024)]
    {
        let alone = rendered(&glb, &by(method, "LS_MDE", &small), samples);
        window.assert(&alone, 0, [0.006, 0.03], truth, &format!("{method:?}"));
        let mut with_layers = by(method, "L.{0,3}E", &small);
        with_layers.layers = vec![layer("LS_MDE"), layer("LDE")];
        let layers = rendered(&glb, &with_layers, samples);
        window.assert(&layers, 1, [0.006, 0.03], truth, &format!("{method:?}, as a layer"));
        window.assert(&layers, 2, [0.006, 0.03], direct, &format!("{method:?}, direct"));
    }
    let mut photon = by(Method::Photon, "LS_MDE", &settings(64, 64, 16));
    photon.layers.push(Layer { name: "narrow".to_owned(), shows: Shows::Narrow });
    let photons = rendered(&glb, &photon, 4);
    let mean = window.radiance([0, 0], [1, 1], truth);
    let ((wide, error), (narrow, _)) = (photons.mean(), photons.mean_of(1));
    // Where irradiance is smooth, a disk of radius ρ is off by ρ² ΔE / 8 and terms of ρ⁴: half the area, half the bias. The
    // radius starts at 0.27 here, where ρ² ΔE / 8 is at most 1.4 % of E.
    assert!((wide - mean).abs() <= 0.014 * mean, "photons: {wide} ± {error}, not {mean}");
    let extrapolated = 2.0 * narrow - wide;
    let off = (extrapolated - mean).abs();
    assert!(off <= 10.0 * error + 0.0005 * mean, "photons: {extrapolated} from {wide} ± {error}, not {mean}");
    let (nothing, _) = rendered(&glb, &by(Method::Path, "LS_MDE", &small), 64).mean();
    assert_eq!(nothing, 0.0, "no walk from the eye meets a point");
}

#[test]
fn photons_reach_a_caustic_that_is_seen_in_a_mirror() {
    // From a point to a mirror, to the floor, to the mirror again, to parallel rays: no joint can make that.
    let (light, slope) = (DVec3::new(0.0, 1.0, 0.0), 0.5_f64);
    let cos = 1.0 / (1.0 + slope * slope).sqrt();
    let window = Window { centre: DVec3::new(0.6, 0.0, 0.3), width: 0.4 / cos, height: 0.4 };
    let eye = DVec3::new(0.6 - slope * (2.0 * MIRROR - 0.2), 0.2, 0.3);
    let mut glb = Glb::new();
    glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 6.0, 0.0, 0.0));
    glb.body(silver(), flipped(floor(MIRROR as f32, 6.0, 0.0, 0.0)));
    point(&mut glb, light);
    glb.orthographic(eye.as_vec3(), (eye + DVec3::new(slope, 1.0, 0.0)).as_vec3(), 0.4, 0.4);
    let glb = glb.finish();
    let truth = |p: DVec3| {
        let towards = mirrored(light) - p;
        let reflected = irradiance::schlick(F0, towards.y / towards.length());
        INTENSITY * reflected * irradiance::of_point(towards)
    };
    let mean = irradiance::schlick(F0, cos) * window.radiance([0, 0], [1, 1], truth);
    let photons = rendered(&glb, &by(Method::Photon, "LS_MDS_ME", &settings(64, 64, 16)), 4);
    let (found, error) = photons.mean();
    assert!(error < 0.004 * mean, "the error {error} of {found} is too large to find a bias");
    // As above, ρ² ΔE / 8 is at most 1.4 % of E.
    assert!((found - mean).abs() <= 0.014 * mean + 4.5 * error, "{found} ± {error}, not {mean}");
    for method in [Method::Path, Method::Light, Method::Bidirectional, Method::Caustics] {
        let (nothing, _) = rendered(&glb, &by(method, "LS_MDS_ME", &settings(4, 4, 16)), 64).mean();
        assert_eq!(nothing, 0.0, "{method:?}");
    }
}

#[test]
fn a_plane_mirror_shows_a_second_lamp() {
    let window = Window { centre: DVec3::new(1.3, 0.0, 0.2), width: 1.8, height: 1.8 };
    // Its front up, so that the mirror alone is lit; it does not stand between the window and its image.
    let (lamp, triangles) = floor(1.0, 1.5, -1.9, 0.0);
    let corners: Vec<DVec3> = lamp.iter().map(|p| mirrored(p.as_dvec3())).collect();
    let glb = under_a_mirror(mirror(), window, |glb| {
        glb.body(lambert(0.0, 2.0), (lamp, triangles));
    });
    let truth = |p: DVec3| 2.0 * irradiance::of_polygon(&corners.iter().map(|c| *c - p).collect::<Vec<_>>());
    let small = settings(4, 4, 16);
    let light = [(Method::Light, 4096), (Method::Bidirectional, 1024), (Method::Caustics, 1024)];
    for (method, samples) in [(Method::Path, 2048)].into_iter().chain(light) {
        let alone = rendered(&glb, &by(method, "LS_MDE", &small), samples);
        window.assert(&alone, 0, [0.008, 0.06], truth, &format!("{method:?}"));
    }
}

/// Irradiance at a distance `r` from the foot of a light of intensity one, `a` above an interface and with the floor `b`
/// below it: r = a tan θ₁ + b tan θ₂, E = T(θ₁) sin θ₁ / (r dr/dθ₁).
fn refracted(eta: f64, a: f64, b: f64, r: f64) -> f64 {
    let inside = |sin: f64| sin / eta / (1.0 - (sin / eta).powi(2)).sqrt();
    let (mut low, mut high) = (0.0_f64, PI / 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let reached = a * middle.tan() + b * inside(middle.sin());
        if reached < r { low = middle } else { high = middle }
    }
    let (sin, cos) = low.sin_cos();
    let cos_inside = (1.0 - (sin / eta).powi(2)).sqrt();
    let widening = a / (cos * cos) + b / (cos_inside * cos_inside) * cos / (eta * cos_inside);
    (1.0 - irradiance::fresnel(eta, cos)) * sin / (r * widening)
}

#[test]
fn a_flat_interface_refracts_as_snell_and_fresnel_say() {
    let (eta, a, b) = (1.5, 0.5, 1.0);
    let window = Window { centre: DVec3::new(1.4, -b, 0.0), width: 2.4, height: 0.6 };
    let mut glb = Glb::new();
    // The floor and the camera are inside of the glass, so that light crosses its upper side alone.
    glb.body(glass(eta as f32), cuboid(Vec3::new(-5.0, -2.0, -5.0), Vec3::new(5.0, 0.0, 5.0)));
    glb.body(lambert(REFLECTANCE, 0.0), floor(-b as f32, 9.0, 0.0, 0.0));
    point(&mut glb, DVec3::Y * a);
    window.camera(&mut glb, 0.5);
    let glb = glb.finish();
    let truth = |p: DVec3| INTENSITY * refracted(eta, a, b, p.with_y(0.0).length());
    for (method, samples) in [(Method::Light, 4096), (Method::Bidirectional, 2048), (Method::Caustics, 2048)]
    {
        let alone = rendered(&glb, &by(method, "LS_MDE", &settings(8, 2, 16)), samples);
        window.assert(&alone, 0, [0.005, 0.04], truth, &format!("{method:?}"));
    }
}

#[test]
fn two_mirrors_show_a_geometric_row_of_lights() {
    let window = Window { centre: DVec3::new(0.0, 0.0, 0.1), width: 1.0, height: 1.0 };
    let light = DVec3::new(0.3, 2.0, 0.0);
    let mut glb = Glb::new();
    glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 6.0, 0.0, 0.0));
    for x in [-1.0, 1.0] {
        let at = |y: f32, z: f32| Vec3::new(x, y, z);
        glb.body(silver(), quad([at(-0.1, 1.5), at(-0.1, -1.5), at(2.5, -1.5), at(2.5, 1.5)]));
    }
    point(&mut glb, light);
    window.camera(&mut glb, 1.0);
    let glb = glb.finish();
    // After k reflections the light seems to be at (−1)ᵏ x ± 2k, and its cosine with each mirror is the same.
    let of_order = |k: i32, p: DVec3| {
        let folded = f64::from(if k % 2 == 0 { 1 } else { -1 }) * light.x;
        let places =
            if k == 0 { vec![folded] } else { vec![folded + f64::from(2 * k), folded - f64::from(2 * k)] };
        let seen = places.into_iter().map(|x| {
            let towards = light.with_x(x) - p;
            irradiance::schlick(F0, (towards.x / towards.length()).abs()).powi(k)
                * irradiance::of_point(towards)
        });
        INTENSITY * seen.sum::<f64>()
    };
    for (method, samples) in [(Method::Light, 4096), (Method::Bidirectional, 2048), (Method::Caustics, 2048)]
    {
        let mut settings = by(method, "LS_M*DE", &settings(4, 4, 16));
        settings.layers = (0..4).map(|k| layer(&format!("LS_M{{{k}}}DE"))).collect();
        let picture = rendered(&glb, &settings, samples);
        for k in 0..4 {
            let power = [[0.005, 0.02], [0.01, 0.04], [0.02, 0.1], [0.04, 0.2]][k as usize];
            let what = format!("{method:?}, {k} reflections");
            window.assert(&picture, k as usize + 1, power, |p| of_order(k, p), &what);
        }
    }
}
