//! Squares of what a method adds to a pixel, also where another one renders.

use crate::math::colour::Rgb;
use crate::path::expression::language::{EyeState, LightState};
use crate::path::mis::exhaustive::{Ends, PathDensity, log_densities};
use crate::path::rules::{Rules, Weighing};
use crate::path::tally::{Receiver, Tally, Technique};
use crate::path::throughput::Throughput;
use crate::path::vertex::Cast;
use crate::settings::Method;
use glam::{DVec3, Vec3};

/// A path that one of all techniques has made.
#[derive(Debug)]
pub struct Made {
    /// Its vertices, from the light to the lens.
    pub path: Vec<PathDensity>,
    /// What its ends admit.
    pub ends: Ends,
    /// Vertices from the light.
    pub s: usize,
    /// What its first surface makes of light.
    pub cast: Cast,
    /// Weight of the technique among all.
    pub weight: f64,
    /// Probability with which roulette let both of its subpaths come so far.
    pub survival: f64,
    /// Probability with which it lets an eye subpath come to the last scattering, and to the light.
    pub from_eye: [f64; 2],
}

impl Made {
    /// By what the square of the contribution is multiplied for that of a method.
    fn factor(&self, densities: &[f64], method: Method) -> f64 {
        let k = densities.len();
        let is_of = |s: usize| match method {
            Method::Path => s <= 1 && k - s >= 2,
            Method::Light => k - s == 1,
            Method::Caustics => s <= 1 && k - s >= 2 || s >= 2 && k - s == 1 && self.cast == Cast::Caustic,
            Method::Bidirectional | Method::Photon | Method::Radiosity => true,
        };
        // Over the density of the technique that made the path.
        let (mut all, mut own, mut dearer) = (0.0, 0.0, 0.0);
        for s in (0..k).filter(|s| densities[*s] > f64::NEG_INFINITY) {
            let density = libm::exp(densities[s] - densities[self.s]);
            all += density;
            if is_of(s) {
                own += density;
                dearer += match s {
                    0 => density / self.from_eye[1],
                    1 => density / self.from_eye[0],
                    _ => density,
                };
            }
        }
        // Other weights than those of the balance heuristic are taken back.
        let factor = self.survival * dearer * all / (own * own) / (self.weight * all).powi(2);
        if factor.is_finite() { factor } else { 0.0 }
    }
}

/// Adds to the planes of squares what was added to the picture: both subpaths joined with `factor`, weight included.
///
/// With the balance heuristic all techniques together make a path with the density P, and each adds f/P of it. A method whose techniques
/// have the share w of them would add f/(wP) with the density wP: the mean of its square, ∫ f²/(wP), is that of (f/P)²/w over all.
///
/// Roulette lets the subpaths of technique i come so far with the probability qᵢ, and what is added is the more: the mean of the square is
/// ∫ f²/(wP) Σ (wᵢ/w)/qᵢ, the sum over the method's techniques, and that of (f/(qP))² q/w Σ (wᵢ/w)/qᵢ over all, q the one that made it.
/// Light subpaths of the method are taken for sure. Lamps and skies that are seen directly are left out everywhere: they are the same
/// large squares by every method.
#[inline(always)]
pub fn deposit(
    rules: &Rules,
    (receiver, technique): (Receiver, Technique),
    ends: (&impl Throughput<EyeState>, &impl Throughput<LightState>),
    factor: Rgb,
    tally: &mut Tally,
    made: impl FnOnce() -> Made,
) {
    if let [first, ..] = rules.square_planes()
        && technique.0 + technique.1 > 2
    {
        deposit_in(rules, (receiver, first.1), ends, factor, tally, made);
    }
}

#[cold]
fn deposit_in(
    rules: &Rules,
    (receiver, first): (Receiver, usize),
    (eye, light): (&impl Throughput<EyeState>, &impl Throughput<LightState>),
    factor: Rgb,
    tally: &mut Tally,
    made: impl FnOnce() -> Made,
) {
    let value = (shown(rules, eye, light) * factor).as_dvec3();
    let mut add = |plane, factor: f64| {
        let square = (value * value * factor).min(DVec3::splat(f64::from(f32::MAX)));
        tally.add(receiver, plane, square.as_vec3());
    };
    if matches!(rules.weighing, Weighing::All(_)) {
        let made = made();
        let densities = log_densities(&made.path, &made.ends);
        rules
            .square_planes()
            .iter()
            .for_each(|(method, plane)| add(*plane, made.factor(&densities, *method)));
    } else {
        add(first, 1.0);
    }
}

/// What both subpaths carry of words that the picture shows.
fn shown(rules: &Rules, eye: &impl Throughput<EyeState>, light: &impl Throughput<LightState>) -> Rgb {
    let mut whole = Vec3::ZERO;
    eye.each(|q, from_eye| {
        light.each(|l, from_light| {
            if let (Some(q), Some(l)) = (q, l)
                && rules.language.accepts(q, l).has(0)
            {
                whole += from_eye * from_light;
            }
        });
    });
    whole
}
