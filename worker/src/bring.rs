//! Sums on their way to the farm.

use crate::desk::Desk;
use bytes::Bytes;
use ovtigre_core::film::{
    exr::{PartialAttributes, write_partial},
    size::Size,
    sum::Sum,
};
use ovtigre_proto::{
    client::farm::Client,
    id::LeaseId,
    lease::{Committed, FailureKind, LeaseFailure},
};
use std::{sync::Arc, time::Duration};

/// A rendered batch.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Whose.
    pub lease: LeaseId,
    /// Its sum.
    pub sum: Sum,
    /// The frame's size.
    pub size: Size,
    /// What its partial EXR says of it.
    pub attributes: PartialAttributes,
    /// Time spent on it in seconds.
    pub seconds: f64,
    /// Where it may be put directly.
    pub upload: Option<String>,
}

/// Slowest line that is waited for, in bytes a second.
const SLOWEST: f64 = 50_000.0;

/// Puts a sum where its lease said, and tells the farm; `None` where that does not work.
async fn hand(client: &Client, lease: &LeaseId, url: &str, sum: &Bytes, seconds: f64) -> Option<Committed> {
    let patience = Duration::from_secs_f64(10.0 + sum.len() as f64 / SLOWEST);
    if let Err(error) = client.put_elsewhere(url, sum.clone(), patience).await {
        tracing::debug!(%lease, %error, "a sum could not be put directly");
        return None;
    }
    client.handed(lease, seconds).await.ok()
}

/// Brings a sum until the farm has taken or refused it; takes its lease off the desk. Its file is written here,
/// while the pool renders the next batch.
pub async fn bring(client: Client, desk: Arc<Desk>, rendered: Rendered) {
    let Rendered { lease, sum, size, attributes, seconds, upload } = rendered;
    let partial = tokio::task::spawn_blocking(move || Bytes::from(write_partial(&sum, size, &attributes)));
    let sum = match partial.await {
        Ok(sum) => sum,
        Err(error) => {
            let reason = format!("writing a sum failed: {error}");
            give_back(&client, &lease, FailureKind::Worker, reason).await;
            desk.remove(&lease);
            return;
        }
    };
    if let Some(url) = upload
        && let Some(committed) = hand(&client, &lease, &url, &sum, seconds).await
    {
        tracing::debug!(%lease, commit = ?committed.commit, "put directly");
        desk.remove(&lease);
        return;
    }
    let mut backoff = client.backoff();
    loop {
        match client.bring(&lease, sum.clone(), seconds).await {
            Ok(committed) => {
                tracing::debug!(%lease, commit = ?committed.commit, seconds, "brought");
                break;
            }
            Err(error) if error.may_pass() => {
                tracing::warn!(%lease, %error, "bringing a sum again");
                tokio::time::sleep(backoff.delay()).await;
            }
            Err(error) => {
                tracing::warn!(%lease, %error, "the farm did not take a sum");
                // A lease that is gone needs no giving back.
                if !matches!(error.status(), Some(404 | 409 | 410)) {
                    give_back(&client, &lease, FailureKind::Worker, error.to_string()).await;
                }
                break;
            }
        }
    }
    desk.remove(&lease);
}

/// Gives a batch back; where that fails the lease ends by itself.
pub async fn give_back(client: &Client, lease: &LeaseId, kind: FailureKind, reason: String) {
    if kind != FailureKind::HandedBack {
        tracing::warn!(%lease, reason, "a batch failed");
    }
    if let Err(error) = client.give_back(lease, &LeaseFailure { reason, kind }).await {
        tracing::debug!(%lease, %error, "a batch could not be given back");
    }
}
