//! The paths that a picture and its layers show, as look-ups a walk can make at every vertex.

use super::{
    automaton::Automaton,
    error::{ExpressionError, Fault},
    minimal::{Minimal, Row},
    parse::parse,
    reverse::{Reverse, set_number},
};
use crate::bsdf::event::{Letter, Letters};
use std::collections::VecDeque;

/// Most expressions of a language.
pub const RULES_MAX: usize = 32;

/// How far an eye subpath is: the letters of all its vertices are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EyeState(u8);

impl EyeState {
    /// As an index below [`Language::eye_states`].
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// How far a light subpath is: the letters of all its vertices are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightState(u16);

impl LightState {
    /// As an index below [`Language::light_states`].
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Which of the names that the expressions use a light has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightTag(u16);

impl LightTag {
    /// A light with none of the names.
    pub const UNNAMED: Self = Self(0);

    /// As an index below [`Language::light_tags`].
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A set of rules: the picture is rule 0, layers follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rules(u32);

impl Rules {
    /// No rule.
    pub const NONE: Self = Self(0);

    /// Whether no rule is in the set.
    #[inline]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether `rule` is in the set.
    #[inline]
    pub const fn has(self, rule: usize) -> bool {
        rule < RULES_MAX && self.0 & (1 << rule) != 0
    }

    /// Rules in either set.
    #[inline]
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The rules in order.
    #[inline]
    pub fn iter(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            (left != 0).then(|| {
                let rule = left.trailing_zeros() as usize;
                left &= left - 1;
                rule
            })
        })
    }
}

/// The words of some expressions. Every question that a walk asks is one look-up in a table.
#[derive(Clone, Debug)]
pub struct Language {
    rules: usize,
    names: Vec<String>,
    eye: Vec<[Option<EyeState>; Letter::COUNT]>,
    light: Vec<[Option<LightState>; Letter::COUNT]>,
    light_starts: Vec<Option<LightState>>,
    /// By light state, then eye state.
    joined: Vec<Rules>,
}

impl Language {
    /// Compiles expressions; rule r is the r-th. The smallest automata that follow all of them at once.
    pub fn compile(rules: &[&str]) -> Result<Self, ExpressionError> {
        let error = |rule: usize, at, fault| ExpressionError {
            rule,
            at,
            fault,
            text: rules.get(rule).map_or_else(String::new, |text| (*text).to_owned()),
        };
        if rules.is_empty() {
            return Err(error(0, 0, Fault::Empty));
        }
        if rules.len() > RULES_MAX {
            return Err(error(RULES_MAX, 0, Fault::TooManyRules(RULES_MAX)));
        }
        let mut automaton = Automaton::default();
        let mut largest = (0, 0);
        for (rule, text) in rules.iter().enumerate() {
            let before = automaton.moves.len();
            let tree = parse(text).map_err(|(at, fault)| error(rule, at, fault))?;
            let added = automaton.add(rule as u32, &tree, text.chars().count());
            added.map_err(|(at, fault)| error(rule, at, fault))?;
            largest = largest.max((automaton.moves.len() - before, rule));
        }
        let too_large = |fault| error(largest.1, 0, fault);
        let eye = Minimal::of(&automaton).map_err(too_large)?;
        let light = Reverse::of(&eye, automaton.names.len()).map_err(too_large)?;
        let eye_state = |state: usize| EyeState(state as u8);
        let light_state = |state: usize| LightState(state as u16);
        Ok(Self {
            rules: rules.len(),
            names: automaton.names,
            eye: eye.rows.iter().map(|row: &Row| row.map(|to| to.map(eye_state))).collect(),
            light: light.rows.iter().map(|row| row.map(|to| to.map(light_state))).collect(),
            light_starts: light.begins.iter().map(|state| state.map(light_state)).collect(),
            joined: light.joined.iter().flatten().map(|rules| Rules(*rules)).collect(),
        })
    }

    /// Number of rules.
    pub fn rules(&self) -> usize {
        self.rules
    }

    /// The state at the eye.
    #[inline]
    pub const fn eye_start(&self) -> EyeState {
        EyeState(0)
    }

    /// One vertex further from the eye; `None` where no light subpath makes a word of it any more.
    #[inline]
    pub fn eye_next(&self, state: EyeState, letter: Letter) -> Option<EyeState> {
        self.eye[state.index()][letter.index()]
    }

    /// The state at a light; `None` where no path from such a light is in the language.
    #[inline]
    pub fn light_start(&self, tag: LightTag) -> Option<LightState> {
        self.light_starts[tag.index()]
    }

    /// One vertex further from the light; `None` where no eye subpath makes a word of it any more.
    #[inline]
    pub fn light_next(&self, state: LightState, letter: Letter) -> Option<LightState> {
        self.light[state.index()][letter.index()]
    }

    /// The rules that a path fulfils whose two subpaths are in these states.
    #[inline]
    pub fn accepts(&self, eye: EyeState, light: LightState) -> Rules {
        self.joined[light.index() * self.eye.len() + eye.index()]
    }

    /// The rules that a path fulfils whose scatterings have these letters, from the eye to the light.
    pub fn accepts_word(&self, tag: LightTag, word: &[Letter]) -> Rules {
        let start = Some(self.eye_start());
        let end = word.iter().fold(start, |state, letter| self.eye_next(state?, *letter));
        match (end, self.light_start(tag)) {
            (Some(eye), Some(light)) => self.accepts(eye, light),
            _ => Rules::NONE,
        }
    }

    /// Number of states of eye subpaths.
    pub fn eye_states(&self) -> usize {
        self.eye.len()
    }

    /// Number of states of light subpaths.
    pub fn light_states(&self) -> usize {
        self.light.len()
    }

    /// Number of tags.
    pub fn light_tags(&self) -> usize {
        self.light_starts.len()
    }

    /// The tags that lights can have.
    pub fn tags(&self) -> impl Iterator<Item = LightTag> + use<> {
        (0..self.light_starts.len() as u16).map(LightTag)
    }

    /// The names that the expressions use.
    pub fn light_names(&self) -> &[String] {
        &self.names
    }

    /// The tag of a light that goes by `names`: its node's and its material's. Of more than two that the
    /// expressions use, the first two of [`Self::light_names`] count.
    pub fn tag_of(&self, names: &[&str]) -> LightTag {
        let used = (0..self.names.len()).filter(|n| names.contains(&self.names[*n].as_str()));
        LightTag(set_number(self.names.len(), used) as u16)
    }

    /// Letters that are on a word of the language. Lobes with others need not be there at all.
    pub fn letters(&self) -> Letters {
        let on = |letter: Letter| self.eye.iter().any(|row| row[letter.index()].is_some());
        Letter::ALL
            .into_iter()
            .filter(|letter| on(*letter))
            .fold(Letters::NONE, |set, letter| set.union(Letters::of(letter)))
    }

    /// Whether every path of natural letters from every light fulfils every rule: then nothing needs to be followed.
    pub fn is_everything(&self) -> bool {
        let all = Rules(u32::MAX >> (RULES_MAX - self.rules));
        self.eye_states() == 1
            && self
                .light_starts
                .iter()
                .all(|start| start.is_some_and(|s| self.accepts(self.eye_start(), s) == all))
            && self.letters().contains(Letters::NATURAL)
    }

    /// Scatterings of the shortest word.
    pub fn shortest(&self) -> u32 {
        let mut distance = vec![None; self.eye.len()];
        let mut open = VecDeque::from([(self.eye_start(), 0)]);
        while let Some((state, scatterings)) = open.pop_front() {
            if distance[state.index()].is_some() {
                continue;
            }
            if self.ends_at(state) {
                return scatterings;
            }
            distance[state.index()] = Some(scatterings);
            open.extend(self.eye[state.index()].iter().flatten().map(|to| (*to, scatterings + 1)));
        }
        unreachable!("every state leads to the end of a word")
    }

    /// Scatterings of the longest word; `None` if there is no longest.
    pub fn longest(&self) -> Option<u32> {
        // Paths in the graph of states without a circle have fewer moves than there are states.
        let mut reached = vec![false; self.eye.len()];
        reached[self.eye_start().index()] = true;
        for scatterings in 0..self.eye.len() {
            let mut next = vec![false; self.eye.len()];
            for (row, _) in self.eye.iter().zip(&reached).filter(|(_, here)| **here) {
                row.iter().flatten().for_each(|to| next[to.index()] = true);
            }
            if !next.contains(&true) {
                return Some(scatterings as u32);
            }
            reached = next;
        }
        None
    }

    /// Whether light of some name may come next.
    fn ends_at(&self, state: EyeState) -> bool {
        self.light_starts.iter().flatten().any(|light| !self.accepts(state, *light).is_empty())
    }
}
