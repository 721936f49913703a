//! Faults of sensors.

/// A fault of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// The sensor repeats its last measurement.
    Stuck,
    /// The noise is larger by this factor.
    Noisy(f64),
    /// The sensor returns nothing.
    Silent,
}

/// The present fault of a sensor and its last measurement.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FaultGate<T> {
    pub(super) fault: Option<SensorFault>,
    last: Option<T>,
}

impl<T: Copy> FaultGate<T> {
    pub(super) const fn new() -> Self {
        FaultGate { fault: None, last: None }
    }

    /// Returns the factor on the noise.
    pub(super) fn noise_factor(&self) -> f64 {
        match self.fault {
            Some(SensorFault::Noisy(factor)) if factor.is_finite() => factor.max(0.0),
            _ => 1.0,
        }
    }

    /// Returns the measurement that leaves the sensor in place of this one.
    pub(super) fn pass(&mut self, reading: T) -> Option<T> {
        match self.fault {
            Some(SensorFault::Silent) => None,
            Some(SensorFault::Stuck) => Some(*self.last.get_or_insert(reading)),
            Some(SensorFault::Noisy(_)) | None => {
                self.last = Some(reading);
                Some(reading)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensor_faults_change_the_readings() {
        let mut gate = FaultGate::new();
        assert_eq!(gate.pass(1), Some(1));
        gate.fault = Some(SensorFault::Stuck);
        assert_eq!([gate.pass(2), gate.pass(3)], [Some(1), Some(1)]);
        gate.fault = Some(SensorFault::Silent);
        assert_eq!(gate.pass(4), None);
        gate.fault = Some(SensorFault::Noisy(7.0));
        assert_eq!((gate.pass(5), gate.noise_factor()), (Some(5), 7.0));
        gate.fault = Some(SensorFault::Noisy(f64::NAN));
        assert_eq!(gate.noise_factor(), 1.0);
    }
}
