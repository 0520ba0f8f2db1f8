//! Integrals in f64 from which the albedo tables are made and checked.

use crate::bsdf::ggx::SPECULAR_BELOW;
use std::f64::consts::PI;

/// The mean over normals visible at a cosine μ of a function of their cosine with the direction and with
/// the surface normal: the midpoint rule on the spherical cap, refined towards its edge, where few
/// normals send light below the horizon.
pub(in crate::bsdf) fn visible_mean<const K: usize>(
    mu: f64,
    alpha: f64,
    n: usize,
    f: impl Fn(f64, f64) -> [f64; K],
) -> [f64; K] {
    let sin = (1.0 - mu * mu).sqrt();
    let stretched = (mu * mu + alpha * alpha * sin * sin).sqrt();
    let (sx, sz) = (alpha * sin / stretched, mu / stretched);
    let turns: Vec<(f64, f64)> = (0..n).map(|j| libm::sincos(PI * (j as f64 + 0.5) / n as f64)).collect();
    let mut sum = [0.0; K];
    for i in 0..n {
        let left = 1.0 - (i as f64 + 0.5) / n as f64;
        let z = left.powi(4) * (1.0 + sz) - sz;
        let r = ((1.0 - z) * (1.0 + z)).sqrt();
        let measure = 4.0 * left.powi(3) / (n * n) as f64;
        for (sin_phi, cos_phi) in &turns {
            let (hx, hy, hz) = (alpha * (r * cos_phi + sx), alpha * r * sin_phi, z + sz);
            let scale = 1.0 / (hx * hx + hy * hy + hz * hz).sqrt();
            let values = f((sin * hx + mu * hz) * scale, hz * scale);
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += measure * value);
        }
    }
    sum
}

/// G₂ / G₁ for the cosines of two directions, zero below the horizon.
pub(in crate::bsdf) fn passed(alpha: f64, mu: f64, other: f64) -> f64 {
    let stretched = |z: f64| (z * z + alpha * alpha * (1.0 - z * z).max(0.0)).sqrt();
    let own = stretched(mu);
    if other > 0.0 { other * (mu + own) / (other * own + mu * stretched(other)) } else { 0.0 }
}

/// The roughness at a place 0..=1 among a table's rows.
pub(in crate::bsdf) fn alpha_of(place: f64) -> f64 {
    let first = f64::from(SPECULAR_BELOW).sqrt();
    let root = first + (1.0 - first) * place;
    root * root
}

/// The cosine at a place 0..=1 among a table's columns.
pub(in crate::bsdf) fn cosine_of(t: f64, alpha: f64) -> f64 {
    let (x2, above) = if t < 0.5 {
        (4.0 * t.powi(4), 1.0 - 4.0 * t.powi(4))
    } else {
        let below = 2.0 * (1.0 - t) * (1.0 - t);
        ((1.0 - below) * (1.0 - below), below * (2.0 - below))
    };
    let scaled = alpha * alpha * x2;
    (scaled / (above + scaled)).sqrt()
}

/// 2 ∫ f μ dμ of a function of column, place 0..1 within it, and cosine.
pub(in crate::bsdf) fn hemisphere<const K: usize>(
    columns: usize,
    alpha: f64,
    f: impl Fn(usize, f64, f64) -> [f64; K],
) -> [f64; K] {
    let steps = 64;
    let mut sum = [0.0; K];
    for column in 0..columns - 1 {
        for step in 0..steps {
            let cosine =
                |s: f64| cosine_of((column as f64 + s / f64::from(steps)) / (columns - 1) as f64, alpha);
            let (low, high) = (cosine(f64::from(step)), cosine(f64::from(step) + 1.0));
            let middle = f64::from(step) + 0.5;
            let values = f(column, middle / f64::from(steps), cosine(middle));
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += (high * high - low * low) * value);
        }
    }
    sum
}
