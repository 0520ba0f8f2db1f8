//! Where each triangle lies in a light map: halves of squares whose sides are powers of two, in Morton order.

use glam::Vec2;

/// Texels between a square's edge and the triangles in it, so that interpolation stays inside.
const EDGE: f32 = 1.0;
/// How far the long edges keep from the square's corners: two triangles of a square then share no texel that
/// interpolation on either looks at (their sums of coordinates differ by 2 · (GAP − EDGE) = 4 texels).
const GAP: f32 = 3.0;
/// Smallest square.
const SMALLEST: u32 = 8;

/// Which half of its square a triangle lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// That of the square's origin.
    First,
    /// The other.
    Second,
}

/// A triangle's place: half a square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chart {
    /// The square's first texel.
    pub origin: [u32; 2],
    /// The square's side in texels.
    pub side: u32,
    /// Which half of it.
    pub half: Half,
}

impl Chart {
    fn legs(&self) -> f32 {
        self.side as f32 - EDGE - GAP
    }

    /// Where a point lies, in texels; `weights` are those of the second and third corner.
    pub fn place(&self, weights: Vec2) -> Vec2 {
        let inside = Vec2::splat(EDGE) + weights * self.legs();
        let inside = match self.half {
            Half::First => inside,
            Half::Second => Vec2::splat(self.side as f32) - inside,
        };
        Vec2::new(self.origin[0] as f32, self.origin[1] as f32) + inside
    }

    /// The texels of its half, each with the weights of the point nearest to the texel's middle.
    pub fn texels(&self) -> impl Iterator<Item = ([u32; 2], Vec2)> + use<> {
        let chart = *self;
        let n = self.side;
        let mine = move |x: u32, y: u32| match chart.half {
            Half::First => x + y < n - 1,
            Half::Second => x + y >= n - 1,
        };
        (0..n * n).map(move |i| (i % n, i / n)).filter(move |&(x, y)| mine(x, y)).map(move |(x, y)| {
            let middle = Vec2::new(x as f32, y as f32) + 0.5;
            let inside = match chart.half {
                Half::First => middle,
                Half::Second => Vec2::splat(n as f32) - middle,
            };
            let weights = ((inside - EDGE) / chart.legs()).max(Vec2::ZERO);
            let beyond = (weights.x + weights.y - 1.0).max(0.0) * 0.5;
            let weights = (weights - beyond).clamp(Vec2::ZERO, Vec2::ONE);
            let weights = weights / (weights.x + weights.y).max(1.0);
            ([chart.origin[0] + x, chart.origin[1] + y], weights)
        })
    }
}

/// Charts for triangles of the given sizes (lengths, all of one unit) in a square of `side` texels, a power of two; as many
/// texels for each as fit, in proportion to its size. `None` where not even the smallest charts fit.
pub fn pack(sizes: &[f64], side: u32) -> Option<Vec<Chart>> {
    let longest = sizes.iter().fold(0.0_f64, |a, b| a.max(*b));
    if !(side.is_power_of_two() && side >= SMALLEST && longest.is_finite()) {
        return None;
    }
    let square = |size: f64, most: u32| {
        let texels = (size / longest.max(f64::MIN_POSITIVE) * f64::from(most)).ceil() as u32;
        texels.next_power_of_two().clamp(SMALLEST, most)
    };
    let fits = |most: &u32| {
        let mut counts = [0_u64; 32];
        for size in sizes {
            counts[square(*size, *most).ilog2() as usize] += 1;
        }
        let needed = counts.iter().enumerate().map(|(log, n)| n.div_ceil(2) << (2 * log)).sum::<u64>();
        needed <= u64::from(side) * u64::from(side)
    };
    let most = std::iter::successors(Some(side), |n| (*n > SMALLEST).then_some(n / 2)).find(fits)?;
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(square(sizes[i], most)), i));
    let mut charts = vec![Chart { origin: [0; 2], side: SMALLEST, half: Half::First }; sizes.len()];
    // In units of the smallest square, along Morton's curve: larger squares first keeps every one aligned.
    let mut next = 0_u64;
    for same in order.chunk_by(|&a, &b| square(sizes[a], most) == square(sizes[b], most)) {
        let side = square(sizes[same[0]], most);
        for pair in same.chunks(2) {
            let origin = [compact(next), compact(next >> 1)].map(|v| v * SMALLEST);
            for (i, half) in pair.iter().zip([Half::First, Half::Second]) {
                charts[*i] = Chart { origin, side, half };
            }
            next += u64::from(side / SMALLEST).pow(2);
        }
    }
    Some(charts)
}

/// Every second bit.
fn compact(bits: u64) -> u32 {
    (0..32).map(|i| ((bits >> (2 * i) & 1) as u32) << i).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_do_not_overlap_and_interpolation_stays_in_them() {
        let sizes: Vec<f64> = (1..150).map(|i| f64::from(i * i % 37 + 1)).collect();
        let charts = pack(&sizes, 512).unwrap();
        let mut owner = vec![usize::MAX; 512 * 512];
        for (i, chart) in charts.iter().enumerate() {
            for ([x, y], weights) in chart.texels() {
                let texel = &mut owner[(y * 512 + x) as usize];
                assert_eq!(*texel, usize::MAX);
                *texel = i;
                assert!(weights.min_element() >= 0.0 && weights.x + weights.y <= 1.0 + 1e-6);
            }
        }
        for (i, chart) in charts.iter().enumerate() {
            for (u, v) in (0..=20).flat_map(|u| (0..=20 - u).map(move |v| (u, v))) {
                let place = chart.place(Vec2::new(u as f32, v as f32) / 20.0) - 0.5;
                let corner = place.floor();
                for (dx, dy) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    // What interpolation gives no weight may be anybody's.
                    let weight = Vec2::new(dx as f32, dy as f32) - (Vec2::ONE - (place - corner));
                    if weight.abs().min_element() == 1.0 {
                        continue;
                    }
                    let (x, y) = (corner.x as usize + dx, corner.y as usize + dy);
                    assert_eq!(owner[y * 512 + x], i, "{chart:?} {place}");
                }
            }
        }
    }

    #[test]
    fn a_texel_shows_the_point_it_lies_on() {
        let charts = pack(&[1.0, 1.0], 64).unwrap();
        for chart in charts {
            for ([x, y], weights) in chart.texels() {
                let place = chart.place(weights);
                let off = (place - Vec2::new(x as f32, y as f32) - 0.5).abs().max_element();
                // The square's corners are the farthest: GAP from the triangle's, less the half of a texel.
                assert!(off <= GAP - 0.5, "at most the padding off: {off}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_said() {
        assert!(pack(&[1.0; 129], 64).is_none());
        assert!(pack(&[1.0; 128], 64).is_some());
        assert!(pack(&[1.0], 100).is_none());
    }
}
