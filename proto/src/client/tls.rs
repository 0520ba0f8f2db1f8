//! What clients encrypt with.

/// Lets all clients of this process encrypt with ring, unless something else was chosen before. Called before
/// the first is made.
pub fn provide() {
    // An error says that somebody was faster: then there is one.
    let _ = rustls::crypto::ring::default_provider().install_default();
}
