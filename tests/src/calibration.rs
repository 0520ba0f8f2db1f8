//! How often the error of a picture is at most what is certified: many short renders of a scene against a reference.

use crate::{
    picture::{scene, settings},
    room::room,
    scenes::{cornell, two_rooms},
    showcase::{caustic, lamp_behind_glass},
};
use ovtigre_core::{
    film::{
        allocate::allocate,
        allocation::Allocations,
        append::Prefix,
        batch::{Batch, Block},
        certificate::{self, level},
        error::estimate,
        estimate::picture,
        reference::Reference,
    },
    gltf::limits::Limits,
    render::{
        batch::render_allocated,
        inspect::{by_chance, inspect},
        prepare::{Prepared, prepare},
        progress::Progress,
    },
    settings::{Distribution, Method, Settings},
};
use rayon::prelude::*;
use std::fmt::Write as _;

/// Replicates of a reference.
const REFERENCE_REPLICATES: u32 = 16;
/// Seed of references; runs have others.
const REFERENCE_SEED: u64 = u64::MAX;
/// Samples of each replicate after which adaptive ones are allocated, as by a farm.
const DECIDED_AFTER: u32 = 16;
/// Errors to stop at.
const TARGETS: [f64; 6] = [0.5, 0.3, 0.2, 0.1, 0.05, 0.03];

/// A scene, and how it is rendered.
#[derive(Debug)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    glb: Vec<u8>,
    method: Method,
    reference: Method,
    sampling: Distribution,
}

/// The scenes: two of diffuse light, one with correlated pixels, one of all kinds of materials, and two with heavy tails.
pub fn cases() -> Vec<Case> {
    let case =
        |name, glb, method, reference| Case { name, glb, method, reference, sampling: Distribution::Uniform };
    let adaptive = |case| Case { sampling: Distribution::Adaptive, ..case };
    vec![
        case("cornell", cornell(), Method::Path, Method::Bidirectional),
        case("two-rooms", two_rooms(), Method::Path, Method::Bidirectional),
        case("cornell-light", cornell(), Method::Light, Method::Path),
        case("room-bidirectional", room(), Method::Bidirectional, Method::Path),
        case("caustic-path", caustic(), Method::Path, Method::Bidirectional),
        case("lamp-behind-glass-path", lamp_behind_glass(), Method::Path, Method::Bidirectional),
        case("room-caustics", room(), Method::Caustics, Method::Bidirectional),
        case("caustic-caustics", caustic(), Method::Caustics, Method::Bidirectional),
        adaptive(case("cornell-adaptive", cornell(), Method::Path, Method::Bidirectional)),
        adaptive(case("caustic-adaptive", caustic(), Method::Path, Method::Bidirectional)),
    ]
}

/// How much is rendered.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Renders of each scene.
    pub runs: u32,
    /// Pixels along a side of them.
    pub side: u32,
    /// Looks at each: after 1, 2, 4 … samples of each replicate.
    pub looks: u32,
    /// Sequences of each render.
    pub replicates: u32,
    /// Samples a pixel of a reference for each of the longest render.
    pub reference: u32,
    /// Seed of the first render.
    pub seed: u64,
}

/// What was found at one look at one render.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Relative error against the reference, whose own is taken off.
    pub truth: f64,
    /// As it was estimated.
    pub relative: f64,
    /// What it is at most.
    pub upper: f64,
    /// Whether that is not to be believed.
    pub doubted: bool,
}

/// All renders of a scene.
#[derive(Debug)]
pub struct Calibration {
    plan: Plan,
    /// Relative error of the reference.
    pub own: f64,
    /// Of each render, its looks.
    pub runs: Vec<Vec<Look>>,
}

/// Renders a case many times.
pub fn calibrate(case: &Case, plan: Plan) -> Calibration {
    let of =
        |method, seed, replicates| Settings { method, seed, ..settings(plan.side, plan.side, replicates) };
    let first = Settings { sampling: case.sampling, ..of(case.method, plan.seed, plan.replicates) };
    let prepared = scene(&case.glb, &first);
    let longest = plan.replicates << (plan.looks - 1);
    let samples = (longest * plan.reference).div_ceil(REFERENCE_REPLICATES).next_power_of_two();
    let settings = of(case.reference, REFERENCE_SEED, REFERENCE_REPLICATES);
    let other = prepare(case.glb.as_slice(), None, &settings).expect("a scene that can be rendered");
    let mut lanes = lanes(&settings);
    append(&other, &settings, &mut lanes, Block { index: 0, start: 0, count: samples }, None);
    let reference = Reference::of_picture(&picture(settings.size, settings.size.frame(), &lanes));
    let contents = inspect(case.glb.as_slice(), &Limits::default()).expect("a scene that can be read");
    let by_chance = by_chance(case.method, contents.letters, contents.brightest);
    let run = |run: u32| {
        let settings = Settings { seed: plan.seed + u64::from(run), ..first.clone() };
        looks(&prepared, &settings, plan.looks, by_chance, &reference)
    };
    let runs = (0..plan.runs).into_par_iter().map(run).collect();
    Calibration { plan, own: reference.own_error(), runs }
}

fn lanes(settings: &Settings) -> Vec<Vec<Prefix>> {
    vec![(0..settings.replicates).map(|r| Prefix::empty(settings.size.frame(), r, 1)).collect()]
}

fn append(
    prepared: &Prepared,
    settings: &Settings,
    lanes: &mut [Vec<Prefix>],
    block: Block,
    allocations: Option<&Allocations>,
) {
    for prefix in &mut lanes[0] {
        let batch = Batch { region: settings.size.frame(), replicate: prefix.replicate(), block };
        let allocation = allocations.map(|both| both.of(prefix.replicate()));
        let sum = render_allocated(prepared, settings, batch, allocation, &Progress::new());
        let sum = sum.expect("not stopped");
        let appended = match allocation {
            Some(allocation) => prefix.append_allocated(&sum, allocation),
            None => prefix.append(&sum),
        };
        appended.expect("in order");
    }
}

fn looks(
    prepared: &Prepared,
    settings: &Settings,
    looks: u32,
    by_chance: Option<f64>,
    reference: &Reference,
) -> Vec<Look> {
    let mut lanes = lanes(settings);
    let region = settings.size.frame();
    let adaptive = settings.sampling == Distribution::Adaptive;
    let mut allocations = None;
    (0..looks)
        .map(|index| {
            let start = if index == 0 { 0 } else { 1 << (index - 1) };
            if adaptive && start == DECIDED_AFTER {
                allocations = allocate(settings.size, region, &lanes);
                assert!(allocations.is_some(), "there are replicates with samples");
            }
            let block = Block { index, start, count: start.max(1) };
            append(prepared, settings, &mut lanes, block, allocations.as_ref());
            let found = estimate(region, &lanes, certificate::Look { number: index + 1, by_chance })
                .expect("there are replicates");
            Look {
                truth: reference.relative_error(&picture(settings.size, region, &lanes).planes[0]),
                relative: found.relative,
                upper: found.relative_upper.expect("there are three replicates and more"),
                doubted: found.doubt.is_some(),
            }
        })
        .collect()
}

fn median(of: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = of.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

impl Calibration {
    /// Renders whose error is not doubted at a look, and those of them whose error is more than what is said.
    pub fn wrong(&self, look: u32) -> [usize; 2] {
        let at = self.runs.iter().map(|run| run[look as usize]).filter(|look| !look.doubted);
        let believed: Vec<Look> = at.collect();
        [believed.len(), believed.iter().filter(|look| look.truth > look.upper).count()]
    }

    /// Renders whose error is at most what is said, whether that is doubted or not.
    pub fn covered_in_all(&self, look: u32) -> usize {
        self.runs.iter().map(|run| run[look as usize]).filter(|look| look.truth <= look.upper).count()
    }

    /// Renders that a target stops, and those of them whose error is at most the target.
    pub fn stopped(&self, target: f64) -> [usize; 2] {
        let stop = |run: &Vec<Look>| run.iter().find(|look| look.upper <= target && !look.doubted).copied();
        let stopped: Vec<Look> = self.runs.iter().filter_map(stop).collect();
        [stopped.len(), stopped.iter().filter(|look| look.truth <= target).count()]
    }

    /// The tables of a case, as Markdown.
    pub fn tables(&self, case: &Case) -> [String; 2] {
        let (mut coverage, mut stops) = (String::new(), String::new());
        let name = case.name;
        for look in 0..self.plan.looks {
            let at = || self.runs.iter().map(|run| run[look as usize]);
            let [believed, wrong] = self.wrong(look);
            let samples = self.plan.replicates << look;
            let [truth, relative, upper] = [
                median(at().map(|l| l.truth)),
                median(at().map(|l| l.relative)),
                median(at().map(|l| l.upper)),
            ];
            let doubted = self.runs.len() - believed;
            let claim = 100.0 * level(look + 1);
            let share = percent(wrong, self.runs.len());
            let all = percent(self.covered_in_all(look), self.runs.len());
            let row = format!(
                "| {name} | {samples} | {truth:.4} | {relative:.4} | {upper:.4} | {doubted} | {wrong} | {share} | {claim:.2} % | {all} |"
            );
            writeln!(coverage, "{row}").expect("writing to a string cannot fail");
        }
        for target in TARGETS {
            let [stopped, right] = self.stopped(target);
            if stopped > 0 {
                let (wrong, all) = (stopped - right, self.runs.len());
                writeln!(
                    stops,
                    "| {name} | {target} | {stopped} of {all} | {wrong} | {} |",
                    percent(wrong, all)
                )
                .expect("writing to a string cannot fail");
            }
        }
        [coverage, stops]
    }
}

fn percent(part: usize, whole: usize) -> String {
    if whole == 0 { "–".to_owned() } else { format!("{:.1} %", 100.0 * part as f64 / whole as f64) }
}
