//! Flights with motion capture at 100 Hz, 1 mm, 10 ms late.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::stack::AttitudeCommand;
use bittybuzz_flight::{Reference, Vec3};

use crate::figures::{mean, rms, step_figures, worst};
use crate::path::figure_8;
use crate::rig::Rig;

/// Runs a flight for each seed and returns the figures.
fn each_seed(seeds: u64, flight: impl Fn(Rig) -> f64) -> Vec<f64> {
    (1..=seeds)
        .map(|seed| {
            let mut rig = Rig::with_capture(seed);
            rig.take_off(0.5);
            flight(rig)
        })
        .collect()
}

#[test]
fn hover_is_accurate() {
    let figures = each_seed(10, |mut rig| {
        let mut errors = Vec::new();
        let (mut estimate, mut axes) = (Vec::new(), [Vec::new(), Vec::new(), Vec::new()]);
        rig.run(60.0, |rig| {
            errors.push(rig.true_error_m());
            estimate.push(rig.estimate_error_m().length());
            let error = rig.drone.state().position_m - rig.reference_m();
            for (axis, value) in axes.iter_mut().zip(error.to_array()) {
                axis.push(value);
            }
        });
        let [x, y, z] = axes.map(|axis| 1e3 * rms(&axis));
        println!(
            "hover: rms {:.2} mm (x {x:.2} y {y:.2} z {z:.2}), of the estimate {:.2} mm",
            1e3 * rms(&errors),
            1e3 * rms(&estimate)
        );
        rms(&errors)
    });
    println!(
        "hover: rms {:.2} mm, worst seed {:.2} mm",
        1e3 * rms(&figures),
        1e3 * worst(&figures)
    );
    assert!(worst(&figures) < 0.005);
}

#[test]
fn go_to_follows_its_path() {
    let figures = each_seed(10, |mut rig| {
        let destination =
            Destination::Relative { displacement_m: Vec3::new(1.0, 0.0, 0.0), turn_rad: 0.0 };
        let report = rig.stack.go_to(destination, Some(2.0)).expect("refused");
        assert_eq!(report.duration_s, 2.0);
        let mut errors = Vec::new();
        rig.run(2.0, |rig| errors.push(rig.true_error_m()));
        println!("go-to: rms {:.1} mm, worst {:.1} mm", 1e3 * rms(&errors), 1e3 * worst(&errors));
        rms(&errors)
    });
    println!(
        "go-to: rms {:.1} mm, worst seed {:.1} mm",
        1e3 * rms(&figures),
        1e3 * worst(&figures)
    );
    assert!(worst(&figures) < 0.03);
}

#[test]
fn figure_8_is_accurate() {
    let pieces = figure_8();
    let figures = each_seed(10, |mut rig| {
        rig.stack.follow_trajectory(&pieces, true).expect("refused");
        rig.run(2.0, |_| {});
        let (mut errors, mut speeds) = (Vec::new(), Vec::new());
        rig.run(8.0, |rig| {
            errors.push(rig.true_error_m());
            speeds.push(rig.drone.state().velocity_m_s.length());
        });
        println!(
            "figure 8: mean {:.1} mm, worst {:.1} mm at {:.2} m/s",
            1e3 * mean(&errors),
            1e3 * worst(&errors),
            mean(&speeds)
        );
        mean(&errors)
    });
    println!(
        "figure 8: mean {:.1} mm, worst seed {:.1} mm",
        1e3 * mean(&figures),
        1e3 * worst(&figures)
    );
    assert!(worst(&figures) < 0.035);
}

#[test]
fn vertical_step_does_not_overshoot() {
    let figures = each_seed(10, |mut rig| {
        let start = rig.stack.reference().expect("no reference");
        let start_m = rig.drone.state().position_m.z;
        let position_m = start.position_m + Vec3::Z;
        rig.stack.track(&Reference { position_m, ..start }).expect("refused");
        let mut heights = Vec::new();
        rig.run(6.0, |rig| heights.push(rig.drone.state().position_m.z - start_m));
        let (rise_s, overshoot) = step_figures(&heights, 1.0);
        println!("vertical step: rise {rise_s:.3} s, overshoot {:.2} %", 1e2 * overshoot);
        overshoot
    });
    println!("vertical step: worst overshoot {:.2} %", 1e2 * worst(&figures));
    assert!(worst(&figures) < 0.03);
}

#[test]
fn roll_step_is_fast_and_damped() {
    let angle_rad = 10.0_f64.to_radians();
    let mut overshoots = Vec::new();
    let rises = (1..=10)
        .map(|seed| {
            let mut rig = Rig::with_capture(seed);
            rig.take_off(1.0);
            rig.stack.hold(&AttitudeCommand::default()).expect("refused");
            rig.run(0.5, |_| {});
            let roll_rad = angle_rad as f32;
            rig.stack.hold(&AttitudeCommand { roll_rad, ..Default::default() }).expect("refused");
            let mut rolls = Vec::new();
            rig.run(1.0, |rig| {
                let up = rig.drone.state().attitude * DVec3::Z;
                rolls.push(-up.y.asin());
            });
            let (rise_s, overshoot) = step_figures(&rolls, angle_rad);
            println!("roll step: rise {rise_s:.3} s, overshoot {:.2} %", 1e2 * overshoot);
            overshoots.push(overshoot);
            rise_s
        })
        .collect::<Vec<_>>();
    println!(
        "roll step: slowest rise {:.3} s, worst overshoot {:.2} %",
        worst(&rises),
        1e2 * worst(&overshoots)
    );
    assert!(worst(&rises) < 0.18 && worst(&overshoots) < 0.05);
}
