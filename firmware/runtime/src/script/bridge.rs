//! The virtual machine's host during a slice, which forwards to the robot.

use bittybuzz_comms::trace;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Calls, Fault, FaultCode, Host, Periods, Reply, RobotFault,
    Sighting,
};
use embassy_time::{Duration, Instant};
use heapless::Vec;

use super::log::Log;
use super::{RobotHost, slice_us};

/// The contained faults that were reported, by position and cause. Faults at further places are
/// only counted.
pub type Places = Vec<(u16, FaultCode), 8>;

/// The output of robot functions that print.
pub struct Console<'a> {
    log: &'a mut Log,
    step: u32,
}

impl Console<'_> {
    /// Prints values as `log` does.
    pub fn print<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        values: &CallArguments<'_, P, C, SLOTS>,
    ) {
        self.log.push(&trace::log(self.step, values));
    }

    /// Prints values followed by the time on a stopwatch.
    pub fn print_with_time<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        values: &CallArguments<'_, P, C, SLOTS>,
        time: Duration,
    ) {
        let ms = i32::try_from(time.as_millis()).unwrap_or(i32::MAX);
        self.log.push(&trace::log_with_time(self.step, values, ms));
    }
}

/// The virtual machine's host during a slice.
pub struct SliceHost<'a, R> {
    pub robot: &'a mut R,
    /// The time at which the slice began, in µs of the robot's clock.
    pub begin: u16,
    pub log: &'a mut Log,
    pub step: u32,
    pub delay: &'a mut Option<Instant>,
    pub contained: &'a mut Places,
}

impl<P: Profile, R: RobotHost<P>> Host<P> for SliceHost<'_, R> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let mut console = Console { log: self.log, step: self.step };
        self.robot.call(function, arguments, again, &mut console)
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        if R::HAS_TRACE {
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

    #[inline(always)]
    fn is_slice_over(&mut self) -> bool {
        self.robot.clock_us().wrapping_sub(self.begin) >= const { slice_us::<P, R>() }
    }

    fn periods(&self) -> Periods {
        R::PERIODS
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        self.robot.receive(frame, sighting)
    }

    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        self.robot.receive_content(content)
    }

    fn send(&mut self, frame: &[u8]) {
        self.robot.send(frame);
    }

    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        self.robot.send_content(robot, content)
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        if R::HAS_TRACE && !R::ON_FAULT_STOPS {
            let place = (fault.position, fault.code);
            let is_known = self.contained.contains(&place) || self.contained.is_full();
            // A fault that finds no room in the log is reported when it occurs again.
            if !is_known && self.log.push(&trace::contained(self.step, fault, calls)) {
                let _ = self.contained.push(place);
            }
        }
        !R::ON_FAULT_STOPS
    }
}
