//! Forces of the air that depend on the ground and on other robots.

/// Factor of the ground effect in gym-pybullet-drones (utiasDSL, commit 90b178a), which fits the
/// data of Shi et al. 2019, "Neural Lander".
const GROUND_EFFECT_FACTOR: f64 = 11.368_59;
/// Largest gain of thrust by the ground. The same simulator limits the height such that all motors
/// together gain 4/15.
const GROUND_EFFECT_MAX: f64 = 4.0 / 15.0;

/// Returns the factor by which the ground below a propeller raises its thrust, 1 to 1.27.
///
/// # Parameters
/// * `height_m`: height of the propeller above the ground.
/// * `radius_m`: radius of the propeller.
#[must_use]
pub fn ground_effect(height_m: f64, radius_m: f64) -> f64 {
    let ratio = radius_m / (4.0 * height_m.max(1e-3));
    1.0 + (GROUND_EFFECT_FACTOR * ratio * ratio).min(GROUND_EFFECT_MAX)
}

/// Largest force of downwash in N (choice). Shi et al. 2020 ("Neural-Swarm", arXiv 2003.02992) found
/// about 9 g (recalled) for a Crazyflie 0.3 m below another one; the formula yields ten times as much.
const DOWNWASH_N_MAX: f64 = 0.1;
/// Least width of the stream in m, a choice: the size of a robot. The formula of the width is
/// negative below 0.69 m.
const DOWNWASH_WIDTH_M_MIN: f64 = 0.06;

/// Returns the force that pushes a robot down when another one flies above it, in N, 0 to 0.1.
///
/// The formula is that of gym-pybullet-drones (commit 90b178a), with a limit on the force and on the
/// width of the stream. Measurements of Crazyflies should replace it.
///
/// # Parameters
/// * `above_m`: height of the upper robot above the lower one; there is no force at 0 or less.
/// * `aside_m`: horizontal distance of both.
/// * `radius_m`: radius of a propeller of the upper robot.
#[must_use]
pub fn downwash_n(above_m: f64, aside_m: f64, radius_m: f64) -> f64 {
    if above_m.is_nan() || above_m <= 0.0 || !aside_m.is_finite() {
        return 0.0;
    }
    let ratio = radius_m / (4.0 * above_m);
    let strength = (2267.18 * ratio * ratio).min(DOWNWASH_N_MAX);
    let width = (0.16 * above_m - 0.11).max(DOWNWASH_WIDTH_M_MIN);
    let share = aside_m / width;
    strength * libm::exp(-0.5 * share * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_M: f64 = 0.023_134_8;

    /// Values computed by hand for the propeller of the source.
    #[test]
    fn ground_effect_falls_with_height() {
        for (height, gain) in [(0.05, 0.152), (0.10, 0.038), (0.20, 0.0095)] {
            let found = ground_effect(height, RADIUS_M) - 1.0;
            assert!((found - gain).abs() < 0.0005, "{height} m: {found}");
        }
        assert_eq!(ground_effect(0.0, RADIUS_M), 1.0 + 4.0 / 15.0);
        assert_eq!(ground_effect(-1.0, RADIUS_M), 1.0 + 4.0 / 15.0);
    }

    #[test]
    fn downwash_is_limited_and_local() {
        assert_eq!(downwash_n(0.3, 0.0, RADIUS_M), 0.1);
        assert!((downwash_n(1.0, 0.0, RADIUS_M) - 0.0758).abs() < 0.0005);
        // One deviation aside.
        let ratio = downwash_n(2.0, 0.21, RADIUS_M) / downwash_n(2.0, 0.0, RADIUS_M);
        assert!((ratio - 0.606_53).abs() < 1e-5);
        assert!(downwash_n(0.3, 0.5, RADIUS_M) < 1e-15);
        assert_eq!(downwash_n(-0.3, 0.0, RADIUS_M), 0.0);
        assert_eq!(downwash_n(f64::NAN, 0.0, RADIUS_M), 0.0);
    }
}
