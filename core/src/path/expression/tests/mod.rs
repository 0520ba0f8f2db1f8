//! Tests of expressions and their automata.

mod faults;
mod limits;
mod matcher;
mod sizes;
mod words;
