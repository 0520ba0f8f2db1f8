//! `/v1/jobs/{id}/image.exr` and `.png`

use super::{
    error::{ApiError, Result},
    params::{Named, Params, id},
    range::{Wanted, wanted},
    tag,
};
use crate::farm::{
    Farm,
    error::FarmError,
    picture::{ExrFile, LayerName},
};
use axum::{
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse as _, Response},
};
use ovtigre_core::film::{develop::Develop, size::Size};
use ovtigre_proto::id::JobId;
use schemars::JsonSchema;
use serde::Deserialize;
use std::sync::Arc;

/// Of a picture that the pilot made, before there is any of the job: its size, before it was enlarged.
const PREVIEW: HeaderName = HeaderName::from_static("ovtigre-preview");
/// Stops of exposure, at most.
const STOPS_MAX: f32 = 64.0;

/// The merged picture so far.
pub async fn exr(State(farm): State<Arc<Farm>>, Named(name): Named, headers: HeaderMap) -> Result<Response> {
    let id: JobId = id("job", &name)?;
    let waits = wait_for_news(&farm, &id, &headers, None).await?;
    if let Some(manifest) = farm.manifest(&id).await?.filter(|m| tag::none_match(&headers, m)) {
        return Ok(answer(StatusCode::NOT_MODIFIED, &manifest, waits, &[], Body::empty()));
    }
    let (manifest, file) = farm.exr(&id).await?;
    let size = file.size();
    let kind = (header::CONTENT_TYPE, HeaderValue::from_static("image/x-exr"));
    let ranges = (header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    let (status, span, body) = match wanted(&headers, size, &manifest) {
        Wanted::Nothing => {
            let detail = format!("the picture has {size} bytes");
            let title = "Range not satisfiable";
            let problem =
                ApiError::new(StatusCode::RANGE_NOT_SATISFIABLE, "range-not-satisfiable", title, detail);
            let mut response = problem.into_response();
            let span = HeaderValue::from_str(&format!("bytes */{size}")).expect("digits");
            response.headers_mut().insert(header::CONTENT_RANGE, span);
            return Ok(response);
        }
        Wanted::Part(range) => {
            let span = HeaderValue::from_str(&format!("bytes {}-{}/{size}", range.start, range.end - 1));
            let bytes = farm.exr_range(&file, range).await?;
            (StatusCode::PARTIAL_CONTENT, Some((header::CONTENT_RANGE, span.expect("digits"))), bytes.into())
        }
        Wanted::Whole => {
            let body = match file {
                ExrFile::Memory(bytes) => bytes.into(),
                ExrFile::Kept { name, .. } => Body::from_stream(farm.exr_stream(&name).await?),
            };
            (StatusCode::OK, Some((header::CONTENT_LENGTH, size.into())), body)
        }
    };
    let heads: Vec<_> = [kind, ranges].into_iter().chain(span).collect();
    Ok(answer(status, &manifest, waits, &heads, body))
}

/// How the picture is developed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PngParams {
    /// `picture`, `error`, a layer's name, or that with `.error` behind it.
    layer: Option<String>,
    /// Stops: the light is multiplied by 2 to their power.
    #[schemars(range(min = -64, max = 64))]
    exposure: Option<f32>,
    /// Columns at most.
    #[schemars(range(min = 1, max = 32768))]
    width: Option<u32>,
}

/// The merged picture so far, developed. Before there is any of it, and unless a wait is asked for, the picture of the pilot.
pub async fn png(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    Params(params): Params<PngParams>,
    headers: HeaderMap,
) -> Result<Response> {
    let id: JobId = id("job", &name)?;
    let exposure = params.exposure.unwrap_or(0.0);
    if !(-STOPS_MAX..=STOPS_MAX).contains(&exposure) {
        return Err(ApiError::parameter(
            "exposure",
            format!("{exposure} is not -{STOPS_MAX} to {STOPS_MAX} stops"),
        ));
    }
    if let Some(width) = params.width.filter(|w| !(1..=Size::SIDE_MAX).contains(w)) {
        return Err(ApiError::parameter("width", format!("{width} is not 1 to {} pixels", Size::SIDE_MAX)));
    }
    let layer = LayerName::parse(params.layer.as_deref());
    let develop = Develop { exposure, width: params.width };
    let suffix = format!(".{}", &blake3::hash(format!("{layer:?} {develop:?}").as_bytes()).to_hex()[..16]);
    let waits = wait_for_news(&farm, &id, &headers, Some(&suffix)).await?;
    if let Some(manifest) = farm.manifest(&id).await? {
        let tag = manifest + &suffix;
        if tag::none_match(&headers, &tag) {
            return Ok(answer(StatusCode::NOT_MODIFIED, &tag, waits, &[], Body::empty()));
        }
    }
    let kind = (header::CONTENT_TYPE, HeaderValue::from_static("image/png"));
    let made = farm.png(&id, layer.clone(), develop).await;
    if let (Err(FarmError::NoPicture(_)), Waited::No) = (&made, waits)
        && let Some((size, bytes)) = farm.sketch(&id, &layer, develop).await?
    {
        let of = HeaderValue::from_str(&size.to_string()).expect("digits");
        let heads = [kind, (PREVIEW, of)];
        return Ok(answer(StatusCode::OK, &format!("preview{suffix}"), waits, &heads, bytes.into()));
    }
    let (manifest, bytes) = made?;
    Ok(answer(StatusCode::OK, &(manifest + &suffix), waits, &[kind], bytes.into()))
}

/// Whether a wait was asked for and granted.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Waited {
    Yes,
    No,
}

/// `Prefer: wait=N`: waits for another version than the one that the client has, or for the first.
async fn wait_for_news(
    farm: &Farm,
    id: &JobId,
    headers: &HeaderMap,
    suffix: Option<&str>,
) -> std::result::Result<Waited, FarmError> {
    let manifest = farm.manifest(id).await?;
    let Some(time) = tag::wait(headers) else { return Ok(Waited::No) };
    let has = |m: &String| tag::none_match(headers, &format!("{m}{}", suffix.unwrap_or("")));
    if manifest.as_ref().is_none_or(has) {
        farm.await_change(id, manifest.as_deref(), time).await?;
    }
    Ok(Waited::Yes)
}

fn answer(
    status: StatusCode,
    tag: &str,
    waited: Waited,
    heads: &[(HeaderName, HeaderValue)],
    body: Body,
) -> Response {
    let mut response = (status, body).into_response();
    let headers = response.headers_mut();
    headers.insert(header::ETAG, tag::strong(tag));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if waited == Waited::Yes {
        headers.insert("preference-applied", HeaderValue::from_static("wait"));
    }
    headers.extend(heads.iter().cloned());
    response
}
