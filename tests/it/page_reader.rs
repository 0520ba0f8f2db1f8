//! A token that may only read: what it may not do is not offered on the page, is said where it would be, and is refused.

use crate::page::{nothing_serious, seen, text_of};
use ovtigre_tests::{
    browser::Browser,
    program::{Farm, command, run},
};
use serde_json::{Value, json};
use std::path::Path;

/// The scene that comes with the program.
const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/room.glb");

/// A token of a role, made in a farm's folder.
fn token(data: &Path, role: &str) -> String {
    let made = run(["token", "create", "--role", role, "--data", data.to_str().unwrap()]);
    assert!(made.status.success(), "{made:?}");
    String::from_utf8(made.stdout).unwrap().split_whitespace().last().unwrap().to_owned()
}

/// Whether any of these elements can be seen.
fn is_seen(browser: &Browser, css: &str) -> bool {
    let any =
        format!("[...document.querySelectorAll({})].some((node) => node.checkVisibility())", json!(css));
    browser.value(&any).as_bool().unwrap()
}

/// Says in the view, by the page's own words, that something takes a token of another role.
fn says(browser: &Browser, words: &str) {
    browser.until(&format!(
        "[...document.querySelectorAll('.refused')].some((p) => p.checkVisibility() && p.textContent === {})",
        json!(words)
    ));
}

#[test]
fn who_may_only_read_is_offered_nothing_else() {
    let Some(browser) = Browser::open("reading only") else { return };
    let folder = tempfile::tempdir().unwrap();
    let [read, submit] = ["read", "submit"].map(|role| token(folder.path(), role));
    let farm = Farm::start_with(folder.path(), &["--workers", "1"]);
    let wished = ["submit", ROOM, "--size", "96x54", "--samples", "1000000", "--server", &farm.url];
    let sent = command().args(wished).env("OVTIGRE_TOKEN", &submit).output().unwrap();
    assert!(sent.status.success(), "{sent:?}");
    let job = String::from_utf8(sent.stdout).unwrap().trim().to_owned();
    browser.go(&farm.url);
    browser.write("dialog.sign input", &read);
    browser.press("Sign in");
    browser.until("document.documentElement.dataset.role === 'read'");
    browser.until("document.querySelectorAll('.jobs-table tbody tr').length === 1");
    for css in ["a[href='#/new']", ".jobs-table input[type=checkbox]"] {
        assert!(!is_seen(&browser, css), "{css}");
    }
    seen(&browser, "reader-jobs");
    a_job_is_only_looked_at(&browser, &job);
    nothing_is_sent(&browser);
    browser.click("nav a[data-view=workers]");
    browser.until("document.querySelector('table').textContent.includes('local-1')");
    assert!(!is_seen(&browser, "tbody button"));
    says(&browser, "This token may not drain workers: that takes one of role admin.");
    seen(&browser, "reader-workers");
    // Another token, which may send jobs, and still not drain workers.
    browser.press("Sign out");
    browser.until("document.querySelector('dialog.sign')?.open");
    browser.write("dialog.sign input", &submit);
    browser.press("Sign in");
    browser.until("document.documentElement.dataset.role === 'submit'");
    browser.until("document.querySelector('table')?.textContent.includes('local-1')");
    assert!(!is_seen(&browser, "tbody button"));
    browser.press("New job");
    browser.until("document.querySelector('.drop')?.checkVisibility()");
    assert!(!is_seen(&browser, ".refused"));
    browser.go(&format!("{}/#/job/{job}", farm.url));
    browser.press("Cancel");
    browser.press("Cancel the job");
    browser.until("document.querySelector('.badge').textContent === 'cancelled'");
}

/// Its picture, its error and its files are there, and no button that changes it.
fn a_job_is_only_looked_at(browser: &Browser, job: &str) {
    browser.click(".jobs-table tbody .named a");
    browser.until("document.querySelector('.stage.filled')");
    browser.until("document.querySelectorAll('.plot circle').length >= 1");
    assert!(!is_seen(browser, ".actions, .actions button, .actions a"));
    assert!(is_seen(browser, "a[download]"));
    says(browser, "This token may not change jobs: that takes one of role submit.");
    seen(browser, "reader-job");
    // Whatever the page offers, the farm refuses.
    let change = "const { send } = await import('/page/client.js');
        return send(`/v1/jobs/${a[0]}`, { method: 'PATCH', json: { priority: 3 } }).then(() => 'done', (error) => [error.status, error.message]);";
    let refused: Value = browser.run(change, &[json!(job)]);
    assert_eq!(refused, json!([403, "a token of role 'read' may not do this"]));
}

/// The place for scenes is not there, and what is dropped beside it is not sent.
fn nothing_is_sent(browser: &Browser) {
    browser.write("body", "n");
    says(browser, "This token may not render scenes: that takes one of role submit.");
    assert!(!is_seen(browser, ".drop, .drop input, form"));
    browser.let_go("h1", &[Path::new(ROOM)]);
    browser.until("document.querySelector('.notice.error')?.textContent.includes('may not send scenes')");
    browser.screenshot("reader-new");
    assert_eq!(text_of(browser, ".told"), "");
    nothing_serious(browser, "reader-new");
}
