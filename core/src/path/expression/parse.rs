//! Text to tree.

use super::{
    error::Fault,
    syntax::{GLOSSY_OR_SPECULAR, Node, Symbol},
};
use crate::bsdf::event::{Letter, Letters};

/// Longest text in bytes.
pub(super) const TEXT_MAX: usize = 4096;
/// Largest count of a repetition.
pub(super) const COUNT_MAX: u32 = 64;
/// Deepest nesting of brackets.
pub(super) const DEPTH_MAX: usize = 64;

/// A fault and the number of its character.
pub(super) type At<T> = Result<T, (usize, Fault)>;

/// The tree of a whole text.
pub(super) fn parse(text: &str) -> At<Node> {
    if text.len() > TEXT_MAX {
        return Err((0, Fault::TooLong(TEXT_MAX)));
    }
    let mut reader = Reader { characters: text.chars().collect(), next: 0 };
    if reader.peek().is_none() {
        return Err((0, Fault::Empty));
    }
    let node = reader.choice(0)?;
    match reader.peek() {
        None => Ok(node),
        Some(c) => Err((reader.next, Fault::Unopened(c))),
    }
}

struct Reader {
    characters: Vec<char>,
    next: usize,
}

impl Reader {
    /// The next character that is not a space.
    fn peek(&mut self) -> Option<char> {
        while self.characters.get(self.next).is_some_and(|c| c.is_whitespace()) {
            self.next += 1;
        }
        self.characters.get(self.next).copied()
    }

    /// Goes past `wanted` if it is next.
    fn skip(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.next += usize::from(found);
        found
    }

    /// Alternatives, up to a closing bracket or the end.
    fn choice(&mut self, depth: usize) -> At<Node> {
        let mut alternatives = vec![self.sequence(depth)?];
        while self.skip('|') {
            alternatives.push(self.sequence(depth)?);
        }
        Ok(single(alternatives, Node::Choice))
    }

    fn sequence(&mut self, depth: usize) -> At<Node> {
        let mut parts = Vec::new();
        while let Some(c) = self.peek() {
            if matches!(c, '|' | ')' | ']') {
                break;
            }
            let part = self.part(c, depth)?;
            parts.push(self.repeated(part)?);
        }
        if parts.is_empty() {
            return Err((self.next, Fault::Missing));
        }
        Ok(single(parts, Node::Sequence))
    }

    /// A letter or a group.
    fn part(&mut self, first: char, depth: usize) -> At<Node> {
        let at = self.next;
        self.next += 1;
        let symbol = match first {
            '(' => return self.group(at, ')', depth),
            '[' => {
                let inner = Box::new(self.group(at, ']', depth)?);
                return Ok(Node::Repeat { inner, least: 0, most: Some(1), at });
            }
            'L' => Symbol::Light(self.name()?),
            'E' => Symbol::Eye,
            'D' => Symbol::Scattering(Letters::of(Letter::Diffuse)),
            'S' => Symbol::Scattering(self.subscript(at)?),
            '.' => Symbol::Scattering(Letters::NATURAL),
            '*' | '+' | '?' | '{' => return Err((at, Fault::NothingToRepeat(first))),
            '}' => return Err((at, Fault::Unopened(first))),
            _ => return Err((at, Fault::UnknownLetter(first))),
        };
        Ok(Node::Letter { symbol, at })
    }

    fn group(&mut self, opened: usize, close: char, depth: usize) -> At<Node> {
        if depth >= DEPTH_MAX {
            return Err((opened, Fault::TooDeep(DEPTH_MAX)));
        }
        let open = self.characters[opened];
        if self.peek().is_none() {
            return Err((opened, Fault::Unclosed(open)));
        }
        let inner = self.choice(depth + 1)?;
        match self.peek() {
            None => Err((opened, Fault::Unclosed(open))),
            Some(c) if c == close => {
                self.next += 1;
                Ok(inner)
            }
            Some(c) => Err((self.next, Fault::Unopened(c))),
        }
    }

    /// What follows an `S`.
    fn subscript(&mut self, at: usize) -> At<Letters> {
        if !self.skip('_') {
            return Ok(GLOSSY_OR_SPECULAR);
        }
        if self.skip('M') {
            Ok(Letters::of(Letter::Specular))
        } else if self.skip('T') {
            Ok(Letters::of(Letter::Mirrored))
        } else {
            Err((at, Fault::UnknownSubscript))
        }
    }

    /// A name in single quotes, if there is one; a quote in it is written twice.
    fn name(&mut self) -> At<Option<String>> {
        if !self.skip('\'') {
            return Ok(None);
        }
        let opened = self.next - 1;
        let mut name = String::new();
        loop {
            let Some(&c) = self.characters.get(self.next) else {
                return Err((opened, Fault::Unclosed('\'')));
            };
            self.next += 1;
            if c == '\'' {
                if self.characters.get(self.next) != Some(&'\'') {
                    break;
                }
                self.next += 1;
            }
            name.push(c);
        }
        if name.is_empty() { Err((opened, Fault::NoName)) } else { Ok(Some(name)) }
    }

    /// `part` with the repetitions behind it.
    fn repeated(&mut self, mut part: Node) -> At<Node> {
        while let Some(c) = self.peek() {
            let at = self.next;
            let (least, most) = match c {
                '*' => (0, None),
                '+' => (1, None),
                '?' => (0, Some(1)),
                '{' => {
                    self.next += 1;
                    self.counts(at)?
                }
                _ => break,
            };
            if c != '{' {
                self.next += 1;
            }
            part = Node::Repeat { inner: Box::new(part), least, most, at };
        }
        Ok(part)
    }

    /// `n}`, `n,m}` or `n,}`.
    fn counts(&mut self, opened: usize) -> At<(u32, Option<u32>)> {
        let least = self.count(opened)?;
        let most = match self.peek() {
            Some(',') => {
                self.next += 1;
                if self.peek() == Some('}') { None } else { Some(self.count(opened)?) }
            }
            _ => Some(least),
        };
        match self.peek() {
            Some('}') => self.next += 1,
            None => return Err((opened, Fault::Unclosed('{'))),
            Some(_) => return Err((self.next, Fault::BadCounts)),
        }
        if most.is_some_and(|most| most < least) {
            return Err((opened, Fault::CountsReversed));
        }
        Ok((least, most))
    }

    fn count(&mut self, opened: usize) -> At<u32> {
        match self.peek() {
            None => return Err((opened, Fault::Unclosed('{'))),
            Some(c) if !c.is_ascii_digit() => return Err((self.next, Fault::BadCounts)),
            Some(_) => {}
        }
        let at = self.next;
        let mut count = 0_u32;
        while let Some(digit) = self.characters.get(self.next).and_then(|c| c.to_digit(10)) {
            count = count.saturating_mul(10).saturating_add(digit);
            self.next += 1;
        }
        if count > COUNT_MAX { Err((at, Fault::CountTooLarge(COUNT_MAX))) } else { Ok(count) }
    }
}

/// One node as it is, several as a list.
fn single(mut nodes: Vec<Node>, list: fn(Vec<Node>) -> Node) -> Node {
    if nodes.len() == 1 { nodes.remove(0) } else { list(nodes) }
}
