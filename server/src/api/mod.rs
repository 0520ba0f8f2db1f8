//! Doors: HTTP to farm and back, no rules.
