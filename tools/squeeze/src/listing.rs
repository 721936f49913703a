//! Assembly as lines with parsed instructions.

use std::fmt;

/// A line of assembly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ListingLine {
    /// A label.
    Label(String),
    /// An instruction.
    Code(AsmInstruction),
    /// Anything else.
    Other(String),
}

impl ListingLine {
    /// Sets `by_hand` if the following lines were written by the programmer, who may count their
    /// cycles.
    pub fn enters_assembly(&self, by_hand: &mut bool) {
        if let ListingLine::Other(text) = self
            && text.contains("APP")
        {
            *by_hand = !text.contains("NO_APP");
        }
    }
}

/// An instruction.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct AsmInstruction {
    /// The mnemonic, in lower case.
    pub name: String,
    /// The text after the mnemonic.
    pub operands: String,
}

impl AsmInstruction {
    /// Creates an instruction from its parts.
    pub fn new(name: &str, operands: &str) -> Self {
        AsmInstruction { name: name.into(), operands: operands.into() }
    }

    /// Returns the largest size of the instruction in bytes.
    pub fn bytes(&self) -> usize {
        if matches!(self.name.as_str(), "call" | "jmp" | "lds" | "sts") { 4 } else { 2 }
    }

    /// Returns true if the instruction may skip the next one.
    pub fn skips(&self) -> bool {
        matches!(self.name.as_str(), "cpse" | "sbrc" | "sbrs" | "sbic" | "sbis")
    }

    /// Returns true if execution never continues with the next instruction.
    pub fn ends_flow(&self) -> bool {
        matches!(self.name.as_str(), "ret" | "reti" | "rjmp" | "jmp" | "ijmp")
    }

    /// Returns true for a jump, branch, call or return.
    pub fn branches(&self) -> bool {
        self.ends_flow()
            || self.name.starts_with("br")
            || matches!(self.name.as_str(), "call" | "rcall" | "icall")
    }
}

impl fmt::Display for AsmInstruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\t{}\t{}", self.name, self.operands)
    }
}

/// A function, with its position in the listing.
#[derive(Clone, Debug)]
pub struct AsmFunction {
    pub symbol: String,
    /// The first line, after the symbol.
    pub start: usize,
    /// The line after the last one.
    pub end: usize,
}

/// The assembly of a program.
#[derive(Debug, Default)]
pub struct Listing {
    pub lines: Vec<ListingLine>,
}

impl Listing {
    /// Reads assembly of LLVM.
    pub fn read(text: &str) -> Listing {
        // LLVM declares the debugger's files at their first use, and that line may be moved.
        let is_file = |line: &ListingLine| matches!(line, ListingLine::Other(text) if text.contains("\t.file\t"));
        let (mut lines, rest): (Vec<ListingLine>, Vec<ListingLine>) =
            text.lines().map(line).partition(is_file);
        lines.extend(rest);
        Listing { lines }
    }

    /// Returns the functions, as LLVM marks them: a symbol, then `.Lfunc_begin` and `.Lfunc_end`.
    pub fn functions(&self) -> Vec<AsmFunction> {
        let mut functions = Vec::new();
        let mut symbol = "";
        let mut start = None;
        for (number, line) in self.lines.iter().enumerate() {
            let ListingLine::Label(label) = line else { continue };
            if label.starts_with(".Lfunc_begin") {
                start = Some((symbol, number + 1));
            } else if label.starts_with(".Lfunc_end") {
                if let Some((symbol, start)) = start.take() {
                    functions.push(AsmFunction { symbol: symbol.into(), start, end: number });
                }
            } else if !label.starts_with(".L") {
                symbol = label;
            }
        }
        functions
    }

    /// Returns the line of the next instruction, from line `from` to before line `end`; `None` if a
    /// label to which branches lead comes first.
    pub fn next_code(&self, from: usize, end: usize) -> Option<usize> {
        for number in from..end {
            match &self.lines[number] {
                ListingLine::Code(_) => return Some(number),
                ListingLine::Label(label) if !is_mark(label) => return None,
                _ => {}
            }
        }
        None
    }

    /// Returns the instruction of that line.
    pub fn code(&self, number: usize) -> Option<&AsmInstruction> {
        match self.lines.get(number) {
            Some(ListingLine::Code(instruction)) => Some(instruction),
            _ => None,
        }
    }

    /// Returns the last instruction before that line, from line `start` on.
    pub fn code_before(&self, line: usize, start: usize) -> Option<&AsmInstruction> {
        (start..line).rev().find_map(|line| self.code(line))
    }

    /// Returns true if a second branch follows the one after that line.
    pub fn is_branch_behind_branch(&self, line: usize, end: usize) -> bool {
        self.next_code(line + 1, end)
            .and_then(|branch| self.next_code(branch + 1, end))
            .and_then(|next| self.code(next))
            .is_some_and(|next| next.name.starts_with("br"))
    }

    /// Removes lines that were emptied.
    pub fn compact(&mut self) {
        self.lines.retain(|line| !matches!(line, ListingLine::Other(text) if text.is_empty()));
    }

    /// Empties a line.
    pub fn remove(&mut self, number: usize) {
        self.lines[number] = ListingLine::Other(String::new());
    }
}

impl fmt::Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for line in &self.lines {
            match line {
                ListingLine::Label(label) => writeln!(f, "{label}:")?,
                ListingLine::Code(instruction) => writeln!(f, "{instruction}")?,
                ListingLine::Other(text) => writeln!(f, "{text}")?,
            }
        }
        Ok(())
    }
}

/// Returns true if a label only marks a place for the debugger.
pub fn is_mark(label: &str) -> bool {
    label.starts_with(".Ltmp") || label.starts_with(".Lfunc")
}

fn line(text: &str) -> ListingLine {
    let trimmed = text.trim();
    if let Some(label) = trimmed.strip_suffix(':')
        && !label.contains(char::is_whitespace)
    {
        return ListingLine::Label(label.into());
    }
    let is_code =
        trimmed.starts_with(|first: char| first.is_ascii_lowercase()) && text.starts_with('\t');
    if !is_code {
        return ListingLine::Other(with_one_name(text));
    }
    let code = trimmed.split(';').next().unwrap_or("").trim();
    let (name, operands) = code.split_once(char::is_whitespace).unwrap_or((code, ""));
    ListingLine::Code(AsmInstruction::new(name, operands.trim()))
}

/// Joins folder and name in `.file 1 "folder" "name"`, as older assemblers require it.
fn with_one_name(text: &str) -> String {
    if text.trim_start().starts_with(".file\t") {
        text.replacen("\" \"", "/", 1)
    } else {
        text.into()
    }
}
