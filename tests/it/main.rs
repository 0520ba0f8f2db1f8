//! All integration tests, one binary.
#[test]
fn builds() {}
