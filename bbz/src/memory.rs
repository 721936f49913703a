//! The memory of a machine that has run out of it: how much there is, and which globals hold it.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Fault, FaultCode, Vm};

use crate::program::Program;
use crate::report::counted;

/// Globals that are named, those that hold most first.
const NAMED: usize = 3;

/// The slots of a machine and their use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// All slots.
    slots: usize,
    /// Slots of globals and of functions that are running.
    stack: usize,
    /// Slots of tables, closures and strings that the script can still reach.
    heap: usize,
    /// Numbers of globals with the slots of the heap that can be reached from them, most first.
    held: Vec<(u16, usize)>,
}

impl Memory {
    /// Looks into a machine of that many slots which a fault has stopped for want of memory; `None` after other faults.
    pub fn at<P: Profile, const SLOTS: usize>(
        fault: &Fault,
        vm: &Vm<P, &[u8], SLOTS>,
        slots: usize,
    ) -> Option<Memory> {
        if !matches!(fault.code, FaultCode::OutOfMemory | FaultCode::StackOverflow) {
            return None;
        }
        let stack = vm.stack_slots();
        let globals = (0..).take_while(|number| vm.global(*number).is_some());
        let mut held: Vec<(u16, usize)> =
            globals.map(|number| (number, vm.slots_held_by(number))).collect();
        held.retain(|(_, slots)| *slots > 0);
        held.sort_by_key(|(number, slots)| (std::cmp::Reverse(*slots), *number));
        Some(Memory { slots, stack, heap: vm.needed_slots().saturating_sub(stack), held })
    }

    /// Describes it in one sentence.
    pub fn text(&self, program: &Program) -> String {
        let Memory { slots, stack, heap, held } = self;
        let all = counted(*slots, "slot");
        let mut text = format!(
            "of {all}, globals and calls take {stack}, tables, closures and strings {heap}"
        );
        let name = |number: u16| {
            let names = program.symbols.as_ref().map(|symbols| &symbols.globals);
            match names.and_then(|names| names.get(usize::from(number))) {
                Some(name) => format!("`{name}`"),
                None => format!("global {number}"),
            }
        };
        let held: Vec<String> = held
            .iter()
            .take(NAMED)
            .map(|(number, slots)| format!("{} holds {slots}", name(*number)))
            .collect();
        if !held.is_empty() {
            text.push_str(&format!("; {}", held.join(", ")));
        }
        text
    }
}
