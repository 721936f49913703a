//! The body of a Zooid: two wheels, tracked by a projector.

use bittybuzz_emulation::message::PowerDetector;
use bittybuzz_motion::drive::{Goal, Pilot, Wheels};
use bittybuzz_motion::{Angle, units};

use bittybuzz_arena::engine::{
    Bodies, Body, BodyBlock, BodyModel, BodySize, Medium, Pose, SettingsError, Stream, above_0,
    first_wrong, within, wrap,
};

/// A command for the wheels, as the firmware gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Turn the wheels with these duties.
    Wheels(Wheels),
    /// Drive to this goal and stay there.
    Goal(Goal),
}

impl Default for Drive {
    fn default() -> Self {
        Drive::Wheels(Wheels::default())
    }
}

/// Converts a pose to the units of the firmware.
pub(crate) fn for_firmware(pose: &Pose) -> bittybuzz_motion::track::TrackedPose {
    // The firmware's lengths end at 32.8 m, which no projector reaches; a place beyond counts as 0.
    let length = |mm: f32| units::from_mm(mm).unwrap_or_default();
    let heading = Angle((wrap(pose.heading) * (32_768.0 / core::f32::consts::PI)) as i32 as i16);
    bittybuzz_motion::track::TrackedPose { x: length(pose.x), y: length(pose.y), heading }
}

/// The parameters of a Zooid's body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZooidModel {
    /// Radius in mm.
    pub radius: f32,
    /// Distance between the wheels in mm.
    pub track: f32,
    /// Speed of a wheel at `full_duty`, in mm/s.
    pub speed: f32,
    /// Duty in percent at which a wheel has `speed`; the speed grows linearly from `dead_duty`.
    pub full_duty: u8,
    /// Duty in percent up to which a wheel stands still.
    pub dead_duty: u8,
    /// Standard deviation of each wheel's gain, as a share of it.
    pub gain_sigma: f32,
    /// The size in mm of one step of the projector's code.
    pub unit: f32,
    /// Faults of the projector's light, for an emulated firmware.
    pub light: ProjectorFaults,
    /// Interpretation of the register RPD, for an emulated firmware.
    pub power_detector: PowerDetector,
}

/// Faults of the projector's light, as a robot's firmware sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectorFaults {
    /// Share of frames that the robot does not see.
    pub lose: f64,
    /// Largest deviation of an edge in µs, early or late.
    pub jitter_us: f64,
    /// Glitches per second at each photodiode.
    pub glitches_per_s: f64,
}

impl ZooidModel {
    /// Track and diameter are from the makers' description. 0.5 m/s is the reported top speed, 60
    /// the highest duty of their firmware, and 22 the duty at which its calibration begins. No
    /// curve of duty and speed was found in the sources: a linear one is a choice, and so is the
    /// deviation.
    pub const STANDARD: Self = ZooidModel {
        radius: 13.0,
        track: 20.0,
        speed: 500.0,
        full_duty: 60,
        dead_duty: 22,
        gain_sigma: 0.05,
        unit: 0.92,
        light: ProjectorFaults { lose: 0.0, jitter_us: 0.0, glitches_per_s: 0.0 },
        power_detector: PowerDetector::Latched,
    };
}

impl BodyModel for ZooidModel {
    /// Returns the shape; the height is the makers' figure.
    fn shape(&self) -> BodySize {
        BodySize { radius_mm: self.radius, height_mm: 21.0 }
    }

    fn top_speed_mm_s(&self) -> f32 {
        self.speed
    }

    fn medium(&self) -> Medium {
        Medium::Nrf24
    }

    fn has_positioning(&self) -> bool {
        true
    }

    fn check(&self) -> Result<(), SettingsError> {
        first_wrong(&[
            ("zooid.radius", within(self.radius, 1.0, 1e4), "1 to 10000"),
            ("zooid.track", above_0(self.track), "a number greater than 0"),
            ("zooid.speed", within(self.speed, 0.0, 1e4), "0 to 10000"),
            ("zooid.full_duty", self.full_duty > self.dead_duty, "above dead_duty"),
            ("zooid.gain_sigma", within(self.gain_sigma, 0.0, 1.0), "0 to 1"),
            ("zooid.unit", above_0(self.unit), "a number greater than 0"),
        ])
    }

    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock> {
        Box::new(Bodies::<ZooidBody>::new(*self, substep_s))
    }
}

/// Distance from the middle to each photodiode in mm (layout of the board, version 1.3).
const DIODE: f32 = 9.8;

/// Duration of a projector's frame in seconds: 41 patterns of 333 µs. The position that a robot
/// decodes is one frame old.
const FRAME: f32 = 0.013_653;

/// A Zooid's body.
#[derive(Clone, Debug)]
struct ZooidBody {
    drive: Drive,
    pilot: Pilot,
    /// The goal of the pilot.
    goal: Option<Goal>,
    gain_left: f32,
    gain_right: f32,
    /// Speed in mm/s and rate of turn in radians per second, in the last substep.
    speed: f32,
    rate: f32,
}

/// The model, and the length of a substep in seconds.
type ZooidStep = (ZooidModel, f32);

impl Body for ZooidBody {
    type Numbers = ZooidModel;
    type Step = ZooidStep;
    type Controls = Drive;

    fn new(model: &ZooidModel, _: &Pose, build: &mut Stream) -> Self {
        ZooidBody {
            drive: Drive::default(),
            pilot: Pilot::new(Some(model.dead_duty)),
            goal: None,
            gain_left: build.gain(model.gain_sigma),
            gain_right: build.gain(model.gain_sigma),
            speed: 0.0,
            rate: 0.0,
        }
    }

    fn prepare(model: &ZooidModel, seconds: f32) -> ZooidStep {
        (*model, seconds)
    }

    fn controls(&mut self) -> &mut Drive {
        &mut self.drive
    }

    fn halt(&mut self) {
        self.drive = Drive::default();
    }

    fn step(&mut self, pose: &mut Pose, (model, seconds): &ZooidStep) {
        let Wheels { left, right } = self.steer(pose);
        self.turn_wheels([left, right].map(f32::from), pose, model, *seconds);
    }

    fn roll(
        &mut self,
        duties: [f32; 2],
        pose: &mut Pose,
        (model, _): &ZooidStep,
        seconds: f32,
    ) -> Option<[f32; 2]> {
        self.turn_wheels(duties, pose, model, seconds);
        Some([self.speed, self.rate])
    }

    /// Returns the pose that the robot decodes from the stripes of the projector's code in which
    /// its two photodiodes are.
    fn sense(
        &mut self,
        pose: &Pose,
        model: &ZooidModel,
        _: f32,
        _: impl FnOnce() -> Stream,
    ) -> Option<Pose> {
        let heading = pose.heading - self.rate * FRAME;
        let (sin, cos) = libm::sincosf(heading);
        let (x, y) = (pose.x - self.speed * FRAME * cos, pose.y - self.speed * FRAME * sin);
        // The line between the diodes is square to the heading.
        let stripe = |value: f32| libm::floorf(value / model.unit + 0.5) * model.unit;
        let (left_x, left_y) = (stripe(x - DIODE * sin), stripe(y + DIODE * cos));
        let (right_x, right_y) = (stripe(x + DIODE * sin), stripe(y - DIODE * cos));
        Some(Pose {
            x: (left_x + right_x) / 2.0,
            y: (left_y + right_y) / 2.0,
            z: 0.0,
            heading: libm::atan2f(right_x - left_x, left_y - right_y),
        })
    }
}

impl ZooidBody {
    /// Turns the wheels for a time, with duties in percent.
    fn turn_wheels(
        &mut self,
        [left, right]: [f32; 2],
        pose: &mut Pose,
        model: &ZooidModel,
        seconds: f32,
    ) {
        let left = wheel_speed(left, model) * self.gain_left;
        let right = wheel_speed(right, model) * self.gain_right;
        self.speed = (left + right) / 2.0;
        self.rate = (right - left) / model.track;
        if self.speed == 0.0 && self.rate == 0.0 {
            return;
        }
        // The path is an arc. Its chord points half of the turn away from the first heading.
        let half = self.rate * seconds / 2.0;
        let chord =
            self.speed * seconds * if half.abs() > 1e-3 { libm::sinf(half) / half } else { 1.0 };
        let (sin, cos) = libm::sincosf(pose.heading + half);
        pose.x += chord * cos;
        pose.y += chord * sin;
        pose.heading = wrap(pose.heading + 2.0 * half);
    }

    /// Returns the duties of the wheels. The firmware steers 73 times per second by a position that
    /// it extrapolates to the present. This position is off by half a mm, which is close enough to
    /// the true one that is used here.
    fn steer(&mut self, pose: &Pose) -> Wheels {
        match self.drive {
            Drive::Wheels(wheels) => {
                self.goal = None;
                wheels
            }
            Drive::Goal(goal) => {
                if self.goal.replace(goal) != Some(goal) {
                    self.pilot.depart();
                }
                // The pilot uses the time only while it searches for the least duty, which is known
                // here.
                self.pilot.steer(goal, &for_firmware(pose), 0)
            }
        }
    }
}

/// Returns the speed of a wheel in mm/s, without its gain error.
fn wheel_speed(duty: f32, model: &ZooidModel) -> f32 {
    let [full, dead] = [model.full_duty, model.dead_duty].map(f32::from);
    let speed = model.speed * (duty.abs().min(full) - dead).max(0.0) / (full - dead);
    if duty < 0.0 { -speed } else { speed }
}
