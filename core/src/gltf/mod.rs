//! glTF bytes to a scene, with limits and named errors.

pub mod bundle;
pub mod error;
pub mod limits;
pub mod load;
pub mod report;
pub mod strip;

mod accessor;
mod animation;
mod assemble;
mod buffers;
mod cameras;
mod curve;
mod document;
mod draco;
mod extensions;
mod gather;
mod geometry;
mod glb;
mod guard;
mod image_based;
mod instancing;
mod knots;
mod lights;
mod materials;
mod meshopt;
mod nodes;
mod pictures;
mod probes;
mod schema;
mod schema_tables;
mod shapes;
mod skin;
mod stage;
mod survey;
mod tangents;
mod textures;
mod topology;
mod uri;
mod variants;

#[cfg(test)]
mod tests;
