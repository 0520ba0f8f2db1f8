//! `/v1/scenes`

use super::{
    body::{File, cut_off},
    error::{ApiError, Result},
    params::{Named, id},
    tag,
};
use crate::farm::{
    Farm,
    parts::{Received, Span},
    scene::Novelty,
};
use axum::{
    Json,
    body::{Body, HttpBody as _},
    extract::State,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse as _, Response},
};
use futures::StreamExt as _;
use ovtigre_proto::{id::BlobId, route, scene::SceneReport};
use std::sync::Arc;

/// An upload that is named by its hash here.
pub async fn create(State(farm): State<Arc<Farm>>, File(body): File) -> Result<Response> {
    upload(&farm, body, None).await
}

/// An upload under its hash: whole, or a part of it where there is a `Content-Range`.
pub async fn put(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    headers: HeaderMap,
    File(body): File,
) -> Result<Response> {
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
    match headers.get(header::CONTENT_RANGE).filter(|value| !value.is_empty()) {
        None => upload(&farm, body, Some(named)).await,
        Some(range) => part(&farm, body, &named, content_range(range)?).await,
    }
}

/// What a `Content-Range` says.
enum ContentRange {
    /// A part comes along.
    Part(Span),
    /// Nothing comes along: how much of so many bytes is there?
    Ask(u64),
}

fn content_range(value: &HeaderValue) -> Result<ContentRange> {
    let numbers = || {
        let (range, whole) = value.to_str().ok()?.trim().strip_prefix("bytes ")?.split_once('/')?;
        let whole: u64 = whole.trim().parse().ok()?;
        if range.trim() == "*" {
            return Some((None, whole));
        }
        let (first, last) = range.split_once('-')?;
        Some((Some((first.trim().parse().ok()?, last.trim().parse().ok()?)), whole))
    };
    match numbers() {
        None => {
            let detail =
                "Content-Range is 'bytes FIRST-LAST/LENGTH', or 'bytes */LENGTH' to ask what is there";
            Err(ApiError::header(detail.to_owned()))
        }
        Some((None, whole)) => Ok(ContentRange::Ask(whole)),
        Some((Some((from, last)), whole)) if from <= last && last < whole => {
            Ok(ContentRange::Part(Span { from, to: last + 1, whole }))
        }
        Some((Some((from, last)), whole)) => {
            let detail = format!("bytes {from} to {last} are no part of {whole} bytes");
            let (status, title) = (StatusCode::RANGE_NOT_SATISFIABLE, "Range not satisfiable");
            Err(ApiError::new(status, "range-not-satisfiable", title, detail))
        }
    }
}

/// A part of a file; told is how much is there, or, when all is there, what is in it.
async fn part(farm: &Farm, body: Body, named: &BlobId, range: ContentRange) -> Result<Response> {
    let span = match range {
        ContentRange::Part(span) => span,
        ContentRange::Ask(whole) => {
            return Ok((StatusCode::ACCEPTED, Json(farm.received(named, whole).await?)).into_response());
        }
    };
    let mut incoming = farm.receive_part(named, span).await?;
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
    match farm.take_part(named, incoming).await? {
        Received::Some(received) => Ok((StatusCode::ACCEPTED, Json(received)).into_response()),
        Received::All(report, novelty) => Ok(reported(*report, novelty)),
    }
}

fn reported(report: SceneReport, novelty: Novelty) -> Response {
    let status = if novelty == Novelty::New { StatusCode::CREATED } else { StatusCode::OK };
    (status, [(header::LOCATION, route::scene(&report.id))], Json(report)).into_response()
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
    Ok(reported(report, novelty))
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
