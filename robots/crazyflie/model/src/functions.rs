//! The robot functions of the Crazyflie in the simulator, and the pilot that carries them out
//! between two calls.

use std::any::Any;

use bittybuzz_arena::engine::{Io, Pose, Side, wrap};
use bittybuzz_arena::robot::{Autopilot, CallNumbers, Done, Effect, Piece, RobotCall, led};
use bittybuzz_robot_spec::RobotFunction;

use crate::keep_apart::KeepApart;
use crate::{CrazyflieModel, Flight, FlightControls, Velocity};

/// Speed of take-off, landing and flights to a place, in mm/s (robots/crazyflie/robot.toml).
const SPEED_MM_S: f32 = 500.0;
/// Speed of `forward` in mm/s.
const CRUISE_SPEED_MM_S: f32 = 200.0;
/// Rate of turn of `left` and `right` in degrees per second.
const TURN_RATE_DEG_S: f32 = 45.0;
/// Distance in mm at which a goal is reached.
const ARRIVAL_DISTANCE_MM: f32 = 50.0;
/// The value of `get_*` when nothing is in range. The world has no ceiling.
const OUT_OF_RANGE_MM: i32 = 32_767;
/// Time limit of `goTo`, and the time that take-off and landing may take in addition to their
/// computed duration, in ms.
const EXTRA_TIME_MS: u64 = 3000;
/// Duration of `spin` in ms.
const SPIN_MS: u64 = 1500;
/// Voltages of a full and of a low battery in mV, and the time of flight between them in ms: 7
/// minutes (Bitcraze's data sheet of the 2.1).
const FULL_MV: u64 = 4150;
const LOW_MV: u64 = 3200;
const FLIGHT_TIME_MS: u64 = 420_000;
/// Voltage in mV below which the robot lands, and the time in ms after which this happens. The
/// firmware, which does not fly yet, stops the motors then (firmware/crazyflie/src/battery.rs).
const EMPTY_MV: u64 = 3100;
const EMPTY_TIME_MS: u64 = 5000;
/// Voltage in mV at which the nRF51 cuts all power.
const FLAT_MV: u64 = 3000;

/// The task of the robot until the next call.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum CrazyflieTask {
    /// Stand on the ground.
    #[default]
    Grounded,
    /// Fly with this velocity in the robot's own frame (mm/s, degrees per second), at a height in
    /// mm.
    Cruise { forward: f32, left: f32, turn: f32, height: f32, climb: f32 },
    /// Fly to a position in mm, and turn towards the x axis if `faces_x` is set.
    Goal { to: [f32; 3], faces_x: bool },
}

/// The autopilot, which carries out the last call.
#[derive(Debug, Clone, Default)]
pub struct Pilot {
    /// The collision avoidance, if the robot has it.
    keep_apart: Option<KeepApart>,
    task: CrazyflieTask,
    /// Height of take-off in mm.
    height: f32,
    /// Time in ms at which the running function ends.
    deadline: u64,
    /// Time of flight in ms.
    flown: u64,
    /// Voltage of the battery in mV, if the body has a battery of its own.
    measured_mv: Option<u16>,
    /// Time in ms since which the battery is empty.
    empty_since: Option<u64>,
    /// Time in ms at which the stopwatch was started.
    started: Option<u64>,
    /// True if a fault stopped the script or the battery is empty, so that the robot lands. It does
    /// not take off again before it is switched off and on.
    has_given_up: bool,
}

impl Pilot {
    /// Returns the autopilot of a robot with these parameters.
    pub fn new(model: &CrazyflieModel) -> Self {
        let keep_apart = (model.avoidance > 0.0)
            .then(|| KeepApart::new(model.avoidance, model.speed, model.lag));
        Pilot { keep_apart, ..Pilot::default() }
    }

    /// Returns the command for the flight controller.
    fn fly(&mut self, here: Option<Pose>, now: u64) -> Flight {
        if self.has_given_up && self.is_down(here, now) {
            self.task = CrazyflieTask::Grounded;
        }
        let z = here.map_or(self.height, |here| here.z);
        let climb_to =
            |height_mm: f32, max_mm_s: f32| ((height_mm - z) * 2.0).clamp(-max_mm_s, max_mm_s);
        let velocity = match self.task {
            CrazyflieTask::Grounded => return Flight::Off,
            CrazyflieTask::Cruise { forward, left, turn, height, climb } => {
                Velocity { forward, left, up: climb_to(height, climb), turn: turn.to_radians() }
            }
            CrazyflieTask::Goal { to: [x, y, height], faces_x } => {
                let Some(here) = here else { return Flight::Velocity(Velocity::default()) };
                let (dx, dy) = (x - here.x, y - here.y);
                let distance_mm = libm::hypotf(dx, dy);
                // The robot slows down when it is a second away from the goal.
                let share =
                    if distance_mm > 0.0 { distance_mm.min(SPEED_MM_S) / distance_mm } else { 0.0 };
                let (sine, cosine) = (libm::sinf(here.heading), libm::cosf(here.heading));
                Velocity {
                    forward: (dx * cosine + dy * sine) * share,
                    left: (dy * cosine - dx * sine) * share,
                    up: climb_to(height, SPEED_MM_S),
                    turn: if faces_x { wrap(-here.heading) } else { 0.0 },
                }
            }
        };
        self.flown += 100;
        Flight::Velocity(velocity)
    }

    /// Returns the time that `show` writes before the value, in ms since `start`.
    fn stopwatch(&self, now: u64) -> Vec<Piece> {
        match self.started {
            Some(start) => {
                vec![Piece::Int((now - start) as i32), Piece::Text(b" ".to_vec())]
            }
            None => Vec::new(),
        }
    }

    fn cruise(&mut self, forward_mm_s: f32, left_mm_s: f32, turn_deg_s: f32) -> Done {
        // A robot on the ground has no height to fly at, so it stays there.
        if self.task != CrazyflieTask::Grounded {
            self.task = CrazyflieTask::Cruise {
                forward: forward_mm_s,
                left: left_mm_s,
                turn: turn_deg_s,
                height: self.height,
                climb: SPEED_MM_S,
            };
        }
        Done::Nil
    }

    /// Begins to land.
    fn descend(&mut self, here: Option<Pose>, now: u64, speed_mm_s: f32) {
        let height_mm = here.map_or(self.height, |here| here.z);
        self.deadline = now + (height_mm / speed_mm_s * 1000.0) as u64 + EXTRA_TIME_MS;
        self.climb(-ARRIVAL_DISTANCE_MM, speed_mm_s);
    }

    /// Returns true if the robot has landed, or had enough time to land.
    fn is_down(&self, here: Option<Pose>, now: u64) -> bool {
        here.is_none_or(|here| here.z < 10.0) || now >= self.deadline
    }

    fn climb(&mut self, height_mm: f32, climb_mm_s: f32) {
        self.task = CrazyflieTask::Cruise {
            forward: 0.0,
            left: 0.0,
            turn: 0.0,
            height: height_mm,
            climb: climb_mm_s,
        };
    }

    /// Returns the voltage of the battery in mV.
    fn battery(&self) -> u64 {
        if let Some(measured) = self.measured_mv {
            return measured.into();
        }
        FULL_MV.saturating_sub((FULL_MV - LOW_MV) * self.flown / FLIGHT_TIME_MS).max(FLAT_MV)
    }

    /// Lands when the battery has been empty for `EMPTY_TIME_MS`.
    fn watch_battery(&mut self, here: Option<Pose>, battery_mv: Option<u16>, now: u64) {
        if battery_mv.map_or_else(|| self.battery(), u64::from) >= EMPTY_MV {
            self.empty_since = None;
        } else if now >= *self.empty_since.get_or_insert(now) + EMPTY_TIME_MS && !self.has_given_up
        {
            self.give_up_flight(here, now);
        }
    }

    /// Lands; the robot does not take off again before it is switched off and on.
    fn give_up_flight(&mut self, here: Option<Pose>, now: u64) {
        self.has_given_up = true;
        if self.task != CrazyflieTask::Grounded {
            self.descend(here, now, SPEED_MM_S);
        }
    }
}

impl Autopilot for Pilot {
    fn copy(&self) -> Box<dyn Autopilot> {
        Box::new(self.clone())
    }

    fn tick(&mut self, io: &mut Io<'_>, battery_mv: Option<u16>) {
        let (now, here) = (io.milliseconds(), io.sensors.estimate());
        self.measured_mv = io.controls::<FlightControls>().map(|controls| controls.battery_mv);
        self.watch_battery(here, battery_mv, now);
        let flight = match (self.fly(here, now), &mut self.keep_apart) {
            (Flight::Velocity(wanted), Some(avoidance)) => {
                Flight::Velocity(avoidance.limit(io, wanted))
            }
            (flight, avoidance) => {
                avoidance.iter_mut().for_each(KeepApart::stand);
                flight
            }
        };
        if let Some(controls) = io.controls::<FlightControls>() {
            controls.flight = flight;
            controls.battery_setting_mv = battery_mv;
        } else {
            *io.controls().expect("the pilot flies a Crazyflie's body") = flight;
        }
    }

    fn battery_mv(&self, _: u64) -> Option<u16> {
        Some(u16::try_from(self.battery()).expect("a full battery has 4150 mV"))
    }

    fn give_up(&mut self, io: &mut Io<'_>) {
        self.give_up_flight(io.sensors.estimate(), io.milliseconds());
    }

    fn start(&mut self) {
        self.started = None;
    }

    fn adopt(&mut self, before: &dyn Any) {
        let before = before.downcast_ref::<Pilot>().expect("a robot keeps its model");
        self.flown = before.flown;
    }
}

/// Returns the effect of a function that only the Crazyflie has; `None` for all others.
pub fn effect(function: &RobotFunction) -> Option<Effect> {
    let cruise = |forward_mm_s: f32, turn_deg_s: f32| -> Effect {
        Box::new(move |call| {
            fly(call, Done::Nil, |pilot, _| pilot.cruise(forward_mm_s, 0.0, turn_deg_s))
        })
    };
    let range = |side: Side| -> Effect {
        Box::new(move |call| distance(call.io.sensors.range(side).map(|mm| mm as i32)))
    };
    Some(match function.name.as_str() {
        "led" => Box::new(set_led),
        "set_motor" => Box::new(|call| match (call.numbers.int(0), call.numbers.int(1)) {
            (0..=3, 0..=255) => Done::Nil,
            _ => Done::OutOfRange,
        }),
        "takeoff" => Box::new(take_off),
        "land" => Box::new(land),
        "hover" => Box::new(|call| {
            fly(call, Done::Nil, |pilot, CallMoment { numbers, .. }| {
                pilot.height = numbers.float(0);
                pilot.climb(pilot.height, SPEED_MM_S);
                Done::Nil
            })
        }),
        "spin" => Box::new(|call| fly(call, Done::Nil, spin)),
        "goTo" => Box::new(|call| fly(call, Done::Int(0), |pilot, at| pilot.go(&at, true))),
        "goto" => Box::new(|call| fly(call, Done::Int(0), |pilot, at| pilot.go(&at, false))),
        "move_toward" => Box::new(|call| {
            fly(call, Done::Nil, |pilot, CallMoment { numbers, .. }| {
                pilot.cruise(numbers.float(0), numbers.float(1), 0.0)
            })
        }),
        "forward" => cruise(CRUISE_SPEED_MM_S, 0.0),
        "left" => cruise(0.0, TURN_RATE_DEG_S),
        "right" => cruise(0.0, -TURN_RATE_DEG_S),
        "get_up" => Box::new(|_| distance(None)),
        "get_left" => range(Side::Left),
        "get_right" => range(Side::Right),
        "get_front" => range(Side::Front),
        "get_back" => range(Side::Back),
        "get_z" => Box::new(|call| distance(call.io.sensors.estimate().map(|here| here.z as i32))),
        "battery" => Box::new(|call| {
            let set = call.memory.battery_mv.map(i32::from);
            Done::Int(set.unwrap_or_else(|| pilot(call).battery() as i32))
        }),
        "rand_bbz" => Box::new(|call| Done::Int(call.memory.chance.below(300) as i32 - 150)),
        "show" => Box::new(|call| {
            let now = call.io.milliseconds();
            let time = pilot(call).stopwatch(now);
            call.log(time);
            Done::Nil
        }),
        "start" => Box::new(|call| start(call, |started, now| started.or(Some(now)))),
        "go" => Box::new(|call| start(call, |_, now| Some(now))),
        _ => return None,
    })
}

/// The time and the arguments of a call, and the robot's pose then.
#[derive(Clone, Copy)]
struct CallMoment<'a> {
    /// Time in ms.
    now: u64,
    here: Option<Pose>,
    numbers: CallNumbers<'a>,
    again: bool,
}

impl<'a> CallMoment<'a> {
    fn new(call: &RobotCall<'a, '_>) -> Self {
        let (now, here) = (call.io.milliseconds(), call.io.sensors.estimate());
        CallMoment { now, here, numbers: call.numbers, again: call.again }
    }
}

/// Returns the pilot of the robot that calls.
fn pilot<'a>(call: &'a mut RobotCall<'_, '_>) -> &'a mut Pilot {
    call.autopilot().expect("a Crazyflie's functions run with its pilot")
}

/// Lets the pilot act; returns `grounded` if it has given up.
fn fly(
    call: &mut RobotCall<'_, '_>,
    grounded: Done,
    act: impl FnOnce(&mut Pilot, CallMoment<'_>) -> Done,
) -> Done {
    let moment = CallMoment::new(call);
    let pilot = pilot(call);
    if pilot.has_given_up { grounded } else { act(pilot, moment) }
}

/// Sets a LED for `led(c, on)`: the red one if c is 0, otherwise the green one.
fn set_led(call: &mut RobotCall<'_, '_>) -> Done {
    let numbers = call.numbers;
    if numbers.count() != 2 {
        return led(call);
    }
    let bit = if numbers.int(0) == 0 { 1 } else { 2 };
    let led = &mut *call.io.led;
    *led = if numbers.int(1) == 0 { *led & !bit } else { *led | bit };
    Done::Nil
}

fn take_off(call: &mut RobotCall<'_, '_>) -> Done {
    let height_mm = call.numbers.float(0);
    if height_mm <= 0.0 {
        return Done::OutOfRange;
    }
    fly(call, Done::Nil, |pilot, CallMoment { now, here, numbers, again }| {
        if !again {
            let speed_mm_s = pace(height_mm, &numbers);
            pilot.height = height_mm;
            pilot.deadline = now + (height_mm / speed_mm_s * 1000.0) as u64 + EXTRA_TIME_MS;
            pilot.climb(height_mm, speed_mm_s);
        }
        let is_there = here.is_none_or(|here| (here.z - height_mm).abs() < ARRIVAL_DISTANCE_MM);
        if is_there || now >= pilot.deadline { Done::Nil } else { Done::Wait }
    })
}

fn land(call: &mut RobotCall<'_, '_>) -> Done {
    let CallMoment { now, here, numbers, again } = CallMoment::new(call);
    let pilot = pilot(call);
    if !again && pilot.task != CrazyflieTask::Grounded && !pilot.has_given_up {
        let speed_mm_s =
            if numbers.count() == 2 { pace(numbers.float(0), &numbers) } else { SPEED_MM_S };
        pilot.descend(here, now, speed_mm_s);
    }
    if pilot.task != CrazyflieTask::Grounded && !pilot.is_down(here, now) {
        return Done::Wait;
    }
    pilot.task = CrazyflieTask::Grounded;
    Done::Nil
}

/// Spins clockwise seen from above.
fn spin(pilot: &mut Pilot, CallMoment { now, numbers, again, .. }: CallMoment<'_>) -> Done {
    let height = numbers.float(0);
    if !again {
        pilot.deadline = now + SPIN_MS;
        pilot.height = height;
        let turn = -numbers.float(1);
        pilot.task =
            CrazyflieTask::Cruise { forward: 0.0, left: 0.0, turn, height, climb: SPEED_MM_S };
    }
    if now < pilot.deadline {
        return Done::Wait;
    }
    pilot.climb(height, SPEED_MM_S);
    Done::Nil
}

impl Pilot {
    /// Flies to a place. `goTo` turns towards the x axis and waits until the robot has arrived;
    /// `goto` does neither.
    fn go(&mut self, at: &CallMoment<'_>, is_waiting: bool) -> Done {
        let CallMoment { now, here, numbers, again } = *at;
        let height = if numbers.count() == 3 { numbers.float(2) } else { self.height };
        let to = [numbers.float(0), numbers.float(1), height];
        if !again {
            self.deadline = now + EXTRA_TIME_MS;
            self.height = height;
            self.task = CrazyflieTask::Goal { to, faces_x: is_waiting };
        }
        let Some(here) = here else { return Done::Int(0) };
        let distance_mm =
            libm::hypotf(libm::hypotf(to[0] - here.x, to[1] - here.y), to[2] - here.z);
        if distance_mm < ARRIVAL_DISTANCE_MM {
            return Done::Int(1);
        }
        if !is_waiting || now >= self.deadline { Done::Int(0) } else { Done::Wait }
    }
}

/// Starts the stopwatch.
fn start(call: &mut RobotCall<'_, '_>, from: impl FnOnce(Option<u64>, u64) -> Option<u64>) -> Done {
    let now = call.io.milliseconds();
    let pilot = pilot(call);
    pilot.started = from(pilot.started, now);
    Done::Nil
}

/// Returns a distance in mm as the robot's functions do: `OUT_OF_RANGE_MM` for `None`.
fn distance(mm: Option<i32>) -> Done {
    Done::Int(mm.unwrap_or(OUT_OF_RANGE_MM))
}

/// Returns the speed in mm/s for a height, from the number of steps of 100 ms in the second
/// argument; `SPEED_MM_S` without such a number.
fn pace(height_mm: f32, numbers: &CallNumbers<'_>) -> f32 {
    match numbers.int(1) {
        steps if numbers.count() == 2 && steps > 0 => (height_mm / (steps as f32 * 0.1)).max(1.0),
        _ => SPEED_MM_S,
    }
}
