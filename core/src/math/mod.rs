//! Frames, warps and their densities, weighted choice, robust arithmetic. Knows no light.

pub mod choice;
pub mod colour;
pub mod cosine;
pub mod frame;
pub mod quantile;
pub mod robust;
pub mod spherical_triangle;
pub mod warp;
