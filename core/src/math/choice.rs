//! Weighted choice in constant time.

/// An alias table (Walker 1977, built as in Vose 1991): picks an index with probability in
/// proportion to its weight.
#[derive(Clone, Debug, Default)]
pub struct AliasTable {
    slots: Vec<Slot>,
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    /// Chance that this slot keeps its own index.
    keep: f32,
    alias: u32,
    /// Probability of this index over the whole table.
    probability: f32,
}

impl AliasTable {
    /// `None` where no weight is positive. Weights must be finite and not negative.
    pub fn new(weights: &[f64]) -> Option<Self> {
        debug_assert!(weights.iter().all(|w| w.is_finite() && *w >= 0.0));
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let n = weights.len() as f64;
        let mut scaled: Vec<f64> = weights.iter().map(|w| w / total * n).collect();
        let mut slots: Vec<Slot> = (weights.iter().enumerate())
            .map(|(i, w)| Slot { keep: 1.0, alias: i as u32, probability: (w / total) as f32 })
            .collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..weights.len()).partition(|&i| scaled[i] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            slots[s].keep = scaled[s] as f32;
            slots[s].alias = l as u32;
            scaled[l] -= 1.0 - scaled[s];
            if scaled[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // Rounding may leave a slot of weight zero in `small` with nothing to pair it with.
        let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        for s in small.into_iter().filter(|&s| weights[s] == 0.0) {
            slots[s].keep = 0.0;
            slots[s].alias = heaviest as u32;
        }
        Some(Self { slots })
    }

    /// An index, its probability, and what is left of `u` (uniform in 0..1 again).
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let scaled = u * self.slots.len() as f32;
        let i = (scaled as usize).min(self.slots.len() - 1);
        let rest = (scaled - i as f32).clamp(0.0, 1.0);
        let slot = self.slots[i];
        let (index, rest) = if rest < slot.keep {
            (i, rest / slot.keep)
        } else {
            (slot.alias as usize, (rest - slot.keep) / (1.0 - slot.keep))
        };
        (index, self.slots[index].probability, rest.min(1.0_f32.next_down()))
    }

    /// The probability of an index.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        self.slots[index].probability
    }

    /// Number of indices.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether there is nothing to pick; never true of a table that was built.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_index_is_picked_as_often_as_its_weight_says() {
        let weights = [0.0, 1.0, 3.0, 1e-3, 0.0, 7.5, 2.0];
        let total: f64 = weights.iter().sum();
        let table = AliasTable::new(&weights).unwrap();
        let n = 1 << 20;
        let mut counts = [0_u32; 7];
        for i in 0..n {
            let (index, probability, rest) = table.sample((i as f32 + 0.5) / n as f32);
            assert!((0.0..1.0).contains(&rest));
            assert!((f64::from(probability) - weights[index] / total).abs() < 1e-7);
            counts[index] += 1;
        }
        for (count, weight) in counts.iter().zip(weights) {
            // The points are equidistant: each of the 7 slots has at most two cuts, so a count is off by a few.
            assert!((f64::from(*count) - weight / total * f64::from(n)).abs() < 8.0, "{counts:?}");
        }
    }

    #[test]
    fn nothing_to_pick_is_no_table() {
        assert!(AliasTable::new(&[]).is_none());
        assert!(AliasTable::new(&[0.0, 0.0]).is_none());
    }
}
