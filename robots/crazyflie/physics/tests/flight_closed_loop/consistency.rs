//! Consistency of the estimate: the normalized squared error (NEES) of position, velocity and
//! attitude. A consistent filter has a mean equal to the number of states.

use bittybuzz_crazyflie_physics::{DQuat, DVec3};

use crate::flight_closed_loop::figures::mean;
use crate::flight_closed_loop::path::figure_8;
use crate::flight_closed_loop::rig::Rig;

/// Returns eᵀ·P⁻¹·e for the states from `first` on, by elimination.
fn normalized_square<const N: usize>(
    error: &[f64; 9],
    covariance: &[[f32; 13]; 13],
    first: usize,
) -> f64 {
    let mut rows: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| covariance[first + i][first + j].into()));
    let mut rest: [f64; N] = std::array::from_fn(|i| error[first + i]);
    let mut square = 0.0;
    for k in 0..N {
        // A step of LDLᵀ: the k-th part of the error, whitened.
        let (pivot, part) = (rows[k], rest[k]);
        square += part * part / pivot[k];
        for (row, value) in rows.iter_mut().zip(&mut rest).skip(k + 1) {
            let factor = row[k] / pivot[k];
            *value -= factor * part;
            for (entry, above) in row.iter_mut().zip(pivot) {
                *entry -= factor * above;
            }
        }
    }
    square
}

/// Returns the NEES of all nine states, of position, of velocity and of attitude.
fn nees(rig: &Rig) -> [f64; 4] {
    nees_of(rig, DQuat::IDENTITY, DQuat::IDENTITY, DVec3::ZERO)
}

/// Returns the same against the frame of sensors: the world's is turned and then displaced, the
/// body's is turned.
pub fn nees_of(rig: &Rig, frame_turn: DQuat, body_turn: DQuat, offset_m: DVec3) -> [f64; 4] {
    let (truth, estimate) = (rig.drone.state(), rig.stack.state());
    let attitude = estimate.attitude.as_dquat();
    let true_attitude = frame_turn * truth.attitude * body_turn;
    let position = frame_turn * truth.position_m + offset_m - estimate.position_m.as_dvec3();
    let velocity = body_turn.conjugate() * truth.body_velocity_m_s()
        - attitude.conjugate() * estimate.velocity_m_s.as_dvec3();
    let turn: DVec3 = (attitude.conjugate() * true_attitude).normalize().to_scaled_axis();
    let mut error = [0.0; 9];
    for (part, value) in [position, velocity, turn].into_iter().enumerate() {
        error[3 * part..3 * part + 3].copy_from_slice(&value.to_array());
    }
    let covariance = rig.stack.covariance();
    [
        normalized_square::<9>(&error, &covariance, 0),
        normalized_square::<3>(&error, &covariance, 0),
        normalized_square::<3>(&error, &covariance, 3),
        normalized_square::<3>(&error, &covariance, 6),
    ]
}

/// Returns the mean NEES of flights of 12 s, sampled four times per second, and prints it with that of
/// its parts.
fn mean_nees(
    name: &str,
    seeds: u64,
    start: impl Fn(u64) -> Rig,
    command: impl Fn(&mut Rig),
) -> f64 {
    let mut samples: [Vec<f64>; 4] = Default::default();
    for seed in 1..=seeds {
        let mut rig = start(seed);
        rig.take_off(0.5);
        command(&mut rig);
        for _ in 0..48 {
            rig.run(0.25, |_| {});
            for (list, value) in samples.iter_mut().zip(nees(&rig)) {
                list.push(value);
            }
        }
    }
    let [all, position, velocity, attitude] = samples.map(|list| mean(&list));
    println!(
        "NEES, {name}, {seeds} seeds: {all:.1} of 9; position {position:.1}, \
         velocity {velocity:.1}, attitude {attitude:.1} of 3"
    );
    all
}

/// Returns the mean NEES of four kinds of flights.
fn nees_of_flights(seeds: u64) -> [f64; 4] {
    let fly_figure = |rig: &mut Rig| {
        rig.stack.follow_trajectory(&figure_8(), true).expect("refused");
    };
    [
        mean_nees("capture, hover", seeds, Rig::with_capture, |_| {}),
        mean_nees("capture, figure 8", seeds, Rig::with_capture, fly_figure),
        mean_nees("deck, hover", seeds, Rig::with_deck, |_| {}),
        mean_nees("deck, figure 8", seeds, Rig::with_deck, fly_figure),
    ]
}

/// 9 is ideal. Less is cautious: the filter's noise covers disturbances that these flights lack.
#[test]
fn the_estimate_is_consistent() {
    let found = nees_of_flights(20);
    assert!(found.iter().all(|nees| (2.0..12.0).contains(nees)), "{found:?}");
}

#[test]
#[ignore = "takes a minute"]
fn the_estimate_is_consistent_over_200_seeds() {
    let found = nees_of_flights(200);
    assert!(found.iter().all(|nees| (2.0..12.0).contains(nees)), "{found:?}");
}
