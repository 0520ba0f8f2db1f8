//! Lights chosen for next events: those that are somewhere by a tree, those infinitely far beside it by their power.

use crate::math::choice::AliasTable;
use crate::math::colour::luminance;
use crate::scene::bounds::Bounds;
use crate::scene::data::SceneData;
use crate::scene::light::Light;
use crate::scene::light_bounds::LightBounds;
use crate::scene::light_tree::LightTree;
use crate::scene::lit::Lit;
use crate::scene::material::{Material, Sides};
use crate::scene::punctual::PunctualKind;
use crate::trace::moment::Moment;
use core::f64::consts::PI;
use glam::{Vec2, Vec3};

/// As many lights that are somewhere make a tree worth its steps (`cargo run -p ovtigre-tests --bin lights`; the table is in
/// docs/PERFORMANCE.md), where
const TREE_FROM: usize = 4;
/// their places have a sphere of at least this share of the scene's radius: of one lamp made of many triangles, each counts
/// about the same everywhere, and the tree only took time.
const SPREAD: f64 = 0.25;
/// Least share of next events to what is somewhere, and to what is infinitely far, where there is both: powers do not say
/// which of them reaches a point.
const LEAST: f64 = 1.0 / 16.0;
/// Least intensity in a tree, over that of its strongest light: still a number after all divisions.
const FAINTEST: f64 = 1e-100;

/// Lights that are somewhere in a tree, and those infinitely far beside it.
#[derive(Clone, Debug)]
pub struct Nearby {
    tree: LightTree,
    /// Numbers of the tree's lights, and of those beside it.
    numbers: [Vec<u32>; 2],
    /// Of each light by its number, its place in one of the lists.
    places: Vec<Place>,
    /// Share of choices that are the tree's.
    share: f64,
    far: AliasTable,
}

#[derive(Clone, Copy, Debug)]
enum Place {
    InTree(u32),
    Beside(u32),
}

impl Nearby {
    /// Over lights of the given powers; `None` where none of them is somewhere.
    pub fn new(data: &SceneData, lights: &[Light], powers: &[f64]) -> Option<Self> {
        let (mut bounds, mut beside) = (Vec::new(), Vec::new());
        let mut numbers = [Vec::new(), Vec::new()];
        let mut sums = [0.0; 2];
        let mut places = Vec::with_capacity(lights.len());
        for (i, (light, power)) in lights.iter().zip(powers).enumerate() {
            let bounded = bounds_of(data, light, *power);
            let list = usize::from(bounded.is_none());
            let place = numbers[list].len() as u32;
            numbers[list].push(i as u32);
            sums[list] += power;
            places.push(if bounded.is_some() { Place::InTree(place) } else { Place::Beside(place) });
            match bounded {
                Some(bounded) => bounds.push(bounded),
                None => beside.push(*power),
            }
        }
        if bounds.is_empty() {
            return None;
        }
        let strongest = bounds.iter().map(LightBounds::intensity).fold(0.0, f64::max);
        let bounds: Vec<_> = bounds.iter().map(|b| b.relative_to(strongest, FAINTEST)).collect();
        let share =
            if beside.is_empty() { 1.0 } else { (sums[0] / (sums[0] + sums[1])).clamp(LEAST, 1.0 - LEAST) };
        let far = AliasTable::new(&beside).unwrap_or_default();
        Some(Self { tree: LightTree::new(&bounds), numbers, places, share, far })
    }

    /// A light's number for a point and the probability of that, by two numbers in [0, 1), the second of which continues the
    /// first.
    pub fn choose(&self, lit: &Lit, choice: Vec2) -> (u32, f32) {
        const BITS: f64 = 1.0 / 16_777_216.0;
        let u = f64::from(choice.x) + (f64::from(choice.y) + 0.5 * BITS) * BITS;
        if u < self.share {
            let (place, probability) = self.tree.sample(lit, u / self.share);
            return (self.numbers[0][place as usize], (self.share * probability) as f32);
        }
        let rest = ((u - self.share) / (1.0 - self.share)) as f32;
        let (place, probability, _) = self.far.sample(rest.min(1.0_f32.next_down()));
        (self.numbers[1][place], ((1.0 - self.share) * f64::from(probability)) as f32)
    }

    /// Probability with which a light of a number is chosen for a point.
    pub fn probability(&self, lit: &Lit, number: u32) -> f32 {
        match self.places[number as usize] {
            Place::InTree(place) => (self.share * self.tree.probability(lit, place)) as f32,
            Place::Beside(place) => {
                ((1.0 - self.share) * f64::from(self.far.probability(place as usize))) as f32
            }
        }
    }
}

/// Whether a scene has enough lights that are somewhere, and apart from each other, for a tree.
pub fn is_worth_a_tree(data: &SceneData) -> bool {
    let (mut count, mut bounds) = (0, Bounds::EMPTY);
    for punctual in &data.punctual {
        if let PunctualKind::Point { position, .. } | PunctualKind::Spot { position, .. } = punctual.kind {
            count += 1;
            bounds.include(position.as_dvec3());
        }
    }
    let emits: Vec<bool> = data.materials.iter().map(Material::emits).collect();
    for (i, instance) in data.instances.iter().enumerate() {
        for (t, material) in data.meshes[instance.mesh.index()].materials.iter().enumerate() {
            if emits[material.index()] {
                count += 1;
                let corners = data.corners(i as u32, t as u32, data.knots.moment(0.0));
                for corner in corners {
                    bounds.include(corner.as_dvec3());
                }
            }
        }
    }
    count >= TREE_FROM && bounds.radius() >= SPREAD * data.bounds.radius()
}

/// Where a light is, which way it shines and how strongly; `None` where it is infinitely far.
fn bounds_of(data: &SceneData, light: &Light, power: f64) -> Option<LightBounds> {
    match *light {
        Light::Triangle { instance, triangle } => {
            let sides = data.material(instance, triangle).sides;
            let count = if sides == Sides::Both { 2.0 } else { 1.0 };
            let intensity = power / (PI * count);
            if !data.moves(instance) {
                let corners = data.corners(instance, triangle, Moment::STILL);
                return Some(LightBounds::of_triangle(corners, sides, intensity));
            }
            // It may turn on its way.
            let at = |(moment, _)| data.corners(instance, triangle, moment);
            let places: Vec<Vec3> = data.knots.weights().flat_map(at).collect();
            Some(LightBounds::of_point(&places, intensity))
        }
        Light::Punctual(index) => {
            let punctual = &data.punctual[index as usize];
            let places: Vec<Vec3> = punctual.knots.iter().map(|knot| knot.0).collect();
            let moves = !places.is_empty();
            match punctual.kind {
                PunctualKind::Spot { position, direction, intensity, outer_cos, .. } if !moves => {
                    let intensity = f64::from(luminance(intensity));
                    Some(LightBounds::of_spot(position, direction, outer_cos, intensity))
                }
                PunctualKind::Point { position, intensity }
                | PunctualKind::Spot { position, intensity, .. } => {
                    let intensity = f64::from(luminance(intensity));
                    let places = if moves { places } else { vec![position] };
                    Some(LightBounds::of_point(&places, intensity))
                }
                PunctualKind::Directional { .. } => None,
            }
        }
        Light::Environment => None,
    }
}
