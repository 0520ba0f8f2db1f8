//! A farm that encrypts, with a certificate of an authority of its own.

use crate::faults::undisturbed;
use ovtigre_core::film::exr::read_layers;
use ovtigre_tests::{
    picture::settings,
    program::{Farm, command, worker_with},
    room::room,
};
use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

/// Runs `openssl`; false where there is none.
fn openssl(folder: &Path, arguments: &str) -> bool {
    let ran = Command::new("openssl").current_dir(folder).args(arguments.split_whitespace()).output();
    ran.is_ok_and(|output| output.status.success())
}

/// Makes an authority `ca.pem`, and a certificate `cert.pem` of this machine with its key `key.pem`.
fn certificates(folder: &Path) -> bool {
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2";
    fs::write(folder.join("ext"), "subjectAltName=IP:127.0.0.1,DNS:localhost\n").unwrap();
    openssl(folder, &format!("req -x509 {key} -subj /CN=authority -keyout ca-key.pem -out ca.pem"))
        && openssl(folder, &format!("req {key} -subj /CN=localhost -keyout key.pem -out request.pem"))
        && openssl(
            folder,
            "x509 -req -in request.pem -CA ca.pem -CAkey ca-key.pem -CAcreateserial -days 2 -extfile ext -out cert.pem",
        )
}

/// Runs a command to its end, trusting the authority in `trusted`.
fn ask(arguments: &[&str], trusted: Option<&str>) -> Output {
    let mut asked = command();
    asked.args(arguments).stdin(Stdio::null());
    match trusted {
        Some(file) => asked.env("SSL_CERT_FILE", file),
        None => asked.env_remove("SSL_CERT_FILE"),
    };
    asked.output().unwrap()
}

/// Asserts that a worker gives up at once, with one line that says why.
fn assert_gives_up(server: &str, word: &str) {
    let begun = Instant::now();
    let output = ask(&["work", "--threads", "1", "--server", server], None);
    let text = String::from_utf8_lossy(&output.stderr);
    let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
    assert_eq!((output.status.code(), errors.len()), (Some(3), 1), "{server}: {text}");
    assert!(errors[0].contains(word), "{text}");
}

#[test]
fn a_farm_that_encrypts_is_worked_for_and_called_only_by_who_trusts_it() {
    let folder = tempfile::tempdir().unwrap();
    if !certificates(folder.path()) {
        eprintln!("SKIPPED: certificates need openssl");
        return;
    }
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (authority, certificate, key) = (file("ca.pem"), file("cert.pem"), file("key.pem"));
    let farm =
        Farm::start_with(&folder.path().join("farm"), &["--tls-cert", &certificate, "--tls-key", &key]);
    assert!(farm.url.starts_with("https://"), "{}", farm.url);
    let _worker = worker_with(&farm.url, &[("SSL_CERT_FILE".to_owned(), authority.clone())]);
    let (scene, picture) = (file("scene.glb"), file("picture.exr"));
    fs::write(&scene, room()).unwrap();
    let render = ["render", &scene, "-o", &picture, "--size", "8x8", "--samples", "1024", "--method", "path"];
    let rendered = ask(&[&render[..], &["--server", &farm.url]].concat(), Some(&authority));
    assert!(rendered.status.success(), "{}", String::from_utf8_lossy(&rendered.stderr));
    let picture = read_layers(&fs::read(picture).unwrap()).unwrap();
    assert!(picture.channels == undisturbed(&room(), &settings(8, 8, 4), 1024).channels);

    let refused = ask(&["status", "--server", &farm.url], None);
    let text = String::from_utf8_lossy(&refused.stderr);
    assert_eq!((refused.status.code(), text.contains("certificate")), (Some(3), true), "{text}");
    assert_gives_up(&farm.url, "certificate");
    assert_gives_up(&farm.url.replace("https", "http"), "is there an ovtigre farm");
    let plain = Farm::start(&folder.path().join("plain"));
    assert_gives_up(&plain.url.replace("http", "https"), "is there an ovtigre farm");
}
