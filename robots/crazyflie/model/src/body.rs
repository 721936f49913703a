//! Crazyflie: follows a velocity, and believes to be where its positioning system says.

use bittybuzz_arena::engine::{
    Block, Bodies, Body, BodyModel, Medium, Pose, SettingsError, Shape, Stream, above_0,
    first_wrong, not_below_0, within, wrap,
};

/// A command for the flight controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Flight {
    /// Propellers off: stands, or falls.
    #[default]
    Off,
    /// Fly.
    Velocity(Velocity),
}

/// A velocity in the robot's own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// mm/s ahead.
    pub forward: f32,
    /// mm/s to the left.
    pub left: f32,
    /// mm/s up.
    pub up: f32,
    /// Radians per second, anticlockwise.
    pub turn: f32,
}

/// The source of a Crazyflie's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Positioning {
    /// Nothing: it knows no position, and neighbours have no place.
    None,
    /// Dead reckoning (Flow deck): the errors add up.
    Flow {
        /// Deviation of the horizontal error after a second of flight, mm; it grows with the root of the time.
        walk: f32,
        /// Deviation of the yaw's error after a second of flight, radians.
        yaw_walk: f32,
    },
    /// It measures where it is (Lighthouse, Loco): errors of one moment are independent of the last.
    Absolute {
        /// Deviation of each coordinate, mm.
        sigma: f32,
        /// Deviation of the yaw, radians.
        yaw_sigma: f32,
    },
}

impl Positioning {
    /// Flow deck. The growth is a choice: some centimetres in a minute.
    pub const FLOW: Self = Positioning::Flow { walk: 5.0, yaw_walk: 0.002 };
    /// Lighthouse deck: 1 to 2 cm.
    pub const LIGHTHOUSE: Self = Positioning::Absolute { sigma: 10.0, yaw_sigma: 0.01 };
    /// Loco positioning deck: 10 cm.
    pub const LOCO: Self = Positioning::Absolute { sigma: 100.0, yaw_sigma: 0.05 };
}

/// Numbers of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrazyflieModel {
    /// mm
    pub radius: f32,
    /// The time in which the velocity reaches 63 % of its command, seconds.
    pub lag: f32,
    /// Greatest speed, mm/s.
    pub speed: f32,
    /// Greatest acceleration, mm/s².
    pub acceleration: f32,
    /// Closing speed above which a contact in the air is a crash, mm/s; 0: every contact is one.
    pub crash_speed: f32,
    /// The source of its position.
    pub positioning: Positioning,
}

impl CrazyflieModel {
    /// Collision cylinder of gym-pybullet-drones; 1 m/s and 20 degrees of tilt, hence 3.6 m/s², as Bitcraze's position
    /// controller allows; the lag is a choice. Every contact in the air is a crash: the propellers have no guards.
    pub const STANDARD: Self = CrazyflieModel {
        radius: 60.0,
        lag: 0.3,
        speed: 1000.0,
        acceleration: 3600.0,
        crash_speed: 0.0,
        positioning: Positioning::LIGHTHOUSE,
    };
}

impl BodyModel for CrazyflieModel {
    /// The height is that of the collision cylinder of gym-pybullet-drones.
    fn shape(&self) -> Shape {
        Shape { radius: self.radius, height: 25.0 }
    }

    fn top_speed(&self) -> f32 {
        self.speed
    }

    fn medium(&self) -> Medium {
        Medium::P2p
    }

    fn crash_speed(&self) -> Option<f32> {
        Some(self.crash_speed)
    }

    fn has_positioning(&self) -> bool {
        self.positioning != Positioning::None
    }

    fn check(&self) -> Result<(), SettingsError> {
        let is_possible = match self.positioning {
            Positioning::None => true,
            Positioning::Flow { walk, yaw_walk } => not_below_0(walk) && not_below_0(yaw_walk),
            Positioning::Absolute { sigma, yaw_sigma } => {
                not_below_0(sigma) && not_below_0(yaw_sigma)
            }
        };
        first_wrong(&[
            ("crazyflie.radius", within(self.radius, 1.0, 1e4), "1 to 10000"),
            ("crazyflie.lag", not_below_0(self.lag), "0 or more"),
            ("crazyflie.speed", within(self.speed, 0.0, 1e5), "0 to 100000"),
            ("crazyflie.acceleration", above_0(self.acceleration), "a number greater than 0"),
            ("crazyflie.crash_speed", within(self.crash_speed, 0.0, 1e5), "0 to 100000"),
            ("crazyflie.positioning", is_possible, "without negative numbers"),
        ])
    }

    fn block(&self, substep: f32) -> Box<dyn Block> {
        Box::new(Bodies::<Crazyflie>::new(*self, substep))
    }
}

/// mm/s²
const GRAVITY: f32 = 9810.0;

/// Greatest rate of yaw, radians per second (a choice: a full turn per second).
const TURN: f32 = core::f32::consts::TAU;

/// A Crazyflie's body.
#[derive(Clone, Debug, Default)]
struct Crazyflie {
    flight: Flight,
    /// mm/s along x, y, z of the world.
    velocity: [f32; 3],
    rate: f32,
    /// Error of the estimate: x, y, z, heading.
    error: [f32; 4],
}

/// The model, and the length of a substep in seconds.
type CrazyflieStep = (CrazyflieModel, f32);

impl Body for Crazyflie {
    type Numbers = CrazyflieModel;
    type Step = CrazyflieStep;
    type Controls = Flight;

    fn new(_: &CrazyflieModel, _: &Pose, _: &mut Stream) -> Self {
        Crazyflie::default()
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
        *self = Crazyflie::default();
    }

    fn step(&mut self, pose: &mut Pose, (model, seconds): &CrazyflieStep) {
        let seconds = *seconds;
        match self.flight {
            Flight::Off if pose.z <= 0.0 => {
                self.rest();
                return;
            }
            Flight::Off => self.velocity[2] -= GRAVITY * seconds,
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
                // The deck measures the height; what drifts is the place.
                if pose.z > 0.0 {
                    let root = seconds.sqrt();
                    self.error[0] += walk * root * stream.normal();
                    self.error[1] += walk * root * stream.normal();
                    self.error[3] += yaw_walk * root * stream.normal();
                }
            }
            Positioning::Absolute { sigma, yaw_sigma } => {
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

impl Crazyflie {
    fn rest(&mut self) {
        self.velocity = [0.0; 3];
        self.rate = 0.0;
    }

    /// First-order lag towards the wanted velocity, within the limits of speed and acceleration.
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
            self.rate += (wanted.turn.clamp(-TURN, TURN) - self.rate) * part;
        }
    }
}

/// Returns the same direction, not longer than `most`; a vector that is no number becomes 0.
fn shorten(vector: [f32; 3], most: f32) -> [f32; 3] {
    let length = vector.iter().map(|part| part * part).sum::<f32>().sqrt();
    if !length.is_finite() {
        return [0.0; 3];
    }
    let scale = if length > most { most / length } else { 1.0 };
    vector.map(|part| part * scale)
}
