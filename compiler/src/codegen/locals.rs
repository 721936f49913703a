//! The places of local variables and the code in which each has its place, for the symbols.

use crate::codegen::asm::{FunctionCode, Mark};
use crate::symbols::LocalPlace;

/// A local variable and the code in which its name has that place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocalRange {
    /// The name in the source; `self` for the self.
    pub name: String,
    /// Its place.
    pub place: LocalPlace,
    /// Offset of the first instruction, from the function's header.
    pub from: usize,
    /// Offset of the first instruction after them.
    pub to: usize,
}

/// The locals of a function while its code is generated.
#[derive(Debug, Default)]
pub struct Locals {
    /// Those that have a place here, outer blocks first.
    open: Vec<Open>,
    closed: Vec<(Open, Mark)>,
}

#[derive(Debug)]
struct Open {
    name: String,
    place: LocalPlace,
    from: Mark,
}

impl Locals {
    /// From that mark on the name has that place, until [`Locals::close`] or the end of the function.
    pub fn open(&mut self, name: &str, place: LocalPlace, from: Mark) {
        self.open.push(Open { name: name.to_owned(), place, from });
    }

    /// Between two marks the name has that place.
    pub fn add(&mut self, name: &str, place: LocalPlace, from: Mark, to: Mark) {
        self.closed.push((Open { name: name.to_owned(), place, from }, to));
    }

    /// Returns the number of locals that are open.
    pub fn count(&self) -> usize {
        self.open.len()
    }

    /// A block ends: all open locals but the first `count` lose their places.
    pub fn close(&mut self, count: usize, to: Mark) {
        let count = count.min(self.open.len());
        self.closed.extend(self.open.drain(count..).map(|local| (local, to)));
    }

    /// Returns all locals of the assembled function, by the start of their ranges.
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
