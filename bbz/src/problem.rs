//! The interface of the errors that end a command.
//!
//! Each module defines the errors that it can cause, with their messages and remedies. A function
//! that can fail for the reasons of several modules returns `Box<dyn Problem>`, to which `?` converts
//! each of them. This file imports none of these modules, so that a new cause changes one file only.

use std::error::Error;

use bittybuzz_toml_reader::Place;

/// A reason why a command cannot be carried out: a mistake of the command line, or of the files that
/// it names. The message is the `Display` form. The threads of a batch pass it on.
pub trait Problem: Error + Send {
    /// Returns advice on how to mend the problem.
    fn help(&self) -> Option<String> {
        None
    }

    /// Returns what is printed about the problem: one message, unless there are several mistakes or
    /// the place in a file is known.
    fn messages(&self) -> Vec<ProblemMessage<'_>> {
        vec![ProblemMessage { text: self.to_string(), place: None, help: self.help() }]
    }
}

/// A message about a mistake.
pub struct ProblemMessage<'a> {
    pub text: String,
    /// The place in the file that has the mistake.
    pub place: Option<&'a Place>,
    /// Advice on how to mend it.
    pub help: Option<String>,
}

impl<E: Problem + 'static> From<E> for Box<dyn Problem> {
    fn from(problem: E) -> Self {
        Box::new(problem)
    }
}
