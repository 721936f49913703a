//! Flights along the legs that the image flies as well (`tests/hil/tests/image_flights/figures.rs`), in
//! the pilot's shortest time.

use bittybuzz_flight::Vec3;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::stack::StackSettings;

use crate::flight_closed_loop::figures::{mean, rms, worst};
use crate::flight_closed_loop::rig::Rig;

/// Name, places in m and time in s of a flight.
type Legs = (&'static str, &'static [[f32; 2]], f64);

const LEGS: [Legs; 4] = [
    ("1 m", &[[1.0, 0.0], [0.0, 0.0]], 6.0),
    ("3 m", &[[3.0, 0.0], [0.0, 0.0]], 15.0),
    ("5 m", &[[5.0, 0.0], [0.0, 0.0]], 24.0),
    ("square of 1 m", &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], 12.0),
];
const HEIGHT_M: f32 = 1.0;
/// Steps of a script, in ms: a leg begins with one.
const STEP_MS: u64 = 100;

/// Returns the error from the path in mm rms.
fn error_mm((_, goals_m, seconds): Legs, seed: u64) -> f64 {
    let settings = StackSettings {
        limits: PilotSettings::CRAZYFLIE.limits,
        ..StackSettings::CRAZYFLIE_2_1_PLUS
    };
    let mut rig = Rig::with_settings(settings, seed);
    rig.take_off(HEIGHT_M);
    let mut goals_m = goals_m.iter().cycle();
    let (mut ms, mut next_ms) = (0, 0);
    let mut errors = Vec::new();
    rig.run(seconds, |rig| {
        if ms >= next_ms {
            let [x, y] = *goals_m.next().expect("a circle of goals");
            let position_m = Vec3::new(x, y, HEIGHT_M);
            let goal = Destination::Absolute { position_m, yaw_rad: Some(0.0) };
            let report = rig.stack.go_to(goal, None).expect("refused");
            next_ms = (ms + (report.duration_s * 1000.0) as u64).next_multiple_of(STEP_MS);
        }
        ms += 1;
        errors.push(rig.true_error_m());
    });
    1e3 * rms(&errors)
}

#[test]
fn legs_in_the_shortest_time_are_accurate() {
    for legs in LEGS {
        let errors: Vec<f64> = (1..=10).map(|seed| error_mm(legs, seed)).collect();
        let (mean, worst) = (mean(&errors), worst(&errors));
        println!("{}: mean {mean:.2}, worst {worst:.2} mm rms", legs.0);
        assert!(worst < 30.0, "{}: {worst} mm rms", legs.0);
    }
}
