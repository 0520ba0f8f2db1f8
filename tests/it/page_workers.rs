//! A worker that the farm has put aside is seen on the page, with the reason in its own words.

use crate::page::{seen, text_of};
use ovtigre_tests::{browser::Browser, program::Farm, scenes::cornell};
use serde_json::json;
use std::fs;

#[test]
fn a_worker_that_is_put_aside_is_shown_with_the_reason() {
    let Some(browser) = Browser::open("workers put aside") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(&folder.path().join("farm"));
    let scene = folder.path().join("cornell.glb");
    fs::write(&scene, cornell()).unwrap();
    for seed in ["1", "2", "3"] {
        farm.client(&[
            "submit",
            scene.to_str().unwrap(),
            "--size",
            "32x32",
            "--samples",
            "16",
            "--seed",
            seed,
        ]);
    }
    browser.go(&farm.url);
    let fail = "const { send } = await import('/page/client.js');
        const post = (path, json) => send(path, { method: 'POST', json });
        const worker = { name: 'weary', threads: 1, build: a[0], instruction_set: 'x86-64-v3', tags: ['basement'] };
        const { id } = await (await post('/v1/workers', worker)).json();
        const beat = { holding: [], wants: 64, scenes: [], leaving: false, beat: 1 };
        const { leases } = await (await post(`/v1/workers/${id}/exchange`, beat)).json();
        const jobs = new Map(leases.map((lease) => [lease.job, lease.id]));
        for (const lease of jobs.values()) await post(`/v1/leases/${lease}/failure`, { reason: 'no memory <b>left</b>', kind: 'worker' });
        return jobs.size;";
    assert_eq!(browser.run(fail, &[json!(env!("CARGO_PKG_VERSION"))]), 3);
    browser.click("nav a[data-view=workers]");
    browser.until("document.querySelector('.badge.aside')");
    let row = text_of(&browser, "tbody tr");
    assert!(row.contains("it failed at 3 jobs, the last time because: no memory <b>left</b>"), "{row}");
    assert!(row.contains("basement"), "{row}");
    seen(&browser, "workers-aside");
}
