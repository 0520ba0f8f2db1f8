//! Which samples, their sums, partial EXR, merging, error, developing.
