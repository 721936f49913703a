//! What the two ends say to each other, one JSON object per line.

use std::path::PathBuf;
use std::time::Duration;

use bittybuzz_chips as chips;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Reads one line.
///
/// It goes by way of a value: with serde_json's `arbitrary_precision`, which defmt-decoder turns on where both are built
/// together, the fractions in tagged, untagged and flattened types are not read from text.
pub fn parse<T: DeserializeOwned>(line: &[u8]) -> serde_json::Result<T> {
    serde_json::from_value(serde_json::from_slice(line)?)
}

/// What the emulator shall do.
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
        /// What to write, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// Read flash, RAM, or the unique id and what was programmed once.
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
        /// When its last bit comes; not before now.
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
    /// A ground station tells the robot where it is.
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
    /// The radio's processor stops to take bytes, or goes on.
    FlowControl {
        /// Whether it stops.
        full: bool,
    },
    /// The battery changes.
    Battery {
        /// Its voltage.
        volts: f32,
        /// Whether it is being charged.
        charging: bool,
        /// Whether USB is plugged in.
        usb_powered: bool,
    },
    /// The power button is pressed.
    Shutdown,
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

/// One line from the emulator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Output {
    /// Something happened on the robot.
    Event(TimedEvent),
    /// A command is finished.
    Reply(Reply),
}

/// An event and its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedEvent {
    /// Since power-on.
    #[serde(rename = "at_ns", with = "nanoseconds")]
    pub at: Duration,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

/// What happens on a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The firmware logged (RTT up channel 0).
    Rtt {
        /// What came, in hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// A LED changed.
    Led {
        /// Its name.
        name: String,
        /// Whether it shines.
        on: bool,
    },
    /// The signal at a motor changed.
    Motor {
        /// 1 to 4.
        number: u8,
        /// Part of the time that it is on, 0 to 1.
        duty: f64,
        /// How often it is turned on; 0 for a constant level.
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
        /// Whether its checksum was right.
        intact: bool,
    },
    /// The radio begins to transmit a P2P frame.
    P2p {
        /// 0 to 15
        port: u8,
        /// Content, in hexadecimal.
        #[serde(with = "hex")]
        payload: Vec<u8>,
        /// How long it takes; the radio is deaf meanwhile.
        #[serde(rename = "air_ns", with = "nanoseconds")]
        air: Duration,
    },
    /// The chip was reset.
    Reset {
        /// `software`, `independent_watchdog`, ...
        cause: String,
    },
    /// The power was cut.
    PowerOff {
        /// Whether the firmware had acknowledged.
        acknowledged: bool,
    },
    /// The firmware did what the chip does not allow.
    HardwareError {
        /// What, and what to do.
        text: String,
    },
    /// The core locked up: a fault while it handled a fault.
    Lockup {
        /// Where.
        pc: u32,
    },
}

/// How a command ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reply", rename_all = "snake_case")]
pub enum Reply {
    /// Well.
    Ok,
    /// With the bytes that were read.
    Bytes {
        /// In hexadecimal.
        #[serde(with = "hex")]
        bytes: Vec<u8>,
    },
    /// `run` is over.
    Paused {
        /// The time reached.
        #[serde(rename = "at_ns", with = "nanoseconds")]
        at: Duration,
        /// Why.
        reason: PauseReason,
    },
    /// The counters.
    Statistics(Box<Statistics>),
    /// Not done.
    Error {
        /// Why, and what to do.
        message: String,
    },
}

/// Why `run` is over.
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

/// Counters since power-on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// What the core counted.
    pub core: CoreStatistics,
    /// What the board counted.
    pub board: BoardStatistics,
}

/// What a core counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CoreStatistics {
    /// Instructions executed.
    pub instructions: u64,
    /// Exceptions taken.
    pub exceptions: u64,
    /// Longest time that interrupts were masked.
    #[serde(rename = "longest_masked_ns", with = "nanoseconds")]
    pub longest_masked: Duration,
}

/// What a board counts; the meaning of each stands in [`bittybuzz_chips::Statistics`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "bittybuzz_chips::Statistics says it")]
pub struct BoardStatistics {
    #[serde(rename = "receive_latency_ns", with = "nanoseconds")]
    pub receive_latency: Duration,
    pub overruns: u64,
    pub framing_errors: u64,
    pub peer_received: u64,
    pub peer_framing_errors: u64,
    pub peer_bad_checksums: u64,
    pub peer_dropped: u64,
    pub peer_unsent: u64,
    pub radio_unheard: u64,
    pub radio_overflown: u64,
    pub link_lost: u64,
    pub link_corrupted: u64,
    pub clocks_hz: [u64; 3],
    pub accesses_without_clock: u64,
    pub unknown: Vec<u32>,
}

impl From<chips::Statistics> for BoardStatistics {
    fn from(s: chips::Statistics) -> Self {
        BoardStatistics {
            receive_latency: Duration::from_nanos(s.receive_latency.nanos()),
            overruns: s.overruns,
            framing_errors: s.framing_errors,
            peer_received: s.peer_received,
            peer_framing_errors: s.peer_framing_errors,
            peer_bad_checksums: s.peer_bad_checksums,
            peer_dropped: s.peer_dropped,
            peer_unsent: s.peer_unsent,
            radio_unheard: s.radio_unheard,
            radio_overflown: s.radio_overflown,
            link_lost: s.link_lost,
            link_corrupted: s.link_corrupted,
            clocks_hz: s.clocks_hz,
            accesses_without_clock: s.accesses_without_clock,
            unknown: s.unknown,
        }
    }
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
            chips::Event::PowerOff { acknowledged } => Event::PowerOff { acknowledged },
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
