//! The page in a real browser on a live farm: every flow once, seen, kept as pictures, and checked by axe.

use glam::Vec3;
use ovtigre_tests::{
    browser::{Browser, Scheme},
    glb::Glb,
    program::{Farm, run},
    scenes::{add, flipped, floor, lambert},
};
use serde_json::{Value, json};
use sqlx::{ConnectOptions as _, Connection as _, sqlite::SqliteConnectOptions};
use std::{fs, path::Path};

/// How many times as long as for a list of [`FEW`] the first sight of a long one may take; each shows fifty rows.
const LONGER_MAX: f64 = 1.5;
/// Jobs in a short list.
const FEW: u32 = 60;
/// Jobs in a long list.
const MANY: u32 = 10_000;

/// The scene that comes with the program.
const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/room.glb");

/// A lamp over a floor: as little as can be seen.
fn lamp() -> Vec<u8> {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(0.6, 0.0), floor(0.0, 4.0, 0.0, 0.0));
    add(&mut glb, "lamp", lambert(0.0, 8.0), flipped(floor(2.0, 0.8, 0.0, 0.0)));
    glb.perspective(Vec3::new(0.0, 1.0, 3.5), Vec3::new(0.0, 0.4, 0.0), 40.0);
    glb.finish()
}

/// Nothing that keeps somebody from using the page, and no error of its scripts.
pub(crate) fn nothing_serious(browser: &Browser, view: &str) {
    let axe = include_str!("../axe/axe.min.js");
    let check = "return (await axe.run(document, { resultTypes: ['violations'] })).violations
        .map(({ impact, id, nodes }) => [impact, id, nodes.map((node) => `${node.html.slice(0, 200)} ${node.failureSummary}`)]);";
    let found = browser.run(&format!("{axe}; {check}"), &[]);
    let serious: Vec<&Value> = (found.as_array().unwrap().iter())
        .filter(|violation| matches!(violation[0].as_str(), Some("serious" | "critical")))
        .collect();
    assert!(serious.is_empty(), "{view}: {serious:#?}");
    assert_eq!(browser.complaints(), Vec::<String>::new(), "{view}");
}

/// The view as it is on a desk and in a hand, by day and by night.
pub(crate) fn seen(browser: &Browser, view: &str) {
    browser.screenshot(view);
    nothing_serious(browser, view);
    browser.look(1400, 900, Scheme::Dark);
    browser.screenshot(&format!("{view}-dark"));
    nothing_serious(browser, view);
    browser.look(390, 844, Scheme::Light);
    browser.screenshot(&format!("{view}-phone"));
    nothing_serious(browser, view);
    let [wide, window] =
        ["document.documentElement.scrollWidth", "innerWidth"].map(|x| browser.value(x).as_f64().unwrap());
    assert!(wide <= window, "{view} is {wide} wide on a phone of {window}");
    browser.look(1400, 900, Scheme::Light);
}

pub(crate) fn text_of(browser: &Browser, css: &str) -> String {
    let text = browser.value(&format!("document.querySelector({})?.textContent ?? ''", json!(css)));
    text.as_str().unwrap().to_owned()
}

#[test]
fn a_scene_becomes_a_picture_with_the_page_alone() {
    let Some(browser) = Browser::open("the page") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start_with(folder.path(), &["--workers", "1"]);
    browser.go(&farm.url);
    browser.until("document.querySelector('.empty').textContent.includes('no job yet')");
    browser.press("New job");
    let job = a_job_is_made(&browser);
    a_job_is_watched_and_changed(&browser, &farm, &job);
    pictures_are_compared(&browser, &farm);
    jobs_are_listed_and_cancelled(&browser, &farm, &job);
    workers_are_listed_and_drained(&browser);
    browser.press("Interface");
    browser.until("document.querySelectorAll('.call').length > 20");
    assert!(text_of(&browser, "#schema-JobRequest").contains("relative error is certified"));
    seen(&browser, "interface");
}

/// From a file to a job; its id.
fn a_job_is_made(browser: &Browser) -> String {
    browser.write("#choose-file", ROOM);
    browser.until("document.querySelector('.told').textContent === 'room.glb was sent.'");
    assert!(text_of(browser, ".facts").contains("31,704"), "triangles are told");
    browser.until("document.querySelector('.preview canvas')");
    // The second time nothing is sent.
    browser.write("#choose-file", ROOM);
    browser.until("document.querySelector('.told').textContent.includes('here already')");
    browser.rewrite("#f-name", "a room <img src=x onerror=alert(1)>");
    browser.rewrite("#f-size", "96");
    browser.rewrite("#f-paths", "L(D|S*E");
    browser.until("document.querySelector('.caret mark')?.textContent === '('");
    assert!(text_of(browser, "#f-paths-fault").contains("never closed"));
    browser.screenshot("new-job-fault");
    browser.press("whittedL[D|S]S_M*E");
    browser.until("document.querySelector('#f-paths').value === 'L[D|S]S_M*E'");
    browser.press("fullL(D|S)*E");
    browser.press("Add a layer");
    browser.write(".layer input", "direct");
    browser.write(".layer input.mono", "LDE");
    browser.rewrite("#f-samples", "4096");
    browser.rewrite("#f-error", "0.1");
    browser.until("document.querySelector('.verdict .facts')?.textContent.includes('96 × 54')");
    browser.until("!document.querySelector('.send button').disabled && document.querySelector('.layer .fault').textContent === ''");
    seen(browser, "new-job");
    browser.press("Render");
    browser.until("document.querySelector('.stage.filled')");
    browser.value("location.hash.split('/').pop()").as_str().unwrap().to_owned()
}

fn a_job_is_watched_and_changed(browser: &Browser, farm: &Farm, job: &str) {
    let name = "a room <img src=x onerror=alert(1)>";
    assert_eq!(text_of(browser, "h1"), name, "a name is a text");
    browser.until("document.querySelectorAll('.plot circle').length >= 2");
    let before = browser.value("document.querySelectorAll('.plot circle').length").as_u64().unwrap();
    browser.until(&format!("document.querySelectorAll('.plot circle').length > {before}"));
    assert!(text_of(browser, ".plot").contains("target 0.1"));
    let point = "const s = document.querySelector('.stage'); const b = s.getBoundingClientRect();
        s.dispatchEvent(new PointerEvent('pointermove', { clientX: b.left + b.width / 2, clientY: b.top + b.height / 2, bubbles: true }));";
    browser.run(point, &[]);
    browser.until("document.querySelector('.read-out').textContent.includes('±')");
    assert!(text_of(browser, ".read-out").contains("pixel 48, 27"));
    // What is said of a pixel goes on with the picture, wherever the pointer is.
    browser.run("document.querySelector('.stage').dispatchEvent(new PointerEvent('pointerleave'));", &[]);
    let said = json!(text_of(browser, ".read-out"));
    browser.until(&format!("document.querySelector('.read-out').textContent !== {said}"));
    seen(browser, "job-running");
    browser.press("Pause");
    browser.until("document.querySelector('.badge').textContent === 'paused'");
    assert_eq!(farm.job(job)["state"], "paused");
    browser.press("Resume");
    browser.until("document.querySelector('.badge').textContent === 'running'");
    browser.press("More samples");
    browser.rewrite("#asked", "5000");
    browser.press("Draw more");
    browser.until("document.querySelector('.numbers').textContent.includes('of 5,000')");
    assert_eq!(farm.job(job)["samples_asked"], 5000);
    browser.press("Tighter error");
    browser.rewrite("#asked", "40");
    browser.press("Set target");
    browser.until("document.querySelector('.badge').textContent === 'done'");
    assert_eq!(farm.job(job)["certified"], true);
    // What is done goes on.
    let reached = farm.job(job)["error"]["relative_error_upper"].as_f64().unwrap();
    browser.press("Tighter error");
    browser.rewrite("#asked", &format!("{:.1}", reached * 90.0));
    browser.press("Set target");
    browser.until("document.querySelector('.badge').textContent === 'running'");
    browser.until("document.querySelector('.badge').textContent === 'done'");
    assert!(farm.job(job)["error"]["relative_error_upper"].as_f64().unwrap() < 0.9 * reached + 0.001);
    let files = "return Promise.all([...document.querySelectorAll('a[download]')].map(async (a) => [(await fetch(a.href)).status, a.download]));";
    let files = browser.run(files, &[]);
    for (file, ending) in files.as_array().unwrap().iter().zip(["exr", "png", "csv"]) {
        assert_eq!(file[0], 200, "{file}");
        assert!(file[1].as_str().unwrap().ends_with(ending), "{file}");
    }
}

fn pictures_are_compared(browser: &Browser, farm: &Farm) {
    // Of another size, so that it can be told from what is there.
    let reference = farm.client(&["submit", ROOM, "--size", "48x27", "--samples", "16"]);
    let reference = reference.trim();
    farm.wait(reference, |job| job["state"] == "done");
    browser.press("Job …");
    browser.rewrite("#asked", "000000000000");
    browser.press("Compare");
    browser.until("document.querySelector('.notice.error')?.textContent.includes('no job')");
    browser.press("Job …");
    browser.rewrite("#asked", reference);
    browser.press("Compare");
    browser.until("document.querySelector('canvas.side.b').width === 48");
    browser.screenshot("job-wipe-reference");
    // The viewer's own drop-downs: what is shown, and what it is compared with.
    browser.rewrite(".against", "layer:error");
    browser.until("!document.querySelector('.legend').hidden");
    browser.rewrite("input.wipe", "60");
    browser.until("document.querySelector('canvas.side.b').width > 1");
    seen(browser, "job-wipe-error");
    let moment = browser.until("[...document.querySelectorAll('.controls option')].map((o) => o.value).find((v) => v.startsWith('moment:'))");
    browser.rewrite(".against", moment.as_str().unwrap());
    browser.until("document.querySelector('.legend').hidden");
    browser.screenshot("job-wipe-moment");
    browser.rewrite(".controls label:nth-of-type(1) select", "direct");
    browser.until("document.querySelector('.stage').ariaLabel.includes('direct')");
    let exposed = "return new Promise((done) => { const c = document.querySelector('canvas.side.a');
        const mean = () => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let s = 0; for (const x of d) s += x; return s / d.length; };
        const before = mean(); const e = document.querySelector('.controls input[type=range]'); e.value = -3; e.dispatchEvent(new Event('input'));
        const look = () => (mean() < 0.8 * before ? done(true) : setTimeout(look, 50)); look(); });";
    assert_eq!(browser.run(exposed, &[]), true, "three stops less is darker");
    browser.write(".stage", "++");
    browser.until("document.querySelector('.level').textContent.endsWith('×')");
    browser.write(".stage", "0");
    browser.until("document.querySelector('.level').textContent === 'fit'");
}

fn jobs_are_listed_and_cancelled(browser: &Browser, farm: &Farm, job: &str) {
    let submit = "const { send } = await import('/page/client.js'); const json = { scene: a[1], name: a[0], size: '64x36', samples: 1000000 };
        return (await send('/v1/jobs', { method: 'POST', json })).status;";
    for name in ["alpha", "beta"] {
        assert_eq!(browser.run(submit, &[json!(name), farm.job(job)["scene"].take()]), 202);
    }
    browser.click("nav a[data-view=jobs]");
    browser.until("document.querySelectorAll('.jobs-table tbody tr').length === 4");
    assert_eq!(browser.value("document.querySelectorAll('.jobs-table img').length"), 0);
    browser.until("document.querySelectorAll('.thumb canvas').length >= 1");
    seen(browser, "jobs");
    browser.press("Job");
    browser.until("document.querySelector('.jobs-table tbody tr').textContent.includes('a room')");
    // By what changes while they are rendered, of all jobs: what is done is ahead of what has begun.
    let first = |states: &str| {
        format!("{states}.includes(document.querySelector('.jobs-table tbody .badge').textContent)")
    };
    browser.press("Progress");
    browser.until(&first("['running', 'queued']"));
    browser.press("Progress");
    browser.until(&first("['done']"));
    browser.press("Time");
    browser.until(&first("['running']"));
    browser.write("input[type=search]", "ALP");
    browser.until("document.querySelectorAll('.jobs-table tbody tr').length === 1");
    browser.rewrite("input[type=search]", "");
    browser.until("document.querySelectorAll('.jobs-table tbody tr').length === 4");
    for name in ["alpha", "beta"] {
        browser.click(&format!("input[aria-label='Choose {name}']"));
    }
    browser.until("document.querySelector('.bulk').textContent.includes('2 chosen')");
    browser.press("Pause");
    browser.until("document.querySelectorAll('.jobs-table .badge.paused').length === 2");
    for name in ["alpha", "beta"] {
        browser.click(&format!("input[aria-label='Choose {name}']"));
    }
    browser.press("Cancel");
    browser.until("document.querySelector('dialog').open");
    nothing_serious(browser, "asking");
    browser.press("Cancel them");
    browser.until("document.querySelectorAll('.jobs-table .badge.cancelled').length === 2");
    browser.press("cancelled");
    browser.until("document.querySelectorAll('.jobs-table tbody tr').length === 2");
    browser.press("all");
}

fn workers_are_listed_and_drained(browser: &Browser) {
    browser.click("nav a[data-view=workers]");
    browser.until("document.querySelector('table').textContent.includes('local-1')");
    browser.until("!document.querySelector('.numbers dd').textContent.includes('–')");
    seen(browser, "workers");
    browser.run("document.querySelector('tbody button').kept = true; document.querySelector('tbody td:last-of-type').previousSibling.textContent = 'long ago'", &[]);
    browser.until("!document.querySelector('tbody').textContent.includes('long ago')");
    assert_eq!(
        browser.value("document.querySelector('tbody button').kept"),
        json!(true),
        "a button is pressed in its first life"
    );
    browser.press("Drain");
    browser.until("document.querySelector('dialog').open");
    browser.run("[...document.querySelectorAll('dialog button')].at(-1).click()", &[]);
    browser.until("['draining', 'gone'].some((s) => document.querySelector(`.badge.${s}`)) || document.querySelector('.empty').textContent.includes('Nobody')");
}

#[test]
fn folders_and_hashes_are_made_in_the_browser() {
    let Some(browser) = Browser::open("hashing") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(folder.path());
    browser.go(&farm.url);
    let lengths = [0, 1, 63, 64, 65, 1023, 1024, 1025, 2048, 3072, 3073, 8192, 31744, 102_400];
    let hashes = "const { Blake3 } = await import('/page/blake3.js');
        return a[0].map((n) => new Blake3().update(Uint8Array.from({ length: n }, (_, i) => i % 251)).hex());";
    let hashes = browser.run(hashes, &[json!(lengths)]);
    for (n, hash) in lengths.iter().zip(hashes.as_array().unwrap()) {
        let bytes: Vec<u8> = (0..*n).map(|i| (i % 251) as u8).collect();
        assert_eq!(*hash, blake3::hash(&bytes).to_hex().as_str(), "of {n} bytes");
    }
    // A folder: the document, its buffer, and what does not belong to it.
    let glb = lamp();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut document: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    document["buffers"][0]["uri"] = json!("data/lamp.bin");
    let sent = "const { packed } = await import('/page/files.js'); const { hashOf } = await import('/page/blake3.js');
        const { upload } = await import('/page/client.js');
        const file = (path, bytes) => ({ path, file: new File([bytes], path.split('/').pop()) });
        const files = [file('scene/lamp.gltf', a[0]), file('scene/data/lamp.bin', Uint8Array.from(a[1])), file('scene/.DS_Store', 'x'), file('notes.txt', 'x')];
        const one = await packed(files); const parts = []; const id = await hashOf(one.blob);
        const report = await upload(`/v1/scenes/${id}`, one.blob, (part) => parts.push(part));
        const again = await packed([...files].reverse());
        return [one.name, id === report.id, report.triangles, parts.at(-1), id === await hashOf(again.blob)];";
    let sent = browser.run(sent, &[json!(document.to_string()), json!(&glb[20 + length + 8..])]);
    assert_eq!(sent, json!(["lamp.zip", true, 4, 1, true]));
    // A file in parts, of which one is there already.
    let parts = "const { upload, send } = await import('/page/client.js'); const blob = new Blob([Uint8Array.from(a[0])]);
        const path = `/v1/scenes/${a[1]}`; const size = Math.ceil(blob.size / 5);
        await fetch(path, { method: 'PUT', body: blob.slice(0, size), headers: { 'content-range': `bytes 0-${size - 1}/${blob.size}` } });
        const parts = []; const report = await upload(path, blob, (part) => parts.push(part), undefined, size);
        return [report.id === a[1], parts.every((part) => part >= 0.2 || part === 0), parts.at(-1)];";
    let mut longer = Glb::new();
    add(&mut longer, "floor", lambert(0.5, 1.0), floor(0.0, 3.0, 0.0, 0.0));
    let longer = longer.finish();
    let sent = browser.run(parts, &[json!(longer), json!(blake3::hash(&longer).to_hex().as_str())]);
    assert_eq!(sent, json!([true, true, 1]));
    // What is dropped is taken like what is chosen.
    browser.press("New job");
    let drop = "const transfer = new DataTransfer(); transfer.items.add(new File([Uint8Array.from(a[0])], 'lamp.glb'));
        document.querySelector('.drop').dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));";
    browser.until("!!document.querySelector('.drop')");
    browser.run(drop, &[json!(glb)]);
    browser.until("document.querySelector('.told').textContent === 'lamp.glb was sent.'");
    browser.until("document.querySelector('.preview').textContent.includes('No worker')");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn who_has_no_token_is_asked_for_one_and_it_is_kept_for_the_session_only() {
    let Some(browser) = Browser::open("signing in") else { return };
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    let made = run(["token", "create", "--role", "read", "--data", data]);
    assert!(made.status.success(), "{made:?}");
    let text = String::from_utf8(made.stdout).unwrap();
    let token = text.split_whitespace().last().unwrap().to_owned();
    let farm = Farm::start(folder.path());
    browser.go(&farm.url);
    browser.until("document.querySelector('dialog.sign')?.open");
    nothing_serious(&browser, "sign-in");
    browser.screenshot("sign-in");
    browser.write("dialog.sign input", &token);
    browser.press("Sign in");
    browser.until("document.querySelector('.empty').textContent.includes('no job yet')");
    assert_eq!(browser.value("Object.values(sessionStorage)"), json!([token]));
    assert_eq!(browser.value("[localStorage.length, document.cookie]"), json!([0, ""]));
    browser.go(&farm.url);
    browser.until("document.querySelector('.empty').textContent.includes('no job yet')");
    browser.press("Sign out");
    browser.until("document.querySelector('dialog.sign')?.open");
    assert_eq!(browser.value("sessionStorage.length"), 0);
}

/// Puts copies of the one job into a farm's database, from copy number `from` to `to`.
fn multiply(data: &Path, [from, to]: [u32; 2]) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let options = SqliteConnectOptions::new().filename(data.join("farm.sqlite"));
        let mut db = options.connect().await.unwrap();
        let columns = "scene, state, reason, version, priority, created_ms, started_ms, ended_ms, paused_ms, spec, progress, certified, manifest, settled";
        let numbers = format!("WITH RECURSIVE n (i) AS (SELECT {from} UNION ALL SELECT i + 1 FROM n WHERE i < {to})");
        let jobs = format!("{numbers} INSERT INTO job (id, name, error_ppb, {columns}) SELECT 'copy' || i, 'copy ' || i, i, {columns} FROM job, n WHERE id NOT LIKE 'copy%'");
        let rows = "look, samples, wall_seconds, worker_seconds, rays, rms_error, relative_error, relative_error_upper";
        let curves = format!("{numbers} INSERT INTO checkpoint (job, {rows}) SELECT 'copy' || i, {rows} FROM checkpoint, n WHERE job NOT LIKE 'copy%'");
        for sql in [jobs, curves] {
            sqlx::query(sqlx::AssertSqlSafe(sql)).execute(&mut db).await.unwrap();
        }
        db.close().await.unwrap();
    });
}

/// Shortest time of ten until the first page of the list is there, in milliseconds.
fn ready(browser: &Browser, farm: &Farm) -> f64 {
    let mut fastest = f64::INFINITY;
    for _ in 0..10 {
        // From the same place: a browser takes its time to make a process for another.
        browser.go(&format!("{}/healthz", farm.url));
        browser.go(&farm.url);
        let at = browser.until("performance.getEntriesByName('ovtigre-ready')[0]?.startTime");
        fastest = fastest.min(at.as_f64().unwrap());
        assert_eq!(browser.value("document.querySelectorAll('.jobs-table tbody tr').length"), 50);
    }
    fastest
}

#[test]
fn a_list_of_ten_thousand_jobs_is_there_at_once() {
    let Some(browser) = Browser::open("a long list") else { return };
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("lamp.glb");
    fs::write(&scene, lamp()).unwrap();
    let farm = Farm::start_with(folder.path(), &["--workers", "1"]);
    let job = farm.client(&["submit", scene.to_str().unwrap(), "--size", "32x18", "--samples", "16"]);
    farm.wait(job.trim(), |job| job["state"] == "done");
    farm.kill();
    multiply(folder.path(), [1, FEW]);
    let farm = Farm::start(folder.path());
    let few = ready(&browser, &farm);
    farm.kill();
    multiply(folder.path(), [FEW + 1, MANY]);
    let farm = Farm::start(folder.path());
    let many = ready(&browser, &farm);
    println!("the first page of {FEW} jobs was there after {few:.0} ms, of {MANY} after {many:.0} ms");
    assert!(
        many < LONGER_MAX * few,
        "the first page was there after {many} ms, of {FEW} jobs after {few} ms"
    );
    let first = text_of(&browser, ".jobs-table tbody tr");
    browser.press("Older");
    browser.until("document.querySelector('.where').textContent.startsWith('51–100')");
    assert_ne!(text_of(&browser, ".jobs-table tbody tr"), first);
    browser.screenshot("jobs-many");
    browser.press("Newer");
    browser.until("document.querySelector('.where').textContent.startsWith('1–50')");
    // Sorted by the farm: the first of all, not of those that were shown.
    browser.press("Job");
    browser.until("document.querySelector('.jobs-table tbody .named a').textContent === 'copy 1'");
    browser.press("Job");
    browser.until("!document.querySelector('.jobs-table tbody .named a').textContent.includes('copy')");
    browser.press("Error");
    browser.until("document.querySelector('.jobs-table tbody .named a').textContent === 'copy 1'");
    browser.press("Older");
    browser.until("document.querySelector('.jobs-table tbody .named a').textContent === 'copy 51'");
    browser.press("Error");
    browser.until("!document.querySelector('.jobs-table tbody .named a').textContent.includes('copy')");
    assert_eq!(browser.value("document.querySelector('th.c-error').ariaSort"), json!("descending"));
    browser.write("input[type=search]", "copy 777");
    browser.until("document.querySelectorAll('.jobs-table tbody tr').length === 11");
}
