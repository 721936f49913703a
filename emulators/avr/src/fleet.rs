//! All robots of the program, and the light between them. The crate's documentation describes the
//! windows of time in which they run.

use std::path::Path;
use std::time::Duration;

use bittybuzz_chips::atmega328p::EEPROM_SIZE;
use bittybuzz_chips::{ResetCause, Time};
use bittybuzz_emulation::message::{
    self, AirStatistics, BoardStatistics, Command, CoreStatistics, EmulatorEvent, Reply,
    RobotStatistics, TimedEvent,
};
use bittybuzz_emulation::{
    CommandError, CommandRefusal, EmulatedRobots, FirmwareImage, MachineError, Pause, READ_MAX,
    finite, probability,
};
use bittybuzz_kilobot::phase;
use bittybuzz_kilobot_board::{Amplitude, Edge, LightChange, Surroundings};
use bittybuzz_simavr::{DATA, SimavrChip};
use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};

use crate::air::{InfraredAir, Range};
use crate::robot::EmulatedKilobot;

/// The length of a window, after which robots exchange their light. A longer window means more
/// repeated work when a robot begins to send, a shorter one more time in which threads wait for
/// each other.
const WINDOW: Time = Time::from_micros(500);

/// The addresses of the memories in the numbering of an AVR's tools.
const RAM_BASE: u32 = 0x80_0000;
const EEPROM_BASE: u32 = 0x81_0000;
/// The instruction `ret`.
const RETURN: [u8; 2] = [0x08, 0x95];

/// The program's robots.
pub struct KilobotFleet {
    chip: SimavrChip,
    members: Vec<Member>,
    air: InfraredAir,
    image: Option<FirmwareImage>,
}

/// A robot, and its known actions in the current window.
struct Member {
    robot: EmulatedKilobot,
    /// The light that the robot saw.
    seen: Vec<LightChange>,
    /// The changes of the robot's own LED.
    edges: Vec<Edge>,
    /// True if the robot was sending at the end of the last window.
    is_sending: bool,
    /// True if the robot's state at the beginning of the window is saved.
    is_saved: bool,
    /// True if the robot is switched off.
    is_off: bool,
    /// True if the robot must run this window, for the first time or again.
    must_run: bool,
    /// The number of resets and steps that were reported.
    resets: u64,
    steps: u64,
    is_dead: bool,
    /// Events that the client has not yet collected.
    events: Vec<TimedEvent>,
}

impl Member {
    fn new(number: usize, chip: SimavrChip) -> Self {
        Member {
            robot: EmulatedKilobot::new(number as u16, chip),
            seen: Vec::new(),
            edges: Vec::new(),
            is_sending: false,
            is_saved: false,
            is_off: false,
            must_run: false,
            resets: 0,
            steps: 0,
            is_dead: false,
            events: Vec::new(),
        }
    }

    fn run(&mut self, end: Time) {
        if std::mem::replace(&mut self.is_saved, true) {
            self.robot.restore();
        } else {
            self.robot.save();
        }
        self.edges = self.robot.run(end, &self.seen);
        self.must_run = false;
    }
}

impl KilobotFleet {
    /// Creates `count` robots without an image.
    pub fn new(count: usize, chip: SimavrChip) -> Self {
        let members = (0..count).map(|number| Member::new(number, chip)).collect();
        KilobotFleet { chip, members, air: InfraredAir::new(count), image: None }
    }

    /// Runs all robots until `end`.
    fn window(&mut self, end: Time) {
        let KilobotFleet { members, air, .. } = self;
        air.begin(end);
        for (number, member) in members.iter_mut().enumerate() {
            (member.is_saved, member.edges) = (false, Vec::new());
            member.seen = air.lights_for(number);
            // A robot that sleeps and sees no light does nothing; it catches up when it is woken.
            let is_awake = !member.seen.is_empty() || !member.robot.is_quiet(end);
            member.must_run = !member.is_off && is_awake;
        }
        // Other robots do not affect a sender, so senders run first, and the others run with known
        // pulses.
        run(members, end, |member| member.must_run && member.is_sending);
        air.learn(members.iter().map(|member| member.edges.as_slice()));
        for (number, member) in members.iter_mut().enumerate() {
            if member.must_run && air.is_busy() {
                member.seen = air.lights_for(number);
            }
        }
        run(members, end, |member| member.must_run);
        // A robot may have begun to send, or may have acted differently than assumed. Robots that
        // have not seen this light run again, until each has seen all light. Each round is correct
        // for longer than the round before.
        while air.learn(members.iter().map(|member| member.edges.as_slice())) {
            for (number, member) in members.iter_mut().enumerate() {
                let lights = air.lights_for(number);
                if lights != member.seen && !member.is_off {
                    member.seen = lights;
                    member.must_run = true;
                }
            }
            run(members, end, |member| member.must_run);
        }
        air.end();
        for member in members {
            member.is_sending = !member.edges.is_empty();
            member.note();
        }
    }

    /// Switches off all lights that are on, before a change of the visible pairs. Otherwise a robot
    /// that no longer sees a sender would see that sender's light for ever.
    fn darken(&mut self, now: Time) {
        let lit: Vec<usize> = (0..self.members.len())
            .filter(|number| self.members[*number].robot.board.is_lit())
            .collect();
        for from in lit {
            let amplitude = Amplitude::default();
            let out = LightChange { at: now, on: false, from: from as u16, amplitude };
            for (_, member) in self.members.iter_mut().enumerate().filter(|(n, _)| *n != from) {
                member.robot.board.will_see([out]);
            }
        }
    }

    fn member(&mut self, robot: usize) -> Result<&mut Member, CommandError> {
        let robots = self.members.len();
        self.members.get_mut(robot).ok_or(CommandError::NoRobot { robot, robots })
    }
}

/// Runs the chosen robots, on all threads.
fn run(members: &mut [Member], end: Time, chosen: impl Fn(&Member) -> bool + Sync) {
    let count = members.iter().filter(|member| chosen(member)).count();
    // Waking a single thread for each window takes as long as the window.
    if count > 1 && rayon::current_num_threads() > 1 {
        let all = members.par_iter_mut().with_max_len(1);
        all.filter(|member| chosen(member)).for_each(|member| member.run(end));
    } else {
        members.iter_mut().filter(|member| chosen(member)).for_each(|member| member.run(end));
    }
}

impl Member {
    /// Collects the events of a window whose result is final.
    fn note(&mut self) {
        let events = self.robot.board.take_events().into_iter();
        self.events.extend(events.map(|(at, event)| TimedEvent {
            at: Duration::from_nanos(at.nanos()),
            event: event.into(),
        }));
        let counted = self.robot.counted;
        let at = Duration::from_nanos(self.robot.board.time(self.robot.core.cycle()).nanos());
        if std::mem::replace(&mut self.resets, counted.resets) != counted.resets {
            self.events
                .push(TimedEvent { at, event: EmulatorEvent::Reset { cause: "watchdog".into() } });
        }
        let steps = counted.steps.completed();
        for _ in std::mem::replace(&mut self.steps, steps)..steps {
            self.events.push(TimedEvent { at, event: EmulatorEvent::Step });
        }
        let is_dead = self.robot.is_dead;
        if is_dead && !std::mem::replace(&mut self.is_dead, is_dead) {
            let pc = self.robot.core.pc().into();
            self.events.push(TimedEvent { at, event: EmulatorEvent::Lockup { pc } });
        }
    }

    /// Returns the `length` bytes from `address` on.
    fn memory(&mut self, address: u32, length: usize) -> Result<Vec<u8>, MachineError> {
        let robot = &mut self.robot;
        let part = |memory: &[u8], base: u32| {
            let start = (address - base) as usize;
            Some(memory.get(start..start.checked_add(length)?)?.to_vec())
        };
        let bytes = match address {
            0..RAM_BASE => part(robot.core.flash(), 0),
            RAM_BASE..EEPROM_BASE => part(robot.core.data(), RAM_BASE),
            _ => part(robot.board.eeprom(), EEPROM_BASE),
        };
        bytes.ok_or(MachineError::NoMemory { address, length })
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        self.memory(address, bytes.len())?;
        let robot = &mut self.robot;
        let (start, end) = (address as usize & 0xffff, (address as usize & 0xffff) + bytes.len());
        match address {
            0..RAM_BASE => robot.core.write_flash(start, bytes),
            RAM_BASE..EEPROM_BASE => robot.core.data()[start..end].copy_from_slice(bytes),
            _ => {
                robot.board.eeprom()[start..end].copy_from_slice(bytes);
                robot.board.wire();
            }
        }
        Ok(())
    }
}

impl EmulatedRobots for KilobotFleet {
    fn count(&self) -> usize {
        self.members.len()
    }

    fn load(&mut self, path: &Path) -> Result<(), CommandError> {
        let flash_size = self.chip.flash_size();
        let image = FirmwareImage::open_avr(path, flash_size)?;
        let count = self.members.len();
        *self = KilobotFleet::new(count, self.chip);
        let data = RAM_BASE..RAM_BASE + DATA as u32;
        let phase = image.symbol(phase::SYMBOL).filter(|address| data.contains(address));
        for member in &mut self.members {
            member.robot.phase = phase.map(|address| (address - RAM_BASE) as u16);
            for (address, bytes) in image.segments() {
                let is_memory = (address as usize) < flash_size
                    || (EEPROM_BASE..EEPROM_BASE + EEPROM_SIZE as u32).contains(&address);
                // Fuses and lock bits in the image have no effect.
                if is_memory {
                    member.write_memory(address, bytes)?;
                }
            }
        }
        self.image = Some(image);
        Ok(())
    }

    fn run(&mut self, from: Duration, until: Duration) -> Result<Pause, MachineError> {
        let (mut now, until) = (time(from), time(until));
        while now < until {
            now = (now + WINDOW).min(until);
            self.window(now);
        }
        Ok(Pause::Time)
    }

    fn take_events(&mut self, robot: usize, _: Duration) -> Result<Vec<TimedEvent>, MachineError> {
        Ok(self.members.get_mut(robot).map_or(Vec::new(), |m| std::mem::take(&mut m.events)))
    }

    fn execute(
        &mut self,
        robot: usize,
        command: Command,
        now: Duration,
    ) -> Result<Reply, CommandError> {
        let board = &mut self.member(robot)?.robot.board;
        match command {
            Command::Write { address, bytes } => {
                self.member(robot)?.write_memory(address, &bytes)?;
            }
            Command::Read { address, length } => {
                if length > READ_MAX {
                    return Err(CommandError::ReadTooLong(length));
                }
                let bytes = self.member(robot)?.memory(address, length as usize)?;
                return Ok(Reply::Bytes { bytes });
            }
            Command::Skip { symbol } => {
                let image = self.image.as_ref().ok_or(CommandError::NotLoaded)?;
                let address = image.function(&symbol)?;
                self.member(robot)?.write_memory(address, &RETURN)?;
            }
            Command::Place { x_mm, y_mm, .. } => {
                let place = [finite("x_mm", x_mm)?, finite("y_mm", y_mm)?];
                self.darken(time(now));
                self.air.place(robot, Some(place));
            }
            Command::Remove => {
                self.darken(time(now));
                self.air.place(robot, None);
            }
            Command::Power { on } => {
                self.darken(time(now));
                let member = self.member(robot)?;
                member.is_off = !on;
                let cause = if on { ResetCause::PowerOn } else { ResetCause::PowerOff };
                member.robot.switch(time(now), cause);
                member.note();
            }
            Command::Chip { memory, seed, debugger: false, crystal: true, .. } => {
                self.member(robot)?.robot.memory = bittybuzz_emulation::memory(memory, seed);
            }
            Command::Reset { cause: message::ResetCause::BrownOut } => {
                self.darken(time(now));
                let member = self.member(robot)?;
                member.robot.switch(time(now), ResetCause::BrownOut);
                member.note();
                let cause = ResetCause::BrownOut.name().into();
                member.events.push(TimedEvent { at: now, event: EmulatorEvent::Reset { cause } });
            }
            Command::Deaf { to } => {
                let robots = self.members.len();
                if let Some(stranger) = to.iter().copied().find(|number| *number >= robots) {
                    return Err(CommandError::NoRobot { robot: stranger, robots });
                }
                self.darken(time(now));
                self.air.cut_off(robot, to);
            }
            Command::Battery { volts, charging, .. } => {
                board.set_battery(volts.into(), charging);
            }
            Command::Clock { error_ppm } => board.set_clock_error(clock_error(error_ppm)?),
            Command::Surroundings { light, celsius } => {
                let celsius = finite("celsius", celsius)?;
                board.set_surroundings(Surroundings { light, celsius });
            }
            Command::Air { lose, seed } => self.air.lose(probability(lose)?, seed),
            Command::Infrared { range_mm, edge_mm, noise_mm, seed } => {
                let range = Range {
                    middle_mm: finite("range_mm", range_mm)?,
                    edge_mm: finite("edge_mm", edge_mm)?.max(0.0),
                };
                self.air.set_light(range, finite("noise_mm", noise_mm)?, seed);
                for (number, member) in self.members.iter_mut().enumerate() {
                    member.robot.board.set_seed(seed.wrapping_add(number as u64 + 1));
                }
            }
            Command::Radio { at, payload } => {
                let frame =
                    crate::air::frame(&payload).ok_or(CommandRefusal::Infrared(payload.len()))?;
                self.air.announce(time(at.max(now)), frame);
            }
            Command::Statistics => {
                let collided = |member: &Member| member.robot.board.statistics().collided;
                let collided = self.members.iter().map(collided).sum();
                let (carried, lost) = self.air.counted();
                let robot = &mut self.member(robot)?.robot;
                let counted = robot.counted;
                robot.counted.turns.longest = 0;
                return Ok(Reply::Statistics(Box::new(RobotStatistics {
                    core: CoreStatistics {
                        instructions: 0,
                        cycles: robot.core.cycle() - counted.slept,
                        exceptions: counted.interrupts,
                        longest_masked: Duration::from_nanos(counted.waited.nanos()),
                        longest_turn: counted.turns.longest,
                    },
                    board: BoardStatistics::Kilobot(robot.board.statistics().into()),
                    air: AirStatistics { carried, collided, lost },
                })));
            }
            _ => return Err(CommandRefusal::OtherRobot("Kilobot").into()),
        }
        Ok(Reply::Ok)
    }
}

/// Returns `ppm` if it is possible: no oscillator of the chip is farther off than 10 %, even
/// uncalibrated (table 29-10 of the data sheet).
fn clock_error(ppm: f64) -> Result<f64, CommandRefusal> {
    const PPM_MAX: f64 = 100_000.0;
    if ppm.abs() <= PPM_MAX {
        Ok(ppm)
    } else {
        Err(CommandRefusal::ClockError { most: PPM_MAX, value: ppm })
    }
}

fn time(duration: Duration) -> Time {
    Time::from_nanos(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX))
}
