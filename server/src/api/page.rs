//! The page: its files, as they are in the program.

use super::{openapi::DOCUMENT, tag};
use crate::farm::Farm;
use axum::{
    Router,
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse as _, Response},
    routing::get,
};
use std::sync::Arc;

/// Nothing is run, shown or asked but what comes from here. Pictures are also shown from memory.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What every file of the page is sent with.
const HEADS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::CACHE_CONTROL, "no-cache"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const DRAWING: &str = "image/svg+xml";

/// A file of the page.
#[derive(Debug)]
struct PageFile {
    path: &'static str,
    media: &'static str,
    bytes: &'static [u8],
}

macro_rules! files {
    ($($name:literal as $media:ident),* $(,)?) => {
        [$(PageFile {
            path: concat!("/page/", $name),
            media: $media,
            bytes: include_bytes!(concat!("../page/", $name)),
        }),*]
    };
}

static INDEX: PageFile = PageFile { path: "/", media: HTML, bytes: include_bytes!("../page/index.html") };
static FILES: [PageFile; 17] = files![
    "style.css" as STYLE,
    "icon.svg" as DRAWING,
    "app.js" as SCRIPT,
    "blake3.js" as SCRIPT,
    "client.js" as SCRIPT,
    "colours.js" as SCRIPT,
    "docs.js" as SCRIPT,
    "dom.js" as SCRIPT,
    "files.js" as SCRIPT,
    "format.js" as SCRIPT,
    "job.js" as SCRIPT,
    "jobs.js" as SCRIPT,
    "plot.js" as SCRIPT,
    "submit.js" as SCRIPT,
    "viewer.js" as SCRIPT,
    "workers.js" as SCRIPT,
    "zip.js" as SCRIPT,
];

static DOCS: PageFile = PageFile { path: "/docs", media: HTML, bytes: include_bytes!("../page/docs.html") };

/// The interface as a page.
pub async fn docs(headers: HeaderMap) -> Response {
    answer(&DOCS, &headers)
}

/// The interface as a document.
pub async fn openapi(headers: HeaderMap) -> Response {
    let file = PageFile { path: "/openapi.json", media: "application/json", bytes: DOCUMENT.as_bytes() };
    answer(&file, &headers)
}

/// The page itself.
pub async fn index(headers: HeaderMap) -> Response {
    answer(&INDEX, &headers)
}

/// What the page loads: open to everybody, as nothing of a farm is in it.
pub fn files() -> Router<Arc<Farm>> {
    FILES.iter().fold(Router::new(), |router, file| {
        router.route(file.path, get(move |headers: HeaderMap| async move { answer(file, &headers) }))
    })
}

fn answer(file: &PageFile, headers: &HeaderMap) -> Response {
    let name = blake3::hash(file.bytes).to_hex();
    let mut response = if tag::none_match(headers, &name) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        ([(header::CONTENT_TYPE, file.media)], file.bytes).into_response()
    };
    let heads = response.headers_mut();
    heads.extend(HEADS.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value))));
    heads.insert(header::ETAG, tag::strong(&name));
    response
}
