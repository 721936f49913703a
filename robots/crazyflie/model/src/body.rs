//! The body of a Crazyflie: it follows a velocity, and estimates its pose with a positioning
//! system.

use bittybuzz_arena::engine::{
    Bodies, Body, BodyBlock, BodyModel, BodySize, Medium, Pose, SettingsError, Stream, above_0,
    first_wrong, not_below_0, within, wrap,
};

use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::{FlightLimits, PositionFence};

use crate::flying::FlyingBody;

/// A command for the flight controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Flight {
    /// Propellers off: the robot stands, or falls.
    #[default]
    Off,
    /// Fly with this velocity.
    Velocity(Velocity),
}

/// A velocity in the robot's own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Velocity ahead in mm/s.
    pub forward: f32,
    /// Velocity to the left in mm/s.
    pub left: f32,
    /// Velocity upwards in mm/s.
    pub up: f32,
    /// Rate of turn in radians per second, anticlockwise.
    pub turn: f32,
}

/// The detail in which a Crazyflie's flight is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fidelity {
    /// The body follows velocities with a lag.
    #[default]
    Kinematic,
    /// The flight controller of [`bittybuzz_flight`] flies a rigid body with four rotors.
    Flight,
}

/// The source of a Crazyflie's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Positioning {
    /// No positioning: the robot knows neither its own position nor those of neighbors.
    None,
    /// Dead reckoning (Flow deck): errors accumulate.
    Flow {
        /// Standard deviation of the horizontal error after a second of flight, in mm; it grows
        /// with the square root of the time.
        walk: f32,
        /// Standard deviation of the yaw error after a second of flight, in radians.
        yaw_walk: f32,
    },
    /// Absolute measurement (Lighthouse, Loco, cameras): each measurement has an independent error.
    Absolute {
        /// Standard deviation of each coordinate, in mm.
        sigma: f32,
        /// Standard deviation of the yaw, in radians.
        yaw_sigma: f32,
        /// Time between two measurements of a flight controller, in ms.
        period_ms: u16,
    },
}

impl Positioning {
    /// The Flow deck. The growth of the error is a choice: some centimeters in a minute.
    pub const FLOW: Self = Positioning::Flow { walk: 5.0, yaw_walk: 0.002 };
    /// The Lighthouse deck: errors of 1 to 2 cm.
    /// A flight controller gets 50 poses per second (crazyflie-firmware 2a18fc29 limits a Lighthouse deck
    /// to 50 events per second).
    pub const LIGHTHOUSE: Self =
        Positioning::Absolute { sigma: 10.0, yaw_sigma: 0.01, period_ms: 20 };
    /// The Loco positioning deck: errors of 10 cm.
    pub const LOCO: Self = Positioning::Absolute { sigma: 100.0, yaw_sigma: 0.05, period_ms: 20 };
    /// Cameras in the room, whose poses come by radio: 100 per second with errors within the 0.1 to 1 mm
    /// of Preiss et al. 2017, "Crazyswarm".
    pub const CAPTURE: Self = Positioning::Absolute { sigma: 0.5, yaw_sigma: 0.005, period_ms: 10 };
}

/// The air, the floor and the radio of poses around a robot with a flight controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightSurroundings {
    /// Mean speed of the wind in mm/s.
    pub wind: f32,
    /// Direction to which the wind blows, in radians anticlockwise from x.
    pub wind_direction: f32,
    /// Standard deviation of each coordinate of the gusts, in mm/s.
    pub gusts: f32,
    /// Time of correlation of the gusts in seconds.
    pub gust_time: f32,
    /// Share of a usual floor's features that a Flow deck sees.
    pub texture: f32,
    /// Time in ms until a pose from outside arrives.
    pub latency: f32,
    /// Share of the latency by which it sways around its mean.
    pub latency_sway: f32,
}

impl FlightSurroundings {
    /// Calm air above a usual floor, and poses that are 10 ms late, within the 8 to 26 ms of Preiss et
    /// al. 2017.
    pub const CALM: Self = FlightSurroundings {
        wind: 0.0,
        wind_direction: 0.0,
        gusts: 0.0,
        gust_time: 1.0,
        texture: 1.0,
        latency: 10.0,
        latency_sway: 0.0,
    };
}

/// The parameters of a Crazyflie's body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrazyflieModel {
    /// Radius in mm.
    pub radius: f32,
    /// Time in which the velocity covers 63 % of a change of the command, in seconds.
    pub lag: f32,
    /// Highest speed in mm/s.
    pub speed: f32,
    /// Highest acceleration in mm/s².
    pub acceleration: f32,
    /// Closing speed in mm/s above which a contact in the air is a crash; at 0 every contact is
    /// one.
    pub crash_speed: f32,
    /// The source of the robot's position.
    pub positioning: Positioning,
    /// The detail of the simulation.
    pub fidelity: Fidelity,
    /// A person has armed the robot at power-on.
    pub armed: bool,
    /// Distance in mm from neighbors that the robot keeps on its side; 0 switches the collision
    /// avoidance off.
    pub avoidance: f32,
    /// The surroundings of a robot with a flight controller.
    pub surroundings: FlightSurroundings,
    /// Highest vertical speed in mm/s of a robot with a flight controller.
    pub climb: f32,
    /// The box that a robot with a flight controller does not leave.
    pub fence: PositionFence,
}

/// Distance in mm within which a robot feels the downwash of those above it: at 3 m it is 3 % of the
/// weight.
const DOWNWASH_MM_MAX: f32 = 3000.0;

impl CrazyflieModel {
    /// Radius and height are those of the collision cylinder of gym-pybullet-drones. Bitcraze's
    /// position controller allows 1 m/s and 20 degrees of tilt, hence 3.6 m/s². The lag is a
    /// choice. Every contact in the air is a crash: the propellers have no guards.
    pub const STANDARD: Self = CrazyflieModel {
        radius: 60.0,
        lag: 0.3,
        speed: 1000.0,
        acceleration: 3600.0,
        crash_speed: 0.0,
        positioning: Positioning::LIGHTHOUSE,
        fidelity: Fidelity::Kinematic,
        armed: false,
        avoidance: 0.0,
        surroundings: FlightSurroundings::CALM,
        climb: f32::INFINITY,
        fence: PositionFence::WIDE,
    };

    /// Returns the model with the limits of the flight in a robot's flash, as the firmware applies them.
    /// Limits that are no setting of the robot file do not exist: the file has read the names.
    pub fn limited(&self, settings: &[(&str, u16)]) -> Self {
        let mut model = *self;
        let (mut least_m, mut most_m) = (self.fence.least_m(), self.fence.most_m());
        for (name, value) in settings {
            let mm = f32::from(*value);
            match *name {
                "speed_mm_s" => model.speed = model.speed.min(mm),
                "climb_mm_s" => model.climb = mm,
                "height_mm" => most_m.z = mm / 1000.0,
                "fence_front_mm" => most_m.x = mm / 1000.0,
                "fence_back_mm" => least_m.x = -mm / 1000.0,
                "fence_left_mm" => most_m.y = mm / 1000.0,
                "fence_right_mm" => least_m.y = -mm / 1000.0,
                _ => {}
            }
        }
        model.fence = PositionFence::new(least_m, most_m)
            .expect("the settings of all sides are distances from the origin");
        model
    }

    /// Returns the settings of the pilot: those of a Crazyflie, with the speed and the acceleration
    /// of this model. A flight controller does not exceed what its airframe can do.
    pub fn pilot(&self) -> PilotSettings {
        let standard = PilotSettings::CRAZYFLIE;
        let mut speed_m_s = self.speed / 1000.0;
        let mut acceleration_m_s2 = self.acceleration / 1000.0;
        if self.fidelity == Fidelity::Flight {
            speed_m_s = speed_m_s.min(FlightLimits::CRAZYFLIE.speed_m_s);
            acceleration_m_s2 = acceleration_m_s2.min(FlightLimits::CRAZYFLIE.acceleration_m_s2);
        }
        // A planner needs limits above 0.
        let speed_m_s = speed_m_s.max(SPEED_M_S_MIN);
        let acceleration_m_s2 = acceleration_m_s2.max(ACCELERATION_M_S2_MIN);
        let lag_rate_s = standard.limits.jerk_m_s3 / standard.limits.acceleration_m_s2;
        let limits = FlightLimits {
            speed_m_s,
            climb_m_s: standard.limits.climb_m_s.min(speed_m_s).min(self.climb / 1000.0),
            acceleration_m_s2,
            jerk_m_s3: acceleration_m_s2 * lag_rate_s,
            ..standard.limits
        };
        let standing_m = match self.fidelity {
            // The world's pose of a body without feet is that of its middle.
            Fidelity::Kinematic => 0.0,
            Fidelity::Flight => standard.standing_m,
        };
        PilotSettings { limits, standing_m, ..standard }
    }
}

/// Least speed in m/s and acceleration in m/s² of a planner.
const SPEED_M_S_MIN: f32 = 0.001;
const ACCELERATION_M_S2_MIN: f32 = 0.001;

impl BodyModel for CrazyflieModel {
    /// Returns the shape; the height is that of the collision cylinder of gym-pybullet-drones.
    fn shape(&self) -> BodySize {
        BodySize { radius_mm: self.radius, height_mm: 25.0 }
    }

    fn top_speed_mm_s(&self) -> f32 {
        self.speed
    }

    fn medium(&self) -> Medium {
        Medium::P2p
    }

    fn crash_speed_mm_s(&self) -> Option<f32> {
        Some(self.crash_speed)
    }

    fn has_positioning(&self) -> bool {
        self.positioning != Positioning::None
    }

    fn feels_within_mm(&self) -> Option<f32> {
        (self.fidelity == Fidelity::Flight).then_some(DOWNWASH_MM_MAX)
    }

    fn check(&self) -> Result<(), SettingsError> {
        let is_possible = match self.positioning {
            Positioning::None => true,
            Positioning::Flow { walk, yaw_walk } => not_below_0(walk) && not_below_0(yaw_walk),
            Positioning::Absolute { sigma, yaw_sigma, period_ms } => {
                not_below_0(sigma) && not_below_0(yaw_sigma) && period_ms > 0
            }
        };
        let (around, calm) = (&self.surroundings, &FlightSurroundings::CALM);
        // Without a flight controller nothing reads the surroundings.
        let has_effect = |is_calm: bool| self.fidelity == Fidelity::Flight || is_calm;
        let needs_flight = "left out, or with fidelity = \"flight\"";
        first_wrong(&[
            ("crazyflie.radius", within(self.radius, 1.0, 1e4), "1 to 10000"),
            ("crazyflie.lag", not_below_0(self.lag), "0 or more"),
            ("crazyflie.speed", within(self.speed, 0.0, 1e5), "0 to 100000"),
            ("crazyflie.acceleration", above_0(self.acceleration), "a number greater than 0"),
            ("crazyflie.crash_speed", within(self.crash_speed, 0.0, 1e5), "0 to 100000"),
            ("crazyflie.positioning", is_possible, "without negative numbers"),
            ("crazyflie.avoidance", within(self.avoidance, 0.0, 5000.0), "0 to 5000"),
            ("crazyflie.wind", within(around.wind, 0.0, 20_000.0), "0 to 20000"),
            ("crazyflie.wind_direction", around.wind_direction.is_finite(), "a finite number"),
            ("crazyflie.gusts", within(around.gusts, 0.0, 10_000.0), "0 to 10000"),
            ("crazyflie.gust_time", within(around.gust_time, 0.05, 60.0), "0.05 to 60"),
            ("crazyflie.texture", within(around.texture, 0.0, 1.0), "0 to 1"),
            ("crazyflie.latency", within(around.latency, 0.0, 150.0), "0 to 150"),
            ("crazyflie.latency_sway", within(around.latency_sway, 0.0, 1.0), "0 to 1"),
            ("crazyflie.wind", has_effect(around.wind == calm.wind), needs_flight),
            ("crazyflie.gusts", has_effect(around.gusts == calm.gusts), needs_flight),
            ("crazyflie.texture", has_effect(around.texture == calm.texture), needs_flight),
            ("crazyflie.latency", has_effect(around.latency == calm.latency), needs_flight),
            (
                "crazyflie.positioning",
                self.fidelity == Fidelity::Kinematic || self.positioning != Positioning::None,
                "flow, loco, lighthouse or capture with fidelity = \"flight\"",
            ),
        ])
    }

    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock> {
        match self.fidelity {
            Fidelity::Kinematic => Box::new(Bodies::<CrazyflieBody>::new(*self, substep_s)),
            Fidelity::Flight => Box::new(Bodies::<FlyingBody>::new(*self, substep_s)),
        }
    }
}

/// Acceleration of gravity in mm/s².
const GRAVITY_MM_S2: f32 = 9810.0;

/// Highest rate of yaw in radians per second (a choice: a full turn per second).
const TURN_RATE_RAD_S_MAX: f32 = core::f32::consts::TAU;

/// A Crazyflie's body.
#[derive(Clone, Debug, Default)]
struct CrazyflieBody {
    flight: Flight,
    /// Velocity along x, y, z of the world, in mm/s.
    velocity: [f32; 3],
    rate: f32,
    /// Error of the estimate: x, y, z in mm, and heading in radians.
    error: [f32; 4],
}

/// The model, and the length of a substep in seconds.
type CrazyflieStep = (CrazyflieModel, f32);

impl Body for CrazyflieBody {
    type Numbers = CrazyflieModel;
    type Step = CrazyflieStep;
    type Controls = Flight;

    fn new(_: &CrazyflieModel, _: &Pose, _: &mut Stream) -> Self {
        CrazyflieBody::default()
    }

    fn prepare(model: &CrazyflieModel, seconds: f32) -> CrazyflieStep {
        (*model, seconds)
    }

    fn controls(&mut self) -> &mut Flight {
        &mut self.flight
    }

    fn halt(&mut self) {
        self.flight = Flight::Off;
    }

    fn restart(&mut self) {
        *self = CrazyflieBody::default();
    }

    fn step(&mut self, pose: &mut Pose, (model, seconds): &CrazyflieStep) {
        let seconds = *seconds;
        match self.flight {
            Flight::Off if pose.z <= 0.0 => {
                self.rest();
                return;
            }
            Flight::Off => self.velocity[2] -= GRAVITY_MM_S2 * seconds,
            Flight::Velocity(wanted) => {
                if pose.z <= 0.0 && (wanted.up <= 0.0 || wanted.up.is_nan()) {
                    self.rest();
                    return;
                }
                self.track(wanted, pose.heading, model, seconds);
            }
        }
        let [vx, vy, vz] = self.velocity;
        pose.x += vx * seconds;
        pose.y += vy * seconds;
        pose.z += vz * seconds;
        pose.heading = wrap(pose.heading + self.rate * seconds);
        if pose.z <= 0.0 {
            pose.z = 0.0;
            self.velocity[2] = self.velocity[2].max(0.0);
        }
    }

    fn sense(
        &mut self,
        pose: &Pose,
        model: &CrazyflieModel,
        seconds: f32,
        stream: impl FnOnce() -> Stream,
    ) -> Option<Pose> {
        let mut stream = stream();
        match model.positioning {
            Positioning::None => {
                return None;
            }
            Positioning::Flow { walk, yaw_walk } => {
                // The deck measures the height, so only the position on the ground plane and the
                // yaw drift.
                if pose.z > 0.0 {
                    let root = seconds.sqrt();
                    self.error[0] += walk * root * stream.normal();
                    self.error[1] += walk * root * stream.normal();
                    self.error[3] += yaw_walk * root * stream.normal();
                }
            }
            Positioning::Absolute { sigma, yaw_sigma, .. } => {
                let scale = [sigma, sigma, sigma, yaw_sigma];
                self.error = scale.map(|scale| scale * stream.normal());
            }
        }
        Some(Pose {
            x: pose.x + self.error[0],
            y: pose.y + self.error[1],
            z: pose.z + self.error[2],
            heading: wrap(pose.heading + self.error[3]),
        })
    }
}

impl CrazyflieBody {
    fn rest(&mut self) {
        self.velocity = [0.0; 3];
        self.rate = 0.0;
    }

    /// Changes the velocity towards the wanted one with a first-order lag, within the limits of
    /// speed and acceleration.
    fn track(&mut self, wanted: Velocity, heading: f32, model: &CrazyflieModel, seconds: f32) {
        let (sin, cos) = libm::sincosf(heading);
        let goal = shorten(
            [
                wanted.forward * cos - wanted.left * sin,
                wanted.forward * sin + wanted.left * cos,
                wanted.up,
            ],
            model.speed,
        );
        let part = if model.lag > 0.0 { 1.0 - libm::expf(-seconds / model.lag) } else { 1.0 };
        let change = [0, 1, 2].map(|axis| (goal[axis] - self.velocity[axis]) * part);
        let change = shorten(change, model.acceleration * seconds);
        for (velocity, change) in self.velocity.iter_mut().zip(change) {
            *velocity += change;
        }
        if wanted.turn.is_finite() {
            self.rate +=
                (wanted.turn.clamp(-TURN_RATE_RAD_S_MAX, TURN_RATE_RAD_S_MAX) - self.rate) * part;
        }
    }
}

/// Returns a vector of the same direction with a length of at most `most`; a vector with a length
/// that is not finite becomes 0.
fn shorten(vector: [f32; 3], most: f32) -> [f32; 3] {
    let length = vector.iter().map(|part| part * part).sum::<f32>().sqrt();
    if !length.is_finite() {
        return [0.0; 3];
    }
    let scale = if length > most { most / length } else { 1.0 };
    vector.map(|part| part * scale)
}
