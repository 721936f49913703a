//! Functions of the Crazyflie, and the pilot that carries them out between two calls.

use bittybuzz_vm_core::hash::name_hash;

use crate::engine::{Pose, Side, wrap};
use crate::robots::crazyflie::{Flight, Velocity};

use super::call::{Done, Numbers};
use super::log::Piece;
use super::platform::Deck;

/// mm/s of take-off, landing and flights to a place, as robots/crazyflie/robot.toml says.
const SPEED: f32 = 500.0;
/// mm/s of `forward`.
const CRUISE: f32 = 200.0;
/// Degrees per second of `left` and `right`.
const TURN: f32 = 45.0;
/// mm at which it has arrived.
const ARRIVED: f32 = 50.0;
/// What `get_*` return when nothing is in range. The world has no ceiling.
const OUT_OF_RANGE: i32 = 32_767;
/// How long `goTo` and what has no end of its own may take, in ms.
const PATIENCE: u64 = 3000;
/// How long `spin` takes, in ms.
const SPIN: u64 = 1500;
/// mV of a full battery, of an empty one, and the ms of flight between them: 7 minutes, Bitcraze's data sheet of the 2.1.
const FULL: u64 = 4150;
const EMPTY: u64 = 3200;
const FLIGHT_TIME: u64 = 420_000;

/// What the robot is told to do until the next call.
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
    /// ms at which the stopwatch was started.
    started: Option<u64>,
    /// A fault has stopped the script: the robot lands, and does not take off before it is switched off and on.
    has_given_up: bool,
}

impl Pilot {
    /// What the flight controller is to be told now.
    pub fn fly(&mut self, here: Option<Pose>, now: u64) -> Flight {
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
    pub fn stopwatch(&self, now: u64) -> Vec<Piece> {
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

    /// Lands for good.
    pub fn give_up(&mut self, here: Option<Pose>, now: u64) {
        self.has_given_up = true;
        if self.task != Task::Grounded {
            self.descend(here, now, SPEED);
        }
    }

    /// The script starts again.
    pub fn start(&mut self) {
        self.started = None;
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

    fn battery(&self) -> i32 {
        (FULL - (FULL - EMPTY) * self.flown.min(FLIGHT_TIME) / FLIGHT_TIME) as i32
    }
}

pub fn call(deck: &mut Deck<'_, '_, '_>, hash: u16, numbers: &Numbers, again: bool) -> Done {
    const LED: u16 = name_hash("led");
    const SET_MOTOR: u16 = name_hash("set_motor");
    const TAKEOFF: u16 = name_hash("takeoff");
    const LAND: u16 = name_hash("land");
    const HOVER: u16 = name_hash("hover");
    const SPIN_AT: u16 = name_hash("spin");
    const GO_TO: u16 = name_hash("goTo");
    const GOTO: u16 = name_hash("goto");
    const MOVE_TOWARD: u16 = name_hash("move_toward");
    const FORWARD: u16 = name_hash("forward");
    const LEFT: u16 = name_hash("left");
    const RIGHT: u16 = name_hash("right");
    const GET_UP: u16 = name_hash("get_up");
    const GET_LEFT: u16 = name_hash("get_left");
    const GET_RIGHT: u16 = name_hash("get_right");
    const GET_FRONT: u16 = name_hash("get_front");
    const GET_BACK: u16 = name_hash("get_back");
    const GET_Z: u16 = name_hash("get_z");
    const BATTERY: u16 = name_hash("battery");
    const RAND_BBZ: u16 = name_hash("rand_bbz");
    const START: u16 = name_hash("start");
    const GO: u16 = name_hash("go");

    let now = deck.milliseconds();
    let here = deck.io.sensors.estimate();
    let battery = deck.state.battery;
    let pilot = &mut deck.state.pilot;
    let (first, second) = (numbers.float(0), numbers.float(1));
    match hash {
        LED => {
            // led(c, on): c 0 red, else green.
            let bit = if numbers.int(0) == 0 { 1 } else { 2 };
            let led = &mut *deck.io.led;
            *led = if numbers.int(1) == 0 { *led & !bit } else { *led | bit };
            Done::Nil
        }
        SET_MOTOR => match (numbers.int(0), numbers.int(1)) {
            (0..=3, 0..=255) => Done::Nil,
            _ => Done::OutOfRange,
        },
        TAKEOFF if first <= 0.0 => Done::OutOfRange,
        TAKEOFF | HOVER | SPIN_AT if pilot.has_given_up => Done::Nil,
        GO_TO | GOTO if pilot.has_given_up => Done::Int(0),
        MOVE_TOWARD | FORWARD | LEFT | RIGHT if pilot.has_given_up => Done::Nil,
        TAKEOFF => {
            if !again {
                let speed = pace(first, numbers);
                pilot.height = first;
                pilot.deadline = now + (first / speed * 1000.0) as u64 + PATIENCE;
                pilot.climb(first, speed);
            }
            let is_there = here.is_none_or(|here| (here.z - first).abs() < ARRIVED);
            if is_there || now >= pilot.deadline { Done::Nil } else { Done::Wait }
        }
        LAND => {
            if !again && pilot.task != Task::Grounded && !pilot.has_given_up {
                let speed = if numbers.count == 2 { pace(first, numbers) } else { SPEED };
                pilot.descend(here, now, speed);
            }
            if pilot.task != Task::Grounded && !pilot.is_down(here, now) {
                return Done::Wait;
            }
            pilot.task = Task::Grounded;
            Done::Nil
        }
        HOVER => {
            pilot.height = first;
            pilot.climb(first, SPEED);
            Done::Nil
        }
        SPIN_AT => {
            if !again {
                pilot.deadline = now + SPIN;
                pilot.height = first;
                // Clockwise seen from above.
                let turn = -second;
                pilot.task =
                    Task::Cruise { forward: 0.0, left: 0.0, turn, height: first, climb: SPEED };
            }
            if now < pilot.deadline {
                return Done::Wait;
            }
            pilot.climb(first, SPEED);
            Done::Nil
        }
        GO_TO | GOTO => {
            let height = if numbers.count == 3 { numbers.float(2) } else { pilot.height };
            let to = [first, second, height];
            if !again {
                pilot.deadline = now + PATIENCE;
                pilot.height = height;
                pilot.task = Task::Goal { to, faces_x: hash == GO_TO };
            }
            let Some(here) = here else { return Done::Int(0) };
            let distance =
                libm::hypotf(libm::hypotf(to[0] - here.x, to[1] - here.y), to[2] - here.z);
            if distance < ARRIVED {
                return Done::Int(1);
            }
            if hash == GOTO || now >= pilot.deadline { Done::Int(0) } else { Done::Wait }
        }
        MOVE_TOWARD => pilot.cruise(first, second, 0.0),
        FORWARD => pilot.cruise(CRUISE, 0.0, 0.0),
        LEFT => pilot.cruise(0.0, 0.0, TURN),
        RIGHT => pilot.cruise(0.0, 0.0, -TURN),
        GET_UP => Done::Int(OUT_OF_RANGE),
        GET_LEFT => range(deck, Side::Left),
        GET_RIGHT => range(deck, Side::Right),
        GET_FRONT => range(deck, Side::Front),
        GET_BACK => range(deck, Side::Back),
        GET_Z => Done::Int(here.map_or(OUT_OF_RANGE, |here| here.z as i32)),
        BATTERY => Done::Int(battery.map_or_else(|| pilot.battery(), i32::from)),
        RAND_BBZ => Done::Int(deck.state.chance.below(300) as i32 - 150),
        START => {
            pilot.started = pilot.started.or(Some(now));
            Done::Nil
        }
        GO => {
            pilot.started = Some(now);
            Done::Nil
        }
        _ => Done::Unknown,
    }
}

/// mm/s for a height in so many steps of 100 ms, if the call says how many.
fn pace(height: f32, numbers: &Numbers) -> f32 {
    match numbers.int(1) {
        steps if numbers.count == 2 && steps > 0 => (height / (steps as f32 * 0.1)).max(1.0),
        _ => SPEED,
    }
}

/// What the Multi-ranger reads, in mm.
fn range(deck: &Deck<'_, '_, '_>, side: Side) -> Done {
    Done::Int(deck.io.sensors.range(side).map_or(OUT_OF_RANGE, |mm| mm as i32))
}
