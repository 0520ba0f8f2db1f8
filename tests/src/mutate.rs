//! Hostile glTF: scenes of the corpus changed by chance, and what becomes of them.

use crate::{
    corpus::{Piece, scenes},
    glb::glb,
    picture::{in_environment, rendered_of, settings},
    proxy::Random,
};
use ovtigre_core::{
    render::prepare::prepare,
    settings::{Settings, Shutter},
};
use serde_json::{Value, json};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::mpsc::{RecvTimeoutError, channel},
    time::Duration,
};

/// Longest that a file may take.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// Files from a seed.
#[derive(Debug)]
pub struct Mutator {
    corpus: Vec<Piece>,
    seed: u64,
}

/// What became of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A picture was rendered.
    Rendered,
    /// It was refused with an error.
    Refused,
    /// The reader, or the render, panicked: what it said.
    Panicked(String),
    /// It was not done within [`PATIENCE`].
    Hung,
}

impl Mutator {
    /// Its files depend on nothing but the seed and their number.
    pub fn new(seed: u64) -> Self {
        Self { corpus: scenes(), seed }
    }

    /// File `number`; the first are the scenes of the corpus as they are.
    pub fn file(&self, number: u64) -> Vec<u8> {
        if let Some(piece) = self.corpus.get(number as usize) {
            return glb(piece.json.to_string().as_bytes(), &piece.binary);
        }
        let mut random = Random::new(self.seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ number);
        let mut piece = self.corpus[random.below(self.corpus.len())].clone();
        let other = &self.corpus[random.below(self.corpus.len())];
        match random.below(10) {
            8 | 9 => {
                for _ in 0..=random.below(3) {
                    change_number(&mut piece.json, &mut random);
                }
            }
            0 => {
                let mut bytes = glb(piece.json.to_string().as_bytes(), &piece.binary);
                let rest = glb(other.json.to_string().as_bytes(), &other.binary);
                change_bytes(&mut bytes, &rest, &mut random);
                return bytes;
            }
            1 => change_bytes(&mut piece.binary, &other.binary, &mut random),
            2 => {
                let mut text = piece.json.to_string().into_bytes();
                change_bytes(&mut text, other.json.to_string().as_bytes(), &mut random);
                return glb(&text, &piece.binary);
            }
            kind => {
                for _ in 0..=random.below(2) {
                    change_value(&mut piece.json, &other.json, &mut random);
                }
                if kind == 7 {
                    change_words(&mut piece.binary, &mut random);
                }
            }
        }
        glb(piece.json.to_string().as_bytes(), &piece.binary)
    }
}

/// Bits turned, pieces cut off, taken out, doubled, or put in from elsewhere.
fn change_bytes(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    for _ in 0..1 << random.below(5) {
        if bytes.is_empty() {
            return;
        }
        let start = random.below(bytes.len());
        let end = (start + 1 + random.below(64)).min(bytes.len());
        match random.below(8) {
            0 => bytes.truncate(start),
            1 => drop(bytes.drain(start..end)),
            2 => {
                let again = bytes[start..end].to_vec();
                bytes.splice(start..start, again);
            }
            3 if !other.is_empty() => {
                let from = random.below(other.len());
                let to = (from + 1 + random.below(64)).min(other.len());
                bytes.splice(start..end, other[from..to].iter().copied());
            }
            _ => bytes[start] ^= 1 << random.below(8),
        }
    }
}

/// Numbers of four bytes at which readers of vertices and indices stumble.
fn change_words(bytes: &mut [u8], random: &mut Random) {
    let numbers = [f32::NAN, f32::INFINITY, f32::MAX, -f32::MAX, f32::MIN_POSITIVE, 1e-45, -0.0, 1e20];
    for _ in 0..=random.below(16) {
        let words = bytes.len() / 4;
        if words == 0 {
            return;
        }
        let at = 4 * random.below(words);
        let word = match random.below(12) {
            number @ 0..8 => numbers[number].to_bits(),
            8 => u32::MAX,
            9 => 1 << 31,
            10 => 65_535,
            _ => random.draw() as u32,
        };
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
    }
}

/// One value of a document becomes another, vanishes, or is taken from another document.
fn change_value(document: &mut Value, other: &Value, random: &mut Random) {
    let from = pick(other, random).clone();
    let elsewhere = pick(document, random).clone();
    let place = count(document);
    let new = match random.below(10) {
        0 => Some(from),
        1 => Some(elsewhere),
        2 => None,
        3 => Some(
            [json!(null), json!([]), json!({}), json!(""), json!(true), json!("\u{0}é")][random.below(6)]
                .clone(),
        ),
        4 => Some((0..random.below(300)).fold(json!(0), |inner, _| Value::Array(vec![inner]))),
        _ => Some(odd_number(random)),
    };
    let mut new = Some(new);
    replace(document, &mut random.below(place), &mut new);
}

/// One number of a document becomes another: a fraction, a multiple, the opposite, or nearly the same.
fn change_number(document: &mut Value, random: &mut Random) {
    let mut numbers = Vec::new();
    let mut open = vec![document];
    while let Some(value) = open.pop() {
        match value {
            Value::Array(list) => open.extend(list),
            Value::Object(map) => open.extend(map.values_mut()),
            Value::Number(_) => numbers.push(value),
            _ => {}
        }
    }
    let place = random.below(numbers.len().max(1));
    let Some(number) = numbers.into_iter().nth(place) else { return };
    let was = number.as_f64().unwrap_or_default();
    *number = match random.below(6) {
        0 => json!(was * 0.5),
        1 => json!(was * 1e3),
        2 => json!(-was),
        3 => json!(was + 1e-7),
        4 => json!(was + 1.0),
        _ => odd_number(random),
    };
}

/// Numbers at which readers of documents stumble.
fn odd_number(random: &mut Random) -> Value {
    let list = [
        json!(0),
        json!(-1),
        json!(1),
        json!(2),
        json!(3),
        json!(7),
        json!(255),
        json!(65_535),
        json!(5126),
        json!(i32::MAX),
        json!(u32::MAX),
        json!(i64::MAX),
        json!(u64::MAX),
        json!(i64::MIN),
        json!(0.5),
        json!(-0.0),
        json!(1e-320),
        json!(1e30),
        json!(-1e30),
        json!(1e308),
        json!(3e38),
        json!(1e-30),
    ];
    list[random.below(list.len())].clone()
}

/// Values in a document, itself among them.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(list) => list.iter().map(count).sum::<usize>(),
        Value::Object(map) => map.values().map(count).sum(),
        _ => 0,
    }
}

fn pick<'a>(value: &'a Value, random: &mut Random) -> &'a Value {
    let mut here = value;
    for _ in 0..random.below(8) {
        let next = match here {
            Value::Array(list) if !list.is_empty() => Some(&list[random.below(list.len())]),
            Value::Object(map) if !map.is_empty() => map.values().nth(random.below(map.len())),
            _ => None,
        };
        let Some(next) = next else { break };
        here = next;
    }
    here
}

/// Gives value number `left` of a document, in the order of reading, another, or takes it away (`Some(None)`).
#[expect(clippy::option_option, reason = "there is something to do, and it may be to take away")]
fn replace(value: &mut Value, left: &mut usize, new: &mut Option<Option<Value>>) {
    if *left == 0 {
        *value = new.take().flatten().unwrap_or(Value::Null);
        return;
    }
    *left -= 1;
    match value {
        Value::Array(list) => {
            for i in 0..list.len() {
                if *left == 0 && *new == Some(None) {
                    list.remove(i);
                    *new = None;
                } else if new.is_some() {
                    replace(&mut list[i], left, new);
                }
                if new.is_none() {
                    return;
                }
            }
        }
        Value::Object(map) => {
            let mut gone = None;
            for (key, value) in map.iter_mut() {
                if *left == 0 && *new == Some(None) {
                    gone = Some(key.clone());
                    *new = None;
                } else if new.is_some() {
                    replace(value, left, new);
                }
                if new.is_none() {
                    break;
                }
            }
            gone.map(|key| map.remove(&key));
        }
        _ => {}
    }
}

/// Reads a file, and renders 4 × 4 pixels of what it holds, on a thread of its own. One that hangs is left behind.
pub fn outcome(file: Vec<u8>) -> Outcome {
    let (sender, receiver) = channel();
    let work = move || {
        let shutter = Shutter { open: 0.0, close: 0.7 };
        let settings = in_environment(Settings { shutter, ..settings(4, 4, 2) }, 0.5);
        let result = catch_unwind(AssertUnwindSafe(|| match prepare(file, None, &settings) {
            Ok(scene) => {
                rendered_of(&scene, &settings, 1).picture();
                Outcome::Rendered
            }
            Err(_) => Outcome::Refused,
        }));
        // Nobody listens any more where it took too long.
        let _ = sender.send(result.unwrap_or_else(|panic| {
            let said = panic.downcast_ref::<String>().cloned();
            let said = said.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
            Outcome::Panicked(said.unwrap_or_default())
        }));
    };
    std::thread::spawn(work);
    match receiver.recv_timeout(PATIENCE) {
        Ok(outcome) => outcome,
        Err(RecvTimeoutError::Timeout) => Outcome::Hung,
        Err(RecvTimeoutError::Disconnected) => Outcome::Panicked("the thread ended".to_owned()),
    }
}

/// The most memory that this process has held, in bytes, where the system tells.
pub fn most_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes << 10)
}
