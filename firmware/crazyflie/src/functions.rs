//! The robot functions that scripts call. Each has an entry in `robots/crazyflie/robot.toml` and an
//! arm here.

use core::cell::RefCell;

use bittybuzz_flight::pilot::{PilotAnswer, PilotFunction};
use bittybuzz_runtime::call::{expect_count, integer, nothing};
use bittybuzz_runtime::mail::MailQueues;
use bittybuzz_runtime::script::{Console, Counts, RobotHost, ScriptStopped};
use bittybuzz_runtime::setpoint::SetpointWriter;
use bittybuzz_station::Station;
use bittybuzz_vm_core::number::{Profile, Rng};
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Periods, Refusal, Reply, RobotFault, Type, Value,
};
use embassy_time::{Duration, Instant};

use crate::clock;
use crate::decks;
use crate::decks::fault::Direction;
use crate::decks::ranging::{self, RangeSample};
use crate::leds::{Color, ScriptLeds, Status, StatusChannel};
use crate::link::{self, swarm::MAIL};
use crate::motors::{POWER_MAX, Powers};
use crate::pilot::{self, ScriptPilot};
use crate::robot::{self, Numbers, function};
use crate::section::Section;
use bittybuzz_board::log;

/// The number of steps between two status lines, and that of the steps from a start or restart to the
/// first one, which says soon that the script runs.
const STATUS_STEPS: u32 = 10 * robot::TICK_HZ as u32;
const FIRST_STATUS_STEPS: u32 = 2 * robot::TICK_HZ as u32;

/// The greatest age of a distance.
const RANGE_AGE_MAX: Duration = Duration::from_millis(500);
/// The distance if nothing is in range, as robots/crazyflie/robot.toml says.
const NOTHING_MM: i32 = 32_767;

/// The functions and settings that scripts can reach.
pub struct Crazyflie {
    leds: ScriptLeds,
    setpoint: SetpointWriter<Powers>,
    pilot: ScriptPilot,
    status: &'static StatusChannel,
    rng: Rng,
    stopwatch: Option<Instant>,
    /// The number of steps at the next status line; `None` until the script runs.
    report_at: Option<u32>,
}

type Result = core::result::Result<Reply<Numbers>, RobotFault>;

impl Crazyflie {
    /// Returns the robot with this id.
    pub fn new(
        leds: ScriptLeds,
        setpoint: SetpointWriter<Powers>,
        status: &'static StatusChannel,
        station: &'static RefCell<Station>,
        robot_id: u16,
    ) -> Self {
        let rng = Rng::new(0, robot_id);
        let pilot = ScriptPilot::new(station);
        Crazyflie { leds, setpoint, pilot, status, rng, stopwatch: None, report_at: None }
    }

    /// Executes `led(color)` and `led(color, on)`.
    fn led<C: ByteCode, const N: usize>(
        &mut self,
        arguments: &CallArguments<'_, Numbers, C, N>,
    ) -> Result {
        let color = integer(arguments, 0)?;
        match arguments.count() {
            1 => match u8::try_from(color) {
                Ok(colors @ 0..=7) => self.leds.show(colors),
                _ => return Err(RobotFault::Refused(Refusal::OutOfRange)),
            },
            2 => {
                let on = integer(arguments, 1)? != 0;
                self.leds.set(if color == 0 { Color::Red } else { Color::Green }, on);
            }
            _ => return Err(RobotFault::Refused(Refusal::ArgumentCount)),
        }
        nothing()
    }

    /// Executes a flight function.
    fn fly<C: ByteCode, const N: usize>(
        &mut self,
        function: PilotFunction,
        arguments: &CallArguments<'_, Numbers, C, N>,
        again: bool,
    ) -> Result {
        let mut numbers = [0.0; NUMBERS_MAX];
        let numbers = numbers.get_mut(..arguments.count());
        let numbers = numbers.ok_or(RobotFault::Refused(Refusal::ArgumentCount))?;
        for (index, place) in numbers.iter_mut().enumerate() {
            *place = number(arguments, index)?;
        }
        let is_there = match self.pilot.call(function, numbers, again) {
            PilotAnswer::Waiting => return Ok(Reply::Wait),
            PilotAnswer::OutOfRange => return Err(RobotFault::Refused(Refusal::OutOfRange)),
            PilotAnswer::Done(is_there) => is_there,
            PilotAnswer::Refused { reason, is_new } => {
                if is_new {
                    pilot::report(function, reason);
                }
                false
            }
        };
        if function.has_value() { Ok(Reply::Value(Value::int(is_there.into()))) } else { nothing() }
    }

    /// Executes `set_motor(motor, power)`.
    fn set_motor<C: ByteCode, const N: usize>(
        &mut self,
        arguments: &CallArguments<'_, Numbers, C, N>,
    ) -> Result {
        expect_count(arguments, 2)?;
        let (motor, power) = (integer(arguments, 0)?, integer(arguments, 1)?);
        let out_of_range = RobotFault::Refused(Refusal::OutOfRange);
        let power = u8::try_from(power).map_err(|_| out_of_range)?;
        let mut powers = self.setpoint.held().unwrap_or_default();
        let slot = usize::try_from(motor).ok().and_then(|motor| powers.get_mut(motor));
        *slot.ok_or(out_of_range)? = power.min(POWER_MAX);
        self.setpoint.set(powers);
        nothing()
    }
}

/// The most arguments of a flight function.
const NUMBERS_MAX: usize = 3;

/// Returns the flight function of this number.
fn flight_function(function: u16) -> Option<PilotFunction> {
    Some(match function {
        function::TAKEOFF => PilotFunction::TakeOff,
        function::LAND => PilotFunction::Land,
        function::HOVER => PilotFunction::Hover,
        function::SPIN => PilotFunction::Spin,
        function::GO_TO => PilotFunction::GoTo,
        function::GOTO => PilotFunction::Approach,
        function::MOVE_TOWARD => PilotFunction::MoveToward,
        function::FORWARD => PilotFunction::Forward,
        function::LEFT => PilotFunction::Left,
        function::RIGHT => PilotFunction::Right,
        _ => return None,
    })
}

/// Returns argument `index` as a number.
fn number<C: ByteCode, const N: usize>(
    arguments: &CallArguments<'_, Numbers, C, N>,
    index: usize,
) -> core::result::Result<f32, RobotFault> {
    match arguments.item(index) {
        Argument::Int(value) => Ok(value as f32),
        Argument::Float(value) => Ok(value),
        Argument::Nil => Err(RobotFault::WrongType(Type::Nil)),
        _ => Err(RobotFault::WrongType(arguments.value(index).type_of())),
    }
}

/// Executes `get_z()` and the functions of the other directions. A robot without a range finder in
/// this direction refuses them, and so does one whose range finder has not measured for a while.
fn range<C: ByteCode, const N: usize>(
    arguments: &CallArguments<'_, Numbers, C, N>,
    direction: Direction,
) -> Result {
    expect_count(arguments, 0)?;
    if let Some(Ok(decks)) = decks::result()
        && !ranging::has(decks, direction)
    {
        return Err(RobotFault::Refused(Refusal::NotBuiltIn));
    }
    let now = Instant::now();
    let is_fresh =
        |sample: &RangeSample| now.saturating_duration_since(sample.read_at) < RANGE_AGE_MAX;
    let sample = ranging::last_sample(direction).filter(is_fresh);
    let sample = sample.ok_or(RobotFault::Refused(Refusal::NotReady))?;
    let mm = sample.distance_m.map_or(NOTHING_MM, |meters| (meters * 1000.0 + 0.5) as i32);
    Ok(Reply::Value(Value::int(mm)))
}

impl RobotHost<Numbers> for Crazyflie {
    const ON_FAULT_STOPS: bool = robot::ON_FAULT_STOPS;
    const PERIODS: Periods = robot::PERIODS;
    /// A sample of the flight task takes 145 µs, each millisecond. The first long instruction of a slice
    /// should end it, which the next 50 µs suffice for.
    const INTERRUPTION: Duration = Duration::from_micros(100);

    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, Numbers, C, SLOTS>,
        again: bool,
        console: &mut Console<'_>,
    ) -> Result {
        match function {
            function::LED => self.led(&arguments),
            function::SET_MOTOR => self.set_motor(&arguments),
            function::BATTERY => {
                expect_count(&arguments, 0)?;
                let mv = link::STATE.battery_mv();
                let mv = mv.ok_or(RobotFault::Refused(Refusal::NotReady))?;
                Ok(Reply::Value(Value::int(mv.into())))
            }
            function::RAND_BBZ => {
                expect_count(&arguments, 0)?;
                let (low, high) = (Numbers::int_from_i32(-150), Numbers::int_from_i32(150));
                let random = self.rng.uniform_int::<Numbers>(low, high);
                Ok(Reply::Value(Value::int(Numbers::int_to_i32(random))))
            }
            function::SHOW => {
                expect_count(&arguments, 1)?;
                match self.stopwatch {
                    Some(start) => console.print_with_time(&arguments, start.elapsed()),
                    None => console.print(&arguments),
                }
                nothing()
            }
            function::START => {
                expect_count(&arguments, 0)?;
                self.stopwatch.get_or_insert_with(Instant::now);
                nothing()
            }
            function::GO => {
                expect_count(&arguments, 0)?;
                self.stopwatch = Some(Instant::now());
                nothing()
            }
            function::GET_Z => range(&arguments, Direction::Down),
            function::GET_FRONT => range(&arguments, Direction::Front),
            function::GET_BACK => range(&arguments, Direction::Back),
            function::GET_LEFT => range(&arguments, Direction::Left),
            function::GET_RIGHT => range(&arguments, Direction::Right),
            function::GET_UP => range(&arguments, Direction::Up),
            _ => match flight_function(function) {
                Some(flight) => self.fly(flight, &arguments, again),
                None => Err(RobotFault::Refused(Refusal::NotBuiltIn)),
            },
        }
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        // Without a positioning system the robot knows its place from its deck.
        let pose = link::POSE.get().or_else(|| crate::flight::state::ESTIMATE.get());
        pose.map(|pose| pose.along::<Section>(axis))
    }

    fn clock_us(&self) -> u16 {
        clock::us()
    }

    fn mail(&self) -> Option<&'static (impl MailQueues<Numbers> + 'static)> {
        Some(&MAIL)
    }

    fn report(&mut self, record: &[u8]) {
        log::write_record(record);
    }

    fn renew(&mut self, counts: Counts) {
        self.setpoint.renew();
        self.pilot.renew();
        let report_at = *self.report_at.get_or_insert(counts.steps + FIRST_STATUS_STEPS);
        if counts.steps >= report_at {
            self.report_at = Some(counts.steps - counts.steps % STATUS_STEPS + STATUS_STEPS);
            log::info!(
                "{=u32} steps, {=u32} ticks missed, longest slice {=u32} us, link {}",
                counts.steps,
                counts.missed,
                counts.longest_slice_us,
                link::STATE.counts()
            );
        }
    }

    fn expire(&mut self) -> bool {
        self.setpoint.expire()
    }

    fn stop(&mut self, reason: ScriptStopped) {
        self.setpoint.stop();
        // After another end a robot that still flies lands for want of a set-point.
        if let ScriptStopped::Fault(_) = reason {
            self.pilot.set_script_fault(true);
        }
        self.status.signal(reason.into());
    }

    fn restart(&mut self) {
        self.leds.show(0);
        self.stopwatch = None;
        self.report_at = None;
        self.pilot.set_script_fault(false);
        self.status.signal(Status::Well);
    }
}
