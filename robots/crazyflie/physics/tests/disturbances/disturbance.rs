//! Disturbances, and the flights in which they occur.

use bittybuzz_crazyflie_physics::{DQuat, DVec3};
use bittybuzz_random::Random;

/// A kind of disturbance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisturbanceKind {
    /// Nothing, for comparison.
    Calm,
    /// A force that pushes the robot aside all the time, as a fan does.
    SideForce,
    /// A touch of 10 ms every 2.5 s, as by a finger or a neighbor.
    Bump,
    /// A wind of 2 m/s with gusts of 1 m/s, from the ground on.
    Gusts,
    /// All poses are displaced at once, as by a marker that slips.
    PoseJump,
    /// The room's frame turns about its z axis, as by cameras that are calibrated again.
    FrameTurn,
    /// The markers turn on the robot, so that measured attitudes are wrong by a constant turn.
    MarkerTurn,
    /// Poses arrive later than the flight controller believes, and this changes.
    Latency,
    /// The floor rises or falls below the robot, every 2.5 s.
    FloorStep,
    /// The flow sensor has less noise than usual; every other flight controller assumes it.
    QuietFlow,
    /// A sensor has another noise than the flight controller assumes, by this factor. Noise of more
    /// than twice the assumed one is a fault.
    PoseNoise,
    RangeNoise,
}

use DisturbanceKind::*;

/// The sensors that give the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionSource {
    MotionCapture,
    FlowDeck,
}

/// Kinds with the source of the position, the least and the largest strength.
///
/// The unit is m/s² for forces, m/s for bumps and winds, m for displacements and steps, rad for
/// turns, seconds for latencies, and counts for flow.
pub const CASES: [(DisturbanceKind, PositionSource, f64, f64); 18] = [
    (Calm, PositionSource::MotionCapture, 0.0, 0.0),
    (Calm, PositionSource::FlowDeck, 0.0, 0.0),
    (SideForce, PositionSource::MotionCapture, 0.5, 2.0),
    (Bump, PositionSource::MotionCapture, 0.1, 0.5),
    (Gusts, PositionSource::MotionCapture, 2.0, 2.0),
    (PoseJump, PositionSource::MotionCapture, 0.01, 0.05),
    (FrameTurn, PositionSource::MotionCapture, 0.5 * DEGREE, 3.0 * DEGREE),
    (MarkerTurn, PositionSource::MotionCapture, 0.5 * DEGREE, 3.0 * DEGREE),
    (Latency, PositionSource::MotionCapture, 0.02, 0.06),
    (SideForce, PositionSource::FlowDeck, 0.5, 2.0),
    (Bump, PositionSource::FlowDeck, 0.1, 0.5),
    (Gusts, PositionSource::FlowDeck, 2.0, 2.0),
    (FloorStep, PositionSource::FlowDeck, 0.02, 0.1),
    (FloorStep, PositionSource::FlowDeck, 0.1, 0.3),
    (QuietFlow, PositionSource::FlowDeck, 0.1, 0.5),
    (QuietFlow, PositionSource::FlowDeck, 0.5, 2.0),
    (PoseNoise, PositionSource::MotionCapture, 0.1, 2.0),
    (RangeNoise, PositionSource::FlowDeck, 0.2, 2.0),
];

/// Height of the flight above the first floor in m.
pub const HEIGHT_M: f32 = 0.8;
/// Time in ms of the disturbed flight.
pub const FLIGHT_MS: u64 = 15_000;
/// Time in ms between two legs.
pub const LEG_MS: u64 = 2500;
/// Time in ms of the last step of the floor.
pub const LAST_STEP_MS: u64 = FLIGHT_MS - 2 * LEG_MS;
/// Slow and quick change of the latency, as a share of its mean, and their periods in ms.
const LATENCY_SWAYS: [(f64, f64); 2] = [(0.3, 7000.0), (0.1, 230.0)];
/// Duration of a touch in ms.
const BUMP_MS: u64 = 10;
/// Standard deviation in m/s and time of correlation in s of the gusts.
pub const GUSTS: (f64, f64) = (1.0, 0.8);

/// Effects that act on a robot, its surroundings and its motion capture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effects {
    /// Force per mass of the robot in m/s².
    pub acceleration_m_s2: DVec3,
    pub floor_m: f64,
    /// Turn of the sensors' frame about z, and its displacement afterwards.
    pub frame_turn_rad: f64,
    pub jump_m: DVec3,
    /// Turn of the markers on the robot, along its axis.
    pub marker_turn_rad: DVec3,
    /// Age of poses, if it is not the usual one.
    pub latency_s: Option<f64>,
}

const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// One flight: everything that differs between flights.
#[derive(Clone, Debug)]
pub struct Scenario {
    pub number: usize,
    pub seed: u64,
    /// Index in [`CASES`].
    pub case: usize,
    pub kind: DisturbanceKind,
    pub source: PositionSource,
    pub strength: f64,
    /// The flight controller assumes the noise of a quiet flow sensor.
    pub states_noise: bool,
    /// Course of the disturbance in the world.
    pub course_rad: f64,
    /// Random numbers of the path.
    pub path: Random,
}

impl Scenario {
    /// Returns the flight of this number. Consecutive numbers have different cases.
    pub fn new(number: usize) -> Self {
        let case = number % CASES.len();
        let (kind, source, least, most) = CASES[case];
        let seed = 0xd157_0000 + number as u64;
        let mut random = Random::new(seed);
        let strength = least + (most - least) * random.unit();
        let course_rad = random.unit() * core::f64::consts::TAU;
        let path = Random::new(seed ^ 0x0070_110f);
        let states_noise = (number / CASES.len()).is_multiple_of(2);
        Scenario { number, seed, case, kind, source, strength, states_noise, course_rad, path }
    }

    /// Returns what acts in this millisecond of the flight.
    pub fn effects(&self, ms: u64) -> Effects {
        let mut effects = Effects::default();
        match self.kind {
            SideForce => effects.acceleration_m_s2 = self.along(self.strength),
            Bump => {
                let turned = DQuat::from_rotation_z((ms / LEG_MS) as f64);
                if ms % LEG_MS < BUMP_MS {
                    let acceleration_m_s2 = self.strength / (BUMP_MS as f64 * 1e-3);
                    effects.acceleration_m_s2 = turned * self.along(acceleration_m_s2);
                }
            }
            PoseJump => effects.jump_m = self.along(self.strength),
            FrameTurn => effects.frame_turn_rad = self.strength,
            MarkerTurn => effects.marker_turn_rad = self.along(self.strength),
            Latency => {
                let sway = |(share, period_ms): (f64, f64)| {
                    share * (ms as f64 / period_ms * core::f64::consts::TAU).sin()
                };
                let factor = 1.0 + LATENCY_SWAYS.into_iter().map(sway).sum::<f64>();
                effects.latency_s = Some(self.strength * factor);
            }
            FloorStep => {
                // A step lasts to the end from the last leg but one on. Up first: the robot flies
                // over a mat or a table, and leaves it.
                let is_up = (ms.min(LAST_STEP_MS) / LEG_MS).is_multiple_of(2);
                let sign = if self.course_rad < core::f64::consts::PI { 1.0 } else { -1.0 };
                effects.floor_m = if is_up { sign * self.strength } else { 0.0 };
            }
            Calm | Gusts | QuietFlow | PoseNoise | RangeNoise => {}
        }
        effects
    }

    /// Returns the goal of the next leg: legs out and back, so that the drift does not depend on the
    /// distance to the start.
    pub fn next_goal_m(&mut self) -> [f32; 2] {
        let course = self.path.unit_f32() * core::f32::consts::TAU;
        let length_m = 0.3 + 0.7 * self.path.unit_f32();
        let (sin, cos) = course.sin_cos();
        [cos * length_m, sin * length_m]
    }

    /// Returns a vector of this length along the course.
    pub fn along(&self, length: f64) -> DVec3 {
        DVec3::new(self.course_rad.cos(), self.course_rad.sin(), 0.0) * length
    }
}
