//! The parameters of each kind of Crazyflie.
//!
//! # Sources
//! * *read*: the current `params.toml` of drone-models (utiasDSL, commit 77f04ab), sets `P250` and
//!   `B500`. Its own comments mark the moments of inertia of `P250` as not measured.
//! * *read, older*: the same file at commit 3eef2b2.
//! * *bench*: Bitcraze's bench of a Crazyflie 2.0 of 2015, total thrust by current.
//! * *ladder*: voltages of a cell at 0 to 90 % of its charge in Bitcraze's firmware (commit
//!   2a18fc29, `pm_stm32f4.c`); the value at 100 % is the usual end of charge.
//! * *recalled*: a manufacturer's figure that was not looked up.
//! * *choice*: a plausible value without a source.
//!
//! | Parameter | 2.1+ | Brushless | Source |
//! |---|---|---|---|
//! | mass, inertia, arm | 31.8 g, 32.53 mm | 43.38 g, 35.355 mm | read |
//! | thrust, torque by speed | `P250` | `B500` | read |
//! | speed by voltage, spin up, spin down | `P250` | `B500` | read |
//! | propeller inertia, drag | `P250` | `B500` | read |
//! | center of mass | 0 | 0 | choice; decks and markers move it by millimeters |
//! | propeller radius | 23.4 mm | 27.5 mm | read, older |
//! | capacity | 250 mAh | 350 mAh | recalled; `platform_defaults_cf21bl.h` |
//! | resistance | 0.20 Ω | 0.15 Ω | choice in the range 0.15 to 0.25 Ω |
//! | current by thrust | 2015 motors | linear | bench; recalled flight time of 10 min |
//! | feet, propeller plane | 15, 10 mm | 15, 12 mm | choice; the robot is 29 mm high |
//! | spread of motors | 2 % | 2 % | choice |
//! | steps of the duty | 256 | 2,000 | timer with 8 bits (`motors.h`); range of DSHOT |

use glam::{DVec2, DVec3};

use crate::battery::BatteryCell;

/// Coefficients of a rotor's dynamics dΩ/dt = k₁(Ω꜀−Ω) + k₂(Ω꜀²−Ω²), where Ω꜀ is the speed that the
/// motor's voltage commands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinResponse {
    /// k₁ in 1/s.
    pub linear_per_s: f64,
    /// k₂ in 1/(rpm·s).
    pub square_per_rpm_s: f64,
}

/// The parameters of one kind of Crazyflie. The module lists the source of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Airframe {
    /// Mass in kg.
    pub mass_kg: f64,
    /// Principal moments of inertia about x, y and z, in kg·m². Products of inertia are neglected.
    pub inertia_kg_m2: DVec3,
    /// Distance of each motor from the x axis, and from the y axis, in m.
    pub arm_m: f64,
    /// Place of the center of mass from the middle of the motors, along the body's x and y, in m.
    pub center_m: DVec2,
    /// Radius of a propeller in m.
    pub propeller_radius_m: f64,
    /// Moment of inertia of a propeller and its rotor about its axis, in kg·m².
    pub propeller_inertia_kg_m2: f64,
    /// Thrust of a propeller: coefficients of rpm and rpm², in N.
    pub thrust_n_rpm: [f64; 2],
    /// Reaction torque of a propeller: coefficients of rpm and rpm², in N·m.
    pub torque_n_m_rpm: [f64; 2],
    /// Steady speed of a rotor: a constant in rpm and the coefficient of the voltage in rpm/V.
    pub speed_rpm_v: [f64; 2],
    /// Response while the command is above the speed.
    pub spin_up: SpinResponse,
    /// Response while the command is below the speed.
    pub spin_down: SpinResponse,
    /// Linear drag along the body's x, y and z, in N·s/m.
    pub drag_n_s_m: DVec3,
    /// Height of the center of mass above the feet, in m.
    pub feet_below_m: f64,
    /// Height of the propeller plane above the center of mass, in m.
    pub propellers_above_m: f64,
    /// Standard deviation of a motor's thrust between robots of one kind, as a share.
    pub motor_spread: f64,
    /// Number of steps in which the duty of a motor reaches 1. The highest one is not used.
    pub duty_steps: f64,
    /// The battery.
    pub battery: BatteryCell,
}

/// Least thrust for which the measured line of speed by voltage is used, in N (thrust of the least
/// command in Bitcraze's `platform_defaults_cf2.h`).
const MEASURED_THRUST_N_MIN: f64 = 0.012_817_6;

impl Airframe {
    /// The Crazyflie 2.1+ without decks (`P250`).
    pub const CRAZYFLIE_2_1_PLUS: Self = Airframe {
        mass_kg: 0.0318,
        inertia_kg_m2: DVec3::new(16.8e-6, 16.8e-6, 29.8e-6),
        arm_m: 0.032_53,
        center_m: DVec2::ZERO,
        propeller_radius_m: 23.4e-3,
        propeller_inertia_kg_m2: 26.97e-9,
        thrust_n_rpm: [-3.6200e-7, 1.606_09e-10],
        torque_n_m_rpm: [-2.2666e-9, 1.114_95e-12],
        speed_rpm_v: [4657.54, 7536.16],
        spin_up: SpinResponse { linear_per_s: 5.1726, square_per_rpm_s: 8.1477e-5 },
        spin_down: SpinResponse { linear_per_s: 0.0, square_per_rpm_s: 2.0953e-4 },
        drag_n_s_m: DVec3::new(0.013_51, 0.013_51, 0.016_77),
        feet_below_m: 0.015,
        propellers_above_m: 0.010,
        motor_spread: 0.02,
        duty_steps: 256.0,
        battery: BatteryCell {
            capacity_a_h: 0.25,
            resistance_ohm: 0.20,
            idle_a: 0.24,
            // The parabola through (0.281 N, 2.11 A) and (0.568 N, 4.44 A) of the bench.
            current_a_n: [5.951, 2.54],
        },
    };

    /// The Crazyflie 2.1 Brushless with propeller guards (`B500`).
    pub const CRAZYFLIE_BRUSHLESS: Self = Airframe {
        mass_kg: 0.043_38,
        inertia_kg_m2: DVec3::new(25e-6, 28e-6, 49e-6),
        arm_m: 0.035_355,
        center_m: DVec2::ZERO,
        propeller_radius_m: 27.5e-3,
        propeller_inertia_kg_m2: 38.93e-9,
        thrust_n_rpm: [-3.1334e-7, 4.407_35e-10],
        torque_n_m_rpm: [1.6589e-9, 2.469_35e-12],
        speed_rpm_v: [2938.40, 6001.83],
        spin_up: SpinResponse { linear_per_s: 13.996, square_per_rpm_s: 1.1093e-4 },
        spin_down: SpinResponse { linear_per_s: 5.9332, square_per_rpm_s: 3.1951e-4 },
        drag_n_s_m: DVec3::new(0.021_49, 0.021_49, 0.023_60),
        feet_below_m: 0.015,
        propellers_above_m: 0.012,
        motor_spread: 0.02,
        duty_steps: 2000.0,
        battery: BatteryCell {
            capacity_a_h: 0.35,
            resistance_ohm: 0.15,
            idle_a: 0.24,
            // Hover at 2.1 A, which empties 350 mAh in 10 minutes.
            current_a_n: [4.5, 0.0],
        },
    };

    /// Returns the thrust of a propeller at this speed, in N; never negative.
    ///
    /// The measured polynomial is negative below about 2,000 rpm, where nothing was measured.
    #[must_use]
    pub fn thrust_n(&self, speed_rpm: f64) -> f64 {
        let [linear, square] = self.thrust_n_rpm;
        ((linear + square * speed_rpm) * speed_rpm).max(0.0)
    }

    /// Returns the reaction torque of a propeller at this speed, in N·m; never negative.
    #[must_use]
    pub fn torque_n_m(&self, speed_rpm: f64) -> f64 {
        let [linear, square] = self.torque_n_m_rpm;
        ((linear + square * speed_rpm) * speed_rpm).max(0.0)
    }

    /// Returns the speed at which a propeller has this thrust, in rpm.
    #[must_use]
    pub fn speed_rpm(&self, thrust_n: f64) -> f64 {
        let [linear, square] = self.thrust_n_rpm;
        let root = (linear * linear + 4.0 * square * thrust_n.max(0.0)).sqrt();
        (root - linear) / (2.0 * square)
    }

    /// Returns the speed and the voltage of a motor at the least measured thrust, in rpm and V.
    ///
    /// The measured line of speed by voltage does not pass through the origin. Below this voltage, the
    /// speed is proportional to the voltage instead (a choice), so a motor without voltage stands still.
    #[must_use]
    pub(crate) fn least_measured(&self) -> (f64, f64) {
        let [constant, slope] = self.speed_rpm_v;
        let least_rpm = self.speed_rpm(MEASURED_THRUST_N_MIN);
        (least_rpm, (least_rpm - constant) / slope)
    }

    /// Returns the speed that a motor reaches at this voltage, in rpm.
    ///
    /// # Parameters
    /// `least`: speed and voltage from [`Airframe::least_measured`].
    #[must_use]
    pub(crate) fn commanded_speed_rpm(
        &self,
        volts: f64,
        (least_rpm, least_volts): (f64, f64),
    ) -> f64 {
        let [constant, slope] = self.speed_rpm_v;
        if volts < least_volts {
            volts.max(0.0) * least_rpm / least_volts
        } else {
            constant + slope * volts
        }
    }

    /// Returns the voltage at which a motor reaches this speed, in V.
    #[must_use]
    pub fn volts(&self, speed_rpm: f64) -> f64 {
        let [constant, slope] = self.speed_rpm_v;
        let (least_rpm, _) = self.least_measured();
        if speed_rpm < least_rpm {
            speed_rpm.max(0.0) / least_rpm * (least_rpm - constant) / slope
        } else {
            (speed_rpm - constant) / slope
        }
    }

    /// Returns the thrust of each motor in hover far from the ground, in N.
    #[must_use]
    pub fn hover_thrust_n(&self) -> f64 {
        self.mass_kg * crate::GRAVITY_M_S2 / 4.0
    }

    /// Returns the rotor speed in hover far from the ground, in rpm.
    #[must_use]
    pub fn hover_speed_rpm(&self) -> f64 {
        self.speed_rpm(self.hover_thrust_n())
    }

    /// Returns the position of each motor in the body frame, whose origin is the center of mass, without
    /// its height, in m.
    #[must_use]
    pub fn motor_positions_m(&self) -> [DVec3; 4] {
        let arm = self.arm_m;
        [[arm, -arm], [-arm, -arm], [-arm, arm], [arm, arm]]
            .map(|[x, y]| (DVec2::new(x, y) - self.center_m).extend(0.0))
    }
}

/// Direction of rotation of each motor about z. The reaction torque has the opposite direction.
pub(crate) const SPIN_DIRECTIONS: [f64; 4] = [1.0, -1.0, 1.0, -1.0];

/// Speed of 1 rpm in rad/s.
pub(crate) const RAD_S_PER_RPM: f64 = core::f64::consts::PI / 30.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// The hover points were computed by hand from the same sources (a quarter of the weight, the
    /// root of the thrust polynomial, the line of speed by voltage).
    #[test]
    fn hover_points_match_the_published_parameters() {
        for (airframe, thrust, rpm, volts) in [
            (Airframe::CRAZYFLIE_2_1_PLUS, 0.0780, 23_190.0, 2.46),
            (Airframe::CRAZYFLIE_BRUSHLESS, 0.1064, 15_900.0, 2.16),
        ] {
            assert!((airframe.hover_thrust_n() - thrust).abs() < 0.000_05);
            let hover = airframe.hover_speed_rpm();
            assert!((hover / rpm - 1.0).abs() < 0.001, "{hover}");
            assert!((airframe.volts(hover) - volts).abs() < 0.005, "{}", airframe.volts(hover));
        }
    }

    #[test]
    fn speed_and_voltage_are_inverse() {
        for airframe in [Airframe::CRAZYFLIE_2_1_PLUS, Airframe::CRAZYFLIE_BRUSHLESS] {
            for tenths in 0..42 {
                let volts = f64::from(tenths) / 10.0;
                let speed = airframe.commanded_speed_rpm(volts, airframe.least_measured());
                assert!((airframe.volts(speed) - volts).abs() < 1e-12);
                assert!(
                    (airframe.speed_rpm(airframe.thrust_n(speed)) - speed).abs() < 1e-6
                        || speed < 2300.0
                );
            }
            assert_eq!(airframe.commanded_speed_rpm(0.0, airframe.least_measured()), 0.0);
            assert_eq!(airframe.commanded_speed_rpm(-1.0, airframe.least_measured()), 0.0);
        }
    }

    /// Bitcraze's own curve of thrust by voltage is an independent measurement: both agree within
    /// a tenth between 0.02 and 0.12 N.
    #[test]
    fn thrust_by_voltage_agrees_with_the_firmware() {
        let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
        let cubic =
            |v: f64| -0.024_765_4 + v * (0.065_237_9 + v * (-0.026_792_5 + v * 0.006_776_79));
        for tenths in 10..30 {
            let volts = f64::from(tenths) / 10.0;
            let speed = airframe.commanded_speed_rpm(volts, airframe.least_measured());
            let own = airframe.thrust_n(speed);
            assert!((own / cubic(volts) - 1.0).abs() < 0.1, "{volts} V: {own} {}", cubic(volts));
        }
    }
}
