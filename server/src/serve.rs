//! A farm that listens: store, blobs, rules and doors put together.

use crate::{
    api::router,
    blobs::{BlobError, Blobs},
    farm::{Farm, error::FarmError, rules::Rules},
    inspect::inspect,
    store::{error::StoreError, sqlite::Sqlite},
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
    /// Folder of database and blobs; made where it is not there.
    pub data: PathBuf,
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
    /// Held until the end: keeps others from the data folder.
    _lock: File,
}

/// Opens the data folder, takes up what was under way, and listens.
pub async fn start(config: ServeConfig) -> Result<Serving, ServeError> {
    let lock = lock(&config.data)?;
    let listening = |error| ServeError::Listen { address: config.listen, error };
    let listener = TcpListener::bind(config.listen).await.map_err(listening)?;
    let address = listener.local_addr().map_err(listening)?;
    let store = Arc::new(Sqlite::open(&config.data.join("farm.sqlite")).await?);
    let blobs = Blobs::folder(&config.data.join("blobs"))?;
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
