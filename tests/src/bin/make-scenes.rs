//! Writes scenes that are made by code: `cargo run -p ovtigre-tests --bin make-scenes`, the one that comes with the program;
//! `… --bin make-scenes FOLDER`, those of the tables in the documents.

use ovtigre_tests::{
    room::room,
    scenes::{cornell, two_rooms},
    showcase::{caustic, lamp_behind_glass},
};
use std::{
    fs,
    path::{Path, PathBuf},
};

fn main() -> anyhow::Result<()> {
    let asked = std::env::args_os().nth(1).map(PathBuf::from);
    let folder = asked.clone().unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes"));
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("room.glb"), room())?;
    if asked.is_some() {
        fs::write(folder.join("cornell.glb"), cornell())?;
        fs::write(folder.join("two-rooms.glb"), two_rooms())?;
        fs::write(folder.join("caustic.glb"), caustic())?;
        fs::write(folder.join("lamp-behind-glass.glb"), lamp_behind_glass())?;
    }
    Ok(())
}
