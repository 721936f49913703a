//! The equipment of a Crazyflie in the messages: its decks, and the faults of its chips.

use bittybuzz_chips::Time;
use bittybuzz_chips::devices::bmi088::Bmi088Fault;
use bittybuzz_chips::devices::bmp388::Bmp388Fault;
use bittybuzz_chips::devices::eeprom_24aa64::Eeprom24aa64Fault;
use bittybuzz_chips::devices::one_wire::OneWireFault;
use serde::{Deserialize, Serialize};

/// A fault of the BMI088: its gyroscope and its accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImuFault {
    /// The accelerometer has this identification.
    AccelerometerId(u8),
    /// The gyroscope has this identification.
    GyroscopeId(u8),
    /// Neither sensor acknowledges its address.
    NoAcknowledge,
    /// SDA is held low until the master has sent this number of pulses of SCL.
    SdaLow(u32),
    /// Neither sensor changes its data.
    FrozenData,
    /// The gyroscope reports no sample at its pin.
    NoDataReady,
    /// The gyroscope reports each sample so many µs late.
    LateDataReadyUs(u64),
    /// Both self-tests fail.
    FailedSelfTest,
}

impl From<ImuFault> for Bmi088Fault {
    fn from(fault: ImuFault) -> Self {
        match fault {
            ImuFault::AccelerometerId(id) => Bmi088Fault::AccelerometerId(id),
            ImuFault::GyroscopeId(id) => Bmi088Fault::GyroscopeId(id),
            ImuFault::NoAcknowledge => Bmi088Fault::NoAcknowledge,
            ImuFault::SdaLow(clock_pulses) => Bmi088Fault::SdaLow { clock_pulses },
            ImuFault::FrozenData => Bmi088Fault::FrozenData,
            ImuFault::NoDataReady => Bmi088Fault::NoDataReady,
            ImuFault::LateDataReadyUs(us) => Bmi088Fault::LateDataReady(Time::from_micros(us)),
            ImuFault::FailedSelfTest => Bmi088Fault::FailedSelfTest,
        }
    }
}

/// A fault of the barometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BarometerFault {
    /// The chip has this identification.
    WrongId(u8),
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low until the master has sent this number of pulses of SCL.
    SdaLow(u32),
    /// The chip repeats its last measurement as a new one.
    FrozenData,
    /// The chip measures nothing.
    NoMeasurement,
    /// The chip is never ready for a command.
    CommandNotReady,
    /// The chip reports a fatal error.
    FatalError,
}

impl From<BarometerFault> for Bmp388Fault {
    fn from(fault: BarometerFault) -> Self {
        match fault {
            BarometerFault::WrongId(id) => Bmp388Fault::WrongId(id),
            BarometerFault::NoAcknowledge => Bmp388Fault::NoAcknowledge,
            BarometerFault::SdaLow(clock_pulses) => Bmp388Fault::SdaLow { clock_pulses },
            BarometerFault::FrozenData => Bmp388Fault::FrozenData,
            BarometerFault::NoMeasurement => Bmp388Fault::NoMeasurement,
            BarometerFault::CommandNotReady => Bmp388Fault::CommandNotReady,
            BarometerFault::FatalError => Bmp388Fault::FatalError,
        }
    }
}

/// A fault of the EEPROM.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EepromFault {
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low until the master has sent this number of pulses of SCL.
    SdaLow(u32),
}

impl From<EepromFault> for Eeprom24aa64Fault {
    fn from(fault: EepromFault) -> Self {
        match fault {
            EepromFault::NoAcknowledge => Eeprom24aa64Fault::NoAcknowledge,
            EepromFault::SdaLow(clock_pulses) => Eeprom24aa64Fault::SdaLow { clock_pulses },
        }
    }
}

/// A deck on a Crazyflie's expansion port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Deck {
    /// The Flow deck v2.
    FlowV2,
    /// The Z-ranger v2.
    ZRangerV2,
    /// The Multi-ranger.
    MultiRanger,
    /// A deck with these bytes in its memory, in hexadecimal, and without chips on the buses. The
    /// rest of the memory is erased.
    Memory(#[serde(with = "super::hex")] Vec<u8>),
}

/// A fault of the memories of decks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeckMemoryFault {
    /// The radio's processor does not answer requests.
    NoAnswer,
    /// The radio's processor finds no memory.
    NoMemory,
    /// The radio's processor finds the memories, but cannot read them.
    Unreadable,
    /// The lowest bit of the byte at this location is wrong in each memory.
    WrongBit(u16),
}

impl From<DeckMemoryFault> for OneWireFault {
    fn from(fault: DeckMemoryFault) -> Self {
        match fault {
            DeckMemoryFault::NoAnswer => OneWireFault::NoAnswer,
            DeckMemoryFault::NoMemory => OneWireFault::NoMemory,
            DeckMemoryFault::Unreadable => OneWireFault::Unreadable,
            DeckMemoryFault::WrongBit(location) => OneWireFault::WrongBit(location),
        }
    }
}
