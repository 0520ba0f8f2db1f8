//! A farm that listens: store, blobs, rules and doors put together.

use crate::{
    api::{guard::Guarding, router},
    blobs::{BlobError, Blobs},
    farm::{
        Farm,
        check::{Checked, check},
        error::FarmError,
        rules::Rules,
    },
    inspect::inspect,
    store::{Store, error::StoreError, sql::Sql},
    tls::{TlsListener, acceptor},
};
use axum::{Router, serve::Listener};
use ovtigre_core::gltf::limits::Limits;
use ovtigre_proto::telemetry::traces::Traces;
use std::{
    fs::{File, TryLockError},
    io,
    net::{Ipv4Addr, SocketAddr},
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
    /// How long, how many, how much.
    pub rules: Rules,
    /// Who is let in.
    pub guarding: Guarding,
    /// Files of a certificate chain and its key: callers encrypt.
    pub tls: Option<(PathBuf, PathBuf)>,
    /// Whether it listens on a port of this machine, too, for workers of its own: without encryption.
    pub own_port: OwnPort,
    /// Where spans go.
    pub traces: Traces,
}

/// Whether a farm listens on a free port of this machine, too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OwnPort {
    /// It does.
    Yes,
    /// It does not.
    #[default]
    No,
}

impl ServeConfig {
    /// All in a folder, for callers of this machine.
    pub fn new(listen: SocketAddr, data: PathBuf) -> Self {
        Self {
            listen,
            data,
            database: None,
            blobs: None,
            rules: Rules::default(),
            guarding: Guarding::default(),
            tls: None,
            own_port: OwnPort::No,
            traces: Traces::default(),
        }
    }
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
    /// The certificate or its key cannot be used.
    #[error("cannot encrypt: {0}")]
    Tls(String),
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
    /// Where it listens for workers of its own, if elsewhere.
    pub own: Option<SocketAddr>,
    farm: Arc<Farm>,
    closing: CancellationToken,
    server: JoinHandle<io::Result<()>>,
    own_server: Option<JoinHandle<io::Result<()>>>,
    /// Held until the end: keeps others from the database in the data folder.
    _lock: Option<File>,
}

/// Opens database and blobs.
async fn open(config: &ServeConfig) -> Result<(Arc<dyn Store>, Blobs), ServeError> {
    let store: Arc<dyn Store> = match &config.database {
        Some(url) => Arc::new(Sql::server(url).await?),
        None => Arc::new(Sql::file(&config.data.join("farm.sqlite")).await?),
    };
    let blobs = match &config.blobs {
        Some(url) => Blobs::bucket(url)?,
        None => Blobs::folder(&config.data.join("blobs"))?,
    };
    blobs.ping().await?;
    Ok((store, blobs))
}

/// Looks whether what the database names is among the blobs. What other servers do meanwhile may be told as missing.
pub async fn verify(config: ServeConfig) -> Result<Checked, ServeError> {
    let _lock = if config.database.is_none() { Some(lock(&config.data)?) } else { None };
    let (store, blobs) = open(&config).await?;
    let checked = check(&*store, &blobs).await;
    store.close().await;
    Ok(checked?)
}

/// Opens database and blobs, takes up what was under way, and listens.
pub async fn start(config: ServeConfig) -> Result<Serving, ServeError> {
    let acceptor = match &config.tls {
        Some((chain, key)) => Some(acceptor(chain, key).map_err(ServeError::Tls)?),
        None => None,
    };
    let lock = if config.database.is_none() { Some(lock(&config.data)?) } else { None };
    let listening = |error| ServeError::Listen { address: config.listen, error };
    let listener = TcpListener::bind(config.listen).await.map_err(listening)?;
    let address = listener.local_addr().map_err(listening)?;
    let (store, blobs) = open(&config).await?;
    let farm = Farm::open(store, blobs, inspect(Limits::default()), config.rules, config.traces).await?;
    let closing = CancellationToken::new();
    let doors = router(Arc::clone(&farm), config.guarding);
    let (mut own, mut own_server) = (None, None);
    if config.own_port == OwnPort::Yes {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.map_err(listening)?;
        own = Some(listener.local_addr().map_err(listening)?);
        own_server = Some(serve(listener, doors.clone(), &closing));
    }
    let server = match acceptor {
        Some(acceptor) => serve(TlsListener::new(listener, acceptor).map_err(listening)?, doors, &closing),
        None => serve(listener, doors, &closing),
    };
    tracing::info!(%address, data = %config.data.display(), "farm listens");
    Ok(Serving { address, own, farm, closing, server, own_server, _lock: lock })
}

fn serve<L>(listener: L, doors: Router, closing: &CancellationToken) -> JoinHandle<io::Result<()>>
where
    L: Listener<Addr = SocketAddr>,
{
    let closed = closing.clone().cancelled_owned();
    tokio::spawn(axum::serve(listener, doors).with_graceful_shutdown(closed).into_future())
}

/// Bytes that are free on the disk of a folder.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    let about = rustix::fs::statvfs(folder).ok()?;
    Some(about.f_bavail.saturating_mul(about.f_frsize))
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
        if let Some(own) = self.own_server {
            own.abort();
        }
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
        self.farm.traces.stop().await;
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
        ServeConfig::new(([127, 0, 0, 1], 0).into(), data.to_owned())
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
            "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: {kind}\r\ncontent-length: {length}\r\n\r\n{body}"
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
        let listen = format!("GET {location}/events HTTP/1.1\r\nhost: localhost\r\n\r\n");
        let (mut stream, answer) = ask(farm.address, listen, "\"event\":\"status\"").await;
        assert!(answer.contains("text/event-stream"), "{answer}");

        let begun = Instant::now();
        farm.stop().await;
        assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
        read_until(&mut stream, "never").await;

        let farm = start(config(folder.path())).await.unwrap();
        let get = format!("GET {location} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n");
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
