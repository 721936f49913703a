//! Numbers of programs.

use std::fmt;

/// The number of the first program with a question at its end.
const FIRST_ASKED: usize = usize::MAX / 2;

/// The number of a program in the setup of a run.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ProgramId(pub usize);

impl ProgramId {
    /// Returns the number of the program at a place in the list of those with questions. They are
    /// numbered apart, so that scripts have the same numbers in a run without questions.
    pub fn asked(place: usize) -> Self {
        ProgramId(FIRST_ASKED + place)
    }

    /// Returns the place in that list; `None` for the program of a script.
    pub fn asked_place(self) -> Option<usize> {
        self.0.checked_sub(FIRST_ASKED)
    }
}

// Digests contain this text. The number of a question depends on other runs with the same setup.
impl fmt::Debug for ProgramId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.asked_place() {
            Some(_) => f.write_str("ProgramId(question)"),
            None => f.debug_tuple("ProgramId").field(&self.0).finish(),
        }
    }
}
