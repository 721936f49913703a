//! A robot of a run, which is a machine in this process or firmware in an emulator.

use std::mem;
use std::sync::Arc;

use bittybuzz_comms::trace::Unused;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_inspect::{Inspection, Limits};
use bittybuzz_vm_core::{Fault, ImageError, NetworkCounters};

use crate::engine::{Brain, Digest, Io};

use super::call::{BatteryState, PoseError};
use super::checks::{Costs, Findings, MachineChecker, Watch, WatchStop, WatchedTick};
use super::content::{ScriptNumber, VariableContent};
use super::context::GroupContext;
use super::faults::{Consequence, FaultRecord};
use super::log::{LineKind, LogLine, News, Piece};
use super::machine::{self, Machine};
use super::model::RobotModel;
use super::overruns::Overrun;
use super::question::{Answer, Question};
use super::seen::{Interest, SeenEvent};
use super::state::{PendingSetting, RobotContext, ScriptStage};

/// Bytes of an autopilot and of the body that it flies, measured with a Crazyflie.
const AUTOPILOT_BYTES: usize = 11_000;

/// The program that a robot runs.
#[derive(Clone)]
enum RobotProgram {
    /// A machine of this process.
    Machine(Box<dyn Machine + Send>),
    /// The firmware of the robot in an emulator, of which only the reports are known.
    Firmware(Unused),
}

/// A robot and its script.
#[derive(Clone)]
pub struct SimRobot {
    program: RobotProgram,
    state: RobotContext,
}

impl SimRobot {
    /// Returns a robot with that id that has just been switched on.
    pub fn new(
        model: &dyn RobotModel,
        context: &Arc<GroupContext>,
        news: News,
        id: u16,
        seed: u32,
    ) -> Result<Self, ImageError> {
        let program = RobotProgram::Machine(machine::load(context, id, seed)?);
        Ok(SimRobot {
            program,
            state: RobotContext::new(context.clone(), news, model.autopilot(), id, seed),
        })
    }

    /// Returns a robot with that id that runs its firmware.
    pub fn emulated(context: &Arc<GroupContext>, news: News, id: u16) -> Self {
        let program = RobotProgram::Firmware(Unused::default());
        SimRobot { program, state: RobotContext::new(context.clone(), news, None, id, 0) }
    }

    /// Checks the script from now on if a machine of this process runs it. Without costs, cycles
    /// are not counted.
    pub fn check(&mut self, id: u16, costs: Option<Arc<Costs>>) {
        if let RobotProgram::Machine(_) = &self.program {
            self.state.checker = Some(Box::new(MachineChecker::new(id, costs)));
        }
    }

    /// Returns the results of the checks; `None` if the script is not checked.
    pub fn findings(&self) -> Option<&Findings> {
        self.state.checker.as_ref().map(|checker| checker.findings())
    }

    /// Stores the firmware's counters of unused messages since power-on.
    pub fn has_missed(&mut self, unused: Unused) {
        if let RobotProgram::Firmware(known) = &mut self.program {
            *known = unused;
        }
        if unused.messages.failed > 0 {
            self.state.faults().has_contained(unused.messages.failed);
        }
    }

    /// Stores the number of steps that the firmware has missed since power-on because an earlier
    /// step took too long.
    pub fn has_overrun(&mut self, tick: u64, missed: u32) {
        let program = self.state.context.program;
        self.state.overrun(Overrun { tick, program, position: None });
        if let Some(overruns) = &mut self.state.overruns {
            overruns.missed = missed.into();
        }
    }

    /// Stores a line that the firmware reports its script to have logged.
    pub fn has_logged(&mut self, tick: u64, pieces: Vec<Piece>) {
        let (program, kind) = (self.state.context.program, LineKind::Logged);
        self.state.log(LogLine { tick, program, pieces, kind });
    }

    /// Evaluates a question after the step, if one is running.
    pub fn ask(&mut self, question: Question) {
        self.state.questions.push(question);
    }

    /// Answers a question now.
    pub fn answer(&mut self, text: &str, tick: u64, answer: Answer) {
        let line = answer.line(text, tick, self.state.context.program);
        self.state.log(line);
    }

    /// Counts a completed step that the firmware reports. After a fault, the step shows that the
    /// script has restarted.
    pub fn has_stepped(&mut self) {
        self.state.steps = self.state.steps.saturating_add(1);
        if let Some(faults) = &mut self.state.faults {
            if faults.is_halted() {
                faults.start();
            }
            faults.step();
        }
    }

    /// Handles a fault that stopped the script in firmware that does not report restarts. Only the
    /// next completed step shows that the script has restarted.
    pub fn has_failed(&mut self, tick: u64, fault: Fault) {
        let record = self.state.record(tick, fault, vec![fault.position], None);
        self.state.fail(record, None);
    }

    /// Handles a fault that stopped the script in firmware that also reports a restart.
    pub fn has_stopped(&mut self, tick: u64, fault: Fault, positions: Vec<u16>) {
        let record = self.state.record(tick, fault, positions, None);
        self.state.add_fault(FaultRecord { consequence: Consequence::Stop, ..record }, None);
    }

    /// Records a fault that ended a listener or a handler of the script.
    pub fn has_contained(&mut self, tick: u64, fault: Fault, positions: Vec<u16>) {
        let record = self.state.record(tick, fault, positions, None);
        self.state.add_fault(record, None);
    }

    /// Records a fault that ended a listener or a handler of the script, unless a contained fault
    /// at that place is already known.
    pub fn has_contained_once(&mut self, tick: u64, fault: Fault) {
        let is_it = |place: &FaultRecord| {
            let known = (place.fault.position, place.fault.code, place.consequence);
            known == (fault.position, fault.code, Consequence::Contained)
        };
        if !self.state.fault_places().iter().any(is_it) {
            self.has_contained(tick, fault, vec![fault.position]);
        }
    }

    /// Handles the report that the script restarts after `pause` ticks; 0 stands for a restart now.
    pub fn has_restarted(&mut self, pause: u16) {
        match pause {
            0 => self.state.faults().start(),
            _ => self.state.faults().has_paused(pause),
        }
    }

    /// Adds the state that determines how the robot continues to a digest. The state of firmware is
    /// in its emulator and is left out.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        if let RobotProgram::Machine(machine) = &self.program {
            machine.add_to(digest);
            self.state.add_to(digest);
        }
    }

    /// Returns the state of the robot, except its machine.
    pub fn state(&self) -> &RobotContext {
        &self.state
    }

    /// Returns the number of frames for which the queues had no room: received frames, and frames
    /// to be sent.
    pub fn dropped(&self) -> [u16; 2] {
        match &self.program {
            RobotProgram::Machine(machine) => machine.dropped(),
            RobotProgram::Firmware(unused) => unused.dropped,
        }
    }

    /// Returns the numbers of messages that it could not use.
    pub fn counters(&self) -> NetworkCounters {
        match &self.program {
            RobotProgram::Machine(machine) => machine.counters(),
            RobotProgram::Firmware(unused) => unused.messages,
        }
    }

    /// Returns the number of received broadcasts on topics to which its script does not listen. A
    /// robot's firmware does not report it.
    pub fn unwanted(&self) -> u16 {
        match &self.program {
            RobotProgram::Machine(machine) => machine.unwanted(),
            RobotProgram::Firmware(_) => 0,
        }
    }

    /// Reports new log lines to the flag of another run from now on.
    pub fn set_news(&mut self, news: News) {
        self.state.news = news;
    }

    /// Takes over the log, the events that observers have not read yet, the watch on statements, the
    /// questions that wait, and the battery of another robot.
    pub fn adopt(&mut self, other: &mut Self) {
        self.state.memory.logged.append(&mut other.state.memory.logged);
        self.state.seen = other.state.seen.take();
        self.state.watch = other.state.watch.take();
        self.state.questions.append(&mut other.state.questions);
        let (memory, before) = (&mut self.state.memory, &other.state.memory);
        memory.battery_mv = before.battery_mv;
        if let (Some(autopilot), Some(before)) = (&mut memory.autopilot, &before.autopilot) {
            autopilot.adopt(&**before);
        }
        let error = before.pose_error;
        self.change_pose_error(|own| *own = error);
    }

    /// Changes the errors of the robot's poses from outside.
    fn change_pose_error(&mut self, change: impl FnOnce(&mut PoseError)) {
        let memory = &mut self.state.memory;
        change(&mut memory.pose_error);
        if let Some(autopilot) = &mut memory.autopilot {
            autopilot.set_pose_error(memory.pose_error);
        }
    }

    /// Returns the errors of the robot's poses from outside.
    pub fn pose_error(&self) -> PoseError {
        self.state.memory.pose_error
    }

    /// Displaces the robot's poses from outside further, in mm.
    pub fn displace_poses(&mut self, [x, y]: [f32; 2]) {
        self.change_pose_error(|error| {
            error.displaced_mm[0] += x;
            error.displaced_mm[1] += y;
        });
    }

    /// Lets the source of poses take the robot whose id is that much larger for this one, or no longer if
    /// it does so already.
    pub fn see_as(&mut self, offset: i32) {
        self.change_pose_error(|error| {
            error.seen_as = (error.seen_as != Some(offset)).then_some(offset);
        });
    }

    /// Returns the battery at a time of the run in ms, if it is known.
    pub fn battery(&self, milliseconds: u64) -> Option<BatteryState> {
        let memory = &self.state.memory;
        if let Some(millivolts) = memory.battery_mv {
            return Some(BatteryState { millivolts, charge: None });
        }
        let autopilot = memory.autopilot.as_ref()?;
        let millivolts = autopilot.battery_mv(milliseconds)?;
        Some(BatteryState { millivolts, charge: autopilot.battery_charge(milliseconds) })
    }

    /// Sets the voltage of its battery.
    pub fn set_battery(&mut self, millivolts: u16) {
        self.state.memory.battery_mv = Some(millivolts);
    }

    /// Keeps the content of the machine at each fault from now on.
    pub fn keep_post_mortem(&mut self) {
        self.state.last_fault.get_or_insert_default();
    }

    /// Records events from now on, until [`stop_watching`](Self::stop_watching).
    pub(crate) fn watch(&mut self, interest: Interest) {
        let seen = self.state.seen.get_or_insert_default();
        seen.interest = interest;
        seen.events.clear();
    }

    /// Returns the events since the last call, or since [`watch`](Self::watch).
    pub(crate) fn take_seen(&mut self) -> Vec<SeenEvent> {
        self.state.seen.as_mut().map_or_else(Vec::new, |seen| mem::take(&mut seen.events))
    }

    /// Records no events from now on.
    pub(crate) fn stop_watching(&mut self) {
        self.state.seen = None;
    }

    /// Watches the statements of the next tick, until [`take_statements`](Self::take_statements).
    pub(crate) fn watch_statements(&mut self, stop: WatchStop) {
        self.state.watch = Some(Box::new(Watch::new(stop)));
    }

    /// Returns the part of the tick that the watch has read, and ends it.
    pub(crate) fn take_statements(&mut self) -> Option<WatchedTick> {
        self.state.watch.take()?.finish()
    }

    /// Removes and returns the lines that the script logged.
    pub fn take_log(&mut self) -> Vec<LogLine> {
        std::mem::take(&mut self.state.memory.logged)
    }

    /// Returns about how many bytes the robot takes.
    pub fn bytes(&self) -> usize {
        let slots = self.state.context.slots;
        let machine = self.machine().map_or(0, |machine| machine.bytes(slots));
        let autopilot = self.state.memory.autopilot.as_ref();
        // The content of the machine at its last fault takes about as much as the machine.
        let last = self.state.last_fault.as_ref().and_then(|last| last.0.as_ref());
        let has_content = last.is_some_and(|fault| fault.content.is_some());
        let machine = if has_content { 2 * machine } else { machine };
        machine + autopilot.map_or(0, |_| AUTOPILOT_BYTES) + size_of::<Self>()
    }

    /// Returns a global of the script, or the value to which `keys` lead in its tables.
    pub fn global(&self, number: u16, keys: &[VariableContent]) -> VariableContent {
        self.machine().map_or(VariableContent::Nil, |machine| machine.global(number, keys))
    }

    /// Returns the number in a global of its script, if it holds one.
    pub fn number(&self, global: u16) -> Option<ScriptNumber> {
        self.machine()?.number(global)
    }

    /// Sets a global of the script now, or after the global code if that has yet to run.
    pub fn set(&mut self, global: u16, number: ScriptNumber) {
        match &mut self.program {
            RobotProgram::Machine(machine)
                if matches!(self.state.stage, ScriptStage::Init | ScriptStage::Step) =>
            {
                machine.set(global, number);
            }
            _ => self.state.settings.push(PendingSetting {
                after: ScriptStage::Global,
                global,
                number,
            }),
        }
    }

    /// Sets a global of the script when `init` is done.
    pub fn keep(&mut self, global: u16, number: ScriptNumber) {
        self.state.settings.push(PendingSetting { after: ScriptStage::Init, global, number });
    }

    /// Returns an entry of a stigmergy, as this robot knows it.
    pub fn stigmergy(&self, number: u16, key: VariableContent) -> VariableContent {
        self.machine().map_or(VariableContent::Nil, |machine| machine.stigmergy(number, key))
    }

    /// Returns the number of free slots of its script's memory.
    pub fn free_slots(&self) -> usize {
        self.machine().map_or(0, |machine| machine.free_slots())
    }

    /// Returns the number of its neighbors.
    pub fn neighbors(&self) -> usize {
        self.machine().map_or(0, |machine| machine.neighbors())
    }

    /// Returns the content of the machine, with names from the symbols of the script; `None` if the
    /// robot runs its firmware. The distances of neighbors are in mm, also if those in the machine
    /// are in the unit of another host.
    pub fn inspect(&self, symbols: Option<&Symbols>, limits: Limits) -> Option<Inspection> {
        let mut found = self.machine()?.inspect(symbols, limits);
        self.state.context.neighbors_to_mm(&mut found);
        Some(found)
    }

    fn machine(&self) -> Option<&(dyn Machine + Send)> {
        match &self.program {
            RobotProgram::Machine(machine) => Some(&**machine),
            RobotProgram::Firmware(_) => None,
        }
    }
}

impl Brain for SimRobot {
    fn tick(&mut self, io: &mut Io<'_>) {
        if let RobotProgram::Machine(machine) = &mut self.program {
            machine.tick(&mut self.state, io);
            let memory = &mut self.state.memory;
            if let Some(autopilot) = &mut memory.autopilot {
                autopilot.tick(io, memory.battery_mv);
            }
        }
    }

    fn has_frame(&self) -> bool {
        self.machine().is_some_and(|machine| machine.has_unsent())
    }

    fn is_within_message(&self) -> bool {
        self.machine().is_some_and(|machine| machine.is_within_message())
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        match &mut self.program {
            RobotProgram::Machine(machine) => machine.next_frame(frame),
            RobotProgram::Firmware(_) => 0,
        }
    }
}
