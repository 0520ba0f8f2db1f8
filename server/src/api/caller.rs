//! `/v1/caller`

use super::guard::Caller;
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::Serialize;

/// Who asks.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CallerStatus {
    /// What the token may do: `read` looks, `submit` sends and changes jobs, too, `admin` does everything, and `work` is a worker's.
    /// A farm without tokens lets everybody do everything.
    #[schemars(extend("enum" = ["admin", "submit", "read", "work"]))]
    role: &'static str,
}

/// What the caller may do.
pub async fn get(Extension(caller): Extension<Caller>) -> Json<CallerStatus> {
    Json(CallerStatus { role: caller.role.name() })
}
