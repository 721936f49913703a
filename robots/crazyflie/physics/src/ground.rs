//! Contact with the ground: eight points on springs, with friction, and the rules for a crash.
//!
//! Four points are the feet below the motors. The other four are the lowest points of the propeller
//! disks. A point below the ground receives
//! * a normal force from a spring and a damper, which never pulls, and
//! * a tangential force from a damper, and at the feet from a spring to the place where the foot
//!   stuck. It is limited to the friction coefficient times the normal force; beyond that, the place
//!   slides along (a bristle model, as in Haessig and Friedland 1991). So a robot on its feet does not
//!   creep. The lowest point of a propeller moves along its rim, so nothing sticks there.
//!
//! Springs and coefficients are choices: the weight presses the feet in by 0.1 mm, which makes the
//! fastest oscillation about 70 Hz, far below the 2 kHz of the integrator.

use glam::{DMat3, DVec2, DVec3};

use crate::{Airframe, DroneState, GRAVITY_M_S2};

/// Depth by which the weight presses the feet in, in m (choice).
pub(crate) const REST_DEPTH_M: f64 = 1e-4;
/// Share of critical damping of the feet (choice: a robot that drops bounces to about a tenth).
const DAMPING_RATIO: f64 = 0.36;
/// Coefficient of friction (choice).
const FRICTION: f64 = 0.6;
/// Sine of the tilt below which the lowest point of a propeller disk moves towards its hub (choice:
/// a disk that lies flat has no single lowest point).
const FLAT_TILT_SINE: f64 = 0.1;
/// Largest downward speed of a landing in m/s (choice).
pub const MOST_LANDING_SPEED_M_S: f64 = 1.0;
/// Largest tilt of a landing in radians (choice: 30 degrees).
pub const MOST_LANDING_TILT_RAD: f64 = core::f64::consts::FRAC_PI_6;
/// Steps without contact after which the next contact counts as an impact: 20 ms (choice).
const STEPS_OF_FLIGHT: u32 = 40;

/// A reason why contact with the ground is a crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashCause {
    /// The downward speed was above [`MOST_LANDING_SPEED_M_S`].
    Speed,
    /// The tilt was above [`MOST_LANDING_TILT_RAD`].
    Tilt,
    /// A propeller or its guard touched the ground.
    Propeller,
}

/// The begin of a contact with the ground after flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Downward speed of the center of mass in m/s.
    pub speed_m_s: f64,
    /// Angle between the body's z axis and the vertical in radians.
    pub tilt_rad: f64,
}

/// The contact of one robot with the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundContact {
    /// The place where each foot sticks; none without contact.
    anchors_m: [Option<DVec2>; 4],
    /// True for each propeller that touches the ground.
    has_propeller_contact: [bool; 4],
    steps_without_contact: u32,
    last_impact: Option<Impact>,
    crash: Option<CrashCause>,
}

impl Default for GroundContact {
    fn default() -> Self {
        GroundContact {
            anchors_m: [None; 4],
            has_propeller_contact: [false; 4],
            steps_without_contact: 0,
            last_impact: None,
            crash: None,
        }
    }
}

/// One point of a robot near the ground.
struct ContactPoint {
    /// Position relative to the center of mass, in the body frame, in m.
    arm_m: DVec3,
    /// Horizontal position in the world frame in m.
    place_m: DVec2,
    velocity_m_s: DVec3,
    normal_n: f64,
}

/// Spring and damper of each point.
struct Suspension {
    stiffness_n_m: f64,
    damping_n_s_m: f64,
}

impl Suspension {
    fn new(airframe: &Airframe) -> Self {
        let mass_kg = airframe.mass_kg / 4.0;
        let stiffness_n_m = mass_kg * GRAVITY_M_S2 / REST_DEPTH_M;
        let damping_n_s_m = 2.0 * DAMPING_RATIO * (stiffness_n_m * mass_kg).sqrt();
        Suspension { stiffness_n_m, damping_n_s_m }
    }

    /// Returns the tangential force at a point, and true if it slides.
    fn tangential_n(&self, point: &ContactPoint, anchor_m: Option<DVec2>) -> (DVec2, bool) {
        let stretch_m = anchor_m.map_or(DVec2::ZERO, |anchor| point.place_m - anchor);
        let pull =
            stretch_m * -self.stiffness_n_m - point.velocity_m_s.truncate() * self.damping_n_s_m;
        let most = FRICTION * point.normal_n;
        let size = pull.length();
        if size > most { (pull * (most / size), true) } else { (pull, false) }
    }
}

/// Returns the position of each foot and of each propeller's lowest point in the body frame, in m.
fn point_arms_m(airframe: &Airframe, rotation: &DMat3) -> ([DVec3; 4], [DVec3; 4]) {
    let motors = airframe.motor_positions_m();
    // The vertical in the body frame is the last row of the rotation.
    let sideways = DVec2::new(rotation.x_axis.z, rotation.y_axis.z);
    let sine = (sideways.length_squared() + FLAT_TILT_SINE * FLAT_TILT_SINE).sqrt();
    let rim =
        (sideways * (-airframe.propeller_radius_m / sine)).extend(airframe.propellers_above_m);
    let foot = DVec3::new(0.0, 0.0, -airframe.feet_below_m);
    (motors.map(|motor| motor + foot), motors.map(|motor| motor + rim))
}

/// Returns the point on this arm if it is below the ground.
fn contact_point(
    state: &DroneState,
    rotation: &DMat3,
    ground_m: f64,
    suspension: &Suspension,
    arm_m: DVec3,
) -> Option<ContactPoint> {
    let height = rotation.x_axis.z * arm_m.x
        + rotation.y_axis.z * arm_m.y
        + rotation.z_axis.z * arm_m.z
        + state.position_m.z
        - ground_m;
    // Also false if the height is not a number.
    if height < 0.0 {
        let velocity_m_s = state.velocity_m_s + *rotation * state.rate_rad_s.cross(arm_m);
        let push = suspension.stiffness_n_m * -height - suspension.damping_n_s_m * velocity_m_s.z;
        let place_m = (state.position_m + *rotation * arm_m).truncate();
        Some(ContactPoint { arm_m, place_m, velocity_m_s, normal_n: push.max(0.0) })
    } else {
        None
    }
}

impl GroundContact {
    /// Returns true if a part of the robot touches the ground.
    #[must_use]
    pub fn is_touching(&self) -> bool {
        self.anchors_m.iter().any(Option::is_some) || self.has_propeller_contact.contains(&true)
    }

    /// Returns true if this motor's propeller touches the ground, which stops the motor.
    pub(crate) fn touches_propeller(&self, motor: usize) -> bool {
        self.has_propeller_contact.get(motor).is_some_and(|touches| *touches)
    }

    /// Returns the begin of the last contact after flight.
    #[must_use]
    pub fn last_impact(&self) -> Option<Impact> {
        self.last_impact
    }

    /// Returns the cause of the first crash.
    #[must_use]
    pub fn crash(&self) -> Option<CrashCause> {
        self.crash
    }

    /// Returns the largest distance of the robot's parts from its center of mass, in m.
    pub(crate) fn reach_m(airframe: &Airframe) -> f64 {
        // The hypotenuse of arm and arm is 1.42 arms; heights are shorter than that.
        2.0 * airframe.arm_m + airframe.propeller_radius_m
    }

    /// Returns the force in the world frame in N, and the torque in the body frame in N·m.
    pub(crate) fn wrench(
        &self,
        airframe: &Airframe,
        state: &DroneState,
        rotation: &DMat3,
        ground_m: f64,
    ) -> (DVec3, DVec3) {
        let suspension = Suspension::new(airframe);
        let mut force_n = DVec3::ZERO;
        let mut torque_n_m = DVec3::ZERO;
        let (feet, propellers) = point_arms_m(airframe, rotation);
        let feet = feet.into_iter().zip(self.anchors_m);
        for (arm_m, anchor_m) in feet.chain(propellers.map(|arm_m| (arm_m, None))) {
            if let Some(point) = contact_point(state, rotation, ground_m, &suspension, arm_m) {
                let (tangential_n, _) = suspension.tangential_n(&point, anchor_m);
                let push_n = tangential_n.extend(point.normal_n);
                force_n += push_n;
                torque_n_m += point.arm_m.cross(rotation.transpose() * push_n);
            }
        }
        (force_n, torque_n_m)
    }

    /// Updates the contact at the end of a step, and returns an impact that began in it.
    ///
    /// # Parameters
    /// `speed_m_s`: downward speed before the step.
    pub(crate) fn update(
        &mut self,
        airframe: &Airframe,
        state: &DroneState,
        ground_m: f64,
        speed_m_s: f64,
    ) -> Option<Impact> {
        let rotation = DMat3::from_quat(state.attitude);
        let suspension = Suspension::new(airframe);
        let (feet, propellers) = point_arms_m(airframe, &rotation);
        for (arm_m, anchor_m) in feet.into_iter().zip(self.anchors_m.iter_mut()) {
            *anchor_m =
                contact_point(state, &rotation, ground_m, &suspension, arm_m).map(|point| {
                    match suspension.tangential_n(&point, *anchor_m) {
                        // A sliding point draws its place along, so far that the spring alone
                        // exerts the friction, against the motion.
                        (force_n, true) => point.place_m + force_n / suspension.stiffness_n_m,
                        (_, false) => anchor_m.unwrap_or(point.place_m),
                    }
                });
        }
        self.has_propeller_contact = propellers
            .map(|arm_m| contact_point(state, &rotation, ground_m, &suspension, arm_m).is_some());
        if !self.is_touching() {
            self.steps_without_contact = self.steps_without_contact.saturating_add(1);
            return None;
        }
        let impact = (self.steps_without_contact >= STEPS_OF_FLIGHT)
            .then(|| Impact { speed_m_s: speed_m_s.max(0.0), tilt_rad: state.tilt_rad() });
        self.steps_without_contact = 0;
        self.last_impact = impact.or(self.last_impact);
        if self.crash.is_none() {
            self.crash = self.crash_cause(state, impact);
        }
        impact
    }

    /// Counts a step far from the ground.
    pub(crate) fn fly(&mut self) {
        self.anchors_m = [None; 4];
        self.has_propeller_contact = [false; 4];
        self.steps_without_contact = self.steps_without_contact.saturating_add(1);
    }

    fn crash_cause(&self, state: &DroneState, impact: Option<Impact>) -> Option<CrashCause> {
        if self.has_propeller_contact.contains(&true) {
            Some(CrashCause::Propeller)
        } else if state.tilt_rad() > MOST_LANDING_TILT_RAD {
            Some(CrashCause::Tilt)
        } else if impact.is_some_and(|impact| impact.speed_m_s > MOST_LANDING_SPEED_M_S) {
            Some(CrashCause::Speed)
        } else {
            None
        }
    }
}
