//! Weights of paths of a thousand scatterings.

use super::{
    case::{Case, Trial},
    finding::Finding,
    random::Random,
};
use ovtigre_core::path::mis::{
    heuristic::Heuristic,
    partial::Partial,
    recursive::{self, Bridge},
};

/// The only one.
pub fn cases() -> Vec<Case> {
    let mut trials = Vec::new();
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        for scale in [1e-6, 1.0, 1e6] {
            let by = format!("{heuristic:?}, lengths around {scale:e}");
            trials.push(Trial::new(by, move |budget| {
                let paths = budget.of(200, 4);
                let worst = (0..paths).map(|seed| off_one(heuristic, scale, seed)).fold(0.0, f64::max);
                Finding::bound(1e-9, worst, paths)
            }));
        }
    }
    vec![Case {
        group: "Long paths",
        name: "a thousand scatterings, α = 0.001 and diffuse in turns".to_owned(),
        stresses: "products of a thousand densities between 0.3 and 10⁶, by recursion from both ends",
        known: "weights of all joins of two surfaces and all other techniques together are one: off by at most 10⁻⁹; infinite where one is no number"
            .to_owned(),
        note: "",
        trials,
    }]
}

/// A vertex, with densities over solid angle.
struct Vertex {
    /// Squared distance to the next one.
    squared: f64,
    /// |cos θ| towards the light and towards the eye.
    cos: [f64; 2],
    /// Density of going on to the eye, and to the light.
    pdf: [f64; 2],
}

/// The vertices of a path from an area light to a pinhole, both included.
fn path(scale: f64, seed: u64) -> Vec<Vertex> {
    let mut random = Random(seed);
    let mut one = |i: usize| {
        let narrow = i % 2 == 1;
        let pdf = if narrow { 3e5 * random.wide(0.5) } else { 0.3 * random.wide(0.5) };
        Vertex {
            squared: (scale * random.wide(1.0)).powi(2),
            cos: [0; 2].map(|_| 1e-3 + f64::from(random.uniform())),
            pdf: [pdf, pdf * random.wide(0.2)],
        }
    };
    (0..1002).map(&mut one).collect()
}

/// How far the weights of all techniques are off one.
fn off_one(h: Heuristic, scale: f64, seed: u64) -> f64 {
    let v = path(scale, seed);
    let last = v.len() - 1;
    let (place, next_event, emission, light_paths) = (0.1 / (scale * scale), 0.3 / (scale * scale), 0.4, 1e4);
    let from_light =
        |i: usize| (if i == 1 { emission } else { v[i - 1].pdf[0] }) * v[i].cos[0] / v[i - 1].squared;
    let from_eye = |i: usize| v[i + 1].pdf[1] * v[i].cos[1] / v[i].squared;
    let near = h.of(next_event / place) * h.of(1.0 / emission);
    let mut partial = Partial { near, far: h.of(v[0].cos[1] / (place * emission)) };
    let mut light = vec![Partial::default()];
    for i in 1..last {
        partial.arrive(h, v[i - 1].squared, v[i].cos[0]);
        light.push(partial);
        partial.scatter(h, v[i].pdf[0], v[i].pdf[1], v[i].cos[1]);
    }
    let mut eye = vec![Partial::default(); last];
    let mut partial = Partial { near: h.of(light_paths / v[last].pdf[1]), far: 0.0 };
    for i in (0..last).rev() {
        partial.arrive(h, v[i].squared, v[i].cos[1]);
        eye[i] = partial;
        partial.scatter(h, v[i].pdf[1], v[i].pdf[0], v[i].cos[0]);
    }
    let weight = |s: usize| match s {
        0 => recursive::hit(h, &eye[0], next_event, place * emission),
        1 => {
            let (hit, picked) = (from_eye(0) / next_event, place / next_event);
            let densities = recursive::NextEventDensities {
                hit,
                picked,
                first_edge: from_light(1),
                reverse: v[1].pdf[0],
            };
            recursive::next_event(h, &eye[1], &densities)
        }
        s if s == last => {
            recursive::to_lens(h, &light[s - 1], from_eye(s - 1) / light_paths, v[s - 1].pdf[1])
        }
        s => {
            let bridge = Bridge {
                onto_light: from_eye(s - 1),
                light_reverse: v[s - 1].pdf[1],
                onto_eye: from_light(s),
                eye_reverse: v[s].pdf[0],
            };
            recursive::join(h, &light[s - 1], &eye[s], &bridge)
        }
    };
    let weights: Vec<f64> = (0..=last).map(weight).collect();
    if weights.iter().all(|w| w.is_finite() && *w >= 0.0) {
        (weights.iter().sum::<f64>() - 1.0).abs()
    } else {
        f64::INFINITY
    }
}
