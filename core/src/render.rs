//! A batch of samples to its sum, on any number of threads.
