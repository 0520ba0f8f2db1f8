//! Readers of bytes from outside, and good bytes to begin with.

use crate::{
    glb::glb,
    job_promises,
    matrix::{coated, lens, maps, moving, point, sky},
    mutation::{mutated, mutated_text},
    picture::{rendered, settings},
    promises,
    proxy::Random,
    room::room,
    scenes::furnace,
};
use ovtigre_core::{
    film::{
        append::Prefix,
        batch::Batch,
        exr::{
            PartialAttributes, PictureAttributes, read_layers, read_partial, write_partial, write_picture,
        },
        invalid::InvalidSamples,
        schedule::Schedule,
        size::Size,
        sum::Sum,
    },
    scene::environment::Environment,
};
use std::{
    fs,
    io::{Cursor, Write as _},
    panic::catch_unwind,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// What is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A binary glTF, in any of its bytes.
    Glb,
    /// A glTF document, as text or within a binary whose lengths are right.
    Gltf,
    /// An archive of a glTF with its files.
    Zip,
    /// A batch's partial EXR.
    Partial,
    /// A picture's EXR.
    Picture,
    /// An environment's EXR or HDR.
    Environment,
    /// Stored sums.
    Prefix,
    /// JSON documents of the REST interface.
    Json,
    /// Path expressions.
    Expression,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Glb,
        Self::Gltf,
        Self::Zip,
        Self::Partial,
        Self::Picture,
        Self::Environment,
        Self::Prefix,
        Self::Json,
        Self::Expression,
    ];

    /// Good bytes to begin with.
    pub fn corpus(self) -> Vec<Vec<u8>> {
        let scenes = || -> Vec<Vec<u8>> {
            let cases = [coated(), lens(), maps(), moving(), point(), sky()];
            cases.into_iter().map(|case| case.glb).chain([room(), furnace(0.5, 1.0)]).collect()
        };
        let text = |texts: &[&str]| texts.iter().map(|text| text.as_bytes().to_vec()).collect();
        match self {
            Self::Glb => scenes(),
            Self::Gltf => scenes().iter().map(|scene| parts(scene).0.to_vec()).collect(),
            Self::Zip => scenes().iter().map(|scene| archive(scene)).collect(),
            Self::Partial => vec![partial()],
            Self::Picture => vec![picture()],
            Self::Environment => vec![picture(), RADIANCE.to_vec()],
            Self::Prefix => {
                let (sum, _) = read_partial(&partial(), 64).expect("just written");
                let mut prefix = Prefix::empty(sum.batch.region, 1, 2);
                prefix.append(&Sum { batch: first_of(sum.batch), ..sum }).expect("the first block");
                vec![prefix.to_bytes()]
            }
            Self::Json => text(&DOCUMENTS),
            Self::Expression => text(&EXPRESSIONS),
        }
    }

    /// A changed one of `corpus`.
    pub fn mutated(self, corpus: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
        let [bytes, other] = [(); 2].map(|()| &corpus[random.below(corpus.len())]);
        match self {
            Self::Json | Self::Expression => mutated_text(bytes, other, random),
            Self::Gltf => {
                let document = mutated_text(bytes, other, random);
                // As it is, or with all the bytes that it speaks of.
                if random.happens(0.2) { document } else { glb(&document, &vec![0x3f; 1 << 16]) }
            }
            _ => mutated(bytes, other, random),
        }
    }

    /// Reads it. That it is refused is as good as that it is taken; it must not panic, and what is taken must be as promised.
    pub fn read(self, bytes: &[u8]) {
        match self {
            Self::Glb | Self::Gltf | Self::Zip => promises::scene(bytes),
            Self::Partial => promises::partial(bytes),
            Self::Picture => drop(read_layers(bytes)),
            Self::Environment => drop(Environment::decode(bytes, 0.0)),
            Self::Prefix => drop(Prefix::from_bytes(bytes)),
            Self::Json => job_promises::document(bytes),
            Self::Expression => promises::expression(bytes),
        }
    }

    /// The fuzzer of `tests/fuzz` that reads the same, where there is one.
    pub fn fuzzer(self) -> Option<&'static str> {
        match self {
            Self::Glb | Self::Gltf => Some("gltf"),
            Self::Zip => Some("zip"),
            Self::Partial => Some("partial"),
            Self::Json => Some("job"),
            Self::Expression => Some("expression"),
            Self::Picture | Self::Environment | Self::Prefix => None,
        }
    }

    /// The kept files that fuzzers begin with, and those that a reader stumbled over before.
    pub fn kept(self) -> Vec<(PathBuf, Vec<u8>)> {
        let Some(fuzzer) = self.fuzzer() else { return Vec::new() };
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(fuzzer);
        let files = fs::read_dir(folder).into_iter().flatten().map(|file| file.expect("a folder").path());
        // What fuzzers add of themselves is named by its hash.
        let kept = files.filter(|path| path.file_name().is_some_and(|name| name.len() < 40));
        let mut kept: Vec<_> = kept.map(|path| (path.clone(), fs::read(path).expect("a file"))).collect();
        kept.sort();
        kept
    }
}

/// A picture of 2×1 pixels.
const RADIANCE: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x40\x40\x40\x80";

const DOCUMENTS: [&str; 6] = [
    r#"{"scene":"0000000000000000000000000000000000000000000000000000000000000000","name":"a","size":"64x32","camera":"0",
        "samples":256,"error":0.01,"seconds":30,"paths":"L(D|S)*E","method":"bidirectional","layers":["a=LDE","b=L.{2}E"],
        "strategies":"0,3;1,2","weights":"power","bounces":7,"seed":3,"replicates":4,"priority":1,"weight":2,"tags":["gpu"],
        "max_workers":3}"#,
    r#"{"scene":"0000000000000000000000000000000000000000000000000000000000000000","size":[1280,720],"preset":"whitted",
        "lens_radius":0.1,"focus_distance":2,"shutter":[0,0.5],"environment":[1,1,1],"environment_rotation":90,
        "shadows":"off","region":{"x":1,"y":2,"width":30,"height":20}}"#,
    r#"{"priority":3,"state":"paused","samples":512,"error":0.5,"weight":2,"max_workers":1}"#,
    r#"{"holding":[{"lease":"l1","done":0.5}],"wants":2,"scenes":[],"leaving":false,"beat":3}"#,
    r#"{"reason":"no memory","kind":"worker"}"#,
    r#"{"name":"w","threads":4,"build":"0.1.0","instruction_set":"x86-64-v3","tags":["a"]}"#,
];

const EXPRESSIONS: [&str; 8] = [
    "L(D|S)*E",
    "L[D|S]S_M*E",
    "E(S|D)+L",
    "L'lamp'D?S{2}E",
    "LD{1,5}(S_M|D)*.{3}E",
    "L((D|S)*(S_M D)+)?E",
    "L.{0,12}E",
    "LS_T*DE",
];

/// The document and the rest of a binary glTF.
fn parts(glb: &[u8]) -> (&[u8], &[u8]) {
    let length = u32::from_le_bytes(glb[12..16].try_into().expect("four bytes")) as usize;
    (&glb[20..20 + length], &glb[20 + length + 8..])
}

fn archive(scene: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let (document, buffer) = parts(scene);
    let document = String::from_utf8_lossy(document);
    let document = document.replacen("\"buffers\":[{", "\"buffers\":[{\"uri\":\"rest.bin\",", 1);
    for (name, bytes) in [("scene.gltf", document.as_bytes()), ("rest.bin", buffer)] {
        let options = zip::write::SimpleFileOptions::default();
        zip.start_file(name, options).expect("a plain name");
        zip.write_all(bytes).expect("memory");
    }
    zip.finish().expect("memory").into_inner()
}

/// The first block of a batch's sequence.
fn first_of(batch: Batch) -> Batch {
    Schedule::new(batch.region, 2, 4, 300).batch(0, batch.replicate, 0).expect("in the schedule")
}

fn partial() -> Vec<u8> {
    let size = Size { width: 8, height: 8 };
    let batch = Schedule::new(size.frame(), 2, 4, 300).batch(0, 1, 1).expect("in the schedule");
    let plane = |v: f32| (0..64).map(|i| [i as f32 * v, 1.0, v]).collect();
    let invalid = InvalidSamples::default();
    let sum = Sum { batch, planes: vec![plane(1.0), plane(0.3)], invalid, rays: 12, tile_rays: Vec::new() };
    let attributes = PartialAttributes {
        job: "j1".to_owned(),
        scene: "0".repeat(64),
        method: "path".to_owned(),
        solution: Some("{}".to_owned()),
        allocation: None,
    };
    write_partial(&sum, size, &attributes)
}

fn picture() -> Vec<u8> {
    let picture = rendered(&furnace(0.5, 1.0), &settings(6, 4, 2), 8).picture();
    let attributes = PictureAttributes {
        job: "j1".to_owned(),
        scene: "0".repeat(64),
        samples: 8.0,
        seed: 0,
        method: "path".to_owned(),
        paths: "L(D|S)*E".to_owned(),
        camera: "0".to_owned(),
        invalid: InvalidSamples::default(),
        layers: Vec::new(),
        manifest: "0".repeat(64),
        render_seconds: 1.0,
        software: "a test".to_owned(),
        capture_date: "2026:01:01 00:00:00".to_owned(),
    };
    write_picture(&picture, &attributes)
}

/// Bytes that a reader did not bear.
#[derive(Debug)]
pub struct Stumbled {
    /// Which reader.
    pub target: Target,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// What became of it.
    pub how: String,
}

/// Slowest answer to a few thousand bytes.
const SLOWEST: Duration = Duration::from_secs(10);

/// Reads one input.
pub fn bear(target: Target, bytes: &[u8]) -> Result<(), Stumbled> {
    let stumbled = |how: String| Stumbled { target, bytes: bytes.to_vec(), how };
    let begun = Instant::now();
    catch_unwind(|| target.read(bytes)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        stumbled(text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string)).unwrap_or_default())
    })?;
    match begun.elapsed() {
        time if time > SLOWEST => Err(stumbled(format!("it took {time:?}"))),
        _ => Ok(()),
    }
}

/// Reads changed inputs until `goes_on` says no; how many.
pub fn torment(target: Target, seed: u64, mut goes_on: impl FnMut(u64) -> bool) -> Result<u64, Stumbled> {
    let mut random = Random::new(seed);
    let kept = target.kept().into_iter().map(|(_, bytes)| bytes);
    let corpus: Vec<Vec<u8>> = target.corpus().into_iter().chain(kept).collect();
    corpus.iter().try_for_each(|good| bear(target, good))?;
    let mut count = 0;
    while goes_on(count) {
        bear(target, &target.mutated(&corpus, &mut random))?;
        count += 1;
    }
    Ok(count)
}

/// Most bytes that this process ever had in memory.
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches(" kB").parse::<u64>().ok()? << 10)
}
