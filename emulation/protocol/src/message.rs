//! The messages between a client and an emulator program, one JSON object per line.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

mod body;
mod deck;
mod fault;
mod statistics;

pub use body::{BodySensor, MeasurementFault, PoseErrors, Powertrain, Room};
pub use deck::Deck;
pub use fault::{
    BarometerFault, DeckMemoryFault, DeviceFault, DistanceFault, EepromFault, FlowFault, ImuFault,
};
pub use statistics::{
    AirStatistics, BoardStatistics, CoreStatistics, CrazyflieStatistics, KilobotStatistics,
    RobotStatistics, ZooidStatistics,
};

use bittybuzz_chips as chips;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Reads a command and the number of its robot: member `robot`, 0 if it is missing.
pub(crate) fn parse_command(line: &[u8]) -> serde_json::Result<(usize, Command)> {
    let mut value: serde_json::Value = serde_json::from_slice(line)?;
    let robot = match value.as_object_mut().and_then(|members| members.remove("robot")) {
        Some(robot) => serde_json::from_value(robot)?,
        None => 0,
    };
    Ok((robot, serde_json::from_value(value)?))
}

/// Writes a command for one of several robots; robot 0 is not written.
pub(crate) fn line_of(robot: usize, command: &Command) -> serde_json::Result<String> {
    let mut value = serde_json::to_value(command)?;
    if robot != 0
        && let Some(members) = value.as_object_mut()
    {
        members.insert("robot".into(), robot.into());
    }
    serde_json::to_string(&value)
}

/// Reads one line.
///
/// The text is first parsed to a JSON value: with serde_json's `arbitrary_precision`, which
/// defmt-decoder turns on when both are in one build, fractions in tagged, untagged and flattened
/// types cannot be read directly from text.
pub fn parse<T: DeserializeOwned>(line: &[u8]) -> serde_json::Result<T> {
    serde_json::from_value(serde_json::from_slice(line)?)
}

/// A command for the emulator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case", deny_unknown_fields)]
pub enum Command {
    /// Load an ELF file and turn the power on.
    Load {
        /// Path of the file.
        elf: PathBuf,
    },
    /// Write to flash or RAM, as a debugger would.
    Write {
        /// First address.
        address: u32,
        /// The bytes to write, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// Read flash, RAM, or the unique id and the bytes that were programmed once.
    Read {
        /// First address.
        address: u32,
        /// Number of bytes.
        length: u32,
    },
    /// Run until the given time.
    Run {
        /// Time since power-on.
        #[serde(rename = "until_ns", with = "nanoseconds")]
        until: Duration,
    },
    /// The radio's processor sends a syslink frame.
    Send {
        /// Type byte.
        #[serde(rename = "type")]
        kind: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
    },
    /// The radio's processor sends bytes, whatever they mean.
    Bytes {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// A P2P frame of another robot is on the air.
    P2p {
        /// The time of the frame's last bit; a time in the past means now.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// 0 to 15
        port: u8,
        /// Signal strength in -dBm.
        rssi: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
    },
    /// A ground station sends the robot its pose.
    Pose {
        /// x in mm.
        x_mm: f32,
        /// y in mm.
        y_mm: f32,
        /// z, up, in mm.
        z_mm: f32,
        /// Direction of the robot's nose in degrees, from x towards y.
        yaw_degrees: f32,
    },
    /// Changes the error rates of the line to the radio's processor, in both directions.
    Link {
        /// Probability that a byte is lost.
        lose: f64,
        /// Probability that a byte is changed.
        corrupt: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// Sets the behavior of the radio's processor from now on.
    RadioProcessor {
        /// False for firmware from before October 2025, which ignores RADIO_READY.
        #[serde(default = "yes")]
        ready: bool,
        /// Number of bytes in the UART's FIFO from which on RTS asks the STM32 to stop sending.
        #[serde(default = "rts_bytes")]
        rts_bytes: u8,
        /// Duration of Bluetooth's shutdown before the first packet that the radio sends or receives.
        #[serde(default = "ble_shutdown_us")]
        ble_shutdown_us: u64,
        /// True if no interrupt is served during that shutdown.
        #[serde(default)]
        ble_masks: bool,
    },
    /// The radio's processor restarts; the STM32 continues to run.
    RadioRestart,
    /// The radio's processor stops or restarts its UART's receiver; the flow control line shows it.
    FlowControl {
        /// True to stop the receiver.
        full: bool,
    },
    /// Sets or ends a fault of a device of a Crazyflie.
    DeviceFault {
        /// The device and its fault.
        fault: DeviceFault,
    },
    /// Sets the content of a Crazyflie's EEPROM; the bytes after the given ones are erased.
    Eeprom {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// Plugs decks into the expansion port of a Crazyflie, instead of those that it had.
    Decks {
        /// The decks, in the order in which the radio's processor finds their memories.
        decks: Vec<Deck>,
    },
    /// Sets the distances that the range finders of a Crazyflie's decks measure. A distance that is
    /// missing means that nothing is in range.
    Ranges {
        /// Distance to the ground in mm; a body replaces it.
        #[serde(default)]
        down_mm: Option<u16>,
        /// Distance to the front in mm.
        #[serde(default)]
        front_mm: Option<u16>,
        /// Distance to the back in mm.
        #[serde(default)]
        back_mm: Option<u16>,
        /// Distance to the left in mm.
        #[serde(default)]
        left_mm: Option<u16>,
        /// Distance to the right in mm.
        #[serde(default)]
        right_mm: Option<u16>,
        /// Distance upwards in mm.
        #[serde(default)]
        up_mm: Option<u16>,
    },
    /// Sets the state of the battery.
    Battery {
        /// Voltage in volts.
        volts: f32,
        /// True if the battery is being charged.
        charging: bool,
        /// True if USB is plugged in.
        usb_powered: bool,
    },
    /// The power button is pressed.
    Shutdown,
    /// Places a Zooid on its table, in the projector's frame, or a Kilobot, which has no heading
    /// here.
    Place {
        /// Distance to the right, in mm.
        x_mm: f64,
        /// Distance downwards as seen from above, in mm.
        y_mm: f64,
        /// Direction of the robot's antenna in degrees, from x towards y.
        heading_degrees: f64,
        /// Velocity along x in mm/s, until the robot is placed again.
        #[serde(default)]
        vx_mm_s: f64,
        /// Velocity along y in mm/s.
        #[serde(default)]
        vy_mm_s: f64,
        /// Rate of turn in degrees per second.
        #[serde(default)]
        turn_degrees_s: f64,
    },
    /// Moves a Zooid out of the projector's light, or a Kilobot out of sight of all others.
    Remove,
    /// Sets the faults of the projector's light on a Zooid.
    Light {
        /// Probability that a frame is lost.
        lose: f64,
        /// Largest deviation of an edge in µs, early or late.
        jitter_us: f64,
        /// Glitches per second at each photodiode, 1 to 50 µs long.
        #[serde(default)]
        glitches_per_s: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// Selects how a Zooid's radio detects power on its channel: its specification can be read in
    /// two ways.
    PowerDetector {
        /// The reading.
        reading: PowerDetector,
    },
    /// Sets the range of the light between Kilobots, and the error of measured distances.
    Infrared {
        /// Range between the robots' centers, in mm: half of the frames are bright enough there.
        range_mm: f64,
        /// Half of the width of the range's edge in mm: reception falls from 90 % to a half, and
        /// from there to 10 %, over this distance.
        #[serde(default)]
        edge_mm: f64,
        /// Standard deviation of a measured distance, in mm.
        noise_mm: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// Sets the error of a Kilobot's oscillator from now on.
    Clock {
        /// Error in ppm; a positive value means too fast.
        error_ppm: f64,
    },
    /// The surroundings that a Kilobot's sensors measure.
    Surroundings {
        /// Reading of the light sensor: 0 to 1023.
        light: u16,
        /// Temperature in degrees Celsius.
        celsius: f64,
    },
    /// Puts fingers on a Zooid's electrodes.
    Touch {
        /// One bit per electrode; bit 0 is the first electrode.
        keys: u8,
    },
    /// Sets properties of a Crazyflie's STM32 from its next reset on. A Zooid refuses `debugger`,
    /// and a Kilobot uses only `memory`.
    Chip {
        /// Frequency of the watchdog's oscillator in Hz.
        #[serde(default = "lsi_hz")]
        lsi_hz: u64,
        /// False if the crystal never oscillates.
        #[serde(default = "yes")]
        crystal: bool,
        /// The content of the RAM after a reset, and of the backup registers after a power-on.
        #[serde(default)]
        memory: Memory,
        /// Start of the pseudo-random sequence, if `memory` is noise.
        #[serde(default)]
        seed: u64,
        /// True if a debugger has control of the core.
        #[serde(default)]
        debugger: bool,
    },
    /// Sets the content of a Crazyflie's one-time programmable memory from its next reset on; the
    /// bytes after the given ones are erased.
    Otp {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// Resets a Crazyflie's STM32; Zooids and Kilobots accept only a brown-out.
    Reset {
        /// The cause that the chip records in its reset flags.
        cause: ResetCause,
    },
    /// Switches a Zooid on or off. Its flash keeps its content.
    Power {
        /// True to switch it on.
        on: bool,
    },
    /// Cuts a Zooid or a Kilobot off from the given robots; replaces the set of an earlier command.
    Deaf {
        /// Numbers of the robots that are no longer received.
        to: BTreeSet<usize>,
    },
    /// Sets the random loss of Zooids' packets or Kilobots' frames.
    Air {
        /// Probability that a packet is lost, independently for each receiver.
        lose: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// Sends a packet to all Zooids in the format of their own radios, or a frame to all Kilobots
    /// from a controller above the table.
    Radio {
        /// The time of the packet's first bit; a time in the past means now.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
    },
    /// Attaches or detaches the debug probe that reads the log; it is attached at the start.
    /// Without the probe nothing reads the log, and its channel stays in the blocking mode that
    /// probe-rs sets.
    Probe {
        /// True to attach the probe.
        attached: bool,
    },
    /// Halts the core as a debugger does, or lets it continue.
    Halt {
        /// True to halt the core.
        halted: bool,
    },
    /// Makes a function return at once from now on.
    Skip {
        /// The function's name: as in the symbol table, or a part of its path that no other
        /// function's path contains.
        symbol: String,
    },
    /// Gives a Crazyflie a body in the physics, which stands on the ground: its sensors measure the motion,
    /// and its motors move it.
    Body {
        /// The build of the robot and the noise of its sensors.
        seed: u64,
        /// Position along x in mm.
        #[serde(default)]
        x_mm: f64,
        /// Position along y in mm.
        #[serde(default)]
        y_mm: f64,
        /// Direction of the robot's nose in degrees, from x towards y.
        #[serde(default)]
        yaw_degrees: f64,
        /// Time in ms between two poses that motion capture sends the robot; 0 for no poses.
        #[serde(default)]
        pose_ms: u32,
        /// Standard deviation of each coordinate of these poses, in mm.
        #[serde(default = "pose_noise_mm")]
        pose_noise_mm: f64,
        /// Standard deviation of the rotation of these poses about each axis, in degrees.
        #[serde(default = "pose_noise_degrees")]
        pose_noise_degrees: f64,
    },
    /// Sets the air and the floor around the body of a Crazyflie from now on.
    Room(Room),
    /// Sets the errors of the poses that motion capture sends the body of a Crazyflie from now on.
    PoseErrors(PoseErrors),
    /// Sets the motors of the body of a Crazyflie, and their power, from now on.
    Powertrain(Powertrain),
    /// Sets or ends a fault of the measurements of a sensor on the body of a Crazyflie.
    BodyFault {
        /// The sensor.
        sensor: BodySensor,
        /// The fault; missing to end it.
        #[serde(default)]
        fault: Option<MeasurementFault>,
    },
    /// Opens a door for ground stations: CRTP packets in UDP datagrams at a port of this computer.
    Door {
        /// The port. cflib looks for robots at 19850 to 19859.
        port: u16,
    },
    /// Ask for the counters since power-on.
    Statistics,
    /// End the program.
    Quit,
}

/// An interpretation of the nRF24L01+'s product specification, 6.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PowerDetector {
    /// A packet sets the register RPD until CE goes low. This is the initial setting.
    Latched,
    /// The register follows the signal on the channel.
    Live,
}

impl From<PowerDetector> for chips::PowerDetector {
    fn from(reading: PowerDetector) -> Self {
        match reading {
            PowerDetector::Latched => chips::PowerDetector::Latched,
            PowerDetector::Live => chips::PowerDetector::Live,
        }
    }
}

fn lsi_hz() -> u64 {
    chips::ChipProperties::default().lsi_hz
}

fn rts_bytes() -> u8 {
    chips::Nrf51Settings::default().rts_bytes
}

fn ble_shutdown_us() -> u64 {
    chips::Nrf51Settings::default().ble_shutdown.nanos() / 1000
}

/// Noise of usual cameras, within the 0.1 to 1 mm of Preiss et al. 2017, "Crazyswarm".
fn pose_noise_mm() -> f64 {
    0.5
}

/// Noise of usual cameras (choice).
fn pose_noise_degrees() -> f64 {
    0.3
}

fn yes() -> bool {
    true
}

/// The content of memory after an event that does not preserve it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Memory {
    /// Unchanged.
    #[default]
    Kept,
    /// All zeros.
    Zeroed,
    /// Pseudo-random bytes.
    Noise,
}

/// A cause of a reset from outside the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResetCause {
    /// Power was applied.
    PowerOn,
    /// The supply voltage was too low for a moment.
    BrownOut,
    /// The reset pin was pulled low.
    Pin,
    /// A write to AIRCR, by a debugger or by a program out of control.
    Software,
}

/// One line from the emulator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum OutputLine {
    /// Something happened on a robot.
    Event(RobotEvent),
    /// A command is finished.
    Reply(Reply),
}

/// An event and the robot on which it happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotEvent {
    /// Number of the robot within the program; omitted for robot 0.
    #[serde(default, skip_serializing_if = "is_first")]
    pub robot: usize,
    /// The event and its time.
    #[serde(flatten)]
    pub timed: TimedEvent,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_first(robot: &usize) -> bool {
    *robot == 0
}

/// An event and its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedEvent {
    /// Time since power-on.
    #[serde(rename = "at_ns", with = "nanoseconds")]
    pub at: Duration,
    /// The event.
    #[serde(flatten)]
    pub event: EmulatorEvent,
}

/// An event on a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum EmulatorEvent {
    /// The firmware wrote to the log (RTT up channel 0).
    Rtt {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// A LED changed.
    Led {
        /// Name of the LED, such as `blue_left`; docs/emulation.md lists all.
        name: String,
        /// True if the LED is on.
        on: bool,
    },
    /// The signal at a motor changed.
    Motor {
        /// Number of the motor, 1 to 4. On a Zooid it is the number of a bridge input: IN1 and IN2
        /// of motor 1, then those of motor 2. On a Kilobot 1 is left and 2 is right.
        number: u8,
        /// Duty cycle of the signal, 0 to 1.
        duty: f64,
        /// Frequency of the PWM signal in Hz; 0 for a constant level.
        frequency_hz: f64,
    },
    /// The body of a flying robot moved: its true motion, 50 times per second.
    Motion {
        /// Position of the center of mass in m; z is up.
        position_m: [f64; 3],
        /// Velocity in m/s.
        velocity_m_s: [f64; 3],
        /// Rotation from the body frame to the world frame: x, y, z and w of a quaternion.
        attitude: [f64; 4],
        /// True once the robot crashed.
        crashed: bool,
        /// Voltage of the battery under load, in V.
        battery_volts: f64,
        /// Remaining charge of the battery, 0 to 1; missing after the command `battery`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        battery_charge: Option<f64>,
    },
    /// The firmware sent a syslink frame.
    Syslink {
        /// Type byte.
        #[serde(rename = "type")]
        kind: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// True if the checksum was correct.
        intact: bool,
    },
    /// The radio begins to transmit a P2P frame.
    P2p {
        /// 0 to 15
        port: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// Duration of the transmission; the radio receives nothing meanwhile.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// A Zooid begins to transmit a packet.
    Radio {
        /// Radio channel; the frequency is 2400 + `channel` MHz.
        channel: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// Duration of the transmission.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// A Kilobot's LED changed its color; each component is 0 to 3.
    #[serde(rename = "colour")]
    Color { red: u8, green: u8, blue: u8 },
    /// A Kilobot sent a frame; the time of the event is the beginning of the last pulse.
    Infrared {
        /// Data, type and checksum, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// Time since the frame's first pulse.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// A Kilobot sent bytes on its debug line.
    Serial {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// The script of a Kilobot completed a step.
    Step,
    /// The chip was reset.
    Reset {
        /// `software`, `independent_watchdog`, ...
        cause: String,
    },
    /// The power was cut.
    PowerOff {
        /// True if the firmware acknowledged the shutdown before.
        acknowledged: bool,
    },
    /// The bootloader started a loader instead of the firmware.
    Loader {
        /// `dfu` or `crtp`.
        name: String,
    },
    /// The firmware did something that the chip does not allow.
    HardwareError {
        /// The error and its remedy.
        text: String,
    },
    /// The core locked up: a fault occurred while it handled a fault.
    Lockup {
        /// The program counter.
        pc: u32,
    },
}

/// The reply to a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reply", rename_all = "snake_case")]
pub enum Reply {
    /// The command succeeded.
    Ok,
    /// The bytes that were read.
    Bytes {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// `run` ended.
    Paused {
        /// The time reached.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// The reason why it ended.
        reason: PauseReason,
        /// No robot decides before this time to transmit to robots of other programs, unless a
        /// command or a packet wakes it before.
        #[serde(rename = "silent_until_ns", with = "nanoseconds")]
        silent_until: Duration,
    },
    /// The counters.
    Statistics(Box<RobotStatistics>),
    /// The command was not executed.
    Error {
        /// The error and its remedy.
        message: String,
    },
}

/// The reason why `run` ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PauseReason {
    /// The requested time is reached.
    Time,
    /// The core is locked up, and no watchdog will reset it.
    Lockup,
    /// The power is off.
    PowerOff,
}

impl From<chips::BoardEvent> for EmulatorEvent {
    fn from(event: chips::BoardEvent) -> Self {
        match event {
            chips::BoardEvent::Led { led, on } => {
                EmulatorEvent::Led { name: led.name().into(), on }
            }
            chips::BoardEvent::Motor { number, duty, frequency_hz } => {
                EmulatorEvent::Motor { number, duty, frequency_hz }
            }
            chips::BoardEvent::Motion(motion) => {
                let chips::BodyMotion {
                    position_m,
                    velocity_m_s,
                    attitude,
                    has_crashed: crashed,
                    battery_volts,
                    battery_charge,
                } = motion;
                EmulatorEvent::Motion {
                    position_m,
                    velocity_m_s,
                    attitude,
                    crashed,
                    battery_volts,
                    battery_charge,
                }
            }
            chips::BoardEvent::Syslink { kind, payload, intact } => {
                EmulatorEvent::Syslink { kind, payload, intact }
            }
            chips::BoardEvent::P2p { port, payload, air } => {
                EmulatorEvent::P2p { port, payload, air: Duration::from_nanos(air.nanos()) }
            }
            chips::BoardEvent::Radio { channel, payload, air } => {
                EmulatorEvent::Radio { channel, payload, air: Duration::from_nanos(air.nanos()) }
            }
            chips::BoardEvent::Color { red, green, blue } => {
                EmulatorEvent::Color { red, green, blue }
            }
            chips::BoardEvent::Infrared { payload, air } => {
                EmulatorEvent::Infrared { payload, air: Duration::from_nanos(air.nanos()) }
            }
            chips::BoardEvent::Serial { bytes } => EmulatorEvent::Serial { bytes },
            chips::BoardEvent::PowerOff { acknowledged } => {
                EmulatorEvent::PowerOff { acknowledged }
            }
            chips::BoardEvent::Loader(loader) => {
                EmulatorEvent::Loader { name: loader.name().into() }
            }
            chips::BoardEvent::HardwareError(error) => {
                EmulatorEvent::HardwareError { text: error.to_string() }
            }
        }
    }
}

/// Durations as a number of nanoseconds.
mod nanoseconds {
    use std::time::Duration;

    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
        u64::deserialize(deserializer).map(Duration::from_nanos)
    }
}

/// Bytes as text: two hexadecimal digits each.
mod hex {
    use std::fmt::Write;

    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;

    pub fn serialize<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
        let mut text = String::with_capacity(2 * bytes.len());
        for byte in bytes {
            write!(text, "{byte:02x}").map_err(serde::ser::Error::custom)?;
        }
        serializer.serialize_str(&text)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
        let text = String::deserialize(deserializer)?;
        let digits: Option<Vec<u8>> =
            text.chars().map(|c| c.to_digit(16).map(|digit| digit as u8)).collect();
        match digits {
            Some(digits) if digits.len() % 2 == 0 => {
                Ok(digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect())
            }
            _ => {
                Err(D::Error::custom("bytes are written as pairs of hexadecimal digits: \"0a1b\""))
            }
        }
    }
}
