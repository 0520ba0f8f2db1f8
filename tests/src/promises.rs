//! What holds of bytes from outside that the core takes. That they are refused is as good; a broken promise panics.
//!
//! Knows nothing but the core, so that `tests/fuzz` can be built without a farm.

use ovtigre_core::{
    bsdf::event::Letter,
    film::{
        exr::{read_partial, write_partial},
        size::Size,
    },
    gltf::limits::Limits,
    path::expression::language::{EyeState, Language, LightState, LightTag, Rules},
    render::inspect::inspect,
};

/// Pixels of a partial that is asked for.
const PARTIAL_PIXELS: usize = 64;
/// Letters of the longest words that are tried.
const WORD_MAX: u32 = 4;
/// Names of lights that are tried.
const TAGS_MAX: usize = 6;

/// A farm's, but for what it would take to reach them.
pub fn limits() -> Limits {
    Limits {
        buffer_bytes: 64 << 20,
        document_bytes: 16 << 20,
        triangles: 1_000_000,
        instances: 100_000,
        picture_pixels: 1 << 22,
        morphed_vertices: 1 << 22,
        ..Limits::default()
    }
}

/// An uploaded scene: a binary glTF, its document alone, or an archive. What is in it is within the limits and has finite
/// numbers, and a fault says what it is.
pub fn scene(bytes: &[u8]) {
    let limits = limits();
    let contents = match inspect(bytes, &limits) {
        Ok(contents) => contents,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            let pointer = error.pointer().unwrap_or_default();
            return assert!(pointer.is_empty() || pointer.starts_with('/'), "{pointer}");
        }
    };
    let report = &contents.report;
    assert!(report.triangles <= limits.triangles && report.instances <= limits.instances, "{report:?}");
    assert!(report.pixels <= limits.picture_pixels, "{report:?}");
    assert!(contents.brightest.is_finite() && contents.brightest >= 0.0, "{}", contents.brightest);
    let aspects = contents.aspects.iter().flatten();
    aspects.for_each(|aspect| assert!(aspect.is_finite() && *aspect > 0.0, "{aspect}"));
    assert_eq!(
        (contents.aspects.len(), contents.parallel.len()),
        (report.camera_names.len(), contents.aspects.len())
    );
}

/// A partial EXR: its sum has finite numbers only, and is the same when it is written and read again.
pub fn partial(bytes: &[u8]) {
    let Ok((sum, says)) = read_partial(bytes, PARTIAL_PIXELS) else { return };
    let region = sum.batch.region;
    assert!(region.pixels() <= PARTIAL_PIXELS && sum.batch.block.count > 0, "{}", sum.batch);
    for plane in &sum.planes {
        assert_eq!(plane.len(), region.pixels());
        assert!(plane.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
    }
    let (Some(width), Some(height)) =
        (region.x.checked_add(region.width), region.y.checked_add(region.height))
    else {
        return;
    };
    let frame = Size { width, height };
    // What no farm asks for, it need not write either.
    if !region.is_in(frame) || i32::try_from(width.max(height)).is_err() {
        return;
    }
    let (again, said) =
        read_partial(&write_partial(&sum, frame, &says), PARTIAL_PIXELS).expect("it was just written");
    assert_eq!((again.hash(), said), (sum.hash(), says));
    assert_eq!(again, sum);
}

/// Where two subpaths stand that make a word together.
fn joined(language: &Language, eye: Option<EyeState>, light: Option<LightState>) -> Rules {
    eye.zip(light).map_or(Rules::NONE, |(eye, light)| language.accepts(eye, light))
}

/// A word is of the same rules wherever its two subpaths are joined.
fn try_word(language: &Language, tag: LightTag, word: &[Letter]) {
    let whole = language.accepts_word(tag, word);
    for cut in 0..=word.len() {
        let (near, far) = word.split_at(cut);
        let eye =
            near.iter().try_fold(language.eye_start(), |state, letter| language.eye_next(state, *letter));
        let light = language.light_start(tag);
        let light = light.and_then(|start| {
            far.iter().rev().try_fold(start, |state, letter| language.light_next(state, *letter))
        });
        assert_eq!(joined(language, eye, light), whole, "{word:?} cut at {cut}");
    }
    if !whole.is_empty() {
        let length = word.len() as u32;
        assert!(language.shortest() <= length && language.longest().is_none_or(|longest| length <= longest));
        assert!(word.iter().all(|letter| language.letters().has(*letter)));
    }
}

/// A path expression, alone and beside another: words are the same from both ends, and the same as alone.
pub fn expression(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let language = match Language::compile(&[&text]) {
        Ok(language) => language,
        Err(error) => {
            assert!(error.rule == 0 && error.at <= text.chars().count(), "{error}");
            return assert!(error.marked().ends_with('^'));
        }
    };
    let both = Language::compile(&["L(D|S)*E", &text]).ok();
    for length in 0..=WORD_MAX {
        for number in 0..Letter::COUNT.pow(length) {
            let letter = |place| Letter::ALL[number / Letter::COUNT.pow(place) % Letter::COUNT];
            let word: Vec<Letter> = (0..length).map(letter).collect();
            for tag in language.tags().take(TAGS_MAX) {
                try_word(&language, tag, &word);
            }
            if let Some(both) = &both {
                let (alone, beside) = (LightTag::UNNAMED, both.accepts_word(LightTag::UNNAMED, &word));
                assert_eq!(language.accepts_word(alone, &word).has(0), beside.has(1), "{word:?}");
            }
        }
    }
}
