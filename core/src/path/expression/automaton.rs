//! Trees to an automaton that reads words from the eye.
//!
//! Thompson's construction gives an automaton over all letters, L and E included. Following it together with what a
//! word has had of its ends shows every word that is no path. The words that begin at the light are then reversed by
//! turning their moves around.

use super::{
    error::Fault,
    parse::At,
    syntax::{Node, Symbol},
};
use crate::bsdf::event::Letters;
use std::collections::{BTreeMap, BTreeSet};

/// States of all trees together, and steps of building them.
const STATES_MAX: usize = 4096;
/// Names of lights.
pub(super) const NAMES_MAX: usize = 32;

/// A state.
type State = usize;

/// Reads the letters of words from the eye, E and L left out; may be in many states at once.
#[derive(Debug, Default)]
pub(super) struct Automaton {
    /// From each state: by a letter of the set, or by nothing, to another state.
    pub(super) moves: Vec<Vec<(Option<Letters>, State)>>,
    /// States it begins in.
    pub(super) begins: Vec<State>,
    /// States in which a rule is fulfilled when light of a name, or of any name, comes next.
    pub(super) ends: Vec<Vec<(u32, Option<usize>)>>,
    /// Names of lights, in order of appearance.
    pub(super) names: Vec<String>,
}

impl Automaton {
    /// Adds the words of `tree`, which fulfil `rule`. `length` is the text's number of characters.
    pub(super) fn add(&mut self, rule: u32, tree: &Node, length: usize) -> At<()> {
        let mut builder = Builder { moves: vec![Vec::new()], steps: self.moves.len() };
        let last = builder.build(tree, 0)?;
        let framed = Framed::explore(&builder.moves, last, length)?;
        let states: BTreeMap<(State, Side), State> = (framed.between.iter())
            .enumerate()
            .map(|(i, (state, side))| ((*state, *side), self.moves.len() + i))
            .collect();
        self.moves.resize(self.moves.len() + states.len(), Vec::new());
        self.ends.resize(self.moves.len(), Vec::new());
        for (&(state, side), &here) in &states {
            for (symbol, to) in &builder.moves[state] {
                match (symbol.map(|(symbol, _)| symbol), side) {
                    (None, _) => self.link(here, None, states[&(*to, side)], side),
                    (Some(Symbol::Scattering(letters)), _) => {
                        self.link(here, Some(*letters), states[&(*to, side)], side);
                    }
                    (Some(Symbol::Light(name)), Side::Eye) => self.end(here, rule, name.as_ref())?,
                    (Some(Symbol::Eye), Side::Light) => self.begins.push(here),
                    (Some(Symbol::Light(_)), Side::Light) | (Some(Symbol::Eye), Side::Eye) => {
                        unreachable!("words with two ends alike were refused")
                    }
                }
            }
        }
        for (to, first) in framed.firsts {
            match first {
                Symbol::Light(name) => self.end(states[&(to, Side::Light)], rule, name.as_ref())?,
                _ => self.begins.push(states[&(to, Side::Eye)]),
            }
        }
        Ok(())
    }

    /// A move of a word that began on `side`, turned around if that is the light.
    fn link(&mut self, from: State, letters: Option<Letters>, to: State, side: Side) {
        match side {
            Side::Eye => self.moves[from].push((letters, to)),
            Side::Light => self.moves[to].push((letters, from)),
        }
    }

    fn end(&mut self, state: State, rule: u32, name: Option<&String>) -> At<()> {
        let name = match name {
            None => None,
            Some(name) => Some(self.number(name)?),
        };
        self.ends[state].push((rule, name));
        Ok(())
    }

    /// The number of a name.
    fn number(&mut self, name: &String) -> At<usize> {
        if let Some(number) = self.names.iter().position(|n| n == name) {
            return Ok(number);
        }
        if self.names.len() == NAMES_MAX {
            return Err((0, Fault::TooManyNames(NAMES_MAX)));
        }
        self.names.push(name.clone());
        Ok(self.names.len() - 1)
    }
}

/// A move by a letter and where it is written, or by nothing.
type Move<'t> = (Option<(&'t Symbol, usize)>, State);

/// Thompson's construction.
struct Builder<'t> {
    moves: Vec<Vec<Move<'t>>>,
    /// Steps so far: repetitions of nothing make no state but take time, too.
    steps: usize,
}

impl<'t> Builder<'t> {
    fn state(&mut self) -> State {
        self.moves.push(Vec::new());
        self.moves.len() - 1
    }

    fn free(&mut self, from: State, to: State) {
        self.moves[from].push((None, to));
    }

    /// Adds `node` from a state on; the state it leads to.
    fn build(&mut self, node: &'t Node, from: State) -> At<State> {
        self.steps += 1;
        if self.steps.max(self.moves.len()) > STATES_MAX {
            return Err((0, Fault::TooManyStates(STATES_MAX)));
        }
        match node {
            Node::Letter { symbol, at } => {
                let to = self.state();
                self.moves[from].push((Some((symbol, *at)), to));
                Ok(to)
            }
            Node::Sequence(parts) => parts.iter().try_fold(from, |here, part| self.build(part, here)),
            Node::Choice(alternatives) => {
                let last = self.state();
                for alternative in alternatives {
                    let first = self.state();
                    self.free(from, first);
                    let end = self.build(alternative, first)?;
                    self.free(end, last);
                }
                Ok(last)
            }
            Node::Repeat { inner, least, most, .. } => self.repeat(inner, *least, *most, from),
        }
    }

    fn repeat(&mut self, inner: &'t Node, least: u32, most: Option<u32>, from: State) -> At<State> {
        let mut here = from;
        for _ in 0..least {
            here = self.build(inner, here)?;
        }
        let last = self.state();
        match most {
            None => {
                self.free(here, last);
                let end = self.build(inner, last)?;
                self.free(end, last);
            }
            Some(most) => {
                for _ in least..most {
                    self.free(here, last);
                    here = self.build(inner, here)?;
                }
                self.free(here, last);
            }
        }
        Ok(last)
    }
}

/// At which end a word began.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Side {
    Light,
    Eye,
}

/// What a word has had of its ends.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Frame {
    Before,
    Between(Side),
    After,
}

/// States by what words have had of their ends when they come there.
struct Framed<'t> {
    /// States between the ends, by where words began.
    between: Vec<(State, Side)>,
    /// States after a first letter.
    firsts: Vec<(State, &'t Symbol)>,
}

impl<'t> Framed<'t> {
    /// Follows all words; the first letter in the text that makes one of them no path.
    fn explore(moves: &[Vec<Move<'t>>], last: State, length: usize) -> At<Self> {
        let mut found = Self { between: Vec::new(), firsts: Vec::new() };
        let mut seen = BTreeSet::from([(0, Frame::Before)]);
        let mut open = vec![(0, Frame::Before)];
        let mut fault: Option<(usize, Fault)> = None;
        let mut note = |at, what| {
            if fault.as_ref().is_none_or(|(before, _)| at < *before) {
                fault = Some((at, what));
            }
        };
        while let Some((state, frame)) = open.pop() {
            if let Frame::Between(side) = frame {
                found.between.push((state, side));
            }
            if state == last
                && let Some(what) = unfinished(frame)
            {
                note(length, what);
            }
            for (symbol, to) in &moves[state] {
                let next = match symbol {
                    None => Ok(frame),
                    Some((symbol, at)) => step(frame, symbol).map_err(|what| (*at, what)),
                };
                match next {
                    Ok(next) => {
                        if let (Frame::Before, Frame::Between(_), Some((symbol, _))) = (frame, next, symbol) {
                            found.firsts.push((*to, symbol));
                        }
                        if seen.insert((*to, next)) {
                            open.push((*to, next));
                        }
                    }
                    Err((at, what)) => note(at, what),
                }
            }
        }
        fault.map_or(Ok(found), Err)
    }
}

fn step(frame: Frame, symbol: &Symbol) -> Result<Frame, Fault> {
    match (frame, symbol) {
        (Frame::Before, Symbol::Light(_)) => Ok(Frame::Between(Side::Light)),
        (Frame::Before, Symbol::Eye) => Ok(Frame::Between(Side::Eye)),
        (Frame::Before, Symbol::Scattering(_)) => Err(Fault::NoBegin),
        (Frame::Between(_), Symbol::Scattering(_)) => Ok(frame),
        (Frame::Between(Side::Light), Symbol::Eye) | (Frame::Between(Side::Eye), Symbol::Light(_)) => {
            Ok(Frame::After)
        }
        (Frame::Between(Side::Light), Symbol::Light(_)) => Err(Fault::Twice('L')),
        (Frame::Between(Side::Eye), Symbol::Eye) => Err(Fault::Twice('E')),
        (Frame::After, _) => Err(Fault::AfterEnd),
    }
}

/// What is missing where a word ends.
fn unfinished(frame: Frame) -> Option<Fault> {
    match frame {
        Frame::Before => Some(Fault::NoPath),
        Frame::Between(Side::Light) => Some(Fault::NoEnd('E')),
        Frame::Between(Side::Eye) => Some(Fault::NoEnd('L')),
        Frame::After => None,
    }
}
