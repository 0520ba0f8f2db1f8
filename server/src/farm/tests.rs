//! The farm's rules, with a renderer whose sums are made up.

mod bench;
mod ending;
mod faults;
mod merging;
mod submitting;
