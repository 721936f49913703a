//! The emulated robots of one kind, side by side with the world: wheels turn when motors' signals change, and what that and
//! contacts make of the robots' places is what the projector shows next.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use bittybuzz_chips::ResetCause;
use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_emulation::ClientError;
use bittybuzz_emulation::message::{BoardStatistics, Command, Event, TimedEvent};

use crate::engine::{LinkStatistics, Loss, Medium, Pose, RobotId, RobotState, Stream, World};
use crate::scenario::Body;

use super::super::robot::{LogLine, Robot};
use super::super::settings::Numbers;
use super::bridge::Bridge;
use super::room::Room;
use super::table::Motion;
use super::told::{Reader, Told};
use super::{Failure, Firmware, FirmwareError, Light};

/// As often robots are told how they move now, if that has changed: it takes effect so much too late at most. A Kilobot moves less
/// than a mm meanwhile.
const LOOK_ZOOID: Duration = Duration::from_micros(2500);
const LOOK_KILOBOT: Duration = Duration::from_millis(20);
/// As often Crazyflies are told where they are, as by Lighthouse or Loco.
const LOOK_CRAZYFLIE: Duration = Duration::from_millis(100);

/// Of a room.
const CELSIUS: f64 = 25.0;
/// Light that reaches everybody.
const EVERYWHERE_MM: f64 = 1e6;

/// All emulated robots of a kind. They are switched on when the run begins; whose brain does not run in the world has no power.
pub struct Fleet<'p> {
    body: Body,
    room: Room,
    robots: Vec<Emulated<'p>>,
    /// Since power-on, and since the world began.
    now: Duration,
    seed: u64,
    /// How often the loss was set.
    losses: u64,
}

/// A robot, as far as it is seen from outside.
struct Emulated<'p> {
    body: Body,
    id: RobotId,
    /// The id that its script sees.
    own_id: u16,
    /// Duties of IN1 to IN4, 0 to 1; of a Kilobot left and right.
    inputs: [f64; 4],
    led: u8,
    /// Until then its wheels have turned.
    rolled: Duration,
    /// What the emulator knows of its place.
    told: Option<Motion>,
    /// Whether it has power.
    is_on: bool,
    /// Numbers of those that it is cut off from.
    deaf_to: BTreeSet<usize>,
    /// Where a positioning system told a Crazyflie to be.
    seen: Option<Pose>,
    /// What it knows of the light sensor of a Kilobot.
    light: Option<u16>,
    /// `None` if the firmware tells nothing.
    reader: Option<Reader<'p>>,
}

impl<'p> Fleet<'p> {
    /// Starts the emulator and flashes all robots. `join` gives the world's number of a robot, and the id that its script sees.
    pub fn new(
        program: &Path,
        firmware: &'p Firmware,
        join: impl Fn(usize) -> Option<(RobotId, u16)>,
        numbers: &Numbers,
        seed: u64,
    ) -> Result<Self, ClientError> {
        let body = firmware.body;
        // A listening Kilobot comes after all others.
        let count = firmware.robots.len() + usize::from(firmware.ear.is_some());
        let mut room = match body {
            Body::Kilobot => Room::shared(program, "kilobot", count, &firmware.path)?,
            Body::Zooid => Room::shared(program, "zooids", count, &firmware.path)?,
            Body::Crazyflie => Room::apart(program, count, &firmware.path)?,
        };
        let mut robots = Vec::new();
        for (number, flashed) in firmware.robots.iter().enumerate() {
            for (address, bytes) in &flashed.sections {
                let write = Command::Write { address: *address, bytes: bytes.clone() };
                room.done_by(number, &write)?;
            }
            let commands = match body {
                Body::Kilobot => {
                    let error = Stream::for_brain(seed, number as u16).normal().clamp(-3.0, 3.0);
                    let error_ppm = f64::from(1e6 * numbers.media.infrared.clock_sigma * error);
                    vec![Command::Clock { error_ppm }]
                }
                Body::Zooid => {
                    let Light { lose, jitter_us, glitches_per_s } = flashed.light;
                    let seed = seed.wrapping_add(number as u64 + 1);
                    let reading = flashed.power_detector;
                    let light = Command::Light { lose, jitter_us, glitches_per_s, seed };
                    vec![light, Command::PowerDetector { reading }]
                }
                Body::Crazyflie => Vec::new(),
            };
            for command in commands {
                room.done_by(number, &command)?;
            }
            let Some((id, own_id)) = join(flashed.number) else { continue };
            robots.push(Emulated {
                body,
                id,
                own_id,
                inputs: [0.0; 4],
                led: 0,
                rolled: Duration::ZERO,
                told: None,
                is_on: true,
                deaf_to: BTreeSet::new(),
                seen: None,
                light: None,
                reader: firmware.messages.as_ref().map(Reader::new),
            });
        }
        if let Some(ear) = &firmware.ear {
            let write = Command::Write { address: 0, bytes: ear.program.clone() };
            room.done_by(robots.len(), &write)?;
            let [x, y] = ear.at.map(|mm| mm as f32);
            let pose = Pose::new(x, y, 0.0);
            let there = Motion { since: Duration::ZERO, pose, speed: 0.0, turn: 0.0 };
            room.done_by(robots.len(), &there.command())?;
        }
        if body == Body::Kilobot {
            let reach = |range| f64::from(range) + 2.0 * f64::from(numbers.kilobot.radius);
            let range_mm = numbers.media.infrared.link.range.map_or(EVERYWHERE_MM, reach);
            let noise_mm = numbers.media.infrared.distance_sigma.into();
            room.done(&Command::Infrared { range_mm, noise_mm, seed })?;
        }
        let now = Duration::ZERO;
        let mut fleet = Fleet { body, room, robots, now, seed, losses: 0 };
        fleet.lose(match body {
            Body::Kilobot => numbers.media.infrared.link.loss,
            Body::Zooid => numbers.media.nrf24.link.loss,
            Body::Crazyflie => numbers.media.p2p.link.loss,
        })?;
        fleet.let_run()?;
        Ok(fleet)
    }

    /// The overhead controller says so to Kilobots; those that run already do not mind.
    fn let_run(&mut self) -> Result<(), ClientError> {
        if self.body == Body::Kilobot {
            self.room.start_kilobots(self.now)?;
        }
        Ok(())
    }

    /// What carries their packets.
    pub fn medium(&self) -> Medium {
        match self.body {
            Body::Kilobot => Medium::Infrared,
            Body::Zooid => Medium::Nrf24,
            Body::Crazyflie => Medium::P2p,
        }
    }

    /// Packets of Zooids and Crazyflies are lost as the medium says for robots that touch: all are in reach, and distance changes nothing.
    /// Frames of Kilobots are lost as it says in the middle between touching and out of reach.
    pub fn lose(&mut self, loss: Loss) -> Result<(), ClientError> {
        self.losses += 1;
        let seed = self.seed.wrapping_add(self.losses << 32);
        let lose = match self.body {
            Body::Kilobot => f64::midpoint(loss.near.into(), loss.far.into()),
            _ => loss.near.into(),
        };
        self.room.done(&Command::Air { lose, seed })
    }

    fn number(&self, id: RobotId) -> Option<usize> {
        self.robots.iter().position(|robot| robot.id == id)
    }

    /// A robot's battery has so many mV, if it is an emulated one.
    pub fn set_battery(&mut self, id: RobotId, millivolts: u16) -> Result<(), ClientError> {
        let Some(number) = self.number(id) else { return Ok(()) };
        let volts = f32::from(millivolts) / 1000.0;
        let battery = Command::Battery { volts, charging: false, usb_powered: false };
        self.room.done_by(number, &battery)
    }

    /// Takes a robot's power away; [`settle`](Self::settle) gives it back to one that runs.
    pub fn switch_off(&mut self, id: RobotId) -> Result<(), ClientError> {
        match self.number(id) {
            Some(number) => self.set_power(number, false),
            None => Ok(()),
        }
    }

    fn set_power(&mut self, number: usize, on: bool) -> Result<(), ClientError> {
        if let Some(robot) = self.robots.get_mut(number) {
            robot.is_on = on;
            self.room.done_by(number, &Command::Power { on })?;
        }
        if on { self.let_run() } else { Ok(()) }
    }

    /// Robots have power if they run in the world, and hear who is not cut off there.
    pub fn settle(&mut self, world: &World<Robot<'_>>) -> Result<(), ClientError> {
        for number in 0..self.robots.len() {
            let Some(robot) = self.robots.get(number) else { continue };
            let runs = world.robot(robot.id).is_some_and(|view| view.state == RobotState::Running);
            let others = self.robots.iter().enumerate();
            let cut_off = others.filter(|(_, other)| !world.connects(robot.id, other.id));
            let to: BTreeSet<usize> = cut_off.map(|(other, _)| other).collect();
            if runs != robot.is_on {
                self.set_power(number, runs)?;
            }
            if let Some(robot) = self.robots.get_mut(number).filter(|robot| robot.deaf_to != to) {
                robot.deaf_to.clone_from(&to);
                self.room.done_by(number, &Command::Deaf { to })?;
            }
        }
        Ok(())
    }

    /// The longest time that it may run at once.
    pub fn look(&self) -> Duration {
        match self.body {
            Body::Kilobot => LOOK_KILOBOT,
            Body::Zooid => LOOK_ZOOID,
            Body::Crazyflie => LOOK_CRAZYFLIE,
        }
    }

    /// Somebody who is no robot sends.
    pub fn hear(&mut self, command: &Command) -> Result<(), ClientError> {
        self.room.done(command)
    }

    /// Runs until a time; the bridge hears what is sent.
    pub fn run(
        &mut self,
        world: &mut World<Robot<'_>>,
        mut bridge: Option<&mut Bridge>,
        until: Duration,
    ) -> Result<(), FirmwareError> {
        let Fleet { room, robots, now, .. } = self;
        let mut places = Vec::new();
        for (number, robot) in robots.iter_mut().enumerate() {
            let light = world.light(robot.id).ok().filter(|_| robot.body == Body::Kilobot);
            if let Some(light) = light
                && robot.light != Some(light)
            {
                places.push((number, Command::Surroundings { light, celsius: CELSIUS }));
                robot.light = Some(light);
            }
            let seen = world.robot(robot.id).and_then(|view| view.estimate);
            if let Some(pose) = seen.filter(|_| robot.body == Body::Crazyflie)
                && robot.seen != Some(pose)
            {
                places.push((number, pose_command(&pose)));
                robot.seen = Some(pose);
            }
            let Some(motion) = robot.motion(world, *now) else { continue };
            if robot.told.is_none_or(|told| !motion.follows(&told)) {
                places.push((number, motion.command()));
                robot.told = Some(motion);
            }
        }
        let mut failed = None;
        room.run_after(&places, until, |event| {
            if let Some(bridge) = bridge.as_deref_mut() {
                let TimedEvent { at, event: timed } = &event.timed;
                match timed {
                    Event::Serial { bytes } if event.robot == robots.len() => {
                        bridge.read_line(*at, bytes);
                    }
                    Event::Radio { payload, .. } => bridge.hear_nrf24(*at, payload),
                    Event::P2p { port, payload, .. } => bridge.hear_p2p(*at, *port, payload),
                    _ => {}
                }
            }
            let Some(robot) = robots.get_mut(event.robot) else { return };
            let at = event.timed.at;
            if let Err(failure) = robot.note(event.timed, until, world) {
                let robot = robot.own_id;
                failed = failed.take().or(Some(FirmwareError::Failed { robot, at, failure }));
            }
        })?;
        if let Some(error) = failed {
            return Err(error);
        }
        for robot in robots {
            robot.roll(until, world);
        }
        *now = until;
        Ok(())
    }

    /// What became of the robots' packets, and how many of them found their radios full.
    pub fn links(&mut self) -> Result<(LinkStatistics, u64), ClientError> {
        let (mut links, mut overflown) = (LinkStatistics::default(), 0);
        for number in 0..self.robots.len() {
            let counted = self.room.statistics_of(number)?;
            match counted.board {
                BoardStatistics::Zooid(board) => {
                    links.sent += board.radio_sent;
                    links.received += board.radio_received;
                    links.deaf += board.radio_unheard;
                    overflown += board.radio_overflown;
                }
                BoardStatistics::Kilobot(board) => {
                    links.sent += board.infrared_sent;
                    links.received += board.infrared_arrived;
                }
                BoardStatistics::Crazyflie(board) => {
                    links.deaf += board.radio_unheard;
                    overflown += board.radio_overflown;
                    links.received = counted.air.carried - counted.air.lost - counted.air.collided;
                }
            }
            links.collided = counted.air.collided;
            links.lost = counted.air.lost;
        }
        Ok((links, overflown))
    }
}

/// What a positioning system tells a Crazyflie.
fn pose_command(pose: &Pose) -> Command {
    let Pose { x, y, z, heading } = *pose;
    Command::Pose { x_mm: x, y_mm: y, z_mm: z, yaw_degrees: heading.to_degrees() }
}

impl Emulated<'_> {
    /// Duties of the wheels in percent: one input of a bridge is high while the other is low. Those of a Kilobot's motors.
    fn duties(&self) -> [f32; 2] {
        let [a, b, c, d] = self.inputs;
        if self.body == Body::Kilobot {
            return [a, b].map(|duty| (100.0 * duty) as f32);
        }
        [b - a, d - c].map(|duty| (100.0 * duty) as f32)
    }

    /// Where it is now and how it moves.
    fn motion(&self, world: &mut World<Robot<'_>>, now: Duration) -> Option<Motion> {
        let [speed, turn] = world.roll(self.id, self.duties(), 0.0).ok()??;
        let pose = world.robot(self.id)?.pose;
        Some(Motion { since: now, pose, speed, turn })
    }

    /// Lets its wheels turn until then as they do.
    fn roll(&mut self, until: Duration, world: &mut World<Robot<'_>>) {
        let span = until.saturating_sub(self.rolled);
        self.rolled = self.rolled.max(until);
        // The world knows the robot.
        let _ = world.roll(self.id, self.duties(), span.as_secs_f32());
    }

    /// Something has happened on it, not later than `until`.
    fn note(
        &mut self,
        TimedEvent { at, event }: TimedEvent,
        until: Duration,
        world: &mut World<Robot<'_>>,
    ) -> Result<(), Failure> {
        match event {
            Event::Motor { number, duty, .. } => {
                // What is known when an instruction ends may be a moment later.
                self.roll(at.min(until), world);
                let input = usize::from(number).checked_sub(1);
                if let Some(input) = input.and_then(|input| self.inputs.get_mut(input)) {
                    *input = duty;
                }
            }
            Event::Led { name, on } => {
                let bit = match name.as_str() {
                    "red" | "red_left" => 1,
                    "green" | "green_left" => 2,
                    "blue" | "blue_left" => 4,
                    // The firmware's own, of a Crazyflie.
                    _ => return Ok(()),
                };
                self.led = if on { self.led | bit } else { self.led & !bit };
                // The world knows the robot.
                let _ = world.shine(self.id, self.led);
            }
            Event::Colour { red, green, blue } => {
                let shines = [red, green, blue].map(|part| u8::from(part > 0));
                self.led = shines[0] | shines[1] << 1 | shines[2] << 2;
                // The world knows the robot.
                let _ = world.shine(self.id, self.led);
            }
            Event::Rtt { bytes } => {
                let told = self.reader.as_mut().map_or(Vec::new(), |reader| reader.read(&bytes));
                let tick = world.now();
                let Some(robot) = world.brain_mut(self.id) else { return Ok(()) };
                for told in told {
                    match told {
                        Told::Log(pieces) => robot.has_logged(LogLine { tick, pieces }),
                        Told::Fault(fault, positions) => robot.has_stopped(tick, fault, positions),
                        Told::Contained(fault, positions) => {
                            robot.has_contained(tick, fault, positions);
                        }
                        Told::Restart(pause) => robot.has_restarted(pause),
                        Told::Unused(unused) => robot.has_missed(unused),
                        Told::Refused(cause) => return Err(Failure::Refused(cause)),
                    }
                }
            }
            Event::Infrared { payload, .. } => {
                let message = payload.as_slice().try_into().ok();
                let Some(report) = message.and_then(FaultReport::of) else { return Ok(()) };
                let fault = report.fault.ok_or(Failure::Unsuitable)?;
                let tick = world.now();
                let Some(robot) = world.brain_mut(self.id) else { return Ok(()) };
                // The robot sends each report again and again.
                if report.is_contained {
                    robot.has_contained_once(tick, fault);
                } else if !robot.state().is_faulted() {
                    robot.has_failed(tick, fault);
                }
            }
            Event::Step => {
                if let Some(robot) = world.brain_mut(self.id) {
                    robot.has_stepped();
                }
            }
            // Its power was cut, or is back.
            Event::Reset { cause } if cause == ResetCause::PowerOff.name() => {}
            Event::Reset { cause } if cause == ResetCause::PowerOn.name() => {
                self.reader = self.reader.take().map(Reader::anew);
            }
            Event::Reset { cause } => return Err(Failure::Reset { cause }),
            Event::Loader { name } => {
                return Err(Failure::Reset { cause: format!("loader {name}") });
            }
            Event::HardwareError { text } => return Err(Failure::Hardware { text }),
            Event::Lockup { pc } => return Err(Failure::Lockup { pc }),
            Event::Syslink { .. }
            | Event::P2p { .. }
            | Event::Radio { .. }
            | Event::Serial { .. }
            | Event::PowerOff { .. } => {}
        }
        Ok(())
    }
}
