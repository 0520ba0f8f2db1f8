//! How long to wait before a call is tried again.

use std::time::Duration;

/// Waits that double from `first` to `longest`, each drawn from its upper half so that many clients
/// of one farm do not come back at the same moment.
#[derive(Clone, Debug)]
pub struct Backoff {
    first: Duration,
    longest: Duration,
    next: Duration,
    state: u64,
}

impl Backoff {
    /// `seed` tells clients apart; nothing else depends on it.
    pub fn new(first: Duration, longest: Duration, seed: u64) -> Self {
        Self { first, longest, next: first, state: seed }
    }

    /// The next wait.
    pub fn delay(&mut self) -> Duration {
        let whole = self.next;
        self.next = (whole * 2).min(self.longest);
        whole.mul_f64(0.5 + 0.5 * self.unit())
    }

    /// Starts over after a success.
    pub fn reset(&mut self) {
        self.next = self.first;
    }

    /// Uniform in [0, 1): Steele, Lea & Flood, Fast splittable pseudorandom number generators, 2014.
    fn unit(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.state;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_longest_and_differ_between_clients() {
        let (first, longest) = (Duration::from_millis(100), Duration::from_secs(1));
        let delays = |seed| {
            let mut backoff = Backoff::new(first, longest, seed);
            (0..8).map(|_| backoff.delay()).collect::<Vec<_>>()
        };
        let mut whole = first;
        for delay in delays(1) {
            assert!(delay >= whole / 2 && delay <= whole, "{delay:?} of {whole:?}");
            whole = (whole * 2).min(longest);
        }
        assert_ne!(delays(1), delays(2));
    }
}
