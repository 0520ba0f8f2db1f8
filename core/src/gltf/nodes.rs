//! The tree of nodes, and where each stands at a time.

use crate::gltf::animation::{Animation, Channels};
use crate::gltf::curve::{Curve, Side};
use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// A node that is part of the scene.
pub(crate) struct Node<'a> {
    pub(crate) at: At<'a>,
    pub(crate) name: String,
    /// Its index in the document.
    pub(crate) index: usize,
    /// Node to file, composed in double precision, when the shutter opens.
    pub(crate) world: DAffine3,
    /// Its parent's place among the tree's nodes.
    parent: Option<usize>,
    /// Its own transform when the shutter opens.
    local: DAffine3,
    /// Its place among the nodes that move while the shutter is open.
    mover: Option<usize>,
    pub(crate) carries: Carries,
}

/// What of its object in the document a node stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Carries {
    All,
    /// Its mesh stands at places of its own.
    AllButMesh,
    /// A place of a parent's mesh.
    Mesh,
}

/// The nodes of the scene, parents before children.
pub(crate) struct Tree<'a> {
    pub(crate) nodes: Vec<Node<'a>>,
    /// Place of each of the document's nodes among `nodes`; `None` for those outside the scene.
    pub(crate) places: Vec<Option<usize>>,
    /// Places of the nodes that move while the shutter is open.
    pub(crate) movers: Vec<usize>,
}

/// When, and on which side of a jump at that very time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instant {
    /// Seconds.
    pub(crate) time: f64,
    pub(crate) side: Side,
}

/// Where the nodes that move are at an instant.
pub(crate) struct Pose {
    pub(crate) instant: Instant,
    /// Node to file, in the order of [`Tree::movers`].
    moved: Vec<DAffine3>,
}

/// The tree of the default scene: the one that "scene" names, else the first, else all nodes. The shutter is open from
/// the first to the second of `times`.
pub(crate) fn read<'a>(
    document: &'a Document,
    animation: &Animation<'_>,
    times: [f64; 2],
    problems: &mut Problems,
) -> Result<Tree<'a>, LoadError> {
    let items = document.list("nodes")?;
    let children = read_children(document, &items)?;
    let roots = find_roots(document, &children, problems)?;
    let mut tree = Tree { nodes: Vec::new(), places: vec![None; items.len()], movers: Vec::new() };
    let opening = Instant { time: times[0], side: Side::After };
    // A stack of our own: a chain of nodes may be as deep as the document is long.
    let mut stack: Vec<(usize, Option<usize>)> = roots.into_iter().rev().map(|n| (n, None)).collect();
    while let Some((index, parent)) = stack.pop() {
        let at = &items[index];
        if tree.places[index].is_some() {
            return Err(at.error("is listed twice among the nodes of the scene"));
        }
        let channels = animation.channels(index);
        let local = local(at, channels, opening)?;
        let above = parent.map(|place| &tree.nodes[place]);
        let world = above.map_or(DAffine3::IDENTITY, |node| node.world) * local;
        if !world.is_finite() {
            return Err(at.error("its transform, together with its parents', exceeds the range of numbers"));
        }
        let moves = above.is_some_and(|node| node.mover.is_some())
            || channels.is_some_and(|c| c.transforms().any(|curve| !curve.is_still(times[0], times[1])));
        let mover = moves.then_some(tree.movers.len());
        let place = tree.nodes.len();
        tree.movers.extend(moves.then_some(place));
        tree.places[index] = Some(place);
        tree.nodes.push(Node {
            at: at.clone(),
            name: at.name(),
            index,
            world,
            parent,
            local,
            mover,
            carries: Carries::All,
        });
        stack.extend(children.lists[index].iter().rev().map(|&child| (child, Some(place))));
    }
    Ok(tree)
}

impl Tree<'_> {
    /// Where the nodes that move are at an instant.
    pub(crate) fn pose(&self, animation: &Animation<'_>, instant: Instant) -> Result<Pose, LoadError> {
        let mut pose = Pose { instant, moved: Vec::with_capacity(self.movers.len()) };
        for &place in &self.movers {
            let node = &self.nodes[place];
            let channels = animation.channels(node.index).filter(|_| node.carries != Carries::Mesh);
            let local = match channels {
                Some(channels) => local(&node.at, Some(channels), instant)?,
                None => node.local,
            };
            let above = node.parent.map_or(DAffine3::IDENTITY, |parent| self.world(parent, &pose));
            let world = above * local;
            if !world.is_finite() {
                let time = instant.time;
                let detail = format!("its transform exceeds the range of numbers at {time} s");
                return Err(node.at.error(detail));
            }
            pose.moved.push(world);
        }
        Ok(pose)
    }

    /// Puts the mesh of a node at a place relative to it.
    pub(crate) fn place_mesh(&mut self, parent: usize, local: DAffine3) -> Result<(), LoadError> {
        let (node, place) = (&self.nodes[parent], self.nodes.len());
        let world = node.world * local;
        if !world.is_finite() {
            return Err(node.at.error("the transform of one of its instances exceeds the range of numbers"));
        }
        let mover = node.mover.map(|_| self.movers.len());
        self.movers.extend(mover.map(|_| place));
        self.nodes.push(Node {
            at: node.at.clone(),
            name: node.name.clone(),
            index: node.index,
            world,
            parent: Some(parent),
            local,
            mover,
            carries: Carries::Mesh,
        });
        Ok(())
    }

    /// Takes the mesh of a node away from where the node is.
    pub(crate) fn take_mesh(&mut self, place: usize) {
        self.nodes[place].carries = Carries::AllButMesh;
    }

    /// Node to file in a pose.
    pub(crate) fn world(&self, place: usize, pose: &Pose) -> DAffine3 {
        let node = &self.nodes[place];
        node.mover.map_or(node.world, |mover| pose.moved[mover])
    }

    /// Whether a node moves while the shutter is open.
    pub(crate) fn moves(&self, place: usize) -> bool {
        self.nodes[place].mover.is_some()
    }
}

struct Children {
    lists: Vec<Vec<usize>>,
    parents: Vec<Option<usize>>,
}

/// Children of each node; no node has two parents or is its own ancestor.
fn read_children(document: &Document, items: &[At<'_>]) -> Result<Children, LoadError> {
    let mut lists = Vec::with_capacity(items.len());
    let mut parents: Vec<Option<usize>> = vec![None; items.len()];
    for (parent, item) in items.iter().enumerate() {
        let mut list = Vec::new();
        for child in item.elements("children")? {
            let index = child.as_index("nodes", items.len())?;
            if let Some(other) = parents[index].replace(parent) {
                return Err(child.error(format!(
                    "/nodes/{index} is a child of /nodes/{other} too; a node has one parent at most, instances repeat the mesh"
                )));
            }
            list.push(index);
        }
        lists.push(list);
    }
    // With one parent at most, what cannot be reached from a node without one is a ring.
    let mut reached = 0;
    let mut stack: Vec<usize> = (0..items.len()).filter(|&n| parents[n].is_none()).collect();
    let mut seen = vec![false; items.len()];
    while let Some(node) = stack.pop() {
        seen[node] = true;
        reached += 1;
        stack.extend(&lists[node]);
    }
    if reached < items.len() {
        let node = seen.iter().position(|seen| !seen).unwrap_or(0);
        return Err(document.error(format!("/nodes/{node}/children"), "the node is its own ancestor"));
    }
    Ok(Children { lists, parents })
}

fn find_roots(
    document: &Document,
    children: &Children,
    problems: &mut Problems,
) -> Result<Vec<usize>, LoadError> {
    let scenes = document.list("scenes")?;
    let chosen = document.root().index("scene", "scenes", scenes.len())?;
    let all = || (0..children.parents.len()).filter(|&n| children.parents[n].is_none()).collect();
    let Some(scene) = scenes.get(chosen.unwrap_or(0)) else {
        if !children.parents.is_empty() {
            problems.add("/scenes", "there is no scene: all nodes are taken");
        }
        return Ok(all());
    };
    if chosen.is_none() && scenes.len() > 1 {
        problems.add("/scene", "no scene is named as the default: the first of several is taken");
    }
    let mut roots = Vec::new();
    for at in scene.elements("nodes")? {
        let index = at.as_index("nodes", children.parents.len())?;
        if let Some(parent) = children.parents[index] {
            problems.add(
                &at.pointer,
                format!("/nodes/{index} is a child of /nodes/{parent}: its parents are left out"),
            );
        }
        roots.push(index);
    }
    Ok(roots)
}

/// A node's own transform at an instant.
fn local(at: &At<'_>, channels: Option<&Channels<'_>>, instant: Instant) -> Result<DAffine3, LoadError> {
    let driven = channels.filter(|channels| channels.transforms().next().is_some());
    let (scale, rotation, translation);
    if let Some(m) = at.numbers::<16>("matrix")? {
        let matrix3 = DMat3::from_cols_slice(&[m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]]);
        let whole = DAffine3 { matrix3, translation: DVec3::new(m[12], m[13], m[14]) };
        if driven.is_none() {
            return Ok(whole);
        }
        (scale, rotation, translation) = whole.to_scale_rotation_translation();
    } else {
        translation = at.numbers::<3>("translation")?.map_or(DVec3::ZERO, DVec3::from);
        scale = at.numbers::<3>("scale")?.map_or(DVec3::ONE, DVec3::from);
        let given = at.numbers::<4>("rotation")?.map_or(DQuat::IDENTITY, DQuat::from_array);
        let length = given.length();
        if !(length > 0.0 && length.is_finite()) {
            return Err(at.error("\"rotation\" has no length; the identity is [0, 0, 0, 1]"));
        }
        // Divide only where it matters: exporters write unit quaternions rounded to single precision.
        rotation = if (length - 1.0).abs() < 1e-12 { given } else { given / length };
    }
    let Instant { time, side } = instant;
    let drive = |curve: Option<&Curve<'_>>, rest: DVec3| curve.map_or(rest, |curve| curve.vector(time, side));
    let (translation, scale, rotation) = match driven {
        Some(channels) => (
            drive(channels.translation.as_ref(), translation),
            drive(channels.scale.as_ref(), scale),
            channels.rotation.as_ref().map_or(rotation, |curve| curve.rotation(time, side)),
        ),
        None => (translation, scale, rotation),
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::limits::Limits;

    fn document(json: &str) -> Document {
        Document::parse("t.gltf", json.as_bytes(), &Limits::default()).unwrap()
    }

    #[test]
    fn transforms_are_composed_in_double_precision() {
        // In single precision 1e6 + 1e-3 − 1e6 is 0; the matrix and the TRS are the same rotation.
        let document = document(
            r#"{"nodes": [
            {"children": [1], "translation": [1000000, 0, 0], "scale": [2, 2, 2]},
            {"children": [2], "translation": [0.001, 0, 0], "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752]},
            {"translation": [0, 500000, 0], "matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 3,4,5,1]}
        ]}"#,
        );
        let tree = read(&document, &Animation::default(), [0.0; 2], &mut Problems::default()).unwrap();
        let p = tree.nodes[tree.places[2].unwrap()].world.transform_point3(DVec3::new(1.0, 0.0, 0.0));
        // Node 2: (1,0,0) → (3,5,5); node 1 turns: (−5,3,5)+(0.001,0,0); node 0 doubles and moves.
        assert!((p - DVec3::new(1e6 - 9.998, 6.0, 10.0)).length() < 1e-9, "{p}");
    }

    #[test]
    fn rings_and_second_parents_are_named() {
        for (json, says) in [
            (r#"{"nodes": [{"children": [1]}, {"children": [0]}]}"#, "own ancestor"),
            (r#"{"nodes": [{"children": [0]}]}"#, "own ancestor"),
            (r#"{"nodes": [{"children": [2]}, {"children": [2]}, {}]}"#, "/nodes/1/children/0"),
            (r#"{"nodes": [{"children": [1, 1]}, {}]}"#, "one parent"),
            (r#"{"nodes": [{"children": [7]}]}"#, "there are only 1"),
            (r#"{"nodes": [{}], "scenes": [{"nodes": [0, 0]}]}"#, "listed twice"),
            (r#"{"nodes": [{"rotation": [0, 0, 0, 0]}]}"#, "no length"),
            (r#"{"nodes": [{"matrix": [1, 2]}]}"#, "16 numbers"),
            (r#"{"nodes": [{}], "scene": 3}"#, "/scene"),
        ] {
            let document = document(json);
            let error = read(&document, &Animation::default(), [0.0; 2], &mut Problems::default())
                .err()
                .unwrap()
                .to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn a_deep_chain_is_walked() {
        let n = 200_000;
        let nodes: Vec<String> = (0..n)
            .map(|i| if i + 1 < n { format!(r#"{{"children":[{}]}}"#, i + 1) } else { "{}".to_owned() })
            .collect();
        let document = document(&format!(r#"{{"nodes": [{}]}}"#, nodes.join(",")));
        assert_eq!(
            read(&document, &Animation::default(), [0.0; 2], &mut Problems::default()).unwrap().nodes.len(),
            n
        );
    }
}
