//! A folder is dropped onto the page, seen by its second camera through a lens while it moves, and held against a file.

use crate::page::{nothing_serious, seen, text_of};
use glam::Vec3;
use ovtigre_tests::{
    browser::Browser,
    glb::Glb,
    program::Farm,
    scenes::{add, coloured_lambert, cuboid, flipped, floor, lambert},
    textures::png,
};
use serde_json::{Value, json};
use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
};

/// Where what is compared with is chosen.
const AGAINST: &str = ".against";

/// A folder as a user has it: a document, its buffer in a folder of its own, and what does not belong to it. Three blocks stand in
/// a row, the one in the middle moves to the right for a second, and of two cameras the second looks along the row.
fn moving(folder: &Path) -> PathBuf {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(0.6, 0.0), floor(0.0, 12.0, 0.0, 0.0));
    add(&mut glb, "lamp", lambert(0.0, 30.0), flipped(floor(4.0, 1.5, 0.0, 1.0)));
    let blocks =
        [([0.8, 0.2, 0.1], 1.2), ([0.2, 0.6, 0.2], -0.6), ([0.1, 0.3, 0.8], -3.0)].map(|(colour, z)| {
            let corner = Vec3::new(0.45 * z - 0.35, 0.0, z - 0.35);
            glb.body(coloured_lambert(colour), cuboid(corner, corner + Vec3::new(0.7, 0.9, 0.7)))
        });
    glb.animate(blocks[1], "translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 0.8, 0.0, 0.0]);
    glb.perspective(Vec3::new(0.0, 9.0, 0.1), Vec3::ZERO, 45.0);
    glb.perspective(Vec3::new(0.0, 1.4, 4.2), Vec3::new(0.0, 0.5, 0.0), 45.0);
    let glb = glb.finish();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut document: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    document["buffers"][0]["uri"] = json!("data/moving.bin");
    let scene = folder.join("my scene");
    fs::create_dir_all(scene.join("data")).unwrap();
    fs::write(scene.join("moving.gltf"), document.to_string()).unwrap();
    fs::write(scene.join("data/moving.bin"), &glb[20 + length + 8..]).unwrap();
    fs::write(scene.join(".DS_Store"), "x").unwrap();
    fs::write(scene.join("notes.txt"), "not of the scene").unwrap();
    scene
}

#[test]
fn a_dropped_folder_is_seen_through_a_lens_and_held_against_a_file() {
    let Some(browser) = Browser::open("dropping a folder") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start_with(&folder.path().join("farm"), &["--workers", "1"]);
    browser.go(&farm.url);
    browser.press("New job");
    a_folder_is_dropped(&browser, folder.path());
    let job = a_lens_and_a_shutter_are_typed(&browser);
    let wished = farm.job(&job)["request"].take();
    assert_eq!(wished["lens_radius"], 0.15);
    assert_eq!(wished["focus_distance"], 2.6);
    assert_eq!(wished["shutter"], json!([0.0, 1.0]));
    assert_eq!(wished["sampling"], "adaptive");
    assert_eq!((&wished["camera"], &wished["method"]), (&json!("1"), &json!("path")));
    browser.until("document.querySelector('.badge').textContent === 'done'");
    browser.until("document.querySelector('.stage').ariaLabel.includes('after 128 samples')");
    for fact in ["radius 0.15 m, in focus at 2.6 m", "0 to 1 s", "where the error is"] {
        assert!(text_of(&browser, ".facts").contains(fact), "{fact}: {}", text_of(&browser, ".facts"));
    }
    browser.click(".without summary");
    assert!(text_of(&browser, ".without").contains("light tree"), "{}", text_of(&browser, ".without"));
    seen(&browser, "job-lens");
    a_file_is_held_against_it(&browser, folder.path());
    a_job_is_left(&browser, &farm, &job);
}

fn a_folder_is_dropped(browser: &Browser, folder: &Path) {
    let empty = folder.join("empty");
    fs::create_dir(&empty).unwrap();
    fs::write(empty.join("notes.txt"), "no scene").unwrap();
    browser.carry(".drop", &[&empty]);
    browser.until("document.querySelector('.drop.over')");
    browser.screenshot("drop-over");
    browser.let_go(".drop", &[&empty]);
    browser.until("document.querySelector('.told.bad')?.textContent.includes('no .glb, .gltf or .zip')");
    assert!(browser.value("document.querySelector('.drop.over') === null").as_bool().unwrap());
    // Beside the place for it: it is taken all the same, and the page stays.
    browser.let_go("h1", &[&moving(folder)]);
    browser.until("document.querySelector('.told').textContent === 'moving.zip was sent.'");
    // A floor and a lamp of two triangles each, three blocks of twelve.
    assert!(text_of(browser, ".facts").contains("Triangles40"), "{}", text_of(browser, ".facts"));
    browser.until("document.querySelector('.preview canvas')");
    browser.let_go(".drop", &[&folder.join("my scene")]);
    browser.until("document.querySelector('.told').textContent.includes('here already')");
}

/// Fills in the form by keys alone; the job.
fn a_lens_and_a_shutter_are_typed(browser: &Browser) -> String {
    let fault = |field: &str, says: &str| {
        browser.until(&format!(
            "document.querySelector('#f-{field}-fault').textContent.includes({})
                && document.querySelector('#f-{field}').getAttribute('aria-invalid') === 'true'
                && document.querySelector('.send button').disabled",
            json!(says)
        ));
    };
    browser.rewrite("#f-size", "240");
    browser.rewrite("#f-camera", "1");
    browser.write("#f-samples", "128");
    browser.rewrite("#f-method", "light");
    browser.rewrite("#f-sampling", "adaptive");
    fault("sampling", "pixels cannot have different numbers of them");
    browser.rewrite("#f-method", "path");
    browser.until("document.querySelector('#f-sampling-fault').textContent === ''");
    browser.press("Lens and shutter");
    browser.write("#f-lens_radius", "1e");
    fault("lens_radius", "this is no number");
    browser.rewrite("#f-lens_radius", "");
    browser.write("#f-lens_radius", "-0.15");
    fault("lens_radius", "a number of metres, 0 for a pinhole");
    browser.rewrite("#f-lens_radius", "");
    browser.write("#f-lens_radius", "0.15");
    fault("focus_distance", "a lens needs a distance in focus");
    browser.write("#f-focus_distance", "2.6");
    browser.until("document.querySelector('#f-focus_distance-fault').textContent === ''");
    browser.write("#f-shutter", "0.5");
    browser.write("#f-closes", "0.25");
    fault("shutter", "not before it opens");
    browser.screenshot("new-job-lens-fault");
    nothing_serious(browser, "new-job-lens-fault");
    // A fault in what is folded shows.
    browser.press("Lens and shutter");
    browser.until("!document.querySelector('#f-shutter').checkVisibility()");
    browser.rewrite("#f-samples", "129");
    browser.until("document.querySelector('#f-shutter-fault').checkVisibility()");
    browser.rewrite("#f-samples", "128");
    browser.rewrite("#f-shutter", "");
    browser.rewrite("#f-closes", "");
    browser.write("#f-closes", "1");
    browser.until("document.querySelector('.verdict .facts')?.textContent.includes('240 × 135')");
    browser.until("!document.querySelector('.send button').disabled");
    seen(browser, "new-job-lens");
    browser.press("Render");
    browser.until("document.querySelector('.stage')");
    browser.value("location.hash.split('/').pop()").as_str().unwrap().to_owned()
}

/// A picture of the user's own, beside a file that is none.
fn a_file_is_held_against_it(browser: &Browser, folder: &Path) {
    let texels: Vec<[u8; 4]> = (0..24 * 13).map(|i| [255, 0, (i % 24) as u8 * 10, 255]).collect();
    let (red, none) = (folder.join("reference.png"), folder.join("none.png"));
    fs::write(&red, png(24, &texels)).unwrap();
    fs::write(&none, "no picture").unwrap();
    browser.without_file_windows();
    browser.press("File …");
    let chosen = |path: &Path| browser.write("input[aria-label='Reference picture']", path.to_str().unwrap());
    chosen(&none);
    browser.until("document.querySelector('.notice.error')?.textContent.includes('none.png is no picture')");
    assert_eq!(browser.value(&format!("document.querySelector('{AGAINST}').value")), "none");
    chosen(&red);
    browser.until("document.querySelector('canvas.side.b').width === 24");
    assert_eq!(browser.value(&format!("document.querySelector('{AGAINST}').value")), "file:");
    let side = "const c = document.querySelector('canvas.side.b'); return [...c.getContext('2d').getImageData(3, 3, 1, 1).data];";
    assert_eq!(browser.run(side, &[]), json!([255, 0, 30, 255]));
    let edge = "parseFloat(document.querySelector('.line').style.left) / document.querySelector('.stage').clientWidth";
    assert!((browser.value(edge).as_f64().unwrap() - 0.5).abs() < 0.01);
    // Ten times to the right.
    browser.write("input.wipe", &"\u{e014}".repeat(10));
    browser.until(&format!("Math.abs({edge} - 0.6) < 0.01"));
    assert!(text_of(browser, AGAINST).contains("reference.png"));
    browser.run("document.querySelectorAll('.notice').forEach((note) => note.remove());", &[]);
    seen(browser, "job-wipe-file");
    // Something else and back again: the file is still known.
    browser.rewrite(AGAINST, "layer:error");
    browser.until("document.querySelector('canvas.side.b').width === 240");
    browser.rewrite(AGAINST, "file:");
    browser.until("document.querySelector('canvas.side.b').width === 24");
    browser.rewrite(AGAINST, "none");
    browser.until("document.querySelector('input.wipe').hidden");
}

/// What is left of a job page: the report, the priority, the end; and the keys that lead from view to view.
fn a_job_is_left(browser: &Browser, farm: &Farm, job: &str) {
    let report = "const made = URL.createObjectURL; return new Promise((done) => {
        URL.createObjectURL = (blob) => { URL.createObjectURL = made; blob.text().then((text) => done(JSON.parse(text))); return made.call(URL, blob); };
        [...document.querySelectorAll('button')].find((b) => b.textContent === 'Report').click(); });";
    let report = browser.run(report, &[]);
    assert_eq!(report["job"]["id"], job);
    assert_eq!(report["rows"].as_array().unwrap().last().unwrap()["samples"], 128);
    browser.press("More samples");
    browser.rewrite("#asked", "1000000");
    browser.press("Draw more");
    browser.until("document.querySelector('.badge').textContent === 'running'");
    // The plot shows the new target at once, and when it will be met.
    browser.press("Tighter error");
    browser.rewrite("#asked", "1.5");
    browser.press("Set target");
    browser.until("document.querySelector('.plot').textContent.includes('target 1.50')");
    browser.until("document.querySelector('.plot text.ahead')?.textContent.startsWith('expected at')");
    assert!(
        browser
            .value("document.querySelector('.plot-space + .hint').textContent.includes('target expected at')")
            .as_bool()
            .unwrap()
    );
    browser.screenshot("job-expected");
    browser.press("Priority");
    browser.rewrite("#asked", "7");
    browser.press("Set");
    browser.until("document.querySelector('.numbers').textContent.includes('priority 7')");
    assert_eq!(farm.job(job)["priority"], 7);
    browser.press("Cancel");
    browser.press("Cancel the job");
    browser.until("document.querySelector('.badge').textContent === 'cancelled'");
    browser.screenshot("job-cancelled");
    browser.press("Remove");
    browser.press("Remove it");
    browser.until("document.querySelector('.empty')?.textContent.includes('no job yet')");
    for (key, view) in [("w", "#/workers"), ("n", "#/new"), ("g", "#/jobs")] {
        browser.write("body", key);
        browser.until(&format!("location.hash.startsWith('{view}')"));
    }
    browser.write("body", "/");
    browser.until("document.activeElement.type === 'search'");
}

/// The folder of `moving` in one file, as an archiver packs it.
fn packed(folder: &Path) -> PathBuf {
    let scene = moving(folder);
    let file = folder.join("packed.zip");
    let mut zip = zip::ZipWriter::new(fs::File::create(&file).unwrap());
    for name in ["moving.gltf", "data/moving.bin", "notes.txt"] {
        zip.start_file(format!("my scene/{name}"), zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(&fs::read(scene.join(name)).unwrap()).unwrap();
    }
    zip.finish().unwrap();
    file
}

#[test]
fn a_dropped_zip_is_previewed_before_anybody_renders_it() {
    let Some(browser) = Browser::open("dropping a zip") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(&folder.path().join("farm"));
    browser.go(&farm.url);
    browser.press("New job");
    browser.let_go(".drop", &[&packed(folder.path())]);
    browser.until("document.querySelector('.told').textContent === 'packed.zip was sent.'");
    assert!(text_of(&browser, ".facts").contains("Triangles40"), "{}", text_of(&browser, ".facts"));
    browser.rewrite("#f-size", "240");
    browser.until("document.querySelector('.verdict .facts')?.textContent.includes('240 × 135')");
    browser.until("!document.querySelector('.send button').disabled");
    browser.press("Render");
    browser.until("document.querySelector('.stage')?.ariaLabel.startsWith('A preview of')");
    seen(&browser, "job-preview");
}
