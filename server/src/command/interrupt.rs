//! A user who wants a command to end.

use ovtigre_worker::leave::{Bell, Leave};

/// What Ctrl-C means: once, stop and keep what is there; twice, leave now.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interrupt(Bell);

impl Interrupt {
    /// Listens from now on, instead of ending the process.
    pub(crate) fn listen() -> Self {
        let bell = Bell::default();
        tokio::spawn(bell.clone().ring_on_signals(Leave::AfterBatch));
        Self(bell)
    }

    /// Returns after the first Ctrl-C, SIGTERM or SIGHUP.
    pub(crate) async fn once(&self) {
        self.0.wait(Leave::AfterBatch).await;
    }

    /// Returns after the second.
    pub(crate) async fn twice(&self) {
        self.0.wait(Leave::Now).await;
    }
}
