//! `/v1/workers`

use super::{
    body::Document,
    error::Result,
    params::{Named, PageParams, Params, cursor, id, limit},
};
use crate::farm::Farm;
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{IntoResponse as _, Response},
};
use ovtigre_proto::{
    lease::{Exchange, ExchangeReply, WorkerJoin},
    route,
    status::{Page, WorkerStatus},
};
use std::sync::Arc;

/// A worker joins.
pub async fn join(State(farm): State<Arc<Farm>>, Document(join): Document<WorkerJoin>) -> Result<Response> {
    let joined = farm.join(join).await?;
    let location = [(header::LOCATION, route::worker(&joined.id))];
    Ok((StatusCode::CREATED, location, Json(joined)).into_response())
}

/// Workers, the newest first.
pub async fn list(
    State(farm): State<Arc<Farm>>,
    Params(params): Params<PageParams>,
) -> Result<Json<Page<WorkerStatus>>> {
    let before = cursor(params.cursor.as_deref())?;
    Ok(Json(farm.workers(before, limit(params.limit)?).await?))
}

/// A worker.
pub async fn get(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Json<WorkerStatus>> {
    Ok(Json(farm.worker(&id("worker", &name)?).await?))
}

/// A worker gets no more batches.
pub async fn drain(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Json<WorkerStatus>> {
    Ok(Json(farm.drain(&id("worker", &name)?).await?))
}

/// A worker's beat.
pub async fn exchange(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    Document(said): Document<Exchange>,
) -> Result<Json<ExchangeReply>> {
    Ok(Json(farm.exchange(&id("worker", &name)?, said).await?))
}
