//! Flights of a simulated quadrotor, in which the work of its flight controller is marked.
//!
//! # Principles
//! 1. **The loop is closed.** A simulated quadrotor follows the duties of the motors, and its sensors
//!    are noisy, so the controller takes the branches of normal flight.
//! 2. **The program does not count.** It [marks](bittybuzz_bench::Mark) the begin of each [`FlightTask`]
//!    and its end; a debugger counts. Marks have a cost, so the first measurement is of
//!    an empty section. The simulation is outside of the marks.
//! 3. **A flight is the same every time**: noise comes from a fixed seed.
//!
//! # Flights
//! A robot stands still until it is calibrated. A person arms it, and its script calls functions of
//! the robot file: it takes off, flies with changing velocities, and falls silent, so that the
//! supervisor lands it. Ten other robots report their positions ten times per second, near enough
//! that the collision avoidance of the [pilot](bittybuzz_flight::pilot) limits the velocity.
//!
//! As in a Crazyflie's firmware, commands and plans are made on a copy of the controller
//! ([`FlightStack::plan_elsewhere`]), from which the controller takes them between two ticks.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod drone;

use bittybuzz_bench::{Mark, Meter};
use bittybuzz_flight::avoidance::{
    Avoidance, AvoidanceSettings, OBSTACLES_MAX, Obstacle, PeerReport,
};
use bittybuzz_flight::pilot::{
    PEERS, Pilot, PilotAnswer, PilotFunction, PilotMoment, PilotSettings,
};
use bittybuzz_flight::stack::{COPY_TICKS, FlightStack, StackSettings};
use bittybuzz_flight::{MotorDuties, Vec2, Vec3};

use drone::SimpleDrone;

/// Name of the place in the program into which the harness writes the number of
/// [`FlightSensors`].
pub const SENSORS_SYMBOL: &str = "FLIGHT_SENSORS";

/// Duration of the measured flight in ticks of 1 ms; it ends during the landing.
pub const FLIGHT_TICKS: u32 = 5800;
/// First tick of the flight's part with changing velocities.
pub const CRUISE_FROM: u32 = 3000;
/// First tick after that part.
pub const CRUISE_UNTIL: u32 = 5000;

/// Ticks before the take-off, in which the robot is calibrated.
const REST_TICKS: u32 = 800;
/// Tick from which on no command arrives, so that the supervisor lands the robot.
const LAST_COMMAND: u32 = CRUISE_UNTIL;
/// Ticks between two steps of the script, and between two reports of each other robot.
const COMMAND_TICKS: u32 = 100;
/// Ticks between two poses, and between two readings of the flow sensor.
const POSE_TICKS: u32 = 10;
/// Ticks between two distances to the ground.
const RANGE_TICKS: u32 = 33;
/// Voltage of the battery in V.
const BATTERY_V: f32 = 3.8;
/// Height of the take-off in mm. The planner's shortest time for it is 1.75 s.
const TAKE_OFF_MM: f32 = 400.0;
/// Distance in m of the other robots from the start, horizontally.
const RING_M: f32 = 1.1;
/// Places in m of columns around the flight.
const COLUMNS_M: [[f32; 2]; OBSTACLES_MAX] = [
    [2.0, 0.0],
    [2.0, 2.0],
    [0.0, 2.0],
    [-2.0, 2.0],
    [-2.0, 0.0],
    [-2.0, -2.0],
    [0.0, -2.0],
    [2.0, -2.0],
];

/// The sensors of position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlightSensors {
    /// Poses from outside, 100 per second.
    Pose = 0,
    /// A Flow deck: flow 100 times per second and the distance to the ground 30 times per second.
    Deck = 1,
}

/// A marked task of the flight controller; the value of the mark [`Mark::Begin`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FlightTask {
    /// Nothing: the cost of the marks.
    Nothing = 0,
    /// `FlightStack::tick`.
    Tick = 1,
    /// `FlightStack::receive_pose`.
    Pose = 2,
    /// `FlightStack::receive_flow`.
    Flow = 3,
    /// `FlightStack::receive_range`.
    Range = 4,
    /// `Pilot::update_peer`.
    PeerReport = 5,
    /// `Pilot::call` and `Pilot::tick`.
    Command = 6,
    /// `FlightStack::take_commands`, and a new copy of the controller: the last task of each ms.
    HandOver = 7,
    /// `FlightStack::plan_what_is_due` on the copy.
    Plan = 8,
}

impl FlightTask {
    /// All tasks.
    pub const ALL: [FlightTask; 9] = [
        FlightTask::Nothing,
        FlightTask::Tick,
        FlightTask::Pose,
        FlightTask::Flow,
        FlightTask::Range,
        FlightTask::PeerReport,
        FlightTask::Command,
        FlightTask::HandOver,
        FlightTask::Plan,
    ];

    /// Returns true for work on the copy, which a sample of the inertial sensors interrupts.
    #[must_use]
    pub const fn is_elsewhere(self) -> bool {
        matches!(self, FlightTask::PeerReport | FlightTask::Command | FlightTask::Plan)
    }
}

/// The state of a flight. It is created by the program, which has a place for it.
#[derive(Debug)]
pub struct BenchFlight {
    stack: FlightStack,
    /// The controller that takes the commands.
    copy: FlightStack,
    /// The copy has commands that the controller lacks.
    has_commands: bool,
    pilot: Pilot,
    /// The script waits for its take-off.
    is_waiting: bool,
    drone: SimpleDrone,
    sensors: FlightSensors,
    duties: MotorDuties,
    tick: u32,
    /// Largest height so far in m.
    top_m: f32,
}

/// Returns as many columns as count for the avoidance, around the flight.
fn columns() -> impl Iterator<Item = Obstacle> {
    COLUMNS_M.into_iter().map(|place| Obstacle::round(Vec2::from(place), 0.1, 2.0))
}

impl BenchFlight {
    /// Creates a flight of a robot that stands still.
    #[must_use]
    pub fn new(sensors: FlightSensors) -> Self {
        let limits = PilotSettings::CRAZYFLIE.limits;
        let settings = StackSettings { limits, ..StackSettings::CRAZYFLIE_2_1_PLUS };
        let drone = SimpleDrone::new(settings.vehicle);
        let mut pilot = Pilot::new(PilotSettings::CRAZYFLIE);
        pilot.permit(0);
        pilot.set_avoidance(Avoidance::new(0, AvoidanceSettings::CRAZYFLIE));
        pilot.set_obstacles(columns());
        let mut stack = FlightStack::new(settings, &drone.state());
        stack.plan_elsewhere();
        BenchFlight {
            stack,
            copy: stack,
            has_commands: false,
            pilot,
            is_waiting: false,
            drone,
            sensors,
            duties: MotorDuties::default(),
            tick: 0,
            top_m: 0.0,
        }
    }

    /// Flies, and then reports with [`Mark::Integer`] the error of the estimated position at the end of
    /// the cruise in mm, or with [`Mark::Fault`] that the robot was not in flight there.
    pub fn run(&mut self, meter: &mut impl Meter) {
        count(meter, FlightTask::Nothing, || ());
        let mut result = (Mark::Fault, 0);
        while self.tick < FLIGHT_TICKS {
            self.step(meter);
            if self.tick == CRUISE_UNTIL && self.drone.is_airborne() {
                let error = self.stack.state().position_m - self.drone.state().position_m;
                result = (Mark::Integer, (error.length() * 1000.0) as u32);
            }
        }
        meter.mark(result.0, result.1);
    }

    /// Advances by 1 ms.
    fn step(&mut self, meter: &mut impl Meter) {
        self.drone.step(&self.duties, BATTERY_V);
        self.top_m = self.top_m.max(self.drone.state().position_m.z);
        if self.tick < LAST_COMMAND {
            self.command(meter);
        }
        let has_deck = self.sensors == FlightSensors::Deck;
        // A robot with a deck is put on a known place.
        let has_pose = !has_deck || self.tick < REST_TICKS;
        if has_pose && self.tick.is_multiple_of(POSE_TICKS) {
            let pose = self.drone.pose();
            count(meter, FlightTask::Pose, || self.stack.receive_pose(&pose));
        }
        if has_deck && self.tick.is_multiple_of(POSE_TICKS) {
            let flow = self.drone.flow();
            count(meter, FlightTask::Flow, || self.stack.receive_flow(&flow));
        }
        if has_deck && self.tick.is_multiple_of(RANGE_TICKS) {
            let range_m = self.drone.range_m();
            count(meter, FlightTask::Range, || self.stack.receive_range(range_m));
        }
        let sample = self.drone.imu();
        self.duties = count(meter, FlightTask::Tick, || self.stack.tick(Some(&sample), BATTERY_V));
        self.exchange(meter);
        self.tick += 1;
    }

    /// Takes the commands from the copy, renews it, and makes the plans that are due on it.
    fn exchange(&mut self, meter: &mut impl Meter) {
        let is_plan_due = count(meter, FlightTask::HandOver, || {
            if self.has_commands {
                self.stack.take_commands(&self.copy);
            }
            let is_plan_due = self.stack.is_plan_due();
            if self.has_commands || is_plan_due || self.tick.is_multiple_of(COPY_TICKS) {
                self.copy = self.stack;
            }
            is_plan_due
        });
        self.has_commands = is_plan_due;
        if is_plan_due {
            count(meter, FlightTask::Plan, || self.copy.plan_what_is_due());
        }
    }

    /// Passes the reports of other robots on, and lets script and pilot act, when they are due.
    fn command(&mut self, meter: &mut impl Meter) {
        let phase = self.tick % COMMAND_TICKS;
        if let Some(number) = (phase as usize).checked_sub(1).filter(|number| *number < PEERS) {
            let report = peer_report(number, self.tick);
            // A report that is refused would leave the table as it is.
            let _ = count(meter, FlightTask::PeerReport, || {
                self.pilot.update_peer(report, &mut self.copy)
            });
            self.has_commands = true;
        }
        if phase == 0 {
            count(meter, FlightTask::Command, || self.step_script());
            self.has_commands = true;
        }
    }

    /// Executes a step of the script: the function that is due, and what the pilot does then.
    fn step_script(&mut self) {
        let battery_mv = (BATTERY_V * 1000.0) as u16;
        let moment = PilotMoment { now_ms: self.tick.into(), battery_mv };
        let BenchFlight { pilot, copy: stack, is_waiting, .. } = self;
        if self.tick >= CRUISE_FROM {
            let velocity_mm_s = wanted_velocity(self.tick);
            pilot.call(PilotFunction::MoveToward, &velocity_mm_s, false, stack, moment);
        } else if self.tick == REST_TICKS || *is_waiting {
            let take_off = PilotFunction::TakeOff;
            let answer = pilot.call(take_off, &[TAKE_OFF_MM], *is_waiting, stack, moment);
            *is_waiting = answer == PilotAnswer::Waiting;
        }
        pilot.tick(stack, moment);
    }
}

/// Counts a task.
#[inline(always)]
fn count<R>(meter: &mut impl Meter, task: FlightTask, work: impl FnOnce() -> R) -> R {
    meter.mark(Mark::Begin, task as u32);
    let result = work();
    meter.mark(Mark::End, 0);
    result
}

/// Returns the velocity ahead and to the left in mm/s that the script wants: to each side in turn.
fn wanted_velocity(tick: u32) -> [f32; 2] {
    match (tick - CRUISE_FROM) / 500 {
        0 => [500.0, 0.0],
        1 => [0.0, 500.0],
        2 => [-500.0, 0.0],
        _ => [0.0, -500.0],
    }
}

/// Returns the report of one of the other robots, which circle around the start.
fn peer_report(number: usize, tick: u32) -> PeerReport {
    let turn_rad_s = 0.2;
    let angle = number as f32 * 0.628 + turn_rad_s * tick as f32 * 0.001;
    let (sine, cosine) = drone::sine_and_cosine(angle);
    PeerReport {
        id: number as u16 + 1,
        position_m: Vec3::new(RING_M * cosine, RING_M * sine, 0.8),
        velocity_m_s: Some(Vec3::new(-sine, cosine, 0.0) * (RING_M * turn_rad_s)),
        measured_at_ms: tick,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_flight::supervisor::SupervisorStage;
    use std::vec::Vec;

    /// Keeps all marks.
    #[derive(Default)]
    struct Recorder(Vec<(Mark, u32)>);

    impl Meter for Recorder {
        fn mark(&mut self, mark: Mark, value: u32) {
            self.0.push((mark, value));
        }
    }

    fn fly(sensors: FlightSensors) -> (BenchFlight, Vec<(Mark, u32)>) {
        let mut recorder = Recorder::default();
        let mut flight = BenchFlight::new(sensors);
        flight.run(&mut recorder);
        (flight, recorder.0)
    }

    fn times(marks: &[(Mark, u32)], task: FlightTask) -> usize {
        marks.iter().filter(|mark| **mark == (Mark::Begin, task as u32)).count()
    }

    /// The robot takes off to 400 mm, and lands when the script falls silent.
    #[test]
    fn robot_flies_and_lands() {
        for sensors in [FlightSensors::Pose, FlightSensors::Deck] {
            let (mut flight, marks) = fly(sensors);
            let (mark, error_mm) = *marks.last().unwrap();
            assert_eq!(mark, Mark::Integer);
            assert!(error_mm < 300, "{error_mm} mm");
            assert!((0.3..1.0).contains(&flight.top_m), "{} m", flight.top_m);
            assert!(flight.drone.is_airborne());
            // A flight without a position would not be a normal one.
            assert_eq!(flight.stack.stage(), SupervisorStage::Landing, "{sensors:?}");
            for _ in 0..4000 {
                flight.step(&mut Recorder::default());
            }
            assert!(!flight.drone.is_airborne());
        }
    }

    #[test]
    fn every_task_has_its_rate() {
        let (_, marks) = fly(FlightSensors::Pose);
        assert_eq!(times(&marks, FlightTask::Nothing), 1);
        assert_eq!(times(&marks, FlightTask::Tick), FLIGHT_TICKS as usize);
        assert_eq!(times(&marks, FlightTask::Pose), FLIGHT_TICKS as usize / 10);
        assert_eq!(times(&marks, FlightTask::Command), 50);
        assert_eq!(times(&marks, FlightTask::PeerReport), 500);
        let (_, marks) = fly(FlightSensors::Deck);
        assert_eq!(times(&marks, FlightTask::Flow), FLIGHT_TICKS as usize / 10);
        // The plan to land, when the script has fallen silent.
        assert_eq!(times(&marks, FlightTask::Plan), 1);
        // The first range comes in the first tick.
        assert_eq!(times(&marks, FlightTask::Range), FLIGHT_TICKS.div_ceil(33) as usize);
    }
}
