//! Kilobot: two vibration motors on three stiff legs.
//!
//! One motor turns the robot about the rear leg on its own side; both together push it straight ahead (Rubenstein, Ahler,
//! Nagpal: Kilobot, ICRA 2012). What both motors give in common drives the robot straight, what one gives more turns it,
//! so unlike motors make it go in a curve, as real ones do.

use bittybuzz_arena::engine::{
    Block, Bodies, Body, BodyModel, Infrared, Link, Loss, Medium, Pose, SettingsError, Shape,
    Stream, first_wrong, not_below_0, within, wrap,
};

/// Duties of the motors, 0 to 255. The left one turns anticlockwise, the right one clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KilobotMotors {
    /// Turns anticlockwise about the left leg.
    pub left: u8,
    /// Turns clockwise about the right leg.
    pub right: u8,
}

/// Numbers of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KilobotModel {
    /// The source of the numbers.
    pub preset: Preset,
    /// mm
    pub radius: f32,
    /// Angle between the heading and a rear leg, radians.
    pub leg_angle: f32,
    /// From the middle to a rear leg, mm.
    pub leg_distance: f32,
    /// mm/s with both motors at `straight_duty`.
    pub speed: f32,
    /// Radians per second with one motor at `turn_duty`.
    pub turn_rate: f32,
    /// Duty of both motors that calibration found for going straight.
    pub straight_duty: u8,
    /// Duty of a motor that calibration found for turning.
    pub turn_duty: u8,
    /// Duty at which a motor begins to move the robot; from there the effect is linear.
    pub dead_duty: u8,
    /// Deviation of each motor's gain, as a part of 1.
    pub gain_sigma: f32,
}

impl KilobotModel {
    /// 10 mm/s and 45 degrees per second (ICRA 2012); legs as the Kilobot plugin of ARGoS has them: 25 mm between the
    /// pins, the middle 9.2 mm before them. The duties are a choice: calibrated robots have 60 to 75.
    pub const STANDARD: Self = KilobotModel {
        preset: Preset::Standard,
        radius: 16.5,
        leg_angle: 2.205_2,
        leg_distance: 15.52,
        speed: 10.0,
        turn_rate: core::f32::consts::FRAC_PI_4,
        straight_duty: 70,
        turn_duty: 70,
        dead_duty: 0,
        gain_sigma: 0.1,
    };

    /// Kilombo: 7 mm/s, 13 degrees per second at duty 75, nothing below 60; legs at 125.5 degrees on the rim.
    pub const KILOMBO: Self = KilobotModel {
        preset: Preset::Kilombo,
        radius: 17.0,
        leg_angle: 2.190_4,
        leg_distance: 17.0,
        speed: 7.0,
        turn_rate: 0.226_9,
        straight_duty: 75,
        turn_duty: 75,
        dead_duty: 60,
        gain_sigma: 0.0,
    };

    /// The Kilobot plugin of ARGoS: 60 mm/s times duty/255 at each pin, 25 mm apart.
    pub const ARGOS: Self = KilobotModel {
        preset: Preset::Argos,
        speed: 60.0 * 48.0 / 255.0,
        turn_rate: 60.0 * 77.0 / 255.0 / 25.0,
        straight_duty: 48,
        turn_duty: 77,
        gain_sigma: 0.0,
        ..Self::STANDARD
    };

    /// Kilosim: 24 mm/s, 0.5 radians per second.
    pub const KILOSIM: Self =
        KilobotModel { preset: Preset::Kilosim, speed: 24.0, turn_rate: 0.5, ..Self::STANDARD };
}

impl BodyModel for KilobotModel {
    /// The height is that of pins and board, as the makers have it.
    fn shape(&self) -> Shape {
        Shape { radius: self.radius, height: 34.4 }
    }

    fn top_speed(&self) -> f32 {
        let most = f32::from(u8::MAX - self.dead_duty);
        let ahead = self.speed * most / f32::from(self.straight_duty - self.dead_duty);
        let turn = self.turn_rate * most / f32::from(self.turn_duty - self.dead_duty);
        ahead.max(turn * self.leg_distance)
    }

    fn medium(&self) -> Medium {
        Medium::Infrared
    }

    fn has_positioning(&self) -> bool {
        false
    }

    fn check(&self) -> Result<(), SettingsError> {
        first_wrong(&[
            ("kilobot.radius", within(self.radius, 1.0, 1e4), "1 to 10000"),
            ("kilobot.leg_angle", self.leg_angle.is_finite(), "a number"),
            ("kilobot.leg_distance", not_below_0(self.leg_distance), "0 or more"),
            ("kilobot.speed", within(self.speed, 0.0, 1e4), "0 to 10000"),
            ("kilobot.turn_rate", within(self.turn_rate, 0.0, 100.0), "0 to 100"),
            ("kilobot.straight_duty", self.straight_duty > self.dead_duty, "above dead_duty"),
            ("kilobot.turn_duty", self.turn_duty > self.dead_duty, "above dead_duty"),
            ("kilobot.gain_sigma", within(self.gain_sigma, 0.0, 1.0), "0 to 1"),
        ])
    }

    fn block(&self, substep: f32) -> Box<dyn Block> {
        Box::new(Bodies::<Kilobot>::new(*self, substep))
    }
}

/// Whose numbers hold for Kilobots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Papers and documentation of the robot.
    #[default]
    Standard,
    /// The simulator Kilombo: 70 mm between middles, no loss, exact distances.
    Kilombo,
    /// The Kilobot plugin of ARGoS: 100 mm between middles, a frame every 100 ms.
    Argos,
    /// The simulator Kilosim: 96 mm between middles.
    Kilosim,
}

impl Preset {
    /// Returns the numbers of the body.
    #[must_use]
    pub fn model(self) -> KilobotModel {
        match self {
            Preset::Standard => KilobotModel::STANDARD,
            Preset::Kilombo => KilobotModel::KILOMBO,
            Preset::Argos => KilobotModel::ARGOS,
            Preset::Kilosim => KilobotModel::KILOSIM,
        }
    }

    /// Returns the numbers of the infrared link.
    #[must_use]
    pub fn infrared(self) -> Infrared {
        let ideal = |range: f32| {
            let link =
                Link { range: Some(range), loss: Loss::even(0.0), ..Infrared::STANDARD.link };
            Infrared { link, distance_sigma: 0.0, ..Infrared::STANDARD }
        };
        match self {
            Preset::Standard => Infrared::STANDARD,
            Preset::Kilombo => ideal(70.0 - 2.0 * 17.0),
            Preset::Argos => Infrared { tx_period: 767, ..ideal(100.0 - 2.0 * 16.5) },
            Preset::Kilosim => ideal(96.0 - 2.0 * 16.5),
        }
    }
}

/// What a model means for one substep.
#[derive(Clone, Copy, Debug)]
struct KilobotStep {
    /// Seconds.
    length: f32,
    dead: u8,
    /// mm per duty of both motors.
    ahead: f32,
    /// Radians per duty of one motor.
    turn: f32,
    /// From the middle to the left leg, of a robot with heading 0.
    leg: (f32, f32),
}

/// A Kilobot's body.
#[derive(Clone, Debug)]
struct Kilobot {
    motors: KilobotMotors,
    gain_left: f32,
    gain_right: f32,
    /// Heading for which sine and cosine were computed.
    heading: f32,
    sin: f32,
    cos: f32,
}

impl Body for Kilobot {
    type Numbers = KilobotModel;
    type Step = KilobotStep;
    type Controls = KilobotMotors;

    fn new(model: &KilobotModel, _: &Pose, build: &mut Stream) -> Self {
        Kilobot {
            motors: KilobotMotors::default(),
            gain_left: build.gain(model.gain_sigma),
            gain_right: build.gain(model.gain_sigma),
            heading: 0.0,
            sin: 0.0,
            cos: 1.0,
        }
    }

    fn prepare(model: &KilobotModel, seconds: f32) -> KilobotStep {
        let (sin, cos) = libm::sincosf(model.leg_angle);
        KilobotStep {
            length: seconds,
            dead: model.dead_duty,
            ahead: model.speed * seconds / f32::from(model.straight_duty - model.dead_duty),
            turn: model.turn_rate * seconds / f32::from(model.turn_duty - model.dead_duty),
            leg: (model.leg_distance * cos, model.leg_distance * sin),
        }
    }

    fn controls(&mut self) -> &mut KilobotMotors {
        &mut self.motors
    }

    fn halt(&mut self) {
        self.motors = KilobotMotors::default();
    }

    fn step(&mut self, pose: &mut Pose, step: &KilobotStep) {
        if self.motors == KilobotMotors::default() {
            return;
        }
        if self.heading != pose.heading {
            self.look(pose.heading);
        }
        let left = f32::from(self.motors.left.saturating_sub(step.dead)) * self.gain_left;
        let right = f32::from(self.motors.right.saturating_sub(step.dead)) * self.gain_right;
        let ahead = left.min(right) * step.ahead;
        pose.x += ahead * self.cos;
        pose.y += ahead * self.sin;
        let turn = (left - right) * step.turn;
        if turn != 0.0 {
            let side = if turn > 0.0 { 1.0 } else { -1.0 };
            let (x, y) = self.leg(step, side);
            pose.heading = wrap(pose.heading + turn);
            self.look(pose.heading);
            let (new_x, new_y) = self.leg(step, side);
            // The leg stays where it is.
            pose.x += x - new_x;
            pose.y += y - new_y;
        }
    }

    fn roll(
        &mut self,
        [left, right]: [f32; 2],
        pose: &mut Pose,
        step: &KilobotStep,
        seconds: f32,
    ) -> Option<[f32; 2]> {
        let substeps = seconds / step.length;
        let duty = |percent: f32| (percent * f32::from(u8::MAX) / 100.0).round() as u8;
        self.motors = KilobotMotors { left: duty(left), right: duty(right) };
        let (ahead, turn) = (step.ahead * substeps, step.turn * substeps);
        self.step(pose, &KilobotStep { ahead, turn, ..*step });
        self.motors = KilobotMotors::default();
        // It stops within a mm: nothing reckons with its speed.
        Some([0.0; 2])
    }
}

impl Kilobot {
    fn look(&mut self, heading: f32) {
        self.heading = heading;
        (self.sin, self.cos) = libm::sincosf(heading);
    }

    /// From the middle to the leg on the left (1) or right (-1) side.
    fn leg(&self, step: &KilobotStep, side: f32) -> (f32, f32) {
        let (x, y) = (step.leg.0, step.leg.1 * side);
        (x * self.cos - y * self.sin, x * self.sin + y * self.cos)
    }
}
