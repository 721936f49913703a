//! The robot functions that scripts call. Each has an entry in `robots/zooids/robot.toml` and an
//! arm here.

use core::ops::RangeInclusive;

use bittybuzz_motion::drive::{Goal, Wheels};
use bittybuzz_motion::{Length, MM, units};
use bittybuzz_runtime::call::{expect_count, integer, nothing};
use bittybuzz_runtime::mail::MailQueues;
use bittybuzz_runtime::script::{Console, Counts, RobotHost, ScriptStopped};
use bittybuzz_runtime::setpoint::SetpointWriter;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Periods, Refusal, Reply, RobotFault, Value,
};

use crate::eyes;
use crate::leds::{Light, LightChannel};
use crate::motors::Drive;
#[cfg(feature = "defmt")]
use crate::radio;
use crate::radio::MAIL;
use crate::robot::{self, function};
use crate::sensors;
use crate::time;
use bittybuzz_board::log::{self, info};

/// The duties of `forward()`, and of `left()` and `right()`, in percent.
const FORWARD: i8 = 80;
const TURN: i8 = 40;

/// The number of steps between two status lines.
const STATUS_STEPS: u32 = 10 * robot::TICK_HZ as u32;

/// The functions and settings that scripts can reach.
pub struct Zooid {
    light: &'static LightChannel,
    setpoint: SetpointWriter<Drive>,
    reported_at: u32,
}

type Result = core::result::Result<Reply<Tiny>, RobotFault>;

impl Zooid {
    /// Returns the robot without a set-point.
    pub fn new(light: &'static LightChannel, setpoint: SetpointWriter<Drive>) -> Self {
        Zooid { light, setpoint, reported_at: 0 }
    }

    fn drive(&mut self, left: i8, right: i8) -> Result {
        self.setpoint.set(Drive::Wheels(Wheels { left, right }));
        nothing()
    }
}

impl RobotHost<Tiny> for Zooid {
    const HAS_TRACE: bool = cfg!(feature = "defmt");
    const ON_FAULT_STOPS: bool = robot::ON_FAULT_STOPS;
    const PERIODS: Periods = robot::PERIODS;

    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, Tiny, C, SLOTS>,
        _again: bool,
        _console: &mut Console<'_>,
    ) -> Result {
        let count = match function {
            function::SET_MOTOR | function::GOTO => 2,
            function::LED | function::GREY_CODE => 1,
            _ => 0,
        };
        expect_count(&arguments, count)?;
        match function {
            function::LED => {
                let color = within(integer(&arguments, 0)?, 0..=7)?;
                self.light.signal(Light::Script(color as u8));
                nothing()
            }
            function::SET_MOTOR => {
                let duty = |index| within(integer(&arguments, index)?, -100..=100);
                self.drive(duty(0)? as i8, duty(1)? as i8)
            }
            function::FORWARD => self.drive(FORWARD, FORWARD),
            function::LEFT => self.drive(-TURN, TURN),
            function::RIGHT => self.drive(TURN, -TURN),
            function::STOP => self.drive(0, 0),
            function::GOTO => {
                let goal = Goal { x: length(&arguments, 0)?, y: length(&arguments, 1)? };
                self.setpoint.set(Drive::Goal(goal));
                let is_there = eyes::pose().is_some_and(|pose| goal.is_reached(&pose));
                Ok(Reply::Value(Value::int(is_there.into())))
            }
            function::BATTERY => Ok(Reply::Value(Value::int(sensors::battery_mv().into()))),
            function::TOUCHED => Ok(Reply::Value(Value::int(sensors::is_touched().into()))),
            function::GREY_CODE => {
                let number = integer(&arguments, 0)?;
                Ok(Reply::Value(Value::int(number ^ (number >> 1))))
            }
            _ => Err(RobotFault::Refused(Refusal::NotBuiltIn)),
        }
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        let pose = eyes::pose()?;
        Some(match axis {
            Axis::X => units::mm(pose.x),
            Axis::Y => units::mm(pose.y),
            Axis::Z => 0.0,
            Axis::Orientation => units::degrees(pose.heading),
        })
    }

    #[inline(always)]
    fn clock_us(&self) -> u16 {
        time::clock_us()
    }

    fn mail(&self) -> Option<&'static (impl MailQueues<Tiny> + 'static)> {
        Some(&MAIL)
    }

    fn report(&mut self, record: &[u8]) {
        log::write_record(record);
    }

    fn renew(&mut self, counts: Counts) {
        self.setpoint.renew();
        if counts.steps.wrapping_sub(self.reported_at) >= STATUS_STEPS {
            self.reported_at = counts.steps;
            info!(
                "{=u32} steps, {=u32} ticks missed, longest slice {=u32} us",
                counts.steps, counts.missed, counts.longest_slice_us
            );
            #[cfg(feature = "defmt")]
            let [heard, unknown, sent] = radio::COUNTS
                .each_ref()
                .map(|count| count.load(portable_atomic::Ordering::Relaxed));
            info!(
                "radio heard {=u32}, unknown {=u32}, doubles {=u16}, sent {=u32}",
                heard,
                unknown,
                MAIL.unread().duplicates,
                sent
            );
        }
    }

    fn expire(&mut self) -> bool {
        self.setpoint.expire()
    }

    fn stop(&mut self, reason: ScriptStopped) {
        self.setpoint.stop();
        if let Some(light) = Light::of(reason) {
            self.light.signal(light);
        }
    }

    fn restart(&mut self) {
        self.light.signal(Light::Script(0));
    }
}

fn within(value: i32, range: RangeInclusive<i32>) -> core::result::Result<i32, RobotFault> {
    if range.contains(&value) { Ok(value) } else { Err(RobotFault::Refused(Refusal::OutOfRange)) }
}

/// Reads argument `index` as a coordinate in mm.
fn length<C: ByteCode, const N: usize>(
    arguments: &CallArguments<'_, Tiny, C, N>,
    index: usize,
) -> core::result::Result<Length, RobotFault> {
    match arguments.item(index) {
        Argument::Float(mm) => units::from_mm(mm).ok_or(RobotFault::Refused(Refusal::OutOfRange)),
        // Integers have 16 bits, so the product does not overflow.
        _ => Ok(integer(arguments, index)? * MM),
    }
}
