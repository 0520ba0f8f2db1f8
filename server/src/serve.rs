//! A farm that listens: store, blobs, rules and doors put together.

use std::{net::SocketAddr, path::PathBuf};

/// Where a farm listens and keeps its memory.
#[derive(Clone, Debug)]
pub struct ServeConfig {
    /// Address to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Folder of database and blobs; made where it is not there.
    pub data: PathBuf,
}

/// A farm that listens.
#[derive(Debug)]
pub struct Serving {
    /// Where it listens.
    pub address: SocketAddr,
}
