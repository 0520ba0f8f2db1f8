//! What lies on a surface, and what shines through it: a clear coat over cloth over what is below
//! (`KHR_materials_clearcoat`, `KHR_materials_sheen`), of which a share scatters to the other side
//! (`KHR_materials_diffuse_transmission`).
//!
//! The coat is an interface of index 1.5 with a normal of its own, there for the share c of the surface. What it does not
//! reflect passes: light that goes through it in two directions counts (1 − c F(o)) (1 − c F(i)), F its albedo. The
//! fibres below let min(1 − s(o), 1 − s(i)) pass, s the largest channel of their albedo. Both are reciprocal, and with any
//! base whose albedo is at most one the whole has one of at most one.
//!
//! What scatters through is coupled to the interface of both sides as the base of plastic is to that of one.
//!
//! They lie on both sides of a thin surface and on the outside of a solid.

use crate::bsdf::conductor::{Conductor, upward};
use crate::bsdf::event::{Letter, Letters, Transport};
use crate::bsdf::fresnel::Schlick;
use crate::bsdf::gloss::Gloss;
use crate::bsdf::interface::Base;
use crate::bsdf::kept::Kept;
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::bsdf::plastic::Plastic;
use crate::bsdf::sheen::Sheen;
use crate::bsdf::surface::{Layers, Walls};
use crate::math::colour::{Rgb, luminance};
use crate::math::frame::Frame;
use glam::{Vec2, Vec3};

/// Reflectance at normal incidence of an index of 1.5.
const COAT: Schlick = Schlick { f0: Rgb::splat(0.04), f90: 1.0 };

/// Layers and the lobes below that are kept.
#[derive(Clone, Debug)]
pub struct Layered {
    coat: Option<Coat>,
    sheen: Option<Sheen>,
    /// Weight of the base that scatters to the other side, and the base, seen as if it did to this.
    through: Option<(f32, Base)>,
    below: Kept,
    letters: Letters,
    walls: Walls,
}

#[derive(Clone, Copy, Debug)]
struct Coat {
    share: f32,
    interface: Conductor,
    /// Around its normal.
    frame: Frame,
}

/// What the layers do to light along a direction.
#[derive(Clone, Copy)]
struct Seen {
    /// The direction in the coat's frame, on its front.
    on_coat: Vec3,
    /// Share that the coat lets pass.
    coat: f32,
    /// Share that the fibres let pass.
    sheen: f32,
    /// Whether the layers lie on this side.
    covered: bool,
}

/// What a direction can be drawn from.
#[derive(Clone, Copy)]
enum Lobe {
    Coat,
    CoatTwin,
    Sheen,
    Through,
    Below,
}

const LOBES: [Lobe; 5] = [Lobe::Coat, Lobe::CoatTwin, Lobe::Sheen, Lobe::Through, Lobe::Below];

impl Layered {
    /// Of lobes with one of `letters`, above and below. Numbers are within their ranges.
    pub(super) fn new(
        layers: &Layers,
        through: Option<(f32, Base)>,
        below: Kept,
        letters: Letters,
        walls: Walls,
    ) -> Self {
        let coat = (layers.coat > 0.0).then(|| Coat {
            share: layers.coat,
            interface: Conductor::of(Gloss::new(layers.coat_roughness * layers.coat_roughness, COAT)),
            frame: Frame::around(layers.coat_normal),
        });
        let sheen = Sheen::new(layers.sheen, layers.sheen_roughness);
        Self { coat, sheen, through, below, letters, walls }
    }

    pub(super) fn letters(&self) -> Letters {
        let of = |lobe| self.letter(lobe).map_or(Letters::NONE, Letters::of);
        [Lobe::Coat, Lobe::CoatTwin, Lobe::Sheen, Lobe::Through]
            .into_iter()
            .fold(self.below.letters(), |letters, lobe| letters.union(of(lobe)))
    }

    /// The letter of a layer's lobe that is there and kept.
    fn letter(&self, lobe: Lobe) -> Option<Letter> {
        let letter = match lobe {
            Lobe::Coat => self.coat.as_ref()?.interface.letter(),
            Lobe::CoatTwin => match self.coat.as_ref()?.interface.letter() {
                Letter::Glossy => Letter::Mirrored,
                _ => return None,
            },
            Lobe::Sheen => self.sheen.as_ref().map(|_| Letter::Glossy)?,
            Lobe::Through => self.through.as_ref().map(|_| Letter::Diffuse)?,
            Lobe::Below => return None,
        };
        self.letters.has(letter).then_some(letter)
    }

    fn see(&self, w: Vec3) -> Seen {
        if w.z < 0.0 && self.walls == Walls::Solid {
            return Seen { on_coat: w, coat: 1.0, sheen: 1.0, covered: false };
        }
        let above = upward(w);
        let (on_coat, coat) = match &self.coat {
            Some(coat) => {
                let local = coat.frame.to_local(above);
                (local, 1.0 - coat.share * coat.interface.albedo(local).x)
            }
            None => (above, 1.0),
        };
        Seen {
            on_coat,
            coat,
            sheen: self.sheen.as_ref().map_or(1.0, |sheen| sheen.passes(above)),
            covered: true,
        }
    }

    /// Probabilities of the lobes; `None` where all is absorbed.
    fn chances(&self, wo: Vec3, o: &Seen) -> Option<[f32; LOBES.len()]> {
        let of = |lobe| match lobe {
            Lobe::Below => o.coat * o.sheen * self.below.luminance(wo),
            _ if !o.covered || self.letter(lobe).is_none() => 0.0,
            Lobe::Through => {
                let albedo = |(weight, part): &(f32, Base)| weight * luminance(part.albedo(wo));
                o.coat * o.sheen * self.through.as_ref().map_or(0.0, albedo)
            }
            Lobe::Coat | Lobe::CoatTwin if o.on_coat.z <= 0.0 => 0.0,
            Lobe::Coat => 1.0 - o.coat,
            Lobe::CoatTwin => {
                self.coat.as_ref().map_or(0.0, |coat| coat.share * coat.interface.mirror(o.on_coat).x)
            }
            Lobe::Sheen => {
                o.coat * self.sheen.as_ref().map_or(0.0, |sheen| luminance(sheen.albedo(upward(wo))))
            }
        };
        let weights = LOBES.map(of);
        let total: f32 = weights.iter().sum();
        (total > 0.0).then(|| weights.map(|weight| weight / total))
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Evaluated {
        let (o, i) = (self.see(wo), self.see(wi));
        let Some([coat, _, sheen, through, below]) = self.chances(wo, &o) else {
            return Evaluated::default();
        };
        let mut all = self.below.evaluate(wo, wi, transport);
        let passes = o.coat * i.coat;
        all.value = all.value * (passes * o.sheen.min(i.sheen));
        all.pdf *= below;
        if wo.z * wi.z <= 0.0 {
            if through > 0.0
                && let Some((weight, part)) = &self.through
            {
                let one = part.evaluate(wo, -wi);
                all.value.diffuse += one.value.diffuse * (weight * passes * o.sheen.min(i.sheen));
                all.pdf += one.pdf * through;
            }
            return all;
        }
        if !o.covered {
            return all;
        }
        if sheen > 0.0
            && let Some(lobe) = &self.sheen
        {
            let one = lobe.evaluate(upward(wo), upward(wi));
            all.value.glossy += one.value.glossy * passes;
            all.pdf += one.pdf * sheen;
        }
        if coat > 0.0
            && i.on_coat.z > 0.0
            && let Some(layer) = &self.coat
        {
            let one = layer.interface.evaluate(o.on_coat, i.on_coat);
            all.value.glossy += one.value.glossy * (layer.share * turn(wo, wi, &o, &i, transport));
            all.pdf += one.pdf * coat;
        }
        all
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        let o = self.see(wo);
        let chances = self.chances(wo, &o)?;
        // The last lobe with a chance takes what rounding leaves.
        let last = chances.iter().rposition(|chance| *chance > 0.0)?;
        let (mut rest, mut chosen) = (u_lobe, 0);
        while chosen < last && rest >= chances[chosen] {
            rest -= chances[chosen];
            chosen += 1;
        }
        let chance = chances[chosen];
        let rest = (rest / chance).min(1.0_f32.next_down());
        let mut drawn = match LOBES[chosen] {
            Lobe::Below => self.below.draw(wo, rest, u, transport)?,
            Lobe::Sheen => Drawn::smooth(Sheen::draw(u)),
            Lobe::Through => Plastic::draw_base(-wo, u)?,
            Lobe::Coat => self.coat.as_ref()?.interface.draw(o.on_coat, rest, u)?,
            Lobe::CoatTwin => self.coat.as_ref()?.interface.draw_mirror(o.on_coat, Letter::Mirrored),
        };
        if let (Lobe::Coat | Lobe::CoatTwin, Some(coat)) = (LOBES[chosen], &self.coat) {
            drawn.wi = coat.frame.to_world(drawn.wi);
            if drawn.wi.z <= 0.0 {
                return None;
            }
        }
        if matches!(LOBES[chosen], Lobe::Coat | Lobe::CoatTwin | Lobe::Sheen) {
            drawn.wi.z = drawn.wi.z.copysign(wo.z);
        }
        if let Some(delta) = &mut drawn.delta {
            let i = self.see(drawn.wi);
            delta.value *= match (LOBES[chosen], &self.coat) {
                (Lobe::Coat | Lobe::CoatTwin, Some(coat)) => {
                    coat.share * turn(wo, drawn.wi, &o, &i, transport)
                }
                _ => o.coat * i.coat * o.sheen.min(i.sheen),
            };
            delta.probability *= chance;
        }
        Some(drawn)
    }
}

/// The coat's cosine is that of its own normal. Light that is carried from its source is corrected for the shading
/// normal's afterwards, so that this has to be undone.
fn turn(wo: Vec3, wi: Vec3, o: &Seen, i: &Seen, transport: Transport) -> f32 {
    match transport {
        Transport::Radiance => 1.0,
        Transport::Importance => ((o.on_coat.z * wi.z) / (wo.z * i.on_coat.z)).abs(),
    }
}
