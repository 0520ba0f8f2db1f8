//! Names in a path and parameters of a query.

use super::error::ApiError;
use axum::{
    extract::{FromRequestParts, Path, Query},
    http::{StatusCode, request::Parts},
};
use schemars::JsonSchema;
use serde::{Deserialize, de::DeserializeOwned};
use std::str::FromStr;

/// The one name in a path.
#[derive(Debug)]
pub struct Named(pub String);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        Path::from_request_parts(parts, state).await.map(|Path(name)| Self(name)).map_err(|error| {
            let detail = format!("the path cannot be read: {}", error.body_text());
            ApiError::new(StatusCode::BAD_REQUEST, "invalid-path", "Invalid path", detail)
        })
    }
}

/// A query as what it says.
#[derive(Debug)]
pub struct Params<T>(pub T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Params<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, ApiError> {
        Query::try_from_uri(&parts.uri).map(|Query(params)| Self(params)).map_err(|error| {
            let text = error.body_text();
            let detail = text.rsplit_once("query string: ").map_or(&*text, |(_, detail)| detail);
            let name = detail.split([':', '`']).next().unwrap_or("").trim();
            ApiError::parameter(if name.contains(' ') { "" } else { name }, detail)
        })
    }
}

/// Where a page of a list begins, and how long it is.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PageParams {
    /// Items at most.
    #[schemars(range(min = 1, max = 500))]
    pub limit: Option<u32>,
    /// `next` of the page before.
    #[schemars(regex(pattern = r"^[0-9]{1,18}$"))]
    pub cursor: Option<String>,
}

/// Where a page begins, from the `next` of the one before.
pub fn cursor(text: Option<&str>) -> Result<Option<i64>, ApiError> {
    let parse = |text: &str| {
        text.parse().map_err(|_| ApiError::parameter("cursor", format!("'{text}' is no page's 'next'")))
    };
    text.map(parse).transpose()
}

/// Items of a page.
pub fn limit(limit: Option<u32>) -> Result<u32, ApiError> {
    use crate::farm::status::{PAGE, PAGE_MAX};
    match limit.unwrap_or(PAGE) {
        n if (1..=PAGE_MAX).contains(&n) => Ok(n),
        n => Err(ApiError::parameter("limit", format!("{n} is not 1 to {PAGE_MAX}"))),
    }
}

/// A name in a path; a text that can name nothing is not found.
pub fn id<T: FromStr>(what: &str, text: &str) -> Result<T, ApiError> {
    text.parse().map_err(|_| ApiError::not_found(what, text))
}
