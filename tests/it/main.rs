//! All integration tests, one binary.

mod bad_input;
mod closed_forms;
mod faults;
mod same_bits;
mod tidy;
