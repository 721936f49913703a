//! Questions to a robot: expressions that its machine evaluates between two steps.

use std::sync::Arc;

use super::context::GroupContext;
use super::log::{LineKind, LogLine, Piece};
use super::program::ProgramId;

/// A question that waits for the end of the step.
#[derive(Clone)]
pub struct Question {
    pub text: Arc<str>,
    /// The robot's program with the question at its end.
    pub context: Arc<GroupContext>,
}

/// The end of a question.
#[derive(Debug)]
pub enum Answer {
    /// The value, as `log` prints it; no piece if statements have none.
    Value(Vec<Piece>),
    /// An error has ended it.
    Fault,
    /// It took more than this number of instructions.
    Endless(u16),
    /// It called a function that waits.
    Waits,
    /// The script does not run, because of an error.
    Stopped,
    /// There is none, for this reason.
    Refused(String),
}

impl Answer {
    /// Returns the line in the log. The program is that with the question, if the question was evaluated.
    pub fn line(self, text: &str, tick: u64, program: ProgramId) -> LogLine {
        let question = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let (kind, after) = match &self {
            Answer::Value(value) if value.is_empty() => (LineKind::Answer, ": done".to_owned()),
            Answer::Value(_) => (LineKind::Answer, " = ".to_owned()),
            Answer::Fault => (LineKind::Fault, ": ended by an error".to_owned()),
            Answer::Endless(budget) => {
                let end = format!(": ended, because it takes more than {budget} instructions");
                (LineKind::NoAnswer, end)
            }
            Answer::Waits => {
                let end =
                    ": ended, because it calls a function that waits, which only the script can";
                (LineKind::NoAnswer, end.to_owned())
            }
            Answer::Stopped => (
                LineKind::NoAnswer,
                ": no answer, because an error has stopped the script".to_owned(),
            ),
            Answer::Refused(reason) => (LineKind::NoAnswer, format!(": no answer: {reason}")),
        };
        let mut pieces = vec![Piece::Text((question + &after).into_bytes())];
        if let Answer::Value(value) = self {
            pieces.extend(value);
        }
        LogLine { tick, program, pieces, kind }
    }
}
