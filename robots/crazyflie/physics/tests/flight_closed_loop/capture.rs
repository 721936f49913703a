//! Flights with motion capture at 100 Hz, 1 mm, 10 ms late.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::planner::{Destination, TrajectoryPiece};
use bittybuzz_flight::stack::AttitudeCommand;
use bittybuzz_flight::{Reference, Vec3};

use crate::figures::{mean, rms, step_figures, worst};
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

/// Length of a piece of the figure in seconds.
const PIECE_S: f64 = 0.75;

/// Returns a point of a figure 8 of 2 m by 1 m that takes 8 s, with three derivatives. The first and
/// the last two seconds are slower.
fn figure_8(time_s: f64) -> [DVec3; 4] {
    let (ramp_s, end_s) = (2.0, 12.0);
    // The phase is the integral of a speed that rises as 10u³ − 15u⁴ + 6u⁵.
    let rise = |u: f64| {
        let u = u.clamp(0.0, 1.0);
        [
            ramp_s * (2.5 * u.powi(4) - 3.0 * u.powi(5) + u.powi(6)),
            10.0 * u.powi(3) - 15.0 * u.powi(4) + 6.0 * u.powi(5),
            (30.0 * u.powi(2) - 60.0 * u.powi(3) + 30.0 * u.powi(4)) / ramp_s,
        ]
    };
    let phase = |t: f64| match t {
        t if t < ramp_s => rise(t / ramp_s)[0],
        t if t > end_s - ramp_s => end_s - ramp_s - rise((end_s - t) / ramp_s)[0],
        t => t - 0.5 * ramp_s,
    };
    let point = |t: f64| {
        let angle = std::f64::consts::TAU / 8.0 * phase(t.clamp(0.0, end_s));
        DVec3::new(angle.sin(), 0.5 * (2.0 * angle).sin(), 0.0)
    };
    // Central differences of order 4 are accurate to 1e-6.
    let h = 1e-2;
    let p = |k: f64| point(time_s + k * h);
    [
        point(time_s),
        (p(-2.0) - 8.0 * p(-1.0) + 8.0 * p(1.0) - p(2.0)) / (12.0 * h),
        (-p(-2.0) + 16.0 * p(-1.0) - 30.0 * p(0.0) + 16.0 * p(1.0) - p(2.0)) / (12.0 * h * h),
        (p(-3.0) - 8.0 * p(-2.0) + 13.0 * p(-1.0) - 13.0 * p(1.0) + 8.0 * p(2.0) - p(3.0))
            / (8.0 * h * h * h),
    ]
}

/// Returns the polynomial of degree 7 between two points with three derivatives each.
fn piece(from: [DVec3; 4], to: [DVec3; 4], duration_s: f64) -> TrajectoryPiece {
    // In units of the duration, the lower half of the coefficients follows from the start; the
    // upper half solves the conditions at the end.
    let scaled = |point: [DVec3; 4]| -> [DVec3; 4] {
        std::array::from_fn(|k| point[k] * duration_s.powi(k as i32))
    };
    let (start, end) = (scaled(from), scaled(to));
    let low = [start[0], start[1], start[2] / 2.0, start[3] / 6.0];
    let rest = [
        end[0] - low[0] - low[1] - low[2] - low[3],
        end[1] - low[1] - 2.0 * low[2] - 3.0 * low[3],
        end[2] - 2.0 * low[2] - 6.0 * low[3],
        end[3] - 6.0 * low[3],
    ];
    let high = [
        35.0 * rest[0] - 15.0 * rest[1] + 2.5 * rest[2] - rest[3] / 6.0,
        -84.0 * rest[0] + 39.0 * rest[1] - 7.0 * rest[2] + 0.5 * rest[3],
        70.0 * rest[0] - 34.0 * rest[1] + 6.5 * rest[2] - 0.5 * rest[3],
        -20.0 * rest[0] + 10.0 * rest[1] - 2.0 * rest[2] + rest[3] / 6.0,
    ];
    let [a, b, c, d] = low;
    let [e, f, g, h] = high;
    let mut power = 0;
    let coefficients = [a, b, c, d, e, f, g, h].map(|coefficient| {
        let scaled = coefficient / duration_s.powi(power);
        power += 1;
        scaled.as_vec3()
    });
    TrajectoryPiece::new(duration_s as f32, coefficients, [0.0; 8]).expect("not finite")
}

#[test]
fn figure_8_is_accurate() {
    let pieces: Vec<_> = (0..16)
        .map(|k| {
            let start_s = f64::from(k) * PIECE_S;
            piece(figure_8(start_s), figure_8(start_s + PIECE_S), PIECE_S)
        })
        .collect();
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
