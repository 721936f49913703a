//! Motors: from thrust to duty, with compensation of the battery and of the lag of the rotors.
//!
//! [`RotorDrive`] joins the two steps. [`LagCompensation`] leads the command, because the thrust of a
//! small rotor follows its voltage with a time constant of 60 to 140 ms, longer than the attitude
//! loop can bear. [`BatteryCompensation`] turns thrust into the share of the battery's voltage.

mod battery;
mod lag;

pub use battery::{BatteryCompensation, steady_thrust_n, voltage_v};
pub use lag::LagCompensation;

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

    /// Returns the estimated thrust of each motor at this moment.
    pub const fn thrust(&self) -> MotorForces {
        self.lag.thrust()
    }
}
