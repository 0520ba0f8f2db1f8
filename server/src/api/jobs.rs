//! `/v1/jobs`

use super::{
    body::Document,
    error::{ApiError, Result},
    guard::Caller,
    params::{Named, Params, id, limit},
    tag,
};
use crate::{
    farm::{Farm, error::FarmError, spec::JobSpec},
    store::list::{JobFilter, Key, Order, Place, Way},
};
use axum::{
    Extension, Json,
    extract::State,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse as _, Response},
};
use ovtigre_core::{film::size::Region, render::pilot::report::Pilot, settings::Settings};
use ovtigre_proto::{
    id::JobId,
    job::{JobPatch, JobRequest},
    route,
    status::{JobState, JobStatus},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Longest text that jobs are looked for by, in bytes.
const TEXT_MAX: usize = 200;
/// What is kept is asked for again before it is used.
const NO_CACHE: HeaderValue = HeaderValue::from_static("no-cache");

/// How a job is sent.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CreateParams {
    #[serde(default)]
    dry_run: bool,
}

/// What a job would be.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DryRun {
    settings: Settings,
    region: Region,
    samples_asked: u32,
    batches_asked: u64,
    method: &'static str,
    method_reason: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pilot: Option<Pilot>,
    paths: String,
    warnings: Vec<String>,
}

impl From<JobSpec> for DryRun {
    fn from(spec: JobSpec) -> Self {
        Self {
            region: spec.region,
            samples_asked: spec.samples_asked(),
            batches_asked: spec.schedule().batches(),
            method: spec.settings.method.name(),
            paths: spec.settings.paths.clone(),
            settings: spec.settings,
            method_reason: spec.method_reason,
            pilot: spec.pilot,
            warnings: spec.warnings,
        }
    }
}

/// A job is sent.
pub async fn create(
    State(farm): State<Arc<Farm>>,
    Extension(caller): Extension<Caller>,
    Params(params): Params<CreateParams>,
    headers: HeaderMap,
    Document(request): Document<JobRequest>,
) -> Result<Response> {
    if params.dry_run {
        return Ok(Json(DryRun::from(farm.check(request).await?)).into_response());
    }
    let key = match headers.get("idempotency-key").map(|value| value.to_str()) {
        None => None,
        Some(Ok(key)) => Some(key.to_owned()),
        Some(Err(_)) => return Err(ApiError::header("Idempotency-Key is not ASCII text")),
    };
    let status = farm.submit(request, key, caller.token).await?;
    let location = [(header::LOCATION, route::job(&status.id))];
    Ok((StatusCode::ACCEPTED, location, with_tag(status)).into_response())
}

/// An order of jobs, downward after a minus.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
enum Sort {
    #[serde(rename = "created")]
    Created,
    #[default]
    #[serde(rename = "-created")]
    CreatedDown,
    #[serde(rename = "name")]
    Name,
    #[serde(rename = "-name")]
    NameDown,
    #[serde(rename = "state")]
    State,
    #[serde(rename = "-state")]
    StateDown,
    #[serde(rename = "priority")]
    Priority,
    #[serde(rename = "-priority")]
    PriorityDown,
    #[serde(rename = "error")]
    Error,
    #[serde(rename = "-error")]
    ErrorDown,
    #[serde(rename = "progress")]
    Progress,
    #[serde(rename = "-progress")]
    ProgressDown,
    #[serde(rename = "eta")]
    Eta,
    #[serde(rename = "-eta")]
    EtaDown,
    #[serde(rename = "workers")]
    Workers,
    #[serde(rename = "-workers")]
    WorkersDown,
}

impl From<Sort> for Order {
    fn from(sort: Sort) -> Self {
        let (by, way) = match sort {
            Sort::Created => (Key::Created, Way::Up),
            Sort::CreatedDown => (Key::Created, Way::Down),
            Sort::Name => (Key::Name, Way::Up),
            Sort::NameDown => (Key::Name, Way::Down),
            Sort::State => (Key::State, Way::Up),
            Sort::StateDown => (Key::State, Way::Down),
            Sort::Priority => (Key::Priority, Way::Up),
            Sort::PriorityDown => (Key::Priority, Way::Down),
            Sort::Error => (Key::Error, Way::Up),
            Sort::ErrorDown => (Key::Error, Way::Down),
            Sort::Progress => (Key::Progress, Way::Up),
            Sort::ProgressDown => (Key::Progress, Way::Down),
            Sort::Eta => (Key::Eta, Way::Up),
            Sort::EtaDown => (Key::Eta, Way::Down),
            Sort::Workers => (Key::Workers, Way::Up),
            Sort::WorkersDown => (Key::Workers, Way::Down),
        };
        Self { by, way }
    }
}

/// Which jobs are listed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListParams {
    /// Only those in this state.
    state: Option<JobState>,
    /// Only those whose name or id has this in it.
    #[schemars(length(max = 200))]
    text: Option<String>,
    /// What they go by, `-created` where it is not said: the newest first. Names go by their letters, A to Z like a to z, states
    /// by their names; a minus turns the order round. Jobs that are alike go by when they came, the same way. `error` is the relative
    /// error at the latest checkpoint, `progress` the part of the samples that is drawn, `eta` when a running job is expected to be
    /// done, `workers` how many hold batches of it; without an error or an expected end it is as if that were endless. These four
    /// follow a job about once a second, so that one may be met on two pages, or on none, while it is rendered.
    sort: Option<Sort>,
    /// Items at most.
    #[schemars(range(min = 1, max = 500))]
    limit: Option<u32>,
    /// `next` of the page before, in the same order.
    #[schemars(regex(pattern = r"^[0-9]{1,18}(\.([0-9a-f]{2}){0,200})?$"))]
    cursor: Option<String>,
}

/// A page of jobs. The tag is that of the answer's bytes, for those who ask again and again.
pub async fn list(
    State(farm): State<Arc<Farm>>,
    Params(params): Params<ListParams>,
    headers: HeaderMap,
) -> Result<Response> {
    let ListParams { state, text, sort, cursor, .. } = params;
    if text.as_ref().is_some_and(|text| text.len() > TEXT_MAX) {
        return Err(ApiError::parameter("text", format!("the text has more than {TEXT_MAX} bytes")));
    }
    let text = text.filter(|text| !text.is_empty());
    let order = Order::from(sort.unwrap_or_default());
    let place = |text: String| Place::parse(&text, order.by).ok_or_else(|| ApiError::cursor(&text));
    let after = cursor.map(place).transpose()?;
    let page = farm.jobs(JobFilter { state, text, order, after, limit: limit(params.limit)? }).await?;
    let body = serde_json::to_vec(&page).map_err(|e| FarmError::Damaged(e.to_string()))?;
    let name = blake3::hash(&body).to_hex();
    let head = [(header::ETAG, tag::strong(&name)), (header::CACHE_CONTROL, NO_CACHE)];
    if tag::none_match(&headers, &name) {
        return Ok((StatusCode::NOT_MODIFIED, head).into_response());
    }
    Ok((head, [(header::CONTENT_TYPE, "application/json")], body).into_response())
}

/// A job.
pub async fn get(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Response> {
    Ok(with_tag(farm.status(&id("job", &name)?).await?))
}

/// A job is changed.
pub async fn patch(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    headers: HeaderMap,
    Document(patch): Document<JobPatch>,
) -> Result<Response> {
    let id: JobId = id("job", &name)?;
    let versions = tag::match_versions(&headers)?;
    Ok(with_tag(farm.patch(&id, &patch, versions).await?))
}

/// How a job is deleted.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DeleteParams {
    #[serde(default)]
    purge: bool,
}

/// A job is cancelled, or removed with its files.
pub async fn delete(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    Params(params): Params<DeleteParams>,
) -> Result<Response> {
    let id: JobId = id("job", &name)?;
    if params.purge {
        farm.purge(&id).await?;
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    farm.cancel(&id).await?;
    Ok(with_tag(farm.status(&id).await?))
}

/// The tag is that of what a client can change: progress does not change it.
fn with_tag(status: JobStatus) -> Response {
    ([(header::ETAG, tag::strong(&status.version.to_string()))], Json(status)).into_response()
}
