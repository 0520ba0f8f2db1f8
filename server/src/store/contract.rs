//! What every store does: one suite, run on each.
