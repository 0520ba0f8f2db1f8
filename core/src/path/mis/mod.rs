//! Weights of the techniques that can make one path: a partition of unity.

pub mod exhaustive;
pub mod heuristic;
pub mod partial;
pub mod recursive;

#[cfg(test)]
mod in_scenes;
#[cfg(test)]
mod tests;
