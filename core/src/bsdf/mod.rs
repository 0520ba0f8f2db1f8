//! One file a lobe, and the enum of what a surface does to light.

pub mod event;
pub mod surface;
