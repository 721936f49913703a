//! Faults of the devices of a Crazyflie.

use bittybuzz_chips::Time;
use bittybuzz_chips::devices::bmi088::Bmi088Fault;
use bittybuzz_chips::devices::bmp388::Bmp388Fault;
use bittybuzz_chips::devices::eeprom_24aa64::Eeprom24aa64Fault;
use bittybuzz_chips::devices::one_wire::OneWireFault;
use bittybuzz_chips::devices::pmw3901::Pmw3901Fault;
use bittybuzz_chips::devices::vl53l1x::Vl53l1xFault;
use serde::{Deserialize, Serialize};

/// A device and its fault; `None` ends the fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceFault {
    /// The BMI088: gyroscope and accelerometer.
    Imu(Option<ImuFault>),
    /// The BMP388.
    Barometer(Option<BarometerFault>),
    /// The memory 24AA64.
    Eeprom(Option<EepromFault>),
    /// The flow sensor PMW3901 of a Flow deck.
    Flow(Option<FlowFault>),
    /// The distance sensor VL53L1X of a Flow deck.
    Distance(Option<DistanceFault>),
    /// The memories of the decks.
    DeckMemories(Option<DeckMemoryFault>),
}

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
    /// SDA is held low until the master has sent this number of SCL pulses.
    SdaLow(u32),
    /// Neither sensor changes its data.
    FrozenData,
    /// The gyroscope reports no sample at its pin.
    NoDataReady,
    /// The gyroscope reports each sample late by this time in µs.
    LateDataReadyUs(u64),
    /// Both self-tests fail.
    FailedSelfTest,
}

/// A fault of the barometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BarometerFault {
    /// The chip has this identification.
    WrongId(u8),
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low until the master has sent this number of SCL pulses.
    SdaLow(u32),
    /// The chip repeats its last measurement.
    FrozenData,
    /// The chip measures nothing.
    NoMeasurement,
    /// The chip never reports that it is ready for a command.
    CommandNotReady,
    /// The chip reports a fatal error.
    FatalError,
}

/// A fault of the memory with the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EepromFault {
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low until the master has sent this number of SCL pulses.
    SdaLow(u32),
    /// Write cycles take their time, but change nothing.
    LostWrites,
    /// Write cycles take this time in ms.
    SlowWritesMs(u64),
}

/// A fault of the flow sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FlowFault {
    /// The chip has this identification.
    WrongId(u8),
    /// The chip does not drive MISO, which is pulled up.
    NoAnswer,
    /// The chip repeats its last motion.
    FrozenData,
}

/// A fault of the distance sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DistanceFault {
    /// The chip has this identification.
    WrongId(u16),
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low until the master has sent this number of SCL pulses.
    SdaLow(u32),
    /// The chip never reports the end of its boot.
    NoBoot,
    /// The chip repeats its last distance.
    FrozenData,
    /// The measurements do not end.
    NoMeasurement,
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

impl From<EepromFault> for Eeprom24aa64Fault {
    fn from(fault: EepromFault) -> Self {
        match fault {
            EepromFault::NoAcknowledge => Eeprom24aa64Fault::NoAcknowledge,
            EepromFault::SdaLow(clock_pulses) => Eeprom24aa64Fault::SdaLow { clock_pulses },
            EepromFault::LostWrites => Eeprom24aa64Fault::LostWrites,
            EepromFault::SlowWritesMs(ms) => Eeprom24aa64Fault::SlowWrites(Time::from_millis(ms)),
        }
    }
}

impl From<FlowFault> for Pmw3901Fault {
    fn from(fault: FlowFault) -> Self {
        match fault {
            FlowFault::WrongId(id) => Pmw3901Fault::WrongId(id),
            FlowFault::NoAnswer => Pmw3901Fault::NoAnswer,
            FlowFault::FrozenData => Pmw3901Fault::FrozenData,
        }
    }
}

impl From<DistanceFault> for Vl53l1xFault {
    fn from(fault: DistanceFault) -> Self {
        match fault {
            DistanceFault::WrongId(id) => Vl53l1xFault::WrongId(id),
            DistanceFault::NoAcknowledge => Vl53l1xFault::NoAcknowledge,
            DistanceFault::SdaLow(clock_pulses) => Vl53l1xFault::SdaLow { clock_pulses },
            DistanceFault::NoBoot => Vl53l1xFault::NoBoot,
            DistanceFault::FrozenData => Vl53l1xFault::FrozenData,
            DistanceFault::NoMeasurement => Vl53l1xFault::NoMeasurement,
        }
    }
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
