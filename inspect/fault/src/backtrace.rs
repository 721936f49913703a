//! The place where a script stopped: the source line, and the calls that led there.

use annotate_snippets::{AnnotationKind, Element, Level, Origin, Snippet};
use bittybuzz_compiler::codegen::GLOBAL_CODE;
use bittybuzz_compiler::render::{LINE_BYTES_MAX, MARKED_BYTES_MAX, WIDE_LINE};
use bittybuzz_compiler::symbols::{SourceSpan, Symbols};
use bittybuzz_vm_core::Entry;
use serde_json::{Value, json};

use crate::description::FaultPlace;
use crate::printable;
use crate::program::KnownProgram;

/// The number of innermost calls that are shown. An endless recursion has thousands.
const INNERMOST: usize = 6;

/// The number of outermost calls that are shown too.
const OUTERMOST: usize = 2;

/// The place at which the machine stopped.
pub struct Backtrace<'a> {
    program: KnownProgram<'a>,
    /// Positions in the code: the instruction that stopped, then the calls that led there.
    positions: Vec<u16>,
    /// The entry that the robot called, if it is known.
    entry: Option<Entry>,
}

impl<'a> Backtrace<'a> {
    /// Returns the backtrace of the machine's positions, innermost first.
    pub fn new(program: KnownProgram<'a>, positions: Vec<u16>, entry: Option<Entry>) -> Self {
        Backtrace { program, positions, entry }
    }

    /// Returns the program.
    pub(crate) fn program(&self) -> KnownProgram<'a> {
        self.program
    }

    /// Returns the source text of the instruction, if it is on one line.
    pub fn marked(&self) -> Option<String> {
        let place = self.place().filter(|place| place.line == place.end_line)?;
        let source = self.program.sources.source(place.file)?;
        let line = source.lines().nth(index(place.line))?;
        let (start, end) = (index(place.column), index(place.end_column));
        Some(line.chars().take(end).skip(start).collect())
    }

    /// Returns the places of the instruction and of the calls that led there as JSON, innermost
    /// first.
    pub fn places(&self) -> Vec<Value> {
        let Some(symbols) = self.program.symbols else { return Vec::new() };
        let place = |position: &u16| {
            let position = u32::from(*position);
            let place = symbols.position(position)?;
            Some(json!({
                "file": symbols.file(place.file),
                "line": place.line,
                "column": place.column,
                "function": symbols.function(position).map(|function| &function.name),
            }))
        };
        self.positions.iter().filter_map(place).collect()
    }

    /// Returns the positions of the instruction and of the calls that led there as JSON, innermost
    /// first. Without symbols, all their fields are null except the position.
    pub fn positions(&self) -> Vec<Value> {
        let call = |position: &u16| {
            let (symbols, at) = (self.program.symbols, u32::from(*position));
            let place = symbols.and_then(|symbols| symbols.position(at));
            let function = symbols.and_then(|symbols| symbols.function(at));
            json!({
                "position": position,
                "function": function.map(|function| &function.name),
                "file": place.and_then(|place| symbols?.file(place.file)),
                "line": place.map(|place| place.line),
                "column": place.map(|place| place.column),
                "end_line": place.map(|place| place.end_line),
                "end_column": place.map(|place| place.end_column),
            })
        };
        self.positions.iter().map(call).collect()
    }

    /// Returns the places of the innermost and the outermost calls, innermost first, and the number
    /// of calls between them.
    pub(crate) fn described(&self) -> (Vec<Option<FaultPlace>>, usize) {
        let count = self.positions.len();
        let is_shown = |number: usize| number < INNERMOST || number + OUTERMOST >= count;
        let shown = self.positions.iter().enumerate().filter(|(number, _)| is_shown(*number));
        let places: Vec<_> = shown.map(|(_, position)| self.described_place(*position)).collect();
        let left_out = count - places.len();
        (places, left_out)
    }

    fn described_place(&self, position: u16) -> Option<FaultPlace> {
        let span = self.program.symbols?.position(position.into())?;
        FaultPlace::new(self.program, position.into(), span)
    }

    /// Returns place, source line and calls for a message.
    pub fn elements(&self) -> Vec<Element<'static>> {
        let mut elements = Vec::new();
        match (self.place(), self.program.symbols, self.positions.first()) {
            (Some(place), Some(symbols), _) => elements.push(self.source(place, symbols)),
            (_, _, Some(position)) => elements.push(note(format!(
                "at position {position} of the code; without symbols, file and line are unknown"
            ))),
            // The entry itself could not be called, so there is no position.
            (_, _, None) => elements.push(note(format!("the robot called {}", self.entry_name()))),
        }
        elements.extend(self.calls().into_iter().map(note));
        elements
    }

    fn entry_name(&self) -> &'static str {
        match self.entry {
            Some(Entry::Global) => GLOBAL_CODE,
            Some(Entry::Init) => "`init`",
            Some(Entry::Step) => "`step`",
            Some(Entry::Reset) => "`reset`",
            Some(Entry::Destroy) => "`destroy`",
            None => "the script",
        }
    }

    fn place(&self) -> Option<SourceSpan> {
        self.program.symbols?.position(u32::from(*self.positions.first()?))
    }

    /// Returns the source line with the instruction marked, or only the place if there is no such
    /// line.
    fn source(&self, place: SourceSpan, symbols: &Symbols) -> Element<'static> {
        // A damaged file of symbols may have places in files that it does not list.
        let path = printable(symbols.file(place.file).unwrap_or("<unknown>"));
        let source = self.program.sources.source(place.file);
        let line = source.as_deref().and_then(|text| text.lines().nth(index(place.line)));
        let Some(line) = line.filter(|line| line.len() <= LINE_BYTES_MAX) else {
            let (line, column) = (index(place.line) + 1, index(place.column) + 1);
            return Origin::path(path).line(line).char_column(column).into();
        };
        let byte =
            |column: u32| line.char_indices().nth(index(column)).map_or(line.len(), |(at, _)| at);
        let start = byte(place.column);
        // An instruction that continues on the next line is marked up to the end of this one.
        let end = if place.end_line == place.line { byte(place.end_column) } else { line.len() };
        let most = match line.len() {
            0..=WIDE_LINE => line.len(),
            _ => line.floor_char_boundary(start + MARKED_BYTES_MAX),
        };
        Snippet::source(line.to_owned())
            .line_start(index(place.line) + 1)
            .path(path)
            .annotation(AnnotationKind::Primary.span(start..end.min(most).max(start)))
            .into()
    }

    /// Returns a line for each function that was running, innermost first.
    fn calls(&self) -> Vec<String> {
        let Some(symbols) = self.program.symbols else { return Vec::new() };
        let name = |position: u16| match symbols.function(u32::from(position)) {
            // The global code and lambdas have descriptions instead of names.
            Some(function) if function.name.contains(' ') => function.name.clone(),
            Some(function) => format!("`{}`", function.name),
            None => "an unknown function".to_owned(),
        };
        // Nothing has called the global code.
        if let [only] = self.positions[..]
            && name(only) == GLOBAL_CODE
        {
            return Vec::new();
        }
        let count = self.positions.len();
        let mut lines = Vec::new();
        for (number, position) in self.positions.iter().enumerate() {
            if number == INNERMOST && count > INNERMOST + OUTERMOST {
                lines.push(format!("... {} more calls ...", count - INNERMOST - OUTERMOST));
            }
            if number >= INNERMOST && number + OUTERMOST < count {
                continue;
            }
            let caller = self.positions.get(number + 1);
            let place = caller.and_then(|caller| symbols.position(u32::from(*caller)));
            lines.push(match place {
                Some(SourceSpan { file, line, column, .. }) => format!(
                    "in {}, called at {}:{line}:{column}",
                    name(*position),
                    symbols.file(file).unwrap_or("<unknown>")
                ),
                None => format!("in {}", name(*position)),
            });
        }
        lines
    }
}

fn note(text: String) -> Element<'static> {
    Level::NOTE.message(printable(&text)).into()
}

/// Converts a line or column that counts from 1 to an index.
fn index(number: u32) -> usize {
    number.saturating_sub(1) as usize
}
