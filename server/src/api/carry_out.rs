//! Calls that change something are carried out to their end, even if the caller hangs up.

use axum::{
    extract::Request,
    http::{Method, StatusCode},
    middleware::Next,
    response::{IntoResponse as _, Response},
};

/// A handler is dropped where it stands when its caller's connection ends: a worker killed while it
/// brings a sum would leave a batch in the store that is never appended. So each call that is not
/// only a question runs as a task of its own.
pub async fn carry_out(request: Request, next: Next) -> Response {
    if matches!(*request.method(), Method::GET | Method::HEAD) {
        return next.run(request).await;
    }
    match tokio::spawn(next.run(request)).await {
        Ok(response) => response,
        Err(error) => {
            tracing::error!(%error, "a request failed");
            StatusCode::INTERNAL_SERVER_ERROR.into_response()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::{Router, body::Body, routing::any};
    use std::{
        sync::{
            Arc,
            atomic::{AtomicU32, Ordering},
        },
        time::Duration,
    };
    use tower::ServiceExt as _;

    #[tokio::test]
    async fn a_caller_that_hangs_up_changes_nothing_but_questions() {
        for (method, carried_out) in [(Method::PUT, 1), (Method::POST, 1), (Method::GET, 0)] {
            let done = Arc::new(AtomicU32::new(0));
            let counter = Arc::clone(&done);
            let slow = any(move || async move {
                tokio::time::sleep(Duration::from_millis(100)).await;
                counter.fetch_add(1, Ordering::SeqCst);
            });
            let router = Router::new().route("/", slow).layer(axum::middleware::from_fn(carry_out));
            let request = Request::builder().method(method).uri("/").body(Body::empty()).unwrap();
            let call = router.oneshot(request);
            assert!(tokio::time::timeout(Duration::from_millis(20), call).await.is_err());
            tokio::time::sleep(Duration::from_millis(400)).await;
            assert_eq!(done.load(Ordering::SeqCst), carried_out);
        }
    }
}
