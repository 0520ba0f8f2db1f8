//! Solved light, written back as a glTF scene that any viewer shows.

pub mod appearance;
pub mod atlas;
pub mod baked;
pub mod cameras;
pub mod light_map;
pub mod materials;
pub mod scale;
pub mod vertex_colours;
pub mod writer;
