//! A linear mixture of metal, plastic and glass, as glTF's `metallic` and `transmission` ask for.

use crate::bsdf::conductor::Conductor;
use crate::bsdf::event::{Letters, Transport};
use crate::bsdf::glass::Glass;
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::bsdf::plastic::Plastic;
use crate::math::colour::luminance;
use glam::{Vec2, Vec3};

/// A lobe is chosen in proportion to its weight times its albedo towards `wo`.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    /// Each with its weight; the weights add up to one.
    pub(super) conductor: Option<(f32, Conductor)>,
    pub(super) plastic: Option<(f32, Plastic)>,
    pub(super) glass: Option<(f32, Glass)>,
}

impl Mixture {
    /// Nothing: all light is absorbed.
    pub(super) const NONE: Self = Self { conductor: None, plastic: None, glass: None };

    pub(super) fn letters(&self) -> Letters {
        let conductor = self.conductor.map_or(Letters::NONE, |(_, part)| part.letters());
        let plastic = self.plastic.map_or(Letters::NONE, |(_, part)| part.letters());
        let glass = self.glass.map_or(Letters::NONE, |(_, part)| part.letters());
        conductor.union(plastic).union(glass)
    }

    /// Probabilities of conductor, plastic and glass; `None` where all is absorbed.
    fn chances(&self, wo: Vec3) -> Option<[f32; 3]> {
        let weights = [
            self.conductor.map_or(0.0, |(weight, part)| weight * luminance(part.albedo(wo))),
            self.plastic.map_or(0.0, |(weight, part)| weight * luminance(part.albedo(wo))),
            self.glass.map_or(0.0, |(weight, part)| weight * luminance(part.albedo(wo))),
        ];
        let total: f32 = weights.iter().sum();
        (total > 0.0).then(|| weights.map(|weight| weight / total))
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Evaluated {
        let Some(chances) = self.chances(wo) else { return Evaluated::default() };
        let parts = [
            self.conductor.map(|(weight, part)| (weight, part.evaluate(wo, wi))),
            self.plastic.map(|(weight, part)| (weight, part.evaluate(wo, wi))),
            self.glass.map(|(weight, part)| (weight, part.evaluate(wo, wi, transport))),
        ];
        let mut all = Evaluated::default();
        for (chance, part) in chances.into_iter().zip(parts) {
            let Some((weight, one)) = part else { continue };
            all.value.diffuse += weight * one.value.diffuse;
            all.value.glossy += weight * one.value.glossy;
            all.pdf += chance * one.pdf;
        }
        all
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        let [conductor, plastic, glass] = self.chances(wo)?;
        let top = 1.0_f32.next_down();
        // The last part with a chance takes what rounding leaves.
        let (weight, chance, drawn) = if u_lobe < conductor {
            let (weight, part) = self.conductor?;
            (weight, conductor, part.draw(wo, (u_lobe / conductor).min(top), u)?)
        } else if u_lobe < conductor + plastic || glass == 0.0 {
            let (weight, part) = self.plastic?;
            let rest = ((u_lobe - conductor) / plastic).min(top);
            (weight, plastic, part.draw(wo, rest, u)?)
        } else {
            let (weight, part) = self.glass?;
            let rest = ((u_lobe - conductor - plastic) / glass).min(top);
            (weight, glass, part.draw(wo, rest, u, transport)?)
        };
        let delta = drawn.delta.map(|mut delta| {
            delta.value *= weight;
            delta.probability *= chance;
            delta
        });
        Some(Drawn { delta, ..drawn })
    }
}
