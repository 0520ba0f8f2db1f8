//! Numbers as a function of (seed, replicate, pixel, index, dimension).
//!
//! Each dimension is an Owen-scrambled pair of the first two Sobol' dimensions whose index is
//! shuffled by nested uniform scrambling, so that aligned dyadic runs of indices stay nets in every
//! dimension and different dimensions are independent ("padding"; Burley 2020, "Practical
//! Hash-based Owen Scrambling").

use glam::Vec2;

/// One sample's numbers. A pure function of its arguments: it does not matter which other samples are drawn.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    key: u64,
    index: u32,
}

/// Which pair of numbers of a sample. Places are fixed, so that leaving a technique out shifts no other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Place in the pixel.
    Film,
    /// Place on the lens.
    Lens,
    /// When the shutter lets it in: the first number, as a share of the shutter's time.
    Time,
    /// At the n-th scattering of the eye subpath, from 0.
    Eye(u32, Use),
    /// At the start of a light subpath.
    Start(StartUse),
    /// At the n-th scattering of a light subpath, from 0. Light subpaths have samplers of their own: [`Sampler::light`].
    Light(u32, Use),
}

/// What a number is used for at the start of a light subpath.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartUse {
    /// Choice of light, and of its side.
    Choice,
    /// Place on it, or direction of the sky.
    Place,
    /// Direction it leaves in, or place on the disk that light from afar passes through.
    Direction,
    /// Place on the lens that sees the light itself.
    Lens,
}

/// What a number is used for at a scattering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Choice of lobe, and roulette.
    Choice,
    /// Direction.
    Direction,
    /// Choice of light.
    Light,
    /// Place on the light.
    LightPoint,
    /// Whether what is partly transparent is hit, on the way there.
    Alpha,
    /// Place on the lens.
    Lens,
}

/// What nearly every scattering draws, in the order of their dimensions.
const DRAWN_TOGETHER: [Use; 4] = [Use::Choice, Use::Direction, Use::Light, Use::LightPoint];

/// The pairs of one scattering that are drawn together, first and second numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScatteringNumbers {
    first: [f32; 4],
    second: [f32; 4],
}

impl ScatteringNumbers {
    /// Choice of lobe, and roulette.
    #[inline]
    pub fn choice(&self) -> Vec2 {
        self.pair(0)
    }

    /// Direction.
    #[inline]
    pub fn direction(&self) -> Vec2 {
        self.pair(1)
    }

    /// Choice of light; the second number where one has too few digits.
    #[inline]
    pub fn light(&self) -> Vec2 {
        self.pair(2)
    }

    /// Place on the light.
    #[inline]
    pub fn light_point(&self) -> Vec2 {
        self.pair(3)
    }

    #[inline]
    fn pair(&self, place: usize) -> Vec2 {
        Vec2::new(self.first[place], self.second[place])
    }
}

/// Keeps light subpaths apart from the pixel's own numbers.
const LIGHT: u64 = 0x6c69_6768_7473;
/// Dimensions before the first scattering.
const FIRST_SCATTERING: u32 = 4;
/// Dimensions a scattering.
const SCATTERING: u32 = 8;

impl Dimension {
    fn number(self) -> u32 {
        match self {
            Self::Film => 0,
            Self::Lens => 1,
            Self::Start(what) => what as u32,
            Self::Time => 2,
            Self::Eye(n, what) | Self::Light(n, what) => FIRST_SCATTERING + SCATTERING * n + what as u32,
        }
    }
}

impl Sampler {
    /// The numbers of sample `index` of a pixel in a replicate.
    pub fn new(seed: u64, replicate: u32, pixel: [u32; 2], index: u32) -> Self {
        let place = u64::from(pixel[0]) << 32 | u64::from(pixel[1]);
        Self { key: mix(mix(mix(seed) ^ place) ^ u64::from(replicate)), index }
    }

    /// The numbers of a light subpath of a replicate. The indices of all subpaths of a frame form one sequence, so that what
    /// leaves the lights is spread over the whole frame, not pixel by pixel.
    pub fn light(seed: u64, replicate: u32, index: u64) -> Self {
        let far = mix(mix(seed ^ LIGHT) ^ (index >> 32));
        Self { key: mix(far ^ u64::from(replicate)), index: index as u32 }
    }

    /// Two numbers in [0, 1), well spread over the indices of a pixel.
    #[inline]
    pub fn pair(&self, dimension: Dimension) -> Vec2 {
        let ([first], [second]) = self.pairs([dimension.number()]);
        Vec2::new(first, second)
    }

    /// The pairs of a scattering, each as [`Self::pair`] gives it; `at` makes its dimensions. All four are computed in the lanes
    /// of one register, for little more than what one costs.
    #[inline]
    pub fn scattering(&self, at: impl Fn(Use) -> Dimension) -> ScatteringNumbers {
        self.four(DRAWN_TOGETHER.map(|what| at(what).number()))
    }

    /// Not inlined: what is not written to memory is not put into lanes.
    #[inline(never)]
    fn four(&self, dimensions: [u32; 4]) -> ScatteringNumbers {
        let (first, second) = self.pairs(dimensions);
        ScatteringNumbers { first, second }
    }

    #[inline(always)]
    fn pairs<const N: usize>(&self, dimensions: [u32; N]) -> ([f32; N], [f32; N]) {
        let keys = dimensions.map(|dimension| mix(self.key ^ u64::from(dimension)));
        let scrambles = keys.map(mix);
        let reversed = self.index.reverse_bits();
        let (mut first, mut second) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let index = scramble(reversed, keys[i] as u32).reverse_bits();
            first[i] = unit(scramble(index, scrambles[i] as u32).reverse_bits());
            second[i] = unit(scramble(pascal(index), (scrambles[i] >> 32) as u32).reverse_bits());
        }
        (first, second)
    }

    /// A key for decisions that are independent of one another and of every other number:
    /// see [`decide`].
    #[inline]
    pub fn key(&self, dimension: Dimension) -> u64 {
        mix(mix(self.key ^ u64::from(dimension.number())) ^ u64::from(self.index))
    }
}

/// A number in [0, 1) as a function of a key and what is decided about.
#[inline]
pub fn decide(key: u64, what: u64) -> f32 {
    unit((mix(key ^ mix(what)) >> 32) as u32)
}

/// The upper 24 bits as a number in [0, 1).
#[inline]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A bijection of 64 bits in which every bit of the result depends on every bit given (the
/// finaliser of `SplitMix64`; Steele et al. 2014).
#[inline]
fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Flips each bit by a hash of the bits below it (Laine and Karras 2011, with the constants of
/// Vegdahl 2021): on bit-reversed fractions this is nested uniform scrambling, and so it is on bit-reversed indices: aligned
/// dyadic ranges go to aligned dyadic ranges.
#[inline]
fn scramble(x: u32, seed: u32) -> u32 {
    let x = x ^ x.wrapping_mul(0x3d20_adea);
    let x = x.wrapping_add(seed);
    let x = x.wrapping_mul((seed >> 16) | 1);
    let x = x ^ x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The second Sobol' dimension before bit reversal: multiplication with Pascal's triangle modulo
/// 2, whose entry (i, j) is one where the bits of i are among those of j.
#[inline]
fn pascal(mut x: u32) -> u32 {
    x ^= (x >> 1) & 0x5555_5555;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 4) & 0x0f0f_0f0f;
    x ^= (x >> 8) & 0x00ff_00ff;
    x ^ ((x >> 16) & 0x0000_ffff)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_dimension_is_that_of_its_direction_numbers() {
        for index in (0..5000).chain([u32::MAX, 0x8000_0001]) {
            let mut expected = 0;
            let mut direction = 1_u32 << 31;
            for bit in 0..32 {
                if index >> bit & 1 == 1 {
                    expected ^= direction;
                }
                direction ^= direction >> 1;
            }
            assert_eq!(pascal(index).reverse_bits(), expected);
        }
    }

    #[test]
    fn every_aligned_dyadic_block_is_a_net_in_every_dimension() {
        for (start, log) in [(0_u32, 6), (64, 6), (256, 8), (1 << 20, 4), (96, 5)] {
            let count = 1_u32 << log;
            for dimension in
                [Dimension::Film, Dimension::Eye(3, Use::Direction), Dimension::Eye(70, Use::Light)]
            {
                let points: Vec<Vec2> = (start..start + count)
                    .map(|index| Sampler::new(7, 2, [10, 20], index).pair(dimension))
                    .collect();
                for columns_log in 0..=log {
                    let (columns, rows) = (1 << columns_log, 1 << (log - columns_log));
                    let mut cells = vec![0; count as usize];
                    for p in &points {
                        let (x, y) = ((p.x * columns as f32) as usize, (p.y * rows as f32) as usize);
                        cells[y * columns as usize + x] += 1;
                    }
                    assert!(cells.iter().all(|n| *n == 1), "{dimension:?} {start} {columns}x{rows}");
                }
            }
        }
    }

    #[test]
    fn numbers_drawn_together_are_those_drawn_alone() {
        for (n, index) in [(0, 0), (3, 77), (2047, u32::MAX)] {
            let sampler = Sampler::new(5, 1, [3, 4], index);
            for at in [Dimension::Eye, Dimension::Light] {
                let alone = |what| sampler.pair(at(n, what));
                let together = sampler.scattering(|what| at(n, what));
                let [choice, direction, light, light_point] = DRAWN_TOGETHER.map(alone);
                assert_eq!((together.choice(), together.direction()), (choice, direction));
                assert_eq!((together.light(), together.light_point()), (light, light_point));
            }
        }
    }

    #[test]
    fn replicates_pixels_and_dimensions_are_uncorrelated() {
        let n = 1 << 14;
        let correlation = |a: &dyn Fn(u32) -> f32, b: &dyn Fn(u32) -> f32| {
            (0..n).map(|i| f64::from(a(i) - 0.5) * f64::from(b(i) - 0.5)).sum::<f64>() / f64::from(n) * 12.0
        };
        let at =
            |replicate, pixel, dimension| move |i| Sampler::new(1, replicate, pixel, i).pair(dimension).x;
        let first = at(0, [0, 0], Dimension::Film);
        let bound = 4.0 / f64::from(n).sqrt();
        for other in
            [at(1, [0, 0], Dimension::Film), at(0, [1, 0], Dimension::Film), at(0, [0, 0], Dimension::Lens)]
        {
            assert!(correlation(&first, &other).abs() < bound);
        }
        let y = |i| Sampler::new(1, 0, [0, 0], i).pair(Dimension::Film).y;
        assert!(correlation(&first, &y).abs() < bound);
    }

    #[test]
    fn decisions_are_uniform() {
        let mut bins = [0_u32; 64];
        let n = 1 << 16;
        for i in 0..n {
            let key = Sampler::new(3, 0, [5, 5], i).key(Dimension::Eye(0, Use::Alpha));
            bins[(decide(key, 77) * 64.0) as usize] += 1;
        }
        let expected = f64::from(n) / 64.0;
        let chi2: f64 = bins.iter().map(|b| (f64::from(*b) - expected).powi(2) / expected).sum();
        // 63 degrees of freedom: the 99.99 % quantile is 112.
        assert!(chi2 < 112.0, "{chi2}");
    }
}
