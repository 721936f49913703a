//! The script's task: loads the image, runs global code, `init()`, and `step()` ten times a second.

use bittybuzz_comms::trace::{self, Unused};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Host, Image, Outcome, Periods, Reply, RobotFault, Sighting,
    Vm,
};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};

use crate::liveness::{BEAT, Pulse};
use crate::setpoint::HOLD;

mod log;
mod ticks;

use log::Log;
use ticks::Ticks;

/// Longest time for which the script keeps the processor, a collection included.
pub const SLICE_MAX: Duration = Duration::from_micros(500);

/// A slice ends after the first look at the clock that finds so much time gone: what one instruction can take on top, a
/// collection of a full heap, fits into the rest of [`SLICE_MAX`].
const SLICE: Duration = Duration::from_micros(150);

/// Instructions between two looks at the clock.
const CHUNK: u16 = 50;

/// Looks at the clock in a slice, at most: it ends even if the clock should stand still.
const CHUNKS: u32 = 1000;

/// A script that prints much waits so long for its readers: a debug probe takes some hundred bytes in a ms.
const PAUSE: Duration = Duration::from_millis(2);

/// How often a waiting script is asked whether it can go on, unless it said when.
const POLL: Duration = Duration::from_millis(10);

/// The robot, as the script's task sees it.
pub trait Robot<P: Profile> {
    /// Whether there is anybody to tell. Else nothing is written down, and the code for it is left out.
    const TELLS: bool = true;

    /// Calls a robot function, as [`Host::call`] says.
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
        console: &mut Console<'_>,
    ) -> Result<Reply<P>, RobotFault>;

    /// The position, as [`Host::position`] says.
    fn position(&mut self, axis: Axis) -> Option<f32>;

    /// How often the robot is heard without the script's doing, as [`Host::periods`] says.
    fn periods(&self) -> Periods {
        Periods::DEFAULT
    }

    /// The oldest frame that waits, as [`Host::receive`] says.
    fn receive(&mut self, _frame: &mut [u8], _sighting: &mut Sighting<P>) -> Option<usize> {
        None
    }

    /// A step begins: what it sends may replace what the one before has sent and nobody has heard yet.
    fn begin_step(&mut self) {}

    /// Sends a frame to whoever hears it, as [`Host::send`] says: queues it.
    fn send(&mut self, _frame: &[u8]) {}

    /// Frames for which its queues had no room since the start: heard, and to be sent.
    fn dropped(&self) -> [u16; 2] {
        [0; 2]
    }

    /// Tells people. Called between slices only.
    fn report(&mut self, record: &[u8]);

    /// An entry was completed, or waits on purpose: set-points hold anew.
    fn renew(&mut self, counts: Counts);

    /// Forgets set-points that have expired; whether there were any.
    fn expire(&mut self) -> bool;

    /// The script has stopped for good, by a fault or because it cannot run: so does everything that moves.
    fn stop(&mut self, reason: Stopped);
}

/// Why a script does not run any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// It ended as it should: there is no `step()`.
    Ended,
    /// A run-time error; the number of its cause.
    Fault(u8),
    /// The image cannot run.
    Refused,
}

/// What the script has done so far.
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
pub struct Script<P: Profile, C: ByteCode + 'static, R, const SLOTS: usize> {
    vm: &'static mut Vm<P, C, SLOTS>,
    robot_id: u16,
    /// The robot.
    pub robot: R,
    pulse: Pulse,
    log: Log,
    counts: Counts,
    /// What was told last of messages that came to nothing.
    unused: Unused,
    /// When the running `delay` is over.
    delay: Option<Instant>,
}

impl<P: Profile, C: ByteCode + 'static, R: Robot<P>, const SLOTS: usize> Script<P, C, R, SLOTS> {
    /// In this machine, on the robot with this id. `log` is the room for what is printed in a slice, each time a byte and at
    /// most [`trace::RECORD_MAX`]; none where nobody is told.
    pub fn new(
        vm: &'static mut Vm<P, C, SLOTS>,
        robot_id: u16,
        robot: R,
        pulse: Pulse,
        log: &'static mut [u8],
    ) -> Self {
        let (log, counts, unused) = (Log::new(log), Counts::default(), Unused::default());
        Script { vm, robot_id, robot, pulse, log, counts, unused, delay: None }
    }

    /// Runs the script in `image` at `period`, until it stops. `is_robot_function` tells whether the robot has a function
    /// of that name hash.
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
        self.vm.identify(self.robot_id, seed);
        let hash = self.vm.header().map_or(0, |header| header.hash());
        let robot_id = self.robot_id;
        self.report(|| trace::start(robot_id, hash));
        self.renew();
        let mut ticks = Ticks::start(period);
        match self.all(&mut ticks).await {
            Ok(()) => {
                // What it set holds as long as after any other step.
                self.wait_until(Instant::now() + HOLD).await;
                self.check_expiry();
                self.robot.stop(Stopped::Ended);
                Stopped::Ended
            }
            Err(stopped) => stopped,
        }
    }

    /// For ever after: shows that the task lives.
    pub async fn rest(&mut self) -> ! {
        loop {
            self.wait_until(Instant::now() + BEAT).await;
        }
    }

    async fn all(&mut self, ticks: &mut Ticks) -> Result<(), Stopped> {
        self.entry(Entry::Global, ticks).await?;
        self.entry(Entry::Init, ticks).await?;
        loop {
            self.wait_until(ticks.next()).await;
            ticks.take();
            self.robot.begin_step();
            if !self.entry(Entry::Step, ticks).await? {
                return Ok(());
            }
            self.counts.steps = self.counts.steps.wrapping_add(1);
        }
    }

    /// Runs an entry to its end. False if the script does not have it.
    async fn entry(&mut self, entry: Entry, ticks: &mut Ticks) -> Result<bool, Stopped> {
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
                Outcome::Fault(fault) => {
                    // The motors first, then the words.
                    let stopped = Stopped::Fault(fault.code as u8);
                    self.robot.stop(stopped);
                    if R::TELLS {
                        let calls = self.vm.calls();
                        self.robot.report(&trace::fault(self.counts.steps, &fault, calls));
                    }
                    self.tell_unused();
                    return Err(stopped);
                }
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

    /// Counts the ticks that have passed during a step. Of those of one step the first is told, and then one in ten.
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

    /// Tells of messages that came to nothing, if there are more.
    fn tell_unused(&mut self) {
        if !R::TELLS {
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
        let start = Instant::now();
        let mut outcome = Outcome::Pending;
        for _ in 0..CHUNKS {
            let mut bridge = Bridge {
                robot: &mut self.robot,
                log: &mut self.log,
                step: self.counts.steps,
                delay: &mut self.delay,
            };
            outcome = self.vm.run(&mut bridge, CHUNK);
            let elapsed = start.elapsed();
            let us = u32::try_from(elapsed.as_micros()).unwrap_or(u32::MAX);
            self.counts.longest_slice_us = self.counts.longest_slice_us.max(us);
            if outcome != Outcome::Pending || elapsed >= SLICE || self.log.is_much() {
                break;
            }
        }
        outcome
    }

    /// Passes on what the script printed in the slice.
    fn tell(&mut self) {
        if R::TELLS {
            self.log.drain(|record| self.robot.report(record));
        }
    }

    fn report(&mut self, record: impl FnOnce() -> trace::Encoded) {
        if R::TELLS {
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

/// Where robot functions print.
pub struct Console<'a> {
    log: &'a mut Log,
    step: u32,
}

impl Console<'_> {
    /// Prints values as `log` does.
    pub fn print<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        values: &Arguments<'_, P, C, SLOTS>,
    ) {
        self.log.push(&trace::log(self.step, values));
    }

    /// Prints values, and the time on a stopwatch.
    pub fn print_with_time<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        values: &Arguments<'_, P, C, SLOTS>,
        time: Duration,
    ) {
        let ms = i32::try_from(time.as_millis()).unwrap_or(i32::MAX);
        self.log.push(&trace::log_with_time(self.step, values, ms));
    }
}

/// What the machine sees of the robot during a slice.
struct Bridge<'a, R> {
    robot: &'a mut R,
    log: &'a mut Log,
    step: u32,
    delay: &'a mut Option<Instant>,
}

impl<P: Profile, R: Robot<P>> Host<P> for Bridge<'_, R> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let mut console = Console { log: self.log, step: self.step };
        self.robot.call(function, arguments, again, &mut console)
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        if R::TELLS {
            self.log.push(&trace::log(self.step, &arguments));
        }
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let now = Instant::now();
        if !again {
            let wait = Duration::from_millis(u64::try_from(ms).unwrap_or(0));
            *self.delay = Some(now + wait);
        }
        let over = self.delay.is_none_or(|end| now >= end);
        if over {
            *self.delay = None;
        }
        over
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        self.robot.position(axis)
    }

    fn periods(&self) -> Periods {
        self.robot.periods()
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        self.robot.receive(frame, sighting)
    }

    fn send(&mut self, frame: &[u8]) {
        self.robot.send(frame);
    }
}
