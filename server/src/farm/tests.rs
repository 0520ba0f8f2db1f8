//! The farm's rules, with a renderer whose sums are made up.

pub(crate) mod bench;
mod ending;
mod extending;
mod faults;
mod housekeeping;
mod keeping;
mod layers;
mod merging;
mod replicas;
mod sharing;
mod simulation;
mod space;
mod submitting;
mod trust;
