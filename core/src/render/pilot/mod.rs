//! A pilot: small pictures by several methods, which tell the one that needs the least work for an error.
//!
//! Work is counted and not timed, so that the choice is the same on every machine.

mod choice;
pub mod plan;
pub mod report;
mod squares;
pub mod trying;
mod work;
