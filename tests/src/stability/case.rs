//! A case: what it stresses, what is known, and who is asked.

use super::{budget::Budget, finding::Finding};
use std::fmt;

/// A stiff or extreme case.
#[derive(Debug)]
pub struct Case {
    /// The heading it stands under.
    pub group: &'static str,
    /// Its name, unique.
    pub name: String,
    /// What it stresses.
    pub stresses: &'static str,
    /// The known answer, and where it is from.
    pub known: String,
    /// What a reader should know of what is found; may be empty.
    pub note: &'static str,
    /// Who is asked.
    pub trials: Vec<Trial>,
}

/// One way to ask.
pub struct Trial {
    /// The method, or what is looked at.
    pub by: String,
    look: Box<dyn Fn(Budget) -> Finding + Send + Sync>,
}

impl Trial {
    /// Looks with `look`.
    pub fn new(by: impl Into<String>, look: impl Fn(Budget) -> Finding + Send + Sync + 'static) -> Self {
        Self { by: by.into(), look: Box::new(look) }
    }

    /// The same with a budget so many times smaller, where a ray is so much dearer.
    #[must_use]
    pub fn dearer(self, times: f64) -> Self {
        let Self { by, look } = self;
        Self::new(by, move |budget: Budget| {
            look(Budget { share: budget.share / times, counts: budget.counts / times })
        })
    }

    /// Looks.
    pub fn look(&self, budget: Budget) -> Finding {
        (self.look)(budget)
    }
}

impl fmt::Debug for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.by)
    }
}
