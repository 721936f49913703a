//! The battery: an open-circuit voltage by charge, in series with a resistance.

/// The parameters of a cell and of the current that a robot draws from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryCell {
    /// Capacity in A·h.
    pub capacity_a_h: f64,
    /// Resistance of cell, connectors and lines in Ω.
    pub resistance_ohm: f64,
    /// Current of the electronics in A.
    pub idle_a: f64,
    /// Current of the motors: coefficients of the total thrust and of its square, in A/N and A/N².
    pub current_a_n: [f64; 2],
}

/// Open-circuit voltage of a lithium polymer cell at 0, 10, ... 100 % of its charge.
const OPEN_CIRCUIT_V: [f64; 11] =
    [3.00, 3.78, 3.83, 3.87, 3.89, 3.92, 3.96, 4.00, 4.04, 4.10, 4.20];

impl BatteryCell {
    /// Returns the voltage without load at this charge, in V.
    ///
    /// # Parameters
    /// `charge`: 0 (empty) to 1 (full); other values are limited to this range.
    #[must_use]
    pub fn open_circuit_volts(&self, charge: f64) -> f64 {
        let place = charge.clamp(0.0, 1.0) * 10.0;
        let below = (place as usize).min(9);
        let share = place - below as f64;
        OPEN_CIRCUIT_V[below] * (1.0 - share) + OPEN_CIRCUIT_V[below + 1] * share
    }

    /// Returns the current at this total thrust, in A.
    ///
    /// The current of a motor that gains speed is higher, which is neglected.
    #[must_use]
    pub fn current_a(&self, total_thrust_n: f64) -> f64 {
        let [linear, square] = self.current_a_n;
        self.idle_a + (linear + square * total_thrust_n) * total_thrust_n
    }

    /// Returns the voltage under load at this charge and total thrust, in V.
    #[must_use]
    pub fn loaded_volts(&self, charge: f64, total_thrust_n: f64) -> f64 {
        let sag = self.resistance_ohm * self.current_a(total_thrust_n);
        (self.open_circuit_volts(charge) - sag).max(0.0)
    }
}

/// The source of a robot's power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PowerSource {
    /// The battery, which discharges and whose voltage sags under load.
    Battery {
        /// Remaining charge: 0 (empty) to 1 (full).
        charge: f64,
    },
    /// A voltage that does not change.
    Constant {
        /// Voltage in V.
        volts: f64,
    },
}

impl PowerSource {
    /// A full battery.
    pub const FULL: Self = PowerSource::Battery { charge: 1.0 };

    /// Returns the voltage at this total thrust, in V.
    pub(crate) fn volts(self, cell: &BatteryCell, total_thrust_n: f64) -> f64 {
        match self {
            PowerSource::Battery { charge } => cell.loaded_volts(charge, total_thrust_n),
            PowerSource::Constant { volts } => volts,
        }
    }

    /// Takes the charge of this total thrust for `seconds` from the battery.
    pub(crate) fn discharge(&mut self, cell: &BatteryCell, total_thrust_n: f64, seconds: f64) {
        if let PowerSource::Battery { charge } = self {
            let used = cell.current_a(total_thrust_n) * seconds / (cell.capacity_a_h * 3600.0);
            *charge = (*charge - used).max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Airframe;

    const CELL: BatteryCell = Airframe::CRAZYFLIE_2_1_PLUS.battery;

    #[test]
    fn voltages_lie_on_the_ladder() {
        assert_eq!(CELL.open_circuit_volts(0.0), 3.0);
        assert_eq!(CELL.open_circuit_volts(1.0), 4.2);
        assert!((CELL.open_circuit_volts(0.55) - 3.94).abs() < 1e-12);
        assert_eq!(CELL.open_circuit_volts(7.0), 4.2);
        assert_eq!(CELL.open_circuit_volts(-7.0), 3.0);
        let steps = (0..=1000).map(|i| CELL.open_circuit_volts(f64::from(i) / 1000.0));
        assert!(steps.clone().zip(steps.skip(1)).all(|(low, high)| low < high));
    }

    /// The bench of 2015: 28.6 g at 2.11 A and 57.9 g at 4.44 A.
    #[test]
    fn current_matches_the_bench() {
        for (grams, amperes) in [(0.0, 0.24), (28.6, 2.11), (57.9, 4.44)] {
            let found = CELL.current_a(grams * 9.81e-3);
            assert!((found - amperes).abs() < 0.01, "{found}");
        }
    }

    /// The manufacturer claims 7 minutes of hover for the 2.0, which weighs 27 g.
    #[test]
    fn hover_lasts_seven_minutes() {
        let thrust = 0.027 * 9.81;
        let mut source = PowerSource::FULL;
        let mut seconds = 0;
        while source.volts(&CELL, thrust) > 3.0 {
            source.discharge(&CELL, thrust, 1.0);
            seconds += 1;
        }
        assert!((360..=480).contains(&seconds), "{seconds}");
    }
}
