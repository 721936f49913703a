//! The loop of an emulator program.

use std::io::{self, BufRead, Write};
use std::path::Path;
use std::time::Duration;

use bittybuzz_chips::RADIO_MAX;

use crate::control::Refusal;
use crate::fleet::Fleet;
use crate::message::{Command, Output, Reply, RobotEvent, TimedEvent, parse_command};
use crate::{Core, ImageError, MachineError, Pause};

/// The period at which events are collected, in the robots' time.
const POLL: Duration = Duration::from_millis(1);

/// More than the largest memory there is.
pub const LONGEST_READ: u32 = 1024 * 1024;

/// The robots that a program plays, and the air between them.
pub trait Robots {
    /// Returns the number of robots.
    fn count(&self) -> usize;

    /// Turns the power of all off, writes the image at `path` and turns the power on.
    fn load(&mut self, path: &Path) -> Result<(), CommandError>;

    /// Runs all from one time to another, or until nothing can happen to any any more.
    fn run(&mut self, from: Duration, until: Duration) -> Result<Pause, MachineError>;

    /// Returns the events on a robot since the last call, in order. It is `now`.
    fn take_events(&mut self, robot: usize, now: Duration)
    -> Result<Vec<TimedEvent>, MachineError>;

    /// Executes a command for a robot, once something is loaded: all but `load`, `run` and `quit`.
    /// It is `now`.
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
    /// Not JSON, or not one of the commands.
    #[error("not a command: {0}; docs/emulation.md lists them")]
    Unknown(serde_json::Error),
    /// There is no program to run.
    #[error("nothing is loaded: send {{\"command\":\"load\",\"elf\":PATH}} first")]
    NotLoaded,
    /// Too much at once.
    #[error("read at most {LONGEST_READ} bytes at once, not {0}")]
    ReadTooLong(u32),
    /// Too much for the radio.
    #[error("a packet has at most {RADIO_MAX} bytes, this one has {0}")]
    PacketTooLong(usize),
    /// A number beyond those of the robots.
    #[error("there is no robot {robot}: this program plays {robots}, counted from 0")]
    NoRobot {
        /// The number.
        robot: usize,
        /// The number of robots.
        robots: usize,
    },
    /// The robot does not obey.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The image cannot be used.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The emulation failed.
    #[error(transparent)]
    Machine(#[from] MachineError),
}

/// Drives `count` robots with this core, which hear each other's radio; see [`serve_robots`].
pub fn serve<C: Core>(count: usize, input: impl BufRead, output: impl Write) -> io::Result<()> {
    serve_robots(&mut Fleet::<C>::new(count), input, output)
}

/// Drives robots. Reads commands from `input`, one JSON object per line, and writes events and replies to `output`, until
/// `quit` or the end of the input. Errors are those of the two streams only.
pub fn serve_robots(
    robots: &mut impl Robots,
    input: impl BufRead,
    output: impl Write,
) -> io::Result<()> {
    let mut server = Server { robots, output, now: None };
    for line in input.split(b'\n') {
        let line = line?;
        if line.trim_ascii().is_empty() {
            continue;
        }
        let reply = match parse_command(&line) {
            Ok((_, Command::Quit)) => {
                server.print(&Output::Reply(Reply::Ok))?;
                return server.output.flush();
            }
            Ok((_, Command::Run { until })) => server.run(until)?,
            Ok((robot, command)) => server.execute(robot, command),
            Err(error) => Err(CommandError::Unknown(error)),
        };
        let reply = reply.unwrap_or_else(|error| Reply::Error { message: error.to_string() });
        server.print(&Output::Reply(reply))?;
        server.output.flush()?;
    }
    Ok(())
}

struct Server<'a, R, W> {
    robots: &'a mut R,
    output: W,
    /// None before something is loaded.
    now: Option<Duration>,
}

impl<R: Robots, W: Write> Server<'_, R, W> {
    fn print(&mut self, output: &Output) -> io::Result<()> {
        serde_json::to_writer(&mut self.output, output)?;
        self.output.write_all(b"\n")
    }

    fn execute(&mut self, robot: usize, command: Command) -> Result<Reply, CommandError> {
        if let Command::Load { elf } = command {
            self.now = None;
            self.robots.load(&elf)?;
            self.now = Some(Duration::ZERO);
            return Ok(Reply::Ok);
        }
        let now = self.now.ok_or(CommandError::NotLoaded)?;
        let robots = self.robots.count();
        if robot >= robots {
            return Err(CommandError::NoRobot { robot, robots });
        }
        self.robots.execute(robot, command, now)
    }

    /// Runs in slices, so that events are printed as they come.
    fn run(&mut self, until: Duration) -> io::Result<Result<Reply, CommandError>> {
        let Some(mut now) = self.now else {
            return Ok(Err(CommandError::NotLoaded));
        };
        let mut reason = Pause::Time;
        while now < until && reason == Pause::Time {
            let slice = (now + POLL).min(until);
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
                    self.print(&Output::Event(RobotEvent { robot, timed }))?;
                }
            }
            if is_news {
                // The observer wants to see them now.
                self.output.flush()?;
            }
        }
        Ok(Ok(Reply::Paused { at: now, reason }))
    }
}
