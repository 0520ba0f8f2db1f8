//! Uploaded files on this worker's disk, by their hash.

use ovtigre_proto::{
    client::{error::ClientError, farm::Client},
    id::BlobId,
};
use std::{
    collections::VecDeque,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

/// Tries to fetch a file whose bytes arrive damaged.
const FETCHES: u32 = 3;
/// Files that the farm is told of.
const TOLD_MAX: usize = 32;

/// A folder of files, each checked whenever it is read. Several workers may share it.
#[derive(Debug)]
pub struct SceneFolder {
    folder: PathBuf,
    bytes_max: u64,
    used: Mutex<VecDeque<BlobId>>,
    /// One fetch at a time: two batches of one scene come together.
    fetching: tokio::sync::Mutex<()>,
}

/// Why a file is not at hand.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The farm did not send it.
    #[error("cannot fetch {id}: {error}")]
    Fetch {
        /// Which.
        id: BlobId,
        /// Why.
        error: ClientError,
    },
    /// The disk did not take it.
    #[error("cannot keep scenes in {}: {error}", folder.display())]
    Disk {
        /// The cache.
        folder: PathBuf,
        /// Why.
        error: io::Error,
    },
}

impl SceneFolder {
    /// In `folder`, of `bytes_max` at most.
    pub fn open(folder: PathBuf, bytes_max: u64) -> Result<Self, SceneError> {
        fs::create_dir_all(&folder).map_err(|error| SceneError::Disk { folder: folder.clone(), error })?;
        let used = Mutex::new(VecDeque::new());
        Ok(Self { folder, bytes_max, used, fetching: tokio::sync::Mutex::default() })
    }

    /// The latest used files.
    pub fn at_hand(&self) -> Vec<BlobId> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// A file's bytes, from the disk or else from the farm.
    pub async fn bytes(&self, client: &Client, id: &BlobId) -> Result<Arc<[u8]>, SceneError> {
        let _one_at_a_time = self.fetching.lock().await;
        let path = self.folder.join(id.as_str());
        let bytes = match read_checked(path.clone(), id.clone()).await {
            Some(bytes) => bytes,
            None => self.fetch(client, id, &path).await?,
        };
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        used.retain(|other| other != id);
        used.push_front(id.clone());
        used.truncate(TOLD_MAX);
        Ok(bytes)
    }

    async fn fetch(&self, client: &Client, id: &BlobId, path: &Path) -> Result<Arc<[u8]>, SceneError> {
        let disk = |error| SceneError::Disk { folder: self.folder.clone(), error };
        let mut left = FETCHES;
        loop {
            left -= 1;
            let part = tempfile::Builder::new().prefix("part-").tempfile_in(&self.folder).map_err(disk)?;
            let saved = match client.scene_bytes(id).await {
                Ok(answer) => answer.save_checked(part.path(), id).await,
                Err(error) => Err(error),
            };
            match saved {
                Ok(()) => {
                    part.persist(path).map_err(|e| disk(e.error))?;
                    break;
                }
                Err(error) if error.may_pass() && left > 0 => {
                    tracing::warn!(%error, "fetching a scene again");
                }
                Err(error) => return Err(SceneError::Fetch { id: id.clone(), error }),
            }
        }
        make_room(&self.folder, self.bytes_max, id);
        let unreadable = || disk(io::Error::other("a file that was just written cannot be read back"));
        read_checked(path.to_owned(), id.clone()).await.ok_or_else(unreadable)
    }
}

/// The bytes at `path` if they are `id`; others are removed. The file counts as used now.
async fn read_checked(path: PathBuf, id: BlobId) -> Option<Arc<[u8]>> {
    let read = move || {
        let bytes = fs::read(&path).ok()?;
        if BlobId::of(*blake3::hash(&bytes).as_bytes()) != id {
            tracing::warn!(path = %path.display(), "a kept scene is damaged");
            fs::remove_file(&path).ok();
            return None;
        }
        if let Ok(file) = File::options().append(true).open(&path) {
            file.set_modified(SystemTime::now()).ok();
        }
        Some(bytes.into())
    };
    tokio::task::spawn_blocking(read).await.ok().flatten()
}

/// Removes the longest unused files until no more than `bytes_max` are left; never `newest`.
fn make_room(folder: &Path, bytes_max: u64, newest: &BlobId) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut files: Vec<(SystemTime, u64, PathBuf)> = entries
        .filter_map(Result::ok)
        .filter(|entry| entry.file_name().to_str().is_some_and(|name| name.parse::<BlobId>().is_ok()))
        .filter_map(|entry| {
            let about = entry.metadata().ok()?;
            Some((about.modified().ok()?, about.len(), entry.path()))
        })
        .collect();
    files.sort();
    let mut total: u64 = files.iter().map(|(_, length, _)| length).sum();
    for (_, length, path) in files {
        if total <= bytes_max {
            return;
        }
        if !path.ends_with(newest.as_str()) && fs::remove_file(&path).is_ok() {
            total -= length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock::MockFarm;

    #[tokio::test]
    async fn a_scene_is_fetched_once_and_again_when_its_file_is_damaged() {
        let farm = MockFarm::start().await;
        let id = farm.add_scene(b"a scene");
        let folder = tempfile::tempdir().unwrap();
        let open = || SceneFolder::open(folder.path().to_owned(), 1 << 20).unwrap();
        let scenes = open();
        for _ in 0..2 {
            assert_eq!(&*scenes.bytes(&farm.client(), &id).await.unwrap(), b"a scene");
        }
        assert_eq!(farm.fetches(), 1);
        fs::write(folder.path().join(id.as_str()), b"a scent").unwrap();
        assert_eq!(&*open().bytes(&farm.client(), &id).await.unwrap(), b"a scene");
        assert_eq!(farm.fetches(), 2);
        assert_eq!(scenes.at_hand(), [id]);
    }

    #[tokio::test]
    async fn bytes_damaged_on_the_way_are_fetched_again_and_then_given_up() {
        let farm = MockFarm::start().await;
        let id = farm.add_scene(b"a scene");
        let folder = tempfile::tempdir().unwrap();
        let scenes = SceneFolder::open(folder.path().to_owned(), 1 << 20).unwrap();
        farm.damage_fetches(FETCHES);
        assert!(matches!(scenes.bytes(&farm.client(), &id).await, Err(SceneError::Fetch { .. })));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing damaged is kept");
        farm.damage_fetches(1);
        assert_eq!(&*scenes.bytes(&farm.client(), &id).await.unwrap(), b"a scene");
    }

    #[tokio::test]
    async fn the_longest_unused_scenes_make_room() {
        let farm = MockFarm::start().await;
        let folder = tempfile::tempdir().unwrap();
        let scenes = SceneFolder::open(folder.path().to_owned(), 25).unwrap();
        for n in 0..5u8 {
            let id = farm.add_scene(&[n; 10]);
            scenes.bytes(&farm.client(), &id).await.unwrap();
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        assert!(folder.path().join(scenes.at_hand()[0].as_str()).exists());
    }
}
