//! Quantiles of Student's t distribution.

/// The value that a t-distributed number with `freedom` degrees of freedom (at least 1) exceeds
/// with probability `alpha` in 0..1/2. Bisection on the tail, to a relative 1e-12.
pub fn student_t_upper(alpha: f64, freedom: u32) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high, freedom) > alpha {
        low = high;
        high *= 2.0;
    }
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if tail(middle, freedom) > alpha { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// P(T > t), by the finite series for a whole number of degrees of freedom (Abramowitz and Stegun
/// 26.7.3–4).
fn tail(t: f64, freedom: u32) -> f64 {
    let n = f64::from(freedom);
    let theta = libm::atan2(t, n.sqrt());
    let (sin, cos) = libm::sincos(theta);
    let two_sided = if freedom % 2 == 1 {
        let mut sum = 0.0;
        let mut term = cos;
        for k in (3..=freedom).step_by(2) {
            sum += term;
            term *= cos * cos * f64::from(k - 1) / f64::from(k);
        }
        core::f64::consts::FRAC_2_PI * (theta + sin * sum)
    } else {
        let mut sum = 0.0;
        let mut term = 1.0;
        for k in (2..=freedom).step_by(2) {
            sum += term;
            term *= cos * cos * f64::from(k - 1) / f64::from(k);
        }
        sin * sum
    };
    0.5 * (1.0 - two_sided)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (alpha, freedom, t) in [
            (0.05, 1, 6.3138),
            (0.05, 2, 2.9200),
            (0.05, 3, 2.3534),
            (0.025, 4, 2.7764),
            (0.005, 7, 3.4995),
            (0.01, 15, 2.6025),
        ] {
            assert!((student_t_upper(alpha, freedom) - t).abs() < 1e-4, "{alpha} {freedom}");
        }
    }
}
