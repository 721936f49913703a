//! The mixer: from thrust and torque to the thrust of each motor, with priorities.
//!
//! Four motors give one thrust and three torques, so the map from forces to a [`Wrench`] is
//! linear and has an inverse. Where the inverse leaves the range of a motor, the mixer gives way
//! in a fixed order, because a robot that loses its roll and pitch falls, while one that loses some
//! thrust or yaw does not (Faessler, Falanga & Scaramuzza 2017, "Thrust mixing, saturation, and
//! body-rate control for accurate aggressive quadrotor flight"; Brescianini &
//! D'Andrea 2018 give yaw the least priority as well):
//! 1. roll and pitch torque, shortened together only when no thrust makes room for them;
//! 2. thrust, moved as little as roll and pitch need;
//! 3. yaw torque, moved as little as the others need.
//!
//! Each step is the exact optimum given the ones before it, in closed form, so a wrench that the
//! motors can exert is never changed.

use glam::Vec3;

use crate::bounds::{at_least, at_most, within};
use crate::{MotorForces, Vehicle, Wrench};

/// Signs of the torque about x that the thrust of motors 1 to 4 gives.
const ROLL_SIGNS: [f32; 4] = [-1.0, -1.0, 1.0, 1.0];
/// Signs of the torque about y.
const PITCH_SIGNS: [f32; 4] = [-1.0, 1.0, 1.0, -1.0];
/// Signs of the torque about z.
const YAW_SIGNS: [f32; 4] = [-1.0, 1.0, -1.0, 1.0];

/// Relative change below which rounding alone can explain a difference.
const ROUNDING: f32 = 1e-5;

/// The geometry and limits that relate forces of motors to thrust and torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixer {
    arm_m: f32,
    torque_per_thrust_m: f32,
    /// Largest thrust of a motor by the vehicle, and by it and the battery.
    vehicle_thrust_n: f32,
    most_thrust_n: f32,
}

/// Forces of the motors, with a report of the parts of the wrench that they do not give.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MixerOutcome {
    /// Thrust of each motor, from 0 to the largest thrust of the vehicle.
    pub forces: MotorForces,
    /// The torques about x and y are shorter than asked.
    pub is_tilt_cut: bool,
    /// The thrust differs from the wanted one, in either direction.
    pub is_thrust_cut: bool,
    /// The torque about z differs from the wanted one.
    pub is_yaw_cut: bool,
    /// The wrench was not finite; all forces are zero.
    pub is_refused: bool,
}

impl Mixer {
    /// Creates the mixer of a vehicle.
    pub const fn new(vehicle: &Vehicle) -> Self {
        Mixer {
            arm_m: vehicle.arm_m,
            torque_per_thrust_m: vehicle.torque_per_thrust_m,
            vehicle_thrust_n: vehicle.most_thrust_n,
            most_thrust_n: vehicle.most_thrust_n,
        }
    }

    /// Limits the thrust of a motor in N to what a weak battery allows. The limit of the vehicle stays.
    ///
    /// Without this limit the duties of all motors end at 1, and no difference is left for roll and
    /// pitch. A number that is not more than 0 is ignored.
    pub fn limit_thrust_n(&mut self, available_n: f32) {
        if available_n > 0.0 {
            self.most_thrust_n = at_most(available_n, self.vehicle_thrust_n);
        }
    }

    /// Returns the thrust and torque that the forces exert together.
    pub fn wrench(&self, forces: &MotorForces) -> Wrench {
        let sum = |signs: [f32; 4]| -> f32 {
            forces.0.iter().zip(signs).map(|(force, sign)| force * sign).sum()
        };
        Wrench {
            thrust_n: sum([1.0; 4]),
            torque_n_m: Vec3::new(
                self.arm_m * sum(ROLL_SIGNS),
                self.arm_m * sum(PITCH_SIGNS),
                self.torque_per_thrust_m * sum(YAW_SIGNS),
            ),
        }
    }

    /// Returns forces that exert the wrench, or the nearest one by the priorities of this module.
    pub fn mix(&self, wrench: &Wrench) -> MixerOutcome {
        let most = self.most_thrust_n;
        let lift = wrench.thrust_n / 4.0;
        let roll = wrench.torque_n_m.x / (4.0 * self.arm_m);
        let pitch = wrench.torque_n_m.y / (4.0 * self.arm_m);
        let yaw = wrench.torque_n_m.z / (4.0 * self.torque_per_thrust_m);

        // Motors on one diagonal have opposite tilt parts and the same yaw part. So the mean force
        // of motors 1 and 3 is lift − yaw and must lie `falling` away from the limits; that of
        // motors 2 and 4 is lift + yaw and must lie `rising` away.
        let (falling, rising) = ((roll + pitch).abs(), (roll - pitch).abs());
        let reach = at_least(falling, rising);
        if !(lift.is_finite() && reach.is_finite() && yaw.is_finite()) {
            return MixerOutcome { is_refused: true, ..MixerOutcome::default() };
        }
        let share = if reach > most / 2.0 { most / 2.0 / reach } else { 1.0 };
        let (falling, rising) = (share * falling, share * rising);

        let margin = (falling + rising) / 2.0;
        let possible_lift = within(lift, margin, most - margin);
        let least_yaw = at_least(possible_lift + falling - most, rising - possible_lift);
        let most_yaw = at_most(possible_lift - falling, most - rising - possible_lift);
        let possible_yaw = within(yaw, least_yaw, most_yaw);

        let mut forces = MotorForces([0.0; 4]);
        for (motor, force) in forces.0.iter_mut().enumerate() {
            let tilt = share * (ROLL_SIGNS[motor] * roll + PITCH_SIGNS[motor] * pitch);
            // The limits only remove rounding here.
            *force = within(possible_lift + tilt + YAW_SIGNS[motor] * possible_yaw, 0.0, most);
        }
        MixerOutcome {
            forces,
            is_tilt_cut: share < 1.0 - ROUNDING,
            is_thrust_cut: (possible_lift - lift).abs() > ROUNDING * most,
            is_yaw_cut: (possible_yaw - yaw).abs() > ROUNDING * most,
            is_refused: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const VEHICLE: Vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;
    const THRUST_N_MAX: f32 = VEHICLE.most_thrust_n;

    fn is_uncut(outcome: &MixerOutcome) -> bool {
        !(outcome.is_tilt_cut || outcome.is_thrust_cut || outcome.is_yaw_cut || outcome.is_refused)
    }

    /// Position of each motor and cross products, instead of the table of signs.
    fn wrench_by_cross_products(forces: [f32; 4]) -> Wrench {
        let arm = VEHICLE.arm_m;
        let places = [(arm, -arm), (-arm, -arm), (-arm, arm), (arm, arm)];
        let turns = [-1.0, 1.0, -1.0, 1.0];
        let mut wrench = Wrench::default();
        for i in 0..4 {
            let thrust = Vec3::new(0.0, 0.0, forces[i]);
            wrench.thrust_n += forces[i];
            wrench.torque_n_m += Vec3::new(places[i].0, places[i].1, 0.0).cross(thrust);
            wrench.torque_n_m.z += turns[i] * VEHICLE.torque_per_thrust_m * forces[i];
        }
        wrench
    }

    fn largest_difference(a: &Wrench, b: &Wrench) -> f32 {
        let torque = (a.torque_n_m - b.torque_n_m) / VEHICLE.arm_m;
        (a.thrust_n - b.thrust_n).abs().max(torque.abs().max_element())
    }

    fn any_wrench() -> impl Strategy<Value = Wrench> {
        (-0.3_f32..0.8, -0.01_f32..0.01, -0.01_f32..0.01, -0.003_f32..0.003)
            .prop_map(|(thrust_n, x, y, z)| Wrench { thrust_n, torque_n_m: Vec3::new(x, y, z) })
    }

    /// A battery that allows 0.08 N per motor gives roll and pitch in full, and less thrust.
    #[test]
    fn a_weak_battery_costs_thrust_alone() {
        let mut mixer = Mixer::new(&VEHICLE);
        mixer.limit_thrust_n(0.08);
        let wrench = Wrench { thrust_n: 0.4, torque_n_m: Vec3::new(0.0005, -0.0007, 0.0) };
        let outcome = mixer.mix(&wrench);
        let given = wrench_by_cross_products(outcome.forces.0);
        assert!(outcome.is_thrust_cut && !outcome.is_tilt_cut);
        assert!(outcome.forces.0.iter().all(|force| *force <= 0.08));
        let difference = (given.torque_n_m - wrench.torque_n_m).truncate();
        assert!(difference.length() < 1e-8, "{given:?}");
        mixer.limit_thrust_n(f32::NAN);
        assert_eq!(mixer.mix(&wrench), outcome);
        mixer.limit_thrust_n(f32::INFINITY);
        assert_eq!(mixer, Mixer::new(&VEHICLE));
    }

    proptest! {
        #[test]
        fn feasible_forces_are_reproduced(forces in prop::array::uniform4(0.0..THRUST_N_MAX)) {
            let mixer = Mixer::new(&VEHICLE);
            let wrench = wrench_by_cross_products(forces);
            prop_assert!(largest_difference(&wrench, &mixer.wrench(&MotorForces(forces))) < 1e-6);
            let outcome = mixer.mix(&wrench);
            prop_assert!(is_uncut(&outcome), "{outcome:?}");
            for (mixed, force) in outcome.forces.0.iter().zip(forces) {
                prop_assert!((mixed - force).abs() < 1e-6, "{mixed} {force}");
            }
        }

        #[test]
        fn limits_hold_and_flags_report_saturation(wrench in any_wrench()) {
            let outcome = Mixer::new(&VEHICLE).mix(&wrench);
            prop_assert!(outcome.forces.0.iter().all(|force| (0.0..=THRUST_N_MAX).contains(force)));
            let given = wrench_by_cross_products(outcome.forces.0);
            let thrust_differs = (given.thrust_n - wrench.thrust_n).abs() > 1e-5;
            let tilt_differs =
                (given.torque_n_m - wrench.torque_n_m).truncate().length() > 1e-6 * VEHICLE.arm_m;
            let yaw_differs = (given.torque_n_m.z - wrench.torque_n_m.z).abs()
                > 4e-5 * THRUST_N_MAX * VEHICLE.torque_per_thrust_m;
            prop_assert!(!thrust_differs || outcome.is_thrust_cut, "{wrench:?} {given:?}");
            prop_assert!(!tilt_differs || outcome.is_tilt_cut, "{wrench:?} {given:?}");
            prop_assert!(!yaw_differs || outcome.is_yaw_cut, "{wrench:?} {given:?}");
        }

        /// Roll and pitch are exact whenever some thrust allows them, and keep their ratio else.
        #[test]
        fn roll_and_pitch_come_first(wrench in any_wrench()) {
            let outcome = Mixer::new(&VEHICLE).mix(&wrench);
            let given = wrench_by_cross_products(outcome.forces.0).torque_n_m / VEHICLE.arm_m;
            let wanted = wrench.torque_n_m / VEHICLE.arm_m;
            // The spread of forces that roll and pitch need, by search over the motors.
            let parts: Vec<f32> = (0..4)
                .map(|i| (ROLL_SIGNS[i] * wanted.x + PITCH_SIGNS[i] * wanted.y) / 4.0)
                .collect();
            let highest = parts.iter().copied().fold(f32::MIN, f32::max);
            let lowest = parts.iter().copied().fold(f32::MAX, f32::min);
            if highest - lowest < THRUST_N_MAX * 0.9999 {
                prop_assert!((given - wanted).truncate().length() < 1e-5);
                prop_assert!(!outcome.is_tilt_cut);
            } else if highest - lowest > THRUST_N_MAX * 1.0001 {
                prop_assert!(outcome.is_tilt_cut);
                prop_assert!(given.truncate().perp_dot(wanted.truncate()).abs() < 1e-5);
            }
        }

        /// No thrust nearer to the wanted one leaves room for roll and pitch, and no yaw torque
        /// nearer to the wanted one leaves room for both: search on grids.
        #[test]
        fn thrust_and_yaw_move_as_little_as_needed(wrench in any_wrench()) {
            let mixer = Mixer::new(&VEHICLE);
            let given = mixer.wrench(&mixer.mix(&wrench).forces);
            let yaw_scale = 4.0 * VEHICLE.torque_per_thrust_m;
            let fits = |lift: f32, yaw: f32| {
                (0..4).all(|i| {
                    let tilt = ROLL_SIGNS[i] * given.torque_n_m.x
                        + PITCH_SIGNS[i] * given.torque_n_m.y;
                    let force = lift + tilt / (4.0 * VEHICLE.arm_m) + YAW_SIGNS[i] * yaw;
                    (0.0..=THRUST_N_MAX).contains(&force)
                })
            };
            let grid = || (-60..=60).map(|k| THRUST_N_MAX * k as f32 / 60.0);
            let moved = (given.thrust_n - wrench.thrust_n).abs();
            for lift in grid() {
                if (4.0 * lift - wrench.thrust_n).abs() < moved - 1e-5 {
                    prop_assert!(!grid().any(|yaw| fits(lift, yaw)), "{wrench:?} {lift}");
                }
            }
            let wanted_yaw = wrench.torque_n_m.z / yaw_scale;
            let moved = (given.torque_n_m.z / yaw_scale - wanted_yaw).abs();
            for yaw in grid() {
                if (yaw - wanted_yaw).abs() < moved - 1e-5 {
                    prop_assert!(!fits(given.thrust_n / 4.0, yaw), "{wrench:?} {yaw}");
                }
            }
        }

        #[test]
        fn no_wrench_exceeds_the_limits(
            thrust_n in any::<f32>(), x in any::<f32>(), y in any::<f32>(), z in any::<f32>()
        ) {
            let wrench = Wrench { thrust_n, torque_n_m: Vec3::new(x, y, z) };
            let outcome = Mixer::new(&VEHICLE).mix(&wrench);
            prop_assert!(outcome.forces.0.iter().all(|force| (0.0..=THRUST_N_MAX).contains(force)));
        }
    }

    #[test]
    fn a_wrench_that_is_not_finite_stops_the_motors() {
        for value in [f32::NAN, f32::INFINITY] {
            for i in 0..4 {
                let mut parts = [0.2, 0.0, 0.0, 0.0];
                parts[i] = value;
                let torque_n_m = Vec3::new(parts[1], parts[2], parts[3]);
                let outcome = Mixer::new(&VEHICLE).mix(&Wrench { thrust_n: parts[0], torque_n_m });
                assert!(outcome.is_refused);
                assert_eq!(outcome.forces, MotorForces::default());
            }
        }
    }

    /// Yaw gets the room that is left, and its sign stays.
    #[test]
    fn yaw_gives_way_first() {
        let wrench = Wrench { thrust_n: 0.44, torque_n_m: Vec3::new(0.0, 0.0, 0.01) };
        let mixer = Mixer::new(&VEHICLE);
        let outcome = mixer.mix(&wrench);
        assert!(outcome.is_yaw_cut && !outcome.is_thrust_cut && !outcome.is_tilt_cut);
        let given = mixer.wrench(&outcome.forces);
        assert!((given.thrust_n - 0.44).abs() < 1e-6);
        // Each motor has 0.01 N of room.
        assert!((given.torque_n_m.z - 0.04 * VEHICLE.torque_per_thrust_m).abs() < 1e-8);
    }
}
