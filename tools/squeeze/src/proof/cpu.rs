//! An AVR core that executes decoded instructions: registers, flags, stack pointer and cycles.
//!
//! The flags follow the tables of the AVR instruction set manual. The [`DataSpace`] implements loads,
//! stores and the stack. The caller keeps the place in the code, and gets a [`Successor`] for each
//! instruction.

use super::decode::{AsmOperation, PairOperation, Pointer, Product, Single, flag};

/// The I/O addresses of SPL, SPH and SREG.
const SPL: u8 = 0x3d;
const SPH: u8 = 0x3e;
const SREG: u8 = 0x3f;
/// The data-space address of I/O register 0.
const IO: u16 = 0x20;

/// Memory and I/O registers, by their addresses in data space.
pub trait DataSpace {
    /// Reads a byte.
    fn load(&mut self, address: u16) -> u8;
    /// Writes a byte.
    fn store(&mut self, address: u16, value: u8);
    /// Reads a byte of flash.
    fn load_flash(&mut self, address: u16) -> u8;
    /// Reads a byte of the stack.
    fn pop(&mut self, address: u16) -> u8;
    /// Writes a byte of the stack.
    fn push(&mut self, address: u16, value: u8);
    /// Executes `sleep`, `wdr` or `break`.
    fn special(&mut self, name: &'static str);
}

/// The place to which control goes after an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Successor {
    /// To the next instruction.
    Next,
    /// Past the next instruction.
    Skip,
    /// To the target of a conditional branch.
    Branch,
    /// To the target of a jump.
    Jump,
    /// To the target of a call.
    Call,
    /// To the address in Z, and back.
    CallPointer,
    /// To the address in Z.
    JumpPointer,
    /// To the address on the stack.
    Return,
    /// To the address on the stack, with interrupts on.
    ReturnFromInterrupt,
}

/// Registers and flags.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cpu {
    /// r0 to r31.
    pub registers: [u8; 32],
    /// SREG.
    pub flags: u8,
    /// SP.
    pub stack: u16,
    /// Cycles since the start. They include those of calls, jumps, returns and taken branches, and
    /// of skips of one-word instructions.
    pub cycles: u32,
}

impl Cpu {
    fn flag(&self, bit: u8) -> bool {
        self.flags & 1 << bit != 0
    }

    fn set_flag(&mut self, bit: u8, is_set: bool) {
        self.flags = self.flags & !(1 << bit) | u8::from(is_set) << bit;
    }

    fn at(&self, register: u8) -> u8 {
        self.registers[usize::from(register & 31)]
    }

    fn put(&mut self, register: u8, value: u8) {
        self.registers[usize::from(register & 31)] = value;
    }

    /// Returns the number in a pair of registers.
    pub fn pair(&self, register: u8) -> u16 {
        u16::from_le_bytes([self.at(register), self.at(register + 1)])
    }

    fn put_pair(&mut self, register: u8, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.put(register, low);
        self.put(register + 1, high);
    }

    /// Executes an instruction. The caller handles return addresses.
    pub fn execute(&mut self, op: &AsmOperation, bus: &mut impl DataSpace) -> Successor {
        let (cycles, control) = self.perform(op, bus);
        self.cycles += cycles;
        control
    }

    fn perform(&mut self, op: &AsmOperation, bus: &mut impl DataSpace) -> (u32, Successor) {
        let skip = |skips: bool| if skips { (2, Successor::Skip) } else { (1, Successor::Next) };
        let cycles = match *op {
            AsmOperation::Pair(kind, to, from) => {
                self.calculate(kind, to, self.at(from));
                1
            }
            AsmOperation::Constant(kind, to, value) => {
                self.calculate(kind, to, value);
                1
            }
            AsmOperation::Single(kind, register) => {
                self.change(kind, register);
                1
            }
            AsmOperation::Multiply(kind, one, other) => {
                self.multiply(kind, self.at(one), self.at(other));
                2
            }
            AsmOperation::Word(register, value, subtracts) => {
                self.add_word(register, value, subtracts);
                2
            }
            AsmOperation::Copy(to, from) => {
                self.put(to, self.at(from));
                1
            }
            AsmOperation::CopyPair(to, from) => {
                self.put_pair(to, self.pair(from));
                1
            }
            AsmOperation::Load(to, value) => {
                self.put(to, value);
                1
            }
            AsmOperation::Read(to, pointer) => {
                let address = self.address(pointer);
                let value = bus.load(address);
                self.put(to, value);
                2
            }
            AsmOperation::Write(pointer, from) => {
                // The value is taken before the pointer changes.
                let value = self.at(from);
                let address = self.address(pointer);
                bus.store(address, value);
                2
            }
            AsmOperation::ReadAt(to, address) => {
                let value = bus.load(address);
                self.put(to, value);
                2
            }
            AsmOperation::WriteAt(address, from) => {
                bus.store(address, self.at(from));
                2
            }
            AsmOperation::ReadFlash(to, pointer) => {
                let address = self.address(pointer);
                let value = bus.load_flash(address);
                self.put(to, value);
                3
            }
            AsmOperation::In(to, from) => {
                let value = match from {
                    SPL => self.stack as u8,
                    SPH => (self.stack >> 8) as u8,
                    SREG => self.flags,
                    _ => bus.load(IO + u16::from(from)),
                };
                self.put(to, value);
                1
            }
            AsmOperation::Out(to, from) => {
                let value = self.at(from);
                match to {
                    SPL => self.stack = self.stack & 0xff00 | u16::from(value),
                    SPH => self.stack = self.stack & 0x00ff | u16::from(value) << 8,
                    SREG => self.flags = value,
                    _ => bus.store(IO + u16::from(to), value),
                }
                1
            }
            AsmOperation::Bit(at, bit, is_set) => {
                let address = IO + u16::from(at);
                let value = bus.load(address);
                bus.store(address, if is_set { value | 1 << bit } else { value & !(1 << bit) });
                2
            }
            AsmOperation::SkipIo(at, bit, is_set) => {
                let value = bus.load(IO + u16::from(at));
                return skip((value & 1 << bit != 0) == is_set);
            }
            AsmOperation::SkipBit(register, bit, is_set) => {
                return skip((self.at(register) & 1 << bit != 0) == is_set);
            }
            AsmOperation::SkipEqual(one, other) => return skip(self.at(one) == self.at(other)),
            AsmOperation::Store(register, bit) => {
                self.set_flag(flag::T, self.at(register) & 1 << bit != 0);
                1
            }
            AsmOperation::Restore(register, bit) => {
                let others = self.at(register) & !(1 << bit);
                self.put(register, others | u8::from(self.flag(flag::T)) << bit);
                1
            }
            AsmOperation::Flag(bit, is_set) => {
                self.set_flag(bit, is_set);
                1
            }
            AsmOperation::Branch(bit, is_set, _) => {
                let is_taken = self.flag(bit) == is_set;
                return if is_taken { (2, Successor::Branch) } else { (1, Successor::Next) };
            }
            AsmOperation::Jump(_, is_long) => {
                return (if is_long { 3 } else { 2 }, Successor::Jump);
            }
            AsmOperation::Call(_, is_long) => {
                return (if is_long { 4 } else { 3 }, Successor::Call);
            }
            AsmOperation::CallPointer => return (3, Successor::CallPointer),
            AsmOperation::JumpPointer => return (2, Successor::JumpPointer),
            AsmOperation::Return => return (4, Successor::Return),
            AsmOperation::ReturnFromInterrupt => {
                self.set_flag(flag::I, true);
                return (4, Successor::ReturnFromInterrupt);
            }
            AsmOperation::Push(register) => {
                bus.push(self.stack, self.at(register));
                self.stack = self.stack.wrapping_sub(1);
                2
            }
            AsmOperation::Pop(register) => {
                self.stack = self.stack.wrapping_add(1);
                let value = bus.pop(self.stack);
                self.put(register, value);
                2
            }
            AsmOperation::Nop => 1,
            AsmOperation::Special(name) => {
                bus.special(name);
                1
            }
        };
        (cycles, Successor::Next)
    }

    /// Returns the address of a pointer, and updates the pointer.
    fn address(&mut self, pointer: Pointer) -> u16 {
        let mut address = self.pair(pointer.pair);
        if pointer.decrements {
            address = address.wrapping_sub(1);
            self.put_pair(pointer.pair, address);
        }
        if pointer.increments {
            self.put_pair(pointer.pair, address.wrapping_add(1));
        }
        address.wrapping_add(pointer.displacement.into())
    }

    /// Sets N, S and Z for a result; V must be set before.
    fn set_signs(&mut self, result: u8) {
        let is_negative = result & 0x80 != 0;
        self.set_flag(flag::N, is_negative);
        self.set_flag(flag::S, is_negative != self.flag(flag::V));
        self.set_flag(flag::Z, result == 0);
    }

    fn calculate(&mut self, kind: PairOperation, to: u8, other: u8) {
        let one = self.at(to);
        let carry = u8::from(self.flag(flag::C));
        let result = match kind {
            PairOperation::And | PairOperation::Or | PairOperation::Eor => {
                let result = match kind {
                    PairOperation::And => one & other,
                    PairOperation::Or => one | other,
                    _ => one ^ other,
                };
                self.set_flag(flag::V, false);
                self.set_signs(result);
                result
            }
            PairOperation::Add | PairOperation::Adc => {
                let carry = if kind == PairOperation::Adc { carry } else { 0 };
                let result = one.wrapping_add(other).wrapping_add(carry);
                // Carries out of each bit.
                let carries = one & other | other & !result | !result & one;
                self.set_flag(flag::H, carries & 0x08 != 0);
                self.set_flag(flag::C, carries & 0x80 != 0);
                self.set_flag(
                    flag::V,
                    (one & other & !result | !one & !other & result) & 0x80 != 0,
                );
                self.set_signs(result);
                result
            }
            PairOperation::Sub | PairOperation::Cp | PairOperation::Sbc | PairOperation::Cpc => {
                let takes_carry = matches!(kind, PairOperation::Sbc | PairOperation::Cpc);
                let result =
                    one.wrapping_sub(other).wrapping_sub(if takes_carry { carry } else { 0 });
                let borrows = !one & other | other & result | result & !one;
                let was_zero = self.flag(flag::Z);
                self.set_flag(flag::H, borrows & 0x08 != 0);
                self.set_flag(flag::C, borrows & 0x80 != 0);
                self.set_flag(
                    flag::V,
                    (one & !other & !result | !one & other & result) & 0x80 != 0,
                );
                self.set_signs(result);
                if takes_carry {
                    // These instructions can only clear Z.
                    self.set_flag(flag::Z, result == 0 && was_zero);
                }
                result
            }
        };
        if !matches!(kind, PairOperation::Cp | PairOperation::Cpc) {
            self.put(to, result);
        }
    }

    fn change(&mut self, kind: Single, register: u8) {
        let value = self.at(register);
        let carry = self.flag(flag::C);
        let result = match kind {
            Single::Swap => value.rotate_left(4),
            Single::Com => !value,
            Single::Neg => value.wrapping_neg(),
            Single::Inc => value.wrapping_add(1),
            Single::Dec => value.wrapping_sub(1),
            Single::Lsr => value >> 1,
            Single::Asr => value >> 1 | value & 0x80,
            Single::Ror => value >> 1 | u8::from(carry) << 7,
        };
        self.put(register, result);
        match kind {
            Single::Swap => return,
            Single::Com => {
                self.set_flag(flag::C, true);
                self.set_flag(flag::V, false);
            }
            Single::Neg => {
                self.set_flag(flag::H, (result | value) & 0x08 != 0);
                self.set_flag(flag::C, result != 0);
                self.set_flag(flag::V, result == 0x80);
            }
            Single::Inc => self.set_flag(flag::V, result == 0x80),
            Single::Dec => self.set_flag(flag::V, result == 0x7f),
            Single::Lsr | Single::Asr | Single::Ror => {
                let carry = value & 1 != 0;
                self.set_flag(flag::C, carry);
                self.set_flag(flag::V, (result & 0x80 != 0) != carry);
            }
        }
        self.set_signs(result);
    }

    fn multiply(&mut self, kind: Product, one: u8, other: u8) {
        let signed = |value: u8| i32::from(value as i8);
        let (one, other) = match kind {
            Product::Unsigned => (i32::from(one), i32::from(other)),
            Product::Signed => (signed(one), signed(other)),
            Product::Mixed => (signed(one), i32::from(other)),
        };
        let product = (one * other) as u16;
        self.put_pair(0, product);
        self.set_flag(flag::C, product & 0x8000 != 0);
        self.set_flag(flag::Z, product == 0);
    }

    fn add_word(&mut self, register: u8, value: u8, subtracts: bool) {
        let before = self.pair(register);
        let value = u16::from(value);
        let result =
            if subtracts { before.wrapping_sub(value) } else { before.wrapping_add(value) };
        self.put_pair(register, result);
        let rises = !before & result & 0x8000 != 0;
        let falls = before & !result & 0x8000 != 0;
        // The direction decides which is V and which is C (ADIW, SBIW).
        self.set_flag(flag::V, if subtracts { falls } else { rises });
        self.set_flag(flag::C, if subtracts { rises } else { falls });
        self.set_flag(flag::N, result & 0x8000 != 0);
        self.set_flag(flag::S, self.flag(flag::N) != self.flag(flag::V));
        self.set_flag(flag::Z, result == 0);
    }
}
