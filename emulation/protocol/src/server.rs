//! The command loop of an emulator program.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};
use std::path::Path;
use std::time::Duration;

use bittybuzz_chips::RADIO_MAX;

use crate::control::CommandRefusal;
use crate::door::{Door, PACKET};
use crate::message::{
    Command, EmulatorEvent, OutputLine, Reply, RobotEvent, TimedEvent, parse_command,
};
use crate::{FirmwareImageError, MachineError, Pause};

/// The period at which events are collected, in simulated time.
const POLL: Duration = Duration::from_millis(1);

/// The largest number of bytes in one read: the size of the largest memory, a Crazyflie's flash.
pub const READ_MAX: u32 = 1024 * 1024;

/// The robots that a program emulates, and the channel between them.
pub trait EmulatedRobots {
    /// Returns the number of robots.
    fn count(&self) -> usize;

    /// Turns all robots off, writes the image at `path` to their flash and turns them on.
    fn load(&mut self, path: &Path) -> Result<(), CommandError>;

    /// Runs all robots from one time to another, or until nothing more can happen to any of them.
    fn run(&mut self, from: Duration, until: Duration) -> Result<Pause, MachineError>;

    /// Returns the time before which no robot decides to transmit to robots of other programs,
    /// unless a command or a packet wakes it before; `now` if that is not known.
    fn silent_until(&self, now: Duration) -> Duration {
        now
    }

    /// Returns a robot's events since the last call, in order; `now` is the current time.
    fn take_events(&mut self, robot: usize, now: Duration)
    -> Result<Vec<TimedEvent>, MachineError>;

    /// Executes a command for a robot at time `now`, after an image was loaded. The commands
    /// `load`, `run` and `quit` are handled by the caller.
    fn execute(
        &mut self,
        robot: usize,
        command: Command,
        now: Duration,
    ) -> Result<Reply, CommandError>;
}

/// A reason why a command was not executed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// The line is not JSON, or not one of the commands.
    #[error("not a command: {0}; docs/emulation.md lists them")]
    Unknown(serde_json::Error),
    /// No image is loaded.
    #[error("nothing is loaded: send {{\"command\":\"load\",\"elf\":PATH}} first")]
    NotLoaded,
    /// The read is longer than the limit.
    #[error("read at most {READ_MAX} bytes at once, not {0}")]
    ReadTooLong(u32),
    /// A door cannot be opened.
    #[error("no door can be opened at port {port}: {error}; choose another port")]
    Door {
        /// The port.
        port: u16,
        /// The system's reason.
        error: io::Error,
    },
    /// The robot has a door already.
    #[error("robot {robot} has a door at port {port} already, and a robot has only one")]
    SecondDoor {
        /// The number of the robot.
        robot: usize,
        /// The port of its door.
        port: u16,
    },
    /// The port is 0, which is none.
    #[error("a door needs a port, 1 to 65535; cflib looks for robots at 19850 to 19859")]
    DoorAtPort0,
    /// The payload is too long for a radio packet.
    #[error("a packet has at most {RADIO_MAX} bytes, this one has {0}")]
    PacketTooLong(usize),
    /// No robot has this number.
    #[error("there is no robot {robot}: this program plays {robots}, counted from 0")]
    NoRobot {
        /// The number in the command.
        robot: usize,
        /// The number of robots.
        robots: usize,
    },
    /// The robot refused the command.
    #[error(transparent)]
    Refused(#[from] CommandRefusal),
    /// The image cannot be loaded.
    #[error(transparent)]
    Image(#[from] FirmwareImageError),
    /// The emulation failed.
    #[error(transparent)]
    Machine(#[from] MachineError),
}

/// Runs the command loop: reads commands from `input`, one JSON object per line, and writes events
/// and replies to `output`, until `quit` or the end of the input. Returns only errors of the two
/// streams.
pub fn serve_robots(
    robots: &mut impl EmulatedRobots,
    input: impl BufRead,
    output: impl Write,
) -> io::Result<()> {
    let mut server = Server { robots, output, now: None, doors: BTreeMap::new() };
    for line in input.split(b'\n') {
        let line = line?;
        if line.trim_ascii().is_empty() {
            continue;
        }
        let reply = match parse_command(&line) {
            Ok((_, Command::Quit)) => {
                server.print(&OutputLine::Reply(Reply::Ok))?;
                return server.output.flush();
            }
            Ok((_, Command::Run { until })) => server.run(until)?,
            Ok((robot, command)) => server.execute(robot, command),
            Err(error) => Err(CommandError::Unknown(error)),
        };
        let reply = reply.unwrap_or_else(|error| Reply::Error { message: error.to_string() });
        server.print(&OutputLine::Reply(reply))?;
        server.output.flush()?;
    }
    Ok(())
}

struct Server<'a, R, W> {
    robots: &'a mut R,
    output: W,
    /// `None` before an image is loaded.
    now: Option<Duration>,
    /// Doors for ground stations, by the numbers of the robots.
    doors: BTreeMap<usize, Door>,
}

impl<R: EmulatedRobots, W: Write> Server<'_, R, W> {
    fn print(&mut self, output: &OutputLine) -> io::Result<()> {
        serde_json::to_writer(&mut self.output, output)?;
        self.output.write_all(b"\n")
    }

    fn execute(&mut self, robot: usize, command: Command) -> Result<Reply, CommandError> {
        if let Command::Load { elf } = command {
            self.now = None;
            self.doors.clear();
            self.robots.load(&elf)?;
            self.now = Some(Duration::ZERO);
            return Ok(Reply::Ok);
        }
        let now = self.now.ok_or(CommandError::NotLoaded)?;
        let robots = self.robots.count();
        if robot >= robots {
            return Err(CommandError::NoRobot { robot, robots });
        }
        if let Command::Door { port } = command {
            // The robot may refuse packets of a ground station.
            self.robots.execute(robot, Command::Door { port }, now)?;
            if let Some(door) = self.doors.get(&robot) {
                return Err(CommandError::SecondDoor { robot, port: door.port() });
            }
            if port == 0 {
                return Err(CommandError::DoorAtPort0);
            }
            let door = Door::open(port).map_err(|error| CommandError::Door { port, error })?;
            self.doors.insert(robot, door);
            return Ok(Reply::Ok);
        }
        self.robots.execute(robot, command, now)
    }

    /// Passes a packet through each door to its robot.
    fn let_in(&mut self, now: Duration) -> Result<(), CommandError> {
        for (robot, door) in &mut self.doors {
            if let Some(payload) = door.poll() {
                self.robots.execute(*robot, Command::Send { kind: PACKET, payload }, now)?;
            }
        }
        Ok(())
    }

    /// Runs in slices, so that events are printed soon after they happen.
    fn run(&mut self, until: Duration) -> io::Result<Result<Reply, CommandError>> {
        let Some(mut now) = self.now else {
            return Ok(Err(CommandError::NotLoaded));
        };
        let mut reason = Pause::Time;
        while now < until && reason == Pause::Time {
            let slice = (now + POLL).min(until);
            if let Err(error) = self.let_in(now) {
                return Ok(Err(error));
            }
            match self.robots.run(now, slice) {
                Ok(pause) => reason = pause,
                Err(error) => return Ok(Err(error.into())),
            }
            now = slice;
            self.now = Some(now);
            let mut is_news = false;
            for robot in 0..self.robots.count() {
                let events = match self.robots.take_events(robot, now) {
                    Ok(events) => events,
                    Err(error) => return Ok(Err(error.into())),
                };
                is_news |= !events.is_empty();
                for timed in events {
                    if let Some(door) = self.doors.get(&robot)
                        && let EmulatorEvent::Syslink { kind: PACKET, payload, intact: true } =
                            &timed.event
                    {
                        door.send(payload);
                    }
                    self.print(&OutputLine::Event(RobotEvent { robot, timed }))?;
                }
            }
            if is_news {
                // Flush at once: a client may observe the robots live.
                self.output.flush()?;
            }
        }
        // A packet through a door may wake a robot at any time.
        let silent_until =
            if self.doors.is_empty() { self.robots.silent_until(now).max(now) } else { now };
        Ok(Ok(Reply::Paused { at: now, reason, silent_until }))
    }
}
