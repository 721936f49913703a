//! Prints a `.bo` file as text with one line per instruction. Diagnostics about an imported program
//! refer to these lines.

use std::fmt::Write as _;

use crate::bo::instruction::Action;
use crate::bo::read::Bo;
use crate::source::{FileId, Span};

/// The text of a `.bo` file, and the mapping between lines and instructions.
#[derive(Debug, Clone)]
pub struct Listing {
    /// Lines of the form `OFFSET: mnemonic argument`; a string's text follows after `#`.
    pub text: String,
    /// The offset of each line in `text`.
    starts: Vec<u32>,
}

impl Listing {
    /// Creates the listing of a file.
    pub fn new(bo: &Bo) -> Self {
        let mut text = String::new();
        let mut starts = Vec::with_capacity(bo.code.len());
        for instruction in &bo.code {
            starts.push(text.len() as u32);
            let argument = match instruction.action {
                Action::PushF(value) => format!(" {value:?}"),
                Action::PushI(value) | Action::PushCc(value) => format!(" {value}"),
                Action::PushS(number) => format!(" {number}  # {:?}", bo.string(number)),
                Action::Lload(number) | Action::Lstore(number) | Action::Lremove(number) => {
                    format!(" {number}")
                }
                Action::PushCn(to)
                | Action::PushL(to)
                | Action::Jump(to)
                | Action::Jumpz(to)
                | Action::Jumpnz(to) => format!(" {}", bo.offset(to)),
                _ => String::new(),
            };
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}: {}{argument}", instruction.offset, instruction.mnemonic);
        }
        Listing { text, starts }
    }

    /// Returns the span of an instruction's line.
    pub fn span(&self, at: usize) -> Span {
        let start = self.start(at);
        let end = self.start(at + 1).saturating_sub(1).max(start);
        Span { file: FileId(0), start, end }
    }

    /// Returns the instruction in whose line a span starts.
    pub fn instruction(&self, span: Span) -> usize {
        self.starts.partition_point(|start| *start <= span.start).saturating_sub(1)
    }

    fn start(&self, at: usize) -> u32 {
        self.starts.get(at).copied().unwrap_or(self.text.len() as u32)
    }
}
