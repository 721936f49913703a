//! What the benchmark program of every chip does: loads an image, runs its steps, and says where to count.
//!
//! # Principles
//! 1. **One program for all scripts.** `cargo xtask bench` compiles a script and puts the image into the linked program,
//!    in place of [`ROOM`] bytes of zeros. So the compiler of the program cannot know the script, and every script runs the
//!    same machine code.
//! 2. **The program does not count**, whoever runs it does: the program only [marks](Mark) where. Marks cost something, so
//!    the first thing counted is nothing.
//! 3. **The machine is the robots' own**, every check on; its sizes are those of robots/bench.toml.
//!
//! # What it will not do
//! Neighbours and messages: the machine has none yet.

#![no_std]
#![forbid(unsafe_code)]

mod script;

pub use script::{HEADER, ROOM, SYMBOL, header, split};

use bittybuzz_vm_core::number::{Number, Profile};
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Host, Image, Outcome, Refusal, Reply, RobotFault, Value, Vm,
};

#[allow(dead_code, reason = "it is generated for firmware")]
mod robot {
    include!(concat!(env!("OUT_DIR"), "/robot.rs"));
}

/// What the machine may take on the smallest chip: everything, and what of it is for parts that it does not have yet.
pub const MEMORY: [usize; 2] = [robot::MEMORY, robot::SWARM_MEMORY];

/// The machine under test.
pub type Machine<P, C> = Vm<P, C, { robot::SLOTS }>;

/// The id of the robot under test.
const ROBOT_ID: u16 = 1;

/// Budget of a slice.
const BUDGET: u16 = u16::MAX;

/// After how many slices an entry is given up: several times what the longest script needs.
const MOST_SLICES: u16 = 200;

/// What the program says to whoever runs it. Its numbers are the protocol between the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mark {
    /// Counting begins.
    Begin = 1,
    /// Counting ends.
    End = 2,
    /// The end. The result is this integer.
    Integer = 3,
    /// The end. The result is a float; its binary32 bits.
    Float = 4,
    /// The end. The result is of a type with this number.
    Other = 5,
    /// The end: the image is refused.
    Refused = 6,
    /// The end: a fault with this number.
    Fault = 7,
    /// The end: an entry takes too long.
    Endless = 8,
}

impl Mark {
    /// The mark with this number.
    pub fn numbered(number: u32) -> Option<Mark> {
        use Mark::{Begin, End, Endless, Fault, Float, Integer, Other, Refused};
        let all = [Begin, End, Integer, Float, Other, Refused, Fault, Endless];
        all.into_iter().find(|mark| *mark as u32 == number)
    }
}

/// The way from the program to whoever runs it.
pub trait Meter {
    /// Says something. On the AVR the upper half of the value gets lost.
    fn mark(&mut self, mark: Mark, value: u32);

    /// Has it counted what `work` takes.
    #[inline(always)]
    fn count<R>(&mut self, work: impl FnOnce() -> R) -> R {
        self.mark(Mark::Begin, 0);
        let result = work();
        self.mark(Mark::End, 0);
        result
    }
}

/// Counts in this order: nothing; verifying and loading the image; the second step; the third step. Then tells the
/// value of the global of that number.
pub fn run<P: Profile, C: ByteCode>(
    vm: &mut Machine<P, C>,
    image: Image<C>,
    global: u16,
    meter: &mut impl Meter,
) {
    vm.identify(ROBOT_ID, 0);
    let (mark, value) = match count_all(vm, image, meter) {
        Ok(()) => result(vm.global(global).unwrap_or(Value::nil())),
        Err(failure) => failure,
    };
    meter.mark(mark, value);
}

fn count_all<P: Profile, C: ByteCode>(
    vm: &mut Machine<P, C>,
    image: Image<C>,
    meter: &mut impl Meter,
) -> Result<(), (Mark, u32)> {
    meter.count(|| ());
    meter.count(|| load(vm, image)).map_err(|()| (Mark::Refused, 0))?;
    enter(vm, Entry::Global)?;
    enter(vm, Entry::Init)?;
    enter(vm, Entry::Step)?;
    meter.count(|| enter(vm, Entry::Step))?;
    meter.count(|| enter(vm, Entry::Step))
}

#[inline(never)]
fn load<P: Profile, C: ByteCode>(vm: &mut Machine<P, C>, image: Image<C>) -> Result<(), ()> {
    vm.load(image, is_known).map_err(drop)
}

/// Whether the robot has this function. Not a search in a table, which the AVR would keep in RAM.
fn is_known(function: u16) -> bool {
    matches!(function, robot::function::LED | robot::function::MOTORS)
}

/// What a robot does at a tick. Not inlined, so that there is one copy, as in a robot.
#[inline(never)]
fn enter<P: Profile, C: ByteCode>(vm: &mut Machine<P, C>, entry: Entry) -> Result<(), (Mark, u32)> {
    if !vm.begin(entry) {
        return Ok(());
    }
    for _ in 0..MOST_SLICES {
        match vm.run(&mut Robot, BUDGET) {
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

/// A robot whose functions do nothing.
struct Robot;

impl<P: Profile> Host<P> for Robot {
    #[inline]
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        _: Arguments<'_, P, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<P>, RobotFault> {
        // All that were known when the image was loaded.
        if is_known(function) {
            Ok(Reply::Value(Value::nil()))
        } else {
            Err(RobotFault::Refused(Refusal::NotBuiltIn))
        }
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: Arguments<'_, P, C, SLOTS>) {}

    fn delay_is_over(&mut self, _: i32, _: bool) -> bool {
        true
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }
}
