//! The emulated robots of one model, coupled to the world: changes of the motors' signals turn the
//! wheels in the world, and the poses that result from wheels and contacts go back to the emulator,
//! as by a projector.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_emulation::ClientError;
use bittybuzz_emulation::message::{Command, EmulatorEvent, TimedEvent};
use bittybuzz_toml_reader::Place;

use crate::engine::{LinkStatistics, Loss, Media, Medium, Pose, RobotId, RobotState, World};
use crate::robot::{BatteryState, Emulation, SimRobot};

use super::bridge::Bridge;
use super::emulated::Emulated;
use super::emulator_pool::EmulatorPool;
use super::radio_turns::TurnLength;
use super::table::Motion;
use super::trace_events::TraceEventReader;
use super::{EMULATED, Firmware, FirmwareError, IN_WORLD};

/// All emulated robots of one model. They are powered on when the run begins. A robot that is not
/// running in the world has no power.
pub struct EmulatedFleet {
    emulation: Arc<dyn Emulation>,
    medium: Medium,
    pool: EmulatorPool,
    robots: Vec<Emulated>,
    /// Time since power-on, which is also the time since the world began.
    now: Duration,
    seed: u64,
    /// The number of times that the loss was set; each time has a seed of its own.
    losses: u64,
}

/// The longest time that robots run before they exchange frames if they have a foreign image or fly.
/// Their frames may be late by this time, a twentieth of a script's step. With turns of a
/// millisecond, four robots that fly use 1.6 of two processors, because each waits for the slowest
/// in every turn; with these, 1.7, and a fifth less of their time.
const LONG_TURN: Duration = Duration::from_millis(5);

/// A reason why a fleet cannot start.
#[derive(Debug)]
pub enum StartError {
    /// The emulator cannot be used.
    Emulator(ClientError),
    /// The door of a robot cannot be opened.
    NoDoor {
        /// The id of the robot.
        robot: u16,
        /// The place of the key `door`.
        place: Place,
        error: ClientError,
    },
}

impl From<ClientError> for StartError {
    fn from(error: ClientError) -> Self {
        StartError::Emulator(error)
    }
}

impl EmulatedFleet {
    /// Starts the emulator and flashes all robots. `join` returns the world's id of a robot, and
    /// the id that its script sees.
    pub fn new(
        program: &Path,
        emulation: Arc<dyn Emulation>,
        firmware: &Firmware,
        join: impl Fn(usize) -> (RobotId, u16),
        world: &World<SimRobot>,
        media: &Media,
        seed: u64,
    ) -> Result<Self, StartError> {
        let medium = firmware.model().medium();
        let has_long_turns = firmware.is_image || emulation.flies();
        let turn = if has_long_turns { TurnLength::Fixed(LONG_TURN) } else { TurnLength::Exact };
        // The listening robot of a bridge has the number after all others.
        let count = firmware.robots.len() + usize::from(firmware.listener.is_some());
        let mut pool = match emulation.shared_program_robot() {
            Some(name) => EmulatorPool::shared(program, name, count, &firmware.path)?,
            None => EmulatorPool::apart(program, count, &firmware.path, turn)?,
        };
        if firmware.robots.iter().any(|robot| robot.door.is_some()) {
            pool.keep_pace();
        }
        let mut robots = Vec::new();
        for (number, flashed) in firmware.robots.iter().enumerate() {
            for (address, bytes) in &flashed.sections {
                let write = Command::Write { address: *address, bytes: bytes.clone() };
                pool.execute_on(number, &write)?;
            }
            let of_group = flashed.model.emulation().expect(EMULATED);
            for command in of_group.set_up(number, seed, media) {
                pool.execute_on(number, &command)?;
            }
            let (id, own_id) = join(flashed.number);
            // A foreign image has a body in any case, and only the decks of its positioning.
            let flies = of_group.flies() && !firmware.is_image;
            if firmware.is_image || flies {
                let pose = world.robot(id).expect(IN_WORLD).pose;
                let build = seed.wrapping_add(u64::from(own_id) << 32);
                for command in of_group.body(&pose, build) {
                    pool.execute_on(number, &command)?;
                }
                if let Some(command) = of_group.range_finders().filter(|_| flies) {
                    pool.execute_on(number, &command)?;
                }
            }
            if let Some((port, place)) = &flashed.door {
                let opened = pool.execute_on(number, &Command::Door { port: *port });
                opened.map_err(|error| StartError::NoDoor {
                    robot: own_id,
                    place: place.clone(),
                    error,
                })?;
            }
            let permission = of_group.permission().filter(|_| flies);
            robots.push(Emulated {
                emulation: of_group,
                permission,
                measured: None,
                id,
                own_id,
                inputs: [0.0; 4],
                led: 0,
                rolled: Duration::ZERO,
                last_motion: None,
                is_image: firmware.is_image,
                is_on: true,
                has_crashed: false,
                battery: None,
                deaf_to: BTreeSet::new(),
                sensed: None,
                reader: firmware.messages.clone().map(TraceEventReader::new),
            });
        }
        if let Some(listener) = &firmware.listener {
            let write = Command::Write { address: 0, bytes: listener.program.clone() };
            pool.execute_on(robots.len(), &write)?;
            let [x, y] = listener.at.map(|mm| mm as f32);
            let pose = Pose::new(x, y, 0.0);
            let there = Motion { since: Duration::ZERO, pose, speed_mm_s: 0.0, turn_rad_s: 0.0 };
            pool.execute_on(robots.len(), &there.command(emulation.origin()))?;
        }
        if let Some(command) = emulation.air(media, seed) {
            pool.execute(&command)?;
        }
        let now = Duration::ZERO;
        let mut fleet = EmulatedFleet { emulation, medium, pool, robots, now, seed, losses: 0 };
        fleet.lose(media.link(medium).loss)?;
        fleet.start_programs()?;
        Ok(fleet)
    }

    /// Starts the programs of robots that have just been powered on; has no effect on other robots.
    fn start_programs(&mut self) -> Result<(), ClientError> {
        match &mut self.pool {
            EmulatorPool::Shared(emulator) => self.emulation.start(emulator, self.now),
            EmulatorPool::Apart(_) => Ok(()),
        }
    }

    /// Returns the medium that carries their packets.
    pub fn medium(&self) -> Medium {
        self.medium
    }

    /// Applies a medium's loss, as far as the emulator can: the emulator has no distances, so all
    /// links have the same loss.
    pub fn lose(&mut self, loss: Loss) -> Result<(), ClientError> {
        self.losses += 1;
        let seed = self.seed.wrapping_add(self.losses << 32);
        self.pool.execute(&Command::Air { lose: self.emulation.loss(loss), seed })
    }

    /// Returns the number of a robot in the fleet; `None` if it belongs to none or to another one.
    fn number(&self, id: RobotId) -> Option<usize> {
        self.robots.iter().position(|robot| robot.id == id)
    }

    /// Sets the battery voltage of a robot, if it is emulated.
    pub fn set_battery(&mut self, id: RobotId, millivolts: u16) -> Result<(), ClientError> {
        // Events may name robots of other kinds, too.
        let Some(number) = self.number(id) else { return Ok(()) };
        let volts = f32::from(millivolts) / 1000.0;
        let battery = Command::Battery { volts, charging: false, usb_powered: false };
        self.pool.execute_on(number, &battery)
    }

    /// Returns the battery of a robot that flies here.
    pub fn battery(&self, id: RobotId) -> Option<BatteryState> {
        self.robots[self.number(id)?].battery
    }

    /// Cuts a robot's power. [`settle`](Self::settle) restores it if the robot runs in the world.
    pub fn switch_off(&mut self, id: RobotId) -> Result<(), ClientError> {
        match self.number(id) {
            Some(number) => self.set_power(number, false),
            None => Ok(()),
        }
    }

    fn set_power(&mut self, number: usize, on: bool) -> Result<(), ClientError> {
        self.robots[number].is_on = on;
        self.pool.execute_on(number, &Command::Power { on })?;
        if on { self.start_programs() } else { Ok(()) }
    }

    /// Copies the state of the world to the emulator: a robot has power if it runs in the world,
    /// and does not receive robots that it is cut off from there.
    pub fn settle(&mut self, world: &World<SimRobot>) -> Result<(), ClientError> {
        for number in 0..self.robots.len() {
            let robot = &self.robots[number];
            let view = world.robot(robot.id).expect(IN_WORLD);
            let runs = view.state == RobotState::Running;
            let others = self.robots.iter().enumerate();
            let cut_off = others.filter(|(_, other)| !world.connects(robot.id, other.id));
            let to: BTreeSet<usize> = cut_off.map(|(other, _)| other).collect();
            if runs != robot.is_on && robot.emulation.has_switch() {
                self.set_power(number, runs)?;
            }
            if self.robots[number].deaf_to != to {
                self.robots[number].deaf_to.clone_from(&to);
                self.pool.execute_on(number, &Command::Deaf { to })?;
            }
        }
        Ok(())
    }

    /// Returns the longest time that the fleet may run in one call.
    pub fn exchange_period(&self) -> Duration {
        self.emulation.exchange_period()
    }

    /// Lets the robots receive a frame of a sender that is not a robot.
    pub fn receive(&mut self, command: &Command) -> Result<(), ClientError> {
        self.pool.execute(command)
    }

    /// Runs all robots until a time. The bridge receives the frames that they send.
    pub fn run(
        &mut self,
        world: &mut World<SimRobot>,
        mut bridge: Option<&mut Bridge>,
        until: Duration,
    ) -> Result<(), FirmwareError> {
        let EmulatedFleet { pool, robots, now, .. } = self;
        let mut places = Vec::new();
        for (number, robot) in robots.iter_mut().enumerate() {
            let view = world.robot(robot.id).expect(IN_WORLD);
            let light = world.light(robot.id).expect(IN_WORLD);
            if let Some(command) = robot.emulation.sense(&view, light)
                && robot.sensed.as_ref() != Some(&command)
            {
                places.push((number, command.clone()));
                robot.sensed = Some(command);
            }
            places.extend(robot.permission.iter().map(|command| (number, command.clone())));
            if robot.emulation.flies() && !robot.is_image {
                let distances_mm = world.ranges(robot.id).expect(IN_WORLD);
                let measured = robot.emulation.ranges(distances_mm);
                if measured != robot.measured {
                    places.extend(measured.iter().map(|command| (number, command.clone())));
                    robot.measured = measured;
                }
            }
            // A body without wheels gives its place to the emulator otherwise.
            let Some(motion) = robot.motion(world, *now) else { continue };
            if robot.last_motion.is_none_or(|last_motion| !motion.is_predicted_by(&last_motion)) {
                places.push((number, motion.command(robot.emulation.origin())));
                robot.last_motion = Some(motion);
            }
        }
        let mut failed = None;
        pool.run_after(&places, until, |event| {
            if let Some(bridge) = bridge.as_deref_mut() {
                let TimedEvent { at, event: timed } = &event.timed;
                match timed {
                    EmulatorEvent::Serial { bytes } if event.robot == robots.len() => {
                        bridge.read_line(*at, bytes);
                    }
                    EmulatorEvent::Radio { payload, .. } => bridge.receive_nrf24(*at, payload),
                    EmulatorEvent::P2p { port, payload, .. } => {
                        bridge.receive_p2p(*at, *port, payload)
                    }
                    _ => {}
                }
            }
            // The listening robot of a bridge has no body in the world.
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

    /// Returns the link statistics, and the number of packets that were lost because a radio's
    /// buffer was full.
    pub fn links(&mut self) -> Result<(LinkStatistics, u64), ClientError> {
        let (mut links, mut overflown) = (LinkStatistics::default(), 0);
        for number in 0..self.robots.len() {
            let counted = self.pool.statistics_of(number)?;
            overflown += self.emulation.count(&counted, &mut links);
            links.collided = counted.air.collided;
            links.lost = counted.air.lost;
        }
        Ok((links, overflown))
    }
}
