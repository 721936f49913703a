//! Bodies: how each kind of robot moves, and what it knows of where it is.

mod crazyflie;
mod kilobot;
mod zooid;

use super::TICK;
use super::geometry::Pose;
use super::robot::RobotKind;
use super::settings::Settings;
use super::stream::Stream;
use crazyflie::Crazyflie;
use kilobot::{Kilobot, KilobotStep};
use zooid::Zooid;

pub use crazyflie::{CrazyflieModel, Flight, Positioning, Velocity};
pub use kilobot::{KilobotModel, KilobotMotors};
pub use zooid::{Drive, ZooidModel, for_firmware};

/// What a brain moves its robot with.
#[derive(Debug)]
pub enum Actuators<'a> {
    /// Of a Kilobot.
    Kilobot(&'a mut KilobotMotors),
    /// Of a Zooid.
    Zooid(&'a mut Drive),
    /// Of a Crazyflie.
    Crazyflie(&'a mut Flight),
}

/// The body of one robot.
#[derive(Clone, Debug)]
pub(crate) enum Body {
    Kilobot(Kilobot),
    Zooid(Zooid),
    Crazyflie(Crazyflie),
}

/// All models, for one length of substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Models {
    kilobot: KilobotStep,
    zooid: ZooidModel,
    crazyflie: CrazyflieModel,
    seconds: f32,
}

impl Models {
    pub(crate) fn new(settings: &Settings, substeps: u32) -> Self {
        let seconds = TICK / substeps as f32;
        Models {
            kilobot: KilobotStep::new(&settings.kilobot, seconds),
            zooid: settings.zooid,
            crazyflie: settings.crazyflie,
            seconds,
        }
    }
}

impl RobotKind {
    /// Radius of the body in mm.
    pub(crate) fn radius(self, settings: &Settings) -> f32 {
        match self {
            RobotKind::Kilobot => settings.kilobot.radius,
            RobotKind::Zooid => settings.zooid.radius,
            RobotKind::Crazyflie => settings.crazyflie.radius,
        }
    }

    /// Height of the body in mm: pins and board, the makers' figures, and the collision cylinder of gym-pybullet-drones.
    pub(crate) fn height(self) -> f32 {
        match self {
            RobotKind::Kilobot => 34.4,
            RobotKind::Zooid => 21.0,
            RobotKind::Crazyflie => 25.0,
        }
    }

    /// Into how many substeps a tick is divided, so that no body moves more than half of its radius in one.
    pub(crate) fn substeps(self, settings: &Settings) -> u32 {
        let fastest = match self {
            RobotKind::Kilobot => {
                let model = &settings.kilobot;
                let most = f32::from(u8::MAX - model.dead_duty);
                let ahead = model.speed * most / f32::from(model.straight_duty - model.dead_duty);
                let turn = model.turn_rate * most / f32::from(model.turn_duty - model.dead_duty);
                ahead.max(turn * model.leg_distance)
            }
            RobotKind::Zooid => settings.zooid.speed,
            RobotKind::Crazyflie => settings.crazyflie.speed,
        };
        let halves = fastest * TICK / (self.radius(settings) / 2.0);
        (halves.ceil() as u32).clamp(1, MOST_SUBSTEPS)
    }
}

/// However fast: more would only cost time.
const MOST_SUBSTEPS: u32 = 50;

impl Body {
    /// `build` decides in what this robot differs from others of its kind.
    pub(crate) fn new(
        kind: RobotKind,
        pose: &Pose,
        settings: &Settings,
        build: &mut Stream,
    ) -> Self {
        match kind {
            RobotKind::Kilobot => Body::Kilobot(Kilobot::new(&settings.kilobot, build)),
            RobotKind::Zooid => Body::Zooid(Zooid::new(&settings.zooid, pose, build)),
            RobotKind::Crazyflie => Body::Crazyflie(Crazyflie::new()),
        }
    }

    pub(crate) fn kind(&self) -> RobotKind {
        match self {
            Body::Kilobot(_) => RobotKind::Kilobot,
            Body::Zooid(_) => RobotKind::Zooid,
            Body::Crazyflie(_) => RobotKind::Crazyflie,
        }
    }

    pub(crate) fn actuators(&mut self) -> Actuators<'_> {
        match self {
            Body::Kilobot(body) => Actuators::Kilobot(&mut body.motors),
            Body::Zooid(body) => Actuators::Zooid(&mut body.drive),
            Body::Crazyflie(body) => Actuators::Crazyflie(&mut body.flight),
        }
    }

    /// Switches the motors off.
    pub(crate) fn halt(&mut self) {
        match self {
            Body::Kilobot(body) => body.motors = KilobotMotors::default(),
            Body::Zooid(body) => body.drive = Drive::default(),
            Body::Crazyflie(body) => body.flight = Flight::Off,
        }
    }

    /// As after power-on: motors off, and nothing is known of where it is.
    pub(crate) fn restart(&mut self) {
        match self {
            Body::Crazyflie(body) => *body = Crazyflie::new(),
            Body::Kilobot(_) | Body::Zooid(_) => self.halt(),
        }
    }

    /// Moves for one substep.
    pub(crate) fn advance(&mut self, pose: &mut Pose, models: &Models) {
        match self {
            Body::Kilobot(body) => body.advance(pose, &models.kilobot),
            Body::Zooid(body) => body.advance(pose, &models.zooid, models.seconds),
            Body::Crazyflie(body) => body.advance(pose, &models.crazyflie, models.seconds),
        }
    }

    /// Wheels or vibration motors run for a time as something outside of the engine makes them; duties in percent. Returns
    /// mm/s ahead and radians per second, which are 0 for a Kilobot: nobody reckons with so little. `None` for other bodies.
    pub(crate) fn roll(
        &mut self,
        duties: [f32; 2],
        pose: &mut Pose,
        models: &Models,
        seconds: f32,
    ) -> Option<[f32; 2]> {
        match self {
            Body::Zooid(body) => {
                body.roll(duties, pose, &models.zooid, seconds);
                Some(body.velocity())
            }
            Body::Kilobot(body) => {
                body.run(duties, pose, &models.kilobot, seconds / models.seconds);
                Some([0.0; 2])
            }
            Body::Crazyflie(_) => None,
        }
    }

    /// Learns where it is, `seconds` after the last time; `stream` is asked for only by bodies that need it.
    pub(crate) fn sense(
        &mut self,
        pose: &Pose,
        models: &Models,
        seconds: f32,
        stream: impl FnOnce() -> Stream,
    ) {
        match self {
            Body::Kilobot(_) => {}
            Body::Zooid(body) => body.sense(pose, &models.zooid),
            Body::Crazyflie(body) => body.sense(pose, &models.crazyflie, seconds, &mut stream()),
        }
    }

    /// Where the robot believes to be.
    pub(crate) fn estimate(&self) -> Option<&Pose> {
        match self {
            Body::Kilobot(_) => None,
            Body::Zooid(body) => Some(&body.estimate),
            Body::Crazyflie(body) => body.estimate.as_ref(),
        }
    }
}
