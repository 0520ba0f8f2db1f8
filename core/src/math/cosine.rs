//! Cosines and distances for weights.
//!
//! Weights are ratios of products over whole paths, and what one technique says of an edge another has to say, too, or they
//! do not add up to one: so both compute it in f64 from the same f32 positions and directions.

use glam::Vec3;

/// |cos θ| between unit vectors.
#[inline]
pub fn cosine(a: Vec3, b: Vec3) -> f64 {
    a.as_dvec3().dot(b.as_dvec3()).abs()
}

/// Squared distance between two points.
#[inline]
pub fn squared_distance(a: Vec3, b: Vec3) -> f64 {
    (a.as_dvec3() - b.as_dvec3()).length_squared()
}
