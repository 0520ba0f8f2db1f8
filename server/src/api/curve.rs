//! `/v1/jobs/{id}/error.json`, `.csv` and `.svg`

use super::{
    error::Result,
    params::{Named, id},
};
use crate::{
    farm::Farm,
    plot::{Trace, svg as drawn},
};
use axum::{
    Json,
    extract::State,
    http::header,
    response::{IntoResponse as _, Response},
};
use ovtigre_proto::curve::{Curve, CurveRow};
use std::{fmt::Write as _, sync::Arc};

/// A job's curve.
pub async fn json(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Json<Curve>> {
    Ok(Json(farm.curve(&id("job", &name)?).await?))
}

/// Its rows as comma-separated values (RFC 4180).
pub async fn csv(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Response> {
    let curve = farm.curve(&id("job", &name)?).await?;
    Ok(([(header::CONTENT_TYPE, "text/csv; charset=utf-8; header=present")], table(&curve.rows))
        .into_response())
}

/// As a picture.
pub async fn svg(State(farm): State<Arc<Farm>>, Named(name): Named) -> Result<Response> {
    let id = id("job", &name)?;
    let (curve, status) = (farm.curve(&id).await?, farm.status(&id).await?);
    let title = format!("{}, {}", status.name, status.method);
    let text = drawn(&title, &[Trace::of(&status.method, &curve)], curve.error_target);
    let heads = [(header::CONTENT_TYPE, "image/svg+xml"), (header::CACHE_CONTROL, "no-cache")];
    Ok((heads, text).into_response())
}

fn table(rows: &[CurveRow]) -> String {
    let mut text = "samples,wall_seconds,worker_seconds,rays,rms_error,relative_error,relative_error_upper,\
         target_expected_at_seconds,doubt\r\n"
        .to_owned();
    let cell = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
    for row in rows {
        let CurveRow { samples, wall_seconds, worker_seconds, rays, .. } = row;
        let CurveRow { rms_error, relative_error, relative_error_upper, target_expected_at_seconds, .. } =
            row;
        let errors = [rms_error, relative_error, relative_error_upper, target_expected_at_seconds];
        let errors = errors.map(|x| cell(*x)).join(",");
        let doubt = row.doubt.as_ref().map_or("", |doubt| doubt.cause.name());
        write!(text, "{samples},{wall_seconds},{worker_seconds},{rays},{errors},{doubt}\r\n")
            .expect("writing to a string cannot fail");
    }
    text
}
