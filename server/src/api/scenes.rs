//! `/v1/scenes`

use super::{
    body::{File, cut_off},
    error::{ApiError, Result},
    params::{Named, id},
    tag,
};
use crate::farm::{Farm, scene::Novelty};
use axum::{
    Json,
    body::{Body, HttpBody as _},
    extract::State,
    http::{HeaderMap, StatusCode, header},
    response::{IntoResponse as _, Response},
};
use futures::StreamExt as _;
use ovtigre_proto::{id::BlobId, route, scene::SceneReport};
use std::sync::Arc;

/// An upload that is named by its hash here.
pub async fn create(State(farm): State<Arc<Farm>>, File(body): File) -> Result<Response> {
    upload(&farm, body, None).await
}

/// An upload under its hash.
pub async fn put(State(farm): State<Arc<Farm>>, Named(name): Named, File(body): File) -> Result<Response> {
    let named: BlobId = name.parse().map_err(|_| {
        let detail = format!(
            "'{}' is not a BLAKE3 hash of 64 hexadecimal digits",
            name.chars().take(80).collect::<String>()
        );
        ApiError::new(StatusCode::BAD_REQUEST, "invalid-hash", "Invalid hash", detail)
    })?;
    if let Ok(report) = farm.scene(&named).await {
        // Read, though nothing is kept: a client that is still sending would not hear the answer.
        let mut pieces = body.into_data_stream();
        let mut left = farm.rules.scene_bytes;
        while let Some(Ok(piece)) = pieces.next().await {
            left = left
                .checked_sub(piece.len() as u64)
                .ok_or_else(|| ApiError::too_large(farm.rules.scene_bytes))?;
        }
        return Ok(
            (StatusCode::OK, [(header::LOCATION, route::scene(&report.id))], Json(report)).into_response()
        );
    }
    upload(&farm, body, Some(named)).await
}

async fn upload(farm: &Farm, body: Body, named: Option<BlobId>) -> Result<Response> {
    if body.size_hint().lower() > farm.rules.scene_bytes {
        return Err(ApiError::too_large(farm.rules.scene_bytes));
    }
    let mut incoming = farm.receive().await?;
    let mut pieces = body.into_data_stream();
    while let Some(piece) = pieces.next().await {
        let written = match piece {
            Ok(piece) => incoming.write(piece).await.map_err(ApiError::from),
            Err(error) => Err(cut_off(&error.to_string())),
        };
        if let Err(error) = written {
            incoming.abort().await;
            return Err(error);
        }
    }
    let (report, novelty) = farm.take_in(incoming, named.as_ref()).await?;
    let status = if novelty == Novelty::New { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, [(header::LOCATION, route::scene(&report.id))], Json(report)).into_response())
}

/// What is in an uploaded file.
pub async fn get(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Json<SceneReport>> {
    Ok(Json(farm.scene(&id("scene", &name)?).await?))
}

/// An uploaded file's bytes.
pub async fn bytes(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    headers: HeaderMap,
) -> Result<Response> {
    let id: BlobId = id("scene", &name)?;
    let (size, stream) = farm.scene_bytes(&id).await?;
    let tag = tag::strong(id.as_str());
    if tag::none_match(&headers, id.as_str()) {
        return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response());
    }
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".parse().expect("a fixed text")),
        (header::CONTENT_LENGTH, size.into()),
        (header::ETAG, tag),
        (header::CACHE_CONTROL, "public, max-age=31536000, immutable".parse().expect("a fixed text")),
    ];
    Ok((head, Body::from_stream(stream)).into_response())
}
