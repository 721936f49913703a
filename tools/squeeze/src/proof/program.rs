//! Reads an assembly file for the proof: sections, functions and decoded instructions.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;

use super::decode::{AsmOperation, JumpTarget, UnknownLine, decode};

/// Directives that may stand outside of functions.
const DIRECTIVES: &[&str] = &[
    ".2byte",
    ".4byte",
    ".addrsig",
    ".addrsig_sym",
    ".ascii",
    ".asciz",
    ".byte",
    ".comm",
    ".data",
    ".file",
    ".global",
    ".globl",
    ".hidden",
    ".ident",
    ".local",
    ".long",
    ".p2align",
    ".protected",
    ".quad",
    ".rodata",
    ".section",
    ".short",
    ".size",
    ".sleb128",
    ".string",
    ".type",
    ".uleb128",
    ".weak",
    ".word",
    ".zero",
    ".bss",
    ".text",
    ".set",
    ".balign",
    ".align",
    ".cfi_sections",
];

/// Directives that may stand within a function, because they generate no code.
const WITHIN: &[&str] = &[".file", ".loc", ".p2align"];

/// Sections that squeeze writes.
const OWN_SECTIONS: [&str; 2] = [".text.shared_frames", ".text.sequence_"];

/// A reason to refuse an assembly file, with its line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AsmFileError {
    /// The function of the line, if it is in one.
    pub function: Option<String>,
    /// The number of the line, from 1 on.
    pub line: usize,
    /// The reason.
    pub cause: ReadCause,
}

/// A reason to refuse a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReadCause {
    /// The instruction cannot be decoded.
    Decode(UnknownLine),
    /// The directive is not known, or must not stand there.
    Directive(String),
    /// The line is neither label, directive, instruction nor comment.
    Line(String),
    /// The label is defined twice.
    Twice(String),
    /// A branch leads to a label that the function does not have.
    Missing(String),
    /// The code jumps to an address that it computes.
    Indirect,
    /// A function begins in another, or ends without a beginning.
    Nested,
    /// SREG or the stack pointer is accessed by its address in data space.
    StatusByAddress,
}

impl fmt::Display for AsmFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(function) = &self.function {
            write!(f, "function `{function}`, ")?;
        }
        write!(f, "line {}: {}", self.line, self.cause)
    }
}

impl fmt::Display for ReadCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReadCause::Decode(error) => write!(
                f,
                "{error}; teach it to tools/squeeze/src/proof/decode.rs, or build with BBZ_SQUEEZE=off"
            ),
            ReadCause::Directive(text) => write!(
                f,
                "the directive `{text}` is not known here; check that it makes no code and add it to tools/squeeze/src/proof/program.rs, or build with BBZ_SQUEEZE=off"
            ),
            ReadCause::Line(text) => write!(f, "`{text}` cannot be read; is the file cut off?"),
            ReadCause::Twice(label) => write!(
                f,
                "the label `{label}` stands twice; use labels with `{{}}` of their own in asm! blocks"
            ),
            ReadCause::Missing(label) => {
                write!(f, "there is no label `{label}` in this function; is the file cut off?")
            }
            ReadCause::Indirect => write!(
                f,
                "a jump to a computed address; build with `-C jump-tables=no`, or with BBZ_SQUEEZE=off"
            ),
            ReadCause::Nested => {
                write!(f, "`.Lfunc_begin` and `.Lfunc_end` do not alternate; is the file cut off?")
            }
            ReadCause::StatusByAddress => write!(
                f,
                "SREG or the stack pointer is accessed by `lds` or `sts`; use `in` and `out`"
            ),
        }
    }
}

/// A place in the code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CodeLocation {
    /// The instruction has no target.
    None,
    /// An instruction, by its number.
    Inside(usize),
    /// The symbol of another function, or of code outside the file.
    Symbol(String),
    /// An address in flash.
    Address(u16),
}

/// An instruction at its place.
#[derive(Clone, Debug)]
pub struct ProofStep {
    /// The instruction; `None` after the last one of a function.
    pub op: Option<AsmOperation>,
    /// The target of a branch, jump or call.
    pub place: CodeLocation,
    /// The number of the line, from 1 on.
    pub line: usize,
    /// The instruction takes two words.
    pub is_long: bool,
}

/// A function.
#[derive(Clone, Debug)]
pub struct Routine {
    pub symbol: String,
    /// The number of the first instruction.
    pub start: usize,
    /// The number after the last instruction, where the step is empty.
    pub end: usize,
    /// The sorted texts of the asm! blocks, except those that only compute with registers and read
    /// flash: their timing has no effect.
    pub by_hand: Vec<String>,
}

/// The functions of a file, and everything else in it.
#[derive(Debug, Default)]
pub struct AssemblyProgram {
    /// All instructions of functions and of sections that squeeze writes.
    pub steps: Vec<ProofStep>,
    /// The functions.
    pub routines: Vec<Routine>,
    /// The lines outside of functions, by their section.
    pub rest: BTreeMap<String, Vec<String>>,
    /// The labels of functions, and the numbers of their instructions.
    pub labels: HashMap<String, usize>,
    /// The functions that code or data outside of this file may call.
    pub outside: HashSet<String>,
}

/// The state of reading a program.
struct ProgramReader {
    program: AssemblyProgram,
    section: String,
    labels: HashMap<String, usize>,
    /// The symbols that code or data mention other than as targets of calls and jumps.
    mentioned: HashSet<String>,
    called: HashSet<String>,
    /// The function that is being read.
    function: Option<Routine>,
    /// The last symbol outside of functions.
    symbol: String,
    /// The asm! block that is being read.
    block: Option<AsmBlock>,
    line: usize,
}

/// An asm! block.
#[derive(Default)]
struct AsmBlock {
    text: String,
    /// The block does more than compute with registers and read flash.
    is_seen: bool,
}

impl AssemblyProgram {
    /// Reads assembly as LLVM writes it.
    pub fn read(text: &str) -> Result<AssemblyProgram, AsmFileError> {
        let mut reader = ProgramReader {
            program: AssemblyProgram::default(),
            section: ".text".into(),
            labels: HashMap::new(),
            mentioned: HashSet::new(),
            called: HashSet::new(),
            function: None,
            symbol: String::new(),
            block: None,
            line: 0,
        };
        let read = text.lines().try_for_each(|line| {
            reader.line += 1;
            reader.take(line)
        });
        let function = reader.function.as_ref().map(|routine| routine.symbol.clone());
        let line = reader.line;
        read.map_err(|cause| AsmFileError { function, line, cause })?;
        reader.finish()
    }

    /// Returns the instructions that can be reached from `starts`.
    pub fn reachable(&self, starts: impl Iterator<Item = usize>) -> Vec<bool> {
        let mut reachable = vec![false; self.steps.len()];
        let mut open: Vec<usize> = starts.collect();
        while let Some(at) = open.pop() {
            let Some(ProofStep { op: Some(op), place, .. }) = self.steps.get(at) else { continue };
            if std::mem::replace(&mut reachable[at], true) {
                continue;
            }
            if let CodeLocation::Inside(target) = place {
                open.push(*target);
            }
            let skips = matches!(
                op,
                AsmOperation::SkipBit(..) | AsmOperation::SkipIo(..) | AsmOperation::SkipEqual(..)
            );
            if skips {
                open.push(at + 2);
            }
            let ends = matches!(
                op,
                AsmOperation::Jump(..)
                    | AsmOperation::JumpPointer
                    | AsmOperation::Return
                    | AsmOperation::ReturnFromInterrupt
            );
            if !ends {
                open.push(at + 1);
            }
        }
        reachable
    }

    /// Returns the function that contains a step.
    pub fn routine_at(&self, step: usize) -> Option<&Routine> {
        self.routines.iter().find(|routine| (routine.start..=routine.end).contains(&step))
    }
}

impl ProgramReader {
    fn take(&mut self, line: &str) -> Result<(), ReadCause> {
        let trimmed = line.trim();
        match trimmed {
            ";APP" | "; APP" if self.function.is_some() => self.block = Some(AsmBlock::default()),
            ";NO_APP" | "; NO_APP" => {
                if let (Some(block), Some(routine)) = (self.block.take(), &mut self.function)
                    && block.is_seen
                {
                    routine.by_hand.push(block.text);
                }
            }
            _ => {}
        }
        let code = trimmed.split(';').next().unwrap_or("").trim();
        if code.is_empty() {
            return Ok(());
        }
        if let Some(block) = &mut self.block
            && !is_debug(code)
        {
            block.text += &with_single_spaces(code);
            block.text += "\n";
            block.is_seen |= code.ends_with(':') || code.starts_with('.');
        }
        if let Some(label) = code.strip_suffix(':')
            && !label.contains(char::is_whitespace)
        {
            return self.label(label);
        }
        if code.starts_with('.') {
            return self.directive(code);
        }
        if self.function.is_none() && !self.is_own() {
            self.mention(code);
            self.keep(code);
            return Ok(());
        }
        if !code.starts_with(|first: char| first.is_ascii_lowercase()) {
            return Err(ReadCause::Line(code.to_owned()));
        }
        let (name, operands) = code.split_once(char::is_whitespace).unwrap_or((code, ""));
        let op = decode(name, operands).map_err(ReadCause::Decode)?;
        if let Some(block) = &mut self.block {
            block.is_seen |= !is_inward(&op);
        }
        match &op {
            AsmOperation::ReadAt(_, 0x5d..=0x5f) | AsmOperation::WriteAt(0x5d..=0x5f, _) => {
                return Err(ReadCause::StatusByAddress);
            }
            // Only the routines of shared entries return by `ijmp`.
            AsmOperation::JumpPointer if !self.is_own() => return Err(ReadCause::Indirect),
            AsmOperation::Branch(.., JumpTarget::Label(label))
            | AsmOperation::Jump(JumpTarget::Label(label), _)
            | AsmOperation::Call(JumpTarget::Label(label), _) => {
                self.called.insert(label.clone());
            }
            _ => self.mention(operands),
        }
        self.step(Some(op));
        Ok(())
    }

    fn step(&mut self, op: Option<AsmOperation>) {
        let is_long = matches!(
            op,
            Some(
                AsmOperation::ReadAt(..)
                    | AsmOperation::WriteAt(..)
                    | AsmOperation::Jump(_, true)
                    | AsmOperation::Call(_, true)
            )
        );
        self.program.steps.push(ProofStep {
            op,
            place: CodeLocation::None,
            line: self.line,
            is_long,
        });
    }

    fn mention(&mut self, text: &str) {
        let words = text.split(|c: char| !(c.is_alphanumeric() || matches!(c, '.' | '_' | '$')));
        self.mentioned.extend(words.map(str::to_owned));
    }

    /// Returns true in a section that squeeze has written.
    fn is_own(&self) -> bool {
        OWN_SECTIONS.iter().any(|own| self.section.starts_with(own))
    }

    /// Keeps a line outside of functions.
    fn keep(&mut self, code: &str) {
        let line = with_single_spaces(code);
        self.program.rest.entry(self.section.clone()).or_default().push(line);
    }

    fn label(&mut self, label: &str) -> Result<(), ReadCause> {
        let here = self.program.steps.len();
        if label.starts_with(".Lfunc_begin") {
            if self.function.is_some() {
                return Err(ReadCause::Nested);
            }
            let symbol = self.symbol.clone();
            self.function = Some(Routine { symbol, start: here, end: here, by_hand: Vec::new() });
            return Ok(());
        }
        if label.starts_with(".Lfunc_end") {
            let mut routine = self.function.take().ok_or(ReadCause::Nested)?;
            routine.end = here;
            routine.by_hand.sort();
            self.program.routines.push(routine);
            self.step(None);
            return Ok(());
        }
        if self.function.is_none() && !self.is_own() {
            if !label.starts_with(".L") {
                self.symbol = label.to_owned();
            }
            self.keep(&format!("{label}:"));
            return Ok(());
        }
        if self.labels.insert(label.to_owned(), here).is_some() {
            return Err(ReadCause::Twice(label.to_owned()));
        }
        Ok(())
    }

    fn directive(&mut self, code: &str) -> Result<(), ReadCause> {
        let name = code.split([' ', '\t']).next().unwrap_or("");
        let is_known = if self.function.is_some() {
            WITHIN.contains(&name)
        } else {
            DIRECTIVES.contains(&name)
        };
        if !is_known {
            return Err(ReadCause::Directive(code.to_owned()));
        }
        if !matches!(name, ".type" | ".size" | ".section" | ".asciz" | ".ascii" | ".string") {
            self.mention(code);
        }
        match name {
            ".section" => {
                if self.is_own() {
                    self.step(None);
                }
                let rest = code[name.len()..].trim();
                self.section = rest.split(',').next().unwrap_or("").to_owned();
                if !self.is_own() {
                    self.keep(code);
                }
            }
            ".text" | ".data" | ".bss" => self.section = name.to_owned(),
            // These lines may move, and do not affect the code.
            ".file" | ".loc" => {}
            _ if self.function.is_none() => self.keep(code),
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self) -> Result<AssemblyProgram, AsmFileError> {
        if let Some(routine) = self.function {
            let function = Some(routine.symbol);
            return Err(AsmFileError { function, line: self.line, cause: ReadCause::Nested });
        }
        self.step(None);
        let AssemblyProgram { steps, routines, .. } = &mut self.program;
        let symbols: HashSet<&str> =
            routines.iter().map(|routine| routine.symbol.as_str()).collect();
        let sizes: Vec<u16> = steps.iter().map(|step| if step.is_long { 4 } else { 2 }).collect();
        for (number, step) in steps.iter_mut().enumerate() {
            let Some(
                AsmOperation::Branch(.., target)
                | AsmOperation::Jump(target, _)
                | AsmOperation::Call(target, _),
            ) = &step.op
            else {
                continue;
            };
            if let JumpTarget::Behind(label, bytes) = target {
                let owner = routines.iter().find(|of| (of.start..=of.end).contains(&number));
                let place = self.labels.get(label).and_then(|at| behind(&sizes, *at, *bytes));
                step.place = CodeLocation::Inside(place.ok_or_else(|| AsmFileError {
                    function: owner.map(|routine| routine.symbol.clone()),
                    line: step.line,
                    cause: ReadCause::Missing(label.clone()),
                })?);
                continue;
            }
            step.place = match target {
                JumpTarget::Behind(..) => continue,
                JumpTarget::Address(address) => CodeLocation::Address(*address),
                JumpTarget::Label(label) if symbols.contains(label.as_str()) => {
                    CodeLocation::Symbol(label.clone())
                }
                JumpTarget::Label(label) => match self.labels.get(label) {
                    Some(place) => CodeLocation::Inside(*place),
                    None if !label.starts_with(".L") => CodeLocation::Symbol(label.clone()),
                    None => {
                        let owner =
                            routines.iter().find(|of| (of.start..=of.end).contains(&number));
                        return Err(AsmFileError {
                            function: owner.map(|routine| routine.symbol.clone()),
                            line: step.line,
                            cause: ReadCause::Missing(label.clone()),
                        });
                    }
                },
            };
        }
        let is_outside =
            |symbol: &&&str| self.mentioned.contains(**symbol) || !self.called.contains(**symbol);
        let outside: HashSet<String> =
            symbols.iter().filter(is_outside).map(|symbol| (*symbol).to_owned()).collect();
        self.program.outside = outside;
        self.program.labels = self.labels;
        Ok(self.program)
    }
}

/// Returns the instruction at a distance in bytes after another.
fn behind(sizes: &[u16], from: usize, bytes: u16) -> Option<usize> {
    let mut left = bytes;
    let mut at = from;
    while left > 0 {
        left = left.checked_sub(*sizes.get(at)?)?;
        at += 1;
    }
    Some(at)
}

/// Returns true for an instruction that affects only registers, flags of arithmetic and T; it may
/// read flash.
fn is_inward(op: &AsmOperation) -> bool {
    matches!(
        op,
        AsmOperation::Pair(..)
            | AsmOperation::Constant(..)
            | AsmOperation::Single(..)
            | AsmOperation::Multiply(..)
            | AsmOperation::Word(..)
            | AsmOperation::Copy(..)
            | AsmOperation::CopyPair(..)
            | AsmOperation::Load(..)
            | AsmOperation::ReadFlash(..)
            | AsmOperation::Store(..)
            | AsmOperation::Restore(..)
    )
}

/// Returns true for a line that only serves the debugger.
fn is_debug(code: &str) -> bool {
    code.starts_with(".loc") || code.starts_with(".file") || code.starts_with(".Ltmp")
}

fn with_single_spaces(code: &str) -> String {
    code.split_whitespace().collect::<Vec<_>>().join(" ")
}
