//! Requests for jobs.

#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../src/job_promises.rs"]
mod job_promises;

// Decoders whose panics are caught may panic: only a panic that nobody catches ends the run.
fuzz_target!(init: drop(std::panic::take_hook()), |bytes: &[u8]| job_promises::document(bytes));
