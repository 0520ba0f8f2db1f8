//! Which radiance a picture's white stands for.

/// Share of the area that is not brighter than white.
const QUANTILE: f64 = 0.999;

/// The least value that at least 99.9 % of all weight is at or below; one where nothing shines. What emits is left out by
/// the caller, so that a lamp does not darken the room that it lights.
pub fn white(mut values: Vec<(f32, f64)>) -> f32 {
    values.retain(|(value, weight)| value.is_finite() && *weight > 0.0);
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    for (value, weight) in values {
        below += weight;
        if below >= QUANTILE * whole && value > 0.0 {
            return value;
        }
    }
    1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_bright_points_do_not_count() {
        let mut values: Vec<(f32, f64)> = (1..=10_000).map(|i| (i as f32 / 10_000.0, 1.0)).collect();
        values.extend([(1e6, 1.0), (f32::NAN, 1.0)]);
        let white = white(values);
        assert!((white - 0.999).abs() < 1e-3, "{white}");
        assert_eq!(super::white(vec![(0.0, 1.0)]), 1.0);
        assert_eq!(super::white(Vec::new()), 1.0);
    }
}
