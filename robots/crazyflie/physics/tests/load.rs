//! Robots whose mass is not where the controller expects it, and whose motors are weak.

use bittybuzz_crazyflie_physics::{Airframe, DVec2};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::supervisor::SupervisorStage;

use crate::flight_closed_loop::rig::Rig;

const HEIGHT_M: f32 = 0.8;

/// Hovers for 5 s and returns the root mean square of the distance in m from the reference, once the
/// robot has taken off.
fn hover_error_m(rig: &mut Rig) -> f64 {
    rig.take_off(HEIGHT_M);
    let (mut sum, mut samples) = (0.0, 0.0);
    rig.run(5.0, |rig| {
        sum += rig.true_error_m().powi(2);
        samples += 1.0;
    });
    assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
    (sum / samples).sqrt()
}

#[test]
fn a_center_of_mass_six_millimeters_off_costs_no_accuracy() {
    for (seed, way) in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::ONE.normalize()].iter().enumerate()
    {
        let airframe = Airframe { center_m: 6e-3 * way, ..Airframe::CRAZYFLIE_2_1_PLUS };
        let mut rig = Rig::with_airframe(airframe, seed as u64);
        let error_m = hover_error_m(&mut rig);
        println!("{way}: {:.1} mm", error_m * 1000.0);
        assert!(error_m <= 0.010, "{way}: {error_m}");
    }
}

#[test]
fn a_robot_hovers_with_a_motor_at_three_quarters() {
    for motor in 0..4 {
        let mut rig = Rig::with_airframe(Airframe::CRAZYFLIE_2_1_PLUS, motor as u64);
        let mut shares = [1.0; 4];
        shares[motor] = 0.75;
        rig.drone.set_motor_efficiency(shares);
        let error_m = hover_error_m(&mut rig);
        println!("motor {motor}: {:.1} mm", error_m * 1000.0);
        assert!(error_m <= 0.020, "{motor}: {error_m}");
    }
}

/// Ten grams leave 17 % of the weight as thrust, of which the controller keeps half for the attitude.
#[test]
fn a_loaded_robot_plans_with_the_thrust_that_is_left() {
    for (seed, load_kg) in [0.0, 0.004, 0.007, 0.010].into_iter().enumerate() {
        let empty = Airframe::CRAZYFLIE_2_1_PLUS;
        let airframe = Airframe { mass_kg: empty.mass_kg + load_kg, ..empty };
        let mut rig = Rig::with_airframe(airframe, seed as u64);
        rig.take_off(HEIGHT_M);
        let mut worst_m = 0.0f64;
        for z_m in [2.0, 0.8, 2.0] {
            let position_m = Vec3::new(z_m - 0.8, 0.0, z_m);
            let destination = Destination::Absolute { position_m, yaw_rad: None };
            let report = rig.stack.go_to(destination, None).expect("no flight");
            let seconds = f64::from(report.duration_s) + 1.0;
            rig.run(seconds, |rig| worst_m = worst_m.max(rig.true_error_m()));
            assert_eq!(rig.stack.stage(), SupervisorStage::Flying);
            println!("{load_kg} kg: plan of {:.1} s, {:.1} mm", report.duration_s, worst_m * 1e3);
        }
        assert!(worst_m <= 0.050, "{load_kg}: {worst_m}");
    }
}
