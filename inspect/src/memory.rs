//! The memory that a script needs, and the globals that keep it alive.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Fault, FaultCode, Vm};

/// The slots of a machine and their use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScriptMemory {
    /// The number of all slots.
    pub slots: usize,
    /// Slots of globals and of active functions.
    pub stack: usize,
    /// Slots of tables, closures and strings that the script can still reach.
    pub heap: usize,
    /// The numbers of globals, each with the heap slots that can be reached from it, largest first.
    pub held: Vec<(u16, usize)>,
}

impl ScriptMemory {
    /// Counts the used slots of a machine with `slots` slots in total. The count collects garbage
    /// in copies of the machine, one for each global.
    pub fn of<P: Profile, C: ByteCode, const SLOTS: usize>(
        vm: &Vm<P, C, SLOTS>,
        slots: usize,
    ) -> ScriptMemory {
        let stack = vm.stack_slots();
        // A machine without an image has no globals.
        let globals = 0..vm.header().map_or(0, |header| header.globals());
        let mut held: Vec<(u16, usize)> =
            globals.map(|number| (number, vm.slots_held_by(number))).collect();
        held.retain(|(_, slots)| *slots > 0);
        held.sort_by_key(|(number, slots)| (std::cmp::Reverse(*slots), *number));
        let heap = vm.needed_slots().checked_sub(stack);
        let heap = heap.expect("the slots that the script needs include the stack");
        ScriptMemory { slots, stack, heap, held }
    }

    /// Counts the used slots of a machine that stopped because it ran out of memory; `None` after
    /// other faults.
    pub fn after<P: Profile, C: ByteCode, const SLOTS: usize>(
        fault: &Fault,
        vm: &Vm<P, C, SLOTS>,
        slots: usize,
    ) -> Option<ScriptMemory> {
        let is_full = matches!(fault.code, FaultCode::OutOfMemory | FaultCode::StackOverflow);
        is_full.then(|| ScriptMemory::of(vm, slots))
    }
}
