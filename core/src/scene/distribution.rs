//! Choice of a texel in proportion to its weight, with a density over the unit square.

use glam::Vec2;

/// A piecewise constant density over the unit square, in rows of cells.
#[derive(Clone, Debug)]
pub struct Distribution {
    width: usize,
    height: usize,
    /// Running sums of each row's weights, from 0 to 1, `width + 1` a row.
    rows: Vec<f32>,
    /// Running sum of the rows' weights, from 0 to 1.
    column: Vec<f32>,
    /// Weight of each cell over the mean weight.
    density: Vec<f32>,
}

impl Distribution {
    /// Over `weights` (not negative, finite) row by row; `None` where none is positive.
    pub fn new(width: usize, height: usize, weights: &[f64]) -> Option<Self> {
        assert_eq!(weights.len(), width * height, "a weight for each cell");
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut rows = Vec::with_capacity((width + 1) * height);
        let mut sums = Vec::with_capacity(height);
        for row in weights.chunks(width) {
            let sum: f64 = row.iter().sum();
            running(row, sum, &mut rows);
            sums.push(sum);
        }
        let mut column = Vec::with_capacity(height + 1);
        running(&sums, total, &mut column);
        let mean = total / weights.len() as f64;
        let density = weights.iter().map(|w| (w / mean) as f32).collect();
        Some(Self { width, height, rows, column, density })
    }

    /// A point of the unit square and its density there.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (y, v) = invert(&self.column, u.y);
        let (x, s) = invert(&self.rows[y * (self.width + 1)..(y + 1) * (self.width + 1)], u.x);
        let point = Vec2::new((x as f32 + s) / self.width as f32, (y as f32 + v) / self.height as f32);
        (point, self.density[y * self.width + x])
    }

    /// Density at a point of the unit square.
    pub fn density(&self, point: Vec2) -> f32 {
        let cell = |p: f32, n: usize| ((p * n as f32) as usize).min(n - 1);
        self.density[cell(point.y, self.height) * self.width + cell(point.x, self.width)]
    }
}

fn running(weights: &[f64], total: f64, sums: &mut Vec<f32>) {
    let mut sum = 0.0;
    sums.push(0.0);
    for w in weights {
        sum += w;
        sums.push(if total > 0.0 { (sum / total) as f32 } else { 0.0 });
    }
}

/// The cell that `u` falls into and its place in it, both of cells of positive weight.
fn invert(sums: &[f32], u: f32) -> (usize, f32) {
    let last = sums[sums.len() - 1];
    let u = u.min(last.next_down());
    let i = sums.partition_point(|s| *s <= u).clamp(1, sums.len() - 1) - 1;
    let width = sums[i + 1] - sums[i];
    let place = if width > 0.0 { (u - sums[i]) / width } else { 0.5 };
    (i, place.clamp(0.0, 1.0_f32.next_down()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fall_into_cells_in_proportion_to_their_weight() {
        let weights = [0.0, 1.0, 0.5, 0.0, 0.0, 0.0, 4.0, 0.25, 0.25];
        let distribution = Distribution::new(3, 3, &weights).unwrap();
        let n = 300;
        let mut counts = [0.0; 9];
        for i in 0..n * n {
            let u = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
            let (p, density) = distribution.sample(u);
            let cell = (p.y * 3.0) as usize * 3 + (p.x * 3.0) as usize;
            assert!((density - distribution.density(p)).abs() < 1e-6);
            assert!((f64::from(density) - weights[cell] / 6.0 * 9.0).abs() < 1e-5);
            counts[cell] += 1.0;
        }
        for (count, weight) in counts.iter().zip(weights) {
            assert!((count / f64::from(n * n) - weight / 6.0).abs() < 0.005, "{counts:?}");
        }
        assert!(Distribution::new(1, 1, &[0.0]).is_none());
    }
}
