//! Small scenes built by code, read back.

mod appearance;
mod builder;
mod bundles;
mod compressed;
mod geometry;
mod image_based;
mod motion;
mod placement;
mod refusals;
