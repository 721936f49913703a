//! A robot that runs a script: the virtual machine with the sizes that the robot has, and its host.

mod call;
mod crazyflie;
mod kilobot;
mod log;
mod platform;
mod zooid;

use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{
    Entry, Fault, Image, ImageError, Network, Outcome, SwarmMemory, Value, Vm,
};

use crate::engine::{Actuators, Brain, Flight, Io, KilobotMotors, Stream, Wheels};
use crate::scenario::Body;

use super::setup::Cast;
use crazyflie::Pilot;
pub use kilobot::Duties;
pub use log::{LogLine, Piece};
use platform::Platform;

/// Slots of the machines, at least as many as the robots' files say.
pub const KILOBOT_SLOTS: usize = 350;
pub const ZOOID_SLOTS: usize = 426;
pub const CRAZYFLIE_SLOTS: usize = 481;

/// What the robots remember of others: neighbours, their bearings, entries, swarms, bytes of a frame, of a message in fragments.
type KilobotMemory = SwarmMemory<Tiny, 15, 0, 4, 8, 10, 48>;
type ZooidMemory = SwarmMemory<Tiny, 10, 10, 4, 8, 25, 168>;
type CrazyflieMemory = SwarmMemory<Full, 10, 10, 4, 8, 49, 360>;

type Script<'p, P, const SLOTS: usize, N> = Box<Vm<P, &'p [u8], SLOTS, N>>;

/// A virtual machine of one of the robots.
enum Machine<'p> {
    Kilobot(Script<'p, Tiny, KILOBOT_SLOTS, KilobotMemory>),
    Zooid(Script<'p, Tiny, ZOOID_SLOTS, ZooidMemory>),
    Crazyflie(Script<'p, Full, CRAZYFLIE_SLOTS, CrazyflieMemory>),
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
}

/// A script that has stopped with a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultRecord {
    /// Tick in which it was.
    pub tick: u64,
    /// What happened.
    pub fault: Fault,
    /// Positions in the code, innermost first.
    pub positions: Vec<u16>,
    /// What the robot had called.
    pub entry: Entry,
    /// What the robot function expects that refused its arguments.
    pub refusal: Option<String>,
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
    /// Milliseconds at which the running `delay` is over.
    awake: u64,
    pilot: Pilot,
    /// Of `rand_bbz`.
    chance: Stream,
    /// Frames that the link could not take.
    pub dropped: u32,
    pub logged: Vec<LogLine>,
    pub fault: Option<Box<FaultRecord>>,
    refusal: Option<String>,
}

impl<'p> Robot<'p> {
    /// A robot of that id that has just been switched on.
    pub fn new(cast: &'p Cast<'p>, id: u16, seed: u32) -> Result<Self, ImageError> {
        let machine = match cast.body {
            Body::Kilobot => Machine::Kilobot(load(cast, id, seed)?),
            Body::Zooid => Machine::Zooid(load(cast, id, seed)?),
            Body::Crazyflie => Machine::Crazyflie(load(cast, id, seed)?),
        };
        let state = State {
            cast,
            stage: Stage::Global,
            is_running: false,
            awake: 0,
            pilot: Pilot::default(),
            chance: Stream::for_brain(u64::from(seed), id),
            dropped: 0,
            logged: Vec::new(),
            fault: None,
            refusal: None,
        };
        Ok(Robot { machine, state })
    }

    /// What it is.
    pub fn state(&self) -> &State<'p> {
        &self.state
    }

    /// Takes what it has logged.
    pub fn take_log(&mut self) -> Vec<LogLine> {
        std::mem::take(&mut self.state.logged)
    }

    /// A global of its script.
    pub fn global(&self, number: u16) -> Content {
        match &self.machine {
            Machine::Kilobot(vm) => content(vm.global(number)),
            Machine::Zooid(vm) => content(vm.global(number)),
            Machine::Crazyflie(vm) => content(vm.global(number)),
        }
    }
}

impl Robot<'_> {
    /// An entry of a stigmergy, as this robot knows it.
    pub fn stigmergy(&self, number: u16, key: Content) -> Content {
        match &self.machine {
            Machine::Kilobot(vm) => content(vm.replica(number, value(key))),
            Machine::Zooid(vm) => content(vm.replica(number, value(key))),
            Machine::Crazyflie(vm) => content(vm.replica(number, value(key))),
        }
    }

    /// How many neighbours it has.
    pub fn neighbors(&self) -> usize {
        match &self.machine {
            Machine::Kilobot(vm) => vm.neighbor_count(),
            Machine::Zooid(vm) => vm.neighbor_count(),
            Machine::Crazyflie(vm) => vm.neighbor_count(),
        }
    }
}

/// What a variable holds, as far as it can be seen from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Content {
    Nil,
    Number(f64),
    /// The number of a string.
    Text(u16),
    Other,
}

fn content<P: Profile>(value: Option<Value<P>>) -> Content {
    let Some(value) = value.filter(|value| !value.is_nil()) else { return Content::Nil };
    if let Some(integer) = value.as_int() {
        return Content::Number(f64::from(integer));
    }
    match (value.as_f32(), value.as_string()) {
        (Some(float), _) => Content::Number(f64::from(float)),
        (None, Some(number)) => Content::Text(number),
        (None, None) => Content::Other,
    }
}

/// A key of a stigmergy.
fn value<P: Profile>(key: Content) -> Value<P> {
    match key {
        Content::Number(number) => Value::int(number as i32),
        Content::Text(number) => Value::string(number),
        Content::Nil | Content::Other => Value::nil(),
    }
}

fn load<'p, P: Profile, const SLOTS: usize, N: Network<P>>(
    cast: &Cast<'p>,
    id: u16,
    seed: u32,
) -> Result<Script<'p, P, SLOTS, N>, ImageError> {
    let mut vm: Script<'p, P, SLOTS, N> = Box::new(Vm::new());
    vm.load_limited(Image::new(cast.image), cast.slots, |hash| cast.has_function(hash))?;
    vm.identify(id, seed);
    Ok(vm)
}

impl Brain for Robot<'_> {
    fn tick(&mut self, io: &mut Io<'_>) {
        match &mut self.machine {
            Machine::Kilobot(vm) => drive(vm, &mut self.state, io, KILOBOT_BUDGET),
            Machine::Zooid(vm) => drive(vm, &mut self.state, io, BUDGET),
            Machine::Crazyflie(vm) => drive(vm, &mut self.state, io, BUDGET),
        }
        if let Actuators::Crazyflie(flight) = &mut io.actuators {
            **flight = self.state.pilot.fly(io.sensors.estimate());
        }
    }
}

/// Runs a tick: global code and `init` in the first, then a step in each, unless one takes longer.
fn drive<P: Profile, const SLOTS: usize, N: Network<P>>(
    vm: &mut Vm<P, &[u8], SLOTS, N>,
    state: &mut State<'_>,
    io: &mut Io<'_>,
    budget: u16,
) {
    if state.fault.is_some() {
        return;
    }
    let mut platform = Platform { io, heard: 0, state };
    loop {
        let stage = platform.state.stage;
        let entry = match stage {
            Stage::Global => Entry::Global,
            Stage::Init => Entry::Init,
            Stage::Step => Entry::Step,
        };
        let is_running = platform.state.is_running || vm.begin(entry);
        let outcome = if is_running { vm.run(&mut platform, budget) } else { Outcome::Done };
        let state = &mut *platform.state;
        match outcome {
            Outcome::Done => {
                state.is_running = false;
                match stage {
                    Stage::Global => state.stage = Stage::Init,
                    Stage::Init => {
                        state.stage = Stage::Step;
                        return;
                    }
                    Stage::Step => return,
                }
            }
            Outcome::Pending | Outcome::Waiting => {
                state.is_running = true;
                return;
            }
            Outcome::Fault(fault) => {
                let record = FaultRecord {
                    tick: platform.io.now,
                    fault,
                    positions: vm.calls().collect(),
                    entry,
                    refusal: state.refusal.take(),
                };
                state.fault = Some(Box::new(record));
                state.cast.note();
                halt(&mut platform.io.actuators, &mut state.pilot);
                return;
            }
        }
    }
}

/// What a robot does whose script has stopped: its motors lose power.
fn halt(actuators: &mut Actuators<'_>, pilot: &mut Pilot) {
    match actuators {
        Actuators::Kilobot(motors) => **motors = KilobotMotors::default(),
        Actuators::Zooid(wheels) => **wheels = Wheels::default(),
        Actuators::Crazyflie(flight) => {
            *pilot = Pilot::default();
            **flight = Flight::Off;
        }
    }
}
