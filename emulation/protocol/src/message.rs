//! The messages between the two ends, one JSON object per line.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

mod statistics;

pub use statistics::{
    AirStatistics, BoardStatistics, CoreStatistics, CrazyflieStatistics, KilobotStatistics,
    Statistics, ZooidStatistics,
};

use bittybuzz_chips as chips;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Reads a command, and which robot it is for: member `robot`, 0 if there is none.
pub(crate) fn parse_command(line: &[u8]) -> serde_json::Result<(usize, Command)> {
    let mut value: serde_json::Value = serde_json::from_slice(line)?;
    let robot = match value.as_object_mut().and_then(|members| members.remove("robot")) {
        Some(robot) => serde_json::from_value(robot)?,
        None => 0,
    };
    Ok((robot, serde_json::from_value(value)?))
}

/// Writes a command for one of several robots.
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
/// It goes by way of a value: with serde_json's `arbitrary_precision`, which defmt-decoder turns on where both are built
/// together, the fractions in tagged, untagged and flattened types are not read from text.
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
    /// Run until the given time since power-on.
    Run {
        /// The time.
        #[serde(rename = "until_ns", with = "nanoseconds")]
        until: Duration,
    },
    /// The radio's processor sends a frame.
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
    /// Another robot's P2P frame is on the air.
    P2p {
        /// The time of its last bit; not before now.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// 0 to 15
        port: u8,
        /// Strength of its signal in -dBm.
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
        /// Direction of its nose in degrees, from x towards y.
        yaw_degrees: f32,
    },
    /// The line to the radio's processor becomes bad.
    Link {
        /// Probability that a byte is lost.
        lose: f64,
        /// Probability that a byte is changed.
        corrupt: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// The radio's processor has this firmware, and is like this, from now on.
    RadioProcessor {
        /// False for firmware from before October 2025, which ignores RADIO_READY.
        #[serde(default = "yes")]
        ready: bool,
        /// Bytes in its UART's FIFO from which on it says that no more should come.
        #[serde(default = "rts_bytes")]
        rts_bytes: u8,
        /// Duration of Bluetooth's shutdown before the first packet that the radio sends or receives.
        #[serde(default = "ble_shutdown_us")]
        ble_shutdown_us: u64,
        /// True if no interrupt is served during that shutdown.
        #[serde(default)]
        ble_masks: bool,
    },
    /// The radio's processor restarts, while the STM32 goes on.
    RadioRestart,
    /// The radio's processor stops its UART's receiver, which says so, or goes on.
    FlowControl {
        /// True if it stops.
        full: bool,
    },
    /// The battery changes.
    Battery {
        /// Its voltage.
        volts: f32,
        /// True if it is being charged.
        charging: bool,
        /// True if USB is plugged in.
        usb_powered: bool,
    },
    /// The power button is pressed.
    Shutdown,
    /// The place of a Zooid on its table, in the projector's frame; or of a Kilobot, without its
    /// heading.
    Place {
        /// To the right, in mm.
        x_mm: f64,
        /// Down as seen from above, in mm.
        y_mm: f64,
        /// The direction of its antenna in degrees, from x towards y.
        heading_degrees: f64,
        /// Its velocity until it is placed again: mm/s along x.
        #[serde(default)]
        vx_mm_s: f64,
        /// mm/s along y.
        #[serde(default)]
        vy_mm_s: f64,
        /// Degrees per second.
        #[serde(default)]
        turn_degrees_s: f64,
    },
    /// A Zooid is where no projector sees it.
    Remove,
    /// The projector's light on a Zooid becomes bad.
    Light {
        /// Probability that a frame is lost.
        lose: f64,
        /// The largest time in µs by which edges come too early or too late.
        jitter_us: f64,
        /// Glitches per second at each photodiode, 1 to 50 µs long.
        #[serde(default)]
        glitches_per_s: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// A Zooid's radio detects power on its channel as one of two readings of its specification says.
    PowerDetector {
        /// The reading.
        reading: PowerDetector,
    },
    /// The light between Kilobots: its reach, and the error of measured distances.
    Infrared {
        /// Between their centres, in mm.
        range_mm: f64,
        /// Standard deviation of a measured distance, in mm.
        noise_mm: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// A Kilobot's oscillator runs wrong from now on.
    Clock {
        /// The error of the clock, in millionths too fast.
        error_ppm: f64,
    },
    /// The surroundings that a Kilobot's sensors measure.
    Surroundings {
        /// Light, as the converter reads it: 0 to 1023.
        light: u16,
        /// Temperature in degrees Celsius.
        celsius: f64,
    },
    /// Fingers are on a Zooid's electrodes.
    Touch {
        /// Bit 0 is the first electrode.
        keys: u8,
    },
    /// A Crazyflie's STM32 is like this from its next reset on. Of a Zooid only LSI and crystal can be chosen.
    Chip {
        /// Frequency of the watchdog's oscillator.
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
    /// From its next reset on a Crazyflie's one-time programmable memory holds these bytes, and is erased after them.
    Otp {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// A Crazyflie's STM32 is reset.
    Reset {
        /// The cause that the chip notes.
        cause: ResetCause,
    },
    /// Switches a Zooid on or off. Its flash keeps its content.
    Power {
        /// True to switch it on.
        on: bool,
    },
    /// A Zooid receives nothing from these others; the links to all others are as before.
    Deaf {
        /// Their numbers.
        to: BTreeSet<usize>,
    },
    /// Zooids lose packets on the air, Kilobots frames.
    Air {
        /// Probability that a packet is lost, for each receiver on its own.
        lose: f64,
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
    /// Sends a packet to the Zooids as they send to each other; to Kilobots from a controller above
    /// the table.
    Radio {
        /// The time of its first bit; not before now.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
    },
    /// A debug probe reads the log, as from the start; or its cable is pulled: the log's channel blocks, as probe-rs has set it,
    /// and is not read.
    Probe {
        /// True if it is plugged in.
        attached: bool,
    },
    /// A debugger halts the core, or lets it go on.
    Halt {
        /// True if it halts.
        halted: bool,
    },
    /// A function returns at once from now on.
    Skip {
        /// Its name: as in the symbol table, or a part of the path that only it has.
        symbol: String,
    },
    /// Ask for the counters.
    Statistics,
    /// End the program.
    Quit,
}

/// A reading of the nRF24L01+'s product specification, 6.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PowerDetector {
    /// A packet sets the register RPD until CE goes low. A radio begins with this one.
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
    chips::Chip::default().lsi_hz
}

fn rts_bytes() -> u8 {
    chips::Nrf51Settings::default().rts_bytes
}

fn ble_shutdown_us() -> u64 {
    chips::Nrf51Settings::default().ble_shutdown.nanos() / 1000
}

fn yes() -> bool {
    true
}

/// The content of memory after an event that guarantees none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Memory {
    /// Unchanged.
    #[default]
    Kept,
    /// All zeros.
    Zeroed,
    /// Anything.
    Noise,
}

/// A reset that comes from outside the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResetCause {
    /// Power was applied.
    PowerOn,
    /// The supply was too low for a moment.
    BrownOut,
    /// The reset pin was pulled.
    Pin,
    /// A write to AIRCR: by a debugger, or by a program that has lost its way.
    Software,
}

/// One line from the emulator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Output {
    /// Something happened on a robot.
    Event(RobotEvent),
    /// A command is finished.
    Reply(Reply),
}

/// An event and where it happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotEvent {
    /// Which robot of the program's; not written for the first.
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
    /// Since power-on.
    #[serde(rename = "at_ns", with = "nanoseconds")]
    pub at: Duration,
    /// The event.
    #[serde(flatten)]
    pub event: Event,
}

/// An event on a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The firmware logged (RTT up channel 0).
    Rtt {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// A LED changed.
    Led {
        /// Its name.
        name: String,
        /// True if it shines.
        on: bool,
    },
    /// The signal at a motor changed.
    Motor {
        /// 1 to 4; of a Zooid the inputs of its bridges, IN1 and IN2 of motor 1, then those of motor 2; of a Kilobot left and
        /// right.
        number: u8,
        /// Part of the time that it is on, 0 to 1.
        duty: f64,
        /// The frequency at which it is turned on; 0 for a constant level.
        frequency_hz: f64,
    },
    /// The firmware sent a frame.
    Syslink {
        /// Type byte.
        #[serde(rename = "type")]
        kind: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// True if its checksum was right.
        intact: bool,
    },
    /// The radio begins to transmit a P2P frame.
    P2p {
        /// 0 to 15
        port: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// The time on the air; the radio is deaf meanwhile.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// A Zooid begins to transmit a packet.
    Radio {
        /// It is sent at 2400 + `channel` MHz.
        channel: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// The time on the air.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// A Kilobot's LED changed its colour; each part is 0 to 3.
    Colour {
        /// Red.
        red: u8,
        /// Green.
        green: u8,
        /// Blue.
        blue: u8,
    },
    /// A Kilobot has sent a frame; its last pulse begins.
    Infrared {
        /// Data, type and checksum, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// Since its first pulse.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// A Kilobot has sent bytes on its debug line.
    Serial {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// The script of a Kilobot has completed a step.
    Step,
    /// The chip was reset.
    Reset {
        /// `software`, `independent_watchdog`, ...
        cause: String,
    },
    /// The power was cut.
    PowerOff {
        /// True if the firmware had acknowledged.
        acknowledged: bool,
    },
    /// The bootloader has started a loader instead of the firmware.
    Loader {
        /// `dfu` or `crtp`.
        name: String,
    },
    /// The firmware did something that the chip does not allow.
    HardwareError {
        /// The error, and the cure.
        text: String,
    },
    /// The core locked up: a fault while it handled a fault.
    Lockup {
        /// The program counter.
        pc: u32,
    },
}

/// The end of a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reply", rename_all = "snake_case")]
pub enum Reply {
    /// Well.
    Ok,
    /// With the bytes that were read.
    Bytes {
        /// The bytes, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// `run` is over.
    Paused {
        /// The time reached.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// The reason.
        reason: PauseReason,
    },
    /// The counters.
    Statistics(Box<Statistics>),
    /// Not done.
    Error {
        /// The error, and the cure.
        message: String,
    },
}

/// The reason why `run` has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PauseReason {
    /// The time is reached.
    Time,
    /// The core is locked up: only a reset would help, and none will come.
    Lockup,
    /// The power is off.
    PowerOff,
}

impl From<chips::Event> for Event {
    fn from(event: chips::Event) -> Self {
        match event {
            chips::Event::Led { led, on } => Event::Led { name: led.name().into(), on },
            chips::Event::Motor { number, duty, frequency_hz } => {
                Event::Motor { number, duty, frequency_hz }
            }
            chips::Event::Syslink { kind, payload, intact } => {
                Event::Syslink { kind, payload, intact }
            }
            chips::Event::P2p { port, payload, air } => {
                Event::P2p { port, payload, air: Duration::from_nanos(air.nanos()) }
            }
            chips::Event::Radio { channel, payload, air } => {
                Event::Radio { channel, payload, air: Duration::from_nanos(air.nanos()) }
            }
            chips::Event::Colour { red, green, blue } => Event::Colour { red, green, blue },
            chips::Event::Infrared { payload, air } => {
                Event::Infrared { payload, air: Duration::from_nanos(air.nanos()) }
            }
            chips::Event::Serial { bytes } => Event::Serial { bytes },
            chips::Event::PowerOff { acknowledged } => Event::PowerOff { acknowledged },
            chips::Event::Loader(loader) => Event::Loader { name: loader.name().into() },
            chips::Event::HardwareError(error) => Event::HardwareError { text: error.to_string() },
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
