//! The automaton that follows words from the light.
//!
//! A light subpath is followed by what it would mean to every eye subpath: for each state of the eye's automaton, the
//! rules that are fulfilled when the two are joined. There are finitely many such lists; each is a state.

use super::{error::Fault, minimal::Minimal};
use crate::bsdf::event::Letter;
use std::collections::BTreeMap;

/// States of a reverse automaton.
const STATES_MAX: usize = 4096;

/// The reverse of a minimal automaton.
#[derive(Debug)]
pub(super) struct Reverse {
    /// By each letter to another state; `None` where no eye subpath can be joined any more.
    pub(super) rows: Vec<[Option<usize>; Letter::COUNT]>,
    /// For each state and each state of the eye's automaton, in this order, the rules that joining them fulfils.
    pub(super) joined: Vec<Vec<u32>>,
    /// State in which words from a light begin, by the number of the set of names that the light has.
    pub(super) begins: Vec<Option<usize>>,
}

impl Reverse {
    /// Of `eye`, for lights that have none, one or two of `names` names.
    pub(super) fn of(eye: &Minimal, names: usize) -> Result<Self, Fault> {
        let mut found = Self { rows: Vec::new(), joined: Vec::new(), begins: Vec::new() };
        let mut known = BTreeMap::new();
        let mut number = |joined: Vec<u32>, all: &mut Vec<Vec<u32>>| -> Result<Option<usize>, Fault> {
            if joined.iter().all(|rules| *rules == 0) {
                return Ok(None);
            }
            let next = all.len();
            let state = *known.entry(joined).or_insert_with_key(|new| {
                all.push(new.clone());
                next
            });
            if all.len() > STATES_MAX { Err(Fault::TooManyStates(STATES_MAX)) } else { Ok(Some(state)) }
        };
        for set in name_sets(names) {
            let fulfilled =
                |output: &Vec<u32>| set.iter().fold(output[0], |rules, name| rules | output[1 + name]);
            let joined = eye.outputs.iter().map(fulfilled).collect();
            found.begins.push(number(joined, &mut found.joined)?);
        }
        while let Some(here) = found.joined.get(found.rows.len()).cloned() {
            let mut row = [None; Letter::COUNT];
            for letter in Letter::ALL {
                let after =
                    |row: &[Option<usize>; Letter::COUNT]| row[letter.index()].map_or(0, |to| here[to]);
                row[letter.index()] = number(eye.rows.iter().map(after).collect(), &mut found.joined)?;
            }
            found.rows.push(row);
        }
        Ok(found)
    }
}

/// No name, each name, each pair of names: in the order of [`set_number`].
fn name_sets(names: usize) -> impl Iterator<Item = Vec<usize>> {
    let pairs = (0..names).flat_map(|second| (0..second).map(move |first| vec![first, second]));
    std::iter::once(Vec::new()).chain((0..names).map(|name| vec![name])).chain(pairs)
}

/// The number of the set of the first two of the names given, which are in order and differ.
pub(super) fn set_number(names: usize, mut of: impl Iterator<Item = usize>) -> usize {
    match (of.next(), of.next()) {
        (None, _) => 0,
        (Some(name), None) => 1 + name,
        (Some(first), Some(second)) => 1 + names + second * (second - 1) / 2 + first,
    }
}
