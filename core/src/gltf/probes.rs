//! Points whose ways tell how straight a motion is.

use crate::gltf::animation::Animation;
use crate::gltf::geometry::Geometry;
use crate::gltf::nodes::{Pose, Tree};
use crate::gltf::shapes::{Morphs, Shape, Skins};
use crate::gltf::skin::Influences;
use crate::scene::bounds::Bounds;
use glam::{DAffine3, DVec3};

/// Things of one kind that are looked at: a choice of those that there are.
const LOOKED_AT: usize = 4096;

/// Vertices of one geometry with a skin that are looked at.
const VERTICES: usize = 64;

/// Points that go along with what moves.
pub(crate) struct Probes<'a> {
    /// Meshes that move as they are: place of the node, and the box in its space.
    rigid: Vec<(usize, Bounds)>,
    /// Geometries bent by a skin that moves, by the skin's index.
    skinned: Vec<(usize, &'a Geometry)>,
    /// Nodes whose mesh morphs, by their index in the document, and how large that is.
    morphing: Vec<(usize, f64)>,
    /// Places of cameras and lights that move.
    looking: Vec<usize>,
    skins: &'a Skins,
    /// Radius of what the scene holds when the shutter opens and when it closes, in metres.
    pub(crate) radius: f64,
}

impl<'a> Probes<'a> {
    /// For a tree and the shapes in it; `ends` are the poses when the shutter opens and closes.
    pub(crate) fn new(
        tree: &Tree<'_>,
        animation: &Animation<'_>,
        shapes: &'a [Shape],
        skins: &'a Skins,
        ends: [&Pose; 2],
    ) -> Self {
        let (mut rigid, mut skinned, mut morphing) = (Vec::new(), Vec::new(), Vec::new());
        let mut all = Bounds::EMPTY;
        for shape in shapes {
            let bounds = shape.bounds();
            for &place in &shape.places {
                let at = |pose: &Pose| match shape.skin {
                    Some(skin) => skinned_bounds(shape, &skins[&skin].joints(tree, pose)),
                    None => bounds.transformed(&tree.world(place, pose)),
                };
                let there = at(ends[0]);
                all = all.union(there).union(at(ends[1]));
                if shape.morphs == Morphs::Yes && !there.is_empty() {
                    morphing.push((tree.nodes[place].index, there.radius()));
                }
                if shape.skin.is_none() && tree.moves(place) && !bounds.is_empty() {
                    rigid.push((place, bounds));
                }
            }
            if let Some(skin) = shape.skin.filter(|skin| skins[skin].moves(tree)) {
                skinned.extend(shape.geometries.iter().map(|geometry| (skin, geometry)));
            }
        }
        let driven = |&(index, _): &(usize, f64)| animation.channels(index).is_some();
        morphing.retain(driven);
        let sees = |place: &usize| {
            let node = &tree.nodes[*place].at;
            node.get("camera").is_some() || node.get("extensions").is_some()
        };
        let looking = tree.movers.iter().copied().filter(sees).collect();
        let radius = if all.is_empty() { 1.0 } else { all.radius() };
        Self {
            rigid: some(rigid),
            skinned: some(skinned),
            morphing: some(morphing),
            looking: some(looking),
            skins,
            radius,
        }
    }

    /// Where the points are in a pose, in metres; always as many, in the same order.
    pub(crate) fn points(&self, tree: &Tree<'_>, animation: &Animation<'_>, pose: &Pose) -> Vec<DVec3> {
        let mut points = Vec::new();
        for (place, bounds) in &self.rigid {
            let world = tree.world(*place, pose);
            for corner in 0..8 {
                let pick = |a: usize| if corner >> a & 1 == 0 { bounds.lower[a] } else { bounds.upper[a] };
                points.push(world.transform_point3(DVec3::new(pick(0), pick(1), pick(2))));
            }
        }
        let mut known = None;
        for &(skin, geometry) in &self.skinned {
            let Some(influences) = &geometry.influences else { continue };
            let joints = match known.take() {
                Some((index, joints)) if index == skin => joints,
                _ => self.skins[&skin].joints(tree, pose),
            };
            points.extend(vertices(geometry, influences, &joints));
            known = Some((skin, joints));
        }
        // A target is taken to move its mesh by its radius.
        for &(index, radius) in &self.morphing {
            let weights = animation.weights(index, pose.instant.time, pose.instant.side);
            points.extend(weights.into_iter().flatten().map(|w| DVec3::X * (w * radius)));
        }
        // What is seen or lit lies within the scene's radius.
        for &place in &self.looking {
            let world = tree.world(place, pose);
            let matrix = world.matrix3;
            points.push(world.translation);
            for axis in [matrix.x_axis, matrix.y_axis, matrix.z_axis] {
                points.push(world.translation + axis.normalize_or_zero() * self.radius);
            }
        }
        points
    }
}

/// Where some of a geometry's vertices are taken by its joints.
fn vertices<'a>(
    geometry: &'a Geometry,
    influences: &'a Influences,
    joints: &'a [DAffine3],
) -> impl Iterator<Item = DVec3> + 'a {
    let step = geometry.positions.len().div_ceil(VERTICES).max(1);
    (geometry.positions.iter().enumerate().step_by(step))
        .map(|(v, position)| influences.transform(v, joints).transform_point3(position.as_dvec3()))
}

fn skinned_bounds(shape: &Shape, joints: &[DAffine3]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for geometry in &shape.geometries {
        let hanging = geometry.influences.iter().flat_map(|i| vertices(geometry, i, joints));
        hanging.for_each(|point| bounds.include(point));
    }
    bounds
}

/// At most [`LOOKED_AT`] of a list, spread over it.
fn some<T>(list: Vec<T>) -> Vec<T> {
    let step = list.len().div_ceil(LOOKED_AT).max(1);
    list.into_iter().step_by(step).collect()
}
