//! Lead compensation of the rotors' lag.
//!
//! The thrust f of a rotor follows its command u as τ·ḟ = u − f, with one τ for spin-up and one for
//! spin-down. The command u = f + (f_wanted − f)·τ/τ_wanted makes that τ_wanted·ḟ = f_wanted − f
//! (cancellation of the pole by the inverse of the model, as for the rotor speed in Faessler,
//! Falanga & Scaramuzza 2017). No rotor of this kind reports its speed, so f is the
//! state of the same model. An error of τ leaves a slow part of the response, not an error at rest.

use crate::bounds::{at_least, at_most, within};
use crate::{MotorForces, Vehicle};

/// Longest step in seconds that the model follows.
const STEP_S_MAX: f32 = 0.1;

/// An estimator of the thrust of four rotors, and a lead command by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagCompensation {
    spin_up_s: f32,
    spin_down_s: f32,
    wanted_s: f32,
    least_thrust_n: f32,
    most_thrust_n: f32,
    thrust_n: [f32; 4],
    approach: Approach,
}

/// The shares of a difference that a rotor covers in a step, up and down.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Approach {
    /// The step in seconds, for which both were computed.
    dt_s: f32,
    up: f32,
    down: f32,
}

impl LagCompensation {
    /// Time constant in seconds that the compensated thrust has, as long as no limit acts.
    ///
    /// A shorter one multiplies noise: the lead is `spin_up_s` over this, 3.2 for the 2.1+.
    pub const WANTED_S: f32 = 0.035;

    /// Creates a compensation for rotors that stand still.
    pub const fn new(vehicle: &Vehicle) -> Self {
        LagCompensation {
            spin_up_s: vehicle.spin_up_s,
            spin_down_s: vehicle.spin_down_s,
            wanted_s: Self::WANTED_S,
            least_thrust_n: vehicle.least_thrust_n,
            most_thrust_n: vehicle.most_thrust_n,
            thrust_n: [0.0; 4],
            approach: Approach { dt_s: 0.0, up: 0.0, down: 0.0 },
        }
    }

    /// Returns the estimated thrust of each motor at this moment.
    pub const fn thrust(&self) -> MotorForces {
        MotorForces(self.thrust_n)
    }

    /// Returns the thrust to command for one step of `dt_s` seconds, and moves the estimate on.
    ///
    /// Commands lie between the least thrust of a turning motor and the smaller of the vehicle's
    /// largest thrust and `available_n`. Four wanted forces of zero stop the motors at once; a
    /// force that is not finite counts as zero.
    pub fn update(&mut self, desired: &MotorForces, available_n: f32, dt_s: f32) -> MotorForces {
        let desired = desired.0.map(|force| if force.is_finite() { force } else { 0.0 });
        let is_stopped = desired.iter().all(|force| *force <= 0.0);
        let most = at_most(self.most_thrust_n, at_least(available_n, 0.0));
        let least = at_most(self.least_thrust_n, most);
        let dt_s = if dt_s.is_finite() { dt_s.clamp(0.0, STEP_S_MAX) } else { 0.0 };
        // The exponentials of the next steps are those of this one, as long as steps are equal.
        if dt_s != self.approach.dt_s {
            let share = |lag_s: f32| 1.0 - libm::expf(-dt_s / lag_s);
            let (up, down) = (share(self.spin_up_s), share(self.spin_down_s));
            self.approach = Approach { dt_s, up, down };
        }
        let mut commands = [0.0; 4];
        for (motor, command) in commands.iter_mut().enumerate() {
            let thrust = &mut self.thrust_n[motor];
            let difference = desired[motor] - *thrust;
            let lag_s = if difference > 0.0 { self.spin_up_s } else { self.spin_down_s };
            // A rotor that is faster than wanted needs no compensation.
            let lead = at_least(lag_s / self.wanted_s, 1.0);
            if !is_stopped {
                *command = within(*thrust + difference * lead, least, most);
            }
            let share = if *command > *thrust { self.approach.up } else { self.approach.down };
            *thrust += (*command - *thrust) * share;
        }
        MotorForces(commands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const VEHICLE: Vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;

    /// A rotor of the model, integrated in f64 with ten steps per control step.
    struct Rotor(f64);

    impl Rotor {
        fn step(&mut self, command: f32, dt_s: f64) {
            for _ in 0..10 {
                let difference = f64::from(command) - self.0;
                let lag = if difference > 0.0 { VEHICLE.spin_up_s } else { VEHICLE.spin_down_s };
                self.0 += difference * dt_s / 10.0 / f64::from(lag);
            }
        }
    }

    /// Runs 1 s of hover, then a step to `to_n`, and returns the thrust `after_s` after the step.
    fn response(to_n: f32, after_s: f64) -> f64 {
        let mut lag = LagCompensation::new(&VEHICLE);
        let mut rotor = Rotor(0.0);
        for k in 0..1000 + (after_s * 1000.0) as usize {
            let desired = if k < 1000 { 0.078 } else { to_n };
            let command = lag.update(&MotorForces([desired; 4]), 1.0, 0.001);
            rotor.step(command.0[0], 0.001);
        }
        assert!((f64::from(lag.thrust().0[0]) - rotor.0).abs() < 1e-4);
        rotor.0
    }

    /// Small steps follow 1 − exp(−t/τ) with the wanted time constant, up and down.
    #[test]
    fn response_has_the_wanted_time_constant() {
        for to_n in [0.085_f32, 0.071] {
            for after_s in [0.02, 0.035, 0.07, 0.2] {
                let wanted = f64::from(LagCompensation::WANTED_S);
                let expected =
                    0.078 + (f64::from(to_n) - 0.078) * (1.0 - (-after_s / wanted).exp());
                let error = response(to_n, after_s) - expected;
                assert!(error.abs() < 0.02 * 0.007, "{to_n} {after_s}: {error}");
            }
        }
    }

    #[test]
    fn zero_stops_all_motors_and_one_zero_does_not() {
        let mut lag = LagCompensation::new(&VEHICLE);
        lag.update(&MotorForces([0.08; 4]), 1.0, 0.1);
        let command = lag.update(&MotorForces([0.0, 0.08, 0.08, 0.08]), 1.0, 0.002);
        assert_eq!(command.0[0], VEHICLE.least_thrust_n);
        assert_eq!(lag.update(&MotorForces::default(), 1.0, 0.002), MotorForces::default());
        assert_eq!(lag.update(&MotorForces([f32::NAN; 4]), 1.0, 0.002), MotorForces::default());
    }

    proptest! {
        #[test]
        fn commands_and_estimates_stay_in_range(
            steps in prop::collection::vec(
                (prop::array::uniform4(any::<f32>()), any::<f32>(), any::<f32>()), 1..40)
        ) {
            let mut lag = LagCompensation::new(&VEHICLE);
            for (desired, available, dt) in steps {
                let command = lag.update(&MotorForces(desired), available, dt);
                let range = 0.0..=VEHICLE.most_thrust_n;
                prop_assert!(command.0.iter().all(|force| range.contains(force)), "{command:?}");
                prop_assert!(lag.thrust().0.iter().all(|force| range.contains(force)));
            }
        }
    }
}
