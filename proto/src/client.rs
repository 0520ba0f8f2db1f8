//! A typed HTTP client of the farm.
