//! Slivers, triangles without area, doubles, gaps, solids in each other, cameras on walls.

use super::{
    case::Case,
    picture_trial::{ALL, by, mean_is_by},
};
use crate::{
    glb::Glb,
    picture::in_environment,
    scenes::{cuboid, flipped, floor, glass, lambert},
};
use glam::Vec3;
use ovtigre_core::settings::Method;
use serde_json::{Value, json};
use std::f64::consts::PI;

const GROUP: &str = "Geometry";
const REFLECTANCE: f32 = 0.8;
/// Of a closed room whose walls emit 1.
const ROOM: f64 = 1.0 / (1.0 - REFLECTANCE as f64);

type Body = (Vec<Vec3>, Vec<[u32; 3]>);

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut all = vec![
        room(
            "slivers of aspect 10⁶",
            "barycentric weights and normals of triangles 2 m by 2 µm",
            "",
            || room_of(strips()).finish(),
        ),
        room(
            "triangles without area",
            "points, lines and repeated vertices among the walls",
            "",
            without_area,
        ),
        room(
            "every triangle twice",
            "emitters at the same place: one of them is hit, both might be sampled",
            "",
            || {
                let mut glb = room_of(closed());
                glb.body(lambert(REFLECTANCE, 1.0), closed());
                glb.finish()
            },
        ),
        room(
            "walls in the same planes",
            "coplanar emitters that are cut in other ways",
            "Rounding decides which of the two a ray meets, but both are sampled: part of the direct light counts twice.",
            coplanar,
        ),
    ];
    all.extend([gap(1e-3), gap(1e-5), gap(1e-7)]);
    all.extend([interpenetrating(), on_a_wall(), inside_glass()]);
    all
}

fn closed() -> Body {
    flipped(cuboid(Vec3::splat(-1.0), Vec3::ONE))
}

fn room_of(body: Body) -> Glb {
    let mut glb = Glb::new();
    glb.body(lambert(REFLECTANCE, 1.0), body);
    glb.perspective(Vec3::new(0.3, -0.2, 0.5), Vec3::new(-1.0, 0.4, -0.7), 70.0);
    glb
}

fn room(
    name: &str,
    stresses: &'static str,
    note: &'static str,
    glb: impl Fn() -> Vec<u8> + Clone + Send + Sync + 'static,
) -> Case {
    Case {
        group: GROUP,
        name: name.to_owned(),
        stresses,
        known: "a closed room: Lₑ / (1 − ρ) = 5, everywhere".to_owned(),
        note,
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), ROOM),
    }
}

/// A cube whose walls are strips, 200 of them 2 µm wide, all vertices shared.
/// Closed, its front inside.
pub(super) fn strips() -> Body {
    let mut cuts = vec![-1.0_f32];
    cuts.extend((0..=200).map(|i| -2e-4 + 2e-6 * i as f32));
    cuts.push(1.0);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    // Around the z axis: at each cut of x the floor's and the ceiling's edge.
    for x in &cuts {
        positions.extend([-1.0, 1.0].into_iter().flat_map(|y| [-1.0, 1.0].map(|z| Vec3::new(*x, y, z))));
    }
    let mut wall = |a: u32, b: u32, c: u32, d: u32| triangles.extend([[a, b, c], [a, c, d]]);
    for i in 0..cuts.len() as u32 - 1 {
        let (here, there) = (4 * i, 4 * i + 4);
        // Floor, ceiling, back and front, seen from within: vertices 0 and 1 are low, 0 and 2 at the back.
        wall(here + 1, there + 1, there, here);
        wall(here + 2, there + 2, there + 3, here + 3);
        wall(here, there, there + 2, here + 2);
        wall(here + 3, there + 3, there + 1, here + 1);
    }
    let last = 4 * (cuts.len() as u32 - 1);
    wall(1, 0, 2, 3);
    wall(last, last + 1, last + 3, last + 2);
    (positions, triangles)
}

fn without_area() -> Vec<u8> {
    let (mut positions, mut triangles) = closed();
    let first = positions.len() as u32;
    positions.extend([
        Vec3::ZERO,
        Vec3::new(0.1, 0.2, 0.3),
        Vec3::new(0.2, 0.4, 0.6),
        Vec3::new(0.1, 0.2, 0.3),
    ]);
    triangles.extend([
        [first, first, first],
        [first, first + 1, first + 2],
        [first + 1, first + 3, first],
        [0, 0, 1],
        [2, 3, 3],
        [first + 1, first + 3, first + 1],
    ]);
    room_of((positions, triangles)).finish()
}

/// A second set of the same walls in the same planes, cut along the other diagonals.
fn coplanar() -> Vec<u8> {
    let mut glb = room_of(closed());
    let (positions, triangles) = closed();
    let other = triangles.chunks(2).flat_map(|pair| {
        let ([a, c, b], [_, d, _]) = (pair[0], pair[1]);
        [[a, d, b], [d, c, b]]
    });
    glb.body(lambert(REFLECTANCE, 1.0), (positions, other.collect()));
    glb.finish()
}

/// A black sheet of alpha 0.4 closely over a floor under a sun.
fn gap(height: f32) -> Case {
    let glb = move || {
        let mut glb = Glb::new();
        glb.body(lambert(0.5, 0.0), floor(0.0, 4.0, 0.0, 0.0));
        glb.body(sheet(0.4), floor(height, 4.0, 0.1, 0.2));
        let half = std::f64::consts::FRAC_1_SQRT_2;
        glb.light(
            json!({"type": "directional", "intensity": 2.0}),
            json!({"rotation": [-half, 0.0, 0.0, half]}),
        );
        glb.orthographic(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO, 1.0, 1.0);
        glb.finish()
    };
    // From above, 60 % of the light comes down and 60 % of that back up; alpha decides by chance on the way of the eye.
    let truth = 0.6 * 0.6 * 0.5 * 2.0 / PI;
    Case {
        group: GROUP,
        name: format!("a sheet {height:e} m over a floor"),
        stresses: "a gap beside the error bound of positions, 8 · 10⁻⁷ m here",
        known: format!("(1 − α)² ρ E / π = {truth:.6}"),
        note: if height < 1e-6 {
            "A ray leaves the floor beyond the sheet, which then takes no share of the light that comes down: (1 − α) is missing once."
        } else {
            ""
        },
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), truth),
    }
}

/// A black sheet of an alpha.
pub fn sheet(alpha: f32) -> Value {
    let mut material = lambert(0.0, 0.0);
    material["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.0, 0.0, 0.0, alpha]);
    material["alphaMode"] = json!("BLEND");
    material
}

/// Clear boxes that overlap, in a uniform sky.
fn interpenetrating() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        for (low, high) in [(-1.0, 0.4), (-0.5, 0.8), (-0.2, 1.1)] {
            glb.body(glass(1.5), cuboid(Vec3::splat(low), Vec3::new(high, high + 0.1, high - 0.2)));
        }
        glb.perspective(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 25.0);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: "boxes of glass in each other".to_owned(),
        stresses: "solids that are entered before others are left; light that is trapped for long",
        known: "nothing is lost: the sky's radiance, 0.7".to_owned(),
        note: "",
        trials: mean_is_by(
            &[Method::Path],
            glb,
            &in_environment(by(Method::Path, 8), 0.7),
            f64::from(0.7_f32),
        ),
    }
}

fn on_a_wall() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        glb.body(lambert(REFLECTANCE, 1.0), closed());
        glb.perspective(Vec3::new(0.25, -0.5, 1.0), Vec3::new(-0.3, 0.1, -1.0), 60.0);
        glb.finish()
    };
    room("a camera on a wall", "rays that start at distance 0 of a surface", "", glb)
}

fn inside_glass() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        glb.body(glass(1.5), cuboid(Vec3::splat(-1.0), Vec3::ONE));
        glb.perspective(Vec3::new(0.1, 0.0, -0.1), Vec3::new(1.0, 0.1, 0.05), 10.0);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: "a camera in glass".to_owned(),
        stresses: "a path that begins inside a solid; total reflection",
        known: "n² L = 2.25 in a direction that gets out in the end".to_owned(),
        note: "",
        trials: mean_is_by(&[Method::Path], glb, &in_environment(by(Method::Path, 4), 1.0), 2.25),
    }
}
