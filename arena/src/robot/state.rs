//! The state of a robot and its script, except the machine.

use std::hash::Hash;
use std::sync::Arc;

use bittybuzz_inspect::{Inspection, ScriptMemory};
use bittybuzz_robot_spec::OnFault;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Entry, Fault, FaultCode, Vm};

use crate::engine::{Digest, Io, Oscillator, Stream, TICK_US};

use super::call::{Autopilot, FunctionMemory, PoseError};
use super::checks::{MachineChecker, Watch};
use super::content::ScriptNumber;
use super::context::GroupContext;
use super::faults::{Consequence, FaultCounts, FaultRecord, Faults};
use super::log::{LogLine, News};
use super::overruns::{Overrun, Overruns};
use super::post_mortem::{self, LastFault, PostMortem};
use super::question::Question;
use super::seen::{Seen, SeenEvent};

/// The part of a script that is about to run, or is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScriptStage {
    Global,
    Init,
    Step,
    /// The pause after a fault: steps that handle messages only.
    Pause,
}

/// An assignment to a global that happens when a part of the script is done.
#[derive(Debug, Clone, Copy)]
pub struct PendingSetting {
    pub after: ScriptStage,
    pub global: u16,
    pub number: ScriptNumber,
}

/// The state of a robot, except the machine.
#[derive(Clone)]
pub struct RobotContext {
    pub context: Arc<GroupContext>,
    pub news: News,
    pub stage: ScriptStage,
    /// True if the stage has begun and is not yet done.
    pub is_running: bool,
    /// True if the stage is not yet done because the script called a function that waits.
    pub is_waiting: bool,
    pub overruns: Option<Box<Overruns>>,
    /// The time of the robot's clock in µs at which the next step is due.
    pub due_us: u64,
    /// The number of completed steps.
    pub steps: u32,
    /// Time of the script's clock in ms at which the running `delay` is over.
    pub awake: u64,
    pub memory: FunctionMemory,
    pub faults: Option<Box<Faults>>,
    pub refusal: Option<String>,
    /// The events of this tick; `None` if the robot is not watched.
    pub seen: Option<Box<Seen>>,
    /// The last fault with the content of the machine; `None` if no copies are kept.
    pub last_fault: Option<Box<LastFault>>,
    /// The checks of the script, if there are any.
    pub checker: Option<Box<MachineChecker>>,
    /// The watch on the statements of this tick, if there is one.
    pub watch: Option<Box<Watch>>,
    /// Globals that are to be set.
    pub settings: Vec<PendingSetting>,
    /// Questions that are to be answered.
    pub questions: Vec<Question>,
    /// The lines that the question which is being answered has logged.
    pub asked: Option<Vec<LogLine>>,
}

impl RobotContext {
    pub fn new(
        context: Arc<GroupContext>,
        news: News,
        autopilot: Option<Box<dyn Autopilot>>,
        id: u16,
        seed: u32,
    ) -> Self {
        let chance = Stream::for_brain(u64::from(seed), id);
        let program = context.program;
        RobotContext {
            context,
            news,
            stage: ScriptStage::Global,
            is_running: false,
            is_waiting: false,
            overruns: None,
            due_us: 0,
            steps: 0,
            awake: 0,
            memory: FunctionMemory {
                autopilot,
                battery_mv: None,
                pose_error: PoseError::default(),
                chance,
                logged: Vec::new(),
                program,
            },
            faults: None,
            refusal: None,
            seen: None,
            last_fault: None,
            checker: None,
            watch: None,
            settings: Vec::new(),
            questions: Vec::new(),
            asked: None,
        }
    }

    /// Adds the state that determines how the robot continues to a digest, except the machine.
    pub fn add_to(&self, digest: &mut Digest) {
        let RobotContext { context, stage, is_running, is_waiting, overruns, due_us, .. } = self;
        let RobotContext { steps, awake, memory, faults, .. } = self;
        // An event may have replaced the script. A question changes nothing by its place in the image,
        // but by the values that it leaves. The other values of the group come from the
        // scenario and do not change.
        context.origin.image().hash(digest);
        (*stage as u8, is_running, is_waiting, due_us, steps, awake).hash(digest);
        memory.add_to(digest);
        digest.text_of(&(overruns, faults));
        if !self.settings.is_empty() {
            digest.text_of(&self.settings);
        }
        self.questions.iter().for_each(|question| digest.text_of(&question.text));
    }

    /// Removes and returns the assignments that are due after a part of the script.
    pub fn settings_after(&mut self, stage: ScriptStage) -> Vec<PendingSetting> {
        self.settings.extract_if(.., |setting| setting.after == stage).collect()
    }

    /// Returns true while the script does not run because of a fault: in the pause after the fault,
    /// or until power-on.
    pub fn is_faulted(&self) -> bool {
        self.faults.as_ref().is_some_and(|faults| faults.is_halted())
    }

    /// Returns the places of the script's faults, ordered by the time of the first fault at each.
    pub fn fault_places(&self) -> &[FaultRecord] {
        self.faults.as_ref().map_or(&[], |faults| faults.places())
    }

    /// Returns the numbers of faults since power-on.
    pub fn fault_counts(&self) -> FaultCounts {
        self.faults.as_ref().map_or_else(FaultCounts::default, |faults| faults.counts())
    }

    /// Returns the number of steps since power-on that were due while the script still executed the one before.
    pub fn missed_steps(&self) -> u64 {
        self.overruns.as_ref().map_or(0, |overruns| overruns.missed)
    }

    /// Returns true if the robot was stopped since its last step.
    pub fn was_stopped(&self, clock: Oscillator, now: u64) -> bool {
        let late_us = clock.time_us(now).saturating_sub(self.due_us);
        self.stage == ScriptStage::Step && late_us > 2 * self.step_us()
    }

    fn step_us(&self) -> u64 {
        self.context.step_ticks * u64::from(TICK_US)
    }

    /// Returns true if a step is due, and plans the next one. The first step is due at once, in the
    /// tick of the global code. With a fast clock, a second step may be due in a tick.
    pub fn take_due(&mut self, clock: Oscillator, now: u64) -> bool {
        let now_us = clock.time_us(now);
        let is_due = now_us >= self.due_us;
        if is_due {
            let step_us = self.step_us();
            // An exact clock follows the ticks of the world. Any other clock keeps its own rhythm,
            // but does not make up for the steps that were left out while the robot was stopped.
            let is_on_time = now_us - self.due_us <= 2 * step_us;
            let from = if !clock.is_exact() && is_on_time {
                self.due_us
            } else {
                now_us - now_us % u64::from(TICK_US)
            };
            self.due_us = from + step_us;
        }
        is_due
    }

    /// Counts a step that is due while the script still executes the one before. `first` describes
    /// the overrun if it is the first one.
    pub fn overrun(&mut self, first: Overrun) {
        let none = || Box::new(Overruns { missed: 0, first });
        self.overruns.get_or_insert_with(none).missed += 1;
    }

    pub fn faults(&mut self) -> &mut Faults {
        self.faults.get_or_insert_default()
    }

    /// Returns the record of a fault that happens now. The consequence is
    /// [`Consequence::Contained`] unless the caller replaces it.
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

    /// Returns true if a copy of a fault of this tick is kept. A listener may fail for each of many
    /// messages, and the copies would be alike.
    pub fn keeps_fault_of(&self, tick: u64) -> bool {
        let last = self.last_fault.as_ref().and_then(|last| last.0.as_ref());
        last.is_some_and(|last| last.fault.tick == tick)
    }

    /// Returns the content of the machine after a fault, if copies are kept.
    pub fn content_after<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        vm: &Vm<P, C, SLOTS>,
    ) -> Option<Arc<Inspection>> {
        self.last_fault.as_ref().map(|_| post_mortem::content(&self.context, vm))
    }

    /// Returns the memory of the machine after a fault that ran out of memory, if it is the first
    /// fault at its place. Later faults at the same place are only counted.
    pub fn memory_after<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        fault: &Fault,
        vm: &Vm<P, C, SLOTS>,
    ) -> Option<ScriptMemory> {
        let place = |fault: &Fault| (fault.position, fault.code);
        let is_known = self.fault_places().iter().any(|known| place(&known.fault) == place(fault));
        if is_known { None } else { ScriptMemory::after(fault, vm, self.context.slots) }
    }

    /// Handles a fault that stopped the script, with the content of the machine if copies are kept.
    /// Returns true if the script restarts after a pause.
    pub fn fail(&mut self, record: FaultRecord, content: Option<Arc<Inspection>>) -> bool {
        let is_final =
            record.fault.code == FaultCode::AssertFailed || self.context.on_fault == OnFault::Stop;
        let consequence = match is_final {
            true => Consequence::Stop,
            false => self.faults().next_pause(),
        };
        self.add_fault(FaultRecord { consequence, ..record }, content);
        !is_final
    }

    /// Counts a fault, whose consequence begins now, and reports it to observers. `content` is that
    /// of the machine, if copies are kept.
    pub fn add_fault(&mut self, record: FaultRecord, content: Option<Arc<Inspection>>) {
        if self.seen.is_some() || self.last_fault.is_some() {
            let is_further =
                record.consequence == Consequence::Contained && self.keeps_fault_of(record.tick);
            let found = Arc::new(PostMortem { fault: record.clone(), content });
            if let Some(seen) = &mut self.seen {
                seen.events.push(SeenEvent::Fault(found.clone()));
            }
            if let Some(last) = &mut self.last_fault
                && !is_further
            {
                last.0 = Some(found);
            }
        }
        self.faults().add(record);
    }

    /// Returns the record of events, if an observer uses those of frames.
    pub fn seen_frames(&mut self) -> Option<&mut Seen> {
        self.seen.as_deref_mut().filter(|seen| seen.interest.frames)
    }

    /// Stores a line that the script logged, and reports it to observers.
    pub fn log(&mut self, line: LogLine) {
        if let Some(seen) = &mut self.seen {
            seen.log(std::slice::from_ref(&line));
        }
        self.memory.logged.push(line);
        self.news.note();
    }

    /// Restarts the script after a pause.
    pub fn start(&mut self, led: &mut u8) {
        self.faults().start();
        self.stage = ScriptStage::Global;
        if let Some(autopilot) = &mut self.memory.autopilot {
            autopilot.start();
        }
        *led = 0;
    }

    /// Brings a robot whose script has stopped to rest: its motors lose power, unless an autopilot
    /// lands it.
    pub fn halt(&mut self, io: &mut Io<'_>) {
        match &mut self.memory.autopilot {
            Some(autopilot) => autopilot.give_up(io),
            None => io.halt(),
        }
    }
}
