//! glTF as it is uploaded: a binary file as it is, and any other text as the document of one whose lengths are right.

#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../src/promises.rs"]
#[expect(dead_code, reason = "each fuzzer keeps one of the promises")]
mod promises;

/// Bytes of the buffer that comes with a document.
const BUFFER: [u8; 4096] = [0x3f; 4096];

/// A binary glTF: header, document filled up with spaces, buffer.
fn binary(document: &[u8]) -> Vec<u8> {
    let filled = document.len().next_multiple_of(4);
    let mut file = b"glTF\x02\0\0\0".to_vec();
    let chunk = |kind: &[u8; 4], bytes: &[u8], length: usize, fill: u8| {
        let mut chunk = (length as u32).to_le_bytes().to_vec();
        chunk.extend_from_slice(kind);
        chunk.extend_from_slice(bytes);
        chunk.resize(8 + length, fill);
        chunk
    };
    let chunks = [chunk(b"JSON", document, filled, b' '), chunk(b"BIN\0", &BUFFER, BUFFER.len(), 0)].concat();
    file.extend_from_slice(&(12 + chunks.len() as u32).to_le_bytes());
    file.extend(chunks);
    file
}

// Decoders whose panics are caught may panic: only a panic that nobody catches ends the run.
fuzz_target!(init: drop(std::panic::take_hook()), |bytes: &[u8]| {
    promises::scene(bytes);
    if bytes.trim_ascii_start().starts_with(b"{") {
        promises::scene(&binary(bytes));
    }
});
