//! What clients encrypt with.

use reqwest::{Client, ClientBuilder, Error};

/// Lets all clients of this process encrypt with ring, unless something else was chosen before. Called before
/// the first is made.
pub fn provide() {
    // An error says that somebody was faster: then there is one.
    let _ = rustls::crypto::ring::default_provider().install_default();
}

/// A client as `builder` says. On a machine that trusts no certificate at all it still speaks to farms that do not
/// encrypt.
pub(crate) fn client(builder: impl Fn() -> ClientBuilder) -> Result<Client, Error> {
    provide();
    builder().build().or_else(|_| builder().tls_certs_only([]).build())
}
