//! The body of a Kilobot: two vibration motors on three stiff legs.
//!
//! One motor turns the robot about the rear leg on its own side; both together push it straight
//! ahead (Rubenstein, Ahler, Nagpal: Kilobot, ICRA 2012). In the model the smaller of the two
//! duties drives the robot straight, and the excess of the other motor turns it. Unequal motors
//! therefore make it drive in a curve, as real ones do.
//!
//! No real robot drives exactly straight. Each has its own bias to one side, and a noise around
//! this bias that lasts for a while (Raoufi, Romanczuk, Hamann: Individuality in swarm robots with
//! the case study of Kilobots, ALIFE 2023). Both are curvatures: the angle grows with the distance,
//! not with the time. The noise is an Ornstein-Uhlenbeck process with one step per tick, so that it
//! does not depend on the length of substeps.
//!
//! A turn is as noisy as its motor. ARGoS and the authors of that paper draw noise for each motor,
//! so the noise of a robot that drives straight is the difference of two equal ones, and a single
//! motor has 1 / sqrt(2) of its deviation. The bias of a turn is the gain of its motor.

use bittybuzz_arena::engine::{
    Bodies, Body, BodyBlock, BodyModel, BodySize, Infrared, LinkSettings, Loss, Medium, Pose,
    SettingsError, Stream, TICK_S, first_wrong, not_below_0, within, wrap,
};

/// Duties of the motors, 0 to 255. The left one turns anticlockwise, the right one clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KilobotMotors {
    /// Duty of the motor that turns the robot anticlockwise about the left leg.
    pub left: u8,
    /// Duty of the motor that turns the robot clockwise about the right leg.
    pub right: u8,
}

/// The parameters of a Kilobot's body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KilobotModel {
    /// The source of the parameters.
    pub preset: Preset,
    /// Radius in mm.
    pub radius: f32,
    /// Angle between the heading and a rear leg, in radians.
    pub leg_angle: f32,
    /// Distance from the middle to a rear leg, in mm.
    pub leg_distance: f32,
    /// Speed in mm/s with both motors at `straight_duty`.
    pub speed: f32,
    /// Rate of turn in radians per second with one motor at `turn_duty`.
    pub turn_rate: f32,
    /// Duty of both motors that calibration found for going straight.
    pub straight_duty: u8,
    /// Duty of a motor that calibration found for turning.
    pub turn_duty: u8,
    /// Duty up to which a motor does not move the robot; above it the effect is linear.
    pub dead_duty: u8,
    /// Duty above which a motor has no more effect.
    pub full_duty: u8,
    /// Standard deviation of the speed between robots, as a share of it.
    pub speed_sigma: f32,
    /// Standard deviation of the turn rate between motors, as a share of it. Each motor has its own
    /// value.
    pub turn_sigma: f32,
    /// Standard deviation between robots of the bias: the rate of turn at `straight_duty` of both
    /// motors, in radians per second.
    pub bias_sigma: f32,
    /// Standard deviation of the rate of turn within a robot, in radians per second.
    pub noise_sigma: f32,
    /// Time constant of the deviation within a robot in seconds, after which the correlation is
    /// 1/e. At 0 each tick has a new value.
    pub noise_time: f32,
}

impl KilobotModel {
    /// The real robot: 10 mm/s and 45 degrees per second (ICRA 2012). The legs are those of ARGoS's
    /// Kilobot plugin: 25 mm between the pins, with the middle 9.2 mm in front of them. The duties
    /// of the calibration are a choice: those of robots are 60 to 75.
    ///
    /// Motors have no effect up to duty 60 and none beyond 90. Both limits are those of Kilombo, and
    /// the makers agree: kilolib limits lasting duties to 90, and ARK begins to look for a duty that
    /// moves a robot at 60.
    ///
    /// Speed and bias vary as in the experiments that Sheffield publishes for ARGoS, where the bias
    /// of each of two pins has a deviation of 1.86 mm/s: 1.86 / sqrt(2) = 1.3 mm/s, and sqrt(2) *
    /// 1.86 / 25 rad/s = 6 degrees per second. The bias of a single robot varies by a sixth of the
    /// spread between robots (figure 2 of Raoufi et al.: 0.05 to 0.32). The time for which a
    /// deviation lasts was not found in a source: 10 s are a choice, and so are the 10 % of the turn
    /// rate.
    pub const STANDARD: Self = KilobotModel {
        preset: Preset::Standard,
        radius: 16.5,
        leg_angle: 2.205_2,
        leg_distance: 15.52,
        speed: 10.0,
        turn_rate: core::f32::consts::FRAC_PI_4,
        straight_duty: 70,
        turn_duty: 70,
        dead_duty: 60,
        full_duty: 90,
        speed_sigma: 0.13,
        turn_sigma: 0.1,
        bias_sigma: 6.0 * DEGREE,
        noise_sigma: 1.0 * DEGREE,
        noise_time: 10.0,
    };

    /// The simulator Kilombo: 7 mm/s, 13 degrees per second at duty 75, no motion below duty 60 and
    /// at most twice the motion of duty 75 (`skilobot.c`); legs at 125.5 degrees on the rim. All noise
    /// is off there by default.
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
        full_duty: 90,
        speed_sigma: 0.0,
        turn_sigma: 0.0,
        bias_sigma: 0.0,
        noise_sigma: 0.0,
        noise_time: 0.0,
    };

    /// The Kilobot plugin of ARGoS: each pin moves at 60 mm/s times duty / 255, the pins are 25 mm
    /// apart, and there is no noise unless an experiment asks for it. Its motors have no dead zone
    /// (`ci_kilobot_controller.cpp`).
    pub const ARGOS: Self = KilobotModel {
        preset: Preset::Argos,
        speed: 60.0 * 48.0 / 255.0,
        turn_rate: 60.0 * 77.0 / 255.0 / 25.0,
        straight_duty: 48,
        turn_duty: 77,
        dead_duty: 0,
        full_duty: u8::MAX,
        speed_sigma: 0.0,
        turn_sigma: 0.0,
        bias_sigma: 0.0,
        noise_sigma: 0.0,
        noise_time: 0.0,
        ..Self::STANDARD
    };

    /// The simulator Kilosim: 24 mm/s, 0.5 radians per second; no bias and no noise. Kilosim draws
    /// its deviations of 10 % again beyond 1.1 standard deviations, which leaves 0.585 of 10 %
    /// (`Kilobot.h`). A motor is proportional to its duty here, which is a choice.
    pub const KILOSIM: Self = KilobotModel {
        preset: Preset::Kilosim,
        speed: 24.0,
        turn_rate: 0.5,
        dead_duty: 0,
        full_duty: u8::MAX,
        speed_sigma: 0.0585,
        turn_sigma: 0.0585,
        bias_sigma: 0.0,
        noise_sigma: 0.0,
        noise_time: 0.0,
        ..Self::STANDARD
    };
}

impl BodyModel for KilobotModel {
    /// Returns the shape; the height is the makers' figure for pins and board.
    fn shape(&self) -> BodySize {
        BodySize { radius_mm: self.radius, height_mm: 34.4 }
    }

    fn top_speed_mm_s(&self) -> f32 {
        let most = f32::from(self.full_duty - self.dead_duty);
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
            ("kilobot.full_duty", self.full_duty > self.dead_duty, "above dead_duty"),
            ("kilobot.speed_sigma", within(self.speed_sigma, 0.0, 1.0), "0 to 1"),
            ("kilobot.turn_sigma", within(self.turn_sigma, 0.0, 1.0), "0 to 1"),
            ("kilobot.bias_sigma", within(self.bias_sigma, 0.0, 100.0), "0 to 100"),
            ("kilobot.noise_sigma", within(self.noise_sigma, 0.0, 100.0), "0 to 100"),
            ("kilobot.noise_time", within(self.noise_time, 0.0, 1e5), "0 to 100000"),
        ])
    }

    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock> {
        Box::new(Bodies::<Kilobot>::new(*self, substep_s))
    }
}

/// A source of parameters for Kilobots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Papers about the robot, and its documentation.
    #[default]
    Standard,
    /// The simulator Kilombo: range of 70 mm between middles, no loss, exact distances.
    Kilombo,
    /// The Kilobot plugin of ARGoS: range of 100 mm between middles, a frame every 100 ms.
    Argos,
    /// The simulator Kilosim: range of 96 mm between middles.
    Kilosim,
}

impl Preset {
    /// Returns the parameters of the body.
    #[must_use]
    pub fn model(self) -> KilobotModel {
        match self {
            Preset::Standard => KilobotModel::STANDARD,
            Preset::Kilombo => KilobotModel::KILOMBO,
            Preset::Argos => KilobotModel::ARGOS,
            Preset::Kilosim => KilobotModel::KILOSIM,
        }
    }

    /// Returns the parameters of the infrared link.
    #[must_use]
    pub fn infrared(self) -> Infrared {
        let ideal = |range: f32| {
            let link = LinkSettings {
                range: Some(range),
                edge: 0.0,
                loss: Loss::even(0.0),
                ..Infrared::STANDARD.link
            };
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

/// A degree in radians.
const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// The constants of a model for one substep.
#[derive(Clone, Copy, Debug)]
struct KilobotStep {
    /// Length of the substep in seconds.
    length: f32,
    dead: u8,
    full: u8,
    /// Distance in mm per unit of common duty.
    ahead: f32,
    /// Angle in radians per unit of excess duty of one motor.
    turn: f32,
    /// Angle in radians per unit of common duty, for a bias of 1 radian per second at
    /// `straight_duty`.
    straight: f32,
    /// Angle in radians per unit of excess duty of one motor, for a noise of 1 radian per second at
    /// `straight_duty`.
    sway: f32,
    /// The noise process: the share that is left after a tick, and the standard deviation of the
    /// part that is added then, in radians per second.
    decay: f32,
    fresh: f32,
    /// Vector in mm from the middle to the left leg of a robot with heading 0.
    leg: (f32, f32),
}

/// A Kilobot's body.
#[derive(Clone, Debug)]
struct Kilobot {
    motors: KilobotMotors,
    speed_gain: f32,
    turn_gains: [f32; 2],
    /// Rate of turn at `straight_duty` of both motors, in radians per second.
    bias: f32,
    /// Deviation from `bias` in this tick, in radians per second.
    noise: f32,
    /// Seconds of motion until the noise is drawn again.
    left: f32,
    /// The robot's own random numbers, for the noise.
    chance: Stream,
    /// The heading for which `sin` and `cos` were computed.
    heading: f32,
    sin: f32,
    cos: f32,
}

impl Body for Kilobot {
    type Numbers = KilobotModel;
    type Step = KilobotStep;
    type Controls = KilobotMotors;

    fn new(model: &KilobotModel, _: &Pose, build: &mut Stream) -> Self {
        let mut chance = build.fork();
        Kilobot {
            motors: KilobotMotors::default(),
            speed_gain: build.gain(model.speed_sigma),
            turn_gains: [(); 2].map(|()| build.gain(model.turn_sigma)),
            bias: model.bias_sigma * build.normal().clamp(-3.0, 3.0),
            noise: model.noise_sigma * chance.normal(),
            left: TICK_S,
            chance,
            heading: 0.0,
            sin: 0.0,
            cos: 1.0,
        }
    }

    fn prepare(model: &KilobotModel, seconds: f32) -> KilobotStep {
        let (sin, cos) = libm::sincosf(model.leg_angle);
        let straight = f32::from(model.straight_duty - model.dead_duty);
        let turn = f32::from(model.turn_duty - model.dead_duty);
        let decay =
            if model.noise_time > 0.0 { libm::expf(-TICK_S / model.noise_time) } else { 0.0 };
        KilobotStep {
            length: seconds,
            dead: model.dead_duty,
            full: model.full_duty,
            ahead: model.speed * seconds / straight,
            turn: model.turn_rate * seconds / turn,
            straight: seconds / straight,
            sway: core::f32::consts::FRAC_1_SQRT_2 * seconds / turn,
            decay,
            fresh: model.noise_sigma * (1.0 - decay * decay).sqrt(),
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
            self.turn_to(pose.heading);
        }
        let KilobotMotors { left, right } = self.motors;
        let [left, right] =
            [left, right].map(|duty| f32::from(duty.min(step.full).saturating_sub(step.dead)));
        // The motors turn, but too slowly to move the robot.
        if left == 0.0 && right == 0.0 {
            return;
        }
        let noise = self.noise(step);
        let (both, more) = (left.min(right), left - right);
        let veer = (self.bias + noise) * both * step.straight;
        let gain = self.turn_gains[usize::from(more < 0.0)];
        let turn = more * step.turn * gain + more.abs() * step.sway * noise;
        // The excess of one motor turns the robot about that motor's leg. When both run, bias and
        // noise turn it about the middle between the legs, which does not change the speed; the
        // second term of `ahead` accounts for this, because both turns are applied about the leg
        // below.
        let side = if more == 0.0 { 0.0 } else { 1.0_f32.copysign(more) };
        let ahead = both * step.ahead * self.speed_gain - side * step.leg.1 * veer;
        pose.x += ahead * self.cos;
        pose.y += ahead * self.sin;
        if turn + veer != 0.0 {
            let (x, y) = self.leg(step, side);
            pose.heading = wrap(pose.heading + turn + veer);
            self.turn_to(pose.heading);
            let (new_x, new_y) = self.leg(step, side);
            // The leg is the center of the turn and stays at its place.
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
        let (straight, sway) = (step.straight * substeps, step.sway * substeps);
        self.step(pose, &KilobotStep { length: seconds, ahead, turn, straight, sway, ..*step });
        self.motors = KilobotMotors::default();
        // A Kilobot stops within a mm, so no caller needs its speed.
        Some([0.0; 2])
    }
}

impl Kilobot {
    fn turn_to(&mut self, heading: f32) {
        self.heading = heading;
        (self.sin, self.cos) = libm::sincosf(heading);
    }

    /// Returns the noise of a substep in radians per second. It is drawn once per tick of motion.
    fn noise(&mut self, step: &KilobotStep) -> f32 {
        if step.fresh > 0.0 && self.left < step.length / 2.0 {
            self.noise = self.noise * step.decay + step.fresh * self.chance.normal();
            self.left += TICK_S;
        }
        self.left -= step.length;
        self.noise
    }

    /// Returns the vector from the middle to the leg on the left (1) or right (-1) side, or to the
    /// middle between both legs (0).
    fn leg(&self, step: &KilobotStep, side: f32) -> (f32, f32) {
        let (x, y) = (step.leg.0, step.leg.1 * side);
        (x * self.cos - y * self.sin, x * self.sin + y * self.cos)
    }
}
