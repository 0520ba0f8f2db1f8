//! A surface of which only some lobes are kept, or whose gloss has an ideal twin.
//!
//! The kept lobes scatter as they do on the whole surface: what is left out is not made up for. Each is chosen in
//! proportion to its weight times its albedo towards `wo` among those kept. A twin is what gloss would be at roughness 0:
//! it is another lobe beside the real one, for renders that take gloss for a mirror's after the first scattering, and
//! has a letter of its own.

use crate::bsdf::event::{Letter, Letters, Transport};
use crate::bsdf::finish::Finish;
use crate::bsdf::interface::Interface;
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::bsdf::mixture::Mixture;
use crate::bsdf::plastic::Plastic;
use crate::math::colour::{Rgb, luminance};
use glam::{Vec2, Vec3};

/// Some lobes of a surface.
#[derive(Clone, Debug)]
pub struct Kept {
    whole: Mixture,
    letters: Letters,
    finishes: Option<Box<Finishes>>,
}

/// Stand for the interfaces of a mixture's conductor and plastic, and for the coupling of its base.
#[derive(Clone, Debug)]
pub(super) struct Finishes {
    pub(super) metal: Finish,
    pub(super) plastic: Finish,
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
        Self { whole: *whole, letters, finishes: None }
    }

    /// The same with interfaces that have a finish.
    pub(super) fn finished(whole: &Mixture, letters: Letters, finishes: Option<Finishes>) -> Self {
        Self { finishes: finishes.map(Box::new), ..Self::new(whole, letters) }
    }

    fn metal(&self) -> Option<(f32, Interface<'_>)> {
        let (weight, part) = self.whole.conductor.as_ref()?;
        let interface = match &self.finishes {
            None => Interface::Plain(*part),
            Some(finishes) => Interface::Finished(&finishes.metal),
        };
        Some((*weight, interface))
    }

    fn interface(&self) -> Option<(f32, Interface<'_>)> {
        let (weight, part) = self.whole.plastic.as_ref()?;
        let interface = match &self.finishes {
            None => Interface::Plain(part.interface()),
            Some(finishes) => Interface::Finished(&finishes.plastic),
        };
        Some((*weight, interface))
    }

    pub(super) fn letters(&self) -> Letters {
        let letters = LOBES.into_iter().filter_map(|lobe| self.letter(lobe));
        letters.fold(Letters::NONE, |set, letter| set.union(Letters::of(letter)))
    }

    /// The letter of a lobe that is there and kept.
    fn letter(&self, lobe: Lobe) -> Option<Letter> {
        let own = match lobe {
            Lobe::Metal | Lobe::MetalTwin => self.metal().map(|(_, part)| part.letter()),
            Lobe::Interface | Lobe::InterfaceTwin => self.interface().map(|(_, part)| part.letter()),
            Lobe::Base => self.whole.plastic.as_ref().map(|_| Letter::Diffuse),
            Lobe::Glass | Lobe::GlassTwin => self.whole.glass.as_ref().map(|(_, part)| part.letter()),
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
        Some(match lobe {
            Lobe::Metal => self.metal().map(|(weight, part)| (weight, part.albedo(wo)))?,
            Lobe::MetalTwin => self.metal().map(|(weight, part)| (weight, part.mirror(wo)))?,
            Lobe::Interface => self.interface().map(|(weight, part)| (weight, part.albedo(wo)))?,
            Lobe::InterfaceTwin => self.interface().map(|(weight, part)| (weight, part.mirror(wo)))?,
            Lobe::Base => self.whole.plastic.as_ref().map(|(weight, part)| match &self.finishes {
                None => (*weight, part.base_albedo(wo)),
                Some(finishes) => (*weight, finishes.plastic.base_albedo(wo)),
            })?,
            Lobe::Glass | Lobe::GlassTwin => {
                self.whole.glass.as_ref().map(|(weight, part)| (*weight, part.albedo(wo)))?
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
        match lobe {
            Lobe::Metal => self.metal().map(|(_, part)| part.evaluate(wo, wi)),
            Lobe::Interface => self.interface().map(|(_, part)| part.evaluate(wo, wi)),
            Lobe::Base => self.whole.plastic.as_ref().map(|(_, part)| match &self.finishes {
                None => part.evaluate_base(wo, wi),
                Some(finishes) => finishes.plastic.evaluate_base(wo, wi),
            }),
            Lobe::Glass => self.whole.glass.as_ref().map(|(_, part)| part.evaluate(wo, wi, transport)),
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
        match lobe {
            Lobe::Metal => self.metal()?.1.draw(wo, u_lobe, u),
            Lobe::MetalTwin => Some(self.metal()?.1.draw_mirror(wo, Letter::Mirrored)),
            Lobe::Interface => self.interface()?.1.draw(wo, u_lobe, u),
            Lobe::InterfaceTwin => Some(self.interface()?.1.draw_mirror(wo, Letter::Mirrored)),
            Lobe::Base => self.whole.plastic.as_ref().and_then(|_| Plastic::draw_base(wo, u)),
            Lobe::Glass => self.whole.glass.as_ref()?.1.draw(wo, u_lobe, u, transport),
            Lobe::GlassTwin => self.whole.glass.as_ref()?.1.draw_twin(wo, u_lobe, transport),
        }
    }
}
