//! Numbers as a function of (seed, replicate, pixel, index, dimension).
