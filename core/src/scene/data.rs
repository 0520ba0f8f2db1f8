//! Everything a file says about a scene.

use crate::scene::bounds::Bounds;
use crate::scene::camera::Camera;
use crate::scene::environment::Environment;
use crate::scene::instance::{Instance, Placement};
use crate::scene::knots::Knots;
use crate::scene::material::Material;
use crate::scene::mesh::Mesh;
use crate::scene::normalisation::Normalisation;
use crate::scene::punctual::Punctual;
use crate::scene::texture::Texture;
use std::sync::Arc;

/// Everything a file says about a scene, in the scene's space. Indices between the lists are in range.
#[derive(Clone, Debug)]
pub struct SceneData {
    /// Triangles. What stands in one place only is gathered in the first mesh, vertices in the scene's space.
    pub meshes: Vec<Mesh>,
    /// Every mesh at every place; [`World`](crate::scene::instance::Placement::World) for the gathered one.
    pub instances: Vec<Instance>,
    /// Materials that triangles have.
    pub materials: Vec<Material>,
    /// Textures that materials look at.
    pub textures: Vec<Texture>,
    /// Cameras in the file's order of nodes; may be empty.
    pub cameras: Vec<Camera>,
    /// Lights without extent.
    pub punctual: Vec<Punctual>,
    /// Light from infinitely far that the file itself has.
    pub environment: Option<Arc<Environment>>,
    /// A box around all geometry at all knots, in the scene's space.
    pub bounds: Bounds,
    /// From the file's space to the scene's.
    pub normalisation: Normalisation,
    /// The knots of its motion, at each of which what moves tells where it is.
    pub knots: Knots,
}

impl SceneData {
    /// A scene without anything in it.
    pub fn empty() -> Self {
        Self {
            meshes: Vec::new(),
            instances: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            cameras: Vec::new(),
            punctual: Vec::new(),
            environment: None,
            bounds: Bounds::EMPTY,
            normalisation: Normalisation::IDENTITY,
            knots: Knots::STILL,
        }
    }

    /// Whether an instance moves or changes its shape.
    pub fn moves(&self, instance: u32) -> bool {
        let Instance { mesh, placement, .. } = &self.instances[instance as usize];
        !placement.knots().is_empty() || !self.meshes[mesh.index()].forms.is_empty()
    }

    /// Keeps what points on the gathered mesh have in common by triangle: it is hit most.
    pub fn keep_faces(&mut self) {
        for instance in &self.instances {
            let mesh = &mut self.meshes[instance.mesh.index()];
            if matches!(instance.placement, Placement::World) && mesh.forms.is_empty() {
                mesh.keep_faces();
            }
        }
    }

    /// Whether any solid absorbs.
    pub fn absorbs(&self) -> bool {
        self.materials.iter().any(|m| m.volume.is_some_and(|volume| volume.absorption != glam::Vec3::ZERO))
    }

    /// Name of the node that a triangle of an instance comes from; may be empty.
    pub fn node_name(&self, instance: u32, triangle: u32) -> &str {
        let instance = &self.instances[instance as usize];
        if instance.name.is_empty() {
            self.meshes[instance.mesh.index()].part_name(triangle)
        } else {
            &instance.name
        }
    }

    /// Whether it has light of its own. Textures that glow, and no more than white would, are taken for decoration: what has
    /// no other light was made to be seen under a sky.
    pub fn is_lit(&self) -> bool {
        !self.punctual.is_empty()
            || self.environment.is_some()
            || self.materials.iter().any(|m| m.emits() && !m.only_glows())
    }

    /// The material of a triangle of an instance.
    pub fn material(&self, instance: u32, triangle: u32) -> &Material {
        let mesh = &self.meshes[self.instances[instance as usize].mesh.index()];
        &self.materials[mesh.materials[triangle as usize].index()]
    }
}
