//! What instructions do (ARMv6-M A6; cycles: DDI 0432, table 3-1).

use bittybuzz_chips::Board;

use crate::bus::{Bus, FLASH};
use crate::decode::{Kind, Op};
use crate::exception::Lockup;
use crate::registers::{Core, LR, PC, SP};

/// The sign.
const N: u32 = 1 << 31;

/// Why the core has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    Deadline,
    WaitForEvent,
    WaitForInterrupt,
}

impl Core {
    #[inline]
    pub fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    #[inline]
    pub fn set(&mut self, register: u8, value: u32) {
        self.r[usize::from(register & 15)] = value;
    }

    /// A register as an operand of instructions that may name the PC, which reads as `ahead`.
    #[inline]
    fn get_high(&self, register: u8, ahead: u32) -> u32 {
        if register == PC as u8 { ahead } else { self.get(register) }
    }

    /// Sets a register, N and Z.
    #[inline]
    fn set_nz(&mut self, register: u8, value: u32) {
        self.set(register, value);
        self.nz = value;
    }

    /// a + b, with all flags.
    #[inline]
    fn add(&mut self, a: u32, b: u32) -> u32 {
        let (sum, carry) = a.overflowing_add(b);
        self.c = carry;
        self.v = (a as i32).overflowing_add(b as i32).1;
        self.nz = sum;
        sum
    }

    /// a - b, with all flags: C says that nothing was borrowed.
    #[inline]
    fn subtract(&mut self, a: u32, b: u32) -> u32 {
        let (difference, borrow) = a.overflowing_sub(b);
        self.c = !borrow;
        self.v = (a as i32).overflowing_sub(b as i32).1;
        self.nz = difference;
        difference
    }

    /// a + b + C, with all flags.
    #[inline]
    fn add_with_carry(&mut self, a: u32, b: u32) -> u32 {
        let wide = u64::from(a) + u64::from(b) + u64::from(self.c);
        let sum = wide as u32;
        self.c = wide >> 32 != 0;
        self.v = (a ^ sum) & (b ^ sum) & N != 0;
        self.nz = sum;
        sum
    }

    /// Whether N is V: what was compared is not less, as signed numbers.
    #[inline]
    fn is_not_less(&self) -> bool {
        (self.nz & N != 0) == self.v
    }

    /// Executes until the deadline or until it waits.
    ///
    /// What changes with every instruction is kept in variables meanwhile, and written back for what looks for it elsewhere.
    pub fn run<B: Board>(&mut self, bus: &mut Bus<B>) -> Result<Stop, Lockup> {
        let (mut pc, mut cycles) = (self.r[PC], bus.cycles);
        let mut count = 0;
        let result = loop {
            if cycles >= bus.deadline {
                break Ok(Stop::Deadline);
            }
            let at = pc;
            let op = match bus.ops.get(at.wrapping_sub(FLASH) as usize / 2) {
                Some(op) => *op,
                None => bus.look(at),
            };
            let Op { kind, d, b, c, imm } = op;
            // What the PC reads as: two instructions ahead.
            let ahead = at.wrapping_add(4);
            pc = at.wrapping_add(2);
            cycles += 1;
            count += 1;
            /// Does what needs the program counter and the cycles where others look for them.
            macro_rules! aside {
                ($act:expr) => {{
                    (self.r[PC], bus.cycles) = (pc, cycles);
                    let outcome: Result<(), Lockup> = $act;
                    (pc, cycles) = (self.r[PC], bus.cycles);
                    if let Err(lockup) = outcome {
                        break Err(lockup);
                    }
                }};
            }
            /// The instruction does what is not allowed.
            macro_rules! refuse {
                () => {
                    aside!(self.fault(bus, at))
                };
            }
            /// To an address whose lowest bit says that there is Thumb code, or back from an exception.
            macro_rules! exchange {
                ($to:expr) => {{
                    let to: u32 = $to;
                    if to >> 28 == 0xf && bus.nvic.current() != 0 {
                        bus.deadline = 0;
                        aside!(self.leave(bus, to));
                    } else {
                        pc = to & !1;
                        if to & 1 == 0 {
                            refuse!();
                        }
                    }
                }};
            }
            /// So many cycles more for an access to memory, where there may be none.
            macro_rules! access {
                ($cycles:expr, $access:expr, $value:ident => $then:expr) => {{
                    cycles += u64::from($cycles);
                    bus.cycles = cycles;
                    match $access {
                        Some($value) => $then,
                        None => refuse!(),
                    }
                }};
            }
            macro_rules! load {
                ($read:ident, $offset:expr, $value:ident => $loaded:expr) => {{
                    let address = self.get(b).wrapping_add($offset);
                    access!(1_u8, bus.$read(address), $value => self.set(d, $loaded));
                }};
            }
            macro_rules! store {
                ($write:ident, $offset:expr, $type:ty) => {{
                    let address = self.get(b).wrapping_add($offset);
                    access!(1_u8, bus.$write(address, self.get(d) as $type), _value => ());
                }};
            }
            macro_rules! branch_if {
                ($holds:expr) => {
                    if $holds {
                        pc = ahead.wrapping_add(imm);
                        cycles += 2;
                    }
                };
            }
            match kind {
                Kind::LslImm => {
                    let value = self.get(b);
                    if imm > 0 {
                        self.c = value >> (32 - imm) & 1 != 0;
                    }
                    self.set_nz(d, value << imm);
                }
                Kind::LsrImm => self.shift_right(d, self.get(b), imm),
                Kind::AsrImm => self.shift_signed(d, self.get(b), imm),
                Kind::AddReg => {
                    let sum = self.add(self.get(b), self.get(c));
                    self.set(d, sum);
                }
                Kind::SubReg => {
                    let difference = self.subtract(self.get(b), self.get(c));
                    self.set(d, difference);
                }
                Kind::AddImm => {
                    let sum = self.add(self.get(b), imm);
                    self.set(d, sum);
                }
                Kind::SubImm => {
                    let difference = self.subtract(self.get(b), imm);
                    self.set(d, difference);
                }
                Kind::MovImm => self.set_nz(d, imm),
                Kind::CmpImm => {
                    self.subtract(self.get(d), imm);
                }
                Kind::And => self.set_nz(d, self.get(d) & self.get(b)),
                Kind::Eor => self.set_nz(d, self.get(d) ^ self.get(b)),
                Kind::Orr => self.set_nz(d, self.get(d) | self.get(b)),
                Kind::Bic => self.set_nz(d, self.get(d) & !self.get(b)),
                Kind::Mvn => self.set_nz(d, !self.get(b)),
                Kind::Mul => self.set_nz(d, self.get(d).wrapping_mul(self.get(b))),
                Kind::Tst => self.nz = self.get(d) & self.get(b),
                Kind::Cmp => {
                    self.subtract(self.get(d), self.get(b));
                }
                Kind::CmpHigh => {
                    self.subtract(self.get(d), self.get_high(b, ahead));
                }
                Kind::Cmn => {
                    self.add(self.get(d), self.get(b));
                }
                Kind::Adc => {
                    let sum = self.add_with_carry(self.get(d), self.get(b));
                    self.set(d, sum);
                }
                Kind::Sbc => {
                    let difference = self.add_with_carry(self.get(d), !self.get(b));
                    self.set(d, difference);
                }
                Kind::Rsb => {
                    let difference = self.subtract(0, self.get(b));
                    self.set(d, difference);
                }
                Kind::LslReg => {
                    let (value, by) = (self.get(d), self.get(b) & 0xff);
                    if by > 0 {
                        self.c = by <= 32 && value >> (32 - by) & 1 != 0;
                    }
                    self.set_nz(d, value.unbounded_shl(by));
                }
                Kind::LsrReg => match self.get(b) & 0xff {
                    0 => self.nz = self.get(d),
                    by => self.shift_right(d, self.get(d), by),
                },
                Kind::AsrReg => match self.get(b) & 0xff {
                    0 => self.nz = self.get(d),
                    by => self.shift_signed(d, self.get(d), by),
                },
                Kind::Ror => {
                    let by = self.get(b) & 0xff;
                    let value = self.get(d).rotate_right(by & 31);
                    if by > 0 {
                        self.c = value >> 31 != 0;
                    }
                    self.set_nz(d, value);
                }
                Kind::AddHigh => {
                    let sum = self.get(d).wrapping_add(self.get_high(b, ahead));
                    self.set(d, if usize::from(d) == SP { sum & !3 } else { sum });
                }
                Kind::AddPc => {
                    pc = ahead.wrapping_add(self.get_high(b, ahead)) & !1;
                    cycles += 2;
                }
                Kind::MovHigh => {
                    let value = self.get_high(b, ahead);
                    self.set(d, if usize::from(d) == SP { value & !3 } else { value });
                }
                Kind::MovPc => {
                    pc = self.get_high(b, ahead) & !1;
                    cycles += 2;
                }
                Kind::Bx => {
                    cycles += 2;
                    exchange!(self.get_high(b, ahead));
                }
                Kind::Blx => {
                    cycles += 2;
                    let to = self.get(b);
                    self.r[LR] = at.wrapping_add(2) | 1;
                    exchange!(to);
                }
                Kind::LdrLiteral => {
                    let address = (ahead & !3).wrapping_add(imm);
                    access!(1_u8, bus.read_word(address), value => self.set(d, value));
                }
                Kind::Constant => {
                    cycles += 1;
                    self.set(d, imm);
                }
                Kind::LdrReg => load!(read_word, self.get(c), value => value),
                Kind::LdrImm => load!(read_word, imm, value => value),
                Kind::LdrhReg => load!(read_half, self.get(c), value => u32::from(value)),
                Kind::LdrhImm => load!(read_half, imm, value => u32::from(value)),
                Kind::LdrbReg => load!(read_byte, self.get(c), value => u32::from(value)),
                Kind::LdrbImm => load!(read_byte, imm, value => u32::from(value)),
                Kind::LdrsbReg => {
                    load!(read_byte, self.get(c), value => i32::from(value as i8) as u32);
                }
                Kind::LdrshReg => {
                    load!(read_half, self.get(c), value => i32::from(value as i16) as u32);
                }
                Kind::StrReg => store!(write_word, self.get(c), u32),
                Kind::StrImm => store!(write_word, imm, u32),
                Kind::StrhReg => store!(write_half, self.get(c), u16),
                Kind::StrhImm => store!(write_half, imm, u16),
                Kind::StrbReg => store!(write_byte, self.get(c), u8),
                Kind::StrbImm => store!(write_byte, imm, u8),
                Kind::Adr => self.set(d, (ahead & !3).wrapping_add(imm)),
                Kind::AddSp => self.set(d, self.r[SP].wrapping_add(imm)),
                Kind::SpUp => self.r[SP] = self.r[SP].wrapping_add(imm),
                Kind::SpDown => self.r[SP] = self.r[SP].wrapping_sub(imm),
                Kind::Sxth => self.set(d, i32::from(self.get(b) as i16) as u32),
                Kind::Sxtb => self.set(d, i32::from(self.get(b) as i8) as u32),
                Kind::Uxth => self.set(d, self.get(b) & 0xffff),
                Kind::Uxtb => self.set(d, self.get(b) & 0xff),
                Kind::Rev => self.set(d, self.get(b).swap_bytes()),
                Kind::Rev16 => self.set(d, self.get(b).swap_bytes().rotate_right(16)),
                Kind::Revsh => {
                    self.set(d, i32::from((self.get(b) as u16).swap_bytes() as i16) as u32);
                }
                Kind::Push => access!(c, self.push(bus, imm), _value => ()),
                Kind::Pop => access!(c, self.pop(bus, imm), _value => ()),
                Kind::PopPc => access!(c, self.pop_to(bus, imm), to => exchange!(to)),
                Kind::Stm => access!(c, self.store_many(bus, b, imm), _value => ()),
                Kind::Ldm => access!(c, self.load_many(bus, b, imm), _value => ()),
                Kind::BranchEq => branch_if!(self.nz == 0),
                Kind::BranchNe => branch_if!(self.nz != 0),
                Kind::BranchCs => branch_if!(self.c),
                Kind::BranchCc => branch_if!(!self.c),
                Kind::BranchMi => branch_if!(self.nz & N != 0),
                Kind::BranchPl => branch_if!(self.nz & N == 0),
                Kind::BranchVs => branch_if!(self.v),
                Kind::BranchVc => branch_if!(!self.v),
                Kind::BranchHi => branch_if!(self.c && self.nz != 0),
                Kind::BranchLs => branch_if!(!self.c || self.nz == 0),
                Kind::BranchGe => branch_if!(self.is_not_less()),
                Kind::BranchLt => branch_if!(!self.is_not_less()),
                Kind::BranchGt => branch_if!(self.is_not_less() && self.nz != 0),
                Kind::BranchLe => branch_if!(!self.is_not_less() || self.nz == 0),
                Kind::Branch => {
                    pc = ahead.wrapping_add(imm);
                    cycles += 2;
                }
                Kind::BranchLink => {
                    self.r[LR] = ahead | 1;
                    pc = ahead.wrapping_add(imm);
                    cycles += 3;
                }
                Kind::Nop => {}
                Kind::Sev => bus.event = true,
                Kind::Wfe => {
                    cycles += 1;
                    break Ok(Stop::WaitForEvent);
                }
                Kind::Wfi => {
                    cycles += 1;
                    break Ok(Stop::WaitForInterrupt);
                }
                Kind::Cps => {
                    self.primask = d != 0;
                    bus.deadline = if self.primask { bus.deadline } else { 0 };
                }
                Kind::Barrier => {
                    pc = ahead;
                    cycles += 3;
                }
                Kind::Mrs => {
                    pc = ahead;
                    cycles += 3;
                    let value = self.special(bus, imm);
                    self.set(d, value);
                }
                Kind::Msr => {
                    pc = ahead;
                    cycles += 3;
                    let value = self.get(d);
                    self.set_special(bus, imm, value);
                }
                Kind::SupervisorCall => aside!(self.call_supervisor(bus, at)),
                Kind::Breakpoint | Kind::Undefined => refuse!(),
                // It is executed the next time, as if nothing had been.
                Kind::Unknown => {
                    bus.remember(at);
                    (pc, cycles) = (at, cycles - 1);
                    count -= 1;
                }
            }
        };
        (self.r[PC], bus.cycles) = (pc, cycles);
        self.instructions += count;
        result
    }

    /// By 1 or more.
    fn shift_right(&mut self, d: u8, value: u32, by: u32) {
        self.c = by <= 32 && value >> (by - 1) & 1 != 0;
        self.set_nz(d, value.unbounded_shr(by));
    }

    /// By 1 or more: sign bits come from the left.
    fn shift_signed(&mut self, d: u8, value: u32, by: u32) {
        let by = by.min(32);
        let before = (value as i32) >> (by - 1);
        self.c = before & 1 != 0;
        self.set_nz(d, (before >> 1) as u32);
    }
}
