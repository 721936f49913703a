//! The results of measurements.

/// The number of bytes of a result, from the register 0x0089 on.
pub const RESULT_BYTES: usize = 17;

/// The bits of the status that name the outcome.
const STATUS_BITS: u8 = 0x1f;

/// A result as the chip reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// The outcome; 9 is a valid distance.
    pub status: u8,
    /// The number of the measurement, which the chip counts. Two readings with the same number are
    /// the same measurement.
    pub stream_count: u8,
    pub distance_mm: u16,
    /// The returned signal, in units of 1/128 Mcps (million counts per second).
    pub signal_mcps_128: u16,
    /// The ambient light, in the same unit.
    pub ambient_mcps_128: u16,
}

/// A valid distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    pub meters: f32,
}

/// A reason why a measurement has no distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeFault {
    /// The laser or the chip failed.
    Hardware,
    /// The signal is below the threshold: nothing is near, or it is dark.
    SignalTooWeak,
    /// The phase of the signal is outside its limits: nothing is near.
    OutOfBounds,
    /// The measurement scatters too much.
    DeviationTooLarge,
    /// The target is beyond the range, and its distance appears shorter than it is.
    WrappedAround,
    /// A status without a meaning for the caller, for example that of the very first measurement.
    Other { status: u8 },
}

impl Reading {
    /// Reads a result. The registers have two bytes, the high byte first.
    pub(crate) fn new(bytes: [u8; RESULT_BYTES]) -> Reading {
        let [
            status,
            _report,
            stream_count,
            _spads_high,
            _spads_low,
            _,
            _,
            ambient_high,
            ambient_low,
            _sigma_high,
            _sigma_low,
            _phase_high,
            _phase_low,
            distance_high,
            distance_low,
            signal_high,
            signal_low,
        ] = bytes;
        Reading {
            status: status & STATUS_BITS,
            stream_count,
            distance_mm: u16::from_be_bytes([distance_high, distance_low]),
            signal_mcps_128: u16::from_be_bytes([signal_high, signal_low]),
            ambient_mcps_128: u16::from_be_bytes([ambient_high, ambient_low]),
        }
    }

    /// Returns the distance, or the reason why there is none.
    ///
    /// # Errors
    /// Returns the fault that the status names.
    pub fn distance(self) -> Result<Distance, RangeFault> {
        match self.status {
            9 => Ok(Distance { meters: f32::from(self.distance_mm) / 1000.0 }),
            3 => Err(RangeFault::Hardware),
            4 => Err(RangeFault::SignalTooWeak),
            5 => Err(RangeFault::OutOfBounds),
            6 => Err(RangeFault::DeviationTooLarge),
            7 => Err(RangeFault::WrappedAround),
            status => Err(RangeFault::Other { status }),
        }
    }
}
