//! One file a method: short, because `path` does the work.

pub mod bidirectional;
pub mod camera;
pub mod caustics;
pub mod light;
pub mod path;
pub mod photon;
pub mod radiosity;
