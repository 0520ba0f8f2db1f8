//! Bytes from outside that are wrong in any way are refused: no reader panics, hangs, or takes all memory.

use ovtigre_tests::hostile::{Target, bear, peak_bytes, torment};

/// Changed inputs of each reader.
const INPUTS: u64 = 400;

#[test]
fn no_reader_stumbles_over_changed_bytes() {
    for target in Target::ALL {
        let borne = torment(target, 1, |count| count < INPUTS);
        assert!(borne.is_ok(), "{target:?}: {}", borne.unwrap_err().how);
    }
    assert!(peak_bytes().unwrap_or(0) < 4 << 30, "{:?} bytes", peak_bytes());
}

#[test]
fn no_reader_stumbles_over_what_is_kept() {
    let mut files = 0;
    for target in Target::ALL {
        for (path, bytes) in target.kept() {
            let borne = bear(target, &bytes);
            assert!(borne.is_ok(), "{}: {}", path.display(), borne.unwrap_err().how);
            files += 1;
        }
    }
    assert!(files > 20, "{files} files");
}

/// The fuzzers are no part of the workspace: what they are called and begin with is looked at here.
#[test]
fn every_fuzzer_has_files_to_begin_with() {
    let manifest = include_str!("../fuzz/Cargo.toml");
    for target in Target::ALL {
        let Some(fuzzer) = target.fuzzer() else { continue };
        assert!(manifest.contains(&format!("fuzz_targets/{fuzzer}.rs")), "{fuzzer}");
        assert!(!target.kept().is_empty(), "{fuzzer}");
    }
}
