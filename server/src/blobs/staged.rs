//! Files of a folder that a process which died was writing: they have no name yet, and nobody lists them.

use super::{BlobError, Blobs, Result};
use std::{
    io,
    path::{Path, PathBuf},
    time::SystemTime,
};

impl Blobs {
    /// Removes what was being written, and was last written to before `time`; how many that were. In a bucket the service
    /// keeps it, and removes it by a rule of the bucket's.
    pub async fn delete_staged(&self, time: SystemTime) -> Result<u64> {
        let Some(folder) = self.folder.clone() else { return Ok(0) };
        let deleted = tokio::task::spawn_blocking(move || delete(&folder, time)).await;
        deleted.map_err(io::Error::other).flatten().map_err(|error| {
            BlobError::Failed(object_store::Error::Generic { store: "folder", source: error.into() })
        })
    }
}

/// Whether a file's name is one that the object store gives to what is not whole yet.
fn is_staged(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.rsplit_once('#').is_some_and(|(_, n)| !n.is_empty() && n.bytes().all(|byte| byte.is_ascii_digit()))
}

fn delete(folder: &Path, time: SystemTime) -> io::Result<u64> {
    let mut folders: Vec<PathBuf> = vec![folder.to_owned()];
    let mut deleted = 0;
    while let Some(folder) = folders.pop() {
        let entries = match std::fs::read_dir(&folder) {
            // Somebody has removed it since.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let path = entry.path();
            if entry.file_type()?.is_dir() {
                folders.push(path);
            } else if is_staged(&path) && entry.metadata()?.modified()? < time {
                std::fs::remove_file(&path)?;
                deleted += 1;
            }
        }
    }
    Ok(deleted)
}
