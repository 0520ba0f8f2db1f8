//! Very many samples and batches, beside exact sums.

use super::{
    budget::Budget,
    case::{Case, Trial},
    finding::Finding,
    random::Random,
};
use crate::{
    glb::Glb,
    picture::{rendered, settings},
    scenes::{floor, lambert},
};
use glam::Vec3;
use ovtigre_core::film::{
    append::Prefix,
    batch::{Batch, Block},
    invalid::InvalidSamples,
    size::Region,
    sum::Sum,
};

const GROUP: &str = "Sums";

/// All of them.
pub fn cases() -> Vec<Case> {
    vec![
        Case {
            group: GROUP,
            name: "2²⁶ samples of one pixel".to_owned(),
            stresses: "sums that an f32 stops adding to after 2²⁴ equal terms",
            known: "a lamp of radiance 0.1 (as f32 has it) that fills the pixel: its mean, off by at most 6 · 10⁻⁸"
                .to_owned(),
            note: "",
            trials: vec![Trial::new("path", one_pixel)],
        },
        Case {
            group: GROUP,
            name: "10⁵ batches".to_owned(),
            stresses: "merging partial sums of 40 binary orders of size",
            known: "the sum in integers of 2⁻⁶⁰, exact: off by at most 10⁻¹²".to_owned(),
            note: "",
            trials: vec![Trial::new("appended in order", batches)],
        },
    ]
}

fn one_pixel(budget: Budget) -> Finding {
    let mut glb = Glb::new();
    glb.body(lambert(0.0, 0.1), floor(0.0, 4.0, 0.0, 0.0));
    glb.orthographic(Vec3::Y, Vec3::ZERO, 1.0, 1.0);
    let samples = budget.of(1 << 26, 1 << 18);
    let picture = rendered(&glb.finish(), &settings(1, 1, 2), (samples / 2) as u32);
    let (mean, _) = picture.mean();
    let mut finding = Finding::bound(6e-8, (mean / f64::from(0.1_f32) - 1.0).abs(), picture.samples());
    finding.invalid = picture.invalid();
    finding
}

/// Sums whose every channel is a multiple of 2⁻⁶⁰ that i128 adds without rounding.
fn batches(budget: Budget) -> Finding {
    let count = budget.of(100_000, 1_000);
    let region = Region { x: 0, y: 0, width: 2, height: 2 };
    let mut prefix = Prefix::empty(region, 0, 1);
    let mut exact = [[0_i128; 3]; 4];
    let mut random = Random(5);
    for index in 0..count as u32 {
        let plane: Vec<[f32; 3]> = (0..4)
            .map(|_| [0; 3].map(|_| (0.5 + random.uniform()) * 2_f32.powi(random.below(40) as i32 - 20)))
            .collect();
        for (into, values) in exact.iter_mut().zip(&plane) {
            for (into, value) in into.iter_mut().zip(values) {
                *into += (f64::from(*value) * 2_f64.powi(60)) as i128;
            }
        }
        let block = Block { index, start: index, count: 1 };
        let batch = Batch { region, replicate: 0, block };
        let sum = Sum {
            batch,
            planes: vec![plane],
            invalid: InvalidSamples::default(),
            rays: 1,
            tile_rays: Vec::new(),
        };
        prefix.append(&sum).expect("in order");
    }
    let off = |(got, exact): (&f64, &i128)| (got * 2_f64.powi(60) / *exact as f64 - 1.0).abs();
    let worst = prefix.layer(0).iter().zip(exact.as_flattened()).map(off).fold(0.0, f64::max);
    Finding::bound(1e-12, worst, count)
}
