//! Measurements, commands and voltages of any bits, while the robot stands and while it flies: the
//! flight controller never panics, its duties stay in their range, and an emergency stop is final.

use bittybuzz_flight::ekf::{FlowMeasurement, PoseMeasurement};
use bittybuzz_flight::planner::{Destination, VelocityCommand, VelocityFrame};
use bittybuzz_flight::stack::{AttitudeCommand, FlightStack, StackSettings};
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{FlightState, GRAVITY_M_S2, ImuSample, MotorDuties, Quat, Reference, Vec3};
use proptest::prelude::*;

/// Noise of the inertial sensors, without which they count as stuck: a sawtooth per axis.
fn sample(tick: u32) -> ImuSample {
    let noise = |step: u32| ((tick * step) % 101) as f32 / 101.0 - 0.5;
    let noise = Vec3::new(noise(37), noise(53), noise(71));
    ImuSample { gyro_rad_s: noise * 0.008, accel_m_s2: Vec3::Z * GRAVITY_M_S2 + noise * 0.04 }
}

/// Returns true if every duty is a share of the battery's voltage.
fn are_shares(duties: &MotorDuties) -> bool {
    duties.0.iter().all(|duty| (0.0..=1.0).contains(duty))
}

/// Runs the stack for `ticks`, commands it to climb if `climbs`, and checks the duties.
fn run(stack: &mut FlightStack, tick: &mut u32, ticks: u32, climbs: bool) {
    for _ in 0..ticks {
        if climbs {
            stack.fly(&velocity(Vec3::Z * 0.3, 0.0));
            // A robot that is not ready refuses.
            let _ = stack.arm();
        }
        *tick += 1;
        if tick.is_multiple_of(10) {
            stack.receive_pose(&PoseMeasurement {
                position_m: Vec3::Z * 0.02,
                attitude: Quat::IDENTITY,
                sigma_m: 0.001,
                sigma_rad: 0.01,
                age_s: 0.01,
            });
        }
        let duties = stack.tick(Some(&sample(*tick)), 4.0);
        assert!(are_shares(&duties), "{duties:?}");
    }
}

fn velocity(velocity_m_s: Vec3, yaw_rate_rad_s: f32) -> VelocityCommand {
    VelocityCommand { frame: VelocityFrame::World, velocity_m_s, yaw_rate_rad_s }
}

/// Does one thing with eight numbers of any bits.
fn disturb(stack: &mut FlightStack, choice: u8, n: [f32; 8]) {
    let [a, b, c, d, e, f, g, h] = n;
    let (first, second) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
    // The stack may refuse a command; the duties are checked in any case.
    match choice {
        0 => {
            let attitude = Quat::from_xyzw(d, e, f, g);
            let pose =
                PoseMeasurement { position_m: first, attitude, sigma_m: h, sigma_rad: a, age_s: b };
            stack.receive_pose(&pose);
        }
        1 => stack.receive_flow(&FlowMeasurement {
            counts_x: a,
            counts_y: b,
            sigma_counts: c,
            seconds: d,
        }),
        2 => stack.receive_range(a),
        3 => stack.fly(&velocity(first, d)),
        4 => {
            let _ = stack.take_off(a, Some(b));
        }
        5 => {
            let _ = stack.land(Some(a));
        }
        6 => {
            let destination = Destination::Absolute { position_m: first, yaw_rad: Some(d) };
            let _ = stack.go_to(destination, Some(e));
        }
        7 => {
            let _ = stack.track(&Reference {
                position_m: first,
                velocity_m_s: second,
                yaw_rad: g,
                ..Reference::default()
            });
        }
        8 => {
            let _ = stack.hold(&AttitudeCommand {
                roll_rad: a,
                pitch_rad: b,
                yaw_rate_rad_s: c,
                climb_m_s: d,
            });
        }
        9 => {
            let duties = stack.tick(Some(&ImuSample { gyro_rad_s: first, accel_m_s2: second }), g);
            assert!(are_shares(&duties), "{duties:?}");
        }
        10 => {
            let duties = stack.tick(None, a);
            assert!(are_shares(&duties), "{duties:?}");
        }
        _ => stack.adopt(&FlightState {
            position_m: first,
            velocity_m_s: second,
            attitude: Quat::from_xyzw(a, b, c, d),
            rate_rad_s: Vec3::new(e, f, g),
        }),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_bits_leave_the_duties_in_their_range(
        climbs in any::<bool>(),
        disturbances in prop::collection::vec(
            (0..12_u8, prop::array::uniform8(any::<f32>()), 1..40_u32), 1..40,
        ),
    ) {
        let mut stack = FlightStack::new(StackSettings::CRAZYFLIE_2_1_PLUS, &FlightState::default());
        let mut tick = 0;
        run(&mut stack, &mut tick, 1200, climbs);
        for (choice, numbers, ticks) in disturbances {
            disturb(&mut stack, choice, numbers);
            run(&mut stack, &mut tick, ticks, false);
        }
        stack.emergency_stop();
        for _ in 0..200 {
            tick += 1;
            prop_assert_eq!(stack.tick(Some(&sample(tick)), 4.0), MotorDuties::default());
            stack.fly(&velocity(Vec3::Z, 0.0));
        }
        prop_assert_eq!(stack.stage(), SupervisorStage::Locked);
    }
}

/// A velocity that is not finite stops the robot, as with the kinematic body of the simulator. It
/// must not keep the velocity before it alive.
#[test]
fn a_velocity_that_is_not_finite_stops_the_robot() {
    let mut stack = FlightStack::new(StackSettings::CRAZYFLIE_2_1_PLUS, &FlightState::default());
    let mut tick = 0;
    run(&mut stack, &mut tick, 1000, true);
    for _ in 0..500 {
        stack.fly(&velocity(Vec3::new(0.5, 0.0, 0.1), 0.0));
        run(&mut stack, &mut tick, 1, false);
    }
    assert!(stack.reference().is_some_and(|reference| reference.velocity_m_s.x > 0.3));
    for _ in 0..1000 {
        stack.fly(&velocity(Vec3::new(f32::NAN, 0.0, 0.1), 0.0));
        run(&mut stack, &mut tick, 1, false);
    }
    let reference = stack.reference();
    assert!(
        reference.is_none_or(|reference| reference.velocity_m_s.length() < 0.05),
        "{reference:?}"
    );
}
