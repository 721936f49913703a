//! The places of local variables, each with the range of code in which it is valid, for the
//! symbols.

use crate::asm::{CodeMark, FunctionCode};
use crate::symbols::LocalPlace;

/// A local variable and a range of code in which it has one place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocalRange {
    /// The name in the source, or `self`.
    pub name: String,
    pub place: LocalPlace,
    /// Offset of the first instruction of the range, from the function's header.
    pub from: usize,
    /// Offset of the first instruction after the range, from the function's header.
    pub to: usize,
}

/// The locals of a function while its code is generated.
#[derive(Debug, Default)]
pub struct Locals {
    /// Locals that are in scope at the current instruction, outer blocks first.
    open: Vec<Open>,
    closed: Vec<(Open, CodeMark)>,
}

#[derive(Debug)]
struct Open {
    name: String,
    place: LocalPlace,
    from: CodeMark,
}

impl Locals {
    /// Starts the range of a local at a mark. The range ends with [`Locals::close`] or with the
    /// function.
    pub fn open(&mut self, name: &str, place: LocalPlace, from: CodeMark) {
        self.open.push(Open { name: name.to_owned(), place, from });
    }

    /// Adds a local whose range lies between two marks.
    pub fn add(&mut self, name: &str, place: LocalPlace, from: CodeMark, to: CodeMark) {
        self.closed.push((Open { name: name.to_owned(), place, from }, to));
    }

    /// Returns the number of locals that are open.
    pub fn count(&self) -> usize {
        self.open.len()
    }

    /// Ends the ranges of all open locals except the first `count`, at the end of a block.
    pub fn close(&mut self, count: usize, to: CodeMark) {
        self.closed.extend(self.open.drain(count..).map(|local| (local, to)));
    }

    /// Returns all locals of the assembled function, sorted by the start of their ranges.
    pub fn finish(self, code: &FunctionCode) -> Vec<LocalRange> {
        let closed = self.closed.into_iter().map(|(local, to)| (local, code.offset(to)));
        let open = self.open.into_iter().map(|local| (local, code.bytes.len()));
        let all = closed.chain(open).map(|(Open { name, place, from }, to)| {
            let from = code.offset(from);
            LocalRange { name, place, from, to }
        });
        let mut ranges: Vec<LocalRange> = all.filter(|range| range.from < range.to).collect();
        ranges.sort_by_key(|range| range.from);
        ranges
    }
}
