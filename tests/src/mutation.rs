//! Bytes changed at random, of a seed: what a careless or malicious sender might send.

use crate::proxy::Random;

/// Numbers at which readers stumble.
const NUMBERS: [&str; 20] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "0.5",
    "-0.0",
    "1e308",
    "1e-320",
    "99999999999999999999",
];
/// Numbers of four bytes at which readers stumble.
const WORDS: [u32; 12] =
    [0, 1, 2, 0x7f, 0x80, 0xff, 0xffff, 0x1_0000, 0x7fff_ffff, 0x8000_0000, 0xffff_fffe, 0xffff_ffff];

/// Some changes of `bytes`; pieces of `other` may come in.
pub fn mutated(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..1 << random.below(5) {
        one(&mut out, other, random);
    }
    out
}

/// The same of a text: mostly its numbers and words.
pub fn mutated_text(text: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = text.to_vec();
    for _ in 0..1 << random.below(4) {
        match random.below(8) {
            0..4 => replace_number(&mut out, random),
            4 => swap_tokens(&mut out, random),
            5 => drop_token(&mut out, random),
            _ => one(&mut out, other, random),
        }
    }
    out
}

/// A piece of at most `most` bytes.
fn piece(length: usize, most: usize, random: &mut Random) -> std::ops::Range<usize> {
    if length == 0 {
        return 0..0;
    }
    let start = random.below(length);
    start..(start + random.below(most) + 1).min(length)
}

fn one(out: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let length = out.len();
    if length == 0 {
        return out.extend_from_slice(other);
    }
    match random.below(9) {
        0 => out[random.below(length)] ^= 1 << random.below(8),
        1 => out[random.below(length)] = random.draw() as u8,
        2 | 3 => {
            let at = random.below(length);
            let word = WORDS[random.below(WORDS.len())].to_le_bytes();
            for (place, byte) in out[at..].iter_mut().zip(word) {
                *place = byte;
            }
        }
        4 => out.truncate(random.below(length)),
        5 => {
            let copy = out[piece(length, 64, random)].to_vec();
            let at = random.below(length);
            out.splice(at..at, copy);
        }
        6 => drop(out.drain(piece(length, 64, random))),
        7 => {
            let from = other[piece(other.len(), 256, random)].to_vec();
            let at = piece(length, 256, random);
            out.splice(at, from);
        }
        _ => out[piece(length, 16, random)].fill(if random.happens(0.5) { 0 } else { 0xff }),
    }
}

/// Places of runs of characters that `is_part` names.
fn runs(text: &[u8], is_part: impl Fn(u8) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for (i, byte) in text.iter().chain(&[0]).enumerate() {
        match (is_part(*byte), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                runs.push(from..i);
                start = None;
            }
            _ => {}
        }
    }
    runs
}

fn replace_number(out: &mut Vec<u8>, random: &mut Random) {
    let numbers = runs(out, |byte| byte.is_ascii_digit() || byte == b'.' || byte == b'-');
    if !numbers.is_empty() {
        let at = numbers[random.below(numbers.len())].clone();
        out.splice(at, NUMBERS[random.below(NUMBERS.len())].bytes());
    }
}

fn tokens(out: &[u8]) -> Vec<std::ops::Range<usize>> {
    runs(out, |byte| !byte.is_ascii_whitespace() && !b",:[]{}".contains(&byte) && byte != 0)
}

fn swap_tokens(out: &mut Vec<u8>, random: &mut Random) {
    let tokens = tokens(out);
    if !tokens.is_empty() {
        let (from, to) = (&tokens[random.below(tokens.len())], &tokens[random.below(tokens.len())]);
        let copy = out[from.clone()].to_vec();
        out.splice(to.clone(), copy);
    }
}

fn drop_token(out: &mut Vec<u8>, random: &mut Random) {
    let tokens = tokens(out);
    if !tokens.is_empty() {
        out.drain(tokens[random.below(tokens.len())].clone());
    }
}
