//! Tokens as an operator makes and revokes them, and workers without a farm.

use ovtigre_tests::program::{Farm, command, run};
use std::{
    io::{BufRead as _, BufReader},
    path::Path,
    process::Stdio,
    time::{Duration, Instant},
};

fn token(place: &Path, arguments: &[&str]) -> String {
    let place = place.to_str().unwrap();
    let output = run([&["token"], arguments, &["--data", place]].concat());
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_revoked_token_opens_nothing_from_the_next_second_on() {
    let place = tempfile::tempdir().unwrap();
    // Before the first client of this process is made.
    ovtigre_proto::client::tls::provide();
    let (admin, read) = (["create", "--role", "admin"], ["create", "--role", "read", "--name", "panel"]);
    let (_admin, read) = (token(place.path(), &admin), token(place.path(), &read));
    let farm = Farm::start(place.path());
    let ask = async || {
        let jobs = reqwest::Client::new().get(format!("{}/v1/jobs", farm.url)).bearer_auth(&read);
        jobs.send().await.unwrap().status().as_u16()
    };
    assert_eq!(ask().await, 200);
    let list = token(place.path(), &["list"]);
    let id = list.lines().find(|line| line.contains("panel")).unwrap().split_whitespace().next().unwrap();
    token(place.path(), &["revoke", id]);
    let revoked = Instant::now();
    while ask().await == 200 {
        assert!(revoked.elapsed() < Duration::from_millis(1500), "it is still believed");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(ask().await, 401);
}

#[test]
fn a_worker_waits_for_a_farm_that_is_down_and_says_so() {
    // Nobody listens on a port that was just free.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut work = command();
    work.args(["work", "--threads", "1", "--server", &format!("http://127.0.0.1:{port}")]);
    let mut work = work.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(work.stderr.take().unwrap()).lines();
    let said = lines.map_while(Result::ok).find(|line| line.contains("trying again"));
    assert!(said.unwrap().contains("WARN"));
    // Nobody reads what it says any more: that must not keep it from leaving.
    assert!(work.try_wait().unwrap().is_none(), "it goes on");
    let leave = std::process::Command::new("kill").arg(work.id().to_string()).status().unwrap();
    assert!(leave.success());
    let told = Instant::now();
    while work.try_wait().unwrap().is_none() {
        assert!(told.elapsed() < Duration::from_secs(20), "it leaves when it is told to");
        std::thread::sleep(Duration::from_millis(20));
    }
}
