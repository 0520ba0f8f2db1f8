//! Numbers that look random.

use glam::{Vec2, Vec3};

/// `SplitMix64` (Steele, Lea and Flood 2014).
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..1.
    pub fn uniform(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Between 10⁻ᵈ and 10ᵈ, its logarithm uniform.
    pub fn wide(&mut self, d: f64) -> f64 {
        10_f64.powf((2.0 * f64::from(self.uniform()) - 1.0) * d)
    }

    /// A whole number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    /// In the unit square.
    pub fn pair(&mut self) -> Vec2 {
        Vec2::new(self.uniform(), self.uniform())
    }

    /// In the cube of side 2 around the origin.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.uniform(), self.uniform(), self.uniform()) * 2.0 - 1.0
    }
}
