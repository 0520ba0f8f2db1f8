//! Farms of a few lines, for tests.

use super::farm::Client;
use axum::Router;
use tokio::net::TcpListener;

/// Serves `router` on a free port until the test's runtime ends; a client of it.
pub(super) async fn serve(router: Router) -> Client {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let client = Client::new(&listener.local_addr().unwrap().to_string(), 1).unwrap();
    tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
    client
}
