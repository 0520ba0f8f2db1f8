//! The picture of the page in README.md.

use image::{
    DynamicImage,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use ovtigre_tests::{
    browser::{Browser, Scheme},
    program::Farm,
};
use std::{fs::File, path::Path, thread::sleep, time::Duration};

/// The scene that comes with the program.
const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/room.glb");
/// Pixels of the picture: a window of a usual desk.
const SIZE: [u32; 2] = [1440, 1010];

/// Run with `./tests/services cargo test --workspace --test it the_page_is_drawn -- --ignored`, some minutes.
#[test]
#[ignore = "it writes docs/page.png, and renders for minutes"]
fn the_page_is_drawn_for_the_readme() {
    let Some(browser) = Browser::open("drawing the page") else { return };
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start_with(folder.path(), &["--workers", "1"]);
    let how = ["--size", "384x216", "--samples", "32", "--error", "0.2", "--method", "bidirectional"];
    let wished = [&how[..], &["--layer", "caustics=LS+DE"]].concat();
    let job = farm.client(&[&["submit", ROOM], &wished[..]].concat());
    while farm.job(job.trim())["state"] != "done" {
        sleep(Duration::from_secs(1));
    }
    browser.look(SIZE[0], SIZE[1], Scheme::Light);
    browser.go(&format!("{}/#/job/{}", farm.url, job.trim()));
    browser.until("document.querySelector('.stage.filled')");
    browser.rewrite(".against", "layer:error");
    browser.until(
        "document.querySelector('canvas.side.b').width > 1 && !document.querySelector('.legend').hidden",
    );
    browser.until("document.querySelector('canvas.side.a').width === 384");
    browser.rewrite("input.wipe", "62");
    let point = "const s = document.querySelector('.stage'); const b = s.getBoundingClientRect();
        s.dispatchEvent(new PointerEvent('pointermove', { clientX: b.left + 0.4 * b.width, clientY: b.top + 0.55 * b.height, bubbles: true }));";
    browser.run(point, &[]);
    browser.until("document.querySelector('.read-out').textContent.includes('±')");
    let taken = image::open(browser.screenshot("readme")).unwrap();
    let shown = DynamicImage::from(taken.crop_imm(0, 0, SIZE[0], SIZE[1]).to_rgb8());
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/page.png");
    let best = PngEncoder::new_with_quality(
        File::create(file).unwrap(),
        CompressionType::Best,
        FilterType::Adaptive,
    );
    shown.write_with_encoder(best).unwrap();
}
