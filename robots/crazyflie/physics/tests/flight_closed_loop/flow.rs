//! Flights with a Flow deck: flow at 100 Hz and the distance to the ground at 30 Hz.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::Destination;
use bittybuzz_flight::supervisor::SupervisorStage;

use crate::flight_closed_loop::figures::{rms, worst};
use crate::flight_closed_loop::rig::Rig;

/// Counts of the flow sensor per radian: ten counts per pixel, 35 pixels in 0.716 74 rad.
const COUNTS_PER_RAD: f64 = 10.0 * 35.0 / 0.716_74;

/// An ideal integrator of flow, for comparison.
///
/// It knows the true attitude, the true mean rate over the time of each flow, and the true vertical
/// speed. From the counts and the latest distance it gets the velocity in the body frame, which it
/// adds up in the world frame. So its drift is that of the noise of the counts alone.
struct IdealIntegrator {
    position_m: DVec3,
    range_m: f64,
    rate_sum: DVec3,
    rates: f64,
}

impl IdealIntegrator {
    fn new(rig: &Rig) -> Self {
        let position_m = rig.drone.state().position_m;
        IdealIntegrator { position_m, range_m: position_m.z, rate_sum: DVec3::ZERO, rates: 0.0 }
    }

    fn step(&mut self, rig: &Rig) {
        let state = rig.drone.state();
        self.rate_sum += state.rate_rad_s;
        self.rates += 1.0;
        self.range_m = rig.readings.range_m.unwrap_or(self.range_m);
        let Some(counts) = rig.readings.counts else { return };
        let rate = self.rate_sum / self.rates;
        let flow = counts.map(|count| count / (COUNTS_PER_RAD * 0.01));
        let [x, y] = [(flow[0] + rate.y) * self.range_m, (flow[1] - rate.x) * self.range_m];
        let z = (state.attitude.conjugate() * state.velocity_m_s).z;
        self.position_m += state.attitude * DVec3::new(x, y, z) * 0.01;
        self.rate_sum = DVec3::ZERO;
        self.rates = 0.0;
    }
}

/// Figures of one hover at 0.5 m for 30 s.
struct Hover {
    /// Distance of the estimate from the reference, in m rms.
    own_error_m: f64,
    /// Horizontal growth of the estimate's error, in m.
    drift_m: f64,
    /// The same of the ideal integrator.
    ideal_drift_m: f64,
}

fn hover(seed: u64, sigma_counts: f64) -> Hover {
    let mut rig = Rig::with_flow_noise(seed, sigma_counts);
    rig.take_off(0.5);
    let mut ideal = IdealIntegrator::new(&rig);
    let start = rig.estimate_error_m().truncate();
    let mut errors = Vec::new();
    rig.run(30.0, |rig| {
        ideal.step(rig);
        errors.push(rig.own_error_m());
    });
    Hover {
        own_error_m: rms(&errors),
        drift_m: (rig.estimate_error_m().truncate() - start).length(),
        ideal_drift_m: (ideal.position_m - rig.drone.state().position_m).truncate().length(),
    }
}

/// Returns the error in m rms over all seeds, and the drift relative to that of the ideal
/// integrator.
fn judge(seeds: u64, sigma_counts: f64) -> (f64, f64) {
    let hovers: Vec<_> = (1..=seeds).map(|seed| hover(seed, sigma_counts)).collect();
    let figures = |figure: fn(&Hover) -> f64| hovers.iter().map(figure).collect::<Vec<_>>();
    let own = figures(|hover| hover.own_error_m);
    let drift_m = rms(&figures(|hover| hover.drift_m));
    let ideal_m = rms(&figures(|hover| hover.ideal_drift_m));
    println!(
        "flow of {sigma_counts} counts, {seeds} seeds: own error {:.1} mm, worst {:.1} mm; \
         drift {:.1} mm, ideal {:.1} mm, ratio {:.2}",
        1e3 * rms(&own),
        1e3 * worst(&own),
        1e3 * drift_m,
        1e3 * ideal_m,
        drift_m / ideal_m
    );
    (rms(&own), drift_m / ideal_m)
}

/// With 2 counts in 10 ms at 0.5 m the sum of the counts walks by 20 mm/√s along each axis. A loop
/// with the gains k_p and k_v that follows this sum, even with a perfect velocity, leaves 20 mm ·
/// √(1/(2 k_v) + k_v/(2 k_p)) along each axis: 19 mm for both. So the filter's position follows its
/// velocity instead (`EkfConfig::flow_moves_position`).
#[test]
fn flow_keeps_the_position() {
    let (own_m, ratio) = judge(20, 2.0);
    assert!(own_m < 0.01, "{own_m}");
    assert!(ratio < 1.3, "{ratio}");
}

/// Bitcraze's firmware can also model the noise as 0.000 798 4 · shutter + 0.4335 counts
/// (crazyflie-firmware 2a18fc29, `flowdeck_v1v2.c`), so half a count stands for a bright ground
/// with texture.
#[test]
fn flow_over_texture_keeps_the_position_to_a_centimeter() {
    let (own_m, ratio) = judge(20, 0.5);
    assert!(own_m < 0.01, "{own_m}");
    assert!(ratio < 1.3, "{ratio}");
}

/// The filter takes a distance for 33 ms old. If it is of the middle of the measurement, it is 17 ms old.
#[test]
fn either_age_of_a_distance_keeps_the_height() {
    for age_ms in [17, 33] {
        let errors = (1..=10).map(|seed| {
            let mut rig = Rig::with_flow_noise(seed, 2.0);
            rig.set_range_age(age_ms);
            rig.take_off(0.4);
            let mut errors = Vec::new();
            for displacement_m in [Vec3::Z, Vec3::NEG_Z] {
                let destination = Destination::Relative { displacement_m, turn_rad: 0.0 };
                rig.stack.go_to(destination, None).expect("a flight");
                rig.run(4.0, |rig| errors.push(rig.estimate_error_m().z.abs()));
            }
            assert_eq!(rig.stack.stage(), SupervisorStage::Flying, "seed {seed}");
            worst(&errors)
        });
        let error_m = worst(&errors.collect::<Vec<_>>());
        println!("distances {age_ms} ms old: height wrong by at most {:.1} mm", 1e3 * error_m);
        // 16 ms at 0.5 m/s are 8 mm, beside the noise.
        assert!(error_m < 0.03, "{age_ms} ms: {error_m}");
    }
}

#[test]
#[ignore = "takes minutes"]
fn flow_drifts_little_over_200_seeds() {
    for sigma_counts in [2.0, 1.0, 0.5] {
        let (_, ratio) = judge(200, sigma_counts);
        assert!(ratio < 1.3, "{ratio}");
    }
}
