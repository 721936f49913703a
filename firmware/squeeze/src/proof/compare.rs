//! Comparison of two executions, event by event.

use super::decode::flag;
use super::program::Place;
use super::refusal::Cause;
use super::run::{Event, Run, SAVED, Snapshot, Timed};
use super::{Contract, Proof};

impl Proof<'_> {
    /// Compares two executions; the number of the event that differs, and how.
    pub(super) fn compare(
        &self,
        one: &Run,
        two: &Run,
        contract: Contract,
        is_interrupt: bool,
    ) -> Result<(), (usize, Cause)> {
        for (number, event) in one.events.iter().enumerate() {
            let Some(other) = two.events.get(number) else {
                return Err((number, Cause::Hangs));
            };
            self.same_event(one, two, event, other, contract, is_interrupt)
                .map_err(|cause| (number, cause))?;
            timed(&one.events[..=number], &two.events[..=number])
                .map_err(|cause| (number, cause))?;
        }
        if !one.is_cut && two.events.len() > one.events.len() {
            return Err((one.events.len(), Cause::Hangs));
        }
        Ok(())
    }

    /// Registers that are no arguments of a callee while they hold their values from the beginning: saved ones if the callee is not
    /// known, and in the handler of an interrupt all.
    fn left(&self, callee: Option<&Place>, is_interrupt: bool) -> u32 {
        let is_known =
            matches!(callee, Some(Place::Symbol(symbol)) if self.contracts.contains_key(symbol));
        match (is_interrupt, is_known) {
            (true, _) => !(1 << 1),
            (false, true) => 0,
            (false, false) => SAVED,
        }
    }

    fn same_event(
        &self,
        one: &Run,
        two: &Run,
        event: &Timed,
        other: &Timed,
        contract: Contract,
        is_interrupt: bool,
    ) -> Result<(), Cause> {
        let differs =
            || Cause::Event { original: describe(&event.event), squeezed: describe(&other.event) };
        match (&event.event, &other.event) {
            (Event::Call(to, first), Event::Call(other_to, second)) => {
                if to != other_to {
                    return Err(differs());
                }
                let callee = self.contract(to.as_ref());
                let left = self.left(to.as_ref(), is_interrupt);
                same_arguments(one, first, second, callee.arguments, left)?;
                if to.is_none() && first.cpu.pair(30) != second.cpu.pair(30) {
                    return Err(Cause::Register { number: 30, what: "the callee's address" });
                }
                if callee.takes_stack {
                    if first.cpu.stack != second.cpu.stack {
                        return Err(Cause::Stack);
                    }
                    if first.pushed != second.pushed {
                        return Err(Cause::Pushed);
                    }
                }
                Ok(())
            }
            (Event::Leave(to, first), Event::Leave(other_to, second)) => {
                if to != other_to {
                    return Err(differs());
                }
                let arguments = self.contract(Some(to)).arguments;
                let left = self.left(Some(to), is_interrupt);
                same_arguments(one, first, second, arguments, left)?;
                self.same_saved(one, two, first, second)
            }
            (Event::Return(first), Event::Return(second)) if !is_interrupt => {
                for number in (0..32).filter(|number| contract.results >> number & 1 != 0) {
                    let at = usize::from(number);
                    if first.cpu.registers[at] != second.cpu.registers[at] {
                        return Err(Cause::Register { number, what: "a result" });
                    }
                }
                self.same_saved(one, two, first, second)
            }
            (Event::ReturnFromInterrupt(first), Event::ReturnFromInterrupt(second)) => {
                for number in 0..32 {
                    let at = usize::from(number);
                    let is_kept = |run: &Run, end: &Snapshot| {
                        run.before.registers[at] == end.cpu.registers[at]
                    };
                    if is_kept(one, first) && !is_kept(two, second) {
                        return Err(Cause::Register { number, what: "of the interrupted program" });
                    }
                }
                let flags = |run: &Run, end: &Snapshot| (run.before.flags ^ end.cpu.flags) & 0x7f;
                if flags(one, first) == 0 && flags(two, second) != 0 {
                    return Err(Cause::Flags);
                }
                same_stack(one, two, first, second)
            }
            (event, other) if event == other => Ok(()),
            _ => Err(differs()),
        }
    }

    /// Registers that a caller wants back, r1, and the stack pointer.
    fn same_saved(
        &self,
        one: &Run,
        two: &Run,
        first: &Snapshot,
        second: &Snapshot,
    ) -> Result<(), Cause> {
        for number in (1..32_u8).filter(|number| *number == 1 || SAVED >> number & 1 != 0) {
            let at = usize::from(number);
            let kept = one.before.registers[at] == first.cpu.registers[at];
            let is_same = if kept {
                two.before.registers[at] == second.cpu.registers[at]
            } else {
                first.cpu.registers[at] == second.cpu.registers[at]
            };
            if !is_same {
                return Err(Cause::Register { number, what: "which the caller wants back" });
            }
        }
        if (first.cpu.flags ^ second.cpu.flags) & 1 << flag::I != 0 {
            return Err(Cause::Flags);
        }
        same_stack(one, two, first, second)
    }
}

/// Compares the arguments of a call. Registers in `left` are no arguments while they hold their values from the beginning.
fn same_arguments(
    one: &Run,
    first: &Snapshot,
    second: &Snapshot,
    arguments: u32,
    left: u32,
) -> Result<(), Cause> {
    for number in (0..32_u8).filter(|number| arguments >> number & 1 != 0 || *number == 1) {
        let at = usize::from(number);
        let is_left =
            left >> number & 1 != 0 && one.before.registers[at] == first.cpu.registers[at];
        if !is_left && first.cpu.registers[at] != second.cpu.registers[at] {
            return Err(Cause::Register { number, what: "an argument" });
        }
    }
    Ok(())
}

/// The stack has to be as far from its beginning as in the original.
fn same_stack(one: &Run, two: &Run, first: &Snapshot, second: &Snapshot) -> Result<(), Cause> {
    let distance = |run: &Run, end: &Snapshot| end.cpu.stack.wrapping_sub(run.before.stack);
    if distance(one, first) == distance(two, second) { Ok(()) } else { Err(Cause::Stack) }
}

/// Data-space addresses of registers that want a second write within four cycles: EECR, MCUCR, SPMCSR, WDTCSR, CLKPR (data sheet
/// of the ATmega328P, 8.6.3, 13.4.1, 26.3.1, 10.9.2, 8.12.2).
pub const TIMED: [u16; 5] = [0x3f, 0x55, 0x57, 0x60, 0x61];

/// Returns an error if the last event comes too late.
fn timed(one: &[Timed], two: &[Timed]) -> Result<(), Cause> {
    let (Some(event), Some(other)) = (one.last(), two.last()) else { return Ok(()) };
    if let Some(original) = event.gap {
        let squeezed = other.gap.unwrap_or(u32::MAX);
        if squeezed > original {
            return Err(Cause::Later { original, squeezed });
        }
    }
    let Event::Store(address, _) = event.event else { return Ok(()) };
    if !TIMED.contains(&address) {
        return Ok(());
    }
    let before = one[..one.len() - 1]
        .iter()
        .rposition(|event| matches!(event.event, Event::Store(other, _) if other == address));
    if let Some(before) = before {
        let original = event.cycle - one[before].cycle;
        let squeezed = other.cycle - two[before].cycle;
        if original <= 4 && squeezed > 4 {
            return Err(Cause::Later { original, squeezed });
        }
    }
    Ok(())
}

fn describe(event: &Event) -> String {
    let place = |place: &Place| match place {
        Place::Symbol(symbol) => format!("`{symbol}`"),
        Place::Address(address) => format!("address {address}"),
        Place::None | Place::Inside(_) => "a place of its own".to_owned(),
    };
    match event {
        Event::Load(address) => format!("a load from {address:#06x}"),
        Event::Store(address, value) => format!("a store of {value:#04x} to {address:#06x}"),
        Event::Flash(address) => format!("a load from flash at {address:#06x}"),
        Event::Special(name) => format!("`{name}`"),
        Event::Off => "an instruction that turns interrupts off".to_owned(),
        Event::On => "an instruction that turns interrupts on".to_owned(),
        Event::Call(Some(to), _) => format!("a call of {}", place(to)),
        Event::Call(None, _) => "a call by address".to_owned(),
        Event::Leave(to, _) => format!("a jump to {}", place(to)),
        Event::Return(_) => "a return".to_owned(),
        Event::ReturnFromInterrupt(_) => "a return from an interrupt".to_owned(),
        Event::End => "a step behind the last instruction".to_owned(),
        Event::Lost => "a return to nowhere".to_owned(),
    }
}
