//! Runs the machine of a script that is checked.

use std::mem;
use std::sync::Arc;

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Calls, Fault, Host, Outcome, Periods, Reply, RobotFault,
    Sighting, Vm,
};

use crate::robot::context::GroupContext;

use super::costs::Costs;
use super::findings::{FailedOperation, Findings, Peak, RobotMoment, raise};
use super::operation::Upcoming;
use super::watch::Watch;

/// A part of a script's run, after which the machine returns.
#[derive(Clone, Copy, Debug)]
pub struct RunSlice {
    /// The largest number of instructions.
    pub budget: u16,
    /// Tick of the world, or step of a script that runs alone.
    pub tick: u64,
    /// True if the slice belongs to a step, whose cycles are counted.
    pub is_step: bool,
}

/// The checks of one machine.
#[derive(Clone, Debug)]
pub struct MachineChecker {
    findings: Findings,
    costs: Option<Arc<Costs>>,
    /// Id of the robot.
    robot: u16,
    /// Cycles of the running entry up to now.
    cycles: u64,
    /// The frame that was running after the last instruction.
    frame: u16,
    /// The state of the heap after the last instruction.
    heap: [u16; 3],
    /// The slots of the heap that the script could reach at the last count; `None` if the heap has
    /// changed since.
    reachable: Option<usize>,
}

impl MachineChecker {
    /// Returns a checker for the robot with that id. Without costs, cycles are not counted.
    pub fn new(robot: u16, costs: Option<Arc<Costs>>) -> Self {
        MachineChecker {
            findings: Findings::default(),
            costs,
            robot,
            cycles: 0,
            frame: 0,
            heap: [0; 3],
            reachable: None,
        }
    }

    /// Returns the results up to now.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }

    /// Runs the machine as [`Vm::run`] would, and ends at the same instruction. Only the budget may
    /// limit a slice, so [`Host::IS_TIMED`] is ignored.
    pub fn run<P: Profile, C: ByteCode, H: Host<P>, const SLOTS: usize>(
        &mut self,
        vm: &mut Vm<P, C, SLOTS>,
        host: &mut H,
        slice: RunSlice,
    ) -> Outcome {
        self.run_watched(vm, &mut TextMeter::new(host), slice, None)
    }

    /// Runs the machine as [`run`](Self::run) does, with a watch that reads the same instructions.
    pub(crate) fn run_watched<P: Profile, C: ByteCode, H: Host<P>, const SLOTS: usize>(
        &mut self,
        vm: &mut Vm<P, C, SLOTS>,
        host: &mut TextMeter<'_, H>,
        slice: RunSlice,
        mut watch: Option<(&mut Watch, &GroupContext)>,
    ) -> Outcome {
        if slice.budget == 0 {
            return vm.run(host, 0);
        }
        host.work = 0;
        let at = RobotMoment { tick: slice.tick, robot: self.robot };
        let mut budget = slice.budget;
        let mut next = vm.next_instruction();
        self.update_memory_peaks(vm, at, true);
        let outcome = loop {
            if let Some((watch, context)) = &mut watch {
                watch.see(context, vm);
            }
            let upcoming = next.and_then(|next| Upcoming::from_instruction(vm, &next));
            let case = self.costs.as_ref().map(|costs| costs.case(vm, next.as_ref()));
            let outcome = vm.run(host, 1);
            if let (Some(upcoming), Some(next)) = (upcoming, next)
                && let Some((anomaly, exact, result)) = upcoming.judge(vm)
            {
                let Upcoming { operation, .. } = upcoming;
                let example = FailedOperation { operation, exact, result, at };
                self.findings.add(next.position, anomaly, example);
            }
            next = vm.next_instruction();
            let work = mem::take(&mut host.work);
            if let (Some(costs), Some(case)) = (&self.costs, case) {
                self.cycles += costs.cycles(case, next.as_ref(), work);
            }
            budget = budget.saturating_sub(1).saturating_sub(work);
            if outcome != Outcome::Pending {
                break outcome;
            }
            self.update_memory_peaks(vm, at, false);
            if budget == 0 {
                break outcome;
            }
        };
        self.update_entry_peak(vm, at);
        if matches!(outcome, Outcome::Done | Outcome::Fault(_)) {
            let cycles = mem::take(&mut self.cycles);
            if slice.is_step && outcome == Outcome::Done && self.costs.is_some() {
                self.findings.steps.add(cycles, at);
            }
        }
        outcome
    }

    /// Updates the peaks of the memory. The stack grows only with a call, and the heap only when a
    /// slot is taken. The heap is counted only if its use, garbage included, exceeds the peak.
    fn update_memory_peaks<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        vm: &Vm<P, C, SLOTS>,
        at: RobotMoment,
        has_begun: bool,
    ) {
        let frame = mem::replace(&mut self.frame, vm.frame());
        let heap = mem::replace(&mut self.heap, vm.heap_state());
        let has_called = has_begun || self.frame > frame;
        if self.heap != heap {
            self.reachable = None;
        }
        if has_called {
            let peak = Peak { value: vm.calls().count(), at };
            raise(&mut self.findings.calls, peak);
        }
        if !has_called && self.heap == heap {
            return;
        }
        let stack = vm.stack_slots();
        let most = stack + self.reachable.unwrap_or_else(|| vm.heap_slots());
        if self.findings.slots.is_none_or(|peak| most > peak.value) {
            let needed = vm.needed_slots();
            self.reachable = Some(needed.saturating_sub(stack));
            raise(&mut self.findings.slots, Peak { value: needed, at });
        }
    }

    fn update_entry_peak<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        vm: &Vm<P, C, SLOTS>,
        at: RobotMoment,
    ) {
        raise(&mut self.findings.entries, Peak { value: vm.entry_count(), at });
    }
}

/// A host that counts the work on text. Machines that are not checked have the same host, so that the
/// program contains their code once.
pub(crate) struct TextMeter<'a, H> {
    host: &'a mut H,
    /// The work since the last read, as the number of instructions that take the same time.
    pub(super) work: u16,
}

impl<'a, H> TextMeter<'a, H> {
    /// Returns a host that has not worked yet.
    pub fn new(host: &'a mut H) -> Self {
        TextMeter { host, work: 0 }
    }
}

impl<P: Profile, H: Host<P>> Host<P> for TextMeter<'_, H> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        self.host.call(function, arguments, again)
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        self.host.log(arguments);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        self.host.delay_is_over(ms, again)
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        self.host.position(axis)
    }

    fn periods(&self) -> Periods {
        self.host.periods()
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        self.host.receive(frame, sighting)
    }

    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        self.host.receive_content(content)
    }

    fn send(&mut self, frame: &[u8]) {
        self.host.send(frame);
    }

    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        self.host.send_content(robot, content)
    }

    fn is_slice_over(&mut self) -> bool {
        self.host.is_slice_over()
    }

    fn has_worked(&mut self, instructions: u16) {
        self.work = self.work.saturating_add(instructions);
        self.host.has_worked(instructions);
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        self.host.contain(fault, calls)
    }
}
