//! All lights of a scene, and the choice among them.

use crate::math::choice::AliasTable;
use crate::math::colour::{Rgb, luminance};
use crate::scene::data::SceneData;
use crate::scene::emitter::{Emitter, area};
use crate::scene::environment::Environment;
use crate::scene::interaction::Interaction;
use crate::scene::light::{Light, NextEvent};
use crate::scene::lit::Lit;
use crate::scene::material::{Material, Sides};
use crate::scene::nearby::Nearby;
use crate::scene::punctual::PunctualKind;
use crate::scene::texture::Texture;
use crate::trace::moment::Moment;
use core::f64::consts::PI;
use glam::{Vec2, Vec3};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// No light has this number.
const NONE: u32 = u32::MAX;

/// All lights of a scene. Light starts from them in proportion to their power; next events choose them likewise, or by a tree.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Triangles first.
    all: Vec<Light>,
    /// Of each of them.
    powers: Vec<f64>,
    /// The triangles among them; `None` of those that move.
    emitters: Vec<Option<Emitter>>,
    choice: AliasTable,
    /// For each instance, the light of each triangle; empty where none emits.
    by_triangle: Vec<Vec<u32>>,
    environment: Option<u32>,
    /// Where next events choose by a tree.
    nearby: Option<Nearby>,
}

impl Lights {
    /// The lights of a scene. What has no power is left out; emitters that are alike and at one place, of which a ray
    /// meets one, are one light.
    pub fn new(data: &SceneData, environment: Option<&Environment>) -> Self {
        let mut lights = Vec::new();
        let mut emitters = Vec::new();
        let mut powers = Vec::new();
        let mut same = BTreeMap::new();
        let radiances: Vec<Rgb> = data.materials.iter().map(|m| mean_radiance(m, &data.textures)).collect();
        let mut by_triangle = vec![Vec::new(); data.instances.len()];
        for (i, instance) in data.instances.iter().enumerate() {
            let mesh = &data.meshes[instance.mesh.index()];
            for (t, material) in mesh.materials.iter().enumerate() {
                let radiance = radiances[material.index()];
                let material = &data.materials[material.index()];
                if !material.emits() {
                    continue;
                }
                let power = triangle_power(data, material.sides, radiance, i as u32, t as u32);
                if power > 0.0 && power.is_finite() {
                    let numbers: &mut Vec<u32> = &mut by_triangle[i];
                    numbers.resize(mesh.triangles.len(), NONE);
                    let (number, place) = (lights.len() as u32, (i as u32, t as u32));
                    if let Some(key) = likeness(data, place) {
                        let first = *same.entry(key).or_insert(number);
                        if first != number {
                            numbers[t] = first;
                            continue;
                        }
                    }
                    numbers[t] = number;
                    lights.push(Light::Triangle { instance: place.0, triangle: place.1 });
                    emitters.push((!data.moves(place.0)).then(|| Emitter::new(data, place, Moment::STILL)));
                    powers.push(power);
                }
            }
        }
        let radius = data.bounds.radius().max(f64::MIN_POSITIVE);
        for (i, punctual) in data.punctual.iter().enumerate() {
            let power = punctual_power(&punctual.kind, radius);
            if power > 0.0 && power.is_finite() {
                lights.push(Light::Punctual(i as u32));
                powers.push(power);
            }
        }
        let mut from_environment = None;
        if let Some(environment) = environment {
            let power = environment.mean_luminance() * 4.0 * PI * PI * radius * radius;
            if power > 0.0 && power.is_finite() {
                from_environment = Some(lights.len() as u32);
                lights.push(Light::Environment);
                powers.push(power);
            }
        }
        let choice = AliasTable::new(&powers).unwrap_or_default();
        Self {
            all: lights,
            powers,
            emitters,
            choice,
            by_triangle,
            environment: from_environment,
            nearby: None,
        }
    }

    /// The same lights, chosen by a tree for next events.
    #[must_use]
    pub fn by_tree(mut self, data: &SceneData) -> Self {
        self.nearby = Nearby::new(data, &self.all, &self.powers);
        self
    }

    /// The same lights, chosen in proportion to their power for next events.
    #[must_use]
    pub fn by_power(mut self) -> Self {
        self.nearby = None;
        self
    }

    /// Whether next events choose by a tree.
    #[inline]
    pub fn are_by_tree(&self) -> bool {
        self.nearby.is_some()
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// One of them, in proportion to its power, and the probability of that.
    pub(super) fn choose(&self, choice: f32) -> Option<(u32, f32)> {
        if self.all.is_empty() {
            return None;
        }
        let (index, probability, _) = self.choice.sample(choice);
        Some((index as u32, probability))
    }

    /// The light of a number.
    pub fn light(&self, number: u32) -> &Light {
        &self.all[number as usize]
    }

    /// Number of a triangle's light; `None` where it is none.
    pub fn of_triangle(&self, (instance, triangle): (u32, u32)) -> Option<u32> {
        let light = *self.by_triangle[instance as usize].get(triangle as usize)?;
        (light != NONE).then_some(light)
    }

    /// Number of the environment's light.
    pub fn of_environment(&self) -> Option<u32> {
        self.environment
    }

    /// Probability with which light starts from a light of a number.
    pub fn probability(&self, number: u32) -> f32 {
        self.choice.probability(number as usize)
    }

    /// Probability with which a next event at a point chooses a light of a number.
    #[inline]
    pub fn probability_at(&self, lit: &Lit, number: u32) -> f32 {
        match &self.nearby {
            Some(nearby) => nearby.probability(lit, number),
            None => self.probability(number),
        }
    }

    /// A light's number and a next event from a point to it at a moment; its density includes the choice of the light.
    pub fn sample(
        &self,
        data: &SceneData,
        environment: Option<&Environment>,
        moment: Moment,
        lit: &Lit,
        choice: Vec2,
        place: Vec2,
    ) -> Option<(u32, NextEvent)> {
        let (light, probability) = match &self.nearby {
            Some(nearby) => nearby.choose(lit, choice),
            None => self.choose(choice.x)?,
        };
        let emitter = || self.emitter(data, light, moment);
        let event = self.light(light).sample(data, environment, emitter, (moment, lit.point), place)?;
        Some((light, NextEvent { pdf: event.pdf * probability, ..event }))
    }

    /// The triangle of a light at a moment; the light must be one.
    pub(super) fn emitter(&self, data: &SceneData, light: u32, moment: Moment) -> Cow<'_, Emitter> {
        if let Some(standing) = &self.emitters[light as usize] {
            return Cow::Borrowed(standing);
        }
        match *self.light(light) {
            Light::Triangle { instance, triangle } => {
                Cow::Owned(Emitter::new(data, (instance, triangle), moment))
            }
            Light::Punctual(_) | Light::Environment => unreachable!("triangles come first"),
        }
    }

    /// Density over solid angle at a point of next events towards `at`, seen in `direction` on a triangle; zero
    /// where that triangle is no light.
    pub fn triangle_pdf(
        &self,
        data: &SceneData,
        (instance, triangle): (u32, u32),
        lit: &Lit,
        at: &Interaction<'_>,
        direction: Vec3,
    ) -> f32 {
        match self.of_triangle((instance, triangle)) {
            Some(light) => {
                let pdf = self.emitter(data, light, at.moment).pdf(lit.point, at, direction);
                pdf * self.probability_at(lit, light)
            }
            None => 0.0,
        }
    }

    /// Density over solid angle at a point of next events towards `at`, a point of the light of a number, seen in
    /// `direction`; zero for a light without extent.
    pub fn light_pdf(
        &self,
        data: &SceneData,
        light: u32,
        lit: &Lit,
        at: &Interaction<'_>,
        direction: Vec3,
    ) -> f32 {
        match *self.light(light) {
            Light::Triangle { instance, triangle } => {
                self.triangle_pdf(data, (instance, triangle), lit, at, direction)
            }
            _ => 0.0,
        }
    }

    /// Density over solid angle of next events at a point in `direction` towards the environment.
    pub fn environment_pdf(&self, environment: &Environment, lit: &Lit, direction: Vec3) -> f32 {
        self.environment.map_or(0.0, |light| environment.pdf(direction) * self.probability_at(lit, light))
    }
}

/// What two triangles have in common of which a ray meets but one and finds the same light on it: corners in their order,
/// and emission. `None` where that varies.
fn likeness(data: &SceneData, (instance, triangle): (u32, u32)) -> Option<([[u32; 3]; 4], bool)> {
    let material = data.material(instance, triangle);
    if data.moves(instance) || !material.emits_evenly() {
        return None;
    }
    let bits = |v: Vec3| (v + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut corners = data.corners(instance, triangle, Moment::STILL).map(bits);
    let least = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
    corners.rotate_left(least);
    let [a, b, c] = corners;
    Some(([a, b, c, bits(material.emission.factor)], material.sides == Sides::Both))
}

/// π · area (its mean over the shutter's time) · mean luminance, for each side that emits.
fn triangle_power(data: &SceneData, sides: Sides, radiance: Rgb, instance: u32, triangle: u32) -> f64 {
    let sides = match sides {
        Sides::Front => 1.0,
        Sides::Both => 2.0,
    };
    let area = if data.moves(instance) {
        let at = |(moment, weight)| weight * f64::from(area(data.corners(instance, triangle, moment)));
        data.knots.weights().map(at).sum()
    } else {
        f64::from(area(data.corners(instance, triangle, Moment::STILL)))
    };
    PI * sides * area * f64::from(luminance(radiance))
}

/// The factor times the texture's mean; a texture that is black in the mean still counts a little, since a part
/// of it may not be.
fn mean_radiance(material: &Material, textures: &[Texture]) -> Rgb {
    if !material.emits() {
        return Vec3::ZERO;
    }
    let mean = material
        .emission
        .texture
        .map_or(Vec3::ONE, |slot| textures[slot.texture.index()].average().truncate().max(Vec3::splat(1e-4)));
    material.emission.factor * mean
}

/// Power as far as it can meet the scene, a sphere of `radius`.
fn punctual_power(kind: &PunctualKind, radius: f64) -> f64 {
    match *kind {
        PunctualKind::Point { intensity, .. } => 4.0 * PI * f64::from(luminance(intensity)),
        PunctualKind::Spot { intensity, inner_cos, outer_cos, .. } => {
            let cos = 0.5 * f64::from(inner_cos + outer_cos);
            2.0 * PI * (1.0 - cos).max(1e-6) * f64::from(luminance(intensity))
        }
        PunctualKind::Directional { irradiance, .. } => {
            PI * radius * radius * f64::from(luminance(irradiance))
        }
    }
}
