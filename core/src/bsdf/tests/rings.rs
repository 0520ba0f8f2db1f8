//! The albedo of rough glass by Gauss's rule between the kinks of its integrand.
//!
//! The cosine-weighted distribution of normals is uniform over the squared sine of χ, tan θₕ = α tan χ, and over
//! the azimuth ψ about the surface normal. Along ψ the cosine between direction and facet is p + q cos ψ, so that
//! it is known where the facet turns away, reflects totally, or sends light along the horizon;
//! along χ, where each of these begins. Between such places the rule is that of u in 3u² − 2u³, which
//! removes roots at both ends.

use super::oracle::passed;
use std::f64::consts::{FRAC_PI_2, PI};

/// Nodes along χ and ψ.
pub(in crate::bsdf) struct Rings {
    along: Vec<[f64; 2]>,
    around: Vec<[f64; 2]>,
}

/// A direction above an interface.
struct View {
    mu: f64,
    sin: f64,
    alpha: f64,
    /// Index of the far side over that of the near one.
    eta: f64,
    /// Facets at which it has less than this cosine reflect totally.
    critical: f64,
}

impl Rings {
    pub(in crate::bsdf) fn new(nodes: usize) -> Self {
        Self { along: rule(nodes), around: rule(nodes) }
    }

    /// E met from the side whose index is 1 of an interface with relative index `eta`.
    pub(in crate::bsdf) fn albedo(&self, mu: f64, alpha: f64, eta: f64) -> f64 {
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        let view = View { mu, sin, alpha, eta, critical: (1.0 - eta * eta).max(0.0).sqrt() };
        let mut sum = 0.0;
        for ends in view.rings().windows(2) {
            for [place, weight] in &self.along {
                let (sin, cos) = libm::sincos(ends[0] + (ends[1] - ends[0]) * place);
                let cosine = 1.0 / (1.0 + (alpha * sin / cos) * (alpha * sin / cos)).sqrt();
                sum += weight * (ends[1] - ends[0]) * sin * cos / cosine * self.ring(&view, cosine);
            }
        }
        4.0 * sum / (PI * (mu + (mu * mu + alpha * alpha * sin * sin).sqrt()))
    }

    /// ∫ of what facets of a cosine with the normal return, times their cosine with the direction.
    fn ring(&self, view: &View, cosine: f64) -> f64 {
        let (level, swing) = (cosine * view.mu, (1.0 - cosine * cosine).sqrt() * view.sin);
        let angles = view.angles(cosine, level, swing);
        let mut sum = 0.0;
        for ends in angles.windows(2) {
            for [place, weight] in &self.around {
                let dot = level + swing * libm::cos(ends[0] + (ends[1] - ends[0]) * place);
                if dot > 0.0 {
                    sum += weight * (ends[1] - ends[0]) * dot * view.returned(dot, cosine);
                }
            }
        }
        sum
    }
}

impl View {
    /// χ between which the integrand over rings of normals is smooth.
    fn rings(&self) -> Vec<f64> {
        let &Self { mu, sin, alpha, eta, critical } = self;
        let theta = libm::atan2(sin, mu);
        let tan = |angle: f64| libm::tan(angle);
        // The facet turns away; its reflection is along the horizon.
        let mut tangents = vec![
            mu / sin,
            0.2 * sin / mu,
            5.0 * mu / sin,
            tan(0.5 * (FRAC_PI_2 + theta)),
            tan(0.5 * (FRAC_PI_2 - theta)),
        ];
        if critical > 0.0 {
            let least = libm::asin(eta);
            // It begins to reflect totally; what it refracts is along the horizon.
            tangents.extend([tan((theta - least).abs()), tan(theta + least)]);
            tangents.extend([(sin - eta).abs() / mu, (sin + eta) / mu]);
        }
        let inside = tangents.into_iter().filter(|tan| *tan > 0.0).map(|tan| libm::atan(tan / alpha));
        let mut ends: Vec<f64> = inside.chain([0.0, FRAC_PI_2]).collect();
        ends.sort_by(f64::total_cmp);
        ends
    }

    /// ψ between which the integrand over a ring is smooth.
    fn angles(&self, cosine: f64, level: f64, swing: f64) -> Vec<f64> {
        let mut ends = vec![0.0];
        let mut add = |dot: f64| {
            let place = (dot - level) / swing;
            if place.abs() < 1.0 {
                ends.push(libm::acos(place));
            }
        };
        [0.0, 0.5 * self.mu / cosine].into_iter().for_each(&mut add);
        if self.critical > 0.0 {
            add(self.critical);
            // What is refracted is along the horizon: its cosine and that of `dot` differ by b / η.
            let (b, change) = (self.mu / (self.eta * cosine), 1.0 / (self.eta * self.eta) - 1.0);
            if b * b <= change {
                add(0.5 * self.eta * (b + change / b));
            }
        }
        ends.push(if swing > level { libm::acos(-level / swing) } else { PI });
        ends.sort_by(f64::total_cmp);
        ends
    }

    /// What a facet returns to either side.
    fn returned(&self, dot: f64, cosine: f64) -> f64 {
        let &Self { mu, alpha, eta, .. } = self;
        let up = passed(alpha, mu, 2.0 * dot * cosine - mu);
        let squared = 1.0 - (1.0 - dot * dot) / (eta * eta);
        if squared <= 0.0 {
            return up;
        }
        let root = squared.sqrt();
        let parallel = (eta * dot - root) / (eta * dot + root);
        let perpendicular = (dot - eta * root) / (dot + eta * root);
        let reflected = 0.5 * (parallel * parallel + perpendicular * perpendicular);
        let down = passed(alpha, mu, mu / eta - cosine * (dot / eta - root));
        reflected * up + (1.0 - reflected) * down
    }
}

/// Places 0..1 and weights of a rule that removes roots at both ends: Gauss's in u, at 3u² − 2u³.
fn rule(nodes: usize) -> Vec<[f64; 2]> {
    let count = nodes as f64;
    let node = |i: usize| {
        // Newton's method for the roots of Legendre's polynomial.
        let mut x = libm::cos(PI * (i as f64 + 0.75) / (count + 0.5));
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=nodes {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = count * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        let u = 0.5 * (1.0 - x);
        [u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / ((1.0 - x * x) * slope * slope)]
    };
    (0..nodes).map(node).collect()
}
