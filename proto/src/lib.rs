//! The words that the farm, its workers and its clients share.
