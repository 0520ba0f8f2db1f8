//! Calls of workers and about them.

use super::{
    call::{Call, Payload, Repeat},
    error::ClientError,
    farm::Client,
    pages::Pages,
};
use crate::{
    id::{LeaseId, WorkerId},
    lease::{Committed, Exchange, ExchangeReply, LeaseFailure, SECONDS_HEADER, WorkerJoin, WorkerJoined},
    route,
    status::{Scaling, WorkerStatus},
};
use bytes::Bytes;
use reqwest::{Method, header::HeaderName};
use std::time::Duration;

/// The farm reads and keeps a sum before it answers.
const COMMITTING: Duration = Duration::from_mins(1);

impl Client {
    /// A worker joins; tried once, the worker has its own patience.
    pub async fn join(&self, join: &WorkerJoin) -> Result<WorkerJoined, ClientError> {
        self.send(&Call::new(Method::POST, route::WORKERS).json(join).attempts(1)).await?.json().await
    }

    /// A worker's beat; tried once, the next beat says the same and more.
    pub async fn exchange(&self, id: &WorkerId, exchange: &Exchange) -> Result<ExchangeReply, ClientError> {
        self.send(&Call::new(Method::POST, route::exchange(id)).json(exchange).attempts(1))
            .await?
            .json()
            .await
    }

    /// Brings a batch's partial EXR and the seconds spent on it. Twice the same is the same as once.
    pub async fn bring(&self, lease: &LeaseId, sum: Bytes, seconds: f64) -> Result<Committed, ClientError> {
        let call = Call::new(Method::PUT, route::lease_sum(lease))
            .body(Payload::Bytes(sum), "image/x-exr")
            .header(HeaderName::from_static(SECONDS_HEADER), &format!("{seconds:.6}"))
            .wait(COMMITTING);
        self.send(&call).await?.json().await
    }

    /// Tells that a batch's partial EXR was put where its lease said, and the seconds spent on it. Twice is the
    /// same as once, but the second time it may be there no more.
    pub async fn handed(&self, lease: &LeaseId, seconds: f64) -> Result<Committed, ClientError> {
        let call = Call::new(Method::POST, route::lease_sum(lease))
            .header(HeaderName::from_static(SECONDS_HEADER), &format!("{seconds:.6}"))
            .repeat(Repeat::Harmless)
            .wait(COMMITTING);
        self.send(&call).await?.json().await
    }

    /// Gives a batch back.
    pub async fn give_back(&self, lease: &LeaseId, failure: &LeaseFailure) -> Result<(), ClientError> {
        let call = Call::new(Method::POST, route::lease_failure(lease)).json(failure);
        self.send(&call.repeat(Repeat::Harmless)).await.map(drop)
    }

    /// Who works.
    pub fn workers(&self) -> Pages<WorkerStatus> {
        Pages::new(self.clone(), Call::new(Method::GET, route::WORKERS))
    }

    /// Lets a worker finish what it holds and leave.
    pub async fn drain(&self, id: &WorkerId) -> Result<(), ClientError> {
        self.send(&Call::new(Method::DELETE, route::worker(id))).await.map(drop)
    }

    /// How many workers the queue could use.
    pub async fn scaling(&self) -> Result<Scaling, ClientError> {
        self.send(&Call::new(Method::GET, route::SCALING)).await?.json().await
    }
}
