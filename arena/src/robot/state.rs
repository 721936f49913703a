//! State of a robot and its script, but for the machine.

use std::hash::Hash;
use std::sync::Arc;

use bittybuzz_inspect::ScriptMemory;
use bittybuzz_robot_spec::OnFault;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Entry, Fault, FaultCode, Vm};

use crate::engine::{Digest, Io, Stream, TICK_US};

use super::call::{Autopilot, Memory};
use super::checks::Checker;
use super::clock::Clock;
use super::content::ScriptNumber;
use super::context::GroupContext;
use super::faults::{Consequence, FaultCounts, FaultRecord, Faults};
use super::log::{LogLine, News};
use super::overruns::{Overrun, Overruns};
use super::seen::{RobotEvent, Seen};

/// The part of a script that is about to run, or is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    Global,
    Init,
    Step,
    /// The pause after a fault: steps that handle messages only.
    Pause,
}

/// A global that gets another number when a part of the script is done.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    pub after: Stage,
    pub global: u16,
    pub number: ScriptNumber,
}

/// Everything of a robot but the machine.
#[derive(Clone)]
pub struct RobotState {
    pub context: Arc<GroupContext>,
    pub news: News,
    pub stage: Stage,
    /// The stage has begun and is not yet done.
    pub is_running: bool,
    /// The stage is not yet done because a function waits, as the script asked.
    pub is_waiting: bool,
    pub overruns: Option<Box<Overruns>>,
    /// The clock of its script.
    pub clock: Clock,
    /// The time of the clock in µs at which the next step is due.
    pub due_us: u64,
    /// Steps that were completed.
    pub steps: u32,
    /// Milliseconds at which the running `delay` is over.
    pub awake: u64,
    pub memory: Memory,
    pub faults: Option<Box<Faults>>,
    pub refusal: Option<String>,
    /// The events of this tick; `None`: nobody watches.
    pub seen: Option<Box<Seen>>,
    /// The checks of the script, if there are any.
    pub checker: Option<Box<Checker>>,
    /// Globals that are to be set.
    pub settings: Vec<Setting>,
}

impl RobotState {
    pub fn new(
        context: Arc<GroupContext>,
        news: News,
        autopilot: Option<Box<dyn Autopilot>>,
        id: u16,
        seed: u32,
    ) -> Self {
        let chance = Stream::for_brain(u64::from(seed), id);
        let program = context.program;
        RobotState {
            context,
            news,
            stage: Stage::Global,
            is_running: false,
            is_waiting: false,
            overruns: None,
            clock: Clock::EXACT,
            due_us: 0,
            steps: 0,
            awake: 0,
            memory: Memory { autopilot, battery_mv: None, chance, logged: Vec::new(), program },
            faults: None,
            refusal: None,
            seen: None,
            checker: None,
            settings: Vec::new(),
        }
    }

    /// Adds everything to a digest that decides how the robot goes on, but the machine.
    pub fn add_to(&self, digest: &mut Digest) {
        let RobotState { context, stage, is_running, is_waiting, overruns, clock, due_us, .. } =
            self;
        let RobotState { steps, awake, memory, faults, .. } = self;
        // The script, which an event may have exchanged. The other numbers of its group are the scenario's.
        context.image.image().hash(digest);
        (*stage as u8, is_running, is_waiting, due_us, steps, awake).hash(digest);
        memory.add_to(digest);
        digest.text_of(&(clock, overruns, faults));
        if !self.settings.is_empty() {
            digest.text_of(&self.settings);
        }
    }

    /// Takes the globals that are to be set when a part of the script is done.
    pub fn settings_after(&mut self, stage: Stage) -> Vec<Setting> {
        self.settings.extract_if(.., |setting| setting.after == stage).collect()
    }

    /// Returns true while its script does not run because of a fault: in the pause after it, or until power-on.
    pub fn is_faulted(&self) -> bool {
        self.faults.as_ref().is_some_and(|faults| faults.is_halted())
    }

    /// Returns the places of its faults, by the time of the first fault at each.
    pub fn fault_places(&self) -> &[FaultRecord] {
        self.faults.as_ref().map_or(&[], |faults| faults.places())
    }

    /// Returns the numbers of its faults since power-on.
    pub fn fault_counts(&self) -> FaultCounts {
        self.faults.as_ref().map_or_else(FaultCounts::default, |faults| faults.counts())
    }

    /// Returns the number of steps since power-on that were due while the script still executed the one before.
    pub fn missed_steps(&self) -> u64 {
        self.overruns.as_ref().map_or(0, |overruns| overruns.missed)
    }

    /// Returns true if a step is due. The first one is due at once, in the tick of the global code. With a fast clock a second one
    /// may be due in a tick.
    pub fn take_due(&mut self, now: u64) -> bool {
        let now_us = self.clock.time_us(now);
        let is_due = now_us >= self.due_us;
        if is_due {
            let step_us = self.context.step_ticks * u64::from(TICK_US);
            // The ticks of an exact clock are those of the world. Another one does not make up for the steps that a stopped robot
            // has left out.
            let is_on_time = now_us - self.due_us <= 2 * step_us;
            let from = if !self.clock.is_exact() && is_on_time { self.due_us } else { now_us };
            self.due_us = from + step_us;
        }
        is_due
    }

    /// A step is due while the script still executes the one before.
    pub fn overrun(&mut self, first: Overrun) {
        let none = || Box::new(Overruns { missed: 0, first });
        self.overruns.get_or_insert_with(none).missed += 1;
    }

    pub fn faults(&mut self) -> &mut Faults {
        self.faults.get_or_insert_default()
    }

    /// Describes a fault that happens now. It is contained unless the caller gives it another consequence.
    pub fn record(
        &mut self,
        tick: u64,
        fault: Fault,
        positions: Vec<u16>,
        entry: Option<Entry>,
    ) -> FaultRecord {
        let refusal = self.refusal.take();
        let consequence = Consequence::Contained;
        let program = self.context.program;
        FaultRecord {
            tick,
            program,
            fault,
            positions,
            entry,
            refusal,
            memory: None,
            consequence,
            count: 1,
        }
    }

    /// Counts the slots of the machine after a fault for want of memory, if it is the first at its place: others are only
    /// counted.
    pub fn memory_after<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        fault: &Fault,
        vm: &Vm<P, C, SLOTS>,
    ) -> Option<ScriptMemory> {
        let place = |fault: &Fault| (fault.position, fault.code);
        let is_known = self.fault_places().iter().any(|known| place(&known.fault) == place(fault));
        if is_known { None } else { ScriptMemory::after(fault, vm, self.context.slots) }
    }

    /// A fault has stopped the script. Returns true if it starts again after a pause.
    pub fn fail(&mut self, record: FaultRecord) -> bool {
        let is_final =
            record.fault.code == FaultCode::AssertFailed || self.context.on_fault == OnFault::Stop;
        let consequence = match is_final {
            true => Consequence::Stop,
            false => self.faults().next_pause(),
        };
        self.add_fault(FaultRecord { consequence, ..record });
        !is_final
    }

    /// Counts a fault, whose consequence begins now.
    pub fn add_fault(&mut self, record: FaultRecord) {
        if let Some(seen) = &mut self.seen {
            seen.events.push(RobotEvent::Fault(record.clone()));
        }
        self.faults().add(record);
    }

    /// The script has logged a line.
    pub fn log(&mut self, line: LogLine) {
        if let Some(seen) = &mut self.seen {
            seen.log(std::slice::from_ref(&line));
        }
        self.memory.logged.push(line);
        self.news.note();
    }

    /// The script begins anew after a pause.
    pub fn start(&mut self, led: &mut u8) {
        self.faults().start();
        self.stage = Stage::Global;
        if let Some(autopilot) = &mut self.memory.autopilot {
            autopilot.start();
        }
        *led = 0;
    }

    /// Brings a robot to rest whose script has stopped: its motors lose power, unless an autopilot lands it.
    pub fn halt(&mut self, io: &mut Io<'_>) {
        match &mut self.memory.autopilot {
            Some(autopilot) => autopilot.give_up(io),
            None => io.halt(),
        }
    }
}
