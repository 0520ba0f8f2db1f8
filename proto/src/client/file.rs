//! Files to and from a farm, piece by piece, checked by their hash.

use super::{answer::Answer, call::Payload, error::ClientError};
use crate::id::BlobId;
use bytes::Bytes;
use std::path::{Path, PathBuf};
use tokio::{
    fs::File,
    io::{AsyncReadExt as _, AsyncWriteExt as _},
};

/// Bytes to upload, with their name.
#[derive(Clone, Debug)]
pub struct Upload {
    pub(super) id: BlobId,
    pub(super) payload: Payload,
}

impl Upload {
    /// Of bytes in memory.
    pub fn bytes(bytes: impl Into<Bytes>) -> Self {
        let bytes = bytes.into();
        Self { id: BlobId::of(*blake3::hash(&bytes).as_bytes()), payload: Payload::Bytes(bytes) }
    }

    /// Of a file, read twice: now for its name, and while it is sent.
    pub async fn file(path: PathBuf) -> Result<Self, ClientError> {
        let fault = |e: std::io::Error| failed(&path, &e);
        let mut file = File::open(&path).await.map_err(fault)?;
        let mut hasher = blake3::Hasher::new();
        let mut piece = vec![0; 1 << 20];
        let mut length = 0;
        loop {
            let count = file.read(&mut piece).await.map_err(fault)?;
            if count == 0 {
                break;
            }
            hasher.update(&piece[..count]);
            length += count as u64;
        }
        let id = BlobId::of(*hasher.finalize().as_bytes());
        Ok(Self { id, payload: Payload::File { path, length } })
    }

    /// The hash of its bytes.
    pub fn id(&self) -> &BlobId {
        &self.id
    }
}

impl Answer {
    /// Writes the body to `path`, over what is there.
    pub async fn save(mut self, path: &Path) -> Result<(), ClientError> {
        let fault = |e: std::io::Error| failed(path, &e);
        let mut file = File::create(path).await.map_err(fault)?;
        while let Some(piece) = self.piece().await? {
            file.write_all(&piece).await.map_err(fault)?;
        }
        file.flush().await.map_err(fault)
    }

    /// Writes the body to `path`, over what is there, and checks that it is `expected`. What is
    /// written of other bytes is left for the caller to remove.
    pub async fn save_checked(mut self, path: &Path, expected: &BlobId) -> Result<(), ClientError> {
        let fault = |e: std::io::Error| failed(path, &e);
        let mut file = File::create(path).await.map_err(fault)?;
        let mut hasher = blake3::Hasher::new();
        while let Some(piece) = self.piece().await? {
            hasher.update(&piece);
            file.write_all(&piece).await.map_err(fault)?;
        }
        file.sync_all().await.map_err(fault)?;
        if BlobId::of(*hasher.finalize().as_bytes()) == *expected {
            Ok(())
        } else {
            Err(ClientError::Damaged { call: self.name })
        }
    }
}

fn failed(path: &Path, error: &std::io::Error) -> ClientError {
    ClientError::File { path: path.to_owned(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::{super::mock::serve, *};
    use axum::{Router, routing::get};

    #[tokio::test]
    async fn bytes_of_another_hash_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene");
        tokio::fs::write(&path, b"scene").await.unwrap();
        let upload = Upload::file(path.clone()).await.unwrap();
        assert_eq!(upload.id(), Upload::bytes("scene").id());
        for (sent, arrives) in [("scene", true), ("scent", false), ("", false)] {
            let route = get(move || async move { sent });
            let client = serve(Router::new().route("/v1/scenes/{id}/bytes", route)).await;
            let saved = client.scene_bytes(upload.id()).await.unwrap().save_checked(&path, upload.id()).await;
            assert_eq!(saved.is_ok(), arrives, "{saved:?}");
        }
    }
}
