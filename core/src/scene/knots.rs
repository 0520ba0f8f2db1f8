//! When the pieces of a scene's motion begin and end.

use crate::trace::moment::Moment;

/// The knots of a scene's motion, as shares of the time from the shutter's opening to its close. None where nothing
/// moves. Two at the same time are a jump: what is at the first holds before, what is at the second from then on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Knots {
    /// From 0 to 1, not falling; empty or at least two.
    shares: Vec<f32>,
}

impl Knots {
    /// Nothing moves.
    pub const STILL: Self = Self { shares: Vec::new() };

    /// From shares of the shutter's time that rise from 0 to 1.
    pub fn new(shares: Vec<f32>) -> Self {
        let ends = [shares.first(), shares.last()];
        assert!(shares.len() > 1 && ends == [Some(&0.0), Some(&1.0)] && shares.is_sorted(), "{shares:?}");
        Self { shares }
    }

    /// Whether nothing moves.
    pub fn is_still(&self) -> bool {
        self.shares.is_empty()
    }

    /// Number of knots; one where nothing moves.
    pub fn count(&self) -> usize {
        self.shares.len().max(1)
    }

    /// The moment at which a share of the shutter's time, in [0, 1), has passed.
    pub fn moment(&self, share: f32) -> Moment {
        if self.is_still() {
            return Moment::STILL;
        }
        let after = self.shares.partition_point(|s| *s <= share).clamp(1, self.shares.len() - 1);
        let (start, end) = (self.shares[after - 1], self.shares[after]);
        let passed = ((share - start) / (end - start)).clamp(0.0, 1.0_f32.next_down());
        Moment { piece: after as u32 - 1, passed }
    }

    /// The moments of the knots, and how much of the time each stands for when a mean is taken over them.
    pub fn weights(&self) -> impl Iterator<Item = (Moment, f64)> + '_ {
        let still = self.is_still().then_some((Moment::STILL, 1.0));
        let pieces = self.shares.windows(2).enumerate().filter(|(_, ends)| ends[0] < ends[1]);
        let moments = pieces.flat_map(|(piece, ends)| {
            let half = 0.5 * f64::from(ends[1] - ends[0]);
            [0.0, 1.0_f32.next_down()].map(|passed| (Moment { piece: piece as u32, passed }, half))
        });
        still.into_iter().chain(moments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_share_of_time_falls_into_its_piece_and_none_into_a_jump() {
        let knots = Knots::new(vec![0.0, 0.25, 0.25, 1.0]);
        let at = |share: f32| {
            let Moment { piece, passed } = knots.moment(share);
            (piece, passed)
        };
        assert_eq!([at(0.0), at(0.125), at(0.25), at(0.625)], [(0, 0.0), (0, 0.5), (2, 0.0), (2, 0.5)]);
        assert_eq!(at(0.25_f32.next_down()).0, 0);
        assert!(at(1.0).1 < 1.0 && at(1.0_f32.next_down()).1 < 1.0);
        assert_eq!(Knots::STILL.moment(0.7), Moment::STILL);
    }

    #[test]
    fn weights_sum_to_one() {
        for knots in [Knots::STILL, Knots::new(vec![0.0, 0.25, 0.25, 1.0])] {
            assert!((knots.weights().map(|w| w.1).sum::<f64>() - 1.0).abs() < 1e-7);
            assert!(knots.weights().all(|(moment, _)| moment.piece != 1));
        }
    }
}
