//! Bounding volume hierarchies over triangles and instances: closest hit, any hit, transmittance.

pub mod aggregate;
mod binary;
pub mod bounds;
#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the same hit means the same bits")]
mod brute_force;
pub mod build_error;
mod collapse;
pub mod instance;
mod lanes;
#[cfg(test)]
mod leaving;
pub mod mesh;
pub mod moment;
mod prepared;
pub mod ray;
pub mod surface_point;
mod triangle;
mod walk;
mod wide;
