//! Solids that absorb: light, eye and walls inside of them.

use super::{
    case::Case,
    picture_trial::{ALL, by, mean_is_by},
};
use crate::{
    glb::Glb,
    picture::in_environment,
    scenes::{cuboid, flipped, floor, lambert},
};
use glam::Vec3;
use ovtigre_core::settings::Method;
use serde_json::{Value, json};

const GROUP: &str = "Solids that absorb";
/// Share of light left after a metre.
const CLEAR: f64 = 0.5;

/// All of them.
pub fn cases() -> Vec<Case> {
    vec![seen_through(), camera_inside(), all_inside(), lit_inside(), overlapping(), nested(), room_inside()]
}

/// A solid that does not refract, and leaves a share of light after a metre.
fn smoke(clear: f64) -> Value {
    json!({
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1.0},
            "KHR_materials_volume": {"thicknessFactor": 1.0, "attenuationDistance": 1.0,
                "attenuationColor": [clear, clear, clear]},
            "KHR_materials_ior": {"ior": 1.0},
        },
    })
}

fn slab(low: f32, high: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    cuboid(Vec3::new(low, -9.0, -9.0), Vec3::new(high, 9.0, 9.0))
}

/// A lamp of radiance 1 all over a view along −x, at x = −4.
fn lamp(glb: &mut Glb) {
    let at = |y: f32, z: f32| Vec3::new(-4.0, y, z);
    glb.body(
        lambert(0.0, 1.0),
        crate::scenes::quad([at(-8.0, 8.0), at(-8.0, -8.0), at(8.0, -8.0), at(8.0, 8.0)]),
    );
}

/// What is seen of the lamp along −x from `eye`, where a ray passes `metres` of absorber.
fn along_x(
    name: &str,
    stresses: &'static str,
    note: &'static str,
    (eye, metres): (f32, f64),
    add: fn(&mut Glb),
) -> Case {
    let glb = move || {
        let mut glb = Glb::new();
        add(&mut glb);
        lamp(&mut glb);
        glb.orthographic(Vec3::new(eye, 0.0, 0.0), Vec3::X * (eye - 1.0), 1.0, 1.0);
        glb.finish()
    };
    let truth = CLEAR.powf(metres);
    Case {
        group: GROUP,
        name: name.to_owned(),
        stresses,
        known: format!("Beer and Lambert: 0.5^{metres} = {truth:.6}"),
        note,
        trials: mean_is_by(&[Method::Path, Method::Bidirectional], glb, &by(Method::Path, 4), truth),
    }
}

fn seen_through() -> Case {
    along_x("a lamp behind an absorber", "entering and leaving", "", (4.0, 2.0), |glb| {
        glb.body(smoke(CLEAR), slab(-1.0, 1.0));
    })
}

fn camera_inside() -> Case {
    along_x(
        "a camera in an absorber",
        "an eye that learns only at the far side where it was",
        "",
        (0.5, 1.5),
        |glb| {
            glb.body(smoke(CLEAR), slab(-1.0, 1.0));
        },
    )
}

fn all_inside() -> Case {
    along_x(
        "a camera and a lamp in an absorber",
        "nothing is entered, nothing is left",
        "",
        (1.0, 5.0),
        |glb| {
            glb.body(smoke(CLEAR), cuboid(Vec3::splat(-12.0), Vec3::splat(12.0)));
        },
    )
}

fn overlapping() -> Case {
    along_x(
        "two absorbers in each other",
        "what is left first is not what was entered last",
        "",
        (4.0, 3.0),
        |glb| {
            glb.body(smoke(CLEAR), slab(-2.0, 0.0));
            glb.body(smoke(CLEAR), slab(-1.0, 1.0));
        },
    )
}

fn nested() -> Case {
    along_x(
        "a clear solid in an absorber, and the camera in both",
        "the innermost solid is what light goes through",
        "",
        (0.0, 2.0),
        |glb| {
            glb.body(smoke(CLEAR), slab(-3.0, 3.0));
            glb.body(smoke(1.0), slab(-1.0, 1.0));
        },
    )
}

/// A floor and a point light in an absorber: every method must know where its walks begin.
fn lit_inside() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        glb.body(smoke(CLEAR), cuboid(Vec3::splat(-12.0), Vec3::splat(12.0)));
        glb.body(lambert(0.5, 0.0), floor(0.0, 4.0, 0.0, 0.0));
        glb.light(json!({"type": "point", "intensity": 3.0}), json!({"translation": [0.0, 1.0, 0.0]}));
        glb.orthographic(Vec3::Y * 2.0, Vec3::ZERO, 0.5, 0.5);
        glb.finish()
    };
    let truth = mean_under_point();
    Case {
        group: GROUP,
        name: "floor, light and camera in an absorber".to_owned(),
        stresses: "walks from the eye and from the light that begin inside",
        known: format!("ρ/π I h/d³ 0.5^d 0.5², mean over what is seen, in f64: {truth:.6}"),
        note: "",
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), truth),
    }
}

fn mean_under_point() -> f64 {
    const N: u32 = 128;
    let at = |i: u32| 0.5 * ((f64::from(i) + 0.5) / f64::from(N) - 0.5);
    let one = |x: f64, z: f64| {
        let d = (x * x + z * z + 1.0).sqrt();
        0.5 / std::f64::consts::PI * 3.0 / d.powi(3) * CLEAR.powf(d) * CLEAR.powi(2)
    };
    (0..N * N).map(|i| one(at(i % N), at(i / N))).sum::<f64>() / f64::from(N * N)
}

/// A camera in a ball that absorbs, in a uniform sky.
fn room_inside() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        glb.body(smoke(CLEAR), slab(-0.5, 3.0));
        glb.body(smoke(CLEAR), flipped(slab(0.5, 1.0)));
        glb.orthographic(Vec3::new(2.0, 0.0, 0.0), Vec3::X, 1.0, 1.0);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: "a camera in an absorber with a hollow".to_owned(),
        stresses: "a solid that is left and entered again through its own inside",
        known: "Beer and Lambert over 1 m + 1 m: 0.25".to_owned(),
        note: "",
        trials: mean_is_by(&[Method::Path], glb, &in_environment(by(Method::Path, 4), 1.0), 0.25),
    }
}
