//! The farm: takes jobs, splits them into batches, leases them to workers, merges what comes back.

pub mod api;
pub mod blobs;
pub mod fail_point;
pub mod farm;
pub mod inspect;
pub mod plot;
pub mod serve;
pub mod store;
pub mod tls;
pub mod webhook;
