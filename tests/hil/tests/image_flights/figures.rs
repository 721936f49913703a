//! The accuracy of the image's flights, as of the host's in docs/flight.md.

use bittybuzz_hil::Command;

use super::course::{Course, rms};
use super::fresh::numbers;

/// The noise of the host's poses in mm, and in degrees.
const POSE_NOISE_MM: f64 = 1.0;
const POSE_NOISE_DEGREES: f64 = 0.286;
/// Height of the host's flights in mm.
const HEIGHT_MM: u32 = 1_000;

/// A flight whose accuracy is a figure.
struct Figure {
    name: &'static str,
    goals_mm: &'static [[f32; 2]],
    seconds: u64,
}

const FIGURES: [Figure; 5] = [
    Figure { name: "hover", goals_mm: &[[0.0, 0.0]], seconds: 60 },
    Figure { name: "1 m", goals_mm: &[[1e3, 0.0], [0.0, 0.0]], seconds: 6 },
    Figure { name: "3 m", goals_mm: &[[3e3, 0.0], [0.0, 0.0]], seconds: 15 },
    Figure { name: "5 m", goals_mm: &[[5e3, 0.0], [0.0, 0.0]], seconds: 24 },
    Figure {
        name: "square of 1 m",
        goals_mm: &[[1e3, 0.0], [1e3, 1e3], [0.0, 1e3], [0.0, 0.0]],
        seconds: 12,
    },
];

/// Returns the error from the path in mm rms.
fn error_mm(figure: &Figure, seed: u64) -> f64 {
    let course = Course { height_mm: HEIGHT_MM, goals_mm: figure.goals_mm.to_vec() };
    let body = Command::Body {
        seed,
        x_mm: 0.0,
        y_mm: 0.0,
        yaw_degrees: 0.0,
        pose_ms: 10,
        pose_noise_mm: POSE_NOISE_MM,
        pose_noise_degrees: POSE_NOISE_DEGREES,
    };
    let mut flight = course.take_off(|robot| robot.execute(&body));
    // Figures of the host count from 5 s after the command to take off on.
    flight.robot.run_ms(1_000 * figure.seconds);
    assert_eq!(flight.early_end(), None, "{} with seed {seed}", figure.name);
    let errors = flight.errors(&course, Some(&|place_m| place_m));
    1e3 * rms(&errors.distances_m)
}

#[test]
#[ignore = "`cargo xtask soak image_flights` runs it"]
fn fresh_figures() {
    let numbers = numbers();
    for figure in &FIGURES {
        for seed in numbers.clone() {
            println!(
                "figure: mm rms, {} = {:.2} in flight {seed}",
                figure.name,
                error_mm(figure, seed as u64)
            );
        }
    }
}
