//! A figure 8 as a trajectory of polynomial pieces.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::planner::TrajectoryPiece;

/// Length of a piece of the figure in seconds.
const PIECE_S: f64 = 0.75;

/// Returns a point of a figure 8 of 2 m by 1 m that takes 8 s, with three derivatives. The first
/// and the last two seconds are slower.
fn figure_point(time_s: f64) -> [DVec3; 4] {
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

/// Returns a figure 8 of 2 m by 1 m that takes 12 s: one and a quarter rounds.
pub fn figure_8() -> Vec<TrajectoryPiece> {
    (0..16)
        .map(|k| {
            let start_s = f64::from(k) * PIECE_S;
            piece(figure_point(start_s), figure_point(start_s + PIECE_S), PIECE_S)
        })
        .collect()
}
