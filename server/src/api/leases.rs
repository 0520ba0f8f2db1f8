//! `/v1/leases`

use super::{
    body::{Document, Partial},
    error::{ApiError, Result},
    params::{Named, id},
};
use crate::farm::Farm;
use axum::{
    Json,
    extract::State,
    http::{HeaderMap, StatusCode},
};
use ovtigre_proto::lease::{Committed, LeaseFailure, SECONDS_HEADER};
use std::{sync::Arc, time::Duration};

/// A batch's sum.
pub async fn sum(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    headers: HeaderMap,
    Partial(bytes): Partial,
) -> Result<Json<Committed>> {
    let commit = farm.commit(&id("lease", &name)?, bytes, seconds(&headers)?).await?;
    Ok(Json(Committed { commit }))
}

/// A batch's sum was put where its lease said.
pub async fn handed(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    headers: HeaderMap,
) -> Result<Json<Committed>> {
    let commit = farm.commit_handed(&id("lease", &name)?, seconds(&headers)?).await?;
    Ok(Json(Committed { commit }))
}

fn seconds(headers: &HeaderMap) -> Result<Duration> {
    let Some(value) = headers.get(SECONDS_HEADER) else { return Ok(Duration::ZERO) };
    let seconds = value.to_str().ok().and_then(|text| text.trim().parse().ok());
    seconds
        .and_then(|s| Duration::try_from_secs_f64(s).ok())
        .ok_or_else(|| ApiError::header(format!("{SECONDS_HEADER} is not a number of seconds")))
}

/// A batch is given back.
pub async fn failure(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    Document(failure): Document<LeaseFailure>,
) -> Result<StatusCode> {
    farm.give_back(&id("lease", &name)?, failure).await?;
    Ok(StatusCode::NO_CONTENT)
}
