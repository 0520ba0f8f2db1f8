//! The program `ovtigre`.
fn main() {}
