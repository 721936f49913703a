//! Functions of the Crazyflie, and the pilot that carries them out between two calls.

use std::any::Any;

use bittybuzz_arena::engine::{Io, Pose, Side, wrap};
use bittybuzz_arena::robot::{Autopilot, Call, CallNumbers, Done, Effect, Piece, led};
use bittybuzz_robot_spec::Function;

use crate::{Flight, Velocity};

/// mm/s of take-off, landing and flights to a place, as robots/crazyflie/robot.toml says.
const SPEED: f32 = 500.0;
/// mm/s of `forward`.
const CRUISE: f32 = 200.0;
/// Degrees per second of `left` and `right`.
const TURN: f32 = 45.0;
/// mm at which it has arrived.
const ARRIVED: f32 = 50.0;
/// The value of `get_*` when nothing is in range. The world has no ceiling.
const OUT_OF_RANGE: i32 = 32_767;
/// Most time of `goTo`, and of functions without an end of their own, in ms.
const PATIENCE: u64 = 3000;
/// Time that `spin` takes, in ms.
const SPIN: u64 = 1500;
/// mV of a full battery, of a low one, and the ms of flight between them: 7 minutes, Bitcraze's data sheet of the 2.1.
const FULL: u64 = 4150;
const LOW: u64 = 3200;
const FLIGHT_TIME: u64 = 420_000;
/// mV below which the motors lose power after some ms, as in the firmware (firmware/crazyflie/src/battery.rs).
const EMPTY: u64 = 3100;
const EMPTY_TIME: u64 = 5000;
/// mV at which the nRF51 cuts all power.
const FLAT: u64 = 3000;

/// The task of the robot until the next call.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Task {
    /// Stand.
    #[default]
    Grounded,
    /// Fly so fast in its own frame, at a height.
    Cruise { forward: f32, left: f32, turn: f32, height: f32, climb: f32 },
    /// Fly to a place, and look along x if asked.
    Goal { to: [f32; 3], faces_x: bool },
}

/// Flies as the last call wants it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pilot {
    task: Task,
    /// Height of take-off in mm.
    height: f32,
    /// ms at which the running function ends.
    deadline: u64,
    /// ms of flight.
    flown: u64,
    /// ms since which the battery is empty.
    empty_since: Option<u64>,
    /// ms at which the stopwatch was started.
    started: Option<u64>,
    /// A fault has stopped the script, and the robot lands; or the battery is empty, and it falls. It does not take off before it is
    /// switched off and on.
    has_given_up: bool,
}

impl Pilot {
    /// Returns the command for the flight controller.
    fn fly(&mut self, here: Option<Pose>, now: u64) -> Flight {
        if self.has_given_up && self.is_down(here, now) {
            self.task = Task::Grounded;
        }
        let z = here.map_or(self.height, |here| here.z);
        let climb_to = |height: f32, most: f32| ((height - z) * 2.0).clamp(-most, most);
        let velocity = match self.task {
            Task::Grounded => return Flight::Off,
            Task::Cruise { forward, left, turn, height, climb } => {
                Velocity { forward, left, up: climb_to(height, climb), turn: turn.to_radians() }
            }
            Task::Goal { to: [x, y, height], faces_x } => {
                let Some(here) = here else { return Flight::Velocity(Velocity::default()) };
                let (dx, dy) = (x - here.x, y - here.y);
                let distance = libm::hypotf(dx, dy);
                // A second from the goal it begins to slow down.
                let share = if distance > 0.0 { distance.min(SPEED) / distance } else { 0.0 };
                let (sine, cosine) = (libm::sinf(here.heading), libm::cosf(here.heading));
                Velocity {
                    forward: (dx * cosine + dy * sine) * share,
                    left: (dy * cosine - dx * sine) * share,
                    up: climb_to(height, SPEED),
                    turn: if faces_x { wrap(-here.heading) } else { 0.0 },
                }
            }
        };
        self.flown += 100;
        Flight::Velocity(velocity)
    }

    /// The time that `show` writes before the value: ms since `start`.
    fn stopwatch(&self, now: u64) -> Vec<Piece> {
        match self.started {
            Some(start) => {
                vec![Piece::Int((now - start) as i32), Piece::Text(b" ".to_vec())]
            }
            None => Vec::new(),
        }
    }

    fn cruise(&mut self, forward: f32, left: f32, turn: f32) -> Done {
        // On the ground there is no height to fly at.
        if self.task != Task::Grounded {
            let height = self.height;
            self.task = Task::Cruise { forward, left, turn, height, climb: SPEED };
        }
        Done::Nil
    }

    /// Begins to land.
    fn descend(&mut self, here: Option<Pose>, now: u64, speed: f32) {
        let height = here.map_or(self.height, |here| here.z);
        self.deadline = now + (height / speed * 1000.0) as u64 + PATIENCE;
        self.climb(-ARRIVED, speed);
    }

    /// Returns true when it has landed, or had the time to.
    fn is_down(&self, here: Option<Pose>, now: u64) -> bool {
        here.is_none_or(|here| here.z < 10.0) || now >= self.deadline
    }

    fn climb(&mut self, height: f32, climb: f32) {
        self.task = Task::Cruise { forward: 0.0, left: 0.0, turn: 0.0, height, climb };
    }

    /// Returns the voltage of the battery in mV.
    fn battery(&self) -> u64 {
        FULL.saturating_sub((FULL - LOW) * self.flown / FLIGHT_TIME).max(FLAT)
    }

    /// Takes the motors' power when the battery is empty.
    fn watch_battery(&mut self, battery_mv: Option<u16>, now: u64) {
        if battery_mv.map_or_else(|| self.battery(), u64::from) >= EMPTY {
            self.empty_since = None;
        } else if now >= *self.empty_since.get_or_insert(now) + EMPTY_TIME {
            self.has_given_up = true;
            self.task = Task::Grounded;
        }
    }
}

impl Autopilot for Pilot {
    fn copy(&self) -> Box<dyn Autopilot> {
        Box::new(*self)
    }

    fn tick(&mut self, io: &mut Io<'_>, battery_mv: Option<u16>) {
        let (now, here) = (io.milliseconds(), io.sensors.estimate());
        self.watch_battery(battery_mv, now);
        if let Some(flight) = io.controls() {
            *flight = self.fly(here, now);
        }
    }

    fn battery_mv(&self, _: u64) -> Option<u16> {
        u16::try_from(self.battery()).ok()
    }

    /// Lands for good.
    fn give_up(&mut self, io: &mut Io<'_>) {
        self.has_given_up = true;
        if self.task != Task::Grounded {
            self.descend(io.sensors.estimate(), io.milliseconds(), SPEED);
        }
    }

    fn start(&mut self) {
        self.started = None;
    }

    fn adopt(&mut self, before: &dyn Any) {
        if let Some(before) = before.downcast_ref::<Pilot>() {
            self.flown = before.flown;
        }
    }
}

/// Returns the effect of a function of the Crazyflie alone.
pub fn effect(function: &Function) -> Option<Effect> {
    let cruise = |forward: f32, turn: f32| -> Effect {
        Box::new(move |call| fly(call, Done::Nil, |pilot, _| pilot.cruise(forward, 0.0, turn)))
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
            fly(call, Done::Nil, |pilot, Moment { numbers, .. }| {
                pilot.height = numbers.float(0);
                pilot.climb(pilot.height, SPEED);
                Done::Nil
            })
        }),
        "spin" => Box::new(|call| fly(call, Done::Nil, spin)),
        "goTo" => Box::new(|call| fly(call, Done::Int(0), |pilot, at| pilot.go(&at, true))),
        "goto" => Box::new(|call| fly(call, Done::Int(0), |pilot, at| pilot.go(&at, false))),
        "move_toward" => Box::new(|call| {
            fly(call, Done::Nil, |pilot, Moment { numbers, .. }| {
                pilot.cruise(numbers.float(0), numbers.float(1), 0.0)
            })
        }),
        "forward" => cruise(CRUISE, 0.0),
        "left" => cruise(0.0, TURN),
        "right" => cruise(0.0, -TURN),
        "get_up" => Box::new(|_| distance(None)),
        "get_left" => range(Side::Left),
        "get_right" => range(Side::Right),
        "get_front" => range(Side::Front),
        "get_back" => range(Side::Back),
        "get_z" => Box::new(|call| distance(call.io.sensors.estimate().map(|here| here.z as i32))),
        "battery" => Box::new(|call| {
            let set = call.memory.battery_mv.map(i32::from);
            let own = call.autopilot::<Pilot>().map(|pilot| pilot.battery() as i32);
            set.or(own).map_or(Done::Idle, Done::Int)
        }),
        "rand_bbz" => Box::new(|call| Done::Int(call.memory.chance.below(300) as i32 - 150)),
        "show" => Box::new(|call| {
            let now = call.io.milliseconds();
            let time = call.autopilot::<Pilot>().map(|pilot| pilot.stopwatch(now));
            call.log(time.unwrap_or_default());
            Done::Nil
        }),
        "start" => Box::new(|call| start(call, |started, now| started.or(Some(now)))),
        "go" => Box::new(|call| start(call, |_, now| Some(now))),
        _ => return None,
    })
}

/// The time of a call, and the robot's state then.
#[derive(Clone, Copy)]
struct Moment<'a> {
    /// ms
    now: u64,
    here: Option<Pose>,
    numbers: CallNumbers<'a>,
    again: bool,
}

impl<'a> Moment<'a> {
    fn new(call: &Call<'a, '_>) -> Self {
        let (now, here) = (call.io.milliseconds(), call.io.sensors.estimate());
        Moment { now, here, numbers: call.numbers, again: call.again }
    }
}

/// Lets the pilot act; returns `grounded` if it has given up.
fn fly(
    call: &mut Call<'_, '_>,
    grounded: Done,
    act: impl FnOnce(&mut Pilot, Moment<'_>) -> Done,
) -> Done {
    let moment = Moment::new(call);
    match call.autopilot::<Pilot>() {
        Some(pilot) if pilot.has_given_up => grounded,
        Some(pilot) => act(pilot, moment),
        None => Done::Idle,
    }
}

/// `led(c, on)`: c 0 red, else green.
fn set_led(call: &mut Call<'_, '_>) -> Done {
    let numbers = call.numbers;
    if numbers.count() != 2 {
        return led(call);
    }
    let bit = if numbers.int(0) == 0 { 1 } else { 2 };
    let led = &mut *call.io.led;
    *led = if numbers.int(1) == 0 { *led & !bit } else { *led | bit };
    Done::Nil
}

fn take_off(call: &mut Call<'_, '_>) -> Done {
    let height = call.numbers.float(0);
    if height <= 0.0 {
        return Done::OutOfRange;
    }
    fly(call, Done::Nil, |pilot, Moment { now, here, numbers, again }| {
        if !again {
            let speed = pace(height, &numbers);
            pilot.height = height;
            pilot.deadline = now + (height / speed * 1000.0) as u64 + PATIENCE;
            pilot.climb(height, speed);
        }
        let is_there = here.is_none_or(|here| (here.z - height).abs() < ARRIVED);
        if is_there || now >= pilot.deadline { Done::Nil } else { Done::Wait }
    })
}

fn land(call: &mut Call<'_, '_>) -> Done {
    let Moment { now, here, numbers, again } = Moment::new(call);
    let Some(pilot) = call.autopilot::<Pilot>() else { return Done::Idle };
    if !again && pilot.task != Task::Grounded && !pilot.has_given_up {
        let speed = if numbers.count() == 2 { pace(numbers.float(0), &numbers) } else { SPEED };
        pilot.descend(here, now, speed);
    }
    if pilot.task != Task::Grounded && !pilot.is_down(here, now) {
        return Done::Wait;
    }
    pilot.task = Task::Grounded;
    Done::Nil
}

/// Spins clockwise seen from above.
fn spin(pilot: &mut Pilot, Moment { now, numbers, again, .. }: Moment<'_>) -> Done {
    let height = numbers.float(0);
    if !again {
        pilot.deadline = now + SPIN;
        pilot.height = height;
        let turn = -numbers.float(1);
        pilot.task = Task::Cruise { forward: 0.0, left: 0.0, turn, height, climb: SPEED };
    }
    if now < pilot.deadline {
        return Done::Wait;
    }
    pilot.climb(height, SPEED);
    Done::Nil
}

impl Pilot {
    /// Flies to a place. `goTo` looks along x and waits until the robot is there, `goto` does neither.
    fn go(&mut self, at: &Moment<'_>, is_waiting: bool) -> Done {
        let Moment { now, here, numbers, again } = *at;
        let height = if numbers.count() == 3 { numbers.float(2) } else { self.height };
        let to = [numbers.float(0), numbers.float(1), height];
        if !again {
            self.deadline = now + PATIENCE;
            self.height = height;
            self.task = Task::Goal { to, faces_x: is_waiting };
        }
        let Some(here) = here else { return Done::Int(0) };
        let distance = libm::hypotf(libm::hypotf(to[0] - here.x, to[1] - here.y), to[2] - here.z);
        if distance < ARRIVED {
            return Done::Int(1);
        }
        if !is_waiting || now >= self.deadline { Done::Int(0) } else { Done::Wait }
    }
}

/// Starts the stopwatch.
fn start(call: &mut Call<'_, '_>, from: impl FnOnce(Option<u64>, u64) -> Option<u64>) -> Done {
    let now = call.io.milliseconds();
    if let Some(pilot) = call.autopilot::<Pilot>() {
        pilot.started = from(pilot.started, now);
    }
    Done::Nil
}

/// Returns mm as the robot's functions do.
fn distance(mm: Option<i32>) -> Done {
    Done::Int(mm.unwrap_or(OUT_OF_RANGE))
}

/// Returns mm/s for a height in a number of steps of 100 ms, if the call has that number.
fn pace(height: f32, numbers: &CallNumbers<'_>) -> f32 {
    match numbers.int(1) {
        steps if numbers.count() == 2 && steps > 0 => (height / (steps as f32 * 0.1)).max(1.0),
        _ => SPEED,
    }
}
