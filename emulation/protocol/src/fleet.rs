//! Emulated robots that run in turns and exchange radio packets.

use std::collections::BTreeSet;
use std::io::{self, BufRead, Write};
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use bittybuzz_chips::{Air, Board, LOOKAHEAD, PacketSource, RADIO_MAX, Time, Width};

use crate::control::{CommandRefusal, probability};
use crate::message::{Command, EmulatorEvent, Reply, RobotStatistics, TimedEvent};
use crate::rtt::Rtt;
use crate::server::{CommandError, EmulatedRobots, READ_MAX, serve_robots};
use crate::{Control, Core, EmulatedRobot, FirmwareImage, MachineError, Pause};

/// Address range of the one-time programmable area, system memory and unique id. The board answers
/// reads there, and they have no side effect.
const IDENTITY: Range<u32> = 0x1fff_7000..0x2000_0000;

/// Runs the command loop for `count` robots with this core, which receive each other's radio
/// packets; see [`serve_robots`].
pub fn serve<C: Core>(count: usize, input: impl BufRead, output: impl Write) -> io::Result<()> {
    serve_robots(&mut Fleet::<C>::new(count), input, output)
}

/// The program's robots, and the channel between them.
struct Fleet<C> {
    count: usize,
    /// Empty before an image is loaded.
    members: Vec<EmulatedRobot<C>>,
    air: Air,
    loaded: Option<(FirmwareImage, Option<Rtt>)>,
    /// Numbers of the robots without an attached debug probe, whose log is not read.
    unread: BTreeSet<usize>,
}

impl<C> Fleet<C> {
    pub fn new(count: usize) -> Self {
        let (members, unread) = (Vec::new(), BTreeSet::new());
        Fleet { count, members, air: Air::new(), loaded: None, unread }
    }
}

impl<C: Core> EmulatedRobots for Fleet<C> {
    fn count(&self) -> usize {
        self.count
    }

    fn load(&mut self, path: &Path) -> Result<(), CommandError> {
        let image = FirmwareImage::open(path)?;
        self.loaded = None;
        self.air = Air::new();
        self.unread.clear();
        self.members.clear();
        for number in 0..self.count {
            self.members.push(EmulatedRobot::load(number, &image)?);
        }
        let rtt = Rtt::new(&image);
        self.loaded = Some((image, rtt));
        Ok(())
    }

    fn execute(
        &mut self,
        robot: usize,
        command: Command,
        now: Duration,
    ) -> Result<Reply, CommandError> {
        let robots = self.members.len();
        let member = self.members.get_mut(robot).ok_or(CommandError::NoRobot { robot, robots })?;
        match command {
            Command::Write { address, bytes } => member.write_memory(address, &bytes)?,
            Command::Read { address, length } => {
                if length > READ_MAX {
                    return Err(CommandError::ReadTooLong(length));
                }
                let mut bytes = vec![0; length as usize];
                let end = address.saturating_add(length);
                if IDENTITY.contains(&address) && end <= IDENTITY.end {
                    let board = member.board();
                    for (address, byte) in (address..end).zip(&mut bytes) {
                        *byte = board.read(address, Width::Byte) as u8;
                    }
                } else {
                    member.read_memory(address, &mut bytes)?;
                }
                return Ok(Reply::Bytes { bytes });
            }
            Command::Skip { symbol } => {
                let (image, _) = self.loaded.as_ref().ok_or(CommandError::NotLoaded)?;
                member.skip(image.function(&symbol)?)?;
            }
            Command::Halt { halted } => member.halt(halted),
            Command::Probe { attached: true } => {
                self.unread.remove(&robot);
            }
            Command::Probe { attached: false } => {
                let (_, rtt) = self.loaded.as_ref().ok_or(CommandError::NotLoaded)?;
                if let Some(rtt) = rtt {
                    rtt.block(member)?;
                }
                self.unread.insert(robot);
            }
            Command::Power { on } => {
                member.board().execute(command)?;
                self.air.set_power(robot, on);
            }
            Command::Deaf { ref to } => {
                if let Some(stranger) = to.iter().find(|number| **number >= robots) {
                    return Err(CommandError::NoRobot { robot: *stranger, robots });
                }
                let from = to.clone();
                member.board().execute(command)?;
                self.air.cut_off(robot, from);
            }
            Command::Air { lose, seed } => self.air.lose(probability(lose)?, seed),
            Command::Radio { at, payload } => {
                if payload.len() > RADIO_MAX {
                    return Err(CommandError::PacketTooLong(payload.len()));
                }
                let begin = time(at.max(now));
                let packet = member.board().packet_of(&payload, begin);
                let packet = packet.ok_or(CommandRefusal::OtherRobot(C::Board::NAME))?;
                self.air.add(PacketSource::Stranger, packet);
            }
            Command::Statistics => {
                return Ok(Reply::Statistics(Box::new(RobotStatistics {
                    core: member.statistics(),
                    board: member.board().counted(),
                    air: self.air.statistics.into(),
                })));
            }
            command => member.board().execute(command)?,
        }
        Ok(Reply::Ok)
    }

    fn silent_until(&self, now: Duration) -> Duration {
        self.members.iter().map(EmulatedRobot::silent_until).min().unwrap_or(now)
    }

    fn take_events(
        &mut self,
        robot: usize,
        now: Duration,
    ) -> Result<Vec<TimedEvent>, MachineError> {
        let member =
            self.members.get_mut(robot).expect("the server asks for each of `count` robots");
        let mut events = member.take_events();
        if let Some((_, Some(rtt))) = &self.loaded
            && !self.unread.contains(&robot)
        {
            let bytes = rtt.poll(member)?;
            if !bytes.is_empty() {
                events.push(TimedEvent { at: now, event: EmulatorEvent::Rtt { bytes } });
            }
        }
        Ok(events)
    }

    /// Runs all robots until `until`, or until nothing can happen to any of them.
    ///
    /// The robots run one after another, in turns short enough that a packet reaches every receiver
    /// in time. A radio announces a packet [`LOOKAHEAD`] before its first bit, and a robot that
    /// sleeps cannot announce one before it wakes; so a turn may end [`LOOKAHEAD`] after the
    /// earliest wake-up. A robot that sleeps through a whole turn is skipped.
    fn run(&mut self, from: Duration, until: Duration) -> Result<Pause, MachineError> {
        let robots = self.members.len();
        let mut now = from;
        while now < until {
            let mut quiet = until;
            if robots > 1 {
                for member in &mut self.members {
                    quiet = quiet.min(member.quiet_until());
                }
            }
            let turn = (quiet.max(now) + duration(LOOKAHEAD)).min(until);
            let members = &mut *self.members;
            self.air
                .carry(time(turn), robots, |robot, event| members[robot].board().receive(event));
            let mut reason = None;
            for (number, member) in self.members.iter_mut().enumerate() {
                // In the last turn no robot is skipped, so that all end at the same time.
                if turn < until && member.quiet_until() > turn {
                    continue;
                }
                let pause = member.run(turn)?;
                reason = Some(if reason.is_none_or(|other| other == pause) {
                    pause
                } else {
                    Pause::Time
                });
                for transmission in member.board().take_transmissions() {
                    self.air.add(PacketSource::Robot(number), transmission);
                }
            }
            now = turn;
            if now == until
                && let Some(reason) = reason
            {
                return Ok(reason);
            }
        }
        Ok(Pause::Time)
    }
}

fn time(duration: Duration) -> Time {
    Time::from_nanos(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX))
}

fn duration(time: Time) -> Duration {
    Duration::from_nanos(time.nanos())
}
