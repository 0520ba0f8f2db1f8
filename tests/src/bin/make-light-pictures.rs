//! Renders the pictures of docs/LIGHT.md: `cargo run --release -p ovtigre-tests --bin make-light-pictures -- [--samples N]
//! [--seconds S] [-o FOLDER] [NAME…]`, with 256 samples a pixel, and 6 s of CPU for each picture of the caustic.

use anyhow::Context as _;
use ovtigre_core::{
    film::{
        develop::{Develop, png},
        size::Region,
        sum::Plane,
    },
    path::expression::presets::PRESETS,
    settings::{Layer, Method, Settings, Shows, Strategy},
};
use ovtigre_tests::{
    picture::{rendered, settings},
    room::room,
    scenes::cornell,
    showcase::caustic,
};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Pixels between pictures of a sheet.
const GAP: u32 = 4;

fn main() -> anyhow::Result<()> {
    let mut names: Vec<String> = Vec::new();
    let (mut samples, mut seconds) = (256, 6.0);
    let mut folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/light");
    let mut given = std::env::args().skip(1);
    while let Some(word) = given.next() {
        let mut value = || given.next().with_context(|| format!("{word} needs a value"));
        match word.as_str() {
            "--samples" => samples = value()?.parse()?,
            "--seconds" => seconds = value()?.parse()?,
            "-o" => folder = value()?.into(),
            _ => names.push(word),
        }
    }
    let is_asked = |name: &str| names.is_empty() || names.iter().any(|one| one == name);
    if is_asked("presets") {
        write(&folder, "presets", &presets(samples), 0.0)?;
    }
    if is_asked("pyramid") {
        write(&folder, "pyramid", &pyramid(samples), 0.0)?;
    }
    if is_asked("caustic") {
        write(&folder, "caustic", &caustics(seconds)?, -1.0)?;
    }
    Ok(())
}

/// The lecture's presets of the bundled room, left to right.
fn presets(samples: u32) -> Sheet {
    let mut sheet = Sheet::new(5, [192, 108]);
    for (i, preset) in PRESETS.iter().enumerate() {
        let mut settings = Settings { paths: preset.paths.to_owned(), ..settings(192, 108, 1) };
        settings.gloss = preset.gloss;
        sheet.place(i as u32, 0, &rendered(&room(), &settings, samples).picture().planes[0]);
    }
    sheet
}

/// What each technique adds to a Cornell box: a row a length, from one edge down; s grows to the right.
fn pyramid(samples: u32) -> Sheet {
    let strategies: Vec<Strategy> =
        (1..=4).flat_map(|edges: u32| (0..=edges).map(move |s| Strategy { s, t: edges + 1 - s })).collect();
    let layer =
        |one: &Strategy| Layer { name: format!("s{}t{}", one.s, one.t), shows: Shows::Strategy(*one) };
    let mut settings = Settings { method: Method::Bidirectional, ..settings(96, 96, 1) };
    settings.layers = strategies.iter().map(layer).collect();
    let planes = rendered(&cornell(), &settings, samples).picture().planes;
    let mut sheet = Sheet::new(5, [96, 96]).rows(4);
    for (one, plane) in strategies.iter().zip(&planes[1..]) {
        sheet.place(one.s, one.s + one.t - 2, plane);
    }
    sheet
}

/// A caustic by path, light, bidirectional and photon, each for so many seconds of the processor, whatever else it does. Says how
/// long they took.
#[expect(clippy::print_stderr, reason = "times belong beside the picture, and this is a program")]
fn caustics(seconds: f64) -> anyhow::Result<Sheet> {
    let mut sheet = Sheet::new(4, [192, 144]);
    for (i, method) in [Method::Path, Method::Light, Method::Bidirectional, Method::Photon].iter().enumerate()
    {
        let settings = Settings { method: *method, ..settings(192, 144, 1) };
        let start = cpu_seconds()?;
        rendered(&caustic(), &settings, 8);
        let begun = cpu_seconds()?;
        let samples = (8.0 * seconds / (begun - start)).max(1.0) as u32;
        sheet.place(i as u32, 0, &rendered(&caustic(), &settings, samples).picture().planes[0]);
        eprintln!("{}: {samples} samples in {:.2} s of CPU", method.name(), cpu_seconds()? - begun);
    }
    Ok(sheet)
}

/// Seconds that all threads of this process have run for.
fn cpu_seconds() -> anyhow::Result<f64> {
    const TICKS: f64 = 100.0;
    let stat = fs::read_to_string("/proc/self/stat").context("no account of CPU time: this needs Linux")?;
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let fields = after_name.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
    Ok(fields.collect::<Result<Vec<_>, _>>()?.iter().sum::<f64>() / TICKS)
}

/// Pictures of one size side by side.
struct Sheet {
    columns: u32,
    rows: u32,
    each: [u32; 2],
    plane: Plane,
}

impl Sheet {
    fn new(columns: u32, each: [u32; 2]) -> Self {
        Self { columns, rows: 1, each, plane: Vec::new() }.rows(1)
    }

    fn rows(mut self, rows: u32) -> Self {
        self.rows = rows;
        let [width, height] = self.size();
        self.plane = vec![[1.0; 3]; width as usize * height as usize];
        self
    }

    fn size(&self) -> [u32; 2] {
        let along = |count: u32, each: u32| count * (each + GAP) - GAP;
        [along(self.columns, self.each[0]), along(self.rows, self.each[1])]
    }

    fn place(&mut self, column: u32, row: u32, picture: &Plane) {
        let [width, height] = self.each;
        let start = ((row * (height + GAP)) * self.size()[0] + column * (width + GAP)) as usize;
        let across = self.size()[0] as usize;
        for (y, line) in picture.chunks(width as usize).enumerate() {
            self.plane[start + y * across..][..width as usize].copy_from_slice(line);
        }
    }
}

fn write(folder: &Path, name: &str, sheet: &Sheet, exposure: f32) -> anyhow::Result<()> {
    let [width, height] = sheet.size();
    let region = Region { x: 0, y: 0, width, height };
    let bytes = png(region, &sheet.plane, &Develop { exposure, width: None });
    fs::create_dir_all(folder)?;
    let file = folder.join(format!("{name}.png"));
    fs::write(&file, bytes).with_context(|| format!("{} cannot be written", file.display()))
}
