//! The script's task: loads the image, runs the global code, `init()`, and `step()` ten times per
//! second.
//!
//! One task runs the virtual machine, next to the tasks of the radio, the motors and the watchdog,
//! on one stack and one processor. It must therefore never run for long, whatever the script does.
//!
//! # Slices
//! The virtual machine runs in slices of at most [`SLICE_MAX`], and the task yields after each. The
//! robot's clock ends a slice; the machine reads that clock after every instruction that may take
//! long. Ticks that come while a step is still running are skipped and counted, never queued: the
//! steps of a slow script become less frequent, but no backlog builds up.
//!
//! # Set-points
//! A robot function that moves the robot writes a set-point with an expiry time. Each completed
//! step renews the set-point. When steps stop, for whatever reason, the motors' task stops the
//! motors.
//!
//! # Faults
//! A fault in a listener ends that call and is reported once per place. Any other fault stops the
//! script and the motors. After a pause ([`Restarts`]), which doubles up to a minute, the script
//! restarts with its global code. During the pause the robot sends beacons, merges and relays as
//! before, but no code of the script runs. A failed `assert` stops the script for good; so does
//! every fault if [`RobotHost::ON_FAULT_STOPS`].
//!
//! # Output
//! Log lines and faults become records after the slice in which they occurred. Formatting and
//! transport never run inside the interpreter's loop.

use core::convert::Infallible;

use bittybuzz_comms::trace::{self, Unused};
use bittybuzz_vm_core::message::Topics;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Fault, FaultCode, ImageError, Outcome, Periods, Reply,
    Restarts, RobotFault, Sighting, Vm,
};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};

use crate::liveness::{BEAT, Pulse};
use crate::mail::MailQueues;
use crate::setpoint::HOLD;

mod bridge;
mod log;
mod ticks;

pub use bridge::Console;

use bridge::{Places, SliceHost};
use log::Log;
use ticks::Ticks;

/// The longest time for which the script keeps the processor, including a garbage collection, and
/// without the tasks of a higher priority that interrupt it.
pub const SLICE_MAX: Duration = Duration::from_micros(500);

/// The part of [`SLICE_MAX`] for the work before the clock is read: [`CHUNK`] short instructions,
/// and a long one with a collection of a full heap.
const LAST_WORK: Duration = Duration::from_micros(350);

/// Returns the time in µs after which the slice of a robot ends as soon as the clock is read.
const fn slice_us<P: Profile, R: RobotHost<P>>() -> u16 {
    (SLICE_MAX.as_micros() - LAST_WORK.as_micros() - R::INTERRUPTION.as_micros()) as u16
}

/// The number of short instructions between two readings of the clock. After a long instruction the
/// machine reads the clock at once.
const CHUNK: u16 = 50;

/// The maximum number of clock readings in a slice, which ends the slice even if the clock stands
/// still.
const CHUNKS: u32 = 1000;

/// The pause of a script that prints a lot. It gives the debug probe time to read; a probe reads
/// some hundred bytes per ms.
const PAUSE: Duration = Duration::from_millis(2);

/// The period at which a waiting script is resumed, unless it gave a time.
const POLL: Duration = Duration::from_millis(10);

/// The interface from the script's task to the robot.
pub trait RobotHost<P: Profile> {
    /// True if the robot has a trace. Otherwise no records are made, and their code is left out.
    const HAS_TRACE: bool = true;

    /// True if every fault stops the script for good.
    const ON_FAULT_STOPS: bool = false;

    /// The longest time that tasks of a higher priority take during a slice, if it is a large part of
    /// one.
    const INTERRUPTION: Duration = Duration::from_micros(0);

    /// The periods of the messages that the virtual machine sends on its own.
    const PERIODS: Periods = Periods::DEFAULT;

    /// Calls a robot function; see [`Host::call`](bittybuzz_vm_core::Host::call).
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
        console: &mut Console<'_>,
    ) -> Result<Reply<P>, RobotFault>;

    /// Returns the position; see [`Host::position`](bittybuzz_vm_core::Host::position).
    fn position(&mut self, axis: Axis) -> Option<f32>;

    /// Returns the time in µs, modulo 65536. It is read after each long instruction, so a robot
    /// that can read a timer directly should override this function.
    fn clock_us(&self) -> u16 {
        Instant::now().as_micros() as u16
    }

    /// Returns the queues of the robot's link; `None` if the robot has no link. The next seven
    /// functions use them. The type is known to the compiler, because a call through a table would
    /// take 13 cycles more for each message of a Zooid.
    fn mail(&self) -> Option<&'static (impl MailQueues<P> + 'static)> {
        None::<&'static Infallible>
    }

    /// Takes the next received frame; see [`Host::receive`](bittybuzz_vm_core::Host::receive).
    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        self.mail()?.receive(frame, sighting)
    }

    /// Takes the content of a long message; see
    /// [`Host::receive_content`](bittybuzz_vm_core::Host::receive_content).
    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        self.mail().map_or(0, |mail| mail.receive_content(content))
    }

    /// Marks the beginning of a step: its messages may replace waiting ones of the step before.
    fn begin_step(&mut self, unwanted: Topics) {
        if let Some(mail) = self.mail() {
            mail.begin_step(unwanted);
        }
    }

    /// Queues a frame for all robots in range; see [`Host::send`](bittybuzz_vm_core::Host::send).
    fn send(&mut self, frame: &[u8]) {
        if let Some(mail) = self.mail() {
            mail.send(frame);
        }
    }

    /// Queues a long message; see [`Host::send_content`](bittybuzz_vm_core::Host::send_content).
    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        self.mail().is_none_or(|mail| mail.send_content(robot, content))
    }

    /// Returns the numbers of frames that the full queues dropped since the start: received ones,
    /// and ones to be sent.
    fn dropped(&self) -> [u16; 2] {
        self.mail().map_or([0; 2], |mail| mail.dropped())
    }

    /// Returns the number of received long messages that were not completed.
    fn incomplete(&self) -> u16 {
        self.mail().map_or(0, |mail| mail.incomplete())
    }

    /// Sends a record to the trace. It is called between slices only.
    fn report(&mut self, record: &[u8]);

    /// Renews the set-points, since an entry was completed or waits on purpose.
    fn renew(&mut self, counts: Counts);

    /// Clears set-points that have expired, and returns true if there were any.
    fn expire(&mut self) -> bool;

    /// Stops everything that moves: the script has ended, or waits for its restart.
    fn stop(&mut self, reason: ScriptStopped);

    /// Resets LEDs and timers to their state after power-on: the script restarts after a fault.
    fn restart(&mut self);
}

/// The reason why a script has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScriptStopped {
    /// The script has nothing more to do, since it has no `step()`.
    Ended,
    /// A run-time error stopped the script; the number is that of the [`FaultCode`].
    Fault(u8),
    /// The image cannot run.
    Refused,
}

/// The counts of the script's work since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// The number of completed steps.
    pub steps: u32,
    /// The number of ticks that were missed because a step took too long.
    pub missed: u32,
    pub longest_slice_us: u32,
}

/// The script's task.
pub struct ScriptTask<P: Profile, C: ByteCode + 'static, R, const SLOTS: usize> {
    vm: &'static mut Vm<P, C, SLOTS>,
    robot_id: u16,
    /// The board's side, which executes robot functions.
    pub robot: R,
    pulse: Pulse,
    log: Log,
    counts: Counts,
    /// The counts of discarded messages that were reported last.
    unused: Unused,
    /// The end of the running `delay`.
    delay: Option<Instant>,
    restarts: Restarts,
    contained: Places,
}

impl<P: Profile, C: ByteCode + 'static, R: RobotHost<P>, const SLOTS: usize>
    ScriptTask<P, C, R, SLOTS>
{
    /// Returns the task that runs scripts in `vm`. `log` is the room for the lines that are printed
    /// in a slice; each takes a byte and at most [`trace::RECORD_MAX`]. It is empty without a
    /// trace.
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

    /// Runs the script that `load` loads at `period` until it stops for good. The board selects
    /// [`Vm::load`] or [`Vm::load_sealed`], so that its program contains only one of them.
    pub async fn run(
        &mut self,
        load: impl FnOnce(&mut Vm<P, C, SLOTS>) -> Result<(), ImageError>,
        seed: u32,
        period: Duration,
    ) -> ScriptStopped {
        self.pulse.beat();
        if let Err(error) = load(self.vm) {
            self.report(|| trace::refused(error));
            self.robot.stop(ScriptStopped::Refused);
            return ScriptStopped::Refused;
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
        // The last set-points hold as long as after any other step.
        self.wait_until(Instant::now() + HOLD).await;
        self.check_expiry();
        self.robot.stop(ScriptStopped::Ended);
        ScriptStopped::Ended
    }

    /// Keeps the task's sign of life up for ever, after the script has stopped.
    pub async fn rest(&mut self) -> ! {
        loop {
            self.wait_until(Instant::now() + BEAT).await;
        }
    }

    /// Runs the script from its global code on, until it has nothing more to do or fails.
    async fn all(&mut self, ticks: &mut Ticks) -> Result<(), Fault> {
        self.entry(Entry::Global, ticks).await?;
        self.entry(Entry::Init, ticks).await?;
        while self.step(ticks).await? {
            self.counts.steps = self.counts.steps.wrapping_add(1);
            self.restarts.step();
        }
        Ok(())
    }

    /// Waits for the next tick and runs a step. Returns false if the script has no `step()`.
    async fn step(&mut self, ticks: &mut Ticks) -> Result<bool, Fault> {
        self.wait_until(ticks.next()).await;
        ticks.take();
        self.robot.begin_step(self.vm.unwanted_topics());
        self.entry(Entry::Step, ticks).await
    }

    /// Stops the motors first, then reports the fault.
    fn stop(&mut self, fault: &Fault) -> ScriptStopped {
        let stopped = ScriptStopped::Fault(fault.code as u8);
        self.robot.stop(stopped);
        if R::HAS_TRACE {
            self.robot.report(&trace::fault(self.counts.steps, fault, self.vm.calls()));
        }
        self.report_unused();
        stopped
    }

    /// Waits for the pause before a restart. At each tick of the pause the robot handles messages
    /// without code of the script.
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

    /// Runs an entry to its end. Returns false if the script does not have it.
    async fn entry(&mut self, entry: Entry, ticks: &mut Ticks) -> Result<bool, Fault> {
        if !self.vm.begin(entry) {
            return Ok(false);
        }
        let mut overruns = 0;
        loop {
            let outcome = self.slice();
            self.pulse.beat();
            let has_printed_much = self.log.is_much();
            self.report_log();
            match outcome {
                // The script waits on purpose, so the ticks that pass are not missed.
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

    /// Counts the ticks that passed during a step. The first overrun of a step is reported, and
    /// then every tenth one.
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

    /// Renews the set-points, and reports discarded messages.
    fn renew(&mut self) {
        self.robot.renew(self.counts);
        self.report_unused();
    }

    /// Reports the counts of discarded messages if they have changed.
    fn report_unused(&mut self) {
        if !R::HAS_TRACE {
            return;
        }
        let mut messages = self.vm.counters();
        messages.incomplete = messages.incomplete.saturating_add(self.robot.incomplete());
        let unused = Unused { dropped: self.robot.dropped(), messages };
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

    /// Runs the virtual machine for at most [`SLICE_MAX`].
    fn slice(&mut self) -> Outcome {
        let begin = self.robot.clock_us();
        let mut outcome = Outcome::Pending;
        for _ in 0..CHUNKS {
            let mut bridge = SliceHost {
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
            if outcome != Outcome::Pending
                || us >= const { slice_us::<P, R>() }
                || self.log.is_much()
            {
                break;
            }
        }
        outcome
    }

    /// Reports the lines that the script printed in the slice.
    fn report_log(&mut self) {
        if R::HAS_TRACE {
            self.log.drain(|record| self.robot.report(record));
        }
    }

    fn report(&mut self, record: impl FnOnce() -> trace::Encoded) {
        if R::HAS_TRACE {
            self.robot.report(&record());
        }
    }

    /// Waits until `end`, and shows meanwhile that the task lives.
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
