//! Sums on their way to the farm.

use crate::{
    desk::Desk,
    errand::{Errand, note},
};
use bytes::Bytes;
use ovtigre_core::film::{
    exr::{PartialAttributes, write_partial},
    size::Size,
    sum::Sum,
};
use ovtigre_proto::{
    client::farm::Client,
    lease::{Committed, FailureKind, LeaseFailure},
    telemetry::{span::Span, traces::Traces},
};
use std::{sync::Arc, time::Duration};

/// A rendered batch.
#[derive(Debug)]
pub struct Rendered {
    /// Its names.
    pub errand: Errand,
    /// The span of the errand: it ends with this.
    pub span: Span,
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
async fn hand(client: &Client, errand: &Errand, url: &str, sum: &Bytes, seconds: f64) -> Option<Committed> {
    let patience = Duration::from_secs_f64(10.0 + sum.len() as f64 / SLOWEST);
    if let Err(error) = client.put_elsewhere(url, sum.clone(), patience).await {
        note!(debug, errand, %error, "a sum could not be put directly");
        return None;
    }
    client.handed(&errand.lease, seconds).await.ok()
}

/// Brings a sum until the farm has taken or refused it; takes its lease off the desk. Its file is written here,
/// while the pool renders the next batch.
pub async fn bring(client: Client, desk: Arc<Desk>, traces: Traces, rendered: Rendered) {
    let Rendered { errand, mut span, sum, size, attributes, seconds, upload } = rendered;
    let _bringing = errand.part(&traces, "bring");
    let partial = tokio::task::spawn_blocking(move || Bytes::from(write_partial(&sum, size, &attributes)));
    let sum = match partial.await {
        Ok(sum) => sum,
        Err(error) => {
            let reason = format!("writing a sum failed: {error}");
            span.fail(&reason);
            give_back(&client, &errand, FailureKind::Worker, reason).await;
            desk.remove(&errand.lease);
            return;
        }
    };
    if let Some(url) = upload
        && let Some(committed) = hand(&client, &errand, &url, &sum, seconds).await
    {
        note!(debug, errand, commit = ?committed.commit, "put directly");
        desk.remove(&errand.lease);
        return;
    }
    let mut backoff = client.backoff();
    loop {
        match client.bring(&errand.lease, sum.clone(), seconds).await {
            Ok(committed) => {
                note!(debug, errand, commit = ?committed.commit, seconds, "brought");
                break;
            }
            Err(error) if error.may_pass() => {
                note!(warn, errand, %error, "bringing a sum again");
                tokio::time::sleep(backoff.delay()).await;
            }
            Err(error) => {
                note!(warn, errand, %error, "the farm did not take a sum");
                span.fail(&error.to_string());
                // A lease that is gone needs no giving back.
                if !matches!(error.status(), Some(404 | 409 | 410)) {
                    give_back(&client, &errand, FailureKind::Worker, error.to_string()).await;
                }
                break;
            }
        }
    }
    desk.remove(&errand.lease);
}

/// Gives a batch back; where that fails the lease ends by itself.
pub async fn give_back(client: &Client, errand: &Errand, kind: FailureKind, reason: String) {
    if kind != FailureKind::HandedBack {
        note!(warn, errand, reason, "a batch failed");
    }
    if let Err(error) = client.give_back(&errand.lease, &LeaseFailure { reason, kind }).await {
        note!(debug, errand, %error, "a batch could not be given back");
    }
}
