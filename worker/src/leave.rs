//! How a worker is told to leave.

use std::sync::Arc;
use tokio::{io::AsyncReadExt as _, sync::watch};

/// How soon to leave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Leave {
    /// Not yet.
    #[default]
    Stay,
    /// After the batch that is being rendered; the others are handed back.
    AfterBatch,
    /// At once: every batch is handed back.
    Now,
}

/// A bell that many hear: it rings ever more urgently, never less.
#[derive(Clone, Debug)]
pub struct Bell(Arc<watch::Sender<Leave>>);

impl Default for Bell {
    fn default() -> Self {
        Self(Arc::new(watch::Sender::new(Leave::Stay)))
    }
}

impl Bell {
    /// Rings; a weaker call than one before changes nothing.
    pub fn ring(&self, leave: Leave) {
        self.0.send_if_modified(|now| {
            let louder = leave > *now;
            *now = (*now).max(leave);
            louder
        });
    }

    /// How it rings now.
    pub fn heard(&self) -> Leave {
        *self.0.borrow()
    }

    /// Returns once it rings at least as urgently as `leave`.
    pub async fn wait(&self, leave: Leave) {
        let mut receiver = self.0.subscribe();
        receiver.wait_for(|now| *now >= leave).await.expect("this bell holds the sender");
    }

    /// The first SIGINT, SIGTERM or SIGHUP of the process rings for `first`, the second for
    /// [`Leave::Now`].
    pub async fn ring_on_signals(self, first: Leave) {
        loop {
            signal().await;
            let urgency = if self.heard() == Leave::Stay { first } else { Leave::Now };
            // First: a log that cannot be written must not keep anybody from leaving.
            self.ring(urgency);
            tracing::info!(?urgency, "told to leave");
        }
    }

    /// Rings for [`Leave::Now`] when standard input ends: whoever started this process is gone.
    pub async fn ring_when_stdin_closes(self) {
        let mut stdin = tokio::io::stdin();
        let mut ignored = [0; 256];
        while stdin.read(&mut ignored).await.is_ok_and(|count| count > 0) {}
        self.ring(Leave::Now);
    }
}

/// Returns at the next SIGINT, SIGTERM or SIGHUP: a terminal that is closed asks like Ctrl-C in it.
#[cfg(unix)]
async fn signal() {
    use tokio::signal::unix::{SignalKind, signal};
    let (Ok(mut interrupt), Ok(mut terminate), Ok(mut hangup)) =
        (signal(SignalKind::interrupt()), signal(SignalKind::terminate()), signal(SignalKind::hangup()))
    else {
        return std::future::pending().await;
    };
    tokio::select! {
        _ = interrupt.recv() => {}
        _ = terminate.recv() => {}
        _ = hangup.recv() => {}
    }
}

#[cfg(not(unix))]
async fn signal() {
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending().await
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_bell_never_rings_less_urgently() {
        let bell = Bell::default();
        bell.ring(Leave::Now);
        bell.ring(Leave::AfterBatch);
        assert_eq!(bell.heard(), Leave::Now);
        bell.wait(Leave::AfterBatch).await;
    }
}
