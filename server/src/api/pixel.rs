//! `/v1/jobs/{id}/pixel`

use super::{
    error::{ApiError, Result},
    params::{Named, Params, id},
};
use crate::farm::Farm;
use axum::{Json, extract::State};
use ovtigre_proto::{id::JobId, pixel::Pixel};
use schemars::JsonSchema;
use serde::Deserialize;
use std::sync::Arc;

/// Which pixel.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PixelParams {
    /// Column in the frame, from 0.
    #[schemars(required)]
    x: Option<u32>,
    /// Row in the frame, from 0.
    #[schemars(required)]
    y: Option<u32>,
}

/// What is at a pixel of the frame, with its error.
pub async fn get(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    Params(params): Params<PixelParams>,
) -> Result<Json<Pixel>> {
    let id: JobId = id("job", &name)?;
    let need = |of: &str| ApiError::parameter(of, format!("'{of}' is needed: a pixel's place in the frame"));
    let (x, y) = (params.x.ok_or_else(|| need("x"))?, params.y.ok_or_else(|| need("y"))?);
    Ok(Json(farm.pixel(&id, x, y).await?))
}
