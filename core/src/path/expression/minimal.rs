//! The smallest automaton that is in one state at a time: subsets of states, then Moore's merging of states that no
//! rest of a word tells apart.

use super::{automaton::Automaton, error::Fault};
use crate::bsdf::event::{Letter, Letters};
use std::collections::BTreeMap;

/// States of a minimal automaton.
pub(super) const STATES_MAX: usize = 64;
/// Sets of states before merging.
const SUBSETS_MAX: usize = 1024;

/// Which rules a state fulfils: `[0]` when light of any name comes next, `[1 + n]` when light with name n does and
/// `[0]` does not say so already. Bit r stands for rule r.
pub(super) type Output = Vec<u32>;
/// By each letter to another state; `None` where no word goes on.
pub(super) type Row = [Option<usize>; Letter::COUNT];

/// A minimal automaton; it begins in state 0, and every state leads to the end of a word.
#[derive(Debug)]
pub(super) struct Minimal {
    pub(super) rows: Vec<Row>,
    pub(super) outputs: Vec<Output>,
}

impl Minimal {
    /// The one that reads the same words.
    pub(super) fn of(automaton: &Automaton) -> Result<Self, Fault> {
        let all = subsets(automaton)?;
        let mut class = number(&all.outputs);
        let mut count = class.iter().max().map_or(0, |last| last + 1);
        loop {
            let keys: Vec<(usize, Row)> = (all.rows.iter().zip(&class))
                .map(|(row, own)| (*own, row.map(|to| to.map(|to| class[to]))))
                .collect();
            let finer = number(&keys);
            let finer_count = finer.iter().max().map_or(0, |last| last + 1);
            if finer_count == count {
                break;
            }
            (class, count) = (finer, finer_count);
        }
        if count > STATES_MAX {
            return Err(Fault::TooManyStates(STATES_MAX));
        }
        // Numbers follow the order of the subsets, so that the first is the one it begins in.
        let mut kept = Self { rows: Vec::new(), outputs: Vec::new() };
        for (subset, own) in class.iter().enumerate() {
            if *own == kept.rows.len() {
                kept.rows.push(all.rows[subset].map(|to| to.map(|to| class[to])));
                kept.outputs.push(all.outputs[subset].clone());
            }
        }
        Ok(kept)
    }
}

/// Numbers things in order of appearance, like things alike.
fn number<K: Ord>(things: &[K]) -> Vec<usize> {
    let mut known = BTreeMap::new();
    things
        .iter()
        .map(|thing| {
            let next = known.len();
            *known.entry(thing).or_insert(next)
        })
        .collect()
}

/// Every set of states that the letters of a word lead to.
fn subsets(automaton: &Automaton) -> Result<Minimal, Fault> {
    let first = closure(automaton, automaton.begins.iter().copied());
    let mut known = BTreeMap::from([(first.clone(), 0)]);
    let mut sets = vec![first];
    let mut all = Minimal { rows: Vec::new(), outputs: Vec::new() };
    while let Some(set) = sets.get(all.rows.len()).cloned() {
        let mut row = [None; Letter::COUNT];
        for letter in Letter::ALL {
            let takes = |letters: &Option<Letters>| letters.is_some_and(|set| set.has(letter));
            let targets = set.iter().flat_map(|state| &automaton.moves[*state]);
            let targets = targets.filter(|(letters, _)| takes(letters)).map(|(_, to)| *to);
            let next = closure(automaton, targets);
            if next.is_empty() {
                continue;
            }
            let count = known.len();
            let number = *known.entry(next).or_insert_with_key(|new| {
                sets.push(new.clone());
                count
            });
            row[letter.index()] = Some(number);
        }
        if sets.len() > SUBSETS_MAX {
            return Err(Fault::TooManyStates(SUBSETS_MAX));
        }
        all.rows.push(row);
        all.outputs.push(output(automaton, &set));
    }
    Ok(all)
}

/// The states given and those that are reached from them without a letter, in order.
fn closure(automaton: &Automaton, states: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut reached = vec![false; automaton.moves.len()];
    let mut open: Vec<usize> = states.collect();
    let mut set = Vec::new();
    while let Some(state) = open.pop() {
        if std::mem::replace(&mut reached[state], true) {
            continue;
        }
        set.push(state);
        open.extend(automaton.moves[state].iter().filter(|(by, _)| by.is_none()).map(|(_, to)| *to));
    }
    set.sort_unstable();
    set
}

fn output(automaton: &Automaton, set: &[usize]) -> Output {
    let mut output = vec![0; 1 + automaton.names.len()];
    for (rule, name) in set.iter().flat_map(|state| &automaton.ends[*state]) {
        output[name.map_or(0, |name| name + 1)] |= 1 << rule;
    }
    let any = output[0];
    output[1..].iter_mut().for_each(|named| *named &= !any);
    output
}
