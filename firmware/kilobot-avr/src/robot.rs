//! The virtual machine's host: the robot's functions and its messages. Each function has an entry
//! in `robots/kilobot/robot.toml` and an arm here.

use bittybuzz_comms::infrared::{CONTAINED, FaultReport, MESSAGE};
use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_kilobot::clock::Delay;
use bittybuzz_kilobot::light::Color;
use bittybuzz_kilobot::mode::ModeSwitch;
use bittybuzz_kilobot::motors::MotorDuties;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Calls, Fault, Host, Periods, Refusal, Reply, RobotFault,
    Sighting, Value,
};

use crate::adc::{self, Sensor};
use crate::chip::registers;
use crate::toml::{self, function};
use crate::{clock, hear};

/// The robot without its virtual machine.
pub struct KilobotHost {
    /// The mode that the overhead controller selected, with id and motor calibration.
    pub mode: ModeSwitch,
    /// The duties of its motors.
    pub motors: MotorDuties,
    /// The script's color.
    pub color: Color,
    /// The frames that wait for the script, each with the distance in mm, or 0 if the distance is
    /// unknown.
    pub inbox: Inbox<Tiny, u8, { toml::FRAME_BYTES }, { toml::IN_QUEUE }, { toml::IN_LONG }>,
    /// The frames that wait to be sent.
    pub outbox: Outbox<Tiny, { toml::FRAME_BYTES }, { toml::OUT_QUEUE }, { toml::OUT_LONG }>,
    /// The running `delay`.
    pub delay: Delay,
    /// The lower half of the script's hash.
    pub script: u16,
    /// The message about the last fault that stopped the script, or else about the first contained
    /// fault since the script's start. It is zeros if there was none.
    pub report: [u8; MESSAGE],
}

type Result = core::result::Result<Reply<Tiny>, RobotFault>;

impl KilobotHost {
    /// Returns the initial state, all zeros, which takes no flash.
    pub const fn new() -> Self {
        KilobotHost {
            mode: ModeSwitch::new(0, [0; 4]),
            motors: MotorDuties::new(),
            color: Color::DARK,
            inbox: Inbox::new(0),
            outbox: Outbox::new(),
            delay: Delay::start(0, 0),
            script: 0,
            report: [0; MESSAGE],
        }
    }

    /// Prepares the message about a fault. `None` means that the robot refuses the image.
    #[inline(never)]
    pub fn note(&mut self, fault: Option<Fault>, is_contained: bool) {
        let report = FaultReport { robot: self.mode.id, script: self.script, fault, is_contained };
        self.report = report.message();
    }

    /// Returns true if the message is about a contained fault.
    pub fn has_contained(&self) -> bool {
        let [.., kind, _, _] = self.report;
        kind == CONTAINED
    }

    /// Prepares the next start of the script, as after power-on.
    pub fn restart(&mut self) {
        self.color = Color::DARK;
        self.report = [0; MESSAGE];
    }
}

impl Host<Tiny> for KilobotHost {
    // `is_slice_over` tests one bit of a register, which takes two cycles.
    const IS_TIMED: bool = true;

    fn is_slice_over(&mut self) -> bool {
        clock::is_slice_over(&registers())
    }

    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, Tiny, C, SLOTS>,
        _again: bool,
    ) -> Result {
        let given = arguments.count();
        let most = match (function, given) {
            (function::SET_MOTOR, 2) => 255,
            (function::LED, 1) => 7,
            (function::LED, 3) => 3,
            (function::SET_MOTOR | function::LED, _) | (_, 1..) => {
                return refused(Refusal::ArgumentCount);
            }
            _ => 0,
        };
        let mut numbers = [0; 3];
        for (index, number) in numbers.iter_mut().enumerate().take(given) {
            *number = at_most(most, arguments.value(index))?;
        }
        let [first, second, third] = numbers;
        let duties = match function {
            function::LED => {
                self.color =
                    if given == 1 { Color::of_sum(first) } else { Color::of(first, second, third) };
                return nothing();
            }
            function::SET_MOTOR => [first, second],
            function::FORWARD => self.mode.straight(),
            function::LEFT => self.mode.turn_left(),
            function::RIGHT => self.mode.turn_right(),
            function::STOP => [0, 0],
            function::LIGHT => return read(Sensor::Light),
            function::BATTERY => return read(Sensor::Battery),
            _ => return refused(Refusal::NotBuiltIn),
        };
        self.motors.set(duties, clock::now(&registers()));
        nothing()
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: CallArguments<'_, Tiny, C, SLOTS>) {}

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let now = clock::now(&registers());
        if !again {
            self.delay = Delay::start(now, ms.clamp(0, i32::from(u16::MAX)) as u16);
        }
        self.delay.is_over(now)
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn periods(&self) -> Periods {
        toml::PERIODS
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<Tiny>) -> Option<usize> {
        let (length, distance) = self.inbox.pop(frame.first_chunk_mut()?)?;
        if *distance != 0 {
            *sighting = Sighting::at(Value::float_from_int(i32::from(*distance)));
        }
        Some(length)
    }

    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        self.inbox.take_content(content)
    }

    fn send(&mut self, frame: &[u8]) {
        self.outbox.push(frame);
    }

    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        self.outbox.push_content(robot, content)
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        _: Calls<'_, Tiny, C, SLOTS>,
    ) -> bool {
        if !toml::ON_FAULT_STOPS && !self.has_contained() {
            self.note(Some(*fault), true);
        }
        !toml::ON_FAULT_STOPS
    }
}

/// Returns the sensor's reading, and waits while a message is being received.
fn read(sensor: Sensor) -> Result {
    if hear::is_busy() {
        return Ok(Reply::Wait);
    }
    Ok(Reply::Value(Value::int(adc::read(&registers(), sensor).into())))
}

fn nothing() -> Result {
    Ok(Reply::Value(Value::nil()))
}

fn refused(reason: Refusal) -> Result {
    Err(RobotFault::Refused(reason))
}

/// Converts an argument that must be an integer from 0 to `most`.
fn at_most(most: u8, argument: Value<Tiny>) -> core::result::Result<u8, RobotFault> {
    let number = argument.as_int().ok_or(RobotFault::WrongType(argument.type_of()))?;
    match u8::try_from(number) {
        Ok(number) if number <= most => Ok(number),
        _ => Err(RobotFault::Refused(Refusal::OutOfRange)),
    }
}
