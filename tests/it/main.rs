//! All integration tests, one binary.

mod closed_forms;
mod same_bits;
mod tidy;
