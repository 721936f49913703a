//! Compares two executions, event by event.
//!
//! # Values that were never set
//! LLVM leaves a register unchanged if its value does not matter, for example the second half of a
//! result that has only one; squeezed code may leave another value there. A value may therefore
//! differ if it depends, in the original, on the contents of r0, X or Z at the beginning of the
//! function or at the return of a callee: the ABI passes nothing in these registers. Such a
//! dependency is found by executing the original again with other values in only these registers.

use std::cell::OnceCell;

use super::decode::flag;
use super::program::CodeLocation;
use super::refusal::DifferenceKind;
use super::run::{Execution, SAVED, Snapshot, VisibleEffect};
use super::{Contract, Proof};

/// Two executions of a function with the same input.
pub struct Comparison<'a> {
    pub proof: &'a Proof<'a>,
    pub original: &'a Execution,
    pub squeezed: &'a Execution,
    /// The registers in which the function and its callers exchange values.
    pub contract: Contract,
    /// True for the handler of an interrupt.
    pub is_interrupt: bool,
    /// Executes the original with other values in registers in which nothing is passed.
    pub again: &'a dyn Fn() -> Vec<Execution>,
    /// The runs of `again`, once they were needed.
    pub others: OnceCell<Vec<Execution>>,
}

impl Comparison<'_> {
    /// Compares all events. The error is the number of the first event that differs, and the cause.
    pub fn check(&self) -> Result<(), (usize, DifferenceKind)> {
        let (one, two) = (self.original, self.squeezed);
        for number in 0..one.events.len() {
            if number >= two.events.len() {
                return Err((number, DifferenceKind::Hangs));
            }
            self.same_event(number).map_err(|cause| (number, cause))?;
            self.in_time(number).map_err(|cause| (number, cause))?;
        }
        if !one.is_cut && two.events.len() > one.events.len() {
            return Err((one.events.len(), DifferenceKind::Hangs));
        }
        Ok(())
    }

    /// Returns true if the value that `pick` finds in an event of the original does not depend on a
    /// register that was never set.
    fn is_set(&self, number: usize, pick: &dyn Fn(&VisibleEffect) -> Option<u8>) -> bool {
        let value = |run: &Execution| run.events.get(number).and_then(|event| pick(&event.event));
        let others = self.others.get_or_init(self.again);
        others.iter().all(|other| value(other) == value(self.original))
    }

    /// Returns true if a register has the same value in both executions, or one that was never set.
    fn is_same(&self, number: usize, register: usize, first: &Snapshot, second: &Snapshot) -> bool {
        let pick = |event: &VisibleEffect| event.snapshot().map(|end| end.cpu.registers[register]);
        first.cpu.registers[register] == second.cpu.registers[register]
            || !self.is_set(number, &pick)
    }

    fn same_event(&self, number: usize) -> Result<(), DifferenceKind> {
        let event = &self.original.events[number].event;
        let other = &self.squeezed.events[number].event;
        let differs =
            || DifferenceKind::Event { original: describe(event), squeezed: describe(other) };
        match (event, other) {
            (VisibleEffect::Call(to, first), VisibleEffect::Call(other_to, second)) => {
                if to != other_to {
                    return Err(differs());
                }
                let callee = self.proof.contract(to.as_ref());
                self.same_arguments(number, to.as_ref(), first, second)?;
                if to.is_none() && first.cpu.pair(30) != second.cpu.pair(30) {
                    return Err(DifferenceKind::Register {
                        number: 30,
                        what: "the callee's address",
                    });
                }
                if callee.takes_stack {
                    if first.cpu.stack != second.cpu.stack {
                        return Err(DifferenceKind::Stack);
                    }
                    if first.pushed != second.pushed {
                        return Err(DifferenceKind::Pushed);
                    }
                }
                Ok(())
            }
            (VisibleEffect::Leave(to, first), VisibleEffect::Leave(other_to, second)) => {
                if to != other_to {
                    return Err(differs());
                }
                self.same_arguments(number, Some(to), first, second)?;
                self.same_saved(first, second)
            }
            (VisibleEffect::Return(first), VisibleEffect::Return(second)) if !self.is_interrupt => {
                let is_result = |register: &u8| self.contract.results >> register & 1 != 0;
                for register in (0..32).filter(is_result) {
                    if !self.is_same(number, register.into(), first, second) {
                        return Err(DifferenceKind::Register {
                            number: register,
                            what: "a result",
                        });
                    }
                }
                self.same_saved(first, second)
            }
            (
                VisibleEffect::ReturnFromInterrupt(first),
                VisibleEffect::ReturnFromInterrupt(second),
            ) => self.same_interrupted(first, second),
            (VisibleEffect::Store(to, value), VisibleEffect::Store(other_to, other))
                if to == other_to =>
            {
                let pick = |event: &VisibleEffect| match event {
                    VisibleEffect::Store(_, value) => Some(*value),
                    _ => None,
                };
                let is_same = value == other || !self.is_set(number, &pick);
                if is_same { Ok(()) } else { Err(differs()) }
            }
            (event, other) if event == other => Ok(()),
            _ => Err(differs()),
        }
    }

    /// Compares the arguments of a call. Some registers are not compared while they hold their
    /// initial values: saved ones if the callee is unknown, and all except r1 in the handler of an
    /// interrupt.
    fn same_arguments(
        &self,
        number: usize,
        callee: Option<&CodeLocation>,
        first: &Snapshot,
        second: &Snapshot,
    ) -> Result<(), DifferenceKind> {
        let kept = match (self.is_interrupt, self.proof.is_known(callee)) {
            (true, _) => !(1 << 1),
            (false, true) => 0,
            (false, false) => SAVED,
        };
        let arguments = self.proof.contract(callee).arguments | 1 << 1;
        for register in (0..32_u8).filter(|register| arguments >> register & 1 != 0) {
            let at = usize::from(register);
            let before = self.original.before.registers[at];
            let is_kept = kept >> register & 1 != 0 && before == first.cpu.registers[at];
            if !is_kept && !self.is_same(number, at, first, second) {
                return Err(DifferenceKind::Register { number: register, what: "an argument" });
            }
        }
        Ok(())
    }

    /// Compares the registers that a caller wants back, r1, and the stack pointer.
    fn same_saved(&self, first: &Snapshot, second: &Snapshot) -> Result<(), DifferenceKind> {
        for number in (1..32_u8).filter(|number| *number == 1 || SAVED >> number & 1 != 0) {
            let at = usize::from(number);
            let kept = self.original.before.registers[at] == first.cpu.registers[at];
            let is_same = if kept {
                self.squeezed.before.registers[at] == second.cpu.registers[at]
            } else {
                first.cpu.registers[at] == second.cpu.registers[at]
            };
            if !is_same {
                return Err(DifferenceKind::Register {
                    number,
                    what: "which the caller wants back",
                });
            }
        }
        if (first.cpu.flags ^ second.cpu.flags) & 1 << flag::I != 0 {
            return Err(DifferenceKind::Flags);
        }
        self.same_stack(first, second)
    }

    /// Compares registers, flags and stack of the interrupted program.
    fn same_interrupted(&self, first: &Snapshot, second: &Snapshot) -> Result<(), DifferenceKind> {
        for number in 0..32 {
            let at = usize::from(number);
            let is_kept =
                |run: &Execution, end: &Snapshot| run.before.registers[at] == end.cpu.registers[at];
            if is_kept(self.original, first) && !is_kept(self.squeezed, second) {
                return Err(DifferenceKind::Register {
                    number,
                    what: "of the interrupted program",
                });
            }
        }
        let flags = |run: &Execution, end: &Snapshot| (run.before.flags ^ end.cpu.flags) & 0x7f;
        if flags(self.original, first) == 0 && flags(self.squeezed, second) != 0 {
            return Err(DifferenceKind::Flags);
        }
        self.same_stack(first, second)
    }

    /// Compares the distances of the stack pointer from its initial value.
    fn same_stack(&self, first: &Snapshot, second: &Snapshot) -> Result<(), DifferenceKind> {
        let distance =
            |run: &Execution, end: &Snapshot| end.cpu.stack.wrapping_sub(run.before.stack);
        let is_same = distance(self.original, first) == distance(self.squeezed, second);
        if is_same { Ok(()) } else { Err(DifferenceKind::Stack) }
    }

    /// Returns an error if an event comes too late.
    fn in_time(&self, number: usize) -> Result<(), DifferenceKind> {
        let (one, two) = (&self.original.events[..=number], &self.squeezed.events[..=number]);
        let (event, other) = (&one[number], &two[number]);
        if let Some(original) = event.gap {
            let squeezed = other.gap.unwrap_or(u32::MAX);
            if squeezed > original {
                return Err(DifferenceKind::Later { original, squeezed });
            }
        }
        let VisibleEffect::Store(address, _) = event.event else { return Ok(()) };
        if !TIMED.contains(&address) {
            return Ok(());
        }
        let before = one[..number].iter().rposition(
            |event| matches!(event.event, VisibleEffect::Store(other, _) if other == address),
        );
        if let Some(before) = before {
            let original = event.cycle - one[before].cycle;
            let squeezed = other.cycle - two[before].cycle;
            if original <= 4 && squeezed > 4 {
                return Err(DifferenceKind::Later { original, squeezed });
            }
        }
        Ok(())
    }
}

/// Data-space addresses of registers that require a second write within four cycles: EECR, MCUCR,
/// SPMCSR, WDTCSR, CLKPR (data sheet of the ATmega328P, 8.6.3, 13.4.1, 26.3.1, 10.9.2, 8.12.2).
const TIMED: [u16; 5] = [0x3f, 0x55, 0x57, 0x60, 0x61];

fn describe(event: &VisibleEffect) -> String {
    let place = |place: &CodeLocation| match place {
        CodeLocation::Symbol(symbol) => format!("`{symbol}`"),
        CodeLocation::Address(address) => format!("address {address}"),
        CodeLocation::None | CodeLocation::Inside(_) => "a place of its own".to_owned(),
    };
    match event {
        VisibleEffect::Load(address) => format!("a load from {address:#06x}"),
        VisibleEffect::Store(address, value) => {
            format!("a store of {value:#04x} to {address:#06x}")
        }
        VisibleEffect::Flash(address) => format!("a load from flash at {address:#06x}"),
        VisibleEffect::Special(name) => format!("`{name}`"),
        VisibleEffect::Off => "an instruction that turns interrupts off".to_owned(),
        VisibleEffect::On => "an instruction that turns interrupts on".to_owned(),
        VisibleEffect::Call(Some(to), _) => format!("a call of {}", place(to)),
        VisibleEffect::Call(None, _) => "a call by address".to_owned(),
        VisibleEffect::Leave(to, _) => format!("a jump to {}", place(to)),
        VisibleEffect::Return(_) => "a return".to_owned(),
        VisibleEffect::ReturnFromInterrupt(_) => "a return from an interrupt".to_owned(),
        VisibleEffect::End => "a step behind the last instruction".to_owned(),
        VisibleEffect::Lost => "a return to nowhere".to_owned(),
    }
}
