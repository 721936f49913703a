//! The flash as a program: instructions that are decoded once, and the cost of each straight line
//! of instructions.

use std::ops::{Add, Sub};
use std::slice;

use bittybuzz_chips::Board;

use crate::bus::{Bus, FLASH};
use crate::decode::{Op, Operation};

/// The cost of instructions: cycles in the upper half, the number of instructions in the lower
/// half. The type is small because there is one for each halfword of the flash.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Cost(u32);

impl Cost {
    const NOTHING: Cost = Cost(0);
    /// The cost of code that is not decoded yet; it exceeds any budget.
    const UNKNOWN: Cost = Cost(1 << 31);
    /// The cost of a line that is too long, which exceeds any budget, too.
    const TOO_MUCH: Cost = Cost(0x7fff_ffff);
    /// The largest budget in cycles. After it is spent, execution restarts with a new budget.
    const CYCLES_MAX: u64 = 0x3fff;
    /// The cost of a taken conditional branch in addition to its own.
    pub const BRANCH: Cost = Cost(2 << 16);

    fn of(op: &Op) -> Self {
        Cost(op.cycles() << 16 | 1)
    }

    /// Returns the cost from instruction `at` to the end of its line, if no branch is taken.
    #[inline]
    pub fn of_line(costs: &[Cost], at: u32) -> Cost {
        costs.get(at as usize).copied().unwrap_or(Cost::NOTHING)
    }

    /// Returns a budget of these cycles and any number of instructions.
    fn at_most(cycles: u64) -> Self {
        Cost((cycles.min(Self::CYCLES_MAX) as u32) << 16 | 0xffff)
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

/// The instructions of the flash, decoded on first use. After a change of the flash the owner must
/// call [`FlashCode::forget`].
#[derive(Default)]
pub struct FlashCode {
    /// One operation for each halfword.
    ops: Vec<Op>,
    /// The cost of each instruction and those after it, to the end of its straight line.
    costs: Vec<Cost>,
}

/// Successive instructions, one for each halfword. They form straight lines; a line ends with an
/// instruction that always continues elsewhere.
#[derive(Clone, Copy)]
pub struct CodeLines<'c> {
    pub ops: &'c [Op],
    pub costs: &'c [Cost],
    /// The address of the first halfword.
    pub base: u32,
    /// The number of the next instruction. The budget is large enough for its line.
    pub first: u32,
    /// No instruction begins after this budget is spent.
    pub budget: Cost,
}

impl CodeLines<'_> {
    /// Returns the address of instruction `at`.
    pub fn address(&self, at: u32) -> u32 {
        self.base.wrapping_add(at.wrapping_mul(2))
    }
}

/// A single instruction outside a line.
pub struct Alone(Op, Cost);

impl Alone {
    pub fn of(op: Op) -> Self {
        Alone(op, Cost::of(&op))
    }

    /// Returns the instruction as a line, whose budget lets it execute once.
    pub fn lines(&self, address: u32) -> CodeLines<'_> {
        let (ops, costs) = (slice::from_ref(&self.0), slice::from_ref(&self.1));
        CodeLines { ops, costs, base: address, first: 0, budget: self.1 }
    }
}

impl FlashCode {
    /// Returns the code of a flash with this number of bytes.
    pub fn new(bytes: u32) -> Self {
        let halfwords = bytes as usize / 2;
        FlashCode { ops: vec![Op::UNDEFINED; halfwords], costs: vec![Cost::UNKNOWN; halfwords] }
    }

    /// Discards all decoded instructions, after a change of the flash.
    pub fn forget(&mut self) {
        self.costs.fill(Cost::UNKNOWN);
    }

    /// Returns the lines around `pc`, with a budget of `cycles`. Returns none outside the flash,
    /// and if the first line may take longer.
    #[inline]
    pub fn lines<B: Board>(&mut self, bus: &Bus<B>, pc: u32, cycles: u64) -> Option<CodeLines<'_>> {
        let first = pc.wrapping_sub(FLASH) / 2;
        let budget = Cost::at_most(cycles);
        if *self.costs.get(first as usize)? == Cost::UNKNOWN {
            self.learn(bus, first as usize);
        }
        self.costs.get(first as usize).filter(|cost| cost.is_within(budget))?;
        Some(CodeLines { ops: &self.ops, costs: &self.costs, base: FLASH, first, budget })
    }

    /// Decodes the line that begins with halfword `first`.
    #[cold]
    #[inline(never)]
    fn learn<B: Board>(&mut self, bus: &Bus<B>, first: usize) {
        let mut end = first;
        while let (Some(op), Some(&Cost::UNKNOWN)) = (self.ops.get_mut(end), self.costs.get(end)) {
            *op = bus.decode_in_flash(FLASH + 2 * end as u32);
            end += 1;
            if op.ends_line() {
                break;
            }
        }
        let is_over = self.ops[end - 1].ends_line();
        let mut cost = if is_over { Cost::NOTHING } else { Cost::of_line(&self.costs, end as u32) };
        for at in (first..end).rev() {
            cost = cost + Cost::of(&self.ops[at]);
            if cost.cycles() > Cost::CYCLES_MAX {
                cost = Cost::TOO_MUCH;
            }
            self.costs[at] = cost;
        }
    }
}

impl Op {
    /// Returns true if execution never continues with the next halfword, or may have to pause
    /// first. All instructions that concern interrupts belong to the latter.
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

    /// Returns the cycles (DDI 0432, table 3-1); for a conditional branch those without a jump.
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
