//! Headers of answers, as the interface's document describes them.

use serde_json::{Value, json};

/// Headers of an answer, each with what it says.
pub(super) fn heads_of(id: &str, status: u16) -> &'static [(&'static str, &'static str)] {
    const TAG: (&str, &str) = ("ETag", "Of what can be changed: `If-Match` holds a change against it");
    const SEEN: (&str, &str) =
        ("ETag", "Of what was answered: `If-None-Match` asks for it only where it has changed");
    const WAITED: (&str, &str) = ("Preference-Applied", "`wait`, where `Prefer: wait=N` was followed");
    const PLACE: (&str, &str) = ("Location", "Where it is");
    const RANGES: (&str, &str) = ("Accept-Ranges", "`bytes`");
    const SPAN: (&str, &str) = ("Content-Range", "Which bytes these are, and of how many");
    const PREVIEW: (&str, &str) = (
        "ovtigre-preview",
        "Only where this is the picture of the trial that told the method, before there is any of the job's own: the size in which it was made",
    );
    match (id, status) {
        ("uploadScene" | "putScene", 200 | 201) | ("joinWorker", 201) => &[PLACE],
        ("createJob", 202) => &[PLACE, TAG],
        ("getJob" | "patchJob" | "deleteJob", 200) => &[TAG],
        ("listJobs" | "getSceneBytes", 200 | 304) => &[SEEN],
        ("getExr", 200) => &[SEEN, WAITED, RANGES],
        ("getExr", 206) => &[SEEN, WAITED, RANGES, SPAN],
        ("getExr" | "getPng", 304) => &[SEEN, WAITED],
        ("getPng", 200) => &[SEEN, WAITED, PREVIEW],
        _ => &[],
    }
}

/// Headers as they are described.
pub(super) fn headers(heads: &[(&str, &str)]) -> Value {
    let one = |(name, says): &(&str, &str)| {
        let schema = match *name {
            "ovtigre-preview" => json!({"type": "string", "pattern": "^[0-9]+x[0-9]+$"}),
            _ => json!({"type": "string"}),
        };
        ((*name).to_owned(), json!({"description": says, "schema": schema}))
    };
    Value::Object(heads.iter().map(one).collect())
}

/// Headers of an answer that says what went wrong.
pub(super) const OF_PROBLEMS: [(&str, &str); 3] = [
    ("Retry-After", "Seconds after which to ask again, where that may help"),
    ("WWW-Authenticate", "With 401: which kind of token is asked for"),
    ("Content-Range", "With 416: how many bytes there are"),
];
