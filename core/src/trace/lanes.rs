//! Eight floats at once: AVX2 with FMA where the build has them, plain loops elsewhere, the same bits on both.

/// Lanes of a node and of a block of triangles.
pub(super) const WIDTH: usize = 8;

/// Eight floats, aligned for one load.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Row(pub(super) [f32; WIDTH]);

/// Arithmetic on eight floats. Every operation rounds once, to nearest, so that all implementations agree bit for bit.
/// Masks have bit `i` for lane `i`.
pub(super) trait Lanes: Copy {
    fn splat(value: f32) -> Self;
    fn load(row: &Row) -> Self;
    fn store(self) -> Row;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self · factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self · factor − term`, rounded once.
    fn mul_sub(self, factor: Self, term: Self) -> Self;
    /// `term − self · factor`, rounded once.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    fn abs(self) -> Self;
    /// The lesser; `other` where one is NaN or both are zero.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where one is NaN or both are zero.
    fn max(self, other: Self) -> Self;
    /// Where `self ≤ other`; never where one is NaN.
    fn at_most(self, other: Self) -> u32;
    /// Where `self < other`; never where one is NaN.
    fn below(self, other: Self) -> u32;
}

/// What this build's rays use.
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
pub(super) type Native = avx2::Avx2;
/// What this build's rays use.
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")))]
pub(super) type Native = portable::Portable;

#[cfg(any(test, not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))))]
pub(super) mod portable {
    use super::{Lanes, Row, WIDTH};
    use std::array::from_fn;

    /// Plain loops over eight floats.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Portable([f32; WIDTH]);

    impl Portable {
        fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
            Self(from_fn(|i| f(self.0[i], other.0[i])))
        }

        fn mask(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
            (0..WIDTH).fold(0, |mask, i| mask | (u32::from(f(self.0[i], other.0[i])) << i))
        }
    }

    impl Lanes for Portable {
        fn splat(value: f32) -> Self {
            Self([value; WIDTH])
        }
        fn load(row: &Row) -> Self {
            Self(row.0)
        }
        fn store(self) -> Row {
            Row(self.0)
        }
        fn add(self, other: Self) -> Self {
            self.zip(other, |a, b| a + b)
        }
        fn sub(self, other: Self) -> Self {
            self.zip(other, |a, b| a - b)
        }
        fn mul(self, other: Self) -> Self {
            self.zip(other, |a, b| a * b)
        }
        fn div(self, other: Self) -> Self {
            self.zip(other, |a, b| a / b)
        }
        fn mul_add(self, factor: Self, term: Self) -> Self {
            Self(from_fn(|i| self.0[i].mul_add(factor.0[i], term.0[i])))
        }
        fn mul_sub(self, factor: Self, term: Self) -> Self {
            Self(from_fn(|i| self.0[i].mul_add(factor.0[i], -term.0[i])))
        }
        fn neg_mul_add(self, factor: Self, term: Self) -> Self {
            Self(from_fn(|i| (-self.0[i]).mul_add(factor.0[i], term.0[i])))
        }
        fn abs(self) -> Self {
            Self(self.0.map(f32::abs))
        }
        fn min(self, other: Self) -> Self {
            self.zip(other, |a, b| if a < b { a } else { b })
        }
        fn max(self, other: Self) -> Self {
            self.zip(other, |a, b| if a > b { a } else { b })
        }
        fn at_most(self, other: Self) -> u32 {
            self.mask(other, |a, b| a <= b)
        }
        fn below(self, other: Self) -> u32 {
            self.mask(other, |a, b| a < b)
        }
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
#[expect(
    unsafe_code,
    reason = "Rust has no safe way yet to call these instructions where the whole build has them"
)]
mod avx2 {
    use super::{Lanes, Row, WIDTH};
    use std::arch::x86_64::{
        __m256, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_add_ps, _mm256_andnot_ps, _mm256_cmp_ps, _mm256_div_ps,
        _mm256_fmadd_ps, _mm256_fmsub_ps, _mm256_fnmadd_ps, _mm256_load_ps, _mm256_max_ps, _mm256_min_ps,
        _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_store_ps, _mm256_sub_ps,
    };

    /// One AVX register.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(__m256);

    /// An instruction on registers alone.
    macro_rules! instruction {
        ($call:expr) => {
            // SAFETY: this module exists only where the whole build may use AVX2 and FMA; no memory is touched.
            unsafe { $call }
        };
    }

    impl Lanes for Avx2 {
        #[inline(always)]
        fn load(row: &Row) -> Self {
            // SAFETY: the build has AVX; the reference is valid for 32 bytes, and `Row` is aligned to 32.
            Self(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> Row {
            let mut row = Row([0.0; WIDTH]);
            // SAFETY: the build has AVX; `row` is 32 bytes of our own, aligned to 32.
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) };
            row
        }
        #[inline(always)]
        fn splat(value: f32) -> Self {
            Self(instruction!(_mm256_set1_ps(value)))
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self(instruction!(_mm256_add_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            Self(instruction!(_mm256_sub_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            Self(instruction!(_mm256_mul_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            Self(instruction!(_mm256_div_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(instruction!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(instruction!(_mm256_min_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(instruction!(_mm256_max_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            Self(instruction!(_mm256_fmadd_ps(self.0, factor.0, term.0)))
        }
        #[inline(always)]
        fn mul_sub(self, factor: Self, term: Self) -> Self {
            Self(instruction!(_mm256_fmsub_ps(self.0, factor.0, term.0)))
        }
        #[inline(always)]
        fn neg_mul_add(self, factor: Self, term: Self) -> Self {
            Self(instruction!(_mm256_fnmadd_ps(self.0, factor.0, term.0)))
        }
        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            instruction!(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0))) as u32
        }
        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            instruction!(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0))) as u32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::portable::Portable;
    use super::*;

    const AWKWARD: [f32; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1.0 / 3.0,
        1e-40,
        -1e-40,
        3e38,
        -3e38,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];

    fn bits<L: Lanes>(lanes: L) -> [u32; WIDTH] {
        // Which NaN an operation gives is not fixed; that it gives one is.
        lanes.store().0.map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() })
    }

    fn results<L: Lanes>(a: f32, b: f32, c: f32) -> Vec<[u32; WIDTH]> {
        let (a, b, c) = (L::splat(a), L::load(&Row([b; WIDTH])), L::splat(c));
        let mut all = vec![bits(a.add(b)), bits(a.sub(b)), bits(a.mul(b)), bits(a.div(b)), bits(a.min(b))];
        all.extend([
            bits(a.max(b)),
            bits(a.mul_add(b, c)),
            bits(a.mul_sub(b, c)),
            bits(a.neg_mul_add(b, c)),
            bits(a.abs()),
        ]);
        all.push([a.at_most(b); WIDTH]);
        all.push([a.below(b); WIDTH]);
        all
    }

    #[test]
    fn native_lanes_are_the_portable_ones() {
        for a in AWKWARD {
            for b in AWKWARD {
                for c in AWKWARD {
                    assert_eq!(results::<Native>(a, b, c), results::<Portable>(a, b, c), "{a} {b} {c}");
                }
            }
        }
    }
}
