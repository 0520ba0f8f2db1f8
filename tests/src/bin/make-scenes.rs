//! Writes the scenes that come with the program: `cargo run -p ovtigre-tests --bin make-scenes`.

use std::{fs, path::Path};

fn main() -> anyhow::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("room.glb"), ovtigre_tests::room::room())?;
    Ok(())
}
