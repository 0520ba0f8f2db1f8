//! `/v1/jobs/{id}/error.json` and `.csv`

use super::{
    error::Result,
    params::{Named, id},
};
use crate::farm::Farm;
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

fn table(rows: &[CurveRow]) -> String {
    let mut text =
        "samples,wall_seconds,worker_seconds,rays,rms_error,relative_error,relative_error_upper\r\n"
            .to_owned();
    let cell = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
    for row in rows {
        let CurveRow { samples, wall_seconds, worker_seconds, rays, .. } = row;
        let errors = [row.rms_error, row.relative_error, row.relative_error_upper].map(cell).join(",");
        write!(text, "{samples},{wall_seconds},{worker_seconds},{rays},{errors}\r\n")
            .expect("writing to a string cannot fail");
    }
    text
}
