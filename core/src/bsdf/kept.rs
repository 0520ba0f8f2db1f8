//! A surface of which only some lobes are kept, or whose gloss has an ideal twin.
//!
//! The kept lobes scatter as they do on the whole surface: what is left out is not made up for. Each is chosen in
//! proportion to its weight times its albedo towards `wo` among those kept. A twin is what gloss would be at roughness 0:
//! it is another lobe beside the real one, for renders that take gloss for a mirror's after the first scattering, and
//! has a letter of its own.

use crate::bsdf::event::{Letter, Letters, Transport};
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::bsdf::mixture::Mixture;
use crate::bsdf::plastic::Plastic;
use crate::math::colour::{Rgb, luminance};
use glam::{Vec2, Vec3};

/// Some lobes of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Kept {
    whole: Mixture,
    letters: Letters,
}

/// What a surface can consist of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lobe {
    Metal,
    MetalTwin,
    Interface,
    InterfaceTwin,
    Base,
    Glass,
    GlassTwin,
}

const LOBES: [Lobe; 7] = [
    Lobe::Metal,
    Lobe::MetalTwin,
    Lobe::Interface,
    Lobe::InterfaceTwin,
    Lobe::Base,
    Lobe::Glass,
    Lobe::GlassTwin,
];

impl Kept {
    /// The lobes of `whole` with one of `letters`; gloss has its twin if `S_T` is one of them.
    pub(super) fn new(whole: &Mixture, letters: Letters) -> Self {
        Self { whole: *whole, letters }
    }

    pub(super) fn letters(&self) -> Letters {
        let letters = LOBES.into_iter().filter_map(|lobe| self.letter(lobe));
        letters.fold(Letters::NONE, |set, letter| set.union(Letters::of(letter)))
    }

    /// The letter of a lobe that is there and kept.
    fn letter(&self, lobe: Lobe) -> Option<Letter> {
        let Mixture { conductor, plastic, glass } = &self.whole;
        let own = match lobe {
            Lobe::Metal | Lobe::MetalTwin => conductor.as_ref().map(|(_, part)| part.letter()),
            Lobe::Interface | Lobe::InterfaceTwin => {
                plastic.as_ref().map(|(_, part)| part.interface_letter())
            }
            Lobe::Base => plastic.as_ref().map(|_| Letter::Diffuse),
            Lobe::Glass | Lobe::GlassTwin => glass.as_ref().map(|(_, part)| part.letter()),
        }?;
        let letter = match lobe {
            Lobe::MetalTwin | Lobe::InterfaceTwin | Lobe::GlassTwin => {
                (own == Letter::Glossy).then_some(Letter::Mirrored)?
            }
            _ => own,
        };
        self.letters.has(letter).then_some(letter)
    }

    /// A lobe's weight and its albedo towards `wo`.
    fn weight_and_albedo(&self, lobe: Lobe, wo: Vec3) -> Option<(f32, Rgb)> {
        let Mixture { conductor, plastic, glass } = &self.whole;
        Some(match lobe {
            Lobe::Metal => conductor.as_ref().map(|(weight, part)| (*weight, part.albedo(wo)))?,
            Lobe::MetalTwin => conductor.as_ref().map(|(weight, part)| (*weight, part.mirror(wo)))?,
            Lobe::Interface => {
                plastic.as_ref().map(|(weight, part)| (*weight, part.interface().albedo(wo)))?
            }
            Lobe::InterfaceTwin => {
                plastic.as_ref().map(|(weight, part)| (*weight, part.interface().mirror(wo)))?
            }
            Lobe::Base => plastic.as_ref().map(|(weight, part)| (*weight, part.base_albedo(wo)))?,
            Lobe::Glass | Lobe::GlassTwin => {
                glass.as_ref().map(|(weight, part)| (*weight, part.albedo(wo)))?
            }
        })
    }

    /// Weights and probabilities of the lobes; zero where they are not kept, `None` where all is absorbed.
    fn chances(&self, wo: Vec3) -> Option<[(f32, f32); LOBES.len()]> {
        let of = |lobe| {
            let (weight, albedo) = self.letter(lobe).and_then(|_| self.weight_and_albedo(lobe, wo))?;
            Some((weight, weight * luminance(albedo)))
        };
        let lobes = LOBES.map(|lobe| of(lobe).unwrap_or((0.0, 0.0)));
        let total: f32 = lobes.iter().map(|(_, albedo)| albedo).sum();
        (total > 0.0).then(|| lobes.map(|(weight, albedo)| (weight, albedo / total)))
    }

    /// The luminance of what it reflects and transmits of light towards `wo`.
    pub(super) fn luminance(&self, wo: Vec3) -> f32 {
        let of = |lobe| {
            let (weight, albedo) = self.letter(lobe).and_then(|_| self.weight_and_albedo(lobe, wo))?;
            Some(weight * luminance(albedo))
        };
        LOBES.into_iter().filter_map(of).sum()
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Evaluated {
        let Some(chances) = self.chances(wo) else { return Evaluated::default() };
        let mut all = Evaluated::default();
        for (lobe, (weight, chance)) in LOBES.into_iter().zip(chances) {
            if weight > 0.0
                && let Some(one) = self.evaluate_lobe(lobe, wo, wi, transport)
            {
                all.value.diffuse += weight * one.value.diffuse;
                all.value.glossy += weight * one.value.glossy;
                all.pdf += chance * one.pdf;
            }
        }
        all
    }

    /// `None` for a twin.
    fn evaluate_lobe(&self, lobe: Lobe, wo: Vec3, wi: Vec3, transport: Transport) -> Option<Evaluated> {
        let Mixture { conductor, plastic, glass } = &self.whole;
        match lobe {
            Lobe::Metal => conductor.as_ref().map(|(_, part)| part.evaluate(wo, wi)),
            Lobe::Interface => plastic.as_ref().map(|(_, part)| part.interface().evaluate(wo, wi)),
            Lobe::Base => plastic.as_ref().map(|(_, part)| part.evaluate_base(wo, wi)),
            Lobe::Glass => glass.as_ref().map(|(_, part)| part.evaluate(wo, wi, transport)),
            Lobe::MetalTwin | Lobe::InterfaceTwin | Lobe::GlassTwin => None,
        }
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        let chances = self.chances(wo)?;
        // The last lobe with a chance takes what rounding leaves.
        let last = chances.iter().rposition(|(_, chance)| *chance > 0.0)?;
        let mut rest = u_lobe;
        let mut chosen = last;
        for (i, (_, chance)) in chances[..last].iter().enumerate() {
            if rest < *chance {
                chosen = i;
                break;
            }
            rest -= chance;
        }
        let (weight, chance) = chances[chosen];
        let rest = (rest / chance).min(1.0_f32.next_down());
        let drawn = self.draw_lobe(LOBES[chosen], wo, rest, u, transport)?;
        let delta = drawn.delta.map(|mut delta| {
            delta.value *= weight;
            delta.probability *= chance;
            delta
        });
        Some(Drawn { delta, ..drawn })
    }

    fn draw_lobe(&self, lobe: Lobe, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        let Mixture { conductor, plastic, glass } = &self.whole;
        match lobe {
            Lobe::Metal => conductor.as_ref()?.1.draw(wo, u_lobe, u),
            Lobe::MetalTwin => Some(conductor.as_ref()?.1.draw_mirror(wo, Letter::Mirrored)),
            Lobe::Interface => plastic.as_ref()?.1.interface().draw(wo, u_lobe, u),
            Lobe::InterfaceTwin => Some(plastic.as_ref()?.1.interface().draw_mirror(wo, Letter::Mirrored)),
            Lobe::Base => plastic.as_ref().and_then(|_| Plastic::draw_base(wo, u)),
            Lobe::Glass => glass.as_ref()?.1.draw(wo, u_lobe, u, transport),
            Lobe::GlassTwin => glass.as_ref()?.1.draw_twin(wo, u_lobe, transport),
        }
    }
}
