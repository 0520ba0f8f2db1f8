//! The farm's rules, with a renderer whose sums are made up.

pub(crate) mod bench;
mod ending;
mod faults;
mod layers;
mod merging;
mod replicas;
mod submitting;
