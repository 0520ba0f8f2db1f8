//! Renders some samples of a scene into sums, the same bits every time.
//!
//! The rooms, bottom to top; a room uses only those above it in this list.

pub mod bake;
pub mod bsdf;
pub mod film;
pub mod gltf;
pub mod math;
pub mod method;
pub mod path;
pub mod radiosity;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod settings;
pub mod trace;
