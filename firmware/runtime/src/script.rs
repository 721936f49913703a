//! The script's task: loads the image, runs the global code, `init()`, and `step()` ten times per
//! second.
//!
//! One task runs the virtual machine, next to those of the radio, the motors and the watchdog, on
//! one stack and one processor. It must therefore never run for long, and a script may do
//! anything.
//!
//! # Slices
//! The machine runs in slices of at most 500 µs, and the task yields after each. A slice ends by
//! the robot's clock, which the machine reads after every instruction that may take long. Ticks
//! that come while a step is still running are skipped and counted, never queued: a script that
//! is too slow becomes slower and does not fall behind.
//!
//! # Set-points
//! A robot function that moves the robot writes a set-point with the time until which it holds.
//! Each completed step renews it. When steps stop, for whatever reason, the motors' task stops
//! the motors.
//!
//! # Faults
//! A fault in a listener ends that call and is reported once per place. Any other fault stops the
//! script and the motors; after a pause ([`Restarts`]), which doubles up to a minute, the script
//! starts again with its global code. During the pause the robot sends beacons, merges and relays
//! as before, but no code of the script runs. A failed `assert` stops the script for good; so
//! does every fault if [`RobotHost::ON_FAULT_STOPS`].
//!
//! # Output
//! Log lines and faults become records after the slice in which they arose. Formatting and
//! transport never run inside the interpreter's loop.

use bittybuzz_comms::trace::{self, Unused};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Fault, FaultCode, Image, Outcome, Periods, Reply, Restarts,
    RobotFault, Sighting, Vm,
};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};

use crate::liveness::{BEAT, Pulse};
use crate::setpoint::HOLD;

mod bridge;
mod log;
mod ticks;

pub use bridge::Console;

use bridge::{Bridge, Places};
use log::Log;
use ticks::Ticks;

/// Longest time for which the script keeps the processor, a collection included.
pub const SLICE_MAX: Duration = Duration::from_micros(500);

/// µs after which a slice ends at the next look at the clock. The rest of [`SLICE_MAX`] is for the
/// work before that look: [`CHUNK`] short instructions, and a long one with a collection of a full
/// heap.
const SLICE: u16 = 150;

/// Short instructions between two looks at the clock. After a long one the machine looks at once.
const CHUNK: u16 = 50;

/// Looks at the clock in a slice, at most: it ends even if the clock should stand still.
const CHUNKS: u32 = 1000;

/// The pause of a script that prints much, for its readers: a debug probe takes some hundred bytes
/// in a ms.
const PAUSE: Duration = Duration::from_millis(2);

/// The period at which a waiting script tries again, unless it gave a time.
const POLL: Duration = Duration::from_millis(10);

/// The robot, as the script's task sees it.
pub trait RobotHost<P: Profile> {
    /// True if the robot has a trace. Else nothing is written down, and the code for it is left
    /// out.
    const HAS_TRACE: bool = true;

    /// Every fault stops the script for good.
    const ON_FAULT_STOPS: bool = false;

    /// Calls a robot function, as [`Host::call`](bittybuzz_vm_core::Host::call) says.
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
        console: &mut Console<'_>,
    ) -> Result<Reply<P>, RobotFault>;

    /// The position, as [`Host::position`](bittybuzz_vm_core::Host::position) says.
    fn position(&mut self, axis: Axis) -> Option<f32>;

    /// Returns the time in µs, modulo 65536. Asked after each long instruction: a robot that can read a timer says so.
    fn clock_us(&self) -> u16 {
        Instant::now().as_micros() as u16
    }

    /// Periods of beacons and advertisements, as [`Host::periods`](bittybuzz_vm_core::Host::periods) says.
    fn periods(&self) -> Periods {
        Periods::DEFAULT
    }

    /// The oldest frame that waits, as [`Host::receive`](bittybuzz_vm_core::Host::receive) says.
    fn receive(&mut self, _frame: &mut [u8], _sighting: &mut Sighting<P>) -> Option<usize> {
        None
    }

    /// A step begins: its messages may replace waiting ones of the step before.
    fn begin_step(&mut self) {}

    /// Sends a frame to all robots in range, as [`Host::send`](bittybuzz_vm_core::Host::send) says: queues it.
    fn send(&mut self, _frame: &[u8]) {}

    /// Frames for which its queues had no room since the start: heard, and to be sent.
    fn dropped(&self) -> [u16; 2] {
        [0; 2]
    }

    /// Reports to people. Called between slices only.
    fn report(&mut self, record: &[u8]);

    /// An entry was completed, or waits on purpose: set-points hold anew.
    fn renew(&mut self, counts: Counts);

    /// Forgets set-points that have expired; whether there were any.
    fn expire(&mut self) -> bool;

    /// The script does not run any more, or not until its restart: everything that moves stops.
    fn stop(&mut self, reason: Stopped);

    /// The script starts again after a fault, with LEDs and timers as after power-on.
    fn restart(&mut self);
}

/// The reason why a script has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// It ended as it should: there is no `step()`.
    Ended,
    /// A run-time error; the number of its cause.
    Fault(u8),
    /// The image cannot run.
    Refused,
}

/// Counts of the script's work so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps completed.
    pub steps: u32,
    /// Ticks missed because a step took too long.
    pub missed: u32,
    /// The longest slice in µs.
    pub longest_slice_us: u32,
}

/// The script's task.
pub struct ScriptTask<P: Profile, C: ByteCode + 'static, R, const SLOTS: usize> {
    vm: &'static mut Vm<P, C, SLOTS>,
    robot_id: u16,
    /// The robot.
    pub robot: R,
    pulse: Pulse,
    log: Log,
    counts: Counts,
    /// The last report of discarded messages.
    unused: Unused,
    /// The end of the running `delay`.
    delay: Option<Instant>,
    restarts: Restarts,
    contained: Places,
}

impl<P: Profile, C: ByteCode + 'static, R: RobotHost<P>, const SLOTS: usize>
    ScriptTask<P, C, R, SLOTS>
{
    /// In this machine, on the robot with this id. `log` is the room for the lines printed in a
    /// slice, each a byte and at most [`trace::RECORD_MAX`]; it is empty without a trace.
    pub fn new(
        vm: &'static mut Vm<P, C, SLOTS>,
        robot_id: u16,
        robot: R,
        pulse: Pulse,
        log: &'static mut [u8],
    ) -> Self {
        ScriptTask {
            vm,
            robot_id,
            robot,
            pulse,
            log: Log::new(log),
            counts: Counts::default(),
            unused: Unused::default(),
            delay: None,
            restarts: Restarts::new(),
            contained: Places::new(),
        }
    }

    /// Runs the script in `image` at `period`, until it stops for good. `is_robot_function` returns true for the name
    /// hashes of the robot's functions.
    pub async fn run(
        &mut self,
        image: Image<C>,
        is_robot_function: impl Fn(u16) -> bool,
        seed: u32,
        period: Duration,
    ) -> Stopped {
        self.pulse.beat();
        if let Err(error) = self.vm.load(image, is_robot_function) {
            self.report(|| trace::refused(error));
            self.robot.stop(Stopped::Refused);
            return Stopped::Refused;
        }
        self.vm.set_robot_id(self.robot_id, seed);
        let hash = self.vm.header().map_or(0, |header| header.hash());
        let robot_id = self.robot_id;
        self.report(|| trace::start(robot_id, hash));
        self.renew();
        let mut ticks = Ticks::start(period);
        loop {
            let Err(fault) = self.all(&mut ticks).await else { break };
            let stopped = self.stop(&fault);
            if R::ON_FAULT_STOPS || fault.code == FaultCode::AssertFailed {
                return stopped;
            }
            self.pause(&mut ticks).await;
        }
        // Set-points hold as long as after any other step.
        self.wait_until(Instant::now() + HOLD).await;
        self.check_expiry();
        self.robot.stop(Stopped::Ended);
        Stopped::Ended
    }

    /// For ever after: shows that the task lives.
    pub async fn rest(&mut self) -> ! {
        loop {
            self.wait_until(Instant::now() + BEAT).await;
        }
    }

    /// Runs the script from its global code on: until it has nothing more to do, or a fault.
    async fn all(&mut self, ticks: &mut Ticks) -> Result<(), Fault> {
        self.entry(Entry::Global, ticks).await?;
        self.entry(Entry::Init, ticks).await?;
        while self.step(ticks).await? {
            self.counts.steps = self.counts.steps.wrapping_add(1);
            self.restarts.step();
        }
        Ok(())
    }

    /// Waits for the next tick, and runs a step. False if there is none.
    async fn step(&mut self, ticks: &mut Ticks) -> Result<bool, Fault> {
        self.wait_until(ticks.next()).await;
        ticks.take();
        self.robot.begin_step();
        self.entry(Entry::Step, ticks).await
    }

    /// Stops the motors first, then reports the fault.
    fn stop(&mut self, fault: &Fault) -> Stopped {
        let stopped = Stopped::Fault(fault.code as u8);
        self.robot.stop(stopped);
        if R::HAS_TRACE {
            self.robot.report(&trace::fault(self.counts.steps, fault, self.vm.calls()));
        }
        self.tell_unused();
        stopped
    }

    /// Lets the pause before a restart pass. At each tick of it the robot handles messages without code of the script.
    async fn pause(&mut self, ticks: &mut Ticks) {
        let (steps, pause) = (self.counts.steps, self.restarts.pause());
        self.report(|| trace::restart(steps, pause));
        self.vm.restart();
        self.delay = None;
        // The step that failed may have taken long.
        ticks.pass();
        loop {
            self.wait_until(ticks.next()).await;
            if self.restarts.tick() {
                break;
            }
            if self.step(ticks).await.is_err() {
                self.vm.restart();
            }
        }
        ticks.take();
        self.robot.restart();
        self.report(|| trace::restart(steps, 0));
        self.renew();
    }

    /// Runs an entry to its end. False if the script does not have it.
    async fn entry(&mut self, entry: Entry, ticks: &mut Ticks) -> Result<bool, Fault> {
        if !self.vm.begin(entry) {
            return Ok(false);
        }
        let mut overruns = 0;
        loop {
            let outcome = self.slice();
            self.pulse.beat();
            let has_printed_much = self.log.is_much();
            self.tell();
            match outcome {
                // A wait is the script's wish: the ticks that pass are not missed.
                Outcome::Waiting => ticks.pass(),
                Outcome::Done | Outcome::Pending => self.count_missed(ticks, &mut overruns),
                Outcome::Fault(fault) => return Err(fault),
            }
            match outcome {
                Outcome::Waiting => {
                    self.renew();
                    let poll = Instant::now() + POLL;
                    self.wait_until(self.delay.map_or(poll, |end| end.min(poll))).await;
                    ticks.pass();
                }
                Outcome::Pending if has_printed_much => {
                    self.wait_until(Instant::now() + PAUSE).await;
                }
                Outcome::Pending => yield_now().await,
                Outcome::Done | Outcome::Fault(_) => {
                    self.renew();
                    return Ok(true);
                }
            }
            self.check_expiry();
        }
    }

    /// Counts the ticks that have passed during a step. The first one of a step is reported, and
    /// then one in ten.
    fn count_missed(&mut self, ticks: &mut Ticks, overruns: &mut u32) {
        let missed = ticks.miss();
        if missed == 0 {
            return;
        }
        self.counts.missed = self.counts.missed.wrapping_add(missed);
        if overruns.is_multiple_of(10) {
            let Counts { steps, missed, .. } = self.counts;
            self.report(|| trace::overrun(steps, missed));
        }
        *overruns += 1;
    }

    /// Set-points hold anew.
    fn renew(&mut self) {
        self.robot.renew(self.counts);
        self.tell_unused();
    }

    /// Reports discarded messages, if there are more.
    fn tell_unused(&mut self) {
        if !R::HAS_TRACE {
            return;
        }
        let unused = Unused { dropped: self.robot.dropped(), messages: self.vm.counters() };
        if unused != self.unused {
            self.unused = unused;
            self.robot.report(&trace::unused(&unused));
        }
    }

    fn check_expiry(&mut self) {
        if self.robot.expire() {
            let steps = self.counts.steps;
            self.report(|| trace::expired(steps));
        }
    }

    /// Runs the machine for at most [`SLICE_MAX`].
    fn slice(&mut self) -> Outcome {
        let begin = self.robot.clock_us();
        let mut outcome = Outcome::Pending;
        for _ in 0..CHUNKS {
            let mut bridge = Bridge {
                robot: &mut self.robot,
                begin,
                log: &mut self.log,
                step: self.counts.steps,
                delay: &mut self.delay,
                contained: &mut self.contained,
            };
            outcome = self.vm.run(&mut bridge, CHUNK);
            let us = self.robot.clock_us().wrapping_sub(begin);
            self.counts.longest_slice_us = self.counts.longest_slice_us.max(us.into());
            if outcome != Outcome::Pending || us >= SLICE || self.log.is_much() {
                break;
            }
        }
        outcome
    }

    /// Passes on the lines that the script printed in the slice.
    fn tell(&mut self) {
        if R::HAS_TRACE {
            self.log.drain(|record| self.robot.report(record));
        }
    }

    fn report(&mut self, record: impl FnOnce() -> trace::Encoded) {
        if R::HAS_TRACE {
            self.robot.report(&record());
        }
    }

    /// Waits, and shows that the task lives.
    async fn wait_until(&mut self, end: Instant) {
        loop {
            self.pulse.beat();
            let now = Instant::now();
            if now >= end {
                return;
            }
            Timer::at(end.min(now + BEAT)).await;
        }
    }
}
