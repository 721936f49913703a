//! This computer in the role of a robot: robot functions print their calls, `log` prints, `delay`
//! waits.

use std::time::{Duration, Instant};

use bittybuzz_arena::robot::{LoneCall, LoneRobot};
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Axis, ByteCode, CallArguments, Calls, Fault, Host, Reply, RobotFault};

use crate::output::{OutputForm, ScriptOutput};
use crate::program::LoadedProgram;

/// The clock of the script.
pub enum HostClock {
    /// Delays end at once.
    Simulated,
    /// Delays take real time.
    Real {
        /// The end of the running `delay`.
        until: Option<Instant>,
    },
}

/// The host of a script, which stands for all robots that the script may run on.
pub struct HostRobot<'a> {
    robot: LoneRobot<'a>,
    /// The destination of calls and logs.
    pub output: ScriptOutput,
    pub clock: HostClock,
    /// The reason why the last robot function refused its arguments.
    pub refusal: Option<String>,
}

impl<'a> HostRobot<'a> {
    /// Creates a host with the functions of all `robots`.
    pub fn new(
        robots: impl Iterator<Item = &'a Robot> + Clone,
        program: &'a LoadedProgram,
        clock: HostClock,
        form: OutputForm,
    ) -> Self {
        HostRobot {
            robot: LoneRobot::new(robots, program.symbols.as_ref(), program.has_text()),
            output: ScriptOutput::of(form),
            clock,
            refusal: None,
        }
    }

    /// Returns the rest of the running `delay`.
    pub fn remaining_delay(&self) -> Duration {
        match self.clock {
            HostClock::Real { until: Some(until) } => {
                until.saturating_duration_since(Instant::now())
            }
            HostClock::Real { until: None } | HostClock::Simulated => Duration::ZERO,
        }
    }
}

impl<P: Profile> Host<P> for HostRobot<'_> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        _again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        match self.robot.call(function, &arguments) {
            Ok(LoneCall { line, reply }) => {
                line.iter().for_each(|line| self.output.line(line));
                Ok(reply)
            }
            Err(refusal) => {
                self.refusal = Some(refusal.accepted);
                Err(refusal.fault)
            }
        }
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        self.output.line(&self.robot.log_line(&arguments));
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let HostClock::Real { until } = &mut self.clock else { return true };
        let now = Instant::now();
        if !again {
            // A negative delay is over at once.
            *until = Some(now + Duration::from_millis(ms.max(0).unsigned_abs().into()));
        }
        until.is_none_or(|until| until <= now)
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        self.robot.position(axis)
    }

    /// Ends the run, as with any other fault. No listener runs here, because no frame arrives.
    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _fault: &Fault,
        _calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        false
    }
}
