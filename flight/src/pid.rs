//! A PID controller.
//!
//! The proportional part acts on the error, the derivative part on the measurement, so that a step
//! of the desired value gives no peak (Åström & Hägglund 1995, set-point weights b = 1 and c = 0).
//! Anti-windup is a limit of the integral: [`PidGains::integral_limit`] bounds the integral of the
//! error, and with it the time that the integral needs to unwind. The limit of the output does not
//! act on the integral.

/// The gains and limits of a PID controller.
///
/// The unit of the output is that of `kp` times that of the error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains {
    /// Output per error.
    pub kp: f32,
    /// Output per integral of the error over seconds.
    pub ki: f32,
    /// Output per rate of the measurement.
    pub kd: f32,
    /// Largest magnitude of the integral of the error, infinite for none.
    pub integral_limit: f32,
    /// Largest magnitude of the output, infinite for none.
    pub output_limit: f32,
}

impl PidGains {
    /// Returns gains without limits.
    pub const fn new(kp: f32, ki: f32, kd: f32) -> Self {
        PidGains { kp, ki, kd, integral_limit: f32::INFINITY, output_limit: f32::INFINITY }
    }

    /// Returns the same gains with a limit of the integral of the error.
    pub const fn with_integral_limit(self, integral_limit: f32) -> Self {
        PidGains { integral_limit, ..self }
    }

    /// Returns the same gains with a limit of the output.
    pub const fn with_output_limit(self, output_limit: f32) -> Self {
        PidGains { output_limit, ..self }
    }
}

/// The state of one PID controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid {
    gains: PidGains,
    integral: f32,
    previous_measured: Option<f32>,
}

impl Pid {
    /// Creates a controller with an empty integral.
    pub const fn new(gains: PidGains) -> Self {
        Pid { gains, integral: 0.0, previous_measured: None }
    }

    /// Returns the integral of the error over seconds.
    pub const fn integral(&self) -> f32 {
        self.integral
    }

    /// Empties the integral and forgets the last measurement.
    pub fn reset(&mut self) {
        *self = Pid::new(self.gains);
    }

    /// Returns the output for one step of `dt_s` seconds.
    ///
    /// A number that is not finite or a step that is not positive leaves the state unchanged, and
    /// the output is that of the integral alone. The derivative part is zero in the first step.
    pub fn update(&mut self, desired: f32, measured: f32, dt_s: f32) -> f32 {
        self.step(desired, measured, dt_s, |difference| difference)
    }

    /// Returns the output for an angle in degrees: differences of angles lie within ±180 degrees.
    pub fn update_angle_deg(&mut self, desired_deg: f32, measured_deg: f32, dt_s: f32) -> f32 {
        self.step(desired_deg, measured_deg, dt_s, wrap_deg)
    }

    fn step(&mut self, desired: f32, measured: f32, dt_s: f32, wrap: fn(f32) -> f32) -> f32 {
        let gains = self.gains;
        let error = wrap(desired - measured);
        if !(error.is_finite() && measured.is_finite() && dt_s.is_finite() && dt_s > 0.0) {
            return limit(gains.ki * self.integral, gains.output_limit);
        }
        let rate = match self.previous_measured {
            Some(previous) => wrap(measured - previous) / dt_s,
            None => 0.0,
        };
        self.previous_measured = Some(measured);
        let integral = limit(self.integral + error * dt_s, gains.integral_limit);
        if integral.is_finite() {
            self.integral = integral;
        }
        let output = gains.kp * error + gains.ki * self.integral - gains.kd * rate;
        // Finite inputs of extreme size can still overflow to infinity minus infinity.
        limit(if output.is_nan() { 0.0 } else { output }, gains.output_limit)
    }
}

/// Returns the angle in degrees that lies within ±180 and differs by a multiple of 360.
pub fn wrap_deg(angle_deg: f32) -> f32 {
    angle_deg - 360.0 * libm::rintf(angle_deg / 360.0)
}

/// Returns the value, cut to ± `limit`. A limit below zero or NaN counts as zero.
fn limit(value: f32, limit: f32) -> f32 {
    let limit = limit.max(0.0);
    value.max(-limit).min(limit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The discrete sums of the definition for a ramp of the measurement, by closed form.
    #[test]
    fn parts_follow_their_definition() {
        let (kp, ki, kd, dt) = (3.0, 0.5, 0.25, 0.01);
        let mut pid = Pid::new(PidGains::new(kp, ki, kd));
        let slope = 2.0;
        let mut output = 0.0;
        let steps = 100;
        for k in 0..steps {
            output = pid.update(1.0, slope * k as f32 * dt, dt);
        }
        let n = steps as f32;
        let last_error = 1.0 - slope * (n - 1.0) * dt;
        let sum = n * dt - slope * dt * dt * n * (n - 1.0) / 2.0;
        assert!((output - (kp * last_error + ki * sum - kd * slope)).abs() < 1e-4);
    }

    /// First-order plant with a constant load: the integral removes the error.
    #[test]
    fn integral_removes_the_error_of_a_load() {
        let mut pid = Pid::new(PidGains::new(2.0, 4.0, 0.0));
        let mut x = 0.0_f64;
        for _ in 0..20_000 {
            let u = f64::from(pid.update(1.0, x as f32, 0.001));
            x += 0.001 * (-x + u - 0.7);
        }
        assert!((x - 1.0).abs() < 1e-4, "{x}");
    }

    #[test]
    fn angles_take_the_short_way() {
        let mut pid = Pid::new(PidGains::new(1.0, 0.0, 1.0));
        assert!((pid.update_angle_deg(-170.0, 170.0, 0.1) - 20.0).abs() < 1e-4);
        // The measurement passes 180 degrees: 2 degrees in 0.1 s, not −358.
        pid.update_angle_deg(179.0, 179.0, 0.1);
        assert!((pid.update_angle_deg(179.0, -179.0, 0.1) - (-2.0 - 20.0)).abs() < 1e-3);
    }

    #[test]
    fn reset_empties_the_state() {
        let gains = PidGains::new(1.0, 1.0, 1.0);
        let mut pid = Pid::new(gains);
        pid.update(4.0, 1.0, 0.1);
        pid.reset();
        assert_eq!(pid, Pid::new(gains));
    }

    proptest! {
        #[test]
        fn limits_hold_and_output_is_finite(
            values in prop::collection::vec((any::<f32>(), any::<f32>(), any::<f32>()), 1..50)
        ) {
            let gains = PidGains::new(250.0, 500.0, 2.5)
                .with_integral_limit(33.3)
                .with_output_limit(1000.0);
            let mut pid = Pid::new(gains);
            for (desired, measured, dt) in values {
                let output = pid.update(desired, measured, dt);
                prop_assert!(output.abs() <= 1000.0);
                prop_assert!(pid.integral().abs() <= 33.3);
            }
        }
    }
}
