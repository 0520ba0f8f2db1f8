//! Names that lights go by: those of their nodes and of their materials.

use crate::scene::data::SceneData;
use crate::scene::material::{Material, MaterialId};
use crate::scene::mesh::Mesh;
use std::collections::BTreeSet;

/// What light from infinitely far goes by.
pub const ENVIRONMENT: &str = "environment";

/// Places of emitting parts whose names are looked at, at most: a mesh of many parts may stand at many places.
const PLACES_MAX: usize = 1 << 22;

/// Names by which `L'name'` takes the light of a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightNames {
    /// All of them.
    pub all: BTreeSet<String>,
    /// One of each light that has any: its node's, or else its material's.
    pub groups: BTreeSet<String>,
}

impl LightNames {
    /// Those of a scene's own lights.
    pub fn of(scene: &SceneData) -> Self {
        let mut names = Self::default();
        let emits: Vec<bool> = scene.materials.iter().map(Material::emits).collect();
        let emitting: Vec<_> = scene.meshes.iter().map(|mesh| emitting(scene, &emits, mesh)).collect();
        let all = scene.instances.iter().flat_map(|instance| {
            emitting[instance.mesh.index()].iter().map(move |parts| (&*instance.name, parts))
        });
        for (instance, (part, material)) in all.take(PLACES_MAX) {
            let node = if instance.is_empty() { part } else { instance };
            names.add([node, material]);
        }
        scene.punctual.iter().for_each(|light| names.add([&light.name]));
        if scene.environment.is_some() || !scene.is_lit() {
            names.add([ENVIRONMENT]);
        }
        names
    }

    /// Adds a light by its names, of which the first that is not empty is its own.
    fn add<const N: usize>(&mut self, names: [&str; N]) {
        let mut named = names.into_iter().filter(|name| !name.is_empty()).peekable();
        if let Some(own) = named.peek() {
            self.groups.insert((*own).to_owned());
        }
        self.all.extend(named.map(str::to_owned));
    }
}

/// Names of the parts and the materials of a mesh that emit, each pair once.
fn emitting<'a>(scene: &'a SceneData, emits: &[bool], mesh: &'a Mesh) -> BTreeSet<(&'a str, &'a str)> {
    let of = |(triangle, material): (usize, &MaterialId)| {
        let name = &*scene.materials[material.index()].name;
        emits[material.index()].then(|| (mesh.part_name(triangle as u32), name))
    };
    mesh.materials.iter().enumerate().filter_map(of).collect()
}
