//! Errors as problem documents (RFC 9457).

use crate::{
    blobs::BlobError,
    farm::error::{FarmError, fault},
    store::error::StoreError,
};
use axum::{
    http::{HeaderValue, Method, StatusCode, Uri, header},
    response::{IntoResponse, Response},
};
use ovtigre_proto::problem::{Fault, MEDIA_TYPE, Problem};

/// An answer that says what went wrong.
#[derive(Debug)]
pub struct ApiError(Box<Problem>);

/// What a door answers.
pub type Result<T> = std::result::Result<T, ApiError>;

impl ApiError {
    /// A problem of the stable kind `/problems/{kind}`.
    pub fn new(status: StatusCode, kind: &str, title: &str, detail: impl Into<String>) -> Self {
        Self(Box::new(Problem {
            kind: format!("/problems/{kind}"),
            title: title.to_owned(),
            status: status.as_u16(),
            detail: detail.into(),
            errors: Vec::new(),
        }))
    }

    /// With the places in a document that are at fault.
    #[must_use]
    pub fn at(mut self, errors: Vec<Fault>) -> Self {
        self.0.errors = errors;
        self
    }

    /// A parameter of the query that cannot be understood.
    pub fn parameter(name: &str, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        Self::new(StatusCode::BAD_REQUEST, "invalid-parameter", "Invalid parameter", detail.clone())
            .at(vec![fault(format!("?{name}"), detail)])
    }

    /// A cursor that is none, or not one of the order that it is sent with.
    pub fn cursor(text: &str) -> Self {
        let text: String = text.chars().take(80).collect();
        let detail = format!("'{text}' is no page's 'next' in this order");
        if !text.starts_with(|c: char| c.is_ascii_digit()) {
            return Self::parameter("cursor", detail);
        }
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "invalid-cursor", "Invalid cursor", detail.clone())
            .at(vec![fault("?cursor".to_owned(), detail)])
    }

    /// A header that cannot be understood.
    pub fn header(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "invalid-header", "Invalid header", detail)
    }

    /// A body of more than `limit` bytes.
    pub fn too_large(limit: u64) -> Self {
        let detail = format!("the body is larger than the {limit} bytes that are taken here");
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, "too-large", "Too large", detail)
    }

    /// Nothing of that name.
    pub fn not_found(what: &str, id: &str) -> Self {
        let id: String = id.chars().take(80).collect();
        Self::new(StatusCode::NOT_FOUND, "not-found", "Not found", format!("there is no {what} '{id}'"))
    }
}

impl From<FarmError> for ApiError {
    fn from(error: FarmError) -> Self {
        let detail = error.to_string();
        let of = |status, kind, title| Self::new(status, kind, title, detail.clone());
        match error {
            FarmError::NotFound { .. } => of(StatusCode::NOT_FOUND, "not-found", "Not found"),
            FarmError::Request(faults) | FarmError::Patch(faults) => {
                of(StatusCode::UNPROCESSABLE_ENTITY, "invalid-job", "Invalid job").at(faults)
            }
            FarmError::Worker(faults) => {
                of(StatusCode::UNPROCESSABLE_ENTITY, "invalid-worker", "Invalid worker").at(faults)
            }
            FarmError::Scene(faults) => {
                of(StatusCode::UNPROCESSABLE_ENTITY, "invalid-scene", "Invalid scene").at(faults)
            }
            FarmError::HashMismatch { .. } => {
                of(StatusCode::UNPROCESSABLE_ENTITY, "hash-mismatch", "Other bytes than named")
            }
            FarmError::TooLarge { .. } => of(StatusCode::PAYLOAD_TOO_LARGE, "too-large", "Too large"),
            FarmError::Sum(_) => of(StatusCode::UNPROCESSABLE_ENTITY, "invalid-sum", "Invalid sum"),
            FarmError::Over { .. } => of(StatusCode::CONFLICT, "job-over", "The job is over"),
            FarmError::Version { .. } => {
                of(StatusCode::PRECONDITION_FAILED, "changed-since", "Changed since")
            }
            FarmError::KeyTaken => {
                of(StatusCode::UNPROCESSABLE_ENTITY, "idempotency-key-taken", "Idempotency key taken")
            }
            FarmError::NoPicture(_) => of(StatusCode::NOT_FOUND, "no-picture-yet", "No picture yet"),
            FarmError::NeverPicture(_) => of(StatusCode::NOT_FOUND, "no-picture", "No picture"),
            FarmError::NoLayer(_) => of(StatusCode::NOT_FOUND, "no-layer", "No such layer"),
            FarmError::NoPixel { .. } => of(StatusCode::NOT_FOUND, "no-pixel", "No such pixel"),
            FarmError::TooManyJobs { .. } => {
                of(StatusCode::TOO_MANY_REQUESTS, "too-many-jobs", "Too many jobs")
            }
            FarmError::BeingRemoved(_) => {
                of(StatusCode::SERVICE_UNAVAILABLE, "being-removed", "Being removed")
            }
            FarmError::Full | FarmError::Blob(BlobError::Full) => {
                of(StatusCode::INSUFFICIENT_STORAGE, "storage-full", "Storage full")
            }
            FarmError::Stopping | FarmError::Store(StoreError::Closed) => {
                of(StatusCode::SERVICE_UNAVAILABLE, "stopping", "Stopping")
            }
            FarmError::Store(_) | FarmError::Blob(_) | FarmError::Damaged(_) | FarmError::Messenger(_) => {
                tracing::error!(error = detail, "a request failed");
                of(StatusCode::INTERNAL_SERVER_ERROR, "internal", "Internal error")
            }
        }
    }
}

impl From<BlobError> for ApiError {
    fn from(error: BlobError) -> Self {
        FarmError::from(error).into()
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.0.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let body = serde_json::to_vec(&self.0).unwrap_or_default();
        let mut response = (status, [(header::CONTENT_TYPE, MEDIA_TYPE)], body).into_response();
        let later = matches!(
            self.0.kind.as_str(),
            "/problems/no-picture-yet"
                | "/problems/stopping"
                | "/problems/being-removed"
                | "/problems/too-many-requests"
                | "/problems/too-many-jobs"
        );
        if later {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
        }
        response
    }
}

/// No door there.
pub async fn no_route(uri: Uri) -> ApiError {
    let path: String = uri.path().chars().take(200).collect();
    let detail = format!("nothing is at '{path}'");
    ApiError::new(StatusCode::NOT_FOUND, "not-found", "Not found", detail)
}

/// A door that does not do that.
pub async fn no_method(method: Method, uri: Uri) -> ApiError {
    let path: String = uri.path().chars().take(200).collect();
    let detail = format!("{method} is not for '{path}'");
    ApiError::new(StatusCode::METHOD_NOT_ALLOWED, "method-not-allowed", "Method not allowed", detail)
}
