//! Bodies of described robots, with four kinds of drive.

use bittybuzz_robot_spec::{ActuatorQuantity, DriveSpec};

use super::steering::{Turning, wheel_speeds};
use crate::engine::{Body, Pose, Stream, TICK_S, wrap};

/// Parameters of a described body.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    pub drive: DriveSpec,
    /// Standard deviation of each actuator's gain, as a share of the gain.
    pub gain_error: f32,
    /// Standard deviation of each speed in a tick, as a share of the speed.
    pub noise: f32,
}

/// The values of a body's actuators that functions have set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuators {
    /// Wheels in mm/s, or duties of motors from 0 to 1: left and right.
    sides: [f32; 2],
    /// Speeds ahead and to the left, in mm/s.
    along: [f32; 2],
    /// Radians per second, anticlockwise.
    turn: f32,
    climb: Climb,
    /// The way in which the last vector turned the robot.
    turning: Turning,
}

/// The vertical motion of a body that flies.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Climb {
    /// mm/s upward.
    Speed(f32),
    /// Target height over the ground in mm.
    Height(f32),
}

impl Default for Climb {
    fn default() -> Self {
        Climb::Speed(0.0)
    }
}

/// mm/s²
const GRAVITY_MM_S2: f32 = 9810.0;

/// The rate, per second, at which a flying body covers the distance to its target height, as long
/// as its speed allows.
const HEIGHT_GAIN_1_S: f32 = 2.0;

impl Actuators {
    /// At rest, with the ground as the target height.
    pub const LANDING: Self = Actuators {
        sides: [0.0; 2],
        along: [0.0; 2],
        turn: 0.0,
        climb: Climb::Height(0.0),
        turning: Turning::Straight,
    };

    /// Sets the wheels so that the robot drives along a vector in its own frame, ahead and to the
    /// left in mm/s. Only drives with a rule for vectors do.
    pub fn steer(&mut self, drive: DriveSpec, vector: [f64; 2]) {
        let Some(rule) = drive.steering() else { return };
        let [left, right] = wheel_speeds(&rule, &mut self.turning, vector);
        self.set(drive, ActuatorQuantity::LeftWheel, left as f32);
        self.set(drive, ActuatorQuantity::RightWheel, right as f32);
    }

    /// Sets a quantity of motion in its unit. A value beyond the limit is replaced by the limit.
    pub fn set(&mut self, drive: DriveSpec, quantity: ActuatorQuantity, value: f32) {
        let most = drive.most(quantity).map_or(f32::INFINITY, |most| most as f32);
        let within = value.clamp(-most, most);
        match quantity {
            ActuatorQuantity::LeftWheel => self.sides[0] = within,
            ActuatorQuantity::RightWheel => self.sides[1] = within,
            ActuatorQuantity::LeftMotor => self.sides[0] = within.max(0.0),
            ActuatorQuantity::RightMotor => self.sides[1] = within.max(0.0),
            ActuatorQuantity::Forward | ActuatorQuantity::Turn => {
                if let DriveSpec::Differential { wheel_distance_mm, .. } = drive {
                    self.set_wheels(wheel_distance_mm as f32, quantity, within);
                } else if quantity == ActuatorQuantity::Forward {
                    self.along[0] = within;
                } else {
                    self.turn = within.to_radians();
                }
            }
            ActuatorQuantity::Leftward => self.along[1] = within,
            ActuatorQuantity::Upward => self.climb = Climb::Speed(within),
            ActuatorQuantity::Height => self.climb = Climb::Height(value.max(0.0)),
            ActuatorQuantity::Color
            | ActuatorQuantity::Red
            | ActuatorQuantity::Green
            | ActuatorQuantity::Blue => {}
        }
    }

    /// Changes both wheels so that the speed ahead or the turning rate becomes `value` and the
    /// other one stays the same.
    fn set_wheels(&mut self, wheel_distance_mm: f32, quantity: ActuatorQuantity, value: f32) {
        let [left, right] = self.sides;
        let (mut ahead_mm_s, mut turn_rad_s) =
            (f32::midpoint(left, right), (right - left) / wheel_distance_mm);
        if quantity == ActuatorQuantity::Forward {
            ahead_mm_s = value;
        } else {
            turn_rad_s = value.to_radians();
        }
        self.sides = [
            ahead_mm_s - turn_rad_s * wheel_distance_mm / 2.0,
            ahead_mm_s + turn_rad_s * wheel_distance_mm / 2.0,
        ];
    }
}

/// A described body.
#[derive(Clone, Debug)]
pub struct DescribedBody {
    actuators: Actuators,
    /// True while the motors have no power. A flying body then falls to the ground.
    is_falling: bool,
    gains: [f32; 4],
    /// Factors of the speeds in this tick.
    noise: [f32; 4],
    /// Seconds until the factors in `noise` are drawn again.
    left: f32,
    chance: Stream,
    /// Velocity of a flying body: mm/s ahead, to the left and up, and radians per second.
    velocity: [f32; 4],
}

/// The parameters, and the length of a substep in seconds.
pub type Step = (Numbers, f32);

impl Body for DescribedBody {
    type Numbers = Numbers;
    type Step = Step;
    type Controls = Actuators;

    fn new(numbers: &Numbers, _: &Pose, build: &mut Stream) -> Self {
        DescribedBody {
            actuators: Actuators::default(),
            is_falling: false,
            gains: [(); 4].map(|()| build.gain(numbers.gain_error)),
            noise: [1.0; 4],
            left: 0.0,
            chance: build.fork(),
            velocity: [0.0; 4],
        }
    }

    fn prepare(numbers: &Numbers, seconds: f32) -> Step {
        (*numbers, seconds)
    }

    fn controls(&mut self) -> &mut Actuators {
        self.is_falling = false;
        &mut self.actuators
    }

    fn halt(&mut self) {
        self.actuators = Actuators::default();
        self.is_falling = true;
    }

    fn restart(&mut self) {
        self.halt();
        self.velocity = [0.0; 4];
    }

    fn step(&mut self, pose: &mut Pose, (numbers, seconds): &Step) {
        let seconds = *seconds;
        self.draw(numbers.noise, seconds);
        let factor = |index: usize| self.gains[index] * self.noise[index];
        let [left, right] = [0, 1].map(|side| self.actuators.sides[side] * factor(side));
        match numbers.drive {
            DriveSpec::Differential { wheel_distance_mm, speed_mm_s, .. } => {
                let most = speed_mm_s as f32;
                let [left, right] = [left, right].map(|speed| speed.clamp(-most, most));
                let turn = (right - left) / wheel_distance_mm as f32;
                arc(pose, f32::midpoint(left, right), turn, seconds);
            }
            DriveSpec::Unicycle { .. } => {
                let Actuators { along, turn, .. } = self.actuators;
                arc(pose, along[0] * factor(0), turn * factor(1), seconds);
            }
            DriveSpec::SlipStick { speed_mm_s, turn_deg_s } => {
                // The duty that both motors have in common drives the robot ahead, and the rest
                // turns it.
                let ahead = left.min(right) * speed_mm_s as f32;
                arc(pose, ahead, (right - left) * (turn_deg_s as f32).to_radians(), seconds);
            }
            DriveSpec::Quadrotor { speed_mm_s, climb_mm_s, lag_s, .. } => {
                let most = [speed_mm_s, climb_mm_s].map(|most| most as f32);
                self.fly(pose, most, lag_s as f32, seconds);
            }
        }
    }
}

impl DescribedBody {
    /// Draws the noise of the speeds at the beginning of a tick.
    fn draw(&mut self, sigma: f32, seconds: f32) {
        if sigma > 0.0 && self.left < seconds / 2.0 {
            self.noise = [(); 4].map(|()| self.chance.gain(sigma));
            self.left += TICK_S;
        }
        self.left -= seconds;
    }

    /// Flies for one substep. The velocities in the robot's own frame follow the values that are
    /// set.
    fn fly(
        &mut self,
        pose: &mut Pose,
        [speed_mm_s, climb_mm_s]: [f32; 2],
        lag_s: f32,
        seconds: f32,
    ) {
        let Actuators { along: [ahead, left], turn, climb: wanted, .. } = self.actuators;
        let up = match wanted {
            Climb::Speed(up) => up,
            Climb::Height(height) => (height - pose.z) * HEIGHT_GAIN_1_S,
        };
        if pose.z <= 0.0 && (up <= 0.0 || self.is_falling) {
            self.velocity = [0.0; 4];
            return;
        }
        let fast = libm::hypotf(ahead, left);
        let share = if fast > speed_mm_s { speed_mm_s / fast } else { 1.0 };
        let goal = [ahead * share, left * share, up.clamp(-climb_mm_s, climb_mm_s), turn];
        let part = if lag_s > 0.0 { 1.0 - libm::expf(-seconds / lag_s) } else { 1.0 };
        if self.is_falling {
            self.velocity[2] -= GRAVITY_MM_S2 * seconds;
        } else {
            for (index, velocity) in self.velocity.iter_mut().enumerate() {
                let goal = goal[index] * self.gains[index] * self.noise[index];
                *velocity += (goal - *velocity) * part;
            }
        }
        let [ahead, left, up, turn] = self.velocity;
        let (sin, cos) = libm::sincosf(pose.heading);
        pose.x += (ahead * cos - left * sin) * seconds;
        pose.y += (ahead * sin + left * cos) * seconds;
        pose.z = (pose.z + up * seconds).max(0.0);
        pose.heading = wrap(pose.heading + turn * seconds);
    }
}

/// Moves along an arc, whose chord points half of the turn further than the heading.
fn arc(pose: &mut Pose, speed_mm_s: f32, rate_rad_s: f32, seconds: f32) {
    if speed_mm_s == 0.0 && rate_rad_s == 0.0 {
        return;
    }
    let half = rate_rad_s * seconds / 2.0;
    let chord =
        speed_mm_s * seconds * if half.abs() > 1e-3 { libm::sinf(half) / half } else { 1.0 };
    let (sin, cos) = libm::sincosf(pose.heading + half);
    pose.x += chord * cos;
    pose.y += chord * sin;
    pose.heading = wrap(pose.heading + 2.0 * half);
}
