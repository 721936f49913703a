//! Thrust by voltage, and duty by the voltage of the battery.

use crate::bounds::{at_least, at_most};
use crate::{MotorDuties, MotorForces, Vehicle};

/// Iterations of Newton's method, at most. Six are enough over the range of the vehicles.
const ITERATIONS_MAX: usize = 20;

/// Least voltage in V of a battery that drives motors; a lower value is no measurement.
const BATTERY_V_MIN: f32 = 2.0;

/// Largest voltage in V that the inverse returns, more than the battery of any such robot.
const VOLTAGE_V_MAX: f32 = 20.0;

/// Returns the thrust in N of a motor at rest with the given voltage, 0 or more.
pub fn steady_thrust_n(vehicle: &Vehicle, voltage_v: f32) -> f32 {
    let [c0, c1, c2, c3] = vehicle.thrust_n_v;
    (c0 + voltage_v * (c1 + voltage_v * (c2 + voltage_v * c3))).max(0.0)
}

/// Returns the voltage in V from which on the thrust bends to the other side, 0 or more.
const fn inflection_v(vehicle: &Vehicle) -> f32 {
    let [_, _, c2, c3] = vehicle.thrust_n_v;
    let inflection = -c2 / (3.0 * c3);
    if inflection.is_finite() { at_least(inflection, 0.0) } else { 0.0 }
}

/// Returns the voltage in V that gives the thrust in N, the inverse of [`steady_thrust_n`].
///
/// A thrust of zero or less, or one that is not finite, needs no voltage. The polynomial must grow
/// with the voltage, as it does for the vehicles of this crate.
///
/// Newton's method starts at `near_v`, but not beyond the [inflection point](inflection_v) of the
/// cubic as seen from the root. The first step therefore goes past the root or hits it, to the side
/// where the cubic bends away from the axis, and from there the method approaches the root
/// monotonically (Fourier's condition). Near the root, two or three steps are enough.
fn voltage_v(vehicle: &Vehicle, inflection_v: f32, thrust_n: f32, near_v: f32) -> f32 {
    if !(thrust_n.is_finite() && thrust_n > 0.0) {
        return 0.0;
    }
    let [c0, c1, c2, c3] = vehicle.thrust_n_v;
    let excess_n = |voltage: f32| c0 + voltage * (c1 + voltage * (c2 + voltage * c3)) - thrust_n;
    let is_above = excess_n(inflection_v) < 0.0;
    let mut voltage =
        if is_above { at_least(near_v, inflection_v) } else { at_most(near_v, inflection_v) };
    for _ in 0..ITERATIONS_MAX {
        let value = excess_n(voltage);
        let slope = c1 + voltage * (2.0 * c2 + voltage * 3.0 * c3);
        if slope <= 0.0 {
            break;
        }
        let next = (voltage - value / slope).clamp(0.0, VOLTAGE_V_MAX);
        let is_done = (next - voltage).abs() <= 1e-6 * next;
        voltage = next;
        if is_done {
            break;
        }
    }
    voltage
}

/// Turns thrust into duty by the voltage of the battery under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryCompensation {
    vehicle: Vehicle,
    /// Voltage of the inflection point of the thrust, see [`inflection_v`].
    inflection_v: f32,
    battery_v: Option<f32>,
    /// Last voltage of each motor, next to which the next one is searched.
    voltages_v: [f32; 4],
}

impl BatteryCompensation {
    /// Time constant in seconds of the low-pass filter of the battery's voltage.
    ///
    /// The voltage falls with the current at once, so a slow filter would leave the thrust too low
    /// while the robot climbs.
    pub const FILTER_S: f32 = 0.05;

    /// Creates a compensation without a measurement; duties are zero until the first one.
    pub const fn new(vehicle: &Vehicle) -> Self {
        BatteryCompensation {
            vehicle: *vehicle,
            inflection_v: inflection_v(vehicle),
            battery_v: None,
            voltages_v: [0.0; 4],
        }
    }

    /// Takes a measurement in V; `dt_s` is the time since the last one.
    ///
    /// A number that is not finite is ignored. The first measurement fills the filter.
    pub fn measure(&mut self, battery_v: f32, dt_s: f32) {
        if !(battery_v.is_finite() && dt_s.is_finite() && dt_s >= 0.0) {
            return;
        }
        let battery_v = battery_v.clamp(0.0, VOLTAGE_V_MAX);
        let share = dt_s / (Self::FILTER_S + dt_s);
        self.battery_v = Some(match self.battery_v {
            Some(before) => before + (battery_v - before) * share,
            None => battery_v,
        });
    }

    /// Returns the filtered voltage in V, or 0 without a measurement.
    pub const fn battery_v(&self) -> f32 {
        match self.battery_v {
            Some(battery_v) => battery_v,
            None => 0.0,
        }
    }

    /// Returns the largest thrust in N of a motor that the battery allows.
    pub fn available_thrust_n(&self) -> f32 {
        self.thrust_n(1.0)
    }

    /// Returns the thrust in N of a motor at rest with the given duty.
    pub fn thrust_n(&self, duty: f32) -> f32 {
        if self.battery_v() < BATTERY_V_MIN {
            return 0.0;
        }
        steady_thrust_n(&self.vehicle, duty.clamp(0.0, 1.0) * self.battery_v())
    }

    /// Returns the duties that give the forces, 0 to 1.
    ///
    /// A force below the least thrust of a turning motor gives 0, as does a battery below 2 V.
    pub fn duties(&mut self, forces: &MotorForces) -> MotorDuties {
        let battery_v = self.battery_v();
        if battery_v < BATTERY_V_MIN {
            return MotorDuties::default();
        }
        let mut duties = MotorDuties::default();
        for (motor, duty) in duties.0.iter_mut().enumerate() {
            let (force, voltage) = (forces.0[motor], &mut self.voltages_v[motor]);
            if force >= self.vehicle.least_thrust_n {
                *voltage = voltage_v(&self.vehicle, self.inflection_v, force, *voltage);
                *duty = at_most(*voltage / battery_v, 1.0);
            }
        }
        duties
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const VEHICLES: [Vehicle; 2] = [Vehicle::CRAZYFLIE_2_1_PLUS, Vehicle::CRAZYFLIE_BRUSHLESS];

    /// Bisection in f64 over the same polynomial.
    fn voltage_by_bisection(vehicle: &Vehicle, thrust_n: f32) -> f64 {
        let (mut low, mut high) = (0.0_f64, 10.0_f64);
        for _ in 0..100 {
            let middle = (low + high) / 2.0;
            let thrust: f64 = vehicle
                .thrust_n_v
                .iter()
                .enumerate()
                .map(|(power, c)| f64::from(*c) * middle.powi(power as i32))
                .sum();
            if thrust < f64::from(thrust_n) { low = middle } else { high = middle }
        }
        low
    }

    /// The cubic grows with the voltage: its derivative has no real root.
    #[test]
    fn thrust_grows_with_the_voltage() {
        for vehicle in VEHICLES {
            let [_, c1, c2, c3] = vehicle.thrust_n_v.map(f64::from);
            assert!(c1 > 0.0 && c3 > 0.0);
            assert!(c2 * c2 < 3.0 * c1 * c3 || (c2 > 0.0 && c1 > 0.0));
        }
    }

    proptest! {
        #[test]
        fn inverse_agrees_with_bisection(share in 0.0_f32..1.0, near in 0.0_f32..20.0) {
            for vehicle in VEHICLES {
                let thrust = vehicle.least_thrust_n + share * vehicle.most_thrust_n * 2.0;
                let voltage = voltage_v(&vehicle, inflection_v(&vehicle), thrust, near);
                let expected = voltage_by_bisection(&vehicle, thrust);
                prop_assert!((f64::from(voltage) - expected).abs() < 3e-6 * expected);
                prop_assert!((steady_thrust_n(&vehicle, voltage) - thrust).abs() < 1e-6);
            }
        }

        #[test]
        fn duties_lie_in_their_range(
            forces in prop::array::uniform4(any::<f32>()),
            battery in any::<f32>(), dt in any::<f32>(),
        ) {
            for vehicle in VEHICLES {
                let mut compensation = BatteryCompensation::new(&vehicle);
                compensation.measure(4.0, 0.01);
                compensation.measure(battery, dt);
                let duties = compensation.duties(&MotorForces(forces));
                prop_assert!(duties.0.iter().all(|duty| (0.0..=1.0).contains(duty)));
            }
        }

        #[test]
        fn duty_and_thrust_are_inverse(share in 0.0_f32..1.0, battery in 3.0_f32..4.2) {
            let vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;
            let mut compensation = BatteryCompensation::new(&vehicle);
            compensation.measure(battery, 0.01);
            let range = vehicle.most_thrust_n - vehicle.least_thrust_n;
            let force = (vehicle.least_thrust_n + share * range)
                .min(compensation.available_thrust_n());
            let duties = compensation.duties(&MotorForces([force; 4]));
            prop_assert!((compensation.thrust_n(duties.0[0]) - force).abs() < 1e-6);
        }
    }

    #[test]
    fn weak_or_missing_battery_stops_the_motors() {
        let mut compensation = BatteryCompensation::new(&Vehicle::CRAZYFLIE_2_1_PLUS);
        let forces = MotorForces([0.08; 4]);
        assert_eq!(compensation.duties(&forces), MotorDuties::default());
        compensation.measure(1.9, 0.01);
        assert_eq!(compensation.duties(&forces), MotorDuties::default());
        compensation.measure(f32::NAN, 0.01);
        assert_eq!(compensation.battery_v(), 1.9);
    }

    /// The filter reaches 1 − 1/e of a step after its time constant.
    #[test]
    fn filter_has_its_time_constant() {
        let mut compensation = BatteryCompensation::new(&Vehicle::CRAZYFLIE_2_1_PLUS);
        compensation.measure(4.0, 0.001);
        for _ in 0..50 {
            compensation.measure(3.0, 0.001);
        }
        let expected = 3.0 + (-1.0_f32).exp();
        assert!((compensation.battery_v() - expected).abs() < 0.01);
    }
}
