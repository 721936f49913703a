//! Virtual machines of the sizes that robot files ask for.
//!
//! The size of a machine's memory is part of its type. There is one type for each robot that ships,
//! as large as its file says or up to a seventh larger, and a few for robots of users, of which the
//! largest has its slots in pages that exist on demand ([`paged`]). A robot gets the smallest type
//! into which it fits. The type makes no difference to a script, which gets exactly the slots of its
//! robot's file.

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_inspect::{InspectedQueue, Inspection, Limits, Queues, inspect};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::message::{FULL_FRAME, FrameKind, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{
    ByteCode, Entry, Image, ImageError, NetworkCounters, Outcome, SLOTS_MAX, Vm,
};

use crate::engine::{Digest, Io, LossCause};

use super::checks::{RunSlice, TextMeter};
use super::content::{ScriptNumber, VariableContent, content, value};
use super::context::{GroupContext, KeptImage};
use super::overruns::Overrun;
use super::platform::Platform;
use super::queue::{InQueue, OutQueue, QueueProfile};
use super::seen::SeenEvent;
use super::state::{PendingSetting, RobotContext, ScriptStage};

mod answer;
mod paged;
#[cfg(not(target_family = "wasm"))]
mod shipped;

use paged::GrowingImage;

/// Slots of the machines for robots that do not ship, by profile, without those whose memory grows.
/// A WebAssembly module is downloaded and should be small: there, robots that ship use these
/// machines, too, and only small robots, of which there are thousands, have one that does not grow.
/// With memory that grows, 20,000 Kilobots took 1.7 times as long, and 1.7 times the memory.
const TINY: [usize; 2] = if cfg!(target_family = "wasm") { [512, 512] } else { FULL };
const FULL: [usize; 2] = if cfg!(target_family = "wasm") { [0, 0] } else { [1024, 4096] };

/// Bytes of a slot of the machines whose memory grows.
const SLOT_BYTES: usize = 5;

/// A virtual machine and its queues of frames.
pub trait Machine {
    /// Returns a copy of the machine and its queues that continues exactly as the original would.
    fn copy(&self) -> Box<dyn Machine + Send>;

    /// Returns about how many bytes the machine takes, whose script may use `slots`.
    fn bytes(&self, slots: usize) -> usize;

    /// Adds the state and the frames in the queues to a digest.
    fn add_to(&self, digest: &mut Digest);

    /// Runs a tick.
    fn tick(&mut self, state: &mut RobotContext, io: &mut Io<'_>);

    /// Returns true if a frame is to be sent.
    fn has_unsent(&self) -> bool;

    /// Returns true if the next frame to be sent continues a long message.
    fn is_within_message(&self) -> bool;

    /// Removes the next frame that is to be sent and copies it; returns its length.
    fn next_frame(&mut self, frame: &mut [u8]) -> usize;

    /// Returns the number of frames for which the queues had no room: received frames, and frames
    /// to be sent.
    fn dropped(&self) -> [u16; 2];

    /// Returns the numbers of messages that it could not use.
    fn counters(&self) -> NetworkCounters;

    /// Returns the number of received broadcasts on topics to which its script does not listen.
    fn unwanted(&self) -> u16;

    /// Returns a global of the script, or the value to which `keys` lead in its tables.
    fn global(&self, number: u16, keys: &[VariableContent]) -> VariableContent;

    /// Returns the number in a global of the script, if it holds one.
    fn number(&self, global: u16) -> Option<ScriptNumber>;

    /// Sets a global of the script.
    fn set(&mut self, global: u16, number: ScriptNumber);

    /// Returns an entry of a stigmergy, as this robot knows it.
    fn stigmergy(&self, number: u16, key: VariableContent) -> VariableContent;

    /// Returns the number of free slots of the script's memory.
    fn free_slots(&self) -> usize;

    /// Returns the number of its neighbors.
    fn neighbors(&self) -> usize;

    /// Returns the content of the machine, with names from the symbols of its script.
    fn inspect(&self, symbols: Option<&Symbols>, limits: Limits) -> Inspection;
}

impl Clone for Box<dyn Machine + Send> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// Returns true for a frame of a known type that is short enough for the queues of the profile.
fn is_readable(profile: NumberProfile, frame: &[u8]) -> bool {
    let longest = match profile {
        NumberProfile::Tiny => TINY_FRAME,
        NumberProfile::Full => FULL_FRAME,
    };
    frame.len() <= longest && frame.first().is_some_and(|first| FrameKind::of(*first).is_some())
}

type Loaded = Result<Box<dyn Machine + Send>, ImageError>;

/// A machine of one of several sizes, with queues of any length.
type Larger<P, const SLOTS: usize> =
    Scripted<P, KeptImage, Box<dyn InQueue + Send>, Box<dyn OutQueue + Send>, SLOTS>;

/// A machine whose memory grows on demand, with queues of any length.
type Growing<P> =
    Scripted<P, GrowingImage, Box<dyn InQueue + Send>, Box<dyn OutQueue + Send>, SLOTS_MAX>;

/// A machine with queues of any type.
#[derive(Clone)]
struct Scripted<P: Profile, C: ByteCode, I, O, const SLOTS: usize> {
    vm: Vm<P, C, SLOTS>,
    inbox: I,
    outbox: O,
    /// True if a frame, or a part of a message, may be in the inbox. There is none in most ticks,
    /// and the queue's memory need not be read.
    has_mail: bool,
    /// True if a frame is in the outbox.
    has_unsent: bool,
}

/// Returns a machine that has loaded the script of its group. The sizes are at most [`SLOTS_MAX`] and
/// [`queue::MOST`](super::queue::MOST).
pub fn load(context: &GroupContext, id: u16, seed: u32) -> Loaded {
    let slots = context.slots + context.sizes.slots();
    #[cfg(not(target_family = "wasm"))]
    if let Some(loaded) = shipped::load(context, slots, id, seed) {
        return loaded;
    }
    match context.profile {
        NumberProfile::Tiny => {
            load_larger::<Tiny, { TINY[0] }, { TINY[1] }>(context, slots, id, seed)
        }
        NumberProfile::Full => {
            load_larger::<Full, { FULL[0] }, { FULL[1] }>(context, slots, id, seed)
        }
    }
}

/// Loads the smallest of three machines that has enough slots.
fn load_larger<P: QueueProfile, const SMALL: usize, const MIDDLE: usize>(
    context: &GroupContext,
    slots: usize,
    id: u16,
    seed: u32,
) -> Loaded
where
    Larger<P, SMALL>: Send,
    Larger<P, MIDDLE>: Send,
    Growing<P>: Send,
{
    let [inbox, outbox, in_long, out_long] = context.queues;
    let (inbox, outbox) = (P::inbox(inbox, in_long), P::outbox(outbox, out_long));
    // The comparison with 0 keeps machines without slots out of a program.
    if SMALL > 0 && slots <= SMALL {
        Larger::<P, SMALL>::load(context, inbox, outbox, id, seed)
    } else if MIDDLE > 0 && slots <= MIDDLE {
        Larger::<P, MIDDLE>::load(context, inbox, outbox, id, seed)
    } else {
        Growing::<P>::load(context, inbox, outbox, id, seed)
    }
}

impl<P: Profile, C, I, O, const SLOTS: usize> Scripted<P, C, I, O, SLOTS>
where
    C: ByteCode + From<KeptImage> + 'static,
    I: InQueue + Clone + 'static,
    O: OutQueue + Clone + 'static,
    Self: Send,
{
    fn load(context: &GroupContext, inbox: I, outbox: O, id: u16, seed: u32) -> Loaded {
        let mut scripted =
            Box::new(Scripted { vm: Vm::new(), inbox, outbox, has_mail: false, has_unsent: false });
        load_program(&mut scripted.vm, context)?;
        scripted.vm.set_robot_id(id, seed);
        Ok(scripted)
    }

    /// Moves the received frames of a robot that is watched into its inbox. Returns those that were
    /// discarded.
    #[cold] // Most runs are not watched.
    fn take_frames(&mut self, io: &Io<'_>, profile: NumberProfile) -> Vec<SeenEvent> {
        let mut unread = Vec::new();
        for (place, frame) in io.inbox.iter().enumerate() {
            let before = self.inbox.counters();
            self.inbox.push(frame.bytes, frame.sighting, self.vm.unwanted_topics());
            self.has_mail = true;
            let after = self.inbox.counters();
            if (before.dropped, before.incomplete) == (after.dropped, after.incomplete) {
                continue;
            }
            let cause = match is_readable(profile, frame.bytes) {
                true => LossCause::QueueFull,
                false => LossCause::Unreadable,
            };
            unread.push(SeenEvent::Unread(io.inbox.sent(place, io.now), cause));
        }
        unread
    }

    /// Runs a tick without questions.
    fn advance(&mut self, state: &mut RobotContext, io: &mut Io<'_>) {
        if state.was_stopped(io.clock, io.now) {
            self.vm.come_back();
        }
        let mut is_due = state.take_due(io.clock, io.now);
        if let Some(faults) = &mut state.faults {
            if faults.is_over() {
                return;
            }
            // A message that is being handled is completed first.
            if state.stage == ScriptStage::Pause && faults.tick() && is_due && !state.is_running {
                state.start(io.led);
            }
        }
        let profile = state.context.profile;
        if let Some(seen) = state.seen_frames() {
            seen.events.extend(self.take_frames(io, profile));
        } else {
            for frame in io.inbox.iter() {
                self.inbox.push(frame.bytes, frame.sighting, self.vm.unwanted_topics());
                self.has_mail = true;
            }
        }
        loop {
            // This is the only call of `run`, so that it is inlined: 0.2 % fewer instructions in
            // speed.toml.
            self.run(state, io, is_due);
            if io.clock.is_exact() || !state.take_due(io.clock, io.now) {
                return;
            }
            is_due = true;
        }
    }

    /// Runs a tick: the global code and `init` in the first tick, then a step in each tick in which
    /// one is due, unless the step before takes longer. After a fault, the steps of the pause
    /// handle only messages, and then the script restarts.
    fn run(&mut self, state: &mut RobotContext, io: &mut Io<'_>, is_due: bool) {
        let budget = state.context.budget;
        let Scripted { vm, inbox, outbox, has_mail, has_unsent } = self;
        if !state.is_running && !is_due {
            return;
        }
        // The script asked for the wait, so the steps that it leaves out are not missed.
        if is_due && state.is_running && !state.is_waiting {
            let (program, position) = (state.context.program, vm.calls().next());
            state.overrun(Overrun { tick: io.now, program, position });
        }
        let mut platform: Platform<'_, '_> =
            Platform { io, state, inbox, outbox, has_mail, has_unsent };
        loop {
            let stage = platform.state.stage;
            let entry = match stage {
                ScriptStage::Global => Entry::Global,
                ScriptStage::Init => Entry::Init,
                ScriptStage::Step | ScriptStage::Pause => Entry::Step,
            };
            if !platform.state.is_running {
                platform.outbox.begin_step();
            }
            let is_running = platform.state.is_running || vm.begin(entry);
            let outcome = if !is_running {
                Outcome::Done
            } else {
                let (mut checker, mut watch) =
                    (platform.state.checker.take(), platform.state.watch.take());
                let context = watch.is_some().then(|| platform.state.context.clone());
                let now = platform.io.now;
                let mut host = TextMeter::new(&mut platform);
                let watched = watch.as_deref_mut().zip(context.as_deref());
                let outcome = match (&mut checker, watched) {
                    (Some(checker), watched) => {
                        let is_step = stage == ScriptStage::Step;
                        let slice = RunSlice { budget, tick: now, is_step };
                        checker.run_watched(vm, &mut host, slice, watched)
                    }
                    (None, Some((watch, context))) => watch.run(context, vm, &mut host, budget),
                    (None, None) => vm.run(&mut host, budget),
                };
                (platform.state.checker, platform.state.watch) = (checker, watch);
                outcome
            };
            let Platform { io, state, .. } = &mut platform;
            match outcome {
                Outcome::Done => {
                    state.is_running = false;
                    if stage == ScriptStage::Step && is_running {
                        state.steps = state.steps.saturating_add(1);
                        if let Some(faults) = &mut state.faults {
                            // The time without a fault counts in ticks, not in steps.
                            (0..state.context.step_ticks).for_each(|_| faults.step());
                        }
                    }
                    state.stage = match stage {
                        ScriptStage::Global => ScriptStage::Init,
                        ScriptStage::Init | ScriptStage::Step => ScriptStage::Step,
                        ScriptStage::Pause => ScriptStage::Pause,
                    };
                    if stage == ScriptStage::Global && !state.context.globals.is_empty() {
                        set_initial_globals(vm, &state.context.globals);
                    }
                    if !state.settings.is_empty() {
                        set_globals(vm, &state.settings_after(stage));
                    }
                    if stage != ScriptStage::Global {
                        return;
                    }
                }
                Outcome::Pending | Outcome::Waiting => {
                    state.is_running = true;
                    state.is_waiting = outcome == Outcome::Waiting;
                    return;
                }
                Outcome::Fault(fault) => {
                    let positions = vm.calls().collect();
                    let mut record = state.record(io.now, fault, positions, Some(entry));
                    record.memory = state.memory_after(&fault, vm);
                    let content = state.content_after(vm);
                    if state.fail(record, content) {
                        state.stage = ScriptStage::Pause;
                        state.is_running = false;
                        vm.restart();
                    }
                    state.halt(io);
                    return;
                }
            }
        }
    }
}

/// Loads the script of a group into a machine.
fn load_program<P: Profile, C: ByteCode + From<KeptImage>, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    context: &GroupContext,
) -> Result<(), ImageError> {
    vm.set_network_capacity(context.sizes);
    let has_function = |hash| context.function(hash).is_some();
    vm.load_limited(Image::new(context.image.into()), context.slots, has_function)
}

/// Sets globals to their numbers of the scenario, after the global code. An integer becomes a float
/// if the global code assigned one, so that the values of a sweep have one type.
#[cold] // Once for each start of a script.
fn set_initial_globals<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    globals: &[(u16, ScriptNumber)],
) {
    for (global, number) in globals {
        let now = vm.global(*global).and_then(ScriptNumber::from_value);
        let number = match (now, *number) {
            (Some(ScriptNumber::Float(_)), ScriptNumber::Int(number)) => {
                ScriptNumber::Float(number as f32)
            }
            (_, number) => number,
        };
        vm.set_global(*global, number.value());
    }
}

/// Sets globals after a part of the script. After `init`, a global that holds something other than
/// a number stays as it is.
#[cold] // Few robots have any.
fn set_globals<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    settings: &[PendingSetting],
) {
    for PendingSetting { after, global, number } in settings {
        let now = vm.global(*global);
        let is_free = now.is_none_or(|now| now.is_nil() || ScriptNumber::from_value(now).is_some());
        if *after == ScriptStage::Global || is_free {
            vm.set_global(*global, number.value());
        }
    }
}

impl<P: Profile, C, I, O, const SLOTS: usize> Machine for Scripted<P, C, I, O, SLOTS>
where
    C: ByteCode + From<KeptImage> + 'static,
    I: InQueue + Clone + 'static,
    O: OutQueue + Clone + 'static,
    Self: Send,
{
    fn copy(&self) -> Box<dyn Machine + Send> {
        Box::new(self.clone())
    }

    fn bytes(&self, slots: usize) -> usize {
        // Slots of machines whose memory grows lie elsewhere.
        let is_growing = SLOTS == SLOTS_MAX;
        let elsewhere = if is_growing { slots.saturating_sub(self.vm.free_slots()) } else { 0 };
        size_of_val(self) + SLOT_BYTES * elsewhere
    }

    fn add_to(&self, digest: &mut Digest) {
        self.vm.hash_state(digest);
        self.inbox.add_to(digest);
        self.outbox.add_to(digest);
    }

    fn tick(&mut self, state: &mut RobotContext, io: &mut Io<'_>) {
        if !state.questions.is_empty() {
            self.answer(state, io);
        }
        self.advance(state, io);
        // The step that a question has waited for may be done.
        if !state.questions.is_empty() {
            self.answer(state, io);
        }
    }

    fn has_unsent(&self) -> bool {
        self.has_unsent
    }

    fn is_within_message(&self) -> bool {
        self.outbox.is_within_message()
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        let length = self.outbox.pop(frame);
        self.has_unsent = !self.outbox.is_empty();
        length
    }

    fn dropped(&self) -> [u16; 2] {
        [self.inbox.counters().dropped, self.outbox.dropped()]
    }

    fn counters(&self) -> NetworkCounters {
        let counters = self.vm.counters();
        let incomplete = counters.incomplete.saturating_add(self.inbox.counters().incomplete);
        NetworkCounters { incomplete, ..counters }
    }

    fn unwanted(&self) -> u16 {
        self.inbox.counters().unwanted
    }

    fn global(&self, number: u16, keys: &[VariableContent]) -> VariableContent {
        let global = self.vm.global(number);
        content(keys.iter().fold(global, |table, key| self.vm.field(table?, value(*key))))
    }

    fn number(&self, global: u16) -> Option<ScriptNumber> {
        self.vm.global(global).and_then(ScriptNumber::from_value)
    }

    fn set(&mut self, global: u16, number: ScriptNumber) {
        self.vm.set_global(global, number.value());
    }

    fn stigmergy(&self, number: u16, key: VariableContent) -> VariableContent {
        content(self.vm.replica(number, value(key)))
    }

    fn free_slots(&self) -> usize {
        self.vm.free_slots()
    }

    fn neighbors(&self) -> usize {
        self.vm.neighbor_count()
    }

    fn inspect(&self, symbols: Option<&Symbols>, limits: Limits) -> Inspection {
        let queue = |(capacity, frames)| -> InspectedQueue {
            let frames: Vec<Vec<u8>> = frames;
            InspectedQueue::of(&self.vm, symbols, capacity, frames)
        };
        let queues =
            Queues { inbox: queue(self.inbox.waiting()), outbox: queue(self.outbox.waiting()) };
        Inspection { queues: Some(queues), ..inspect(&self.vm, symbols, limits) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest machine that ships is small, because a world of 20,000 robots then fits the
    /// cache better.
    #[test]
    fn machines_are_small() {
        let vm = size_of::<Vm<Tiny, &[u8], { shipped::SMALLEST_SLOTS }>>();
        assert!(vm <= 2200, "{vm} bytes");
    }
}
