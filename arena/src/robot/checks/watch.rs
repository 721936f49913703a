//! The statements that a robot's script begins in a tick, and its machine before one of them.
//!
//! A machine cannot be stopped within a tick, since the world would be in half a tick. A watch
//! therefore only reads: it counts the statements while the tick goes on as it would without the
//! watch. A debugger simulates a tick of a copy of the run as often as it wants to look into it,
//! and its position is the tick and the number of the statement.

use std::mem;
use std::sync::Arc;

use bittybuzz_inspect::{Inspection, Limits, inspect};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Host, Outcome, Vm};

use crate::robot::context::GroupContext;

use super::checker::TextMeter;

/// The statements at which a watch stops reading a tick.
#[derive(Clone, Debug)]
pub enum WatchStop {
    /// The statement with that number in the tick, which is kept with the content of the machine.
    Number(usize, Limits),
    /// None: all statements are listed.
    Never,
}

/// A statement that a script begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WatchedStatement {
    /// The position of its first byte in the code.
    pub position: u32,
    /// The number of active functions.
    pub depth: usize,
}

/// A watch on a robot's script for one tick.
#[derive(Clone, Debug)]
pub struct Watch {
    stop: WatchStop,
    is_found: bool,
    seen: WatchedTick,
}

/// The part of a tick that a watch has read.
#[derive(Clone, Debug, Default)]
pub struct WatchedTick {
    /// The statements up to the one at which the watch stopped.
    pub statements: Vec<WatchedStatement>,
    /// The machine before the last of these statements, if the watch stops at a number.
    pub content: Option<Arc<Inspection>>,
}

impl Watch {
    /// Returns a watch that stops there.
    pub fn new(stop: WatchStop) -> Self {
        Watch { stop, is_found: false, seen: WatchedTick::default() }
    }

    /// Returns the statements and the machine that the watch has read. Returns `None` if the watch
    /// stops at a statement that the script did not begin.
    pub fn finish(self) -> Option<WatchedTick> {
        (self.is_found || matches!(self.stop, WatchStop::Never)).then_some(self.seen)
    }

    /// Reads the machine before its next instruction.
    pub(super) fn see<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        context: &GroupContext,
        vm: &Vm<P, C, SLOTS>,
    ) {
        if self.is_found {
            return;
        }
        let Some(symbols) = context.symbols.as_deref() else { return };
        let Some(next) = vm.next_instruction() else { return };
        let position = u32::from(next.start);
        if symbols.statement(position).is_none() {
            return;
        }
        let number = self.seen.statements.len();
        self.seen.statements.push(WatchedStatement { position, depth: vm.calls().count() });
        match &self.stop {
            WatchStop::Number(wanted, limits) if *wanted == number => {
                let mut content = inspect(vm, Some(symbols), *limits);
                context.neighbors_to_mm(&mut content);
                self.seen.content = Some(Arc::new(content));
                self.is_found = true;
            }
            WatchStop::Number(..) | WatchStop::Never => {}
        }
    }

    /// Runs the machine as [`Vm::run`] would, and ends at the same instruction. Only the budget may
    /// limit the slice, as for a script that is checked.
    pub(crate) fn run<P: Profile, C: ByteCode, H: Host<P>, const SLOTS: usize>(
        &mut self,
        context: &GroupContext,
        vm: &mut Vm<P, C, SLOTS>,
        host: &mut TextMeter<'_, H>,
        mut budget: u16,
    ) -> Outcome {
        if budget == 0 {
            return vm.run(host, 0);
        }
        host.work = 0;
        loop {
            self.see(context, vm);
            let outcome = vm.run(host, 1);
            budget = budget.saturating_sub(1).saturating_sub(mem::take(&mut host.work));
            if outcome != Outcome::Pending || budget == 0 {
                return outcome;
            }
        }
    }
}
