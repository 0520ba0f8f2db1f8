//! All integration tests, one binary.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

mod bad_input;
mod closed_forms;
mod faults;
mod methods;
mod motion;
mod radiosity;
mod same_bits;
mod techniques;
mod tidy;
