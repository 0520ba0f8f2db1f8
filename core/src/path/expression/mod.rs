//! Path expressions: words from the light to the eye, and the automata that follow a path along them.
//!
//! Text is parsed to a tree (`syntax`), the tree becomes an automaton that reads words from the eye (`automaton`),
//! made deterministic and minimal (`minimal`), and its reverse for walks from the light (`reverse`).

mod automaton;
pub mod error;
pub mod language;
mod minimal;
mod parse;
pub mod presets;
mod reverse;
mod syntax;

#[cfg(test)]
mod tests;
