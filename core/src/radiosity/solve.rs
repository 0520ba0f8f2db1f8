//! The system of equations, by iteration.

use crate::radiosity::form_factor::Row;
use glam::DVec3;
use rayon::prelude::*;

/// Iterations after which no more are made.
const ITERATIONS_MAX: u32 = 20_000;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// The estimated relative error of the solution is at most this.
    Error(f64),
    /// Light has been scattered this often.
    Scatterings(u32),
}

/// A solution, and the way there.
#[derive(Clone, Debug)]
pub struct Solved {
    /// H of each element: mean radiance that arrives, by the cosine.
    pub arriving: Vec<DVec3>,
    /// For each iteration, Σ A ρ |change of H| / Σ A ρ H: how much radiosity it adds to what is there.
    pub residuals: Vec<f64>,
}

/// Solves H = D + F ρ H by Jacobi's iteration from H = D. After n steps it holds what has been scattered n times on the way
/// to an element, and its error falls by the mean reflectance at every step at least. `areas` are those of the elements.
pub fn solve(rows: &[Row], areas: &[f64], until: Until) -> Solved {
    let mut residuals = Vec::new();
    if let Until::Scatterings(0) = until {
        return Solved { arriving: vec![DVec3::ZERO; rows.len()], residuals };
    }
    let most = match until {
        Until::Error(_) => ITERATIONS_MAX,
        Until::Scatterings(n) => (n - 1).min(ITERATIONS_MAX),
    };
    let mut arriving: Vec<DVec3> = rows.iter().map(|row| row.direct).collect();
    let mut leaving = leave(rows, &arriving);
    for _ in 0..most {
        let next: Vec<DVec3> = rows.par_iter().map(|row| row.direct + gathered(row, &leaving)).collect();
        let residual = residual(rows, areas, &arriving, &next);
        (leaving, arriving) = (leave(rows, &next), next);
        let before = residuals.last().copied();
        residuals.push(residual);
        // What is still to come is a geometric series of the last ratio.
        let ratio = before.map_or(0.5, |before: f64| residual / before).min(1.0 - 1e-6);
        let done = match until {
            Until::Error(error) => residual * ratio / (1.0 - ratio) <= error,
            Until::Scatterings(_) => false,
        };
        if done || residual == 0.0 {
            break;
        }
    }
    Solved { arriving, residuals }
}

fn leave(rows: &[Row], arriving: &[DVec3]) -> Vec<DVec3> {
    rows.iter().zip(arriving).map(|(row, h)| row.reflectance.as_dvec3() * *h).collect()
}

fn gathered(row: &Row, leaving: &[DVec3]) -> DVec3 {
    row.links.iter().map(|link| leaving[link.from.index()] * f64::from(link.share)).sum()
}

fn residual(rows: &[Row], areas: &[f64], before: &[DVec3], after: &[DVec3]) -> f64 {
    let (mut change, mut whole) = (0.0, 0.0);
    for ((row, area), (b, a)) in rows.iter().zip(areas).zip(before.iter().zip(after)) {
        let scale = row.reflectance.as_dvec3() * *area;
        change += (scale * (*a - *b).abs()).element_sum();
        whole += (scale * *a).element_sum();
    }
    if whole > 0.0 { change / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::element::Element;
    use crate::radiosity::form_factor::Link;
    use glam::Vec3;

    /// Two infinite plates that face each other, the first one lit by itself.
    fn plates(a: f32, b: f32) -> Vec<Row> {
        let row = |direct: f64, reflectance: f32, from: u32| Row {
            direct: DVec3::splat(direct),
            reflectance: Vec3::splat(reflectance),
            links: vec![Link { from: Element(from), share: 1.0 }],
            rays: 0,
        };
        vec![row(0.0, a, 1), row(1.0, b, 0)]
    }

    #[test]
    fn plates_hold_what_the_series_says() {
        for (a, b) in [(0.5_f32, 0.8_f32), (0.99, 0.99), (0.0, 0.5), (0.5, 0.0)] {
            let solved = solve(&plates(a, b), &[1.0, 1.0], Until::Error(1e-9));
            let (a, b) = (f64::from(a), f64::from(b));
            let truth = [b / (1.0 - a * b), 1.0 / (1.0 - a * b)];
            for (found, truth) in solved.arriving.iter().zip(truth) {
                assert!((found.x - truth).abs() <= 2e-9 * truth, "{a} {b}: {found} is not {truth}");
            }
        }
    }

    #[test]
    fn scatterings_are_counted() {
        // Direct light on the second plate; once scattered it is on the first, twice: on the second again.
        let at = |n| {
            let solved = solve(&plates(0.5, 0.25), &[1.0, 1.0], Until::Scatterings(n));
            [solved.arriving[0].x, solved.arriving[1].x]
        };
        assert_eq!(at(0), [0.0, 0.0]);
        assert_eq!(at(1), [0.0, 1.0]);
        assert_eq!(at(2), [0.25, 1.0]);
        assert_eq!(at(3), [0.25, 1.125]);
    }
}
