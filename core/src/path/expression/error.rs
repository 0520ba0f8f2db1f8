//! What is wrong with a path expression, and where.

use std::fmt;

/// Characters that [`ExpressionError::marked`] shows on either side of a fault.
const AROUND: usize = 40;

/// An expression that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpressionError {
    /// Which of the expressions given, from 0.
    pub rule: usize,
    /// The character that is at fault, from 0; the number of characters where something is missing at the end.
    pub at: usize,
    /// What is wrong.
    pub fault: Fault,
    pub(super) text: String,
}

/// What is wrong with an expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// Nothing but spaces.
    #[error("there is no expression: 'L(D|S)*E' is the whole rendering equation")]
    Empty,
    /// More bytes than are read.
    #[error("the expression has more than {0} bytes: write a shorter one")]
    TooLong(usize),
    /// A character that stands for nothing.
    #[error("'{0}' is no letter of a path: use L, D, S, S_M, '.' and E")]
    UnknownLetter(char),
    /// `S_` with a wrong letter or none behind it.
    #[error("'S_' is followed by 'M': 'S_M' is ideally specular")]
    UnknownSubscript,
    /// Nothing where a letter or a group is needed.
    #[error("something is missing here: a letter or a group")]
    Missing,
    /// `*`, `+`, `?` or `{` with nothing before it.
    #[error("there is nothing to repeat before this '{0}'")]
    NothingToRepeat(char),
    /// A bracket that is not closed.
    #[error("this '{0}' is never closed")]
    Unclosed(char),
    /// A bracket that was not opened, or not of this kind.
    #[error("this '{0}' closes nothing")]
    Unopened(char),
    /// Counts that are none.
    #[error("counts are written {{2}}, {{2,5}} or {{2,}}")]
    BadCounts,
    /// A count over the limit.
    #[error("a count is {0} at most")]
    CountTooLarge(u32),
    /// `{n,m}` with n over m.
    #[error("the first count is not above the second")]
    CountsReversed,
    /// Brackets in brackets without end.
    #[error("brackets are nested more than {0} deep")]
    TooDeep(usize),
    /// `''`.
    #[error("a light's name is missing between the quotes")]
    NoName,
    /// More names than are kept.
    #[error("the expressions name more than {0} lights")]
    TooManyNames(usize),
    /// A word that does not begin at one end.
    #[error("a path begins with L at the light, or with E at the eye")]
    NoBegin,
    /// A second L or E.
    #[error("a second '{0}': a path has one L at one end, and one E at the other")]
    Twice(char),
    /// A letter after the end.
    #[error("the path has ended before this: it goes from L to E, or from E to L")]
    AfterEnd,
    /// A word without its last letter.
    #[error("a path ends here without '{0}'")]
    NoEnd(char),
    /// A word without a letter.
    #[error("this also allows a path without L and E")]
    NoPath,
    /// More expressions than a set of rules holds.
    #[error("there are more than {0} expressions: leave some layers out")]
    TooManyRules(usize),
    /// An automaton over the limits.
    #[error("the expressions need more than {0} states: use smaller counts, or fewer layers")]
    TooManyStates(usize),
}

impl fmt::Display for ExpressionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "character {}: {}", self.at + 1, self.fault)
    }
}

impl std::error::Error for ExpressionError {}

impl ExpressionError {
    /// Two lines for a terminal: the expression, and a caret below the character at fault. Of a long expression only
    /// the neighbourhood is shown.
    pub fn marked(&self) -> String {
        let printable = |c: char| if c.is_control() { ' ' } else { c };
        let from = self.at.saturating_sub(AROUND);
        let shown: String = self.text.chars().skip(from).take(2 * AROUND).map(printable).collect();
        let (dots, indent) = if from > 0 { ("…", self.at - from + 1) } else { ("", self.at) };
        format!("{dots}{shown}\n{}^", " ".repeat(indent))
    }
}
