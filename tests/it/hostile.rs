//! Bytes from outside that are wrong in any way are refused: no reader panics, hangs, or takes all memory.

use ovtigre_tests::hostile::{Target, bear, peak_bytes, torment};
use std::{fs, path::Path};

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
fn no_reader_stumbles_over_what_one_stumbled_over_before() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("hostile");
    for file in fs::read_dir(folder).into_iter().flatten() {
        let path = file.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let target = Target::ALL.into_iter().find(|target| name.starts_with(&format!("{target:?}-")));
        let borne = bear(target.expect("named after its reader"), &fs::read(&path).unwrap());
        assert!(borne.is_ok(), "{name}: {}", borne.unwrap_err().how);
    }
}
