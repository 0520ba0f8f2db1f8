//! What all methods share: vertices, next event, weights.
