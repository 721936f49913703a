//! The benchmark program of every chip: it loads an image, runs its steps, and marks the counted parts.
//!
//! # Principles
//! 1. **One program for all scripts.** `cargo xtask bench` compiles a script and puts the image
//!    into the linked program, in place of [`ROOM`] bytes of zeros. The compiler of the program
//!    therefore cannot know the script, and every script runs the same machine code.
//! 2. **The program does not count.** It only [marks](Mark) places, and the emulator or debugger
//!    that runs it counts. Marks have a cost themselves, so the first measurement is of an empty
//!    section.
//! 3. **The machine is the same as on the robots**, with every check on: it has as many slots as that of the
//!    robot with the chip ([`slots`]), on which the compiler's code depends. The memory that it may use is
//!    that of robots/bench.toml on every chip, so that collections happen at the same places. Images that
//!    measure single instructions may use all slots of a machine with many, so that no collection happens.
//!
//! # Neighbors
//! Before each step, [`NEIGHBORS`] robots are in sight, with ids from 2 on, at 10 mm, 20 mm and so
//! on. If the script has broadcast an integer, each of them sends an integer on the same topic: the
//! first 0, the next 1 and so on.

#![no_std]
#![forbid(unsafe_code)]

mod script;

pub use script::{ALL_SLOTS, HEADER, ROOM, SYMBOL, header, split};

use bittybuzz_vm_core::number::{Number, Profile};
use bittybuzz_vm_core::{
    Axis, Buffer, ByteCode, CallArguments, Entry, Host, Image, Outcome, Places, Refusal, Reply,
    RobotFault, Sighting, Sizes, Value, Vm,
};

#[allow(dead_code, reason = "it is generated for firmware")]
mod robot {
    include!(concat!(env!("OUT_DIR"), "/robot.rs"));
}

/// The slots of the robots' machines, from their robot files.
pub mod slots {
    include!(concat!(env!("OUT_DIR"), "/slots.rs"));
}

/// The memory that the machine may take on the smallest chip, its queues of messages included.
pub const MEMORY: usize = robot::MEMORY;

/// The machine's capacities for neighbors, stigmergy entries and swarms.
const SIZES: Sizes = Sizes {
    neighbors: robot::NEIGHBORS as u8,
    bearings: robot::BEARINGS != 0,
    entries: robot::STIGMERGY_ENTRIES as Places,
    swarms: robot::SWARMS as u8,
};

/// The number of robots in sight.
pub const NEIGHBORS: u8 = 8;

/// The id of the robot under test.
const ROBOT_ID: u16 = 1;
/// The id of the first of its neighbors.
const FIRST_NEIGHBOR: u16 = 2;

/// Instructions of a slice.
const BUDGET: u16 = u16::MAX;

/// The number of slices after which an entry is aborted: several times the need of the longest
/// script.
const SLICES_MAX: u16 = 200;

/// A mark that the program sends to its caller. The numbers are the protocol between the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mark {
    /// Counting begins.
    Begin = 1,
    /// Counting ends.
    End = 2,
    /// The program ends. The result is this integer.
    Integer = 3,
    /// The program ends. The result is a float, of which these are the binary32 bits.
    Float = 4,
    /// The program ends. The result has the type with this number.
    Other = 5,
    /// The program ends: the image is refused.
    Refused = 6,
    /// The program ends: a fault with this number.
    Fault = 7,
    /// The program ends: an entry takes too long.
    Endless = 8,
}

impl Mark {
    /// Returns the mark with this number.
    pub fn numbered(number: u32) -> Option<Mark> {
        use Mark::{Begin, End, Endless, Fault, Float, Integer, Other, Refused};
        let all = [Begin, End, Integer, Float, Other, Refused, Fault, Endless];
        all.into_iter().find(|mark| *mark as u32 == number)
    }
}

/// The connection from the program to its caller.
pub trait Meter {
    /// Sends a mark. The AVR sends only the lower half of the value; for a float only the upper
    /// half, because the lower half is zero there.
    fn mark(&mut self, mark: Mark, value: u32);

    /// Counts the cost of `work`.
    #[inline(always)]
    fn count<R>(&mut self, work: impl FnOnce() -> R) -> R {
        self.mark(Mark::Begin, 0);
        let result = work();
        self.mark(Mark::End, 0);
        result
    }
}

/// Counts, in this order: an empty section; verifying and loading the image; the second step; the
/// third step. Then reports the value of the global with that number. With [`ALL_SLOTS`] in the number the
/// script may use all slots of the machine, otherwise those of a Kilobot.
pub fn run<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    image: Image<C>,
    global: u16,
    meter: &mut impl Meter,
) {
    vm.set_network_capacity(SIZES);
    vm.set_robot_id(ROBOT_ID, 0);
    let slots = if global & ALL_SLOTS == 0 { robot::SLOTS } else { SLOTS };
    let (mark, value) = match count_all(vm, image, slots, meter) {
        Ok(()) => result(vm.global(global & !ALL_SLOTS).unwrap_or(Value::nil())),
        Err(failure) => failure,
    };
    meter.mark(mark, value);
}

fn count_all<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    image: Image<C>,
    slots: usize,
    meter: &mut impl Meter,
) -> Result<(), (Mark, u32)> {
    meter.count(|| ());
    meter.count(|| load(vm, image, slots)).map_err(|()| (Mark::Refused, 0))?;
    // Measuring distances is the task of the link, so they are prepared outside of the counted
    // work.
    let distances = core::array::from_fn(|number| Value::float_from_int(10 * (number as i32 + 1)));
    let frames = [P::Frame::ZERO; NEIGHBORS as usize];
    let mut robot = BenchHost { frames, length: 0, coming: 0, distances };
    enter(vm, Entry::Global, &mut robot)?;
    enter(vm, Entry::Init, &mut robot)?;
    approach(vm, &mut robot);
    enter(vm, Entry::Step, &mut robot)?;
    for _ in 0..2 {
        approach(vm, &mut robot);
        meter.count(|| enter(vm, Entry::Step, &mut robot))?;
    }
    Ok(())
}

/// Brings all neighbors into sight, with their messages waiting.
fn approach<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    robot: &mut BenchHost<P>,
) {
    for (robot, distance) in (FIRST_NEIGHBOR..).zip(&robot.distances) {
        vm.add_neighbor(robot, &Sighting::at(*distance), u8::MAX);
    }
    robot.coming = NEIGHBORS;
    let Some(sent) = robot.frames.first().copied() else { return };
    for (number, frame) in (0..).zip(&mut robot.frames) {
        *frame = sent;
        // Sets the sender, and the integer after the topic (docs/wire-format.md).
        if let [_, low, high, rest @ ..] = frame.as_mut() {
            [*low, *high] = (FIRST_NEIGHBOR + u16::from(number)).to_le_bytes();
            if let Some(byte) = rest.get_mut(P::WORD_BYTES) {
                *byte = number;
            }
        }
    }
}

#[inline(never)]
fn load<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    image: Image<C>,
    slots: usize,
) -> Result<(), ()> {
    vm.load_limited(image, slots, is_known).map_err(drop)
}

/// Returns true if the robot has this function. The search is not in a table, because the AVR would
/// keep the table in RAM.
fn is_known(function: u16) -> bool {
    matches!(function, robot::function::LED | robot::function::MOTORS)
}

/// Does the work of a robot at a tick. It is not inlined, so that there is one copy, as on a robot.
#[inline(never)]
fn enter<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &mut Vm<P, C, SLOTS>,
    entry: Entry,
    robot: &mut BenchHost<P>,
) -> Result<(), (Mark, u32)> {
    if !vm.begin(entry) {
        return Ok(());
    }
    for _ in 0..SLICES_MAX {
        match vm.run(robot, BUDGET) {
            Outcome::Pending => {}
            Outcome::Done => return Ok(()),
            Outcome::Fault(fault) => return Err((Mark::Fault, fault.code as u32)),
            // No function of this robot waits.
            Outcome::Waiting => break,
        }
    }
    Err((Mark::Endless, 0))
}

fn result<P: Profile>(value: Value<P>) -> (Mark, u32) {
    match value.as_number() {
        Some(Number::Int(integer)) => (Mark::Integer, integer as u32),
        Some(Number::Float(float)) => (Mark::Float, float.to_bits()),
        None => (Mark::Other, value.type_of() as u32),
    }
}

/// A robot whose functions do nothing, with the frames of its neighbors. It runs on chips without
/// an allocator, so it must cost less than the host of `bittybuzz-testkit`.
struct BenchHost<P: Profile> {
    /// The messages of the neighbors: the first one has the script's last broadcast.
    frames: [P::Frame; NEIGHBORS as usize],
    /// The length of the last broadcast, 0 if there was none.
    length: usize,
    /// The number of neighbors that still have to send the broadcast.
    coming: u8,
    /// The distances of the neighbors, floats in mm.
    distances: [Value<P>; NEIGHBORS as usize],
}

impl<P: Profile> Host<P> for BenchHost<P> {
    #[inline]
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        _: CallArguments<'_, P, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<P>, RobotFault> {
        // Loading has accepted the same functions.
        if is_known(function) {
            Ok(Reply::Value(Value::nil()))
        } else {
            Err(RobotFault::Refused(Refusal::NotBuiltIn))
        }
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: CallArguments<'_, P, C, SLOTS>) {}

    fn delay_is_over(&mut self, _: i32, _: bool) -> bool {
        true
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        if self.length == 0 || self.coming == 0 {
            return None;
        }
        let number = NEIGHBORS - self.coming;
        self.coming -= 1;
        let sent = self.frames.get(usize::from(number))?;
        frame.get_mut(..self.length)?.copy_from_slice(sent.as_ref().get(..self.length)?);
        *sighting = Sighting::at(*self.distances.get(usize::from(number))?);
        Some(self.length)
    }

    fn send(&mut self, frame: &[u8]) {
        self.length = frame.len();
        if let Some(sent) = self.frames.first_mut() {
            for (to, from) in sent.as_mut().iter_mut().zip(frame) {
                *to = *from;
            }
        }
    }
}
