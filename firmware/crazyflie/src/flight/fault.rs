//! The faults of the robot's own sensors.

use bittybuzz_bmi088 as bmi088;
use bittybuzz_bmp3xx as bmp3xx;

use crate::bus::BusError;

/// A sensor on the robot's board.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Sensor {
    Gyroscope,
    Accelerometer,
    Barometer,
}

/// A fault of a sample.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum SampleFault {
    /// There was no data-ready pulse.
    NoPulse,
    /// A transaction did not end in time.
    BusSilent,
    /// A chip held a line of the bus, which was freed. The sample was read.
    BusHeld,
    /// A transaction failed.
    Bus(BusError),
}

/// A reason why a sensor does not start.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct StartFault {
    pub sensor: Sensor,
    pub cause: StartCause,
}

/// The cause of a [`StartFault`].
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum StartCause {
    /// The bus has an error.
    Bus(BusError),
    /// The chip has another identity.
    WrongId(u8),
    /// A register does not hold the value that was written.
    Refused { register: u8, found: u8 },
    /// The self-test failed: the chip is broken, or the robot moves.
    TestFailed,
    /// The calibration in the chip is damaged.
    CalibrationDamaged,
    /// The start or the self-test did not end in time.
    Timeout,
}

impl From<bmi088::Error<BusError>> for StartCause {
    fn from(error: bmi088::Error<BusError>) -> Self {
        match error {
            bmi088::Error::Bus(error) => StartCause::Bus(error),
            bmi088::Error::WrongId { found } => StartCause::WrongId(found),
            bmi088::Error::ConfigurationRefused { register, found } => {
                StartCause::Refused { register, found }
            }
            bmi088::Error::GyroscopeTestFailed | bmi088::Error::AccelerometerTestFailed { .. } => {
                StartCause::TestFailed
            }
            bmi088::Error::Timeout => StartCause::Timeout,
        }
    }
}

impl From<bmp3xx::Error<BusError>> for StartCause {
    fn from(error: bmp3xx::Error<BusError>) -> Self {
        match error {
            bmp3xx::Error::Bus(error) => StartCause::Bus(error),
            bmp3xx::Error::WrongId { found } => StartCause::WrongId(found),
            bmp3xx::Error::ConfigurationRefused { register, found } => {
                StartCause::Refused { register, found }
            }
            bmp3xx::Error::CalibrationDamaged { .. } => StartCause::CalibrationDamaged,
            bmp3xx::Error::CommandRefused { .. }
            | bmp3xx::Error::Broken { .. }
            | bmp3xx::Error::Implausible(_) => StartCause::TestFailed,
            bmp3xx::Error::Timeout => StartCause::Timeout,
        }
    }
}

impl defmt::Format for StartFault {
    fn format(&self, f: defmt::Formatter<'_>) {
        let sensor = self.sensor;
        match self.cause {
            StartCause::Bus(error) => defmt::write!(f, "{} does not answer: {}", sensor, error),
            StartCause::WrongId(id) => {
                defmt::write!(f, "{} is another chip, with id {=u8:#x}", sensor, id)
            }
            StartCause::Refused { register, found } => defmt::write!(
                f,
                "{} does not take its settings: register {=u8:#x} holds {=u8:#x}",
                sensor,
                register,
                found
            ),
            StartCause::TestFailed => {
                defmt::write!(f, "{} fails its self-test", sensor)
            }
            StartCause::CalibrationDamaged => {
                defmt::write!(f, "{} has a damaged calibration", sensor)
            }
            StartCause::Timeout => defmt::write!(f, "{} does not start", sensor),
        }
    }
}

/// A reason why the sensors are not fit for flight.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum SensorRefusal {
    /// The sensors have not started since power-on.
    NotStarted,
    /// A sensor is missing, wrong or broken.
    Start(StartFault),
    /// The samples failed, and the sensors are started again.
    Stopped(SampleFault),
    /// A sensor repeats its values.
    Frozen(Sensor),
}

impl defmt::Format for SensorRefusal {
    fn format(&self, f: defmt::Formatter<'_>) {
        match *self {
            SensorRefusal::NotStarted => defmt::write!(f, "the sensors have not started yet"),
            SensorRefusal::Start(fault) => defmt::write!(f, "{}", fault),
            SensorRefusal::Stopped(fault) => defmt::write!(f, "no samples after {}", fault),
            SensorRefusal::Frozen(sensor) => defmt::write!(f, "{} repeats its values", sensor),
        }
    }
}
