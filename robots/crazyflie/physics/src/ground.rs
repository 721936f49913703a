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
//! fastest oscillation about 70 Hz, far below the 1 kHz of the integrator.

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
pub const LANDING_SPEED_M_S_MAX: f64 = 1.0;
/// Largest tilt of a landing in radians (choice: 30 degrees).
pub const LANDING_TILT_RAD_MAX: f64 = core::f64::consts::FRAC_PI_6;
/// Cosine of [`LANDING_TILT_RAD_MAX`].
const LANDING_COS_TILT_MIN: f64 = 0.866_025_403_784_438_6;
/// Steps without contact after which the next contact counts as an impact: 20 ms (choice).
const STEPS_OF_FLIGHT: u32 = 20;

/// A reason why contact with the ground is a crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashCause {
    /// The downward speed was above [`LANDING_SPEED_M_S_MAX`].
    Speed,
    /// The tilt was above [`LANDING_TILT_RAD_MAX`].
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GroundContact {
    /// The place where each foot sticks; none without contact.
    anchors_m: [Option<DVec2>; 4],
    /// True for each propeller that touches the ground.
    has_propeller_contact: [bool; 4],
    steps_without_contact: u32,
    last_impact: Option<Impact>,
    crash: Option<CrashCause>,
}

/// One point of a robot below the ground.
struct ContactPoint {
    /// Position relative to the center of mass, in world directions, in m.
    arm_m: DVec3,
    /// Horizontal position in the world frame in m.
    place_m: DVec2,
    velocity_m_s: DVec3,
    normal_n: f64,
}

/// Spring and damper of each point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Suspension {
    stiffness_n_m: f64,
    damping_n_s_m: f64,
}

impl Suspension {
    pub(crate) fn new(airframe: &Airframe) -> Self {
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
        let square = pull.length_squared();
        if square > most * most { (pull * (most / square.sqrt()), true) } else { (pull, false) }
    }
}

/// The pose of a robot near the ground.
struct PoseAboveGround<'a> {
    airframe: &'a Airframe,
    state: &'a DroneState,
    rotation: &'a DMat3,
    suspension: &'a Suspension,
    /// Angular rate in the world frame in rad/s.
    rate_rad_s: DVec3,
    ground_m: f64,
}

impl<'a> PoseAboveGround<'a> {
    fn new(
        airframe: &'a Airframe,
        state: &'a DroneState,
        rotation: &'a DMat3,
        suspension: &'a Suspension,
        ground_m: f64,
    ) -> Self {
        let rate_rad_s = *rotation * state.rate_rad_s;
        PoseAboveGround { airframe, state, rotation, suspension, rate_rad_s, ground_m }
    }

    /// Returns the point on this arm of the body frame if it is below the ground.
    fn point(&self, arm_m: DVec3) -> Option<ContactPoint> {
        let arm_m = *self.rotation * arm_m;
        let height_m = self.state.position_m.z + arm_m.z - self.ground_m;
        // A height that is not a number counts as above the ground.
        if height_m < 0.0 {
            let velocity_m_s = self.state.velocity_m_s + self.rate_rad_s.cross(arm_m);
            let push = self.suspension.stiffness_n_m * -height_m
                - self.suspension.damping_n_s_m * velocity_m_s.z;
            let place_m = (self.state.position_m + arm_m).truncate();
            Some(ContactPoint { arm_m, place_m, velocity_m_s, normal_n: push.max(0.0) })
        } else {
            None
        }
    }

    /// Returns the position of each foot in the body frame, in m.
    fn feet_m(&self) -> [DVec3; 4] {
        let down = DVec3::new(0.0, 0.0, -self.airframe.feet_below_m);
        self.airframe.motor_positions_m().map(|motor| motor + down)
    }

    /// Returns the lowest point of each propeller disk in the body frame, in m; none if all disks are
    /// certainly above the ground.
    fn propellers_m(&self) -> Option<[DVec3; 4]> {
        let airframe = self.airframe;
        // The vertical in the body frame is the last row of the rotation.
        let sideways = DVec2::new(self.rotation.x_axis.z, self.rotation.y_axis.z);
        let square = sideways.length_squared();
        let center_m = self.state.position_m.z - self.ground_m
            + self.rotation.z_axis.z * airframe.propellers_above_m;
        // The farthest points of the propellers lie within 1.5 arms and a radius.
        let reach_m = 1.5 * airframe.arm_m + airframe.propeller_radius_m;
        if center_m > 0.0 && center_m * center_m > square * reach_m * reach_m {
            return None;
        }
        let sine = (square + FLAT_TILT_SINE * FLAT_TILT_SINE).sqrt();
        let rim = sideways * (-airframe.propeller_radius_m / sine);
        let rim = rim.extend(airframe.propellers_above_m);
        Some(airframe.motor_positions_m().map(|motor| motor + rim))
    }
}

impl GroundContact {
    /// Returns the contact of a robot that flies, so that its next contact is an impact.
    pub(crate) fn in_flight() -> Self {
        GroundContact { steps_without_contact: STEPS_OF_FLIGHT, ..GroundContact::default() }
    }

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
        suspension: &Suspension,
        ground_m: f64,
    ) -> (DVec3, DVec3) {
        let pose = PoseAboveGround::new(airframe, state, rotation, suspension, ground_m);
        let mut force_n = DVec3::ZERO;
        let mut torque_n_m = DVec3::ZERO;
        let mut push = |arm_m: DVec3, anchor_m: Option<DVec2>| {
            if let Some(point) = pose.point(arm_m) {
                let (tangential_n, _) = suspension.tangential_n(&point, anchor_m);
                let push_n = tangential_n.extend(point.normal_n);
                force_n += push_n;
                torque_n_m += point.arm_m.cross(push_n);
            }
        };
        for (arm_m, anchor_m) in pose.feet_m().into_iter().zip(self.anchors_m) {
            push(arm_m, anchor_m);
        }
        for arm_m in pose.propellers_m().into_iter().flatten() {
            push(arm_m, None);
        }
        (force_n, rotation.transpose() * torque_n_m)
    }

    /// Updates the contact at the end of a step, and returns an impact that began in it.
    ///
    /// # Parameters
    /// `speed_m_s`: downward speed before the step.
    pub(crate) fn update(
        &mut self,
        airframe: &Airframe,
        state: &DroneState,
        suspension: &Suspension,
        ground_m: f64,
        speed_m_s: f64,
    ) -> Option<Impact> {
        let rotation = DMat3::from_quat(state.attitude);
        let pose = PoseAboveGround::new(airframe, state, &rotation, suspension, ground_m);
        for (arm_m, anchor_m) in pose.feet_m().into_iter().zip(self.anchors_m.iter_mut()) {
            *anchor_m =
                pose.point(arm_m).map(|point| match suspension.tangential_n(&point, *anchor_m) {
                    // A sliding point draws its place along, so far that the spring alone exerts the
                    // friction, against the motion.
                    (force_n, true) => point.place_m + force_n / suspension.stiffness_n_m,
                    (_, false) => anchor_m.unwrap_or(point.place_m),
                });
        }
        self.has_propeller_contact = pose
            .propellers_m()
            .map_or([false; 4], |arms_m| arms_m.map(|arm_m| pose.point(arm_m).is_some()));
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
        } else if state.cos_tilt() < LANDING_COS_TILT_MIN {
            Some(CrashCause::Tilt)
        } else if impact.is_some_and(|impact| impact.speed_m_s > LANDING_SPEED_M_S_MAX) {
            Some(CrashCause::Speed)
        } else {
            None
        }
    }
}
