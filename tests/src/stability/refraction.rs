//! Glass of every index, and total reflection.

use super::{
    case::{Case, Trial},
    finding::Finding,
    picture_trial::{by, mean_is_by},
    random::Random,
};
use crate::{
    picture::in_environment,
    scenes::{body_alone, glass, sphere},
};
use glam::Vec3;
use ovtigre_core::{
    bsdf::{
        Bsdf,
        event::Transport,
        fresnel::dielectric,
        surface::{SurfaceParameters, Walls},
    },
    math::warp,
    settings::Method,
};
use serde_json::json;

const GROUP: &str = "Refraction";
const SKY: f32 = 0.7;

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut all: Vec<Case> =
        [1.000_000_1, 1.0001, 1.05, 1.5, 2.4, 100.0].into_iter().map(|ior| ball(ior, 0.0)).collect();
    all.extend(
        [(1.0001, 0.5), (1.05, 0.5), (1.5, 0.2), (1.5, 0.5), (1.5, 1.0), (2.4, 0.5), (100.0, 0.5)]
            .map(|(ior, rough)| ball(ior, rough)),
    );
    all.extend([critical(), reciprocity()]);
    all
}

fn ball(ior: f32, roughness: f32) -> Case {
    let glb = move || {
        let mut material = glass(ior);
        material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
        body_alone(material, sphere(Vec3::ZERO, 1.0, 24))
    };
    let rough = if roughness > 0.0 { format!(", roughness {roughness}") } else { String::new() };
    Case {
        group: GROUP,
        name: format!("a ball of index {ior}{rough}"),
        stresses: "clear glass that must neither gain nor lose",
        known: "it cannot be seen in a uniform sky: 0.7".to_owned(),
        note: if roughness > 0.0 && ior > 10.0 {
            "Of what rough glass scatters between its facets the table misses less than a thousandth of the light, so that it never gains: what is let in here is reflected inside so often that much of it is lost."
        } else if roughness > 0.0 {
            "Of what rough glass scatters between its facets the table misses less than a thousandth of the light at each scattering, so that it never gains."
        } else if ior > 10.0 {
            "Facets that are not quite a sphere trap light for tens of thousands of reflections: few paths get out and count for very many, so that the error is underestimated."
        } else {
            ""
        },
        trials: mean_is_by(&[Method::Path], glb, &in_environment(by(Method::Path, 8), SKY), f64::from(SKY)),
    }
}

/// Fresnel's reflectance in f64.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let squared = 1.0 - (1.0 - cos * cos) / (eta * eta);
    if squared <= 0.0 {
        return 1.0;
    }
    let inside = squared.sqrt();
    let s = (cos - eta * inside) / (cos + eta * inside);
    let p = (eta * cos - inside) / (eta * cos + inside);
    0.5 * (s * s + p * p)
}

fn critical() -> Case {
    let trial = |ior: f32| {
        Trial::new(format!("n = {ior}"), move |_| {
            let eta = 1.0 / ior;
            let critical = f64::from(eta).asin();
            let offsets = [-1e-3, -1e-5, -1e-6, -1e-7, 1e-7, 1e-6, 1e-5, 1e-3];
            let beyond = |offset: f64| {
                let cos = (critical + offset).cos() as f32;
                let got = f64::from(dielectric(cos, eta));
                // What f32 can know: the same for arguments that are off by two roundings.
                let around = (-64..=64).map(|i| f64::from(cos) * (1.0 + 2.4e-7 / 64.0 * f64::from(i)));
                let around: Vec<f64> = around.map(|cos| fresnel(cos, f64::from(eta))).collect();
                let low = around.iter().copied().fold(f64::INFINITY, f64::min);
                let high = around.iter().copied().fold(0.0, f64::max);
                (low - got).max(got - high).max(0.0)
            };
            Finding::bound(1e-6, offsets.into_iter().map(beyond).fold(0.0, f64::max), offsets.len() as u64)
        })
    };
    Case {
        group: GROUP,
        name: "at the critical angle ± 10⁻⁶".to_owned(),
        stresses: "a root of nearly nothing decides between total reflection and none",
        known: "Fresnel's equations in f64, of the f32 cosine or of one within two roundings: beyond these by at most 10⁻⁶".to_owned(),
        note: "",
        trials: [1.000_1, 1.05, 1.5, 2.4, 100.0].map(trial).into(),
    }
}

/// Rough glass seen from both ends.
fn reciprocity() -> Case {
    let trial = |ior: f32| {
        Trial::new(format!("n = {ior}"), move |budget| {
            let mut random = Random(17);
            let count = budget.of(2_000_000, 50_000);
            let worst = (0..count).map(|_| one_way_more(ior, &mut random)).fold(0.0, f64::max);
            Finding::bound(2e-4, worst, count)
        })
    };
    Case {
        group: GROUP,
        name: "rough glass seen from both ends".to_owned(),
        stresses: "light must go both ways alike, or path and light disagree; α from 0.001 to 1",
        known: "f(o→i) / η² is symmetric: relative difference at most 2 · 10⁻⁴".to_owned(),
        note: "",
        trials: [1.0001, 1.05, 1.2, 1.5, 2.4].map(trial).into(),
    }
}

/// The relative difference of f between two random directions on glass of a random roughness.
fn one_way_more(ior: f32, random: &mut Random) -> f64 {
    let glass = SurfaceParameters {
        base_color: Vec3::ONE,
        metallic: 0.0,
        roughness: 0.032 + 0.968 * random.uniform(),
        specular: 1.0,
        specular_color: Vec3::ONE,
        ior,
        transmission: 1.0,
        walls: Walls::Solid,
        layers: None,
    };
    let bsdf = Bsdf::from_surface(&glass);
    let [wo, wi] = [0, 1].map(|_| warp::sphere(random.pair()));
    let there = bsdf.eval(wo, wi, Transport::Radiance).total().x / wi.z.abs();
    let back = bsdf.eval(wi, wo, Transport::Importance).total().x / wo.z.abs();
    let most = f64::from(there.max(back));
    if most > 1e-9 { f64::from((there - back).abs()) / most } else { 0.0 }
}
