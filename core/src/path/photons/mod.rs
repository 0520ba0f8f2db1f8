//! Photons: where light subpaths met surfaces, and how eye subpaths gather them.
//!
//! Progressive (Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach"): each sample index is a
//! pass with photons and a radius of its own, so that passes can be rendered anywhere in any order. A pass is biased by its
//! radius; their mean is not in the limit, because radii shrink.

pub mod gather;
pub mod map;
pub mod photon;
pub mod radius;
