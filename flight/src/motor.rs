//! Motors: from thrust to duty, with compensation of the battery and of the lag of the rotors.
//!
//! [`RotorDrive`] joins the two steps. [`LagCompensation`] leads the command, because the thrust of
//! a small rotor follows its voltage with a time constant of 60 to 140 ms, longer than the attitude
//! loop can bear. [`BatteryCompensation`] turns thrust into the share of the battery's voltage.
//! [`DutySteps`] rounds duties to the steps of a timer.

mod battery;
mod lag;
mod steps;

pub use battery::{BatteryCompensation, steady_thrust_n};
pub use lag::LagCompensation;
pub use steps::DutySteps;

use crate::{MotorDuties, MotorForces, Vehicle};

/// The whole path from wanted forces to duties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorDrive {
    lag: LagCompensation,
    battery: BatteryCompensation,
}

impl RotorDrive {
    /// Creates the drive of a vehicle whose rotors stand still.
    pub const fn new(vehicle: &Vehicle) -> Self {
        RotorDrive {
            lag: LagCompensation::new(vehicle),
            battery: BatteryCompensation::new(vehicle),
        }
    }

    /// Takes a measurement of the battery in V; `dt_s` is the time since the last one.
    pub fn measure_battery(&mut self, battery_v: f32, dt_s: f32) {
        self.battery.measure(battery_v, dt_s);
    }

    /// Returns the duties of one step of `dt_s` seconds.
    ///
    /// The lead never asks for more than the battery can give, so that the estimate of the thrust
    /// stays right when the battery is weak.
    pub fn update(&mut self, desired: &MotorForces, dt_s: f32) -> MotorDuties {
        let available_n = self.battery.available_thrust_n();
        self.battery.duties(&self.lag.update(desired, available_n, dt_s))
    }

    /// Returns the largest thrust in N of a motor that the battery allows, 0 before a measurement.
    pub fn available_thrust_n(&self) -> f32 {
        self.battery.available_thrust_n()
    }

    /// Returns the estimated thrust of each motor at this moment.
    pub const fn thrust(&self) -> MotorForces {
        self.lag.thrust()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The whole path in front of rotors that follow their voltage, with a battery that sags
    /// with the thrust: the thrust follows 1 − exp(−t/τ) with the wanted time constant.
    #[test]
    fn thrust_follows_the_wish_with_a_sagging_battery() {
        let vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;
        let mut drive = RotorDrive::new(&vehicle);
        let mut thrust = 0.0_f64;
        for k in 0..1500 {
            // 0.2 Ω and 2.1 A at 0.28 N of all motors.
            let battery_v = 3.9 - 0.2 * 2.1 * thrust * 4.0 / 0.28;
            drive.measure_battery(battery_v as f32, 0.001);
            let desired = if k < 1000 { 0.075 } else { 0.080 };
            let duties = drive.update(&MotorForces([desired; 4]), 0.001);
            let steady = steady_thrust_n(&vehicle, duties.0[2] * battery_v as f32);
            let difference = f64::from(steady) - thrust;
            let lag = if difference > 0.0 { vehicle.spin_up_s } else { vehicle.spin_down_s };
            thrust += difference * 0.001 / f64::from(lag);
            if k == 1034 {
                let expected = 0.075 + 0.005 * (1.0 - (-1.0_f64).exp());
                assert!((thrust - expected).abs() < 4e-4, "{thrust} {expected}");
            }
        }
        assert!((thrust - 0.080).abs() < 5e-4, "{thrust}");
        assert!((f64::from(drive.thrust().0[2]) - thrust).abs() < 5e-4);
    }

    /// The estimate does not run ahead of the motors when the battery is weak.
    #[test]
    fn weak_battery_bounds_the_estimate() {
        let vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;
        let mut drive = RotorDrive::new(&vehicle);
        drive.measure_battery(2.5, 0.01);
        for _ in 0..3000 {
            let duties = drive.update(&MotorForces([0.12; 4]), 0.001);
            assert!(duties.0.iter().all(|duty| (0.0..=1.0).contains(duty)));
        }
        let most = steady_thrust_n(&vehicle, 2.5);
        assert!(most < 0.1 && (drive.thrust().0[0] - most).abs() < 1e-4);
    }
}
