//! Changes to an object file that know what its bytes mean, so that many of the results are still programs.

use std::ops::Range;

use bittybuzz_compiler::bo::instruction::{BoAction, BoInstruction, OperandForm, TABLE};
use bittybuzz_compiler::bo::read::Bo;

/// An object file taken apart.
#[derive(Clone)]
pub struct Program {
    strings: Vec<Vec<u8>>,
    code: Vec<BoCode>,
}

#[derive(Clone, Copy)]
struct BoCode {
    opcode: u8,
    argument: Argument,
}

#[derive(Clone, Copy)]
enum Argument {
    None,
    Word(u32),
    /// An instruction by its number in the list.
    Address(usize),
}

impl Program {
    /// `None` if the bytes are no object file.
    pub fn of(bytes: &[u8]) -> Option<Program> {
        let bo = Bo::read(bytes).ok()?;
        let code = bo.code.iter().map(|instruction| code(bytes, instruction));
        Some(Program {
            strings: bo.strings.iter().map(|text| text.clone().into_bytes()).collect(),
            code: code.collect(),
        })
    }

    /// The bytes of the file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = (self.strings.len() as u16).to_le_bytes().to_vec();
        for text in &self.strings {
            bytes.extend(text);
            bytes.push(0);
        }
        let mut offsets = Vec::with_capacity(self.code.len());
        let mut end = bytes.len();
        for code in &self.code {
            offsets.push(end as u32);
            end += if matches!(code.argument, Argument::None) { 1 } else { 5 };
        }
        for code in &self.code {
            bytes.push(code.opcode);
            match code.argument {
                Argument::None => {}
                Argument::Word(word) => bytes.extend(word.to_le_bytes()),
                Argument::Address(at) => {
                    let offset = offsets.get(at).copied().unwrap_or(end as u32);
                    bytes.extend(offset.to_le_bytes());
                }
            }
        }
        bytes
    }

    /// Makes one change: `kind` says which, `place` where, `value` what with. `other` is a program to take from.
    pub fn change(&mut self, other: &Program, [kind, place, value]: [u8; 3]) {
        let count = self.code.len();
        if count == 0 {
            return;
        }
        let at = usize::from(place) * count / 256;
        match kind % 16 {
            0..4 => self.set_argument(at, value),
            4..7 => self.set_opcode(at, value),
            7 | 8 => {
                let from = self.statement(value);
                self.insert(self.statement(place).start, from.start, self.code[from].to_vec());
            }
            9 | 10 => {
                let from = other.statement(value);
                self.insert(self.statement(place).start, from.start, other.code[from].to_vec());
            }
            11 | 12 => self.remove(self.statement(place)),
            13 => {
                // A word that the machine's own names, keywords of the listing, or nothing known stands for.
                let strings = self.strings.len().max(1);
                let text = WORDS[usize::from(value) % WORDS.len()].to_vec();
                match self.strings.get_mut(usize::from(place) % strings) {
                    Some(there) => *there = text,
                    None => self.strings.push(text),
                }
            }
            14 if value < 128 => self.remove(at..at + 1),
            14 => self.code.swap(at, usize::from(value) * count / 256),
            _ => {
                let jumps = self.code.iter_mut();
                let mut jumps: Vec<&mut BoCode> =
                    jumps.filter(|code| matches!(code.argument, Argument::Address(_))).collect();
                if !jumps.is_empty() {
                    let chosen = usize::from(place) % jumps.len();
                    jumps[chosen].argument = Argument::Address(usize::from(value) * count / 256);
                }
            }
        }
    }

    fn set_argument(&mut self, at: usize, value: u8) {
        let (count, strings) = (self.code.len(), self.strings.len());
        let code = &mut self.code[at];
        code.argument = match (TABLE[usize::from(code.opcode)].1, code.argument) {
            (OperandForm::String(_), _) => {
                Argument::Word((usize::from(value) % (strings + 1)) as u32)
            }
            (OperandForm::Locals(_), _) => Argument::Word(u32::from(value) % 8),
            (OperandForm::Float(_), Argument::Word(word)) => {
                Argument::Word(word ^ 1 << (value & 31))
            }
            (OperandForm::Int(_), _) => Argument::Word(i32::from(value as i8) as u32),
            (OperandForm::Address(_), _) => Argument::Address(usize::from(value) * count / 256),
            (_, argument) => argument,
        };
    }

    /// Another instruction that takes and leaves as many values.
    fn set_opcode(&mut self, at: usize, value: u8) {
        let old = self.code[at];
        let kind = Kind::of(old.opcode);
        let like: Vec<u8> =
            (0..TABLE.len() as u8).filter(|opcode| Kind::of(*opcode) == kind).collect();
        self.code[at].opcode = like[usize::from(value) % like.len()];
        if kind == Kind::Push {
            self.set_argument(at, value / 4);
        }
    }

    /// The first statement from a place on: the instructions until there are as many values as before.
    fn statement(&self, place: u8) -> Range<usize> {
        // In front of the first `nop` stand the names of functions.
        let first = self.code.iter().position(|code| code.opcode == NOP).map_or(0, |nop| nop + 1);
        let place = first + usize::from(place) * self.code.len().saturating_sub(first) / 256;
        let (mut start, mut depth) = (first, 0);
        for at in first..self.code.len() {
            depth += self.gain(at);
            if depth <= 0 {
                if at >= place {
                    return start..at + 1;
                }
                (start, depth) = (at + 1, 0);
            }
        }
        start.min(self.code.len())..self.code.len()
    }

    /// Returns the number of values that an instruction adds to the stack.
    fn gain(&self, at: usize) -> i64 {
        match TABLE[usize::from(self.code[at].opcode)].1 {
            OperandForm::Plain(BoAction::Callc) => {
                let before = at.checked_sub(1).map(|before| self.code[before].argument);
                let arguments = match before {
                    Some(Argument::Word(count)) => i64::from(count),
                    _ => 0,
                };
                -2 - arguments
            }
            OperandForm::Plain(action) => match action {
                BoAction::PushNil | BoAction::Dup | BoAction::PushT => 1,
                BoAction::Pop | BoAction::Ret1 | BoAction::Binary(_) | BoAction::Tget => -1,
                BoAction::Gstore | BoAction::Calls => -2,
                BoAction::Tput => -3,
                _ => 0,
            },
            OperandForm::Float(_) | OperandForm::Int(_) | OperandForm::String(_) => 1,
            OperandForm::Locals(make) => match make(0) {
                BoAction::Lload(_) => 1,
                BoAction::Lstore(_) => -1,
                _ => 0,
            },
            OperandForm::Address(make) => match make(0) {
                BoAction::PushCn(_) | BoAction::PushL(_) => 1,
                BoAction::Jump(_) => 0,
                _ => -1,
            },
        }
    }

    /// Inserts instructions that stood at `from`; what they jump to among themselves comes along.
    fn insert(&mut self, at: usize, from: usize, codes: Vec<BoCode>) {
        // Repeated insertions must not make every input a long one.
        if self.code.len() + codes.len() > 1000 {
            return;
        }
        // What led here leads to the new instructions.
        self.shift(at + 1, codes.len() as isize);
        let moved = codes.iter().map(|code| match code.argument {
            Argument::Address(to) if (from..=from + codes.len()).contains(&to) => {
                BoCode { argument: Argument::Address(to - from + at), ..*code }
            }
            _ => *code,
        });
        self.code.splice(at..at, moved);
    }

    fn remove(&mut self, range: Range<usize>) {
        self.code.drain(range.clone());
        self.shift(range.end, -(range.len() as isize));
    }

    /// Moves the targets of jumps after a place by the number of instructions that were inserted or
    /// removed there.
    fn shift(&mut self, from: usize, by: isize) {
        for code in &mut self.code {
            if let Argument::Address(to) = &mut code.argument
                && *to >= from
            {
                *to = to.wrapping_add_signed(by);
            }
        }
    }
}

const NOP: u8 = 0;

/// Instructions of one kind can stand for each other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Binary,
    Unary,
    Push,
    Jump,
    Other(u8),
}

impl Kind {
    fn of(opcode: u8) -> Kind {
        match TABLE[usize::from(opcode)].1 {
            OperandForm::Plain(BoAction::Binary(_) | BoAction::Tget) => Kind::Binary,
            OperandForm::Plain(BoAction::Unary(_)) => Kind::Unary,
            OperandForm::Float(_) | OperandForm::Int(_) | OperandForm::String(_) => Kind::Push,
            OperandForm::Address(make)
                if matches!(make(0), BoAction::Jumpz(_) | BoAction::Jumpnz(_)) =>
            {
                Kind::Jump
            }
            _ => Kind::Other(opcode),
        }
    }
}

/// Names that the importer or the checks treat in a special way.
const WORDS: [&[u8]; 16] = [
    b"x",
    b"step",
    b"init",
    b"math",
    b"sqrt",
    b"foreach",
    b"log",
    b"neighbors",
    b"self",
    b"swarm",
    b"",
    b"\xff",
    b"size",
    b"rng",
    b"led",
    b"a\nb",
];

fn code(bytes: &[u8], instruction: &BoInstruction) -> BoCode {
    let opcode = bytes.get(instruction.offset).copied().unwrap_or(0);
    let argument = match instruction.action {
        BoAction::PushCn(to)
        | BoAction::PushL(to)
        | BoAction::Jump(to)
        | BoAction::Jumpz(to)
        | BoAction::Jumpnz(to) => Argument::Address(to),
        _ if is_plain(opcode) => Argument::None,
        _ => {
            let word = bytes.get(instruction.offset + 1..).and_then(|rest| rest.first_chunk());
            Argument::Word(u32::from_le_bytes(*word.unwrap_or(&[0; 4])))
        }
    };
    BoCode { opcode, argument }
}

fn is_plain(opcode: u8) -> bool {
    matches!(TABLE[usize::from(opcode)].1, OperandForm::Plain(_))
}
