//! A robot that runs a script: the virtual machine with the sizes that the robot has, and its host.

mod call;
mod content;
mod crazyflie;
mod faults;
mod kilobot;
mod log;
mod platform;
mod zooid;

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_comms::trace::Unused;
use bittybuzz_robot_spec::{OnFault, Profile as NumberProfile};
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Counters, Entry, Fault, FaultCode, Image, ImageError, Outcome, Vm};

use crate::engine::{Brain, Io, Sighting, Stream};
use crate::robots::crazyflie::Flight;
use crate::scenario::Body;

use super::setup::Cast;
pub use content::Content;
use content::{content, value};
use crazyflie::Pilot;
use faults::Faults;
pub use faults::{Consequence, FaultCounts, FaultRecord};
pub use kilobot::Duties;
pub use log::{LogLine, Piece};
use platform::{Deck, Platform};

/// Slots of the machines, for scripts and for what is remembered of others, and lengths of the queues: as the robots' files say.
#[allow(dead_code, reason = "there are robots that the world does not have")]
mod sizes {
    include!(concat!(env!("OUT_DIR"), "/sizes.rs"));
}
use sizes::{CRAZYFLIE_IN_QUEUE, CRAZYFLIE_OUT_QUEUE, KILOBOT_IN_QUEUE, KILOBOT_OUT_QUEUE};
pub use sizes::{CRAZYFLIE_SLOTS, KILOBOT_SLOTS, ZOOIDS_SLOTS};
use sizes::{ZOOIDS_IN_QUEUE, ZOOIDS_OUT_QUEUE};

type Kilobot<'p> =
    Scripted<'p, Tiny, KILOBOT_SLOTS, TINY_FRAME, KILOBOT_IN_QUEUE, KILOBOT_OUT_QUEUE>;
type Zooid<'p> = Scripted<'p, Tiny, ZOOIDS_SLOTS, TINY_FRAME, ZOOIDS_IN_QUEUE, ZOOIDS_OUT_QUEUE>;
type TinyCrazyflie<'p> =
    Scripted<'p, Tiny, CRAZYFLIE_SLOTS, TINY_FRAME, CRAZYFLIE_IN_QUEUE, CRAZYFLIE_OUT_QUEUE>;
type Crazyflie<'p> =
    Scripted<'p, Full, CRAZYFLIE_SLOTS, FULL_FRAME, CRAZYFLIE_IN_QUEUE, CRAZYFLIE_OUT_QUEUE>;

/// A virtual machine of one of the robots.
enum Machine<'p> {
    Kilobot(Box<Kilobot<'p>>),
    Zooid(Box<Zooid<'p>>),
    Crazyflie(Box<Crazyflie<'p>>),
    TinyCrazyflie(Box<TinyCrazyflie<'p>>),
    /// Its firmware, in an emulator: only what that tells is known.
    Elsewhere(Unused),
}

/// A virtual machine, and the frames that wait for it and for its link.
struct Scripted<
    'p,
    P: Profile,
    const SLOTS: usize,
    const FRAME: usize,
    const IN: usize,
    const OUT: usize,
> {
    vm: Vm<P, &'p [u8], SLOTS>,
    inbox: Inbox<P, Sighting, FRAME, IN>,
    outbox: Outbox<P, FRAME, OUT>,
    /// A frame may be in the inbox. Most ticks there is none, and the queue's memory need not be looked at.
    has_mail: bool,
    /// A frame is in the outbox.
    has_unsent: bool,
}

/// Instructions that a robot executes in a tick, about: an instruction takes some 150 cycles of the ATmega328P at 8 MHz,
/// and 80 of a Cortex-M0 at 48 MHz. More are not executed in one tick on the Crazyflie either, so that a script that never
/// ends does not stop the world.
const KILOBOT_BUDGET: u16 = 5_000;
const BUDGET: u16 = 60_000;

/// What the script is about to run, or is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Global,
    Init,
    Step,
    /// The pause after a fault: steps that handle messages only.
    Pause,
}

/// A robot and its script.
pub struct Robot<'p> {
    machine: Machine<'p>,
    state: State<'p>,
}

/// Everything of the robot but the machine.
pub struct State<'p> {
    cast: &'p Cast<'p>,
    stage: Stage,
    /// The stage has begun and is not yet done.
    is_running: bool,
    /// Steps that were completed.
    pub steps: u32,
    /// Milliseconds at which the running `delay` is over.
    awake: u64,
    pilot: Pilot,
    /// mV of the battery, where that was said.
    battery: Option<u16>,
    /// Of `rand_bbz`.
    chance: Stream,
    pub logged: Vec<LogLine>,
    faults: Option<Box<Faults>>,
    refusal: Option<String>,
}

impl<'p> State<'p> {
    fn new(cast: &'p Cast<'p>, id: u16, seed: u32) -> Self {
        State {
            cast,
            stage: Stage::Global,
            is_running: false,
            steps: 0,
            awake: 0,
            pilot: Pilot::default(),
            battery: None,
            chance: Stream::for_brain(u64::from(seed), id),
            logged: Vec::new(),
            faults: None,
            refusal: None,
        }
    }

    /// Returns true while its script does not run because of a fault: in the pause after it, or until power-on.
    pub fn is_faulted(&self) -> bool {
        self.faults.as_ref().is_some_and(|faults| faults.is_halted())
    }

    /// The places of its faults, by the time of the first fault at each.
    pub fn fault_places(&self) -> &[FaultRecord] {
        self.faults.as_ref().map_or(&[], |faults| faults.places())
    }

    /// The numbers of its faults since power-on.
    pub fn fault_counts(&self) -> FaultCounts {
        self.faults.as_ref().map_or_else(FaultCounts::default, |faults| faults.counts())
    }

    fn faults(&mut self) -> &mut Faults {
        self.faults.get_or_insert_default()
    }

    /// Describes a fault that happens now. Its consequence is decided later.
    fn record(
        &mut self,
        tick: u64,
        fault: Fault,
        positions: Vec<u16>,
        entry: Option<Entry>,
    ) -> FaultRecord {
        let refusal = self.refusal.take();
        let consequence = Consequence::Contained;
        FaultRecord { tick, fault, positions, entry, refusal, consequence, count: 1 }
    }

    /// A fault has stopped the script. Returns true if it starts again after a pause.
    fn fail(&mut self, record: FaultRecord) -> bool {
        let is_final =
            record.fault.code == FaultCode::AssertFailed || self.cast.on_fault == OnFault::Stop;
        match is_final {
            true => self.faults().stop(record),
            false => self.faults().pause(record),
        }
        !is_final
    }

    /// The script begins anew after a pause.
    fn start(&mut self, led: &mut u8) {
        self.faults().start();
        self.stage = Stage::Global;
        self.pilot.start();
        *led = 0;
    }
}

impl<'p> Robot<'p> {
    /// A robot of that id that has just been switched on.
    pub fn new(cast: &'p Cast<'p>, id: u16, seed: u32) -> Result<Self, ImageError> {
        let machine = match cast.body {
            Body::Kilobot => Machine::Kilobot(load(cast, id, seed)?),
            Body::Zooid => Machine::Zooid(load(cast, id, seed)?),
            Body::Crazyflie if cast.profile == NumberProfile::Tiny => {
                Machine::TinyCrazyflie(load(cast, id, seed)?)
            }
            Body::Crazyflie => Machine::Crazyflie(load(cast, id, seed)?),
        };
        Ok(Robot { machine, state: State::new(cast, id, seed) })
    }

    /// A robot of that id that runs its firmware.
    pub fn elsewhere(cast: &'p Cast<'p>, id: u16) -> Self {
        Robot { machine: Machine::Elsewhere(Unused::default()), state: State::new(cast, id, 0) }
    }

    /// Its firmware tells what messages came to nothing, all of them since power-on.
    pub fn has_missed(&mut self, unused: Unused) {
        if let Machine::Elsewhere(known) = &mut self.machine {
            *known = unused;
        }
        if unused.messages.failed > 0 {
            self.state.faults().has_contained(unused.messages.failed);
        }
    }

    /// Its script has logged a line.
    pub fn has_logged(&mut self, line: LogLine) {
        self.state.logged.push(line);
        self.state.cast.note();
    }

    /// Its script has completed a step: after a fault it has started again.
    pub fn has_stepped(&mut self) {
        self.state.steps = self.state.steps.saturating_add(1);
        if let Some(faults) = &mut self.state.faults {
            if faults.is_halted() {
                faults.start();
            }
            faults.step();
        }
    }

    /// Its script has stopped. Only its next completed step shows that it has started again.
    pub fn has_failed(&mut self, tick: u64, fault: Fault) {
        let record = self.state.record(tick, fault, vec![fault.position], None);
        self.state.fail(record);
    }

    /// Its script has stopped. Its firmware reports a restart.
    pub fn has_stopped(&mut self, tick: u64, fault: Fault, positions: Vec<u16>) {
        let record = self.state.record(tick, fault, positions, None);
        self.state.faults().stop(record);
    }

    /// A fault has ended a listener or a handler of its script.
    pub fn has_contained(&mut self, tick: u64, fault: Fault, positions: Vec<u16>) {
        let record = self.state.record(tick, fault, positions, None);
        self.state.faults().contain(record);
    }

    /// A fault has ended a listener or a handler of its script, which is new if there was none at that place.
    pub fn has_contained_once(&mut self, tick: u64, fault: Fault) {
        let is_it = |place: &FaultRecord| {
            let known = (place.fault.position, place.fault.code, place.consequence);
            known == (fault.position, fault.code, Consequence::Contained)
        };
        if !self.state.fault_places().iter().any(is_it) {
            self.has_contained(tick, fault, vec![fault.position]);
        }
    }

    /// Its script, which has stopped, starts again after `pause` ticks; 0: it starts now.
    pub fn has_restarted(&mut self, pause: u16) {
        match pause {
            0 => self.state.faults().start(),
            _ => self.state.faults().has_paused(pause),
        }
    }

    /// What it is.
    pub fn state(&self) -> &State<'p> {
        &self.state
    }

    /// Frames that its queues had no room for, heard and to be sent.
    pub fn dropped(&self) -> [u16; 2] {
        match &self.machine {
            Machine::Kilobot(of) => of.dropped(),
            Machine::Zooid(of) => of.dropped(),
            Machine::Crazyflie(of) => of.dropped(),
            Machine::TinyCrazyflie(of) => of.dropped(),
            Machine::Elsewhere(unused) => unused.dropped,
        }
    }

    /// Messages that it could not use.
    pub fn counters(&self) -> Counters {
        match &self.machine {
            Machine::Kilobot(of) => of.vm.counters(),
            Machine::Zooid(of) => of.vm.counters(),
            Machine::Crazyflie(of) => of.vm.counters(),
            Machine::TinyCrazyflie(of) => of.vm.counters(),
            Machine::Elsewhere(unused) => unused.messages,
        }
    }

    /// Takes over what another robot has logged, and its battery.
    pub fn adopt(&mut self, other: &mut Self) {
        self.state.logged.append(&mut other.state.logged);
        self.state.battery = other.state.battery;
    }

    /// Its battery has so many mV from now on.
    pub fn has_battery(&mut self, millivolts: u16) {
        self.state.battery = Some(millivolts);
    }

    /// Takes what it has logged.
    pub fn take_log(&mut self) -> Vec<LogLine> {
        std::mem::take(&mut self.state.logged)
    }

    /// A global of its script, or what `keys` lead to in tables there.
    pub fn global(&self, number: u16, keys: &[Content]) -> Content {
        match &self.machine {
            Machine::Kilobot(of) => of.global(number, keys),
            Machine::Zooid(of) => of.global(number, keys),
            Machine::Crazyflie(of) => of.global(number, keys),
            Machine::TinyCrazyflie(of) => of.global(number, keys),
            Machine::Elsewhere(_) => Content::Nil,
        }
    }
}

impl Robot<'_> {
    /// An entry of a stigmergy, as this robot knows it.
    pub fn stigmergy(&self, number: u16, key: Content) -> Content {
        match &self.machine {
            Machine::Kilobot(of) => content(of.vm.replica(number, value(key))),
            Machine::Zooid(of) => content(of.vm.replica(number, value(key))),
            Machine::Crazyflie(of) => content(of.vm.replica(number, value(key))),
            Machine::TinyCrazyflie(of) => content(of.vm.replica(number, value(key))),
            Machine::Elsewhere(_) => Content::Nil,
        }
    }

    /// Slots of its script's memory that are free.
    pub fn free_slots(&self) -> usize {
        match &self.machine {
            Machine::Kilobot(of) => of.vm.free_slots(),
            Machine::Zooid(of) => of.vm.free_slots(),
            Machine::Crazyflie(of) => of.vm.free_slots(),
            Machine::TinyCrazyflie(of) => of.vm.free_slots(),
            Machine::Elsewhere(_) => 0,
        }
    }

    /// How many neighbours it has.
    pub fn neighbors(&self) -> usize {
        match &self.machine {
            Machine::Kilobot(of) => of.vm.neighbor_count(),
            Machine::Zooid(of) => of.vm.neighbor_count(),
            Machine::Crazyflie(of) => of.vm.neighbor_count(),
            Machine::TinyCrazyflie(of) => of.vm.neighbor_count(),
            Machine::Elsewhere(_) => 0,
        }
    }
}

type Loaded<'p, P, const SLOTS: usize, const FRAME: usize, const IN: usize, const OUT: usize> =
    Result<Box<Scripted<'p, P, SLOTS, FRAME, IN, OUT>>, ImageError>;

fn load<
    'p,
    P: Profile,
    const SLOTS: usize,
    const FRAME: usize,
    const IN: usize,
    const OUT: usize,
>(
    cast: &Cast<'p>,
    id: u16,
    seed: u32,
) -> Loaded<'p, P, SLOTS, FRAME, IN, OUT> {
    let (inbox, outbox) = (Inbox::new(Sighting::default()), Outbox::new());
    let mut scripted =
        Box::new(Scripted { vm: Vm::new(), inbox, outbox, has_mail: false, has_unsent: false });
    let vm = &mut scripted.vm;
    vm.equip(cast.sizes);
    vm.load_limited(Image::new(cast.image), cast.slots, |hash| cast.has_function(hash))?;
    vm.identify(id, seed);
    Ok(scripted)
}

impl Brain for Robot<'_> {
    fn tick(&mut self, io: &mut Io<'_>) {
        match &mut self.machine {
            Machine::Kilobot(of) => of.tick(&mut self.state, io, KILOBOT_BUDGET),
            Machine::Zooid(of) => of.tick(&mut self.state, io, BUDGET),
            Machine::Crazyflie(of) => of.tick(&mut self.state, io, BUDGET),
            Machine::TinyCrazyflie(of) => of.tick(&mut self.state, io, BUDGET),
            Machine::Elsewhere(_) => {}
        }
        let (now, here) = (io.milliseconds(), io.sensors.estimate());
        if self.state.cast.body == Body::Crazyflie
            && let Some(flight) = io.controls::<Flight>()
        {
            *flight = self.state.pilot.fly(here, now);
        }
    }

    fn has_frame(&self) -> bool {
        match &self.machine {
            Machine::Kilobot(of) => of.has_unsent,
            Machine::Zooid(of) => of.has_unsent,
            Machine::Crazyflie(of) => of.has_unsent,
            Machine::TinyCrazyflie(of) => of.has_unsent,
            Machine::Elsewhere(_) => false,
        }
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        match &mut self.machine {
            Machine::Kilobot(of) => of.next_frame(frame),
            Machine::Zooid(of) => of.next_frame(frame),
            Machine::Crazyflie(of) => of.next_frame(frame),
            Machine::TinyCrazyflie(of) => of.next_frame(frame),
            Machine::Elsewhere(_) => 0,
        }
    }
}

impl<P: Profile, const SLOTS: usize, const FRAME: usize, const IN: usize, const OUT: usize>
    Scripted<'_, P, SLOTS, FRAME, IN, OUT>
{
    fn global(&self, number: u16, keys: &[Content]) -> Content {
        let global = self.vm.global(number);
        content(keys.iter().fold(global, |table, key| self.vm.field(table?, value(*key))))
    }

    fn dropped(&self) -> [u16; 2] {
        [self.inbox.counters().dropped, self.outbox.counters().dropped]
    }

    fn tick(&mut self, state: &mut State<'_>, io: &mut Io<'_>, budget: u16) {
        if let Some(faults) = &mut state.faults {
            if faults.is_over() {
                return;
            }
            // A message that is being handled comes to its end first.
            if state.stage == Stage::Pause && faults.tick() && !state.is_running {
                state.start(io.led);
            }
        }
        for frame in io.inbox.iter() {
            self.inbox.push(frame.bytes, frame.sighting);
            self.has_mail = true;
        }
        self.run(state, io, budget);
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        // No frame of the machine is longer than the link's.
        let length = self.outbox.pop().map_or(0, |next| {
            frame.iter_mut().zip(&**next).for_each(|(to, from)| *to = *from);
            next.len()
        });
        self.has_unsent = !self.outbox.is_empty();
        length
    }

    /// Runs a tick: global code and `init` in the first, then a step in each, unless one takes longer. After a fault the
    /// ticks of the pause handle messages only, and the script begins anew.
    fn run(&mut self, state: &mut State<'_>, io: &mut Io<'_>, budget: u16) {
        let Scripted { vm, inbox, outbox, has_mail, has_unsent } = self;
        let mut platform =
            Platform { deck: Deck { io, state }, inbox, outbox, has_mail, has_unsent };
        loop {
            let stage = platform.deck.state.stage;
            let entry = match stage {
                Stage::Global => Entry::Global,
                Stage::Init => Entry::Init,
                Stage::Step | Stage::Pause => Entry::Step,
            };
            if !platform.deck.state.is_running {
                platform.outbox.begin_step();
            }
            let is_running = platform.deck.state.is_running || vm.begin(entry);
            let outcome = if is_running { vm.run(&mut platform, budget) } else { Outcome::Done };
            let Deck { io, state } = &mut platform.deck;
            match outcome {
                Outcome::Done => {
                    state.is_running = false;
                    if stage == Stage::Step && is_running {
                        state.steps = state.steps.saturating_add(1);
                        if let Some(faults) = &mut state.faults {
                            faults.step();
                        }
                    }
                    state.stage = match stage {
                        Stage::Global => Stage::Init,
                        Stage::Init | Stage::Step => Stage::Step,
                        Stage::Pause => Stage::Pause,
                    };
                    if stage != Stage::Global {
                        return;
                    }
                }
                Outcome::Pending | Outcome::Waiting => {
                    state.is_running = true;
                    return;
                }
                Outcome::Fault(fault) => {
                    let positions = vm.calls().collect();
                    let record = state.record(io.now, fault, positions, Some(entry));
                    if state.fail(record) {
                        state.stage = Stage::Pause;
                        state.is_running = false;
                        vm.restart();
                    }
                    match state.cast.body {
                        Body::Kilobot | Body::Zooid => io.halt(),
                        Body::Crazyflie => {
                            state.pilot.give_up(io.sensors.estimate(), io.milliseconds());
                        }
                    }
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A world of 20,000 robots fits the cache the better the smaller they are.
    #[test]
    fn robots_are_small() {
        let vm = size_of::<Vm<Tiny, &[u8], KILOBOT_SLOTS>>();
        assert!(vm <= 2200, "{vm} bytes");
        let kilobot = size_of::<Kilobot<'_>>() + size_of::<Robot<'_>>();
        assert!(kilobot <= 3000, "{kilobot} bytes");
        let crazyflie = size_of::<Vm<Full, &[u8], CRAZYFLIE_SLOTS>>();
        assert!(crazyflie <= 5120, "{crazyflie} bytes");
    }
}
