//! Where the light of one sample goes: planes of its own pixel, splats to others.

use crate::math::colour::Rgb;
use crate::path::expression::language::{EyeState, LightState};
use crate::path::rules::Rules;
use crate::path::throughput::Throughput;
use glam::Vec3;

/// Light for a pixel that a light subpath found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Column and row in the frame.
    pub pixel: [u32; 2],
    /// Which picture.
    pub plane: u32,
    /// How much.
    pub value: Rgb,
}

/// What one sample adds up to.
#[derive(Clone, Debug)]
pub struct Tally {
    /// Light of the sample's pixel, by plane.
    pub planes: Vec<Rgb>,
    /// Light of other pixels.
    pub splats: Vec<Splat>,
    /// Rays traced.
    pub rays: u64,
}

/// Who sees a contribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receiver {
    /// The sample's own pixel.
    Own,
    /// Any pixel.
    Pixel([u32; 2]),
}

/// A technique: vertices from the light, vertices from the eye.
pub type Technique = (usize, usize);

impl Tally {
    /// Nothing, for a number of planes.
    pub fn new(planes: usize) -> Self {
        Self { planes: vec![Vec3::ZERO; planes], splats: Vec::new(), rays: 0 }
    }

    /// Forgets light and splats, not rays.
    pub fn clear(&mut self) {
        self.planes.fill(Vec3::ZERO);
        self.splats.clear();
    }

    /// Adds what an eye and a light subpath carry, joined with `factor`, for every rule that accepts the whole word, and
    /// for the layer of the technique that made it.
    #[inline]
    pub fn deposit(
        &mut self,
        rules: &Rules,
        receiver: Receiver,
        technique: Technique,
        eye: &impl Throughput<EyeState>,
        light: &impl Throughput<LightState>,
        factor: Rgb,
    ) {
        self.deposit_gathered(rules, receiver, technique, eye, light, [factor; 2]);
    }

    /// The same of light that was gathered from photons: `factor` in the picture and its layers, `narrow` in the plane that
    /// shows half the area of gathering.
    #[inline]
    pub fn deposit_gathered(
        &mut self,
        rules: &Rules,
        receiver: Receiver,
        technique: Technique,
        eye: &impl Throughput<EyeState>,
        light: &impl Throughput<LightState>,
        [factor, narrow]: [Rgb; 2],
    ) {
        eye.each(|q, from_eye| {
            light.each(|l, from_light| {
                let value = from_eye * from_light * factor;
                let (Some(q), Some(l)) = (q, l) else {
                    self.add(receiver, 0, value);
                    return;
                };
                let accepted = rules.language.accepts(q, l);
                for rule in accepted.iter() {
                    self.add(receiver, rules.rule_plane(rule), value);
                }
                if !accepted.has(0) {
                    return;
                }
                if let Some(plane) = rules.technique_plane(technique) {
                    self.add(receiver, plane, value);
                }
                if let Some(plane) = rules.narrow_plane() {
                    self.add(receiver, plane, from_eye * from_light * narrow);
                }
                if let Some(plane) = rules.scattered_plane()
                    && technique.0 + technique.1 > 2
                {
                    self.add(receiver, plane, value);
                }
            });
        });
    }

    /// Adds to one plane.
    #[inline]
    pub fn add(&mut self, receiver: Receiver, plane: usize, value: Rgb) {
        match receiver {
            Receiver::Own => self.planes[plane] += value,
            Receiver::Pixel(pixel) => self.splats.push(Splat { pixel, plane: plane as u32, value }),
        }
    }
}
