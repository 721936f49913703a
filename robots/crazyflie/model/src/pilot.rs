//! The autopilot of a simulated Crazyflie: the pilot of [`bittybuzz_flight`], its aircraft, and what
//! the robot keeps between two calls of its script.
//!
//! With `fidelity = "flight"` the aircraft is the flight controller, which is part of the body.
//! Otherwise it is a planner, whose references the kinematic body follows.

use std::any::Any;

use bittybuzz_arena::engine::{self, Io, Pose, Sensors, TICK_S, TICK_US};
use bittybuzz_arena::robot::{Autopilot, Done, Piece, PoseError, RobotCall};
use bittybuzz_flight::avoidance::{Avoidance, AvoidanceSettings, Obstacle, PeerReport};
use bittybuzz_flight::pilot::{
    Aircraft, BodyVelocity, Pilot, PilotAnswer, PilotFunction, PilotMoment, PilotRefusal,
    PlannedAircraft,
};
use bittybuzz_flight::{Vec2, Vec3};

use crate::body::Fidelity;
use crate::flying::FlightControls;
use crate::{CrazyflieModel, Flight, Velocity};

/// Voltages of a full and of a low battery in mV, and the time of flight between them in ms: 7
/// minutes (Bitcraze's data sheet of the 2.1).
const FULL_MV: u64 = 4150;
const LOW_MV: u64 = 3200;
const FLIGHT_TIME_MS: u64 = 420_000;
/// Voltage in mV at which the nRF51 cuts all power.
const FLAT_MV: u64 = 3000;
/// Age in ms that the collision avoidance assumes of a position. In the simulator a frame carries
/// the position at the end of a tick and arrives at the beginning of the next one; the robot acts
/// for a tick on it.
const FRAME_AGE_MS: u32 = TICK_US / 1000;

/// The autopilot of one robot.
#[derive(Debug, Clone)]
pub struct CrazyflieAutopilot {
    pilot: Pilot,
    /// The aircraft of a robot whose body has no flight controller.
    planned: Option<PlannedAircraft>,
    /// Time constant in seconds with which the body follows a velocity.
    lag_s: f32,
    /// The collision avoidance, until the robot's id is known.
    avoidance: Option<AvoidanceSettings>,
    /// A person arms the robot at power-on.
    is_armed_at_start: bool,
    /// Time of flight in ms.
    flown_ms: u64,
    /// Voltage of the battery in mV, if the body has a battery of its own.
    measured_mv: Option<u16>,
    /// Time in ms at which the stopwatch was started.
    started_ms: Option<u64>,
    /// The errors of poses from outside.
    pose_error: PoseError,
}

/// Returns the collision avoidance of robots with these parameters: they keep twice
/// `model.avoidance` between their middles.
fn avoidance(model: &CrazyflieModel) -> Option<AvoidanceSettings> {
    let standard = AvoidanceSettings::CRAZYFLIE;
    let radius_m = model.avoidance / 1000.0;
    (radius_m > 0.0).then(|| AvoidanceSettings {
        radius_m,
        height_m: standard.height_m / standard.radius_m * radius_m,
        speed_m_s: standard.speed_m_s.min(model.speed / 1000.0),
        lag_s: model.lag,
        ..standard
    })
}

impl CrazyflieAutopilot {
    /// Returns the autopilot of a robot with these parameters.
    pub fn new(model: &CrazyflieModel) -> Self {
        let settings = model.pilot();
        let planned = (model.fidelity == Fidelity::Kinematic).then(|| {
            PlannedAircraft::new(settings.limits).expect("the limits of a model are above 0")
        });
        CrazyflieAutopilot {
            pilot: Pilot::new(settings),
            planned,
            lag_s: model.lag,
            avoidance: avoidance(model),
            is_armed_at_start: model.armed,
            flown_ms: 0,
            measured_mv: None,
            started_ms: None,
            pose_error: PoseError::default(),
        }
    }

    /// Lets the pilot act on its aircraft. `setting_mv` is the voltage of the battery that an event
    /// of the scenario has set.
    fn act<R>(
        &mut self,
        io: &mut Io<'_>,
        setting_mv: Option<u16>,
        act: impl FnOnce(&mut Pilot, &mut dyn Aircraft, PilotMoment) -> R,
    ) -> R {
        let now_ms = io.milliseconds();
        if std::mem::take(&mut self.is_armed_at_start) {
            self.pilot.permit(now_ms);
        }
        if let Some(settings) = self.avoidance.take() {
            let settings = within_walls(settings, &io.sensors);
            self.pilot.set_avoidance(Avoidance::new(io.id.0, settings));
        }
        let battery_mv = setting_mv.unwrap_or_else(|| self.battery_mv());
        let moment = PilotMoment { now_ms, battery_mv };
        let CrazyflieAutopilot { pilot, planned, .. } = self;
        match planned {
            Some(planned) => {
                let position =
                    |here: Pose| (Vec3::new(here.x, here.y, here.z) / 1000.0, here.heading);
                planned.sense(now_ms, io.sensors.estimate().map(position));
                act(pilot, planned, moment)
            }
            None => {
                let controls = io.controls::<FlightControls>();
                let controls = controls.expect("a body without a planner has a flight controller");
                act(pilot, &mut *controls.stack, moment)
            }
        }
    }

    /// Executes a flight function.
    pub fn fly(call: &mut RobotCall<'_, '_>, function: PilotFunction) -> Done {
        let numbers: Vec<f32> =
            (0..call.numbers.count()).map(|index| call.numbers.float(index)).collect();
        let (is_repeated, setting_mv) = (call.again, call.memory.battery_mv);
        let autopilot = call.memory.autopilot.as_deref_mut().map(|autopilot| {
            let autopilot: &mut dyn Any = autopilot;
            autopilot.downcast_mut::<CrazyflieAutopilot>()
        });
        let autopilot = autopilot.flatten().expect("a Crazyflie's functions run with its pilot");
        autopilot.measure_battery(call.io);
        let answer = autopilot.act(call.io, setting_mv, |pilot, aircraft, moment| {
            pilot.call(function, &numbers, is_repeated, aircraft, moment)
        });
        let value = |is_there: bool| match function.has_value() {
            true => Done::Int(is_there.into()),
            false => Done::Nil,
        };
        match answer {
            PilotAnswer::Waiting => Done::Wait,
            PilotAnswer::Done(is_there) => value(is_there),
            PilotAnswer::OutOfRange => Done::OutOfRange,
            PilotAnswer::Refused { reason, is_new } => {
                if is_new {
                    call.log_text(&refusal_text(function, reason));
                }
                value(false)
            }
        }
    }

    /// Returns the voltage of the battery in mV, without a setting of the scenario.
    pub fn battery_mv(&self) -> u16 {
        self.measured_mv.unwrap_or_else(|| {
            let drop_mv = (FULL_MV - LOW_MV) * self.flown_ms / FLIGHT_TIME_MS;
            let left_mv = FULL_MV.saturating_sub(drop_mv).max(FLAT_MV);
            u16::try_from(left_mv).expect("a full battery has 4150 mV")
        })
    }

    /// Returns the time that `show` writes before the value, in ms since `start`.
    pub fn stopwatch(&self, now_ms: u64) -> Vec<Piece> {
        match self.started_ms {
            Some(start_ms) => {
                vec![Piece::Int((now_ms - start_ms) as i32), Piece::Text(b" ".to_vec())]
            }
            None => Vec::new(),
        }
    }

    /// Starts the stopwatch. One that runs starts again only if `restarts` is true.
    pub fn start_stopwatch(&mut self, now_ms: u64, restarts: bool) {
        if restarts || self.started_ms.is_none() {
            self.started_ms = Some(now_ms);
        }
    }

    fn measure_battery(&mut self, io: &mut Io<'_>) {
        self.measured_mv = io.controls::<FlightControls>().map(|controls| controls.battery_mv);
    }

    /// Passes the positions of neighbors on, as the frames of their messages show them.
    fn report_peers(
        pilot: &mut Pilot,
        peers: &[(u16, Vec3)],
        aircraft: &mut dyn Aircraft,
        now_ms: u64,
    ) {
        let here_m = aircraft.status().state.position_m;
        for (id, way_m) in peers {
            // The filter refuses frames of the robot's own id and positions that are not finite.
            let report = PeerReport {
                id: *id,
                position_m: here_m + *way_m,
                velocity_m_s: None,
                measured_at_ms: (now_ms as u32).wrapping_sub(FRAME_AGE_MS),
            };
            let _ = pilot.update_peer(report, aircraft);
        }
    }

    /// Moves a kinematic body.
    fn steer(&mut self, io: &mut Io<'_>) {
        let Some(planned) = &mut self.planned else { return };
        let heading = io.sensors.estimate().map_or(0.0, |here| here.heading);
        let command = planned.steer(self.lag_s, TICK_S).map(|command| {
            let BodyVelocity { velocity_m_s, yaw_rate_rad_s } = command;
            let (sine, cosine) = libm::sincosf(heading);
            let velocity_mm_s = velocity_m_s * 1000.0;
            Velocity {
                forward: velocity_mm_s.x * cosine + velocity_mm_s.y * sine,
                left: velocity_mm_s.y * cosine - velocity_mm_s.x * sine,
                up: velocity_mm_s.z,
                turn: yaw_rate_rad_s,
            }
        });
        if command.is_some() {
            self.flown_ms += u64::from(TICK_US / 1000);
        }
        let flight = command.map_or(Flight::Off, Flight::Velocity);
        *io.controls().expect("a body without a flight controller follows a velocity") = flight;
    }
}

/// Returns the settings with the walls of the world, from which a robot keeps its distance. In a world that
/// is too small for it, it stays in the middle.
fn within_walls(settings: AvoidanceSettings, sensors: &Sensors<'_>) -> AvoidanceSettings {
    let area = sensors.area();
    let half = [area.width, area.height].map(|side| {
        let reach_m = side / 2000.0 - settings.radius_m;
        reach_m.max(MIDDLE_M)
    });
    let most = Vec3::new(half[0], half[1], f32::INFINITY);
    AvoidanceSettings { lowest_m: -most, highest_m: most, ..settings }
}

/// Half of the middle in m in which a robot stays that has no room.
const MIDDLE_M: f32 = 0.001;

/// Returns the obstacles of the world that do not move, as on the robot's map.
fn obstacles<'a>(sensors: &Sensors<'a>) -> impl Iterator<Item = Obstacle> + use<'a> {
    sensors.obstacles().map(|(obstacle, height_mm)| column(obstacle, height_mm))
}

/// Returns an obstacle of the world as the avoidance knows it.
fn column(obstacle: &engine::Obstacle, height_mm: f32) -> Obstacle {
    let meters = |x: f32, y: f32| Vec2::new(x, y) / 1000.0;
    let top_m = height_mm / 1000.0;
    match *obstacle {
        engine::Obstacle::Round { x, y, radius } => {
            Obstacle::round(meters(x, y), radius / 1000.0, top_m)
        }
        engine::Obstacle::Box { x, y, width, height } => Obstacle {
            half_m: meters(width, height) / 2.0,
            ..Obstacle::round(meters(x, y), 0.0, top_m)
        },
        engine::Obstacle::TurnedBox { x, y, width, height, along } => Obstacle {
            along: Vec2::from(along).normalize_or(Vec2::X),
            half_m: meters(width, height) / 2.0,
            ..Obstacle::round(meters(x, y), 0.0, top_m)
        },
        engine::Obstacle::Segment { from, to } => {
            let (from, to) = (meters(from.0, from.1), meters(to.0, to.1));
            Obstacle {
                along: (to - from).normalize_or(Vec2::X),
                half_m: Vec2::new(from.distance(to) / 2.0, 0.0),
                ..Obstacle::round(from.midpoint(to), 0.0, top_m)
            }
        }
    }
}

/// Returns the ids of the neighbors whose frames arrived, and the way to each in m.
fn heard_peers(io: &Io<'_>) -> Vec<(u16, Vec3)> {
    let Some(here) = io.sensors.estimate() else { return Vec::new() };
    let frames = io.inbox.iter().filter_map(|frame| {
        let [distance, azimuth, elevation] = frame.sighting.place()?;
        let (sine, cosine) = libm::sincosf(azimuth + here.heading);
        let (rise, flat) = libm::sincosf(elevation);
        let way_m = Vec3::new(flat * cosine, flat * sine, rise) * (distance / 1000.0);
        Some((frame.sighting.robot?.0, way_m))
    });
    frames.collect()
}

/// Returns the log line of a call that the pilot refused.
fn refusal_text(function: PilotFunction, reason: PilotRefusal) -> String {
    let remedy = match reason {
        PilotRefusal::NotArmed => {
            "; `armed = true` in [body.crazyflie] or in the `model` of its group arms it"
        }
        PilotRefusal::Ended(_) => "; the event `restart` does that",
        _ => "",
    };
    format!("{}: {reason}{remedy}", function.name())
}

impl Autopilot for CrazyflieAutopilot {
    fn copy(&self) -> Box<dyn Autopilot> {
        Box::new(self.clone())
    }

    fn tick(&mut self, io: &mut Io<'_>, battery_mv: Option<u16>) {
        if let Some(controls) = io.controls::<FlightControls>() {
            controls.battery_setting_mv = battery_mv;
            controls.pose_error = self.pose_error;
        }
        self.measure_battery(io);
        // A planned aircraft without avoidance has no use for them.
        self.pilot.set_obstacles(obstacles(&io.sensors));
        let uses_peers = self.planned.is_none() || self.pilot.has_avoidance();
        let peers = if uses_peers { heard_peers(io) } else { Vec::new() };
        self.act(io, battery_mv, |pilot, aircraft, moment| {
            Self::report_peers(pilot, &peers, aircraft, moment.now_ms);
            pilot.tick(aircraft, moment);
        });
        self.steer(io);
    }

    fn battery_mv(&self, _: u64) -> Option<u16> {
        Some(CrazyflieAutopilot::battery_mv(self))
    }

    fn set_pose_error(&mut self, error: PoseError) {
        self.pose_error = error;
    }

    fn give_up(&mut self, _: &mut Io<'_>) {
        self.pilot.set_script_fault(true);
    }

    fn start(&mut self) {
        self.started_ms = None;
        self.pilot.set_script_fault(false);
    }

    fn adopt(&mut self, before: &dyn Any) {
        let before = before.downcast_ref::<CrazyflieAutopilot>().expect("a robot keeps its model");
        self.flown_ms = before.flown_ms;
    }
}
