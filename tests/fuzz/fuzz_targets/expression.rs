//! Path expressions, as they come with jobs.

#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../src/promises.rs"]
#[expect(dead_code, reason = "each fuzzer keeps one of the promises")]
mod promises;

// Decoders whose panics are caught may panic: only a panic that nobody catches ends the run.
fuzz_target!(init: drop(std::panic::take_hook()), |bytes: &[u8]| promises::expression(bytes));
