//! The interface as an `OpenAPI` 3.1 document, made from the types that it speaks and the list of its doors.

use super::{
    caller::CallerStatus,
    heads::{OF_PROBLEMS, headers, heads_of},
    image::PngParams,
    jobs::{CreateParams, DeleteParams, DryRun, ListParams},
    params::PageParams,
    pixel::PixelParams,
    roles::{Access, DOORS},
};
use axum::http::Method;
use ovtigre_proto::{
    curve::Curve,
    job::{JobPatch, JobRequest},
    lease::{Committed, Exchange, ExchangeReply, LeaseFailure, WorkerJoin, WorkerJoined},
    pixel::Pixel,
    problem::Problem,
    scene::{PartsReceived, SceneReport},
    status::{JobEvent, JobStatus, Page, Scaling, WorkerStatus},
    webhook::Notice,
};
use schemars::{JsonSchema, Schema, SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value, json};
use std::sync::LazyLock;

/// What an operation takes or gives.
#[derive(Clone, Copy)]
enum Content {
    /// Nothing.
    Nothing,
    /// A JSON document.
    Json(fn(&mut SchemaGenerator) -> Schema),
    /// Bytes or text of a media type.
    Media(&'static str),
}

/// What is done at a door.
struct Operation {
    /// Its name in clients.
    id: &'static str,
    /// In a line.
    summary: &'static str,
    /// Parameters of the query.
    query: Option<fn(&mut SchemaGenerator) -> Schema>,
    /// Headers of a request that change what is done.
    heads: &'static [&'static str],
    /// The body of a request.
    takes: Content,
    /// Statuses of success, each with what is given.
    gives: Vec<(u16, Content)>,
}

const fn json<T: JsonSchema>() -> Content {
    Content::Json(SchemaGenerator::subschema_for::<T>)
}

const BYTES: Content = Content::Media("application/octet-stream");
const EXR: Content = Content::Media("image/x-exr");
const PNG: Content = Content::Media("image/png");
const TEXT: Content = Content::Media("text/plain");
const HTML: Content = Content::Media("text/html");
const NOTHING: Content = Content::Nothing;
/// Only the parts that differ are written at each door.
const PLAIN: Operation =
    Operation { id: "", summary: "", query: None, heads: &[], takes: NOTHING, gives: Vec::new() };

/// What is done at the door at `path` by `method`.
fn operation(method: &Method, path: &str) -> Option<Operation> {
    of_scenes_and_jobs(method, path)
        .or_else(|| of_pictures(path))
        .or_else(|| of_workers(method, path))
        .or_else(|| of_the_farm(path))
}

fn of_scenes_and_jobs(method: &Method, path: &str) -> Option<Operation> {
    let (id, summary) = match (method.as_str(), path) {
        ("POST", "/v1/scenes") => (
            "uploadScene",
            "Uploads a .glb, a .zip of a .gltf with its files, or an image to light scenes with",
        ),
        ("PUT", "/v1/scenes/{id}") => (
            "putScene",
            "Uploads a scene under the BLAKE3 hash of its bytes; what is here already costs nothing",
        ),
        ("GET", "/v1/scenes/{id}") => ("getScene", "What is in an uploaded file"),
        ("GET", "/v1/scenes/{id}/bytes") => ("getSceneBytes", "The bytes of an uploaded file"),
        ("POST", "/v1/jobs") => ("createJob", "Takes a job, or only checks it"),
        ("GET", "/v1/jobs") => ("listJobs", "Jobs, page by page"),
        ("GET", "/v1/jobs/{id}") => ("getJob", "How a job stands; the ETag is that of what can be changed"),
        ("PATCH", "/v1/jobs/{id}") => {
            ("patchJob", "Changes priority or state, or asks for more samples or a smaller error")
        }
        ("DELETE", "/v1/jobs/{id}") => {
            ("deleteJob", "Cancels a job, or removes one that is over with its files")
        }
        _ => return None,
    };
    let operation = Operation { id, summary, ..PLAIN };
    Some(match id {
        "uploadScene" => Operation {
            takes: BYTES,
            gives: vec![(201, json::<SceneReport>()), (200, json::<SceneReport>())],
            ..operation
        },
        "putScene" => Operation {
            heads: &["Content-Range"],
            takes: BYTES,
            gives: vec![
                (201, json::<SceneReport>()),
                (200, json::<SceneReport>()),
                (202, json::<PartsReceived>()),
            ],
            ..operation
        },
        "getScene" => Operation { gives: vec![(200, json::<SceneReport>())], ..operation },
        "getSceneBytes" => {
            Operation { heads: &["If-None-Match"], gives: vec![(200, BYTES), (304, NOTHING)], ..operation }
        }
        "createJob" => Operation {
            query: Some(schema::<CreateParams>),
            heads: &["Idempotency-Key"],
            takes: json::<JobRequest>(),
            gives: vec![(202, json::<JobStatus>()), (200, json::<DryRun>())],
            ..operation
        },
        "listJobs" => Operation {
            query: Some(schema::<ListParams>),
            heads: &["If-None-Match"],
            gives: vec![(200, json::<Page<JobStatus>>()), (304, NOTHING)],
            ..operation
        },
        "patchJob" => Operation {
            heads: &["If-Match"],
            takes: json::<JobPatch>(),
            gives: vec![(200, json::<JobStatus>())],
            ..operation
        },
        "deleteJob" => Operation {
            query: Some(schema::<DeleteParams>),
            gives: vec![(200, json::<JobStatus>()), (204, NOTHING)],
            ..operation
        },
        _ => Operation { gives: vec![(200, json::<JobStatus>())], ..operation },
    })
}

fn of_pictures(path: &str) -> Option<Operation> {
    let part = path.strip_prefix("/v1/jobs/{id}/")?;
    Some(match part {
        "events" => Operation {
            id: "watchJob",
            summary: "Its status whenever it changes, and each checkpoint once: server-sent events whose data is a JobEvent",
            heads: &["Last-Event-ID"],
            gives: vec![(200, Content::Media("text/event-stream")), (204, NOTHING)],
            ..PLAIN
        },
        "image.exr" => Operation {
            id: "getExr",
            summary: "The merged picture so far, with its error and its layers",
            heads: &["If-None-Match", "Range", "If-Range", "Prefer"],
            gives: vec![(200, EXR), (206, EXR), (304, NOTHING)],
            ..PLAIN
        },
        "image.png" => Operation {
            id: "getPng",
            summary: "The merged picture so far, developed",
            query: Some(schema::<PngParams>),
            heads: &["If-None-Match", "Prefer"],
            gives: vec![(200, PNG), (304, NOTHING)],
            ..PLAIN
        },
        "pixel" => Operation {
            id: "getPixel",
            summary: "What is at a pixel of the picture so far, with its error",
            query: Some(schema::<PixelParams>),
            gives: vec![(200, json::<Pixel>())],
            ..PLAIN
        },
        "error.json" => Operation {
            id: "getCurve",
            summary: "Error against run time",
            gives: vec![(200, json::<Curve>())],
            ..PLAIN
        },
        "error.csv" => Operation {
            id: "getCurveCsv",
            summary: "Error against run time as a table",
            gives: vec![(200, Content::Media("text/csv"))],
            ..PLAIN
        },
        "error.svg" => Operation {
            id: "getCurveSvg",
            summary: "Error against run time as a drawing",
            gives: vec![(200, Content::Media("image/svg+xml"))],
            ..PLAIN
        },
        _ => return None,
    })
}

fn of_workers(method: &Method, path: &str) -> Option<Operation> {
    let lease = |id, summary| Operation {
        id,
        summary,
        heads: &["ovtigre-seconds"],
        gives: vec![(200, json::<Committed>())],
        ..PLAIN
    };
    Some(match (method.as_str(), path) {
        ("POST", "/v1/workers") => Operation {
            id: "joinWorker",
            summary: "A worker joins",
            takes: json::<WorkerJoin>(),
            gives: vec![(201, json::<WorkerJoined>())],
            ..PLAIN
        },
        ("GET", "/v1/workers") => Operation {
            id: "listWorkers",
            summary: "Workers, the newest first",
            query: Some(schema::<PageParams>),
            gives: vec![(200, json::<Page<WorkerStatus>>())],
            ..PLAIN
        },
        ("GET", "/v1/workers/{id}") => Operation {
            id: "getWorker",
            summary: "How a worker stands",
            gives: vec![(200, json::<WorkerStatus>())],
            ..PLAIN
        },
        ("DELETE", "/v1/workers/{id}") => Operation {
            id: "drainWorker",
            summary: "A worker gets no more batches",
            gives: vec![(200, json::<WorkerStatus>())],
            ..PLAIN
        },
        ("POST", "/v1/workers/{id}/exchange") => Operation {
            id: "exchange",
            summary: "A worker's beat: progress, new leases, cancellations, the next interval",
            takes: json::<Exchange>(),
            gives: vec![(200, json::<ExchangeReply>())],
            ..PLAIN
        },
        ("PUT", "/v1/leases/{id}/sum") => {
            Operation { takes: EXR, ..lease("putSum", "Brings the sum of a batch as a partial EXR") }
        }
        ("POST", "/v1/leases/{id}/sum") => {
            lease("handSum", "Says that the sum of a batch was put where its lease said")
        }
        ("POST", "/v1/leases/{id}/failure") => Operation {
            id: "failLease",
            summary: "Gives a batch back with the reason",
            takes: json::<LeaseFailure>(),
            gives: vec![(204, NOTHING)],
            ..PLAIN
        },
        _ => return None,
    })
}

fn of_the_farm(path: &str) -> Option<Operation> {
    let (id, summary, content) = match path {
        "/v1/scaling" => ("getScaling", "How many workers the queue could use now", json::<Scaling>()),
        "/v1/caller" => ("getCaller", "What the token of this call may do", json::<CallerStatus>()),
        "/healthz" => ("getHealth", "Whether the process runs", TEXT),
        "/readyz" => ("getReadiness", "Whether the farm can be used", TEXT),
        "/metrics" => ("getMetrics", "Numbers for Prometheus (text format 0.0.4)", TEXT),
        "/openapi.json" => ("getOpenApi", "This document", Content::Media("application/json")),
        "/docs" => ("getDocs", "This document, to be read", HTML),
        "/" => ("getPage", "The page", HTML),
        _ => return None,
    };
    Some(Operation { id, summary, gives: vec![(200, content)], ..PLAIN })
}

fn schema<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    T::json_schema(generator)
}

/// A schema for bytes where they are binary, for a text where they are that.
fn content(generator: &mut SchemaGenerator, of: Content) -> Option<Value> {
    match of {
        Content::Nothing => None,
        Content::Json(schema) => Some(json!({"application/json": {"schema": schema(generator)}})),
        // A stream of events is no text but fields: what is in them, its door says.
        Content::Media(media) if media.starts_with("text/") && media != "text/event-stream" => {
            Some(json!({media: {"schema": {"type": "string"}}}))
        }
        Content::Media(media) => Some(json!({media: {}})),
    }
}

/// The schema of a parameter that is given: leaving it out is no value of its own.
fn given(mut schema: Value) -> Value {
    let null = |kind: &Value| *kind == "null" || kind["type"] == "null";
    for key in ["type", "anyOf"] {
        let Some(kinds) = schema.get_mut(key).and_then(Value::as_array_mut) else { continue };
        kinds.retain(|kind| !null(kind));
        if let [one] = kinds.as_slice() {
            let one = one.clone();
            if key == "anyOf" {
                return one;
            }
            schema[key] = one;
        }
    }
    schema
}

/// A BLAKE3 hash.
const HASH: &str = "^[0-9a-f]{64}$";

/// What a header of a request holds.
fn header(name: &str) -> Value {
    let pattern = match name {
        "ovtigre-seconds" => return json!({"type": "number", "minimum": 0, "maximum": 1e9}),
        "Idempotency-Key" => "^[!-~]{1,255}$",
        "Last-Event-ID" => r"^[0-9]{1,18}\.[0-9]{1,18}\.[0-9]{1,18}$",
        "If-Match" => r#"^(\*|"[0-9]{1,18}")$"#,
        "Content-Range" => r"^bytes ([0-9]{1,12}-[0-9]{1,12}|\*)/[0-9]{1,12}$",
        _ => return json!({"type": "string"}),
    };
    json!({"type": "string", "pattern": pattern})
}

/// Says of every whole number how large it may be: what its format means is not known to all.
fn bound_numbers(value: &mut Value) {
    match value {
        Value::Array(all) => all.iter_mut().for_each(bound_numbers),
        Value::Object(fields) => {
            let most = match fields.get("format").and_then(Value::as_str) {
                Some("uint32") => Some(u64::from(u32::MAX)),
                Some("int32") => Some(i32::MAX as u64),
                Some("uint64") => Some(u64::MAX),
                _ => None,
            };
            if let Some(most) = most {
                fields.entry("maximum").or_insert_with(|| most.into());
            }
            if fields.get("format").is_some_and(|format| format == "int32") {
                fields.entry("minimum").or_insert_with(|| i32::MIN.into());
            }
            fields.values_mut().for_each(bound_numbers);
        }
        _ => {}
    }
}

fn parameters(generator: &mut SchemaGenerator, path: &str, operation: &Operation) -> Vec<Value> {
    let mut all = Vec::new();
    if path.contains("{id}") {
        let hash = path.starts_with("/v1/scenes/");
        let schema =
            if hash { json!({"type": "string", "pattern": HASH}) } else { json!({"type": "string"}) };
        all.push(json!({"name": "id", "in": "path", "required": true, "schema": schema}));
    }
    let query = operation.query.map(|schema| schema(generator));
    let fields = query.as_ref().and_then(|schema| schema.get("properties")?.as_object());
    let required = query.as_ref().and_then(|schema| schema.get("required")?.as_array());
    for (name, field) in fields.into_iter().flatten() {
        let mut field = field.clone();
        let text = field.as_object_mut().and_then(|field| field.remove("description"));
        let field = given(field);
        let mut parameter = json!({"name": name, "in": "query", "schema": field});
        if let Some(text) = text {
            parameter["description"] = text;
        }
        if required.is_some_and(|names| names.iter().any(|one| one == name)) {
            parameter["required"] = true.into();
        }
        all.push(parameter);
    }
    all.extend(
        operation.heads.iter().map(|name| json!({"name": name, "in": "header", "schema": header(name)})),
    );
    all
}

fn described(generator: &mut SchemaGenerator, path: &str, access: Access, operation: &Operation) -> Value {
    let mut responses = Map::new();
    for (status, of) in &operation.gives {
        let mut response = json!({"description": phrase(*status)});
        if let Some(content) = content(generator, *of) {
            response["content"] = content;
        }
        let heads = heads_of(operation.id, *status);
        if !heads.is_empty() {
            response["headers"] = headers(heads);
        }
        responses.insert(status.to_string(), response);
    }
    responses.insert("default".to_owned(), json!({"$ref": "#/components/responses/Problem"}));
    let mut described =
        json!({"operationId": operation.id, "summary": operation.summary, "responses": responses});
    let parameters = parameters(generator, path, operation);
    if !parameters.is_empty() {
        described["parameters"] = parameters.into();
    }
    if let Some(content) = content(generator, operation.takes) {
        described["requestBody"] = json!({"required": true, "content": content});
    }
    described["security"] = match access {
        Access::Open => json!([]),
        Access::Roles(roles) => {
            let names: Vec<_> = roles.iter().map(|role| role.name()).chain(["admin"]).collect();
            // A farm without tokens asks for none.
            json!([{"token": names}, {}])
        }
    };
    described
}

fn phrase(status: u16) -> &'static str {
    match status {
        200 => "Done",
        201 => "Made",
        202 => "Taken",
        204 => "Done; there is nothing to say",
        206 => "The bytes that were asked for",
        _ => "As before",
    }
}

/// The document.
pub static DOCUMENT: LazyLock<String> = LazyLock::new(|| {
    let text = serde_json::to_string_pretty(&document()).expect("a document is plain data");
    text + "\n"
});

fn document() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.definitions_path = "/components/schemas".into());
    let mut generator = settings.into_generator();
    let mut paths: Map<String, Value> = Map::new();
    for (method, path, access) in DOORS {
        let Some(operation) = operation(&method, path) else { continue };
        let described = described(&mut generator, path, access, &operation);
        let at = paths.entry(path).or_insert_with(|| json!({}));
        at[method.as_str().to_ascii_lowercase()] = described;
    }
    let problem = generator.subschema_for::<Problem>();
    generator.subschema_for::<JobEvent>();
    let notice = generator.subschema_for::<Notice>();
    let signed = ["webhook-id", "webhook-timestamp", "webhook-signature"];
    let signed = signed
        .map(|name| json!({"name": name, "in": "header", "required": true, "schema": {"type": "string"}}));
    let mut document = json!({
        "openapi": "3.1.0",
        "info": {
            "title": "ovtigre",
            "version": env!("CARGO_PKG_VERSION"),
            "summary": "A render farm whose pictures come with error bars",
            "license": {"name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0"},
        },
        "paths": paths,
        "webhooks": {"jobState": {"post": {
            "operationId": "tellJobState",
            "summary": "A job's state has changed; signed as Standard Webhooks say. Any 2xx takes it, 410 ends it, all else is tried again",
            "parameters": signed,
            "requestBody": {"required": true, "content": {"application/json": {"schema": notice}}},
            "responses": {"2XX": {"description": "Taken"}},
        }}},
        "components": {
            "schemas": generator.take_definitions(true),
            "responses": {"Problem": {
                "description": "What went wrong (RFC 9457)",
                "headers": headers(&OF_PROBLEMS),
                "content": {"application/problem+json": {"schema": problem}},
            }},
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    });
    bound_numbers(&mut document);
    document
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{collections::BTreeSet, fs, path::Path};

    #[test]
    fn every_door_is_described_under_a_name_of_its_own() {
        let mut names = BTreeSet::new();
        for (method, path, _) in DOORS {
            let operation =
                operation(&method, path).unwrap_or_else(|| panic!("{method} {path} is not described"));
            assert!(names.insert(operation.id), "{} is there twice", operation.id);
            assert!(!operation.gives.is_empty(), "{method} {path} gives nothing");
        }
    }

    #[test]
    fn what_is_referred_to_is_there() {
        let document = document();
        let text = document.to_string();
        let mut references = 0;
        for (at, _) in text.match_indices("\"$ref\":\"#") {
            let pointer = text[at + 9..].split('"').next().unwrap();
            assert!(document.pointer(pointer).is_some(), "{pointer} is not there");
            references += 1;
        }
        assert!(references > 50, "{references} references");
    }

    #[test]
    fn the_document_that_is_kept_is_that_of_the_code() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/openapi.json");
        if std::env::var_os("OVTIGRE_WRITE").is_some() {
            fs::write(&path, &*DOCUMENT).unwrap();
        }
        let kept = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            kept == *DOCUMENT,
            "docs/openapi.json is of other code: run this test with OVTIGRE_WRITE=1, and look at what changed"
        );
    }
}
