//! Numbers of a request that are out of bounds.

use super::submit::{REPLICATES_MAX, SAMPLES_MAX, TAGS_MAX, WEIGHT_MAX, bad_text};
use ovtigre_proto::{job::JobRequest, pair::EnvironmentRequest};

/// Notes which numbers and texts of a request cannot be.
pub(super) fn numbers(request: &JobRequest, note: &mut impl FnMut(&str, String)) {
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if request.samples.is_some_and(|n| n == 0 || n > SAMPLES_MAX) {
        note("/samples", format!("samples are 1 to {SAMPLES_MAX}"));
    }
    if request.replicates.is_some_and(|n| n == 0 || n > REPLICATES_MAX) {
        note("/replicates", format!("replicates are 1 to {REPLICATES_MAX}"));
    }
    if request.error.is_some_and(|e| !positive(e)) {
        note("/error", "the relative error to stop at is positive, such as 0.01".to_owned());
    }
    if request.seconds.is_some_and(|s| !positive(s)) {
        note("/seconds", "the run time to stop after is positive".to_owned());
    }
    if request.environment_rotation.is_some_and(|d| !d.is_finite()) {
        note("/environment_rotation", "the rotation is a finite number of degrees".to_owned());
    }
    if request.environment_rotation.is_some_and(|d| d != 0.0) && request.environment.is_none() {
        note("/environment_rotation", "there is no 'environment' to rotate".to_owned());
    }
    if let Some(EnvironmentRequest::Uniform(rgb)) = &request.environment
        && !rgb.iter().all(|c| c.is_finite() && *c >= 0.0)
    {
        note("/environment", "a radiance has three finite numbers that are not negative".to_owned());
    }
    if let Some([open, close]) = request.shutter
        && !(open.is_finite() && close.is_finite() && open <= close)
    {
        note(
            "/shutter",
            "the shutter opens and closes at finite seconds, and not before it opens".to_owned(),
        );
    }
    if let Some(fault) = request.name.as_ref().and_then(|name| bad_text(name)) {
        note("/name", fault);
    }
    sharing(request, note);
}

fn sharing(request: &JobRequest, note: &mut impl FnMut(&str, String)) {
    if request.weight.is_some_and(|n| n == 0 || n > WEIGHT_MAX) {
        note("/weight", format!("a weight is 1 to {WEIGHT_MAX}"));
    }
    if request.max_workers == Some(0) {
        note("/max_workers", "a job needs 1 worker or more: pause it instead".to_owned());
    }
    if request.tags.len() > TAGS_MAX {
        note("/tags", format!("there are more than {TAGS_MAX} tags"));
    }
    for (i, tag) in request.tags.iter().enumerate() {
        if let Some(fault) = bad_text(tag) {
            note(&format!("/tags/{i}"), fault);
        }
    }
}
