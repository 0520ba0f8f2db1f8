//! Jobs, leases and commits, changed together or not at all.
