//! What happens to a job, told as OpenTelemetry spans to a collector, where one is configured.

pub mod post;
pub mod span;
pub mod traces;
