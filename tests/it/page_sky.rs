//! An image to light a scene with is uploaded on the page, and seen in the picture.

use crate::page::{seen, text_of};
use glam::Vec3;
use image::{Rgb, codecs::hdr::HdrEncoder};
use ovtigre_tests::{
    browser::Browser,
    glb::Glb,
    program::Farm,
    scenes::{add, lambert, sphere},
};
use serde_json::json;
use std::{fs, path::Path};

/// Where the image is chosen.
const SKY: &str = "#choose-sky";

/// Lets the first answer about a picture be that there is none yet, and come when the job is done: it is not the last word.
const LATE: &str = "const send = window.fetch;
    let first = true;
    window.fetch = async (path, ...rest) => {
        if (!first || !String(path).includes('/image.png')) return send(path, ...rest);
        first = false;
        while (document.querySelector('.badge')?.textContent !== 'done') await new Promise((done) => setTimeout(done, 10));
        return new Response(JSON.stringify({ title: 'no picture yet' }), { status: 404 });
    };";

/// A ball, seen from the side: the sky around it from 30° below the horizon to 30° above.
fn ball() -> Vec<u8> {
    let mut glb = Glb::new();
    add(&mut glb, "ball", lambert(0.7, 0.0), sphere(Vec3::ZERO, 1.0, 24));
    glb.perspective(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 60.0);
    glb.finish()
}

/// Blue above the horizon, red below it.
fn sky() -> Vec<u8> {
    let mut bytes = Vec::new();
    let texels: Vec<Rgb<f32>> =
        (0..16 * 8).map(|i| if i < 16 * 4 { Rgb([0.0, 0.1, 1.0]) } else { Rgb([1.0, 0.1, 0.0]) }).collect();
    HdrEncoder::new(&mut bytes).encode(&texels, 16, 8).unwrap();
    bytes
}

#[test]
fn a_scene_is_lit_by_an_image_that_is_uploaded_on_the_page() {
    let Some(browser) = Browser::open("an environment") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start_with(&folder.path().join("farm"), &["--workers", "1"]);
    let keep = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        fs::write(&file, bytes).unwrap();
        file
    };
    let ball = keep("ball.glb", &ball());
    let (good, bad) = (keep("sky.hdr", &sky()), keep("bad.exr", b"no image"));
    browser.go(&farm.url);
    browser.press("New job");
    let choose = |css: &str, file: &Path| browser.write(css, file.to_str().unwrap());
    choose("#choose-file", &ball);
    browser.until("document.querySelector('.told').textContent === 'ball.glb was sent.'");
    browser.press("Light from infinitely far");
    // What is no image, and what is a scene, is said at the field.
    let fault = "document.querySelector('#f-environment-fault').textContent";
    choose(SKY, &bad);
    browser.until(&format!("{fault} !== ''"));
    browser.screenshot("new-job-sky-fault");
    let said = text_of(&browser, "#f-environment-fault");
    choose(SKY, &ball);
    browser.until(&format!("{fault} !== {} && {fault} !== ''", json!(said)));
    assert_eq!(text_of(&browser, "#f-environment-fault"), "ball.glb is no image to light a scene with");
    assert_eq!(browser.value("document.querySelector('#f-environment').value"), "");
    choose(SKY, &good);
    let id = blake3::hash(&sky()).to_hex().to_string();
    browser.until(&format!("document.querySelector('#f-environment').value === '{id}'"));
    browser.until(&format!("{fault} === ''"));
    browser.rewrite("#f-environment_rotation", "90");
    browser.rewrite("#f-size", "48");
    browser.rewrite("#f-height", "48");
    browser.rewrite("#f-samples", "16");
    browser.until("document.querySelector('.verdict .facts')?.textContent.includes('48 × 48')");
    browser.until("!document.querySelector('.send button').disabled");
    seen(&browser, "new-job-sky");
    browser.run(LATE, &[]);
    browser.press("Render");
    browser.until("document.querySelector('.badge')?.textContent === 'done'");
    let job = browser.value("location.hash.split('/').pop()");
    let wished = farm.job(job.as_str().unwrap())["request"].take();
    assert_eq!((&wished["environment"], &wished["environment_rotation"]), (&json!(id), &json!(90.0)));
    // The sky is seen around the ball, blue at the top and red at the bottom.
    browser.until("document.querySelector('.stage').ariaLabel.includes('after 16 samples')");
    browser.until("document.querySelector('canvas.side.a').width === 48");
    let pixels = "const c = document.querySelector('canvas.side.a').getContext('2d');
        return [[1, 1], [1, 46]].map(([x, y]) => [...c.getImageData(x, y, 1, 1).data]);";
    let pixels = browser.run(pixels, &[]);
    let light = |y: usize, c: usize| pixels[y][c].as_u64().unwrap();
    assert!(light(0, 2) > 200 && light(0, 0) < 50, "{pixels}");
    assert!(light(1, 0) > 200 && light(1, 2) < 50, "{pixels}");
    let facts = text_of(&browser, ".facts");
    assert!(facts.contains(&format!("Environment{}…turned by 90.0°", &id[..12])), "{facts}");
    seen(&browser, "job-sky");
}
