//! How far a batch is, and whether it should go on.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Shared between those who render a batch and those who wait for it.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicU64,
    all: AtomicU64,
    stop: AtomicBool,
}

impl Progress {
    /// Nothing done, not stopped.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the render to end soon, without a sum.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Part of the pixels done, 0 to 1.
    pub fn fraction(&self) -> f64 {
        match self.all.load(Ordering::Relaxed) {
            0 => 0.0,
            all => self.done.load(Ordering::Relaxed) as f64 / all as f64,
        }
    }

    pub(super) fn begin(&self, pixels: u64) {
        self.done.store(0, Ordering::Relaxed);
        self.all.store(pixels, Ordering::Relaxed);
    }

    pub(super) fn advance(&self, pixels: u64) {
        self.done.fetch_add(pixels, Ordering::Relaxed);
    }
}
