//! Flights whose commands go to a copy of the flight controller, which is older than the controller.

use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::stack::FlightStack;
use bittybuzz_flight::supervisor::SupervisorStage;

use super::rig::Rig;

/// Seconds from a copy to the command, and from the command to its return. The firmware makes a copy
/// each 10 ms, and takes it back after the next sample.
const COPY_AGE_S: f64 = 0.009;
const RETURN_S: f64 = 0.003;

/// Lets `act` command a copy.
fn command<R>(rig: &mut Rig, act: impl FnOnce(&mut FlightStack) -> R) -> R {
    let mut copy = rig.stack;
    rig.run(COPY_AGE_S, |_| {});
    let result = act(&mut copy);
    rig.run(RETURN_S, |_| {});
    rig.stack.take_commands(&copy);
    result
}

/// A robot that flies to 0.5 m, with its plans made elsewhere.
fn flying(seed: u64) -> Rig {
    let mut rig = Rig::with_capture(seed);
    rig.stack.plan_elsewhere();
    rig.run(2.0, |_| {});
    command(&mut rig, |copy| copy.arm().expect("not ready"));
    rig.run(0.3, |_| {});
    command(&mut rig, |copy| copy.take_off(0.5, Some(2.0)).expect("no take-off"));
    rig.run(3.0, |_| {});
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    rig
}

/// The reference does not jump when a plan takes over, and the robot follows it as if it had made the
/// plan itself (5.6 mm rms, docs/flight.md).
#[test]
fn a_plan_of_a_copy_begins_without_a_jump() {
    let mut rig = flying(1);
    let mut before_m;
    let (mut sum, mut count, mut largest_m) = (0.0, 0.0, 0.0_f64);
    for x_m in [1.0, 0.0, 0.5] {
        let there = Destination::Absolute { position_m: Vec3::new(x_m, 0.0, 0.5), yaw_rad: None };
        // The second goal comes in motion, so that the robot may have to brake before it.
        command(&mut rig, |copy| copy.go_to(there, None).expect("no plan"));
        // The reference of the last tick is still that of the old plan.
        before_m = rig.reference_m();
        for _ in 0..1_200 {
            if rig.stack.is_plan_due() {
                command(&mut rig, FlightStack::plan_what_is_due);
                before_m = rig.reference_m();
            }
            rig.run(0.001, |_| {});
            largest_m = largest_m.max(rig.reference_m().distance(before_m));
            before_m = rig.reference_m();
            sum += rig.true_error_m().powi(2);
            count += 1.0;
        }
    }
    let rms_mm = 1000.0 * (sum / count).sqrt();
    println!("{rms_mm} mm rms, largest step {largest_m} m");
    // A control step of 2 ms at the planner's speed of 1.5 m/s.
    assert!(largest_m < 0.0031, "{largest_m} m");
    assert!(rms_mm < 12.0, "{rms_mm} mm");
}

/// The supervisor lands a robot without set-points, whether a copy plans the landing or nobody does.
#[test]
fn a_landing_of_the_supervisor_needs_no_copy() {
    for has_copy in [true, false] {
        let mut rig = flying(2);
        for _ in 0..8_000 {
            rig.step();
            if has_copy && rig.stack.is_plan_due() {
                let mut copy = rig.stack;
                copy.plan_what_is_due();
                rig.stack.take_commands(&copy);
                assert!(!rig.stack.is_plan_due());
            }
        }
        let z_m = rig.drone.state().position_m.z;
        assert!(rig.motors_are_off() && z_m < 0.02, "{has_copy}: {z_m} m");
        assert!(!rig.drone.has_crashed(), "{has_copy}");
    }
}

/// The supervisor may end a flight while a copy plans. Its plan must not revive the flight.
#[test]
fn a_plan_of_an_ended_flight_is_dropped() {
    let mut rig = flying(3);
    let mut copy = rig.stack;
    let there = Destination::Relative { displacement_m: Vec3::X, turn_rad: 0.0 };
    copy.go_to(there, None).expect("no plan");
    rig.stack.emergency_stop();
    rig.step();
    assert!(rig.motors_are_off());
    rig.stack.take_commands(&copy);
    rig.run(0.5, |rig| assert!(rig.motors_are_off()));
    assert_eq!(rig.stack.stage(), SupervisorStage::Locked);
    assert_eq!(rig.stack.reference(), None);
}

/// A copy disarms, although the controller has changed meanwhile.
#[test]
fn a_copy_disarms() {
    let mut rig = flying(4);
    command(&mut rig, FlightStack::stop);
    rig.step();
    assert!(rig.motors_are_off());
}
