//! What instructions do (ARMv6-M A6; cycles: DDI 0432, table 3-1).

use bittybuzz_chips::Board;

use crate::bus::{Bus, FLASH};
use crate::decode::{Kind, Op, decode};
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

/// The next instruction, and when it begins.
pub struct At {
    pub pc: u32,
    pub cycles: u64,
}

/// What an instruction leads to.
pub type Outcome = Result<Option<Stop>, Lockup>;

impl Core {
    #[inline]
    pub fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    #[inline]
    pub fn set(&mut self, register: u8, value: u32) {
        self.r[usize::from(register & 15)] = value;
    }

    /// Sets a register, N and Z.
    #[inline]
    fn set_nz(&mut self, register: u8, value: u32) {
        self.set(register, value);
        self.test(value);
    }

    #[inline]
    fn test(&mut self, value: u32) {
        self.nz = value;
    }

    /// a + b + carry, with all flags.
    #[inline]
    fn add(&mut self, a: u32, b: u32, carry: bool) -> u32 {
        let wide = u64::from(a) + u64::from(b) + u64::from(carry);
        let sum = wide as u32;
        self.c = wide >> 32 != 0;
        self.v = (a ^ sum) & (b ^ sum) & N != 0;
        self.test(sum);
        sum
    }

    fn holds(&self, condition: u8) -> bool {
        let (n, z) = (self.nz >> 31 != 0, self.nz == 0);
        let positive = match condition >> 1 {
            0 => z,
            1 => self.c,
            2 => n,
            3 => self.v,
            4 => self.c && !z,
            5 => n == self.v,
            6 => n == self.v && !z,
            _ => true,
        };
        positive != (condition & 1 != 0)
    }

    /// The operation at `pc`, wherever it is.
    fn look<B: Board>(&self, bus: &mut Bus<B>, pc: u32) -> Option<Op> {
        // Nothing is executed from peripherals and beyond (B3.1).
        if pc >= 0x4000_0000 {
            return None;
        }
        let first = bus.memory(pc, 2)?.first_chunk().copied().map(u16::from_le_bytes)?;
        let second = bus.memory(pc.wrapping_add(2), 2);
        let second = second.and_then(|bytes| bytes.first_chunk().copied());
        Some(decode(first, second.map_or(0, u16::from_le_bytes)))
    }

    /// Executes until the deadline or until it waits.
    ///
    /// What changes with every instruction is kept in variables meanwhile, and written back when it ends.
    pub fn run<B: Board>(&mut self, bus: &mut Bus<B>) -> Result<Stop, Lockup> {
        let mut at = At { pc: self.r[PC], cycles: bus.cycles };
        let mut count = 0;
        let mut outcome = Ok(None);
        while at.cycles < bus.deadline {
            count += 1;
            outcome = match bus.ops.get(at.pc.wrapping_sub(FLASH) as usize / 2) {
                Some(op) => {
                    let op = *op;
                    self.execute(bus, &mut at, op)
                }
                None => self.execute_elsewhere(bus, &mut at),
            };
            if !matches!(outcome, Ok(None)) {
                break;
            }
        }
        (self.r[PC], bus.cycles) = (at.pc, at.cycles);
        self.instructions = self.instructions.wrapping_add(count);
        outcome.map(|stop| stop.unwrap_or(Stop::Deadline))
    }

    /// Executes an instruction that is not in the flash.
    #[cold]
    #[inline(never)]
    fn execute_elsewhere<B: Board>(&mut self, bus: &mut Bus<B>, at: &mut At) -> Outcome {
        match self.look(bus, at.pc) {
            Some(op) => self.execute(bus, at, op),
            None => self.refuse(bus, at, at.pc),
        }
    }

    /// Looks at an instruction in the flash that was not looked at; it is executed the next time.
    #[cold]
    #[inline(never)]
    fn remember<B: Board>(&mut self, bus: &mut Bus<B>, at: &mut At, pc: u32) -> Outcome {
        let op = self.look(bus, pc);
        if let (Some(op), Some(place)) = (op, bus.ops.get_mut(pc.wrapping_sub(FLASH) as usize / 2))
        {
            *place = op;
        }
        // As if nothing had been.
        *at = At { pc, cycles: at.cycles - 1 };
        self.instructions = self.instructions.wrapping_sub(1);
        Ok(None)
    }

    /// Does what needs the program counter and the cycles where others look for them.
    #[cold]
    #[inline(never)]
    fn aside<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        at: &mut At,
        act: impl FnOnce(&mut Self, &mut Bus<B>) -> Result<(), Lockup>,
    ) -> Outcome {
        (self.r[PC], bus.cycles) = (at.pc, at.cycles);
        let result = act(self, bus);
        *at = At { pc: self.r[PC], cycles: bus.cycles };
        result.map(|()| None)
    }

    #[inline(always)]
    fn execute<B: Board>(&mut self, bus: &mut Bus<B>, at: &mut At, op: Op) -> Outcome {
        let Op { kind, d, b, c, imm } = op;
        let pc = at.pc;
        // What the PC reads as: two instructions ahead.
        let ahead = pc.wrapping_add(4);
        at.pc = pc.wrapping_add(2);
        at.cycles += 1;
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
                let sum = self.add(self.get(b), self.get(c), false);
                self.set(d, sum);
            }
            Kind::SubReg => {
                let difference = self.add(self.get(b), !self.get(c), true);
                self.set(d, difference);
            }
            Kind::AddImm => {
                let sum = self.add(self.get(b), imm, false);
                self.set(d, sum);
            }
            Kind::SubImm => {
                let difference = self.add(self.get(b), !imm, true);
                self.set(d, difference);
            }
            Kind::MovImm => self.set_nz(d, imm),
            Kind::CmpImm => {
                self.add(self.get(d), !imm, true);
            }
            Kind::And => self.set_nz(d, self.get(d) & self.get(b)),
            Kind::Eor => self.set_nz(d, self.get(d) ^ self.get(b)),
            Kind::Orr => self.set_nz(d, self.get(d) | self.get(b)),
            Kind::Bic => self.set_nz(d, self.get(d) & !self.get(b)),
            Kind::Mvn => self.set_nz(d, !self.get(b)),
            Kind::Mul => self.set_nz(d, self.get(d).wrapping_mul(self.get(b))),
            Kind::Tst => self.test(self.get(d) & self.get(b)),
            Kind::Cmp | Kind::CmpHigh => {
                let other = if b == PC as u8 { ahead } else { self.get(b) };
                self.add(self.get(d), !other, true);
            }
            Kind::Cmn => {
                self.add(self.get(d), self.get(b), false);
            }
            Kind::Adc => {
                let sum = self.add(self.get(d), self.get(b), self.c);
                self.set(d, sum);
            }
            Kind::Sbc => {
                let difference = self.add(self.get(d), !self.get(b), self.c);
                self.set(d, difference);
            }
            Kind::Rsb => {
                let difference = self.add(!self.get(b), 0, true);
                self.set(d, difference);
            }
            Kind::LslReg => {
                let (value, by) = (self.get(d), self.get(b) & 0xff);
                if by > 0 {
                    self.c = by <= 32 && value >> (32 - by) & 1 != 0;
                }
                self.set_nz(d, value.checked_shl(by).unwrap_or(0));
            }
            Kind::LsrReg => match self.get(b) & 0xff {
                0 => self.test(self.get(d)),
                by => self.shift_right(d, self.get(d), by),
            },
            Kind::AsrReg => match self.get(b) & 0xff {
                0 => self.test(self.get(d)),
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
                let other = if b == PC as u8 { ahead } else { self.get(b) };
                let sum = self.get(d).wrapping_add(other);
                self.set(d, if usize::from(d) == SP { sum & !3 } else { sum });
            }
            Kind::AddPc => {
                let other = if b == PC as u8 { ahead } else { self.get(b) };
                at.pc = ahead.wrapping_add(other) & !1;
                at.cycles += 2;
            }
            Kind::MovHigh => {
                let value = if b == PC as u8 { ahead } else { self.get(b) };
                self.set(d, if usize::from(d) == SP { value & !3 } else { value });
            }
            Kind::MovPc => {
                let value = if b == PC as u8 { ahead } else { self.get(b) };
                at.pc = value & !1;
                at.cycles += 2;
            }
            Kind::Bx => {
                at.cycles += 2;
                let to = if b == PC as u8 { ahead } else { self.get(b) };
                return self.branch_exchange(bus, at, pc, to);
            }
            Kind::Blx => {
                at.cycles += 2;
                let to = self.get(b);
                self.r[LR] = pc.wrapping_add(2) | 1;
                return self.branch_exchange(bus, at, pc, to);
            }
            Kind::LdrLiteral => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                match bus.read_word((ahead & !3).wrapping_add(imm)) {
                    Some(value) => self.set(d, value),
                    None => return self.refuse(bus, at, pc),
                }
            }
            Kind::LdrReg | Kind::LdrImm => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                match bus.read_word(self.address(b, c, imm, kind == Kind::LdrReg)) {
                    Some(value) => self.set(d, value),
                    None => return self.refuse(bus, at, pc),
                }
            }
            Kind::LdrhReg | Kind::LdrhImm => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                match bus.read_half(self.address(b, c, imm, kind == Kind::LdrhReg)) {
                    Some(value) => self.set(d, value.into()),
                    None => return self.refuse(bus, at, pc),
                }
            }
            Kind::LdrbReg | Kind::LdrbImm => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                match bus.read_byte(self.address(b, c, imm, kind == Kind::LdrbReg)) {
                    Some(value) => self.set(d, value.into()),
                    None => return self.refuse(bus, at, pc),
                }
            }
            Kind::LdrsbReg => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                match bus.read_byte(self.address(b, c, 0, true)) {
                    Some(value) => self.set(d, i32::from(value as i8) as u32),
                    None => return self.refuse(bus, at, pc),
                }
            }
            Kind::LdrshReg => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                match bus.read_half(self.address(b, c, 0, true)) {
                    Some(value) => self.set(d, i32::from(value as i16) as u32),
                    None => return self.refuse(bus, at, pc),
                }
            }
            Kind::StrReg | Kind::StrImm => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                let address = self.address(b, c, imm, kind == Kind::StrReg);
                if bus.write_word(address, self.get(d)).is_none() {
                    return self.refuse(bus, at, pc);
                }
            }
            Kind::StrhReg | Kind::StrhImm => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                let address = self.address(b, c, imm, kind == Kind::StrhReg);
                if bus.write_half(address, self.get(d) as u16).is_none() {
                    return self.refuse(bus, at, pc);
                }
            }
            Kind::StrbReg | Kind::StrbImm => {
                at.cycles += 1;
                bus.cycles = at.cycles;
                let address = self.address(b, c, imm, kind == Kind::StrbReg);
                if bus.write_byte(address, self.get(d) as u8).is_none() {
                    return self.refuse(bus, at, pc);
                }
            }
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
            Kind::Push => return self.push(bus, at, pc, imm),
            Kind::Pop => return self.pop(bus, at, pc, imm, false),
            Kind::PopPc => return self.pop(bus, at, pc, imm, true),
            Kind::Stm => return self.store_many(bus, at, pc, b, imm),
            Kind::Ldm => return self.load_many(bus, at, pc, b, imm),
            Kind::BranchIf => {
                if self.holds(d) {
                    at.pc = ahead.wrapping_add(imm);
                    at.cycles += 2;
                }
            }
            Kind::Branch => {
                at.pc = ahead.wrapping_add(imm);
                at.cycles += 2;
            }
            Kind::BranchLink => {
                self.r[LR] = ahead | 1;
                at.pc = ahead.wrapping_add(imm);
                at.cycles += 3;
            }
            Kind::Nop => {}
            Kind::Sev => bus.event = true,
            Kind::Wfe => {
                at.cycles += 1;
                return Ok(Some(Stop::WaitForEvent));
            }
            Kind::Wfi => {
                at.cycles += 1;
                return Ok(Some(Stop::WaitForInterrupt));
            }
            Kind::Cps => {
                self.primask = d != 0;
                bus.deadline = if self.primask { bus.deadline } else { 0 };
            }
            Kind::Barrier => {
                at.pc = ahead;
                at.cycles += 3;
            }
            Kind::Mrs => {
                at.pc = ahead;
                at.cycles += 3;
                let value = self.special(bus, imm);
                self.set(d, value);
            }
            Kind::Msr => {
                at.pc = ahead;
                at.cycles += 3;
                let value = self.get(d);
                self.set_special(bus, imm, value);
            }
            Kind::SupervisorCall => {
                return self.aside(bus, at, |core, bus| core.call_supervisor(bus, pc));
            }
            Kind::Breakpoint | Kind::Undefined => return self.refuse(bus, at, pc),
            Kind::Unknown => return self.remember(bus, at, pc),
        }
        Ok(None)
    }

    #[inline]
    fn address(&self, b: u8, c: u8, imm: u32, by_register: bool) -> u32 {
        self.get(b).wrapping_add(if by_register { self.get(c) } else { imm })
    }

    /// By 1 or more.
    fn shift_right(&mut self, d: u8, value: u32, by: u32) {
        self.c = by <= 32 && value >> (by - 1) & 1 != 0;
        self.set_nz(d, value.checked_shr(by).unwrap_or(0));
    }

    /// By 1 or more: sign bits come from the left.
    fn shift_signed(&mut self, d: u8, value: u32, by: u32) {
        let by = by.min(32);
        let before = (value as i32) >> (by - 1);
        self.c = before & 1 != 0;
        self.set_nz(d, (before >> 1) as u32);
    }

    /// To an address whose lowest bit says that there is Thumb code, or back from an exception.
    #[inline]
    pub fn branch_exchange<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        at: &mut At,
        pc: u32,
        to: u32,
    ) -> Outcome {
        if to >> 28 == 0xf && bus.nvic.current() != 0 {
            bus.deadline = 0;
            return self.aside(bus, at, |core, bus| core.leave(bus, to));
        }
        at.pc = to & !1;
        if to & 1 == 0 { self.refuse(bus, at, pc) } else { Ok(None) }
    }

    /// The instruction at `pc` does what is not allowed.
    #[cold]
    pub fn refuse<B: Board>(&mut self, bus: &mut Bus<B>, at: &mut At, pc: u32) -> Outcome {
        self.aside(bus, at, |core, bus| core.fault(bus, pc))
    }
}
