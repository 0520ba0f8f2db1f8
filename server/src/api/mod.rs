//! Doors: HTTP to farm and back, no rules.

pub mod body;
pub mod caller;
pub mod carry_out;
pub mod curve;
pub mod error;
pub mod events;
pub mod guard;
mod heads;
pub mod health;
pub mod image;
pub mod jobs;
pub mod leases;
pub mod openapi;
pub mod page;
pub mod params;
pub mod pixel;
pub mod range;
pub mod roles;
pub mod scenes;
pub mod tag;
pub mod workers;

#[cfg(test)]
mod tests;

use crate::farm::Farm;
use axum::{
    Router, middleware,
    routing::{get, post, put},
};
use guard::{Guard, Guarding};
use std::sync::Arc;

/// All doors of a farm; who is let in says `guarding`.
pub fn router(farm: Arc<Farm>, guarding: Guarding) -> Router {
    let guard = Arc::new(Guard::new(Arc::clone(&farm), guarding));
    Router::new()
        .route("/v1/scenes", post(scenes::create))
        .route("/v1/scenes/{id}", put(scenes::put).get(scenes::get))
        .route("/v1/scenes/{id}/bytes", get(scenes::bytes))
        .route("/v1/jobs", post(jobs::create).get(jobs::list))
        .route("/v1/jobs/{id}", get(jobs::get).patch(jobs::patch).delete(jobs::delete))
        .route("/v1/jobs/{id}/events", get(events::stream))
        .route("/v1/jobs/{id}/image.exr", get(image::exr))
        .route("/v1/jobs/{id}/image.png", get(image::png))
        .route("/v1/jobs/{id}/pixel", get(pixel::get))
        .route("/v1/jobs/{id}/error.json", get(curve::json))
        .route("/v1/jobs/{id}/error.csv", get(curve::csv))
        .route("/v1/jobs/{id}/error.svg", get(curve::svg))
        .route("/v1/workers", post(workers::join).get(workers::list))
        .route("/v1/workers/{id}", get(workers::get).delete(workers::drain))
        .route("/v1/workers/{id}/exchange", post(workers::exchange))
        .route("/v1/leases/{id}/sum", put(leases::sum).post(leases::handed))
        .route("/v1/leases/{id}/failure", post(leases::failure))
        .route("/v1/scaling", get(health::scaling))
        .route("/v1/caller", get(caller::get))
        .route("/healthz", get(health::alive))
        .route("/readyz", get(health::ready))
        .route("/metrics", get(health::metrics))
        .route("/openapi.json", get(page::openapi))
        .route("/docs", get(page::docs))
        .route("/", get(page::index))
        .merge(page::files())
        .fallback(error::no_route)
        .method_not_allowed_fallback(error::no_method)
        .layer(middleware::from_fn(carry_out::carry_out))
        .layer(middleware::from_fn_with_state(guard, guard::guard))
        .with_state(farm)
}
