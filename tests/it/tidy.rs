//! The shape of the house: which room may know which, how long a file may be, how it begins.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Rooms of `core`, bottom to top: a room may use itself and those before it.
const ROOMS: [&str; 13] = [
    "math",
    "sampler",
    "bsdf",
    "trace",
    "film",
    "scene",
    "gltf",
    "settings",
    "path",
    "radiosity",
    "bake",
    "method",
    "render",
];
/// Rooms of the `server` library, bottom to top.
const SERVER_ROOMS: [&str; 8] = ["fail_point", "store", "blobs", "farm", "inspect", "api", "tls", "serve"];
/// What `film` may not know though it stands above it: a sum does not know what a scene is made of.
const STRANGERS: [(&str, &str); 4] =
    [("film", "trace"), ("film", "bsdf"), ("trace", "bsdf"), ("gltf", "sampler")];
/// Longest file, tests apart.
const LINES_MAX: usize = 500;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

fn sources() -> Vec<(PathBuf, String)> {
    let folders = ["core/src", "proto/src", "worker/src", "server/src", "tests/src", "tests/it"];
    let files: Vec<PathBuf> = folders.iter().flat_map(|f| rust_files(&root().join(f))).collect();
    assert!(files.len() > 100, "where are the sources?");
    files.into_iter().map(|p| (p.clone(), fs::read_to_string(p).unwrap())).collect()
}

/// The text before the unit tests.
fn code(text: &str) -> &str {
    text.find("#[cfg(test)]\nmod tests").map_or(text, |end| &text[..end])
}

fn is_test(path: &Path) -> bool {
    path.components().any(|c| matches!(c.as_os_str().to_str(), Some("tests" | "it" | "tests.rs")))
}

/// Rooms that a text names after `crate::`, also in nested imports.
fn rooms_used<'t>(text: &'t str, rooms: &[&'static str]) -> Vec<&'static str> {
    let lines = text.lines().filter(|l| !l.trim_start().starts_with("//"));
    let code: Vec<&'t str> = lines.collect();
    let code = code.join("\n");
    let mut used = Vec::new();
    for (i, _) in code.match_indices("crate::") {
        let rest = &code[i + 7..];
        let names = match rest.strip_prefix('{') {
            Some(list) => nested_names(list),
            None => vec![rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or("")],
        };
        used.extend(rooms.iter().filter(|room| names.contains(room)));
    }
    used
}

/// First names of the items of a braced import.
fn nested_names(list: &str) -> Vec<&str> {
    let (mut depth, mut names, mut start) = (1, Vec::new(), 0);
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if (c == ',' && depth == 1) || depth == 0 {
            let name = list[start..i].trim();
            names.push(name.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or(""));
            start = i + 1;
        }
        if depth == 0 {
            break;
        }
    }
    names
}

fn check_arrows(folder: &str, rooms: &[&'static str]) {
    let source = root().join(folder);
    let mut seen = 0;
    for path in rust_files(&source) {
        let inside = path.strip_prefix(&source).unwrap();
        let room = inside.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs");
        let Some(floor) = rooms.iter().position(|r| *r == room) else { continue };
        if is_test(inside) {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        for used in rooms_used(code(&text), rooms) {
            seen += 1;
            let below = rooms.iter().position(|r| *r == used).unwrap();
            assert!(below <= floor, "{}: {room} may not use {used}", inside.display());
            assert!(!STRANGERS.contains(&(room, used)), "{}: {room} does not know {used}", inside.display());
        }
    }
    assert!(seen > 10, "no arrows found in {folder}: is the reader broken?");
}

#[test]
fn arrows_run_downward_in_core() {
    check_arrows("core/src", &ROOMS);
}

#[test]
fn arrows_run_downward_in_the_server() {
    check_arrows("server/src", &SERVER_ROOMS);
}

#[test]
fn crates_know_only_those_below_them() {
    let may: [(&str, &[&str]); 4] = [
        ("core", &[]),
        ("proto", &["ovtigre-core"]),
        ("worker", &["ovtigre-core", "ovtigre-proto"]),
        ("server", &["ovtigre-core", "ovtigre-proto", "ovtigre-worker"]),
    ];
    for (krate, allowed) in may {
        let manifest = fs::read_to_string(root().join(krate).join("Cargo.toml")).unwrap();
        let of_ours = manifest.lines().filter(|l| l.starts_with("ovtigre") && l.contains("workspace = true"));
        for line in of_ours {
            let name = line.split(['.', ' ']).next().unwrap();
            assert!(allowed.contains(&name), "{krate} may not depend on {name}");
        }
    }
}

#[test]
fn only_the_command_line_starts_workers() {
    for (path, text) in sources() {
        let outside = !path.starts_with(root().join("server/src/command"));
        if path.starts_with(root().join("server/src")) && outside && !path.ends_with("main.rs") {
            assert!(!text.contains("ovtigre_worker::"), "{} knows the worker", path.display());
        }
    }
}

#[test]
fn files_are_short_and_say_what_they_are() {
    for (path, text) in sources() {
        assert!(text.starts_with("//! "), "{} does not begin with what it is", path.display());
        let lines = if is_test(&path) { 0 } else { code(&text).lines().count() };
        assert!(lines <= LINES_MAX, "{} has {lines} lines", path.display());
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert!(
            !["util", "utils", "common", "helpers", "misc"].contains(&name),
            "{} has no name",
            path.display()
        );
    }
}

#[test]
fn nothing_is_left_for_later_and_no_lint_is_silenced_without_a_reason() {
    for (path, text) in sources() {
        if path.ends_with("tidy.rs") {
            continue;
        }
        for word in ["TODO", "FIXME", "XXX", "#[allow(", "#![allow("] {
            assert!(!text.contains(word), "{} has {word}", path.display());
        }
    }
}
