//! A plain matcher of words against trees, to judge the automata by.

use crate::bsdf::event::Letter;
use crate::path::expression::syntax::{Node, Symbol};
use std::collections::BTreeSet;

/// One character of a word, as a path has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'n> {
    Light(&'n [&'n str]),
    Eye,
    Scattering(Letter),
}

/// Whether the whole word, or the word read backwards, is one of the tree's.
pub(super) fn matches(tree: &Node, word: &[Token<'_>]) -> bool {
    let backwards: Vec<_> = word.iter().rev().copied().collect();
    [word, &backwards].iter().any(|word| ends(tree, word, &BTreeSet::from([0])).contains(&word.len()))
}

/// The places where a match of `node` can end that begins at one of `from`.
fn ends(node: &Node, word: &[Token<'_>], from: &BTreeSet<usize>) -> BTreeSet<usize> {
    match node {
        Node::Letter { symbol, .. } => {
            let fits = |i: &&usize| word.get(**i).is_some_and(|token| is(symbol, *token));
            from.iter().filter(fits).map(|i| i + 1).collect()
        }
        Node::Sequence(parts) => parts.iter().fold(from.clone(), |here, part| ends(part, word, &here)),
        Node::Choice(parts) => parts.iter().flat_map(|part| ends(part, word, from)).collect(),
        Node::Repeat { inner, least, most, .. } => {
            let mut here = from.clone();
            for _ in 0..*least {
                here = ends(inner, word, &here);
            }
            let mut all = here.clone();
            for _ in *least..most.unwrap_or(*least + word.len() as u32 + 1) {
                here = ends(inner, word, &here);
                all.extend(&here);
            }
            all
        }
    }
}

fn is(symbol: &Symbol, token: Token<'_>) -> bool {
    match (symbol, token) {
        (Symbol::Light(None), Token::Light(_)) | (Symbol::Eye, Token::Eye) => true,
        (Symbol::Light(Some(name)), Token::Light(names)) => names.contains(&name.as_str()),
        (Symbol::Scattering(letters), Token::Scattering(letter)) => letters.has(letter),
        _ => false,
    }
}
