//! Which samples, their sums, partial EXR, merging, error, developing. Knows no scene.

pub mod allocate;
pub mod allocation;
pub mod append;
pub mod batch;
pub mod certificate;
pub mod compare;
pub mod develop;
pub mod error;
pub mod estimate;
pub mod exr;
pub mod grid;
pub mod invalid;
pub mod missed;
pub mod reference;
pub mod schedule;
pub mod shares;
pub mod size;
pub mod sketch;
pub mod squares;
pub mod sum;
