//! Room on the disk: what is kept in reserve, so that nothing is ever half written.

use super::{
    Farm,
    error::{FarmError, Result},
};
use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// Says how many bytes are free where the farm keeps its memory; `None` where nobody knows.
#[derive(Clone)]
pub struct Room(Arc<dyn Fn() -> Option<u64> + Send + Sync>);

impl Room {
    /// By `free`.
    pub fn new(free: impl Fn() -> Option<u64> + Send + Sync + 'static) -> Self {
        Self(Arc::new(free))
    }

    /// Without bounds.
    pub fn endless() -> Self {
        Self::new(|| None)
    }
}

impl fmt::Debug for Room {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Room")
    }
}

/// How full it is, as of the last look.
#[derive(Debug, Default)]
pub struct Fullness {
    reserved: AtomicBool,
    full: AtomicBool,
}

impl Farm {
    /// Looks how much room there is. Below the reserve nothing new is taken and no batch is handed out;
    /// below half of it sums are not taken either. What runs on its own goes on, and so does the farm when
    /// there is room again.
    pub(super) fn look_at_room(&self) {
        let free = (self.rules.room.0)().unwrap_or(u64::MAX);
        let before = self.fullness.reserved.swap(free < self.rules.reserve_bytes, Ordering::Relaxed);
        self.fullness.full.store(free < self.rules.reserve_bytes / 2, Ordering::Relaxed);
        match (before, self.is_full()) {
            (false, true) => tracing::error!(free, "the disk is nearly full: nothing new is taken"),
            (true, false) => tracing::info!(free, "there is room on the disk again"),
            _ => {}
        }
    }

    /// Whether the reserve is touched: no batches are handed out.
    pub fn is_full(&self) -> bool {
        self.fullness.reserved.load(Ordering::Relaxed)
    }

    /// An error where nothing new may be taken.
    pub(super) fn need_room(&self) -> Result<()> {
        if self.is_full() { Err(FarmError::Full) } else { Ok(()) }
    }

    /// An error where not even sums may be taken.
    pub(super) fn need_room_for_sums(&self) -> Result<()> {
        if self.fullness.full.load(Ordering::Relaxed) { Err(FarmError::Full) } else { Ok(()) }
    }
}
