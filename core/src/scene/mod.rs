//! What a render may ask of a scene: camera, meshes, materials, textures, lights, environment.

pub mod bounds;
pub mod camera;
pub mod data;
pub mod instance;
pub mod interaction;
pub mod material;
pub mod mesh;
pub mod normalisation;
pub mod punctual;
pub mod texture;
