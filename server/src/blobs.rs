//! Scenes, partials, sums and results over an object store.

use crate::store::row::{BatchKey, Lane};
use bytes::Bytes;
use futures::{StreamExt as _, TryStreamExt as _, stream::BoxStream};
use object_store::{
    ObjectStore, ObjectStoreExt as _, WriteMultipart, local::LocalFileSystem, path::Path as Key,
};
use ovtigre_proto::id::{BlobId, JobId};
use std::{fmt, io, ops::Range, path::Path, sync::Arc};

/// Parts of an upload on their way at a time.
const PARTS_IN_FLIGHT: usize = 4;

/// What a blob is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BlobName {
    /// An upload that has no name yet.
    Incoming(String),
    /// An uploaded file.
    Scene(BlobId),
    /// The partial EXR of a batch. Its sum's hash is in the name: a sum that differs never
    /// replaces one that counts.
    Partial(JobId, BatchKey, BlobId),
    /// The first blocks of a lane as one.
    Prefix(JobId, Lane, u32),
    /// How a job's scene was solved before the first sample.
    Solution(JobId),
    /// A job's picture.
    Result(JobId),
}

impl fmt::Display for BlobName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Incoming(name) => write!(f, "incoming/{name}"),
            Self::Scene(id) => write!(f, "scenes/{id}"),
            Self::Partial(job, BatchKey { block, replicate, region }, hash) => {
                let hash = &hash.as_str()[..16];
                write!(f, "{}/{region}-{replicate}-{block}-{hash}.exr", BlobFolder::Partials(job.clone()))
            }
            Self::Prefix(job, Lane { replicate, region }, blocks) => {
                write!(f, "{}/{region}-{replicate}-{blocks}", BlobFolder::Prefixes(job.clone()))
            }
            Self::Solution(job) => write!(f, "jobs/{job}/solution.json"),
            Self::Result(job) => write!(f, "jobs/{job}/result.exr"),
        }
    }
}

/// Blobs that go together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BlobFolder {
    /// Uploads that have no name yet.
    Incoming,
    /// All of a job.
    Job(JobId),
    /// Its partials.
    Partials(JobId),
    /// Its sums.
    Prefixes(JobId),
}

impl fmt::Display for BlobFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Incoming => f.write_str("incoming"),
            Self::Job(job) => write!(f, "jobs/{job}"),
            Self::Partials(job) => write!(f, "jobs/{job}/partials"),
            Self::Prefixes(job) => write!(f, "jobs/{job}/prefix"),
        }
    }
}

/// Why a blob was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum BlobError {
    /// There is none of that name.
    #[error("the blob '{0}' is missing")]
    Missing(String),
    /// No space is left.
    #[error("no space is left for blobs")]
    Full,
    /// The store failed.
    #[error("the blob store failed: {0}")]
    Failed(object_store::Error),
}

impl From<object_store::Error> for BlobError {
    fn from(error: object_store::Error) -> Self {
        if let object_store::Error::NotFound { path, .. } = &error {
            return Self::Missing(path.clone());
        }
        let mut source: Option<&(dyn std::error::Error + 'static)> = Some(&error);
        while let Some(inner) = source {
            let kind = inner.downcast_ref::<io::Error>().map(io::Error::kind);
            if matches!(kind, Some(io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)) {
                return Self::Full;
            }
            source = inner.source();
        }
        Self::Failed(error)
    }
}

type Result<T> = std::result::Result<T, BlobError>;

/// Where blobs are kept. A blob is there whole or not at all, and durable once it was put.
#[derive(Clone, Debug)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
}

impl Blobs {
    /// In a folder, which is made where it is not there. Written under a temporary name, synced,
    /// then renamed.
    pub fn folder(path: &Path) -> Result<Self> {
        std::fs::create_dir_all(path).map_err(|e| {
            BlobError::Failed(object_store::Error::Generic { store: "folder", source: e.into() })
        })?;
        let store = LocalFileSystem::new_with_prefix(path)?.with_fsync(true).with_automatic_cleanup(true);
        Ok(Self { store: Arc::new(store) })
    }

    /// Writes a blob; one of the same name is replaced.
    pub async fn put(&self, name: &BlobName, bytes: Bytes) -> Result<()> {
        self.store.put(&key(name), bytes.into()).await?;
        Ok(())
    }

    /// A whole blob.
    pub async fn get(&self, name: &BlobName) -> Result<Bytes> {
        Ok(self.store.get(&key(name)).await?.bytes().await?)
    }

    /// Some bytes of a blob.
    pub async fn get_range(&self, name: &BlobName, range: Range<u64>) -> Result<Bytes> {
        Ok(self.store.get_range(&key(name), range).await?)
    }

    /// A blob's size and its bytes piece by piece.
    pub async fn stream(&self, name: &BlobName) -> Result<(u64, BoxStream<'static, Result<Bytes>>)> {
        let found = self.store.get(&key(name)).await?;
        Ok((found.meta.size, found.into_stream().map_err(BlobError::from).boxed()))
    }

    /// A blob's size in bytes.
    pub async fn size(&self, name: &BlobName) -> Result<u64> {
        Ok(self.store.head(&key(name)).await?.size)
    }

    /// Removes a blob; one that is not there is no error.
    pub async fn delete(&self, name: &BlobName) -> Result<()> {
        match self.store.delete(&key(name)).await.map_err(BlobError::from) {
            Err(BlobError::Missing(_)) | Ok(()) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Removes all blobs of a folder.
    pub async fn delete_all(&self, folder: &BlobFolder) -> Result<()> {
        let prefix = Key::from(folder.to_string());
        let keys = self.store.list(Some(&prefix)).map_ok(|meta| meta.location).boxed();
        let mut deleted = self.store.delete_stream(keys);
        while let Some(one) = deleted.next().await {
            match one.map_err(BlobError::from) {
                Err(BlobError::Missing(_)) | Ok(_) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Jobs that have blobs.
    pub async fn jobs(&self) -> Result<Vec<JobId>> {
        let listed = self.store.list_with_delimiter(Some(&Key::from("jobs"))).await?;
        let names = listed.common_prefixes.iter().filter_map(|key| key.filename());
        Ok(names.filter_map(|name| name.parse().ok()).collect())
    }

    /// Begins to write a blob piece by piece under a temporary name.
    pub async fn upload(&self, name: String) -> Result<Upload> {
        let incoming = BlobName::Incoming(name);
        let parts = self.store.put_multipart(&key(&incoming)).await?;
        Ok(Upload { blobs: self.clone(), incoming, parts: WriteMultipart::new(parts) })
    }
}

/// A blob that is being written.
pub struct Upload {
    blobs: Blobs,
    incoming: BlobName,
    parts: WriteMultipart,
}

impl fmt::Debug for Upload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Upload").field("incoming", &self.incoming).finish_non_exhaustive()
    }
}

impl Upload {
    /// Adds a piece.
    pub async fn write(&mut self, bytes: Bytes) -> Result<()> {
        self.parts.wait_for_capacity(PARTS_IN_FLIGHT).await?;
        self.parts.put(bytes);
        Ok(())
    }

    /// Makes the blob durable under its name.
    pub async fn finish(self, name: &BlobName) -> Result<()> {
        self.parts.finish().await?;
        Ok(self.blobs.store.rename(&key(&self.incoming), &key(name)).await?)
    }

    /// Forgets what was written.
    pub async fn abort(self) -> Result<()> {
        Ok(self.parts.abort().await?)
    }
}

fn key(name: &BlobName) -> Key {
    Key::from(name.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_blob_is_written_whole_replaced_and_removed_with_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let blobs = Blobs::folder(folder.path()).unwrap();
        let job: JobId = "j1".parse().unwrap();
        let name = BlobName::Prefix(job.clone(), Lane { replicate: 1, region: 0 }, 3);
        blobs.put(&name, Bytes::from_static(b"first")).await.unwrap();
        blobs.put(&name, Bytes::from_static(b"second")).await.unwrap();
        assert_eq!(blobs.get(&name).await.unwrap(), "second");
        assert_eq!(blobs.get_range(&name, 1..3).await.unwrap(), "ec");
        assert_eq!(blobs.jobs().await.unwrap(), std::slice::from_ref(&job));
        blobs.delete_all(&BlobFolder::Partials(job.clone())).await.unwrap();
        assert_eq!(blobs.size(&name).await.unwrap(), 6);
        blobs.delete_all(&BlobFolder::Job(job)).await.unwrap();
        assert!(matches!(blobs.get(&name).await, Err(BlobError::Missing(_))));
        blobs.delete(&name).await.unwrap();
    }

    #[tokio::test]
    async fn an_upload_has_its_name_only_once_it_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let blobs = Blobs::folder(folder.path()).unwrap();
        let name = BlobName::Scene(BlobId::of([7; 32]));
        let mut upload = blobs.upload("u1".to_owned()).await.unwrap();
        upload.write(Bytes::from(vec![1; 7 << 20])).await.unwrap();
        upload.write(Bytes::from(vec![2; 5])).await.unwrap();
        assert!(matches!(blobs.size(&name).await, Err(BlobError::Missing(_))));
        upload.finish(&name).await.unwrap();
        assert_eq!(blobs.size(&name).await.unwrap(), (7 << 20) + 5);
        let mut upload = blobs.upload("u2".to_owned()).await.unwrap();
        upload.write(Bytes::from_static(b"x")).await.unwrap();
        upload.abort().await.unwrap();
        assert!(!folder.path().join("incoming/u2").exists());
    }
}
