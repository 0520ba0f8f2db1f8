//! Lights that touch walls, that are tiny or huge, that differ by many decades.

use super::{
    budget::Budget,
    case::{Case, Trial},
    finding::Finding,
    picture_trial::{ALL, by, mean_is_by},
};
use crate::{
    glb::Glb,
    irradiance,
    picture::{rendered_of, scene},
    scenes::{cuboid, flipped, floor, lambert, quad},
};
use glam::{DVec3, Vec3};
use ovtigre_core::{
    film::size::{Region, Size},
    settings::{Method, Settings},
};
use std::f64::consts::PI;

const GROUP: &str = "Lights";
const REFLECTANCE: f32 = 0.5;
const EYE: [Method; 2] = [Method::Path, Method::Bidirectional];

/// All of them.
pub fn cases() -> Vec<Case> {
    let corner = vec![wall_z(), wall_x()];
    vec![
        over_floor(
            "a lamp that stands on the floor",
            "1/d² where a light touches what it lights",
            &[wall_z()],
            [0.25, 0.25],
            &ALL,
        ),
        over_floor(
            "two lamps that meet in a corner of the floor",
            "light from all of two walls, seen from their corner",
            &corner,
            [0.25, 0.25],
            &ALL,
        ),
        over_floor(
            "a lamp of 10⁻⁴ m",
            "solid angles of 10⁻⁸ sr",
            &[square(0.4, 1.0, 0.1, 1e-4)],
            [0.0; 2],
            &ALL,
        ),
        over_floor(
            "a lamp of 10⁴ m",
            "half the sky from one light",
            &[square(0.0, 1.0, 0.0, 1e4)],
            [0.0; 2],
            &EYE,
        ),
        over_floor(
            "a sun of 10⁻³ degrees",
            "a lamp of 2⁻⁹ m in 112 m, placed where f32 has it exactly: 3 · 10⁻¹⁰ sr",
            &[square(0.0, 112.0, 0.0, 0.001_953_125)],
            [0.0; 2],
            &EYE,
        ),
        over_floor(
            "a lamp of 10⁻⁴ m by 1 m",
            "slivers whose own distance is hard to tell, at the ends of shadow rays",
            &[strip(0.4, 1.0, 0.1, [1e-4, 1.0])],
            [0.0; 2],
            &ALL,
        ),
        in_the_middle(),
        many(),
        apart(),
    ]
}

type Lamp = [Vec3; 4];

fn square(x: f32, y: f32, z: f32, side: f32) -> Lamp {
    strip(x, y, z, [side; 2])
}

fn strip(x: f32, y: f32, z: f32, [width, length]: [f32; 2]) -> Lamp {
    let corner = |dx: f32, dz: f32| Vec3::new(x + dx * width / 2.0, y, z + dz * length / 2.0);
    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
}

/// In the plane z = 0, its front to +z.
fn wall_z() -> Lamp {
    let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]
}

/// In the plane x = 0, its front to +x.
fn wall_x() -> Lamp {
    let at = |z: f32, y: f32| Vec3::new(0.0, y, z);
    [at(1.0, 0.0), at(0.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)]
}

/// Mean over a rectangle of the floor of the radiance that lamps of a radiance leave there, by the midpoint rule over
/// Lambert's formula in f64.
fn mean_radiance(lamps: &[(Lamp, f64)], [x, z]: [[f64; 2]; 2], steps: u32) -> f64 {
    let at = |[low, high]: [f64; 2], i: u32| low + (high - low) * (f64::from(i) + 0.5) / f64::from(steps);
    let mut sum = 0.0;
    for i in 0..steps * steps {
        let here = DVec3::new(at(x, i % steps), 0.0, at(z, i / steps));
        let of = |(lamp, radiance): &(Lamp, f64)| {
            radiance * irradiance::of_polygon(&lamp.map(|c| c.as_dvec3() - here))
        };
        sum += lamps.iter().map(of).sum::<f64>();
    }
    f64::from(REFLECTANCE) / PI * sum / f64::from(steps * steps)
}

/// Half a metre squared of a floor under lamps of radiance 3, looked at from right above.
fn over_floor(
    name: &str,
    stresses: &'static str,
    lamps: &[Lamp],
    [x, z]: [f32; 2],
    methods: &[Method],
) -> Case {
    let all: Vec<(Lamp, f64)> = lamps.iter().map(|lamp| (*lamp, 3.0)).collect();
    let around = |c: f32| [f64::from(c) - 0.25, f64::from(c) + 0.25];
    let truth = mean_radiance(&all, [around(x), around(z)], 192);
    let lamps = lamps.to_vec();
    let glb = move || {
        let mut glb = Glb::new();
        glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 4.0, 0.0, 0.0));
        for lamp in &lamps {
            glb.body(lambert(0.0, 3.0), quad(*lamp));
        }
        let above = Vec3::new(x, 0.5, z);
        glb.orthographic(above, above.with_y(0.0), 0.5, 0.5);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: name.to_owned(),
        stresses,
        known: format!("Lambert's polygon formula in f64, mean over what is seen: {truth:.6e}"),
        note: "",
        trials: mean_is_by(methods, glb, &by(Method::Path, 4), truth),
    }
}

/// A black ceiling as high above the lamp as the floor is below it.
fn in_the_middle() -> Case {
    let lamp = square(0.0, 1.0, 0.0, 0.02);
    let truth = mean_radiance(&[(lamp, 3.0)], [[-0.25, 0.25]; 2], 192);
    let glb = move || {
        let mut glb = Glb::new();
        glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 4.0, 0.0, 0.0));
        glb.body(lambert(0.0, 0.0), floor(2.0, 4.0, 0.0, 0.0));
        glb.body(lambert(0.0, 3.0), quad(lamp));
        glb.orthographic(Vec3::new(0.0, 0.5, 0.0), Vec3::ZERO, 0.5, 0.5);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: "a small lamp in the middle of its scene".to_owned(),
        stresses: "a surface at the origin is known far more exactly than rays from afar end",
        known: format!("Lambert's polygon formula in f64, mean over what is seen: {truth:.6e}"),
        note: "",
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), truth),
    }
}

/// 100 × 100 lamps whose radiances have 13 decades.
fn many() -> Case {
    let lamp = |i: u32| {
        let at = |i: u32| (i as f32 - 49.5) * 0.04;
        square(at(i % 100), 1.0, at(i / 100), 0.02)
    };
    let decade = |i: u32| (i.wrapping_mul(2_654_435_761) >> 16) % 13;
    let radiance = |decade: u32| 10_f32.powi(decade as i32 - 10);
    let all: Vec<(Lamp, f64)> = (0..10_000).map(|i| (lamp(i), f64::from(radiance(decade(i))))).collect();
    let truth = mean_radiance(&all, [[-0.25, 0.25]; 2], 16);
    let glb = move || {
        let mut glb = Glb::new();
        glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 4.0, 0.0, 0.0));
        for d in 0..13 {
            let (mut positions, mut triangles) = (Vec::new(), Vec::new());
            for i in (0..10_000).filter(|i| decade(*i) == d) {
                let first = positions.len() as u32;
                positions.extend(lamp(i));
                triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
            glb.body(lambert(0.0, radiance(d)), (positions, triangles));
        }
        glb.orthographic(Vec3::Y * 0.5, Vec3::ZERO, 0.5, 0.5);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: "10⁴ lamps of very unequal power".to_owned(),
        stresses: "the choice among 20,000 emitters whose powers have 13 decades",
        known: format!("the sum of Lambert's polygon formula over all of them: {truth:.6e}"),
        note: "",
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), truth),
    }
}

/// Two dark booths with a lamp each, one 60 decades brighter than the other.
fn apart() -> Case {
    let radiances = [1e-30_f32, 1e30];
    let lamp = |booth: usize| square([-1.5, 1.5][booth], 0.9, 0.2, 0.6);
    let side = |booth: usize| [[-1.0, 0.0], [0.0, 1.0]][booth];
    let truth = [0, 1].map(|booth| {
        mean_radiance(&[(lamp(booth), f64::from(radiances[booth]))], [side(booth), [-0.5, 0.5]], 128)
    });
    let glb = move || {
        let mut glb = Glb::new();
        glb.body(lambert(0.0, 0.0), flipped(cuboid(Vec3::new(-2.0, -0.01, -1.0), Vec3::new(2.0, 1.0, 1.0))));
        glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 4.5, 0.0, 0.0));
        let at = |y: f32, z: f32| Vec3::new(0.0, y, z);
        glb.body(lambert(0.0, 0.0), quad([at(-0.01, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-0.01, 1.0)]));
        for booth in [0, 1] {
            glb.body(lambert(0.0, radiances[booth]), quad(lamp(booth)));
        }
        glb.orthographic(Vec3::Y * 0.8, Vec3::ZERO, 2.0, 1.0);
        glb.finish()
    };
    let mut trials = Vec::new();
    for method in ALL {
        for booth in [0, 1] {
            let name = format!("{}, of 10{}", method.name(), ["⁻³⁰", "³⁰"][booth]);
            trials.push(Trial::new(name, move |budget| half(&glb(), method, booth, truth[booth], budget)));
        }
    }
    Case {
        group: GROUP,
        name: "lamps of radiance 10⁻³⁰ and 10³⁰".to_owned(),
        stresses: "sixty decades in one picture; probabilities that no f32 holds",
        known: format!("Lambert's polygon formula for each booth: {:.5e} and {:.5e}", truth[0], truth[1]),
        note: "Light paths start at a lamp in proportion to its power: none ever starts at the faint one, which light alone then leaves dark.",
        trials,
    }
}

/// One half of the picture of both booths.
fn half(glb: &[u8], method: Method, booth: usize, truth: f64, budget: Budget) -> Finding {
    let settings = Settings { size: Size { width: 8, height: 4 }, ..by(method, 4) };
    let samples = budget.of(1 << 14, 64) as u32;
    let picture = rendered_of(&scene(glb, &settings), &settings, samples);
    let region = Region { x: 4 * booth as u32, y: 0, width: 4, height: 4 };
    let means = picture.means(0, region);
    let mut finding = Finding::estimate(truth, crate::picture::mean_and_error(&means), picture.samples());
    finding.invalid = picture.invalid();
    finding
}
