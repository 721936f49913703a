//! Flights with motion capture at 100 Hz, 1 mm, 10 ms late.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::stack::AttitudeCommand;
use bittybuzz_flight::{Reference, Vec3};

use crate::flight_closed_loop::figures::{mean, rms, step_figures, worst};
use crate::flight_closed_loop::path::figure_8;
use crate::flight_closed_loop::rig::Rig;

/// A function that builds the robot of a seed.
type Start = fn(u64) -> Rig;

/// Kinds of robots, by their name.
const KINDS: [(&str, Start); 2] =
    [("2.1+", Rig::with_capture), ("Brushless", Rig::brushless_with_capture)];
/// Builds of each kind.
const SEEDS: u64 = 10;

/// Flies all builds, and returns the worst figure of each kind.
///
/// # Parameters
/// `scale`: the factor for the printed unit.
fn worst_of_kinds(figure: &str, scale: f64, flight: impl Fn(&mut Rig) -> f64) -> [f64; 2] {
    KINDS.map(|(kind, start)| {
        let fly = |seed| {
            let mut rig = start(seed);
            rig.take_off(1.0);
            flight(&mut rig)
        };
        let figures: Vec<f64> = (1..=SEEDS).map(fly).collect();
        let (mean, worst) = (scale * mean(&figures), scale * worst(&figures));
        println!("{kind}, {figure}: mean {mean:.2}, worst {worst:.2}");
        worst / scale
    })
}

#[test]
fn hover_is_accurate() {
    let worst = worst_of_kinds("hover, mm rms", 1e3, |rig| {
        let mut errors = Vec::new();
        rig.run(60.0, |rig| errors.push(rig.true_error_m()));
        rms(&errors)
    });
    assert!(worst.iter().all(|worst_m| *worst_m < 0.005));
}

#[test]
fn go_to_follows_its_path() {
    let worst = worst_of_kinds("go to 1 m in 2 s, mm rms", 1e3, |rig| {
        let destination = Destination::Relative { displacement_m: Vec3::X, turn_rad: 0.0 };
        let report = rig.stack.go_to(destination, Some(2.0)).expect("refused");
        assert_eq!(report.duration_s, 2.0);
        let mut errors = Vec::new();
        rig.run(2.0, |rig| errors.push(rig.true_error_m()));
        rms(&errors)
    });
    assert!(worst.iter().all(|worst_m| *worst_m < 0.03));
}

/// Two seconds after the start, the figure takes 8 s at full speed.
#[test]
fn figure_8_is_accurate() {
    let pieces = figure_8();
    let worst = worst_of_kinds("figure 8, mm mean", 1e3, |rig| {
        rig.stack.follow_trajectory(&pieces, true).expect("refused");
        rig.run(2.0, |_| {});
        let (mut errors, mut speeds) = (Vec::new(), Vec::new());
        rig.run(8.0, |rig| {
            errors.push(rig.true_error_m());
            speeds.push(rig.drone.state().velocity_m_s.length());
        });
        assert!((mean(&speeds) - 0.75).abs() < 0.03);
        mean(&errors)
    });
    assert!(worst.iter().all(|worst_m| *worst_m < 0.035));
}

/// A step of the reference itself, without a plan.
#[test]
fn vertical_step_does_not_overshoot() {
    let worst = worst_of_kinds("vertical step of 1 m, % overshoot", 1e2, |rig| {
        let start = rig.stack.reference().expect("no reference");
        let start_m = rig.drone.state().position_m.z;
        let position_m = start.position_m + Vec3::Z;
        rig.stack.track(&Reference { position_m, ..start }).expect("refused");
        let mut heights = Vec::new();
        rig.run(6.0, |rig| heights.push(rig.drone.state().position_m.z - start_m));
        step_figures(&heights, 1.0).1
    });
    assert!(worst.iter().all(|overshoot| *overshoot < 0.03));
}

/// Returns the true roll of each millisecond after a command of 10 degrees.
fn roll_step(rig: &mut Rig, roll_rad: f64) -> Vec<f64> {
    rig.stack.hold(&AttitudeCommand::default()).expect("refused");
    rig.run(0.5, |_| {});
    let command = AttitudeCommand { roll_rad: roll_rad as f32, ..AttitudeCommand::default() };
    rig.stack.hold(&command).expect("refused");
    let mut rolls = Vec::new();
    rig.run(1.0, |rig| {
        let up = rig.drone.state().attitude * DVec3::Z;
        rolls.push(-up.y.asin());
    });
    rolls
}

#[test]
fn roll_step_is_fast_and_damped() {
    let roll_rad = 10.0_f64.to_radians();
    let rises = worst_of_kinds("roll step of 10°, ms rise", 1e3, |rig| {
        step_figures(&roll_step(rig, roll_rad), roll_rad).0
    });
    let overshoots = worst_of_kinds("roll step of 10°, % overshoot", 1e2, |rig| {
        step_figures(&roll_step(rig, roll_rad), roll_rad).1
    });
    assert!(rises.iter().all(|rise_s| *rise_s < 0.18));
    assert!(overshoots.iter().all(|overshoot| *overshoot < 0.05));
}
