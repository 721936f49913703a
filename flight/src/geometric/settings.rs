//! Gains and limits of the geometric controller.

use glam::Vec3;

/// Gains and limits. Gains are accelerations per error, so that they hold for any mass and inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometricSettings {
    /// Acceleration per position error, in 1/s².
    pub position_1_s2: Vec3,
    /// Acceleration per velocity error, in 1/s.
    pub velocity_1_s: Vec3,
    /// Acceleration per integral of the position error, in 1/s³.
    pub position_integral_1_s3: Vec3,
    /// Acceleration per integral of the velocity error, in 1/s².
    pub velocity_integral_1_s2: Vec3,
    /// Largest magnitude of the acceleration by the integrals, in m/s².
    pub integral_limit_m_s2: Vec3,
    /// Largest position error that the controller uses, in m.
    pub position_error_limit_m: f32,

    /// Angular acceleration per attitude error, in 1/s².
    pub attitude_1_s2: Vec3,
    /// Angular acceleration per rate error, in 1/s.
    pub rate_1_s: Vec3,
    /// Growth of `rate_1_s` per error of the rate about x and y above 2 rad/s, in s/rad. The lead of the
    /// motors is cut in large swings, and a loop with slower motors would swing on.
    pub swing_growth_s: f32,
    /// Angular acceleration per integral of the attitude error, in 1/s³.
    pub attitude_integral_1_s3: Vec3,
    /// Angular acceleration per integral of the rate error, in 1/s².
    pub rate_integral_1_s2: Vec3,
    /// Largest magnitude of the angular acceleration by the integrals, in rad/s².
    pub integral_limit_rad_s2: Vec3,

    /// Linear drag per mass in the world frame, in 1/s, for the feed-forward.
    pub drag_1_s: Vec3,
    /// Time constant of the thrust in seconds, for the feed-forward; 0 for none.
    pub thrust_lag_s: f32,
    /// Largest tilt of the thrust that the position loop asks, in rad, below π/2.
    pub most_tilt_rad: f32,
    /// Largest yaw error in rad that the controller uses. A battery that is too weak for the yaw lets
    /// it drift, and with a large error of yaw the errors of roll and pitch would mix.
    pub most_yaw_error_rad: f32,
    /// Least vertical thrust per mass in m/s².
    pub least_lift_m_s2: f32,
    /// Largest thrust per mass in m/s².
    pub most_lift_m_s2: f32,
}

/// Returns a vector with equal x and y.
const fn xy_z(xy: f32, z: f32) -> Vec3 {
    Vec3::new(xy, xy, z)
}

impl GeometricSettings {
    /// Settings for a Crazyflie 2.1+ whose rotors have the lag that
    /// [`LagCompensation`](crate::motor::LagCompensation) leaves.
    ///
    /// With that lag τ the attitude loop has the polynomial τs³ + s² + rate·s + attitude. Its three
    /// poles sum to −1/τ. The gains of roll and pitch put them near the ITAE pattern
    /// s³ + 1.75ωs² + 2.15ω²s + ω³ (Graham & Lathrop 1953), with 2.46 instead of 2.15, because a
    /// longer lag than expected and the integral take damping away (`flight/tests/control.rs` tries a
    /// lag of 20 % more). A motor with 80 % of its thrust in a climb turns the robot with 55 rad/s²,
    /// for which the attitude gain alone would lean by 0.7 rad, and sets the integral: at 2 instead of
    /// 3 per second, two of 105 such robots flew past the fence by 0.33 and 0.42 m.
    ///
    /// The integral gains of position and of attitude have the ratio of the proportional gains: see
    /// [`geometric`](super). The drag is that of drone-models 77f04ab (`P250`).
    pub const CRAZYFLIE_2_1_PLUS: Self = {
        let lag_s = crate::motor::LagCompensation::WANTED_S;
        let omega = 1.0 / (1.75 * lag_s);
        let attitude = xy_z(omega * omega * omega * lag_s, 60.0);
        let rate = xy_z(2.46 * omega * omega * lag_s, 12.0);
        GeometricSettings {
            position_1_s2: xy_z(7.0, 14.0),
            velocity_1_s: xy_z(4.5, 7.0),
            position_integral_1_s3: xy_z(0.7 * 7.0, 14.0),
            velocity_integral_1_s2: xy_z(0.7 * 4.5, 7.0),
            // 10 g more than the vehicle's mass need 3.1 m/s².
            integral_limit_m_s2: xy_z(1.5, 4.0),
            position_error_limit_m: 0.6,
            attitude_1_s2: attitude,
            rate_1_s: rate,
            swing_growth_s: 0.1,
            attitude_integral_1_s3: xy_z(3.0 * attitude.x, 0.6 * attitude.z),
            rate_integral_1_s2: xy_z(3.0 * rate.x, 0.6 * rate.z),
            // In hover, a center of mass 6 mm off takes 111 rad/s², and a motor at 70 % of its thrust 45.
            integral_limit_rad_s2: xy_z(150.0, 10.0),
            drag_1_s: xy_z(0.01351 / 0.0318, 0.01677 / 0.0318),
            thrust_lag_s: lag_s,
            most_tilt_rad: 0.6,
            most_yaw_error_rad: 0.5,
            least_lift_m_s2: 4.0,
            most_lift_m_s2: 14.5,
        }
    };

    /// Settings for a Crazyflie 2.1 Brushless: gains are accelerations per error and hold for any mass,
    /// so only the drag differs (drone-models 77f04ab, `B500`).
    pub const CRAZYFLIE_BRUSHLESS: Self = GeometricSettings {
        drag_1_s: xy_z(0.02149 / 0.04338, 0.0236 / 0.04338),
        ..Self::CRAZYFLIE_2_1_PLUS
    };

    /// Moments of inertia in kg·m² that belong to [`Self::BITCRAZE_LEE`].
    pub const BITCRAZE_LEE_INERTIA_KG_M2: Vec3 = Vec3::new(16.5717e-6, 16.6556e-6, 29.2617e-6);

    /// The gains of Bitcraze's controller of the same law (crazyflie-firmware 2a18fc29,
    /// `controller_lee.c`), without the limits of this crate.
    ///
    /// The firmware states the attitude gains as torques: KR 0.007, 0.007, 0.008 N·m, Kω 0.00115,
    /// 0.00115, 0.002 N·m·s, KI 0.03 N·m/s. They are the same with
    /// [`Self::BITCRAZE_LEE_INERTIA_KG_M2`] in the vehicle.
    pub const BITCRAZE_LEE: Self = {
        let j = Self::BITCRAZE_LEE_INERTIA_KG_M2;
        GeometricSettings {
            position_1_s2: xy_z(7.0, 7.0),
            velocity_1_s: xy_z(4.0, 4.0),
            position_integral_1_s3: Vec3::ZERO,
            velocity_integral_1_s2: Vec3::ZERO,
            integral_limit_m_s2: Vec3::ZERO,
            position_error_limit_m: f32::INFINITY,
            attitude_1_s2: Vec3::new(0.007 / j.x, 0.007 / j.y, 0.008 / j.z),
            rate_1_s: Vec3::new(0.00115 / j.x, 0.00115 / j.y, 0.002 / j.z),
            swing_growth_s: 0.0,
            attitude_integral_1_s3: Vec3::new(0.03 / j.x, 0.03 / j.y, 0.03 / j.z),
            rate_integral_1_s2: Vec3::ZERO,
            integral_limit_rad_s2: Vec3::INFINITY,
            drag_1_s: Vec3::ZERO,
            thrust_lag_s: 0.0,
            most_tilt_rad: core::f32::consts::FRAC_PI_2,
            most_yaw_error_rad: core::f32::consts::PI,
            least_lift_m_s2: f32::NEG_INFINITY,
            most_lift_m_s2: f32::INFINITY,
        }
    };
}
