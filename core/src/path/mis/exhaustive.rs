//! Weights from all densities of a path, written out: for chosen techniques, where no recursion holds.

use crate::path::mis::heuristic::Heuristic;
use crate::settings::{Strategy, Weights};

/// What a subpath knows of one of its vertices. The first is on the light or the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Density over area with which the subpath made it (over solid angle for light from infinitely far).
    pub forward: f64,
    /// Density over area with which it is made from the vertex after it.
    pub reverse: f64,
    /// Turns a density over solid angle at this vertex, towards the one before, into one over area there.
    pub jacobian: f64,
    /// Whether the path goes through it by a Dirac delta, so that nothing can be joined to it.
    pub specular: bool,
}

/// A vertex of a whole path, from the light to the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathDensity {
    /// Density from the light's side.
    pub from_light: f64,
    /// Density from the eye's side.
    pub from_eye: f64,
    /// Whether nothing can be joined to it.
    pub specular: bool,
}

/// What the ends of a path admit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Density with which a next event at the second vertex picks the first, where the first can be picked.
    pub next_event: f64,
    /// Whether a ray can hit the light.
    pub light_is_hit: bool,
    /// Density over area with which the lens is picked, where a ray can hit it.
    pub lens: Option<f64>,
    /// Light subpaths for every eye subpath of a pixel.
    pub light_paths: f64,
}

/// Techniques that are used, and how they are weighed.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    strategies: Vec<Strategy>,
    weights: Weights,
}

impl Chosen {
    /// Only `strategies`, or all but those that hit the lens where there are none.
    pub fn new(strategies: Vec<Strategy>, weights: Weights) -> Self {
        Self { strategies, weights }
    }

    /// Whether a technique is used.
    pub fn uses(&self, s: usize, t: usize) -> bool {
        if self.strategies.is_empty() {
            return t >= 1;
        }
        self.strategies.iter().any(|one| one.s as usize == s && one.t as usize == t)
    }

    /// Weight of the technique with `s` vertices from the light. `path` runs from the light to the lens.
    pub fn weight(&self, path: &[PathDensity], ends: &Ends, s: usize) -> f64 {
        if self.weights == Weights::Single {
            return 1.0;
        }
        let heuristic = if self.weights == Weights::Power { Heuristic::Power } else { Heuristic::Balance };
        let own = log_density(path, ends, s);
        let mut sum = 0.0;
        for other in 0..=path.len() {
            if self.uses(other, path.len() - other) && is_able(path, ends, other) {
                sum += match self.weights {
                    Weights::Uniform => 1.0,
                    _ if other == s => 1.0,
                    _ => heuristic.of(libm::exp(log_density(path, ends, other) - own)),
                };
            }
        }
        1.0 / sum
    }
}

/// Whether a technique can make the path at all.
pub fn is_able(path: &[PathDensity], ends: &Ends, s: usize) -> bool {
    match s {
        0 => ends.light_is_hit && log_density(path, ends, 0) > f64::NEG_INFINITY,
        _ if s == path.len() => ends.lens.is_some() && log_density(path, ends, s) > f64::NEG_INFINITY,
        _ => {
            let joined = !path[s - 1].specular && !path[s].specular;
            joined && log_density(path, ends, s) > f64::NEG_INFINITY
        }
    }
}

/// Logarithm of how often a technique makes the path, per eye subpath of its pixel: densities of long paths leave the range
/// of f64.
pub fn log_density(path: &[PathDensity], ends: &Ends, s: usize) -> f64 {
    let (light, eye) = path.split_at(s);
    let mut sum = 0.0;
    for (i, vertex) in light.iter().enumerate() {
        let picked = i == 0 && s == 1 && path.len() > 2;
        sum += libm::log(if picked { ends.next_event } else { vertex.from_light });
    }
    // The place on the lens is picked alike by all techniques that do not hit it, and left out of their densities.
    let eye = eye.split_last().map_or(eye, |(_, rest)| rest);
    for vertex in eye {
        sum += libm::log(vertex.from_eye);
    }
    match path.len() - s {
        0 => sum + libm::log(ends.light_paths) - ends.lens.map_or(f64::INFINITY, libm::log),
        1 => sum + libm::log(ends.light_paths),
        _ => sum,
    }
}

/// [`log_density`] of all techniques that do not hit the lens, by how many vertices they have from the light, at once; −∞ of those
/// that cannot make the path.
pub fn log_densities(path: &[PathDensity], ends: &Ends) -> Vec<f64> {
    let k = path.len();
    let mut sums = vec![0.0; k];
    for i in (0..k - 1).rev() {
        sums[i] = sums[i + 1] + libm::log(path[i].from_eye);
    }
    if !ends.light_is_hit {
        sums[0] = f64::NEG_INFINITY;
    }
    let mut light = libm::log(path[0].from_light);
    for s in 1..k {
        let to_lens = if s == k - 1 { libm::log(ends.light_paths) } else { 0.0 };
        let ended = if s == 1 && k > 2 { libm::log(ends.next_event) } else { light };
        let joined = !path[s - 1].specular && !path[s].specular;
        sums[s] = if joined { sums[s] + ended + to_lens } else { f64::NEG_INFINITY };
        light += libm::log(path[s].from_light);
    }
    sums
}
