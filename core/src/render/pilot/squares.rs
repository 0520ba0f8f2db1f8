//! Squares of the errors of methods, by what they show and by what they are told.

use crate::film::append::Prefix;
use crate::film::missed::missed;
use crate::film::squares::RelativeTo;
use crate::settings::{Layer, Method, Settings, Shows};
use std::cmp::Ordering;
use std::iter;

/// Methods that `bidirectional` tells of.
const TOLD: [Method; 3] = [Method::Path, Method::Caustics, Method::Light];

/// Settings of a method, and some of its sequences.
#[derive(Clone, Debug)]
pub(super) struct Seen<'a> {
    pub settings: &'a Settings,
    pub lanes: Vec<&'a Prefix>,
}

/// Of the relative error of a method.
#[derive(Clone, Copy, Debug)]
pub(super) struct Squares {
    /// Variance of a sample, by the spread of sequences.
    pub variance: f64,
    /// Variance of a sample to be expected.
    pub expected: f64,
    /// Of the error by light that another method has met, where nothing else tells of it.
    pub missed: f64,
}

/// What the picture of a method has to show beside it.
pub(super) fn layers(method: Method) -> impl Iterator<Item = Layer> {
    let told = TOLD.into_iter().filter(move |told| [*told, Method::Bidirectional].contains(&method));
    let shown = iter::once(Shows::Scattered).chain(told.map(Shows::Squares));
    shown.map(|shows| Layer { name: shows.to_string(), shows })
}

/// The method by which errors are over the light in the picture: the one that tells of others.
pub(super) fn teller<'a, 'b>(all: &'b [Seen<'a>]) -> Option<&'b Seen<'a>> {
    all.iter().find(|seen| seen.settings.method == Method::Bidirectional)
}

/// Of each method.
pub(super) fn squares(all: &[Seen<'_>], relative: &RelativeTo) -> Vec<Squares> {
    let teller = teller(all);
    let of = |seen: &Seen<'_>| {
        let variance = relative.variance(&seen.lanes, scattered(seen));
        let told = teller.and_then(|teller| corrected(variance, relative, [seen, teller]));
        let others = all.iter().filter(|other| other.settings.method != seen.settings.method);
        let missed = match told {
            Some(_) => 0.0,
            None => others.map(|other| missed(&seen.lanes, &other.lanes)).fold(0.0, f64::max),
        };
        Squares { variance, expected: told.unwrap_or(variance), missed: missed * missed }
    };
    all.iter().map(of).collect()
}

/// Standard error of the variance of a sample: √((R − 1)/R · Σ (Vᵣ − V̄)²), Vᵣ the variance without replicate r.
pub(super) fn spread(seen: &Seen<'_>, relative: &RelativeTo) -> f64 {
    let plane = scattered(seen);
    let without = |one: usize| [&seen.lanes[..one], &seen.lanes[one + 1..]].concat();
    let without: Vec<f64> =
        (0..seen.lanes.len()).map(|one| relative.variance(&without(one), plane)).collect();
    let r = without.len() as f64;
    let mean = without.iter().sum::<f64>() / r;
    ((r - 1.0) / r * without.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>()).sqrt()
}

/// The variance of a sample of a method, where its own samples say `variance` and others also tell of the squares of what it adds.
///
/// Own samples and others tell the mean of the same squares. What others tell of more than own samples have met counts as much as these
/// do: contributions to one sample come together, so that the variance is more than their squares. Where own samples have met too much,
/// they have too much variance in proportion; of `light` others tell too little, as they take its walks for sure.
fn corrected(variance: f64, relative: &RelativeTo, [own, others]: [&Seen<'_>; 2]) -> Option<f64> {
    let method = own.settings.method;
    let told = Shows::Squares(method);
    let square = |seen: &Seen<'_>| Some(relative.square(&seen.lanes, plane(seen, &told)?));
    let (own, others) = (square(own)?, square(others)?);
    let together = (variance / own).max(1.0);
    let corrected = match own.total_cmp(&others) {
        Ordering::Greater if method == Method::Light => variance,
        Ordering::Greater => variance * others / own,
        _ => variance + (others - own) * together,
    };
    Some(if corrected.is_nan() { variance } else { corrected })
}

/// The plane of light that is scattered.
fn scattered(seen: &Seen<'_>) -> usize {
    plane(seen, &Shows::Scattered).expect("all that is tried shows it")
}

/// The plane of what a layer shows, behind that of the picture.
fn plane(seen: &Seen<'_>, shows: &Shows) -> Option<usize> {
    seen.settings.layers.iter().position(|layer| layer.shows == *shows).map(|layer| layer + 1)
}
