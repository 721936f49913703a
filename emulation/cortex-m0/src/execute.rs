//! The execution of instructions (ARMv6-M A6; cycles: DDI 0432, table 3-1).

use bittybuzz_chips::Board;

use crate::bus::Bus;
use crate::code::{Alone, CodeLines, Cost, FlashCode};
use crate::decode::Operation;
use crate::exception::Lockup;
use crate::ram;
use crate::registers::{LR, PC, PRIMASK, Processor, Register, SP};

/// The bit of the sign.
const N: u32 = 1 << 31;

/// The reason why the core stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoreStop {
    Deadline,
    WaitForEvent,
    WaitForInterrupt,
}

/// The reason why the loop over successive instructions ends.
enum Exit {
    /// The next instruction is not among them, or its line exceeds the budget.
    End,
    /// The last instruction has an effect that this loop does not handle.
    Aside,
    /// The last instruction waits.
    Stop(CoreStop),
}

impl Processor {
    #[inline]
    pub fn get(&self, register: Register) -> u32 {
        self.r[register as usize]
    }

    #[inline]
    pub fn set(&mut self, register: Register, value: u32) {
        self.r[register as usize] = value;
    }

    /// Returns a register as an operand of instructions that may use the PC, which reads as
    /// `ahead`.
    #[inline]
    pub fn get_high(&self, register: Register, ahead: u32) -> u32 {
        if register == Register::Pc { ahead } else { self.get(register) }
    }

    /// Sets LR to the address to which a subroutine returns.
    #[inline]
    pub fn link(&mut self, address: u32) {
        self.r[LR] = address | 1;
    }

    /// Sets a register, N and Z.
    #[inline]
    fn set_nz(&mut self, register: Register, value: u32) {
        self.set(register, value);
        self.nz = value;
    }

    /// Returns a + b and sets all flags.
    #[inline]
    fn add(&mut self, a: u32, b: u32) -> u32 {
        let (sum, carry) = a.overflowing_add(b);
        self.c = carry;
        self.v = (a as i32).overflowing_add(b as i32).1;
        self.nz = sum;
        sum
    }

    /// Returns a - b and sets all flags; C is set if nothing was borrowed.
    #[inline]
    fn subtract(&mut self, a: u32, b: u32) -> u32 {
        let (difference, borrow) = a.overflowing_sub(b);
        self.c = !borrow;
        self.v = (a as i32).overflowing_sub(b as i32).1;
        self.nz = difference;
        difference
    }

    /// Returns a + b + C and sets all flags.
    #[inline]
    fn add_with_carry(&mut self, a: u32, b: u32) -> u32 {
        let wide = u64::from(a) + u64::from(b) + u64::from(self.c);
        let sum = wide as u32;
        self.c = wide >> 32 != 0;
        self.v = (a ^ sum) & (b ^ sum) & N != 0;
        self.nz = sum;
        sum
    }

    /// Returns true if N equals V: the first operand of a comparison is not less, as a signed
    /// number.
    #[inline]
    fn is_not_less(&self) -> bool {
        (self.nz & N != 0) == self.v
    }

    /// Executes until the deadline, or until an instruction waits.
    pub fn run<B: Board>(&mut self, bus: &mut Bus<B>) -> Result<CoreStop, Lockup> {
        let mut code = std::mem::take(&mut bus.code);
        if std::mem::take(&mut bus.flash_has_changed) {
            code.forget();
        }
        let result = self.execute(&mut code, bus);
        bus.code = code;
        result
    }

    /// Executes lines of code. Interrupts and the board act only between calls of
    /// [`Self::straight_on`].
    fn execute<B: Board>(
        &mut self,
        code: &mut FlashCode,
        bus: &mut Bus<B>,
    ) -> Result<CoreStop, Lockup> {
        loop {
            if bus.cycles >= bus.deadline {
                return Ok(CoreStop::Deadline);
            }
            let pc = self.r[PC];
            let budget = bus.deadline - bus.cycles;
            let alone;
            // Whole lines, if they end before the deadline; otherwise the next instruction alone.
            let lines = match code.lines(bus, pc, budget) {
                Some(lines) => lines,
                None => {
                    alone = Alone::of(bus.decode_at(pc));
                    alone.lines(pc)
                }
            };
            let mut at = lines.first;
            let (exit, mut spent) = self.straight_on(&lines, &mut at, &mut bus.ram, &mut bus.event);
            let last = at.wrapping_sub(1);
            let op = match exit {
                Exit::Aside => lines.ops.get(last as usize),
                _ => None,
            };
            if op.is_some_and(|op| !op.ends_line()) {
                spent = spent - Cost::of_line(lines.costs, at);
            }
            self.instructions += spent.instructions();
            bus.cycles += spent.cycles();
            self.r[PC] = lines.address(at);
            if let Some(op) = op {
                self.execute_rare(bus, *op, lines.address(last))?;
            }
            if let Exit::Stop(stop) = exit {
                return Ok(stop);
            }
        }
    }

    /// Executes line after line within the budget. Only registers, RAM and the event register are
    /// used, so nothing can interrupt the execution. `at` is the number of the next instruction,
    /// also on return.
    #[inline(never)]
    fn straight_on(
        &mut self,
        lines: &CodeLines<'_>,
        at: &mut u32,
        memory: &mut [u8],
        event: &mut bool,
    ) -> (Exit, Cost) {
        let CodeLines { ops, costs, base, budget, .. } = *lines;
        let mut next = *at;
        let mut spent = Cost::of_line(costs, next);
        let exit = loop {
            let Some(op) = ops.get(next as usize) else { break Exit::End };
            next = next.wrapping_add(1);
            /// The value of the PC when read: two instructions ahead.
            macro_rules! ahead {
                () => {
                    base.wrapping_add(2 * next + 2)
                };
            }
            /// Ends the loop: the instruction is not executed here.
            macro_rules! execute_rare {
                () => {
                    break Exit::Aside
                };
            }
            macro_rules! load {
                ($read:ident, $offset:expr, $value:ident => $loaded:expr) => {
                    match ram::$read(memory, self.get(op.b).wrapping_add($offset)) {
                        Some($value) => self.set(op.d, $loaded),
                        None => execute_rare!(),
                    }
                };
            }
            macro_rules! store {
                ($write:ident, $offset:expr, $type:ty) => {{
                    let address = self.get(op.b).wrapping_add($offset);
                    if ram::$write(memory, address, self.get(op.d) as $type).is_none() {
                        execute_rare!();
                    }
                }};
            }
            macro_rules! many {
                ($done:expr) => {
                    if $done.is_none() {
                        execute_rare!();
                    }
                };
            }
            /// Continues with instruction `$to`, if the budget suffices for its line.
            macro_rules! jump {
                ($to:expr) => {{
                    next = $to;
                    match costs.get(next as usize) {
                        Some(cost) if (spent + *cost).is_within(budget) => spent = spent + *cost,
                        _ => break Exit::End,
                    }
                }};
            }
            /// Branches by `imm` halfwords from the PC.
            macro_rules! branch {
                () => {
                    jump!(next.wrapping_add(1).wrapping_add(op.imm))
                };
            }
            macro_rules! branch_if {
                ($holds:expr) => {
                    if $holds {
                        spent = spent + Cost::BRANCH - Cost::of_line(costs, next);
                        branch!();
                    }
                };
            }
            /// Returns the number of the instruction at an address, unless the branch needs more
            /// than a jump.
            macro_rules! exchange {
                ($to:expr) => {{
                    let to: u32 = $to;
                    if to & 1 == 0 || to >> 28 == 0xf {
                        execute_rare!();
                    }
                    to.wrapping_sub(base) >> 1
                }};
            }
            match op.kind {
                Operation::MovReg => self.set_nz(op.d, self.get(op.b)),
                Operation::LslImm => {
                    // The shift is by 1 to 31.
                    let before = self.get(op.b) << (op.imm - 1);
                    self.c = before >> 31 != 0;
                    self.set_nz(op.d, before << 1);
                }
                Operation::LsrImm => {
                    // The shift is by 1 to 32.
                    let before = self.get(op.b) >> (op.imm - 1);
                    self.c = before & 1 != 0;
                    self.set_nz(op.d, before >> 1);
                }
                Operation::AsrImm => {
                    let before = self.get(op.b) as i32 >> (op.imm - 1);
                    self.c = before & 1 != 0;
                    self.set_nz(op.d, (before >> 1) as u32);
                }
                Operation::AddReg => {
                    let sum = self.add(self.get(op.b), self.get(op.c));
                    self.set(op.d, sum);
                }
                Operation::SubReg => {
                    let difference = self.subtract(self.get(op.b), self.get(op.c));
                    self.set(op.d, difference);
                }
                Operation::AddImm => {
                    let sum = self.add(self.get(op.b), op.imm);
                    self.set(op.d, sum);
                }
                Operation::SubImm => {
                    let difference = self.subtract(self.get(op.b), op.imm);
                    self.set(op.d, difference);
                }
                Operation::MovImm => self.set_nz(op.d, op.imm),
                Operation::CmpImm => {
                    self.subtract(self.get(op.d), op.imm);
                }
                Operation::And => self.set_nz(op.d, self.get(op.d) & self.get(op.b)),
                Operation::Eor => self.set_nz(op.d, self.get(op.d) ^ self.get(op.b)),
                Operation::Orr => self.set_nz(op.d, self.get(op.d) | self.get(op.b)),
                Operation::Bic => self.set_nz(op.d, self.get(op.d) & !self.get(op.b)),
                Operation::Mvn => self.set_nz(op.d, !self.get(op.b)),
                Operation::Mul => self.set_nz(op.d, self.get(op.d).wrapping_mul(self.get(op.b))),
                Operation::Tst => self.nz = self.get(op.d) & self.get(op.b),
                Operation::Cmp => {
                    self.subtract(self.get(op.d), self.get(op.b));
                }
                Operation::CmpHigh => {
                    self.subtract(self.get(op.d), self.get_high(op.b, ahead!()));
                }
                Operation::Cmn => {
                    self.add(self.get(op.d), self.get(op.b));
                }
                Operation::Adc => {
                    let sum = self.add_with_carry(self.get(op.d), self.get(op.b));
                    self.set(op.d, sum);
                }
                Operation::Sbc => {
                    let difference = self.add_with_carry(self.get(op.d), !self.get(op.b));
                    self.set(op.d, difference);
                }
                Operation::Rsb => {
                    let difference = self.subtract(0, self.get(op.b));
                    self.set(op.d, difference);
                }
                Operation::LslReg => {
                    let (value, by) = (self.get(op.d), self.get(op.b) & 0xff);
                    if by > 0 {
                        self.c = by <= 32 && value >> (32 - by) & 1 != 0;
                    }
                    self.set_nz(op.d, value.unbounded_shl(by));
                }
                Operation::LsrReg => match self.get(op.b) & 0xff {
                    0 => self.nz = self.get(op.d),
                    by => self.shift_right(op.d, self.get(op.d), by),
                },
                Operation::AsrReg => match self.get(op.b) & 0xff {
                    0 => self.nz = self.get(op.d),
                    by => self.shift_signed(op.d, self.get(op.d), by),
                },
                Operation::Ror => {
                    let by = self.get(op.b) & 0xff;
                    let value = self.get(op.d).rotate_right(by & 31);
                    if by > 0 {
                        self.c = value >> 31 != 0;
                    }
                    self.set_nz(op.d, value);
                }
                Operation::AddHigh => {
                    let sum = self.get(op.d).wrapping_add(self.get_high(op.b, ahead!()));
                    self.set(op.d, if op.d == Register::Sp { sum & !3 } else { sum });
                }
                Operation::AddPc => {
                    let to = ahead!().wrapping_add(self.get_high(op.b, ahead!()));
                    jump!(to.wrapping_sub(base) >> 1);
                }
                Operation::MovHigh => self.set(op.d, self.get(op.b)),
                Operation::MovSpecial => {
                    let value = self.get_high(op.b, ahead!());
                    self.set(op.d, if op.d == Register::Sp { value & !3 } else { value });
                }
                Operation::MovPc => jump!(self.get_high(op.b, ahead!()).wrapping_sub(base) >> 1),
                Operation::Bx => {
                    let to = exchange!(self.get_high(op.b, ahead!()));
                    jump!(to);
                }
                Operation::Blx => {
                    let to = exchange!(self.get(op.b));
                    self.link(ahead!().wrapping_sub(2));
                    jump!(to);
                }
                Operation::Constant => self.set(op.d, op.imm),
                Operation::LdrReg => load!(word, self.get(op.c), value => value),
                Operation::LdrImm => load!(word, op.imm, value => value),
                Operation::LdrhReg => load!(half, self.get(op.c), value => u32::from(value)),
                Operation::LdrhImm => load!(half, op.imm, value => u32::from(value)),
                Operation::LdrbReg => load!(byte, self.get(op.c), value => u32::from(value)),
                Operation::LdrbImm => load!(byte, op.imm, value => u32::from(value)),
                Operation::LdrsbReg => {
                    load!(byte, self.get(op.c), value => i32::from(value as i8) as u32);
                }
                Operation::LdrshReg => {
                    load!(half, self.get(op.c), value => i32::from(value as i16) as u32);
                }
                Operation::StrReg => store!(set_word, self.get(op.c), u32),
                Operation::StrImm => store!(set_word, op.imm, u32),
                Operation::StrhReg => store!(set_half, self.get(op.c), u16),
                Operation::StrhImm => store!(set_half, op.imm, u16),
                Operation::StrbReg => store!(set_byte, self.get(op.c), u8),
                Operation::StrbImm => store!(set_byte, op.imm, u8),
                Operation::Adr => self.set(op.d, (ahead!() & !3).wrapping_add(op.imm)),
                Operation::AddSp => self.set(op.d, self.r[SP].wrapping_add(op.imm)),
                Operation::SpUp => self.r[SP] = self.r[SP].wrapping_add(op.imm),
                Operation::SpDown => self.r[SP] = self.r[SP].wrapping_sub(op.imm),
                Operation::Sxth => self.set(op.d, i32::from(self.get(op.b) as i16) as u32),
                Operation::Sxtb => self.set(op.d, i32::from(self.get(op.b) as i8) as u32),
                Operation::Uxth => self.set(op.d, self.get(op.b) & 0xffff),
                Operation::Uxtb => self.set(op.d, self.get(op.b) & 0xff),
                Operation::Rev => self.set(op.d, self.get(op.b).swap_bytes()),
                Operation::Rev16 => self.set(op.d, self.get(op.b).swap_bytes().rotate_right(16)),
                Operation::Revsh => {
                    self.set(op.d, i32::from((self.get(op.b) as u16).swap_bytes() as i16) as u32);
                }
                Operation::Push => many!(self.push_to_ram(memory, op)),
                Operation::Pop => many!(self.pop_from_ram(memory, op)),
                Operation::Stm => many!(self.store_to_ram(memory, op)),
                Operation::Ldm => many!(self.load_from_ram(memory, op)),
                Operation::PopPc => match self.pop_to_from_ram(memory, op) {
                    Some(to) => jump!(to.wrapping_sub(base) >> 1),
                    None => execute_rare!(),
                },
                Operation::BranchEq => branch_if!(self.nz == 0),
                Operation::BranchNe => branch_if!(self.nz != 0),
                Operation::BranchCs => branch_if!(self.c),
                Operation::BranchCc => branch_if!(!self.c),
                Operation::BranchMi => branch_if!(self.nz & N != 0),
                Operation::BranchPl => branch_if!(self.nz & N == 0),
                Operation::BranchVs => branch_if!(self.v),
                Operation::BranchVc => branch_if!(!self.v),
                Operation::BranchHi => branch_if!(self.c && self.nz != 0),
                Operation::BranchLs => branch_if!(!self.c || self.nz == 0),
                Operation::BranchGe => branch_if!(self.is_not_less()),
                Operation::BranchLt => branch_if!(!self.is_not_less()),
                Operation::BranchGt => branch_if!(self.is_not_less() && self.nz != 0),
                Operation::BranchLe => branch_if!(!self.is_not_less() || self.nz == 0),
                Operation::Branch => branch!(),
                Operation::BranchLink => {
                    self.link(ahead!());
                    branch!();
                }
                Operation::Nop => {}
                Operation::Sev => *event = true,
                Operation::Wfe => break Exit::Stop(CoreStop::WaitForEvent),
                Operation::Wfi => break Exit::Stop(CoreStop::WaitForInterrupt),
                Operation::Barrier => jump!(next.wrapping_add(1)),
                // Critical sections begin with this instruction.
                Operation::Cps if op.imm != 0 => {
                    self.primask = true;
                    jump!(next);
                }
                Operation::Mrs if op.imm == PRIMASK => {
                    self.set(op.d, self.primask.into());
                    jump!(next.wrapping_add(1));
                }
                Operation::LdrLiteral
                | Operation::Cps
                | Operation::Mrs
                | Operation::Msr
                | Operation::SupervisorCall
                | Operation::Breakpoint
                | Operation::Undefined => execute_rare!(),
            }
        };
        *at = next;
        (exit, spent)
    }

    /// Shifts right by at least 1, and sets N, Z and C.
    fn shift_right(&mut self, d: Register, value: u32, by: u32) {
        self.c = by <= 32 && value >> (by - 1) & 1 != 0;
        self.set_nz(d, value.unbounded_shr(by));
    }

    /// Shifts right by at least 1 with copies of the sign bit, and sets N, Z and C.
    fn shift_signed(&mut self, d: Register, value: u32, by: u32) {
        let by = by.min(32);
        let before = (value as i32) >> (by - 1);
        self.c = before & 1 != 0;
        self.set_nz(d, (before >> 1) as u32);
    }
}
