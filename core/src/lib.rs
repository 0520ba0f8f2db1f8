//! Renders some samples of a scene into sums, the same bits every time.
//!
//! The rooms, bottom to top; a room uses only those above it in this list.

pub mod math;
pub mod sampler;
pub mod bsdf;
pub mod trace;
pub mod film;
pub mod scene;
pub mod gltf;
pub mod settings;
pub mod path;
pub mod method;
pub mod render;
