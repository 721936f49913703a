//! Tracks values from the tape: the bytes on which a condition depends, and the values that they
//! were compared with.

use super::cpu::Cpu;
use super::decode::{AsmOperation, PairOperation, flag};
use super::run::{FLAGS_AT, Tape};

/// A comparison: for each of its two values the place on the tape, if it comes from there, and the
/// other value.
pub type Hint = [Option<(usize, u8)>; 2];

/// The origin of each value: a bit for each of the first 128 places on the tape.
#[derive(Clone)]
pub struct Trail {
    registers: [u128; 32],
    flags: u128,
    /// The T flag.
    copied: u128,
    hints: Vec<Hint>,
}

fn bit(place: usize) -> u128 {
    if place < 128 { 1 << place } else { 0 }
}

impl Trail {
    /// Starts with these registers and the flags from the tape.
    pub fn new(registers: u32) -> Trail {
        let of = |number: usize| if registers >> number & 1 != 0 { bit(number) } else { 0 };
        let flags = bit(FLAGS_AT);
        Trail { registers: std::array::from_fn(of), flags, copied: flags, hints: Vec::new() }
    }

    /// Sets the origin of a register to a place on the tape, or to none.
    pub fn set_register(&mut self, register: u8, place: Option<usize>) {
        self.registers[usize::from(register)] = place.map_or(0, bit);
    }

    /// Sets the origin of the flags to a place on the tape.
    pub fn set_flags(&mut self, place: usize) {
        self.flags = bit(place);
        self.copied = bit(place);
    }

    /// Takes the last comparisons.
    pub fn take_hints(&mut self) -> Vec<Hint> {
        std::mem::take(&mut self.hints)
    }

    /// Returns the origin of the outcome of a conditional instruction.
    pub fn condition(&self, op: &AsmOperation) -> u128 {
        match *op {
            AsmOperation::Branch(flag::T, ..) => self.copied,
            AsmOperation::SkipBit(register, ..) => self.registers[usize::from(register)],
            AsmOperation::SkipEqual(one, other) => {
                self.registers[usize::from(one)] | self.registers[usize::from(other)]
            }
            _ => self.flags,
        }
    }

    /// Tracks an instruction; `cpu` and `cursor` are the core and the place on the tape before it.
    pub fn follow(&mut self, op: &AsmOperation, cpu: &Cpu, tape: &Tape, cursor: usize) {
        let tags = self.registers;
        let at = |register: u8| tags[usize::from(register)];
        let takes_carry =
            |kind| matches!(kind, PairOperation::Adc | PairOperation::Sbc | PairOperation::Cpc);
        match *op {
            AsmOperation::Pair(kind, to, from) => {
                if matches!(
                    kind,
                    PairOperation::Cp
                        | PairOperation::Cpc
                        | PairOperation::Sub
                        | PairOperation::Sbc
                ) {
                    let value = |register: u8| cpu.registers[usize::from(register)];
                    self.hint([
                        place(tape, at(to), value(to), value(from)),
                        place(tape, at(from), value(from), value(to)),
                    ]);
                }
                let mut tag = self.registers[usize::from(to)] | self.registers[usize::from(from)];
                if takes_carry(kind) {
                    tag |= self.flags;
                }
                if to == from && matches!(kind, PairOperation::Eor | PairOperation::Sub) {
                    tag = 0;
                }
                self.flags = tag;
                if !matches!(kind, PairOperation::Cp | PairOperation::Cpc) {
                    self.registers[usize::from(to)] = tag;
                }
            }
            AsmOperation::Constant(kind, to, value) => {
                if matches!(kind, PairOperation::Cp | PairOperation::Sub | PairOperation::Sbc) {
                    self.hint([place(tape, at(to), cpu.registers[usize::from(to)], value), None]);
                }
                let carry = if takes_carry(kind) { self.flags } else { 0 };
                let tag = self.registers[usize::from(to)] | carry;
                self.flags = tag;
                if kind != PairOperation::Cp {
                    self.registers[usize::from(to)] = tag;
                }
            }
            AsmOperation::Single(_, register) => {
                // `ror` takes the carry.
                self.registers[usize::from(register)] |= self.flags;
                self.flags = self.registers[usize::from(register)];
            }
            AsmOperation::Multiply(_, one, other) => {
                let tag = at(one) | at(other);
                self.registers[0] = tag;
                self.registers[1] = tag;
                self.flags = tag;
            }
            AsmOperation::Word(pair, ..) => {
                let pair = usize::from(pair);
                let tag = self.registers[pair] | self.registers[pair + 1];
                self.registers[pair + 1] = tag;
                self.flags = tag;
            }
            AsmOperation::Copy(to, from) => self.registers[usize::from(to)] = at(from),
            AsmOperation::CopyPair(to, from) => {
                let tags = [at(from), at(from + 1)];
                self.registers[usize::from(to)] = tags[0];
                self.registers[usize::from(to + 1)] = tags[1];
            }
            AsmOperation::Load(to, _) => self.registers[usize::from(to)] = 0,
            AsmOperation::Read(to, _)
            | AsmOperation::ReadAt(to, _)
            | AsmOperation::ReadFlash(to, _) => {
                self.registers[usize::from(to)] = bit(cursor);
            }
            AsmOperation::In(to, from) => {
                let tag = if from < 0x3d { bit(cursor) } else { self.flags };
                self.registers[usize::from(to)] = tag;
            }
            AsmOperation::Out(0x3f, from) => {
                self.flags = at(from);
                self.copied = at(from);
            }
            AsmOperation::SkipIo(..) => self.flags |= bit(cursor),
            AsmOperation::Store(register, _) => self.copied = at(register),
            AsmOperation::Restore(register, _) => {
                self.registers[usize::from(register)] |= self.copied;
            }
            AsmOperation::Pop(register) => self.registers[usize::from(register)] = 0,
            _ => {}
        }
    }

    /// Records a comparison, and keeps the last four.
    fn hint(&mut self, hint: Hint) {
        self.hints.push(hint);
        if self.hints.len() > 4 {
            self.hints.remove(0);
        }
    }
}

/// Returns the place of a value on the tape, if it comes from there, with the other value of the
/// comparison.
fn place(tape: &Tape, tag: u128, value: u8, other: u8) -> Option<(usize, u8)> {
    let place = tag.trailing_zeros() as usize;
    (tag.count_ones() == 1 && tape.at(place) == value).then_some((place, other))
}
