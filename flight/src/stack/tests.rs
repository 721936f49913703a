//! Tests on the ground. Flights are tested with the physics of a Crazyflie.

use super::*;
use crate::planner::{Destination, PlanError, VelocityCommand};
use bittybuzz_random::Random;

const SETTINGS: StackSettings = StackSettings::CRAZYFLIE_2_1_PLUS;

/// A robot on the ground with noisy inertial sensors and a gyroscope with a bias.
struct Standing {
    stack: FlightStack,
    noise: Random,
    duties: MotorDuties,
}

impl Standing {
    fn new() -> Self {
        let at = FlightState { position_m: Vec3::new(1.0, 2.0, 0.015), ..FlightState::default() };
        Standing {
            stack: FlightStack::new(SETTINGS, &at),
            noise: Random::new(1),
            duties: MotorDuties::default(),
        }
    }

    fn wait(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            let mut noise =
                || Vec3::from_array(core::array::from_fn(|_| self.noise.uniform(0.004) as f32));
            let sample = ImuSample {
                gyro_rad_s: Vec3::new(0.01, -0.01, 0.005) + noise(),
                accel_m_s2: Vec3::Z * GRAVITY_M_S2 + noise() * 5.0,
            };
            self.duties = self.stack.tick(Some(&sample), 4.0);
        }
    }

    fn wait_alive(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.stack.renew();
            self.wait(1);
        }
    }
}

#[test]
fn a_robot_without_a_script_cannot_arm() {
    let mut robot = Standing::new();
    robot.wait(2000);
    assert_eq!(robot.stack.stage(), SupervisorStage::Preflight);
    assert_eq!(robot.stack.arm(), Err(FlightRefusal::NotReady));
    robot.wait_alive(10);
    assert_eq!(robot.stack.arm(), Ok(()));
    robot.wait_alive(300);
    assert_eq!(robot.stack.stage(), SupervisorStage::Armed);
    assert_eq!(robot.duties, MotorDuties::default());
    robot.wait(3000);
    assert_eq!(robot.stack.stage(), SupervisorStage::Preflight);
}

/// Without measurements of the position, the estimate of a robot that stands does not drift.
#[test]
fn a_robot_that_stands_keeps_its_estimate() {
    let mut robot = Standing::new();
    robot.wait(60_000);
    let state = robot.stack.state();
    let drift_m = state.position_m.distance(Vec3::new(1.0, 2.0, 0.015));
    assert!(drift_m < 0.1 && state.velocity_m_s.length() < 0.02, "{state:?}");
    assert!(robot.stack.health().is_position_valid);
}

#[test]
fn commands_of_flight_are_refused_on_the_ground() {
    let mut robot = Standing::new();
    robot.wait_alive(1000);
    let there = Destination::Relative { displacement_m: Vec3::X, turn_rad: 0.0 };
    assert_eq!(robot.stack.take_off(0.5, None), Err(FlightRefusal::NotArmed));
    for refusal in [
        robot.stack.go_to(there, None).err(),
        robot.stack.hover().err(),
        robot.stack.land(None).err(),
        robot.stack.follow_trajectory(&[], true).err(),
        robot.stack.track(&Reference::default()).err(),
        robot.stack.hold(&AttitudeCommand::default()).err(),
    ] {
        assert_eq!(refusal, Some(FlightRefusal::NotFlying));
    }
    robot.stack.arm().expect("not ready");
    robot.wait_alive(300);
    let refusal = robot.stack.take_off(f32::NAN, None);
    assert_eq!(refusal, Err(FlightRefusal::Plan(PlanError::NotFinite)));
    assert_eq!(robot.stack.reference(), None);
}

/// A take-off that expires before the robot leaves the ground leaves no plan behind.
#[test]
fn a_take_off_gives_thrust_and_expires() {
    let mut robot = Standing::new();
    robot.wait_alive(1000);
    robot.stack.arm().expect("not ready");
    robot.wait_alive(300);
    robot.stack.take_off(0.5, None).expect("refused");
    robot.wait_alive(100);
    assert_eq!(robot.stack.stage(), SupervisorStage::Flying);
    assert!(robot.duties.0.iter().all(|duty| *duty > 0.3), "{:?}", robot.duties);
    robot.stack.stop();
    robot.wait(1);
    assert_eq!(robot.duties, MotorDuties::default());
    assert_eq!(robot.stack.reference(), None);
    assert_eq!(robot.stack.hover(), Err(FlightRefusal::NotFlying));
}

/// A velocity moves an armed robot only.
#[test]
fn no_velocity_arms() {
    let mut robot = Standing::new();
    robot.wait_alive(1000);
    let climb = VelocityCommand { velocity_m_s: Vec3::Z * 0.2, ..VelocityCommand::STOP };
    for _ in 0..1000 {
        robot.stack.fly(&climb);
        robot.wait(1);
        assert_eq!(robot.stack.stage(), SupervisorStage::Ready);
    }
    robot.stack.arm().expect("not ready");
    for _ in 0..500 {
        robot.stack.fly(&climb);
        robot.wait(1);
    }
    assert_eq!(robot.stack.stage(), SupervisorStage::Flying);
}
