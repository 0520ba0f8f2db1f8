//! With which probability roulette lets subpaths go on.

use crate::math::colour::Rgb;
use glam::Vec3;

/// Scatterings before which no walk is ended by roulette. Measured as error² · time, smaller is better, from 2, 5 and
/// 9 on: a Cornell box 70, 51, 50; a hall with many lamps 26, 25, 26; a textured helmet 24, 12, 13.
pub const ROULETTE_FROM: u32 = 5;

/// What roulette has done to a subpath.
#[derive(Clone, Debug, PartialEq)]
pub struct Survival {
    /// Probability to get as far as before the last scattering.
    pub before: f64,
    /// Probability to get as far as now.
    pub now: f64,
    /// By vertex, what one from the other end is multiplied by when it scatters there, where that is asked for.
    pub turned: Vec<Rgb>,
}

impl Survival {
    /// Of a subpath that nothing has happened to.
    pub const SURE: Self = Self { before: 1.0, now: 1.0, turned: Vec::new() };

    /// The subpath has scattered, and goes on with a probability.
    #[inline]
    pub fn scatter(&mut self, survival: f32) {
        self.before = self.now;
        self.now *= f64::from(survival);
    }
}

/// Probabilities of an eye subpath to get to the last scattering of a whole path, and over it: it has come with the probability `now` to a
/// place before its scattering number `scatterings` + 1 with the throughput `carried`, and is multiplied by `rest` at those that follow.
pub fn to_the_light(
    mut carried: Rgb,
    mut scatterings: u32,
    now: f64,
    rest: impl IntoIterator<Item = Rgb>,
) -> [f64; 2] {
    let mut survival = [now; 2];
    for factor in rest {
        carried *= factor;
        scatterings += 1;
        survival[0] = survival[1];
        if scatterings >= ROULETTE_FROM {
            let goes_on = carried.max_element().clamp(f32::MIN_POSITIVE, 1.0);
            carried /= goes_on;
            survival[1] *= f64::from(goes_on);
        }
    }
    survival
}

/// What a subpath from the other end is multiplied by at a smooth scattering: f · |cos θ| / p← from f · |cos θ| / p→, by both densities
/// over solid angle and the cosines of the ways on and back.
pub fn turned(weight: Rgb, [forward, reverse]: [f64; 2], [on, back]: [f64; 2]) -> Rgb {
    let factor = (forward / reverse * back / on) as f32;
    if factor.is_finite() { weight * factor } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roulette_takes_from_the_fifth_scattering_on_what_was_lost_since_the_last() {
        let half = [Vec3::new(0.5, 0.25, 0.1); 7];
        // 1/32 is left after five scatterings, and all of it again after each that follows.
        assert_eq!(to_the_light(Vec3::ONE, 0, 1.0, half), [1.0 / 64.0, 1.0 / 128.0]);
        assert_eq!(to_the_light(Vec3::ONE, 0, 1.0, half.into_iter().take(4)), [1.0, 1.0]);
        assert_eq!(to_the_light(Vec3::ONE, 5, 0.25, half.into_iter().take(1)), [0.25, 0.125]);
        assert_eq!(to_the_light(Vec3::splat(4.0), 5, 1.0, half.into_iter().take(2)), [1.0, 1.0]);
    }

    #[test]
    fn a_scattering_counts_from_both_ends_by_its_own_densities() {
        // f = 3: 3 · 0.5 / 2 one way, 3 · 0.25 / 4 the other.
        let weight = Vec3::splat(3.0 * 0.5 / 2.0);
        assert_eq!(turned(weight, [2.0, 4.0], [0.5, 0.25]), Vec3::splat(3.0 * 0.25 / 4.0));
        assert_eq!(turned(weight, [2.0, 0.0], [0.5, 0.25]), Vec3::ZERO);
    }
}
