//! The program `ovtigre-worker`.
fn main() {}
