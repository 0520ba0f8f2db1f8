//! glTF bytes to a scene, with limits and named errors.

pub mod bundle;
pub mod error;
pub mod limits;
pub mod load;
pub mod report;

mod accessor;
mod assemble;
mod buffers;
mod cameras;
mod document;
mod extensions;
mod geometry;
mod glb;
mod lights;
mod materials;
mod nodes;
mod pictures;
mod schema;
mod schema_tables;
mod shapes;
mod skin;
mod survey;
mod tangents;
mod textures;
mod topology;
mod uri;

#[cfg(test)]
mod tests;
