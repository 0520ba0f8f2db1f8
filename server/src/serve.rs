//! A farm that listens: store, blobs, rules and doors put together.

use crate::{
    api::router,
    blobs::{BlobError, Blobs},
    farm::{Farm, error::FarmError, rules::Rules},
    inspect::inspect,
    store::{Store, error::StoreError, sql::Sql},
};
use ovtigre_core::gltf::limits::Limits;
use std::{
    fs::{File, TryLockError},
    io,
    net::SocketAddr,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};
use tokio::{net::TcpListener, task::JoinHandle};
use tokio_util::sync::CancellationToken;

/// How long requests under way may take when the farm stops.
const LAST_REQUESTS: Duration = Duration::from_secs(5);

/// Where a farm listens and keeps its memory.
#[derive(Clone, Debug)]
pub struct ServeConfig {
    /// Address to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Folder of database and blobs, where they are not elsewhere; made where it is not there.
    pub data: PathBuf,
    /// A PostgreSQL server, `postgres://…`, instead of a database in the folder.
    pub database: Option<String>,
    /// A bucket, `s3://bucket/prefix`, instead of files in the folder.
    pub blobs: Option<String>,
}

/// Why a farm does not listen.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The data folder cannot be used.
    #[error("the data folder '{}' cannot be used: {error}", .folder.display())]
    Folder {
        /// Which.
        folder: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Another farm uses the data folder.
    #[error("the data folder '{}' is used by another ovtigre: stop that one, or give another folder", .0.display())]
    Taken(PathBuf),
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {error}")]
    Listen {
        /// Which.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// The database cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The blobs cannot be used.
    #[error(transparent)]
    Blobs(#[from] BlobError),
    /// What is kept cannot be taken up again.
    #[error(transparent)]
    Farm(#[from] FarmError),
}

/// A farm that listens.
#[derive(Debug)]
pub struct Serving {
    /// Where it listens.
    pub address: SocketAddr,
    farm: Arc<Farm>,
    closing: CancellationToken,
    server: JoinHandle<io::Result<()>>,
    /// Held until the end: keeps others from the database in the data folder.
    _lock: Option<File>,
}

/// Opens database and blobs, takes up what was under way, and listens.
pub async fn start(config: ServeConfig) -> Result<Serving, ServeError> {
    let lock = if config.database.is_none() { Some(lock(&config.data)?) } else { None };
    let listening = |error| ServeError::Listen { address: config.listen, error };
    let listener = TcpListener::bind(config.listen).await.map_err(listening)?;
    let address = listener.local_addr().map_err(listening)?;
    let store: Arc<dyn Store> = match &config.database {
        Some(url) => Arc::new(Sql::server(url).await?),
        None => Arc::new(Sql::file(&config.data.join("farm.sqlite")).await?),
    };
    let blobs = match &config.blobs {
        Some(url) => Blobs::bucket(url)?,
        None => Blobs::folder(&config.data.join("blobs"))?,
    };
    blobs.ping().await?;
    let farm = Farm::open(store, blobs, inspect(Limits::default()), Rules::default()).await?;
    let closing = CancellationToken::new();
    let closed = closing.clone().cancelled_owned();
    let server = axum::serve(listener, router(Arc::clone(&farm))).with_graceful_shutdown(closed);
    let server = tokio::spawn(server.into_future());
    tracing::info!(%address, data = %config.data.display(), "farm listens");
    Ok(Serving { address, farm, closing, server, _lock: lock })
}

fn lock(folder: &Path) -> Result<File, ServeError> {
    let unusable = |error| ServeError::Folder { folder: folder.to_owned(), error };
    std::fs::create_dir_all(folder).map_err(unusable)?;
    let file = File::options().create(true).truncate(false).write(true).open(folder.join("lock"));
    let file = file.map_err(unusable)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(ServeError::Taken(folder.to_owned())),
        Err(TryLockError::Error(error)) => Err(unusable(error)),
    }
}

impl Serving {
    /// Takes no more requests, lets those under way end, and keeps all that was done. Leases stay:
    /// workers go on when the farm is back.
    pub async fn stop(self) {
        self.closing.cancel();
        // Ends event streams and waits for pictures.
        self.farm.stopping.cancel();
        let abort = self.server.abort_handle();
        match tokio::time::timeout(LAST_REQUESTS, self.server).await {
            Ok(Ok(Ok(()))) => {}
            Ok(Ok(Err(error))) => tracing::error!(%error, "listening failed"),
            Ok(Err(error)) => tracing::error!(%error, "listening ended early"),
            Err(_) => {
                tracing::warn!("requests took too long and were cut off");
                abort.abort();
            }
        }
        self.farm.close().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;
    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _},
        net::TcpStream,
    };

    fn config(data: &Path) -> ServeConfig {
        let listen = ([127, 0, 0, 1], 0).into();
        ServeConfig { listen, data: data.to_owned(), database: None, blobs: None }
    }

    /// What comes until `end` is in it, or the connection ends.
    async fn read_until(stream: &mut TcpStream, end: &str) -> String {
        let mut text = Vec::new();
        while !String::from_utf8_lossy(&text).contains(end) && stream.read_buf(&mut text).await.unwrap() > 0 {
        }
        String::from_utf8(text).unwrap()
    }

    async fn ask(address: SocketAddr, request: String, end: &str) -> (TcpStream, String) {
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(request.as_bytes()).await.unwrap();
        let answer = read_until(&mut stream, end).await;
        (stream, answer)
    }

    fn post(path: &str, kind: &str, body: &str) -> String {
        let length = body.len();
        format!(
            "POST {path} HTTP/1.1\r\nhost: x\r\ncontent-type: {kind}\r\ncontent-length: {length}\r\n\r\n{body}"
        )
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_farm_stops_at_once_though_somebody_listens_to_events_and_goes_on_later() {
        let folder = tempfile::tempdir().unwrap();
        let farm = start(config(folder.path())).await.unwrap();
        let triangle = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
            "bufferViews":[{"buffer":0,"byteLength":36}],
            "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
        let (_, answer) =
            ask(farm.address, post("/v1/scenes", "model/gltf+json", triangle), "warnings").await;
        let scene = blake3::hash(triangle.as_bytes()).to_hex().to_string();
        assert!(answer.starts_with("HTTP/1.1 201") && answer.contains(&scene), "{answer}");
        let job = format!(r#"{{"scene":"{scene}"}}"#);
        let (_, answer) = ask(farm.address, post("/v1/jobs", "application/json", &job), "\"warnings\"").await;
        assert!(answer.starts_with("HTTP/1.1 202"), "{answer}");
        let location = answer.lines().find_map(|line| line.strip_prefix("location: ")).unwrap().to_owned();
        let listen = format!("GET {location}/events HTTP/1.1\r\nhost: x\r\n\r\n");
        let (mut stream, answer) = ask(farm.address, listen, "\"event\":\"status\"").await;
        assert!(answer.contains("text/event-stream"), "{answer}");

        let begun = Instant::now();
        farm.stop().await;
        assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
        read_until(&mut stream, "never").await;

        let farm = start(config(folder.path())).await.unwrap();
        let get = format!("GET {location} HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n");
        let (_, answer) = ask(farm.address, get, "never").await;
        assert!(answer.contains("\"queued\""), "{answer}");
        farm.stop().await;
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_second_farm_in_the_same_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let farm = start(config(folder.path())).await.unwrap();
        let second = start(config(folder.path())).await.unwrap_err();
        assert!(matches!(second, ServeError::Taken(_)), "{second}");
        farm.stop().await;
        start(config(folder.path())).await.unwrap().stop().await;
    }

    #[tokio::test]
    async fn what_cannot_be_used_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "x").unwrap();
        assert!(matches!(start(config(&file)).await.unwrap_err(), ServeError::Folder { .. }));
        std::fs::write(folder.path().join("farm.sqlite"), "this is no database, but text of some length")
            .unwrap();
        assert!(matches!(start(config(folder.path())).await.unwrap_err(), ServeError::Store(_)));
    }
}
