//! Samples that are no numbers: dropped, and counted by cause.

use super::{
    case::{Case, Trial},
    finding::Finding,
};
use crate::{
    picture::{rendered, settings},
    scenes::furnace,
};
use glam::Vec3;
use ovtigre_core::{
    film::invalid::InvalidSamples,
    settings::{Method, Settings},
};

/// The only one. That clean cases drop none is asked of every picture on the page.
pub fn cases() -> Vec<Case> {
    let mut trials = vec![Trial::new("by cause", |_| {
        let mut counts = InvalidSamples::default();
        let values = [
            Vec3::ONE,
            Vec3::new(1.0, f32::NAN, 1.0),
            Vec3::splat(f32::INFINITY),
            Vec3::new(0.0, -1e-30, 0.0),
            Vec3::new(f32::NEG_INFINITY, 0.0, f32::NAN),
        ];
        let kept: Vec3 = values.into_iter().map(|value| counts.checked(value)).sum();
        let expected = InvalidSamples { nan: 2, infinite: 1, negative: 1 };
        Finding::bound(0.0, f64::from(u8::from(counts != expected || kept != Vec3::ONE)), 5)
    })];
    // A sample of this room is the sum of up to twenty times what an f32 holds.
    for method in [Method::Path, Method::Light, Method::Bidirectional] {
        trials.push(Trial::new(format!("{}, a room beyond the range of f32", method.name()), move |_| {
            let settings = Settings { method, ..settings(4, 4, 2) };
            let picture = rendered(&furnace(0.9, 3e38), &settings, 64);
            let finite = picture.picture().planes[0].iter().flatten().all(|v| v.is_finite());
            let counted = picture.invalid() > 0;
            Finding::bound(0.0, f64::from(u8::from(!(finite && counted))), picture.samples())
        }));
    }
    vec![Case {
        group: "Invalid samples",
        name: "samples that are no numbers".to_owned(),
        stresses: "NaN, infinities, negative values",
        known: "dropped and counted by cause; the picture stays finite: 0 faults".to_owned(),
        note: "",
        trials,
    }]
}
