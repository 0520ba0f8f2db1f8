//! Trials that are pictures whose mean is known.

use super::{
    budget::Budget,
    case::Trial,
    finding::{BIAS, Finding},
};
use crate::picture::{Rendered, rendered_of, scene, settings};
use ovtigre_core::{
    render::prepare::Prepared,
    settings::{Method, Settings},
};

/// Replicates of a picture: an error from 31 degrees of freedom.
pub const REPLICATES: u32 = 32;
/// Share of the rays that a pilot spends before it is believed.
const PILOT: f64 = 0.02;
/// Most samples a pixel and replicate of a pilot.
const PILOT_SAMPLES: u32 = 256;
/// Most samples a pixel and replicate.
const SAMPLES_MAX: u32 = 1 << 20;
/// By how much more is sampled than the pilot asks for.
const MARGIN: f64 = 1.7;

/// The methods that make every path.
pub const ALL: [Method; 3] = [Method::Path, Method::Light, Method::Bidirectional];

/// Settings of a picture of `side` × `side` pixels by a method.
pub fn by(method: Method, side: u32) -> Settings {
    Settings { method, ..settings(side, side, REPLICATES) }
}

/// A picture by a method whose mean over all pixels and channels is `truth`.
pub fn mean_is(glb: impl Fn() -> Vec<u8> + Send + Sync + 'static, settings: Settings, truth: f64) -> Trial {
    // Many joins are worth no ray.
    let dearness = if settings.method == Method::Bidirectional { 4.0 } else { 1.0 };
    let trial = Trial::new(settings.method.name(), move |budget| {
        let scene = scene(&glb(), &settings);
        let picture = measured(&scene, &settings, budget, truth);
        finding(&picture, &settings, truth)
    });
    trial.dearer(dearness)
}

/// The same by several methods.
pub fn mean_is_by(
    methods: &[Method],
    glb: impl Fn() -> Vec<u8> + Clone + Send + Sync + 'static,
    settings: &Settings,
    truth: f64,
) -> Vec<Trial> {
    let one = |method: &Method| mean_is(glb.clone(), Settings { method: *method, ..settings.clone() }, truth);
    methods.iter().map(one).collect()
}

/// The mean of a picture beside what is known of it.
pub fn finding(picture: &Rendered, settings: &Settings, truth: f64) -> Finding {
    let mut finding = Finding::estimate(truth, picture.mean(), picture.samples());
    finding.invalid = picture.invalid();
    debug_assert_eq!(settings.replicates, REPLICATES);
    finding
}

/// A picture that finds a bias of [`BIAS`] in its mean, if the budget reaches that far. A pilot with other random numbers
/// tells how many samples that takes, so that the number does not depend on what is found.
pub fn measured(scene: &Prepared, settings: &Settings, budget: Budget, truth: f64) -> Rendered {
    let pilot = Settings { seed: settings.seed + 1, ..settings.clone() };
    let mut samples = 1;
    let seen = loop {
        let seen = rendered_of(scene, &pilot, samples);
        let spent = seen.rays() as f64;
        if samples >= PILOT_SAMPLES || spent >= PILOT * budget.rays() {
            break seen;
        }
        samples *= 4;
    };
    let wanted = BIAS / 5.0 * truth.abs();
    let (_, error) = seen.mean();
    let more = if error > 0.0 && wanted > 0.0 { MARGIN * (error / wanted).powi(2) } else { 1.0 };
    let affordable = budget.rays() / (seen.rays() as f64).max(1.0) * f64::from(samples);
    let count = (f64::from(samples) * more).clamp(1.0, affordable.max(1.0));
    // A power of two, as sequences are made for.
    let count = (1_u32 << count.log2().round() as u32).min(SAMPLES_MAX);
    rendered_of(scene, settings, count)
}
