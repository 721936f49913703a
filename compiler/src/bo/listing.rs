//! Prints a `.bo` file as text with one line per instruction. Diagnostics about an imported program
//! refer to these lines.

use std::fmt::Write as _;

use crate::bo::instruction::BoAction;
use crate::bo::read::Bo;
use crate::source::{FileId, Span};

/// The text of a `.bo` file, and the mapping between lines and instructions.
#[derive(Debug, Clone)]
pub struct BoListing {
    /// Lines of the form `OFFSET: mnemonic argument`; a string's text follows after `#`.
    pub text: String,
    /// The offset of each line in `text`.
    starts: Vec<u32>,
}

impl BoListing {
    /// Creates the listing of a file.
    pub fn new(bo: &Bo) -> Self {
        let mut text = String::new();
        let mut starts = Vec::with_capacity(bo.code.len());
        for instruction in &bo.code {
            starts.push(text.len() as u32);
            let argument = match instruction.action {
                BoAction::PushF(value) => format!(" {value:?}"),
                BoAction::PushI(value) | BoAction::PushCc(value) => format!(" {value}"),
                BoAction::PushS(number) => format!(" {number}  # {:?}", bo.string(number)),
                BoAction::Lload(number) | BoAction::Lstore(number) | BoAction::Lremove(number) => {
                    format!(" {number}")
                }
                BoAction::PushCn(to)
                | BoAction::PushL(to)
                | BoAction::Jump(to)
                | BoAction::Jumpz(to)
                | BoAction::Jumpnz(to) => format!(" {}", bo.offset(to)),
                _ => String::new(),
            };
            writeln!(text, "{}: {}{argument}", instruction.offset, instruction.mnemonic)
                .expect("writing to a string cannot fail");
        }
        BoListing { text, starts }
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
