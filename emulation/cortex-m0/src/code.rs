//! The flash as a program: instructions that are decoded once, and the time of each straight line
//! of them.

use std::ops::{Add, Sub};
use std::slice;

use bittybuzz_chips::Board;

use crate::bus::{Bus, FLASH};
use crate::decode::{Op, Operation};

/// The cost of instructions: cycles in the upper half, and the number of instructions. Small, since
/// there is one for each
/// halfword of the flash.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Cost(u32);

impl Cost {
    const NOTHING: Cost = Cost(0);
    /// The cost of code that is not decoded yet, more than any budget.
    const UNKNOWN: Cost = Cost(1 << 31);
    /// A cost that exceeds any budget, too.
    const TOO_MUCH: Cost = Cost(0x7fff_ffff);
    /// The most that is spent at once: further lines begin again.
    const MOST_CYCLES: u64 = 0x3fff;
    /// The cost of a conditional branch that is taken, beyond its own.
    pub const BRANCH: Cost = Cost(2 << 16);

    fn of(op: &Op) -> Self {
        Cost(op.cycles() << 16 | 1)
    }

    /// From instruction `at` to the end of its line, if no branch is taken.
    #[inline]
    pub fn of_line(costs: &[Cost], at: u32) -> Cost {
        costs.get(at as usize).copied().unwrap_or(Cost::NOTHING)
    }

    /// Returns a cost of these cycles, for any number of instructions.
    fn at_most(cycles: u64) -> Self {
        Cost((cycles.min(Self::MOST_CYCLES) as u32) << 16 | 0xffff)
    }

    #[inline]
    pub fn is_within(self, budget: Cost) -> bool {
        self.0 <= budget.0
    }

    pub fn cycles(self) -> u64 {
        u64::from(self.0 >> 16)
    }

    pub fn instructions(self) -> u64 {
        u64::from(self.0 & 0xffff)
    }
}

impl Add for Cost {
    type Output = Cost;

    #[inline]
    fn add(self, other: Cost) -> Cost {
        Cost(self.0.wrapping_add(other.0))
    }
}

impl Sub for Cost {
    type Output = Cost;

    #[inline]
    fn sub(self, part: Cost) -> Cost {
        Cost(self.0.wrapping_sub(part.0))
    }
}

/// The flash's instructions, as far as they were looked at. It does not see when the flash changes.
#[derive(Default)]
pub struct Code {
    /// By halfwords.
    ops: Vec<Op>,
    /// The cost of each instruction with those after it, to the end of its straight line.
    costs: Vec<Cost>,
}

/// Successive instructions, by halfwords. They form straight lines, which end where another one
/// certainly comes next.
#[derive(Clone, Copy)]
pub struct Lines<'c> {
    pub ops: &'c [Op],
    pub costs: &'c [Cost],
    /// Address of the first of them.
    pub base: u32,
    /// Which one comes next. There is time for its line.
    pub first: u32,
    /// The budget: no instruction begins when it is used up.
    pub budget: Cost,
}

impl Lines<'_> {
    /// Returns the address of that instruction.
    pub fn address(&self, at: u32) -> u32 {
        self.base.wrapping_add(at.wrapping_mul(2))
    }
}

/// An instruction alone.
pub struct Alone(Op, Cost);

impl Alone {
    pub fn of(op: Op) -> Self {
        Alone(op, Cost::of(&op))
    }

    /// To be executed once.
    pub fn lines(&self, address: u32) -> Lines<'_> {
        let (ops, costs) = (slice::from_ref(&self.0), slice::from_ref(&self.1));
        Lines { ops, costs, base: address, first: 0, budget: self.1 }
    }
}

impl Code {
    /// Returns the code of a flash with this number of bytes.
    pub fn new(bytes: u32) -> Self {
        let halfwords = bytes as usize / 2;
        Code { ops: vec![Op::UNDEFINED; halfwords], costs: vec![Cost::UNKNOWN; halfwords] }
    }

    /// The flash has changed.
    pub fn forget(&mut self) {
        self.costs.fill(Cost::UNKNOWN);
    }

    /// The lines around `pc`, in which no instruction begins `cycles` from now or later. None where there is no flash, and if the
    /// first line may take longer.
    #[inline]
    pub fn lines<B: Board>(&mut self, bus: &Bus<B>, pc: u32, cycles: u64) -> Option<Lines<'_>> {
        let first = pc.wrapping_sub(FLASH) / 2;
        let budget = Cost::at_most(cycles);
        if *self.costs.get(first as usize)? == Cost::UNKNOWN {
            self.learn(bus, first as usize);
        }
        self.costs.get(first as usize).filter(|cost| cost.is_within(budget))?;
        Some(Lines { ops: &self.ops, costs: &self.costs, base: FLASH, first, budget })
    }

    /// Looks at a line that begins with halfword `first`.
    #[cold]
    #[inline(never)]
    fn learn<B: Board>(&mut self, bus: &Bus<B>, first: usize) {
        let mut end = first;
        while let (Some(op), Some(&Cost::UNKNOWN)) = (self.ops.get_mut(end), self.costs.get(end)) {
            *op = bus.look_once(FLASH + 2 * end as u32);
            end += 1;
            if op.ends_line() {
                break;
            }
        }
        let is_over = self.ops[end - 1].ends_line();
        let mut cost = if is_over { Cost::NOTHING } else { Cost::of_line(&self.costs, end as u32) };
        for at in (first..end).rev() {
            cost = cost + Cost::of(&self.ops[at]);
            if cost.cycles() > Cost::MOST_CYCLES {
                cost = Cost::TOO_MUCH;
            }
            self.costs[at] = cost;
        }
    }
}

impl Op {
    /// Returns true if another instruction than the next halfword always comes next, or may not
    /// come at once: also all that concern interrupts.
    pub fn ends_line(&self) -> bool {
        matches!(
            self.kind,
            Operation::Undefined
                | Operation::AddPc
                | Operation::MovPc
                | Operation::Bx
                | Operation::Blx
                | Operation::PopPc
                | Operation::Cps
                | Operation::Breakpoint
                | Operation::Wfe
                | Operation::Wfi
                | Operation::SupervisorCall
                | Operation::Branch
                | Operation::BranchLink
                | Operation::Mrs
                | Operation::Msr
                | Operation::Barrier
        )
    }

    /// Cycles (DDI 0432, table 3-1); those of a conditional branch that is not taken.
    fn cycles(&self) -> u32 {
        match self.kind {
            Operation::AddPc
            | Operation::MovPc
            | Operation::Bx
            | Operation::Blx
            | Operation::Branch => 3,
            Operation::BranchLink | Operation::Barrier | Operation::Mrs | Operation::Msr => 4,
            Operation::LdrLiteral
            | Operation::Constant
            | Operation::StrReg
            | Operation::StrhReg
            | Operation::StrbReg
            | Operation::LdrsbReg
            | Operation::LdrReg
            | Operation::LdrhReg
            | Operation::LdrbReg
            | Operation::LdrshReg
            | Operation::StrImm
            | Operation::LdrImm
            | Operation::StrbImm
            | Operation::LdrbImm
            | Operation::StrhImm
            | Operation::LdrhImm
            | Operation::Wfe
            | Operation::Wfi => 2,
            Operation::Push
            | Operation::Pop
            | Operation::PopPc
            | Operation::Stm
            | Operation::Ldm => 1 + self.more_cycles(),
            _ => 1,
        }
    }
}
