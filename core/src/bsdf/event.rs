//! What a scattering event is called in a path expression, and what it carries.

use crate::math::colour::Rgb;
use glam::Vec3;

/// A scattering letter of a path expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Letter {
    /// `D`: broad, reflected or transmitted.
    Diffuse,
    /// `S`: a microfacet lobe of finite roughness.
    Glossy,
    /// `S_M`: ideally specular; its density is a Dirac delta.
    Specular,
    /// `S_T`: gloss taken as a mirror's. Its density is a Dirac delta, and surfaces have it only where a render
    /// asks for it.
    Mirrored,
}

impl Letter {
    /// Number of letters.
    pub const COUNT: usize = 4;
    /// Every letter, in the order of their numbers.
    pub const ALL: [Self; Self::COUNT] = [Self::Diffuse, Self::Glossy, Self::Specular, Self::Mirrored];

    /// Its number.
    #[inline]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// As it is written.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Diffuse => "D",
            Self::Glossy => "S",
            Self::Specular => "S_M",
            Self::Mirrored => "S_T",
        }
    }

    /// Whether its density is a Dirac delta, so that nothing can be connected to it.
    #[inline]
    pub const fn is_delta(self) -> bool {
        matches!(self, Self::Specular | Self::Mirrored)
    }
}

/// A set of letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Letters(u8);

impl Letters {
    /// No letter.
    pub const NONE: Self = Self(0);
    /// Every letter that surfaces have by themselves: `D`, `S` and `S_M`.
    pub const NATURAL: Self = Self(0b0111);
    /// Every letter.
    pub const ALL: Self = Self(0b1111);

    /// The set of one letter.
    pub const fn of(letter: Letter) -> Self {
        Self(1 << letter as u8)
    }

    /// Letters in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Letters in both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether `letter` is in the set.
    pub const fn has(self, letter: Letter) -> bool {
        self.0 & (1 << letter as u8) != 0
    }

    /// Whether every letter of `other` is in the set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether there is no letter in the set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The letters, in the order of their numbers.
    pub fn iter(self) -> impl Iterator<Item = Letter> {
        Letter::ALL.into_iter().filter(move |letter| self.has(*letter))
    }
}

/// Which way light is carried along a walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// A walk from the eye: `wi` points to where light comes from. Refraction scales radiance by (ηₒ/ηᵢ)².
    Radiance,
    /// A walk from the light: no such factor.
    Importance,
}

/// `f · |cos θᵢ|` of one pair of directions, by letter. A delta lobe has no value here.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scattered {
    /// Letter `D`.
    pub diffuse: Rgb,
    /// Letter `S` with finite density.
    pub glossy: Rgb,
}

impl Scattered {
    /// Over all letters.
    #[inline]
    pub fn total(self) -> Rgb {
        self.diffuse + self.glossy
    }
}

impl core::ops::Mul<f32> for Scattered {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f32) -> Self {
        Self { diffuse: self.diffuse * factor, glossy: self.glossy * factor }
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The direction, unit length, away from the surface, in the shading frame.
    pub wi: Vec3,
    /// Where it came from.
    pub kind: SampleKind,
    /// Refractive index of the side of `wi` over that of the side of `wo`; 1 for reflection and thin walls.
    pub eta: f32,
}

/// Of a smooth lobe or of a delta lobe.
#[derive(Clone, Copy, Debug)]
pub enum SampleKind {
    /// Finite density: `value` and `pdf` are those of **all** smooth lobes together at `wi`
    /// (what `eval` and `pdf` return), `pdf` over solid angle.
    Smooth {
        /// f · |cos θᵢ|, by letter.
        value: Scattered,
        /// Density over solid angle.
        pdf: f32,
    },
    /// A Dirac delta: `weight` is f · |cos θᵢ| over the discrete probability of this choice.
    Specular {
        /// `S_M`, or `S_T` of the ideal twin of a glossy lobe.
        letter: Letter,
        /// Throughput factor.
        weight: Rgb,
        /// Discrete probability of the choice.
        probability: f32,
    },
}
