//! Scenes, partials, sums and results over an object store.

mod bucket;
mod staged;

use crate::store::row::{BatchKey, Lane};
use bytes::Bytes;
use futures::{StreamExt as _, TryStreamExt as _, stream::BoxStream};
use object_store::{
    ObjectMeta, ObjectStore, ObjectStoreExt as _, PutMode, WriteMultipart,
    local::LocalFileSystem,
    path::Path as Key,
    signer::{Method, Signer},
};
use ovtigre_proto::id::{BlobId, JobId, LeaseId};
use std::{
    collections::BTreeMap,
    fmt, io,
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, SystemTime},
};

/// Parts of an upload on their way at a time.
const PARTS_IN_FLIGHT: usize = 4;

/// What a blob is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BlobName {
    /// An upload that has no name yet.
    Incoming(String),
    /// A sum that its worker puts here itself, before it is looked at.
    Handed(LeaseId),
    /// An uploaded file.
    Scene(BlobId),
    /// Some bytes of a file that is uploaded in parts: from the first number on, before the second.
    Part(BlobId, u64, u64),
    /// The partial EXR of a batch. Its sum's hash is in the name: a sum that differs never
    /// replaces one that counts.
    Partial(JobId, BatchKey, BlobId),
    /// The first blocks of a lane as one.
    Prefix(JobId, Lane, u32),
    /// How a job's scene was solved before the first sample.
    Solution(JobId),
    /// A job's picture, of the set of batches that a manifest names.
    Result(JobId, String),
    /// The same, as the first version of this program named it.
    OldResult(JobId),
}

impl fmt::Display for BlobName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Incoming(name) => write!(f, "incoming/{name}"),
            Self::Handed(lease) => write!(f, "incoming/{lease}.exr"),
            Self::Scene(id) => write!(f, "scenes/{id}"),
            Self::Part(id, from, to) => write!(f, "{}/{from}-{to}", BlobFolder::Parts(id.clone())),
            Self::Partial(job, BatchKey { block, replicate, region }, hash) => {
                let hash = &hash.as_str()[..16];
                write!(f, "{}/{region}-{replicate}-{block}-{hash}.exr", BlobFolder::Partials(job.clone()))
            }
            Self::Prefix(job, Lane { replicate, region }, blocks) => {
                write!(f, "{}/{region}-{replicate}-{blocks}", BlobFolder::Prefixes(job.clone()))
            }
            Self::Solution(job) => write!(f, "jobs/{job}/solution.json"),
            Self::Result(job, manifest) => {
                write!(f, "jobs/{job}/result-{}.exr", manifest.get(..16).unwrap_or(manifest))
            }
            Self::OldResult(job) => write!(f, "jobs/{job}/result.exr"),
        }
    }
}

/// Blobs that go together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BlobFolder {
    /// Uploads that have no name yet.
    Incoming,
    /// Parts of all files that are uploaded in parts.
    AllParts,
    /// Parts of one of them.
    Parts(BlobId),
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
            Self::AllParts => f.write_str("parts"),
            Self::Parts(id) => write!(f, "parts/{id}"),
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
    /// An address that is none.
    #[error("'{0}' is no address of blobs: write s3://bucket or s3://bucket/prefix")]
    Address(String),
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

/// Whether there are sums of a job: partials or prefixes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sums {
    /// There are none.
    None,
    /// There are some.
    Some,
}

/// Where blobs are kept. A blob is there whole or not at all, and durable once it was put.
#[derive(Clone, Debug)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
    /// Where they are, if that is in a folder.
    folder: Option<PathBuf>,
    signer: Option<Arc<dyn Signer>>,
    prefix: Key,
}

impl Blobs {
    /// In a folder, which is made where it is not there. Written under a temporary name, synced,
    /// then renamed.
    pub fn folder(path: &Path) -> Result<Self> {
        std::fs::create_dir_all(path).map_err(|e| {
            BlobError::Failed(object_store::Error::Generic { store: "folder", source: e.into() })
        })?;
        let store = LocalFileSystem::new_with_prefix(path)?.with_fsync(true).with_automatic_cleanup(true);
        Ok(Self {
            store: Arc::new(store),
            folder: Some(path.to_owned()),
            signer: None,
            prefix: Key::default(),
        })
    }

    /// In a bucket of an S3-compatible service, `s3://bucket/prefix`.
    pub fn bucket(url: &str) -> Result<Self> {
        let (store, prefix) = bucket::open(url)?;
        let store = Arc::new(store);
        Ok(Self { store: store.clone(), folder: None, signer: Some(store), prefix })
    }

    fn key(&self, name: &impl fmt::Display) -> Key {
        self.prefix.parts().chain(Key::from(name.to_string()).parts()).collect()
    }

    /// Whether blobs can be listed: address, keys and bucket are right.
    pub async fn ping(&self) -> Result<()> {
        self.store.list_with_delimiter(Some(&self.key(&"incoming"))).await?;
        Ok(())
    }

    /// Writes a blob; one of the same name is replaced.
    pub async fn put(&self, name: &BlobName, bytes: Bytes) -> Result<()> {
        self.store.put(&self.key(name), bytes.into()).await?;
        Ok(())
    }

    /// Writes a blob whose name says what is in it; one of the same name stays.
    pub async fn put_once(&self, name: &BlobName, bytes: Bytes) -> Result<()> {
        let new = PutMode::Create.into();
        match self.store.put_opts(&self.key(name), bytes.clone().into(), new).await {
            Ok(_) | Err(object_store::Error::AlreadyExists { .. }) => Ok(()),
            // Not all services know conditions.
            Err(object_store::Error::NotImplemented { .. }) => self.put(name, bytes).await,
            Err(error) => Err(error.into()),
        }
    }

    /// Where anybody may put that blob for `time`, without asking; `None` where blobs can only be put
    /// through here.
    pub async fn address_to_put(&self, name: &BlobName, time: Duration) -> Result<Option<String>> {
        let Some(signer) = &self.signer else { return Ok(None) };
        Ok(Some(signer.signed_url(Method::PUT, &self.key(name), time).await?.to_string()))
    }

    /// A whole blob.
    pub async fn get(&self, name: &BlobName) -> Result<Bytes> {
        Ok(self.store.get(&self.key(name)).await?.bytes().await?)
    }

    /// Some bytes of a blob.
    pub async fn get_range(&self, name: &BlobName, range: Range<u64>) -> Result<Bytes> {
        Ok(self.store.get_range(&self.key(name), range).await?)
    }

    /// A blob's size and its bytes piece by piece.
    pub async fn stream(&self, name: &BlobName) -> Result<(u64, BoxStream<'static, Result<Bytes>>)> {
        let found = self.store.get(&self.key(name)).await?;
        Ok((found.meta.size, found.into_stream().map_err(BlobError::from).boxed()))
    }

    /// A blob's size in bytes.
    pub async fn size(&self, name: &BlobName) -> Result<u64> {
        Ok(self.store.head(&self.key(name)).await?.size)
    }

    /// Removes a blob; one that is not there is no error.
    pub async fn delete(&self, name: &BlobName) -> Result<()> {
        match self.store.delete(&self.key(name)).await.map_err(BlobError::from) {
            Err(BlobError::Missing(_)) | Ok(()) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Removes all blobs of a folder.
    pub async fn delete_all(&self, folder: &BlobFolder) -> Result<()> {
        self.delete_where(folder, |_| true).await
    }

    /// Removes blobs of a folder that were put longer ago than `age`.
    pub async fn delete_older(&self, folder: &BlobFolder, age: Duration) -> Result<()> {
        let now = SystemTime::now();
        let is_old = move |meta: &ObjectMeta| {
            now.duration_since(SystemTime::from(meta.last_modified)).is_ok_and(|time| time > age)
        };
        self.delete_where(folder, is_old).await
    }

    async fn delete_where(
        &self,
        folder: &BlobFolder,
        is_meant: impl Fn(&ObjectMeta) -> bool + Send + 'static,
    ) -> Result<()> {
        let listed = self.store.list(Some(&self.key(folder)));
        let meant = listed.try_filter(move |meta| std::future::ready(is_meant(meta)));
        let keys = meant.map_ok(|meta| meta.location).boxed();
        let mut deleted = self.store.delete_stream(keys);
        while let Some(one) = deleted.next().await {
            match one.map_err(BlobError::from) {
                Err(BlobError::Missing(_)) | Ok(_) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Bytes of a job's files, without partials: those of a job that is settled are about to go.
    pub async fn bytes_of(&self, job: &JobId) -> Result<u64> {
        let partials = self.key(&BlobFolder::Partials(job.clone()));
        let listed = self.store.list(Some(&self.key(&BlobFolder::Job(job.clone()))));
        let kept =
            listed.try_filter(move |meta| std::future::ready(!meta.location.prefix_matches(&partials)));
        Ok(kept.try_fold(0, async |sum, meta| Ok(sum + meta.size)).await?)
    }

    /// Uploaded files that were put longer ago than `age`.
    pub async fn scenes_older(&self, age: Duration) -> Result<Vec<BlobId>> {
        let now = SystemTime::now();
        let listed = self.store.list(Some(&self.key(&"scenes")));
        let old = listed.try_filter_map(|meta| {
            let time = now.duration_since(SystemTime::from(meta.last_modified)).unwrap_or_default();
            let id = meta.location.filename().and_then(|name| name.parse().ok()).filter(|_| time >= age);
            std::future::ready(Ok(id))
        });
        Ok(old.try_collect().await?)
    }

    /// Parts of a file that are there, by where they begin.
    pub async fn parts(&self, id: &BlobId) -> Result<Vec<(u64, u64)>> {
        let folder = self.key(&BlobFolder::Parts(id.clone()));
        let listed: Vec<ObjectMeta> = self.store.list(Some(&folder)).try_collect().await?;
        let range = |meta: &ObjectMeta| {
            let (from, to) = meta.location.filename()?.split_once('-')?;
            Some((from.parse().ok()?, to.parse().ok()?))
        };
        let mut parts: Vec<(u64, u64)> = listed.iter().filter_map(range).collect();
        parts.sort_unstable();
        Ok(parts)
    }

    /// Jobs that have blobs, and whether some of them are sums.
    pub async fn jobs(&self) -> Result<BTreeMap<JobId, Sums>> {
        let folder = self.key(&"jobs");
        let mut listed = self.store.list(Some(&folder));
        let mut jobs = BTreeMap::new();
        while let Some(meta) = listed.try_next().await? {
            let Some(mut parts) = meta.location.prefix_match(&folder) else { continue };
            let Some(Ok(job)) = parts.next().map(|part| part.as_ref().parse::<JobId>()) else { continue };
            let sums = if parts.count() > 1 { Sums::Some } else { Sums::None };
            jobs.entry(job).and_modify(|before: &mut Sums| *before = sums.max(*before)).or_insert(sums);
        }
        Ok(jobs)
    }

    /// Gives a blob another name; one that has it is replaced.
    pub async fn rename(&self, from: &BlobName, to: &BlobName) -> Result<()> {
        Ok(self.store.rename(&self.key(from), &self.key(to)).await?)
    }

    /// Begins to write a blob piece by piece under a temporary name.
    pub async fn upload(&self, name: String) -> Result<Upload> {
        let incoming = BlobName::Incoming(name);
        let parts = self.store.put_multipart(&self.key(&incoming)).await?;
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
        self.blobs.rename(&self.incoming, name).await
    }

    /// Forgets what was written.
    pub async fn abort(self) -> Result<()> {
        Ok(self.parts.abort().await?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bucket to test with, such as `s3://test`; its keys and endpoint are in the environment.
    const BUCKET: &str = "OVTIGRE_TEST_BUCKET";

    /// An empty place in the bucket; `None` where there is none, which is said.
    fn bucket(name: &str) -> Option<Blobs> {
        let Ok(bucket) = std::env::var(BUCKET) else {
            eprintln!("SKIPPED: {BUCKET} is not set: nothing was tested with S3");
            return None;
        };
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_nanos();
        Some(Blobs::bucket(&format!("{bucket}/{name}/{now}")).unwrap())
    }

    async fn a_blob_is_written_whole_replaced_and_removed_with_its_folder(blobs: &Blobs) {
        blobs.ping().await.unwrap();
        let job: JobId = "j1".parse().unwrap();
        let name = BlobName::Prefix(job.clone(), Lane { replicate: 1, region: 0 }, 3);
        blobs.put(&name, Bytes::from_static(b"first")).await.unwrap();
        blobs.put(&name, Bytes::from_static(b"second")).await.unwrap();
        assert_eq!(blobs.get(&name).await.unwrap(), "second");
        assert_eq!(blobs.get_range(&name, 1..3).await.unwrap(), "ec");
        blobs.put_once(&name, Bytes::from_static(b"third")).await.unwrap();
        assert_eq!(blobs.get(&name).await.unwrap(), "second", "one of the same name stays");
        let lease: LeaseId = "l1".parse().unwrap();
        let handed = BlobName::Handed(lease);
        blobs.put_once(&handed, Bytes::from_static(b"a sum")).await.unwrap();
        blobs.rename(&handed, &BlobName::Result(job.clone(), "m".repeat(64))).await.unwrap();
        assert!(matches!(blobs.size(&handed).await, Err(BlobError::Missing(_))));
        assert_eq!(blobs.jobs().await.unwrap(), BTreeMap::from([(job.clone(), Sums::Some)]));
        assert_eq!(blobs.bytes_of(&job).await.unwrap(), 6 + 5);
        blobs.delete_all(&BlobFolder::Partials(job.clone())).await.unwrap();
        assert_eq!(blobs.size(&name).await.unwrap(), 6);
        blobs.delete_all(&BlobFolder::Job(job)).await.unwrap();
        assert!(matches!(blobs.get(&name).await, Err(BlobError::Missing(_))));
        blobs.delete(&name).await.unwrap();
    }

    async fn an_upload_has_its_name_only_once_it_is_finished(blobs: &Blobs) {
        let name = BlobName::Scene(BlobId::of([7; 32]));
        let mut upload = blobs.upload("u1".to_owned()).await.unwrap();
        upload.write(Bytes::from(vec![1; 7 << 20])).await.unwrap();
        upload.write(Bytes::from(vec![2; 5])).await.unwrap();
        assert!(matches!(blobs.size(&name).await, Err(BlobError::Missing(_))));
        upload.finish(&name).await.unwrap();
        assert_eq!(blobs.size(&name).await.unwrap(), (7 << 20) + 5);
        let (size, pieces) = blobs.stream(&name).await.unwrap();
        let pieces: Vec<Bytes> = pieces.try_collect().await.unwrap();
        assert_eq!(size, pieces.iter().map(|piece| piece.len() as u64).sum::<u64>());
        let mut upload = blobs.upload("u2".to_owned()).await.unwrap();
        upload.write(Bytes::from_static(b"x")).await.unwrap();
        upload.abort().await.unwrap();
        let cut_off = BlobName::Incoming("u3".to_owned());
        blobs.put(&cut_off, Bytes::from_static(b"x")).await.unwrap();
        blobs.delete_older(&BlobFolder::Incoming, Duration::from_hours(1)).await.unwrap();
        assert_eq!(blobs.size(&cut_off).await.unwrap(), 1);
        blobs.delete_all(&BlobFolder::Incoming).await.unwrap();
        assert!(matches!(blobs.size(&cut_off).await, Err(BlobError::Missing(_))));
    }

    #[tokio::test]
    async fn a_folder_keeps_blobs() {
        let folder = tempfile::tempdir().unwrap();
        let blobs = Blobs::folder(folder.path()).unwrap();
        a_blob_is_written_whole_replaced_and_removed_with_its_folder(&blobs).await;
        an_upload_has_its_name_only_once_it_is_finished(&blobs).await;
        assert!(!folder.path().join("incoming/u2").exists());
        let handed = BlobName::Handed("l1".parse().unwrap());
        assert_eq!(blobs.address_to_put(&handed, Duration::from_mins(1)).await.unwrap(), None);
    }

    #[tokio::test]
    async fn a_bucket_keeps_blobs() {
        let Some(blobs) = bucket("blobs") else { return };
        a_blob_is_written_whole_replaced_and_removed_with_its_folder(&blobs).await;
        an_upload_has_its_name_only_once_it_is_finished(&blobs).await;
    }

    #[tokio::test]
    async fn whoever_has_the_address_may_put_one_blob() {
        let Some(blobs) = bucket("address") else { return };
        let handed = BlobName::Handed("l1".parse().unwrap());
        let address = blobs.address_to_put(&handed, Duration::from_mins(1)).await.unwrap().unwrap();
        let client = ovtigre_proto::client::farm::Client::new("http://127.0.0.1:1", 0).unwrap();
        let bytes = Bytes::from_static(b"a sum");
        client.put_elsewhere(&address, bytes.clone(), Duration::from_secs(10)).await.unwrap();
        assert_eq!(blobs.get(&handed).await.unwrap(), bytes);
    }

    #[tokio::test]
    async fn a_bucket_that_is_not_there_and_an_address_that_is_none_are_errors() {
        for address in ["s3://", "s3:///x", "http://x", "bucket"] {
            assert!(matches!(Blobs::bucket(address), Err(BlobError::Address(_))), "{address}");
        }
        if std::env::var(BUCKET).is_ok() {
            let nowhere = Blobs::bucket("s3://there-is-no-such-bucket").unwrap();
            assert!(nowhere.ping().await.is_err());
        }
    }
}
